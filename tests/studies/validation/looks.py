"""What lasts of the errors of films' observables, and whether filming the fitted flag corrects it.

**Registered** before its films were read (seed, sizes and the rule are this file's). `LOOKS` cloths
over the priors of `flagdata calibrate` but for damping (4 to 40 ms, for speed) are simulated on 20
columns in two winds of von Kármán's spectrum each, at 4 to 8 m/s, and filmed twice by the raster
renderer: cloth, colours (flags, weaves, stripes, prints), background (sky, hills, foliage,
buildings) and view are a look's own, wind, light and the camera's noise the film's. Pixels less
geometry of the same windows is the error. Its variance is split by the analysis of variance into
what is common to both films of a look, what is common to the windows of one film, and what passes.
The same is done with the two windows each of the films by VTK of
`docs/results/validate-observables.json`, in which look and film are one.

*Filmed once more.* A flag as a fit might leave it (weight ± 6 %, bending and damping by a factor of
e^0.5, another fabric, the view ± 5° and ± 3°, 12 columns, other turbulence) is drawn in the film's
own colours before the film's own background, and read in the same way; its mean error is taken off.
The first attempt takes it off whole; the second by a factor for each observable, from 0 to 1, by
least squares on the raster renderer's films. Both are judged on films of
other looks by Cycles: the correction is used if the mean over the observables of the logarithm of
the variance of the films' mean errors, after over before, is below 0 by twice its standard error
(jackknife over films).

`python -m tests.studies looks`; films that were read are kept in FLAGDATA_LOOKS, by default a new
folder, and a run that was stopped goes on. FLAGDATA_LOOKS_COUNT takes fewer looks,
FLAGDATA_LOOKS_CYCLES fewer films by Cycles, "0" none.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import numpy as np
from torch import Tensor

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import child_seed, stream
from measure.cloth import CLOTH, COLUMNS, NUISANCES, OBSERVED, Flag, FlagBatch, draws
from measure.cloth.flag_prior import FABRIC
from measure.observables import OBSERVABLES
from sim.assets import Assets
from sim.cloth.mesh import Mesh
from sim.render import Cycles, Meshes, Raster, RenderParameters
from tests.studies.validation.looks_films import RATE, Filmed, Place, edges_of, filmed, look
from tests.studies.validation.looks_refilmed import Look, refilmed
from tests.studies.validation.loop_on_films import log

SEED = 20261128
LOOKS = 12
FILMS = 2
"""Of a look."""
SECONDS = 10.0
"""Of a film [s]."""
AGAIN = 5.0
"""Of the film of a fitted flag [s]."""
BY_CYCLES = 8
"""Films by Cycles, of other looks."""
CYCLES_SECONDS = 5.0
"""Of each [s]."""
FLAG = Flag(length=1.5, height=1.0)
SIGMA = np.array([OBSERVABLES[name].sigma for name in OBSERVED])
_WINDS = ((4.0, 6.2), (5.0, 7.8))
"""Means of the winds of a look's films, for even and odd looks [m/s]."""
_FEWEST = 4
"""Films of a renderer below which nothing is reported of it."""
_FINE = 20
"""Columns of the mesh of flags that are filmed."""
_VTK = Path(__file__).resolve().parents[3] / "docs" / "results" / "validate-observables.json"

