"""Winds of gusty films by window and their means, each window by itself and as one series: errors,
intervals, gusts.

Films of flags in gusts (`wind_series_films`) of a seed that the constants in the model's card are
not from (`tests.studies.series_errors`) are measured as `flagdata measure` does, their flags' sizes
given, with and without the weight of the cloth. Each is measured twice: by the model without its
constants, as before decision 080, and with them.

FLAGDATA_WIND_SERIES names the folder of the films, where those that are missing are made.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch

from flagdata.core.arrays import BoolArray, FloatArray
from flagdata.core.console import progress
from flagdata.core.rng import child_seed
from flagdata.core.stated import Stated
from flagdata.ingest.films.film_array import Frames
from measure.estimate import SERIES_KEY, Measurement, Options, measure, of_model
from measure.measuring_model import Network, gate_beside, network
from tests.studies.long_films import LongFilm
from tests.studies.series_errors import size_of
from tests.studies.validation.wind_series_films import made

FILMS = 16
LEVEL = 0.9
AIM = 0.6
"""m/s, RMSE of a window's wind."""
COVERED = (0.85, 0.95)
"""Share of intervals of 90 % that should contain the truth."""
WAYS = ("alone", "series")
WEIGHTS = ("open", "stated")


@dataclass(frozen=True, kw_only=True, eq=False)
class Read:
    """What a measurement says of one film, beside the truth.

    Attributes:
        refused: whether the gate refuses it.
        error: (k,) estimated less true wind of each window [m/s]; NaN where there is a bound alone.
        inside: (k,) whether the interval contains the truth.
        width: (k,) of the interval [m/s]; infinite where it has one end.
        mean_error, mean_inside, mean_width: the same of the film's mean wind.
        gusts: intensity, low and high; None where the windows are not one series.
        intensity: what was simulated.
    """

    refused: bool
    error: FloatArray
    inside: BoolArray
    width: FloatArray
    mean_error: float
    mean_inside: bool
    mean_width: float
    gusts: tuple[float, float, float] | None
    intensity: float


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Errors and intervals of films of a seed, each window alone and as one series."""
    torch.set_num_threads(1)
    folder = Path(os.environ.get("FLAGDATA_WIND_SERIES", out / "wind-series"))
    own = network(None, lake=None, at=None)
    card = {key: value for key, value in own.estimator.card.items() if key != SERIES_KEY}
    ways = {"alone": replace(own, estimator=replace(own.estimator, card=card)), "series": own}
    films = made(folder, own.estimator, count=FILMS, seed=seed)
    found: dict[tuple[str, str], list[Read]] = {
        (weight, way): [] for weight in WEIGHTS for way in WAYS
    }
    with progress(len(films), label="wind series", unit="film") as advance:
        for number, film in enumerate(films):
            for (weight, way), reads in found.items():
                of_film = child_seed(seed, "wind-series", number)
                reads.append(read(film, ways[way], stated=weight == "stated", seed=of_film))
            advance(1)
    sheet = {
        "model": own.estimator.name,
        "seed": seed,
        "films": len(films),
        "windows": len(films[0].winds),
        "constants": own.estimator.card.get(SERIES_KEY),
        "aims": {"rmse": AIM, "covered": list(COVERED)},
        "results": {f"{weight}, {way}": scores(reads) for (weight, way), reads in found.items()},
    }
    (out / "validate-wind-series.md").write_text(page(sheet), encoding="utf-8")
    return sheet


def read(film: LongFilm, model: Network, *, stated: bool, seed: int) -> Read:
    """Measures one film.

    Args:
        stated: whether the weight of the cloth is given.
    """
    images = film.windows.reshape(-1, *film.windows.shape[2:])
    options = Options(
        size=size_of(film),
        level=LEVEL,
        seed=seed,
        area_weight=Stated.of(film.parameters["area_weight"]) if stated else None,
    )
    found = measure(
        Frames(
            images=images,
            time=np.arange(len(images)) / model.estimator.front_end.rate,
            name=film.dataset,
        ),
        model.estimator,
        gate=gate_beside(model, false_alarm=options.false_alarm),
        dependence=of_model(model.estimator),
        options=options,
    )
    return beside_truth(found, film)


def beside_truth(found: Measurement, film: LongFilm) -> Read:
    """Compares a measurement with the winds that were simulated."""
    quantities = [window.quantity("wind_speed") for window in found.windows]
    length = len(film.windows[0]) / found.rate
    places = [round(window.start / length) for window in found.windows]
    truth = film.winds.mean(axis=1)
    true = truth[places]
    low, high = (np.array([getattr(q.span, end) for q in quantities]) for end in ("low", "high"))
    values = np.array([np.nan if q.value is None else q.value for q in quantities])
    (mean,) = (q for q in found.quantities if q.name == "wind_speed")
    return Read(
        refused=found.verdict.refused,
        error=values - true,
        inside=(low <= true) & (true <= high),
        width=high - low,
        mean_error=float("nan") if mean.value is None else mean.value - float(truth.mean()),
        mean_inside=bool(mean.span.low <= truth.mean() <= mean.span.high),
        mean_width=mean.span.high - mean.span.low,
        gusts=None
        if found.gusts is None
        else (found.gusts.intensity.value, *found.gusts.intensity.interval),
        intensity=film.parameters["gusts.intensity"],
    )


def scores(reads: Sequence[Read]) -> dict[str, Any]:
    """Errors, coverage and widths over films, and how the gusts' intensity was read."""
    error, inside, width = (
        np.concatenate([getattr(one, name) for one in reads])
        for name in ("error", "inside", "width")
    )
    valued, means = np.isfinite(error), np.array([one.mean_error for one in reads])
    within = np.concatenate(
        [one.error - one.error.mean() for one in reads if np.isfinite(one.error).all()]
    )
    gusts = [(one.gusts, one.intensity) for one in reads if one.gusts is not None]
    return {
        "refused": sum(one.refused for one in reads),
        "windows": len(error),
        "bounded": int((~valued).sum()),
        "rmse": _rms(error[valued]),
        "rmse_within_films": _rms(within),
        "covered": float(inside.mean()),
        "width": float(width[np.isfinite(width)].mean()),
        "mean_rmse": _rms(means[np.isfinite(means)]),
        "mean_covered": float(np.mean([one.mean_inside for one in reads])),
        "mean_width": float(
            np.mean([one.mean_width for one in reads if np.isfinite(one.mean_width)])
        ),
        "gusts": None
        if not gusts
        else {
            "films": len(gusts),
            "rmse": _rms(np.array([found[0] - true for found, true in gusts])),
            "covered": float(np.mean([found[1] <= true <= found[2] for found, true in gusts])),
            "width": float(np.mean([found[2] - found[1] for found, _ in gusts])),
        },
    }


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def page(sheet: Mapping[str, Any]) -> str:
    """The sheet in Markdown."""
    rows, gusts = [], []
    for name, of in sheet["results"].items():
        numbers = [f"{of[key]:.2f}" for key in ("rmse", "rmse_within_films", "width")]
        of_means = [
            f"{of['mean_rmse']:.2f}",
            f"{of['mean_covered']:.0%}",
            f"{of['mean_width']:.2f}",
        ]
        cells = [
            name,
            *numbers[:2],
            f"{of['covered']:.0%}",
            numbers[2],
            *of_means,
            str(of["bounded"]),
        ]
        rows.append(f"| {' | '.join(cells)} |")
        if of["gusts"] is not None:
            strength = of["gusts"]
            gusts.append(
                f"Weight {name.partition(',')[0]}, {strength['films']} films as series: the "
                "intensity of the gusts "
                f"errs by {100 * strength['rmse']:.0f} % of the wind (RMSE), its intervals are "
                f"{100 * strength['width']:.0f} % wide and contain it in {strength['covered']:.0%} "
                "of the films."
            )
            gusts.append("")
    refused = max(of["refused"] for of in sheet["results"].values())
    low, high = sheet["aims"]["covered"]
    about = (
        f"The model {sheet['model']!r} on {sheet['films']} simulated films of {sheet['windows']} "
        "windows in gusts, of "
        f"seed {sheet['seed']} (`python -m tests.studies wind-series`). The constants in its card "
        "are of "
        f"{sheet['constants']['source']}. Intervals are of 90 %. The gate refuses {refused} of the "
        "films; all count."
    )
    aims = (
        f"RMSE of windows at most {sheet['aims']['rmse']:g} m/s, {low:.0%} to {high:.0%} of the "
        "intervals contain it"
    )
    names = (
        "weight, windows",
        "RMSE [m/s]",
        "the same about each film's mean",
        "hold",
        "width [m/s]",
        "film's mean: RMSE",
        "hold",
        "width",
        "windows with a bound alone",
    )
    lines = ["# Winds of gusty films by window", "", about, "", f"Aims: {aims}.", ""]
    lines += [f"| {' | '.join(names)} |", "|---" * len(names) + "|", *rows, "", *gusts]
    return "\n".join(lines).rstrip() + "\n"