Render = Callable[[Meshes, RenderParameters], Tensor]


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Film and read all. The design has its own seed."""
    del seed
    folder = Path(os.environ.get("FLAGDATA_LOOKS") or mkdtemp(prefix="looks-"))
    folder.mkdir(parents=True, exist_ok=True)
    looks = int(os.environ.get("FLAGDATA_LOOKS_COUNT", str(LOOKS)))
    others = int(os.environ.get("FLAGDATA_LOOKS_CYCLES", str(BY_CYCLES)))
    own = rows(range(looks), folder, Raster().render, "raster", seconds=SECONDS, films=FILMS)
    by_cycles: list[dict[str, Any]] = []
    if others:
        with Cycles(Assets()) as cycles:
            chosen = range(1000, 1000 + others)
            by_cycles = rows(
                chosen, folder, cycles.render, "cycles", seconds=CYCLES_SECONDS, films=1
            )
    sheet = summary(own, by_cycles, json.loads(_VTK.read_text(encoding="utf-8"))["result"]["films"])
    (out / "validate-looks.md").write_text(page(sheet), encoding="utf-8")
    return sheet


def rows(
    numbers: Sequence[int], folder: Path, render: Render, name: str, *, seconds: float, films: int
) -> list[dict[str, Any]]:
    """Of each film of some looks its windows' errors, and those of the fitted flag; refused ones
    are left out."""
    found = []
    for number in numbers:
        for film in range(films):
            path = folder / f"{name}-{number}-{film}.json"
            if not path.exists():
                path.write_text(json.dumps(one(number, film, render, seconds)), encoding="utf-8")
            found.append(json.loads(path.read_text(encoding="utf-8")))
    return found


def one(number: int, film: int, render: Render, seconds: float) -> dict[str, Any]:
    """A film of a look, read against its geometry, and the film of a fitted flag likewise; NaN as
    None."""
    seed = child_seed(SEED, "look", number)
    place = Place.drawn(stream(seed, "place"))
    zeta = look(seed, light=child_seed(seed, "light", film))
    mesh, coarse = FLAG.mesh(_FINE), FLAG.mesh(COLUMNS)
    wind = _WINDS[number % 2][film]
    truth, fitted = cloths(seed, film)
    positions = moved(truth, wind, mesh, seconds, child_seed(seed, "run", film))
    hoist, _ = edges_of(mesh.rest)
    zeta = place.put(zeta, positions, int(hoist[0]), FLAG.length)
    shown = filmed(
        positions, mesh, FLAG, zeta, render=render, seed=child_seed(seed, "camera", film)
    )
    row: dict[str, Any] = {
        "look": number,
        "film": film,
        "wind": wind,
        "texture": zeta.texture.partition("/")[0],
        "background": zeta.background.partition("/")[0],
        "azimuth": math.degrees(place.azimuth),
        "errors": None,
        "again": None,
    }
    if shown is None:
        return row
    again = moved(fitted, wind, coarse, AGAIN, child_seed(seed, "again", film))
    rng = stream(seed, "fitted place", film)
    near = replace(
        place,
        azimuth=place.azimuth + math.radians(5.0) * rng.standard_normal(),
        elevation=place.elevation + math.radians(3.0) * rng.standard_normal(),
    )
    once = refilmed(Look.of(shown), again, coarse, FLAG, near, seed=seed)
    return {**row, "errors": _errors(shown), "again": None if once is None else _errors(once)}


def cloths(seed: int, film: int) -> tuple[dict[str, float], dict[str, float]]:
    """A look's cloth, and the cloth that a fit to one of its films might find."""
    (drawn,) = (draws((*CLOTH, *FABRIC, *NUISANCES), 1, seed=seed, name="look"),)
    truth = {name: float(own[0]) for name, own in drawn.items()}
    truth |= {"gain": 1.0, "scale": 1.0, "distance_constant": 3.0}
    truth["damping"] = 0.004 * 10 ** stream(seed, "damping").random()
    rng = stream(seed, "fitted", film)
    fitted = truth | {
        "area_weight": truth["area_weight"] * math.exp(0.06 * rng.standard_normal()),
        "bending": truth["bending"] * math.exp(0.5 * rng.standard_normal()),
        "damping": float(
            np.clip(truth["damping"] * math.exp(0.5 * rng.standard_normal()), 0.004, 0.08)
        ),
        "fabric": float(rng.random()),
    }
    return truth, fitted


def moved(
    cloth: Mapping[str, float], wind: float, mesh: Mesh, seconds: float, seed: int
) -> FloatArray:
    """(frame, vertex, 3) [m] of a cloth in a wind of a mean [m/s], with a frame beyond the last
    window."""
    batch = FlagBatch(
        flag=FLAG,
        log=log(wind),
        duration=30.0,
        values={name: np.array([value]) for name, value in cloth.items()},
        places=np.zeros((1, 1, 3)),
        seeds=(seed,),
        until=seconds + 1 / RATE,
    )
    return batch.positions(mesh, rate=RATE)[..., 0]


def _errors(film: Filmed) -> list[list[float | None]]:
    apart = film.pixels - film.geometry
    return [[None if math.isnan(value) else value for value in row] for row in apart.tolist()]


def arrays(some: Sequence[Mapping[str, Any]], key: str) -> list[FloatArray]:
    """(window, observable) of each film that has them; NaN where a window shows nothing."""
    return [np.array(row[key], dtype=np.float64) for row in some if row[key] is not None]


def vtk(films: Sequence[Mapping[str, Any]]) -> list[FloatArray]:
    """Errors of the films by VTK, the product's bias taken off; films of one window among them."""
    found = []
    for row in films:
        own = [
            [
                math.nan
                if None in (window["values"][name]["pixels"], window["values"][name]["geometry"])
                else window["values"][name]["pixels"]
                - window["values"][name]["geometry"]
                - OBSERVABLES[name].bias
                for name in OBSERVED
            ]
            for window in row["windows"]
            if window is not None
        ]
        if own:
            found.append(np.array(own))
    return found


def split(films: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """(observable,) variance of what lasts in a film and of what passes: analysis of variance of
    unequal groups."""
    lasting, passing = np.full(len(OBSERVED), np.nan), np.full(len(OBSERVED), np.nan)
    for k in range(len(OBSERVED)):
        groups = [own[np.isfinite(own[:, k]), k] for own in films]
        groups = [own for own in groups if len(own)]
        sizes = np.array([len(own) for own in groups], dtype=np.float64)
        total, count = sizes.sum(), len(groups)
        means = np.array([own.mean() for own in groups])
        within = sum(float(np.square(own - own.mean()).sum()) for own in groups) / (total - count)
        between = float((sizes * np.square(means - (sizes * means).sum() / total)).sum()) / (
            count - 1
        )
        lasting[k] = (between - within) / ((total - np.square(sizes).sum() / total) / (count - 1))
        passing[k] = within
    return lasting, passing


def _means(films: Sequence[FloatArray]) -> FloatArray:
    """(observable,) mean over films of their mean errors."""
    each = [[own[np.isfinite(own[:, k]), k] for own in films] for k in range(len(OBSERVED))]
    return np.array([float(np.mean([own.mean() for own in some if len(own)])) for some in each])


def share(films: Sequence[FloatArray]) -> FloatArray:
    """(observable,) share of the variance that lasts, 0 at least."""
    lasting, passing = split(films)
    return np.maximum(lasting, 0.0) / (np.maximum(lasting, 0.0) + passing)


def interval(
    films: Sequence[Any], statistic: Callable[[Sequence[Any]], FloatArray], seed: int
) -> FloatArray:
    """(2, …) 90 % by a bootstrap of films or looks."""
    rng = stream(seed, "looks", "bootstrap")
    drawn = [
        statistic([films[k] for k in rng.integers(len(films), size=len(films))]) for _ in range(400)
    ]
    return np.nanquantile(drawn, (0.05, 0.95), axis=0)


def common(some: Sequence[Mapping[str, Any]]) -> FloatArray:
    """(observable,) share of what lasts in a film that is common to both films of its look: their
    covariance over the variance of what lasts, clipped to 0 to 1."""
    pairs = paired(some)
    away = pairs - pairs.mean(axis=(0, 1))
    together = (away[:, 0] * away[:, 1]).sum(axis=0) / (len(pairs) - 0.5)
    lasting, _ = split(arrays(some, "errors"))
    return np.clip(together / np.maximum(lasting, 1e-12), 0.0, 1.0)


def common_of_all(some: Sequence[Mapping[str, Any]]) -> float:
    """The same of all observables together: the sum of the covariances over the sum of the
    variances of what lasts, each in units of the observable's sigma."""
    pairs = paired(some) / SIGMA
    away = pairs - pairs.mean(axis=(0, 1))
    together = (away[:, 0] * away[:, 1]).sum(axis=0) / (len(pairs) - 0.5)
    lasting, _ = split([one / SIGMA for one in arrays(some, "errors")])
    return float(together.sum() / np.maximum(lasting, 0.0).sum())


def paired(some: Sequence[Mapping[str, Any]]) -> FloatArray:
    """(look, 2, observable) mean errors of the films of looks, both of which show all."""
    means = {}
    for row in some:
        if (
            row["errors"] is not None
            and np.isfinite(own := np.array(row["errors"], float)).any(axis=0).all()
        ):
            means[row["look"], row["film"]] = np.nanmean(own, axis=0)
    both = sorted({number for number, _ in means if (number, 0) in means and (number, 1) in means})
    return np.array([[means[number, 0], means[number, 1]] for number in both])


def of_looks(some: Sequence[Mapping[str, Any]], statistic: Callable[[Sequence[Any]], Any]) -> Any:
    """(2, …) 90 % of a statistic of films by a bootstrap of looks."""
    groups: dict[int, list[Mapping[str, Any]]] = {}
    for row in some:
        groups.setdefault(row["look"], []).append(row)
    each = list(groups.values())

    def of(chosen: Sequence[Any]) -> Any:
        again = [{**row, "look": number} for number, own in enumerate(chosen) for row in own]
        return statistic(again)

    return interval(each, of, SEED)


def correlated(films: Sequence[FloatArray]) -> FloatArray:
    """(observable, observable) correlation of films' mean errors."""
    means = np.array(
        [np.nanmean(own, axis=0) for own in films if np.isfinite(own).any(axis=0).all()]
    )
    return np.corrcoef(means.T)


def means_of(some: Sequence[Mapping[str, Any]]) -> tuple[FloatArray, FloatArray]:
    """(film, observable) mean errors of films and of their fitted flags', of those that show all in
    both."""
    errors, again = [], []
    for row in some:
        if row["errors"] is None or row["again"] is None:
            continue
        own, other = (np.array(row[key], float) for key in ("errors", "again"))
        if all(np.isfinite(one).any(axis=0).all() for one in (own, other)):
            errors.append(np.nanmean(own, axis=0))
            again.append(np.nanmean(other, axis=0))
    return np.array(errors), np.array(again)


def factors(errors: FloatArray, again: FloatArray) -> FloatArray:
    """(observable,) by which the fitted flag's errors predict a film's, 0 to 1."""
    x, y = again - again.mean(axis=0), errors - errors.mean(axis=0)
    return np.clip((x * y).sum(axis=0) / np.square(x).sum(axis=0), 0.0, 1.0)


def judged(errors: FloatArray, again: FloatArray, factor: FloatArray) -> dict[str, Any]:
    """Variance of mean errors after over before, by observable, and the mean of its logarithm with
    its error."""

    def ratio(which: Sequence[int]) -> FloatArray:
        own = list(which)
        return (errors[own] - factor * again[own]).var(axis=0, ddof=1) / errors[own].var(
            axis=0, ddof=1
        )

    count = len(errors)
    left = np.array(
        [np.log(ratio([k for k in range(count) if k != one])).mean() for one in range(count)]
    )
    return {
        "films": count,
        "ratio": ratio(range(count)).tolist(),
        "mean_log": float(np.log(ratio(range(count))).mean()),
        "error": float(math.sqrt((count - 1) / count * np.square(left - left.mean()).sum())),
        "correlation": [
            float(np.corrcoef(errors[:, k], again[:, k])[0, 1]) for k in range(len(OBSERVED))
        ],
    }


def summary(
    own: Sequence[Mapping[str, Any]],
    by_cycles: Sequence[Mapping[str, Any]],
    by_vtk: Sequence[Mapping[str, Any]],
) -> dict[str, Any]:
    """All that is reported."""
    found: dict[str, Any] = {"observables": list(OBSERVED), "shares": {}}
    sources = {
        "raster": arrays(own, "errors"),
        "VTK": vtk(by_vtk),
        "Cycles": arrays(by_cycles, "errors"),
    }
    for name, films in sources.items():
        films = [one for one in films if np.isfinite(one).any()]
        if len(films) < _FEWEST:
            continue
        lasting, passing = split(films)
        ends = interval(films, share, SEED)
        found["shares"][name] = {
            "films": len(films),
            "mean": _means(films).tolist(),
            "lasting": np.sqrt(np.maximum(lasting, 0)).tolist(),
            "passing": np.sqrt(passing).tolist(),
            "share": share(films).tolist(),
            "interval": ends.T.tolist(),
            "correlation": correlated(films).tolist(),
        }
    found["common"] = common(own).tolist()
    found["common_of_all"] = [common_of_all(own), *of_looks(own, common_of_all).tolist()]
    errors, again = means_of(own)
    by_least_squares = factors(errors, again)
    found["factors"] = by_least_squares.tolist()
    ones = np.ones(len(OBSERVED))
    found["corrected"] = {
        "raster, whole": judged(errors, again, ones),
        "raster, by factors": judged(errors, again, by_least_squares),
    }
    if len(by_cycles) >= _FEWEST:
        errors, again = means_of(by_cycles)
        found["corrected"] |= {
            "Cycles, whole": judged(errors, again, ones),
            "Cycles, by factors": judged(errors, again, by_least_squares),
        }
    return {**found, "films": [*own, *by_cycles]}


def page(sheet: Mapping[str, Any]) -> str:
    """The figures for people."""
    lines = [
        "# Looks: what lasts of the errors of films' observables",
        "",
        (
            "Pixels less geometry, less the bias, split into what lasts in a film and what passes from "
            "window to window."
        ),
        (
            "Standard deviations are in the observables' units, shares with 90 % by a bootstrap of "
            "films."
        ),
        "`python -m tests.studies looks` makes it.",
        "",
    ]
    for name, own in sheet["shares"].items():
        lines += [
            f"## Films by {name}",
            "",
            f"{own['films']} films.",
            "",
            *_shares(sheet["observables"], own),
            "",
        ]
    middle, low, high = sheet["common_of_all"]
    lines += [
        "## Two films of one look",
        "",
        (
            "The raster renderer's; each look was filmed in two winds and two lights: share of what "
            "lasts in a film that"
        ),
        (
            f"is common to both. Of all observables together it is {middle:.2f} (90 %: {low:.2f} to "
            f"{high:.2f})."
        ),
        "",
        _row(sheet["observables"]),
        _row(["---"] * len(sheet["observables"])),
        _row([f"{one:.2f}" for one in sheet["common"]]),
        "",
        "## A fitted flag filmed once, and its error taken off",
        "",
        (
            "Variance of films' mean errors, after over before, and the mean of its logarithm over the "
            "observables."
        ),
        (
            f"The factors are {', '.join(f'{one:.2f}' for one in sheet['factors'])}, of the raster "
            "renderer's films."
        ),
        "",
        _row(["films, taken off", "films", *sheet["observables"], "mean of the logarithm"]),
        _row(["---"] * (len(sheet["observables"]) + 3)),
    ]
    for name, own in sheet["corrected"].items():
        ratios = [f"{one:.2f}" for one in own["ratio"]]
        lines.append(
            _row([name, str(own["films"]), *ratios, f"{own['mean_log']:+.2f} ± {own['error']:.2f}"])
        )
    lines += ["", "Correlation of the fitted flag's mean error with the film's:", ""]
    lines += [
        _row(["films", *sheet["observables"]]),
        _row(["---"] * (len(sheet["observables"]) + 1)),
    ]
    for name, own in sheet["corrected"].items():
        if name.endswith("whole"):
            lines.append(
                _row([name.partition(",")[0], *(f"{one:+.2f}" for one in own["correlation"])])
            )
    return "\n".join(lines) + "\n"


def _shares(names: Sequence[str], own: Mapping[str, Any]) -> list[str]:
    lines = [
        _row(["observable", "mean", "lasts", "passes", "share that lasts", "90 %"]),
        _row(["---"] * 6),
    ]
    for k, name in enumerate(names):
        low, high = own["interval"][k]
        values = (own["mean"][k], own["lasting"][k], own["passing"][k])
        lines.append(
            _row(
                [
                    name,
                    *(f"{one:.3f}" for one in values),
                    f"{own['share'][k]:.2f}",
                    f"{low:.2f} to {high:.2f}",
                ]
            )
        )
    return lines


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"
