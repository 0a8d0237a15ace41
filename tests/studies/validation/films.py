"""What `flagdata measure` answers on films whose wind is known: ArcSim's runs filmed by VTK,
neither of them ours.

The list of films was fixed before the first was measured (`vtk_films.designs`). Each is measured
with the flag's size, once with the area weight open and once with a range about the true one.
FLAGDATA_FILMS names the folder of the films, where those that are missing are made;
FLAGDATA_FILMS_ONLY gives patterns of their names.
"""

from __future__ import annotations

import os
import time
from collections.abc import Mapping, Sequence
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import numpy as np
import torch

from flagdata.core.stated import Stated
from flagdata.errors import FlagdataError, NotFoundError
from measure.estimate import Measurement, Options, measure, of_model
from measure.film import FilmReading, FlagSize, subjects
from measure.gate import REASONS, WindowGate
from measure.measuring_model import Network, gate_beside, network
from tests.evidence import ABSENT, REFERENCE
from tests.studies.shares import Share
from tests.studies.validation.environments import VTK
from tests.studies.validation.vtk_films.designs import COMPARED, Design, designs, stressor_of
from tests.studies.validation.vtk_films.making import FOLDER, make, path_of
from tests.studies.validation.vtk_films.runs import DENSITY, HEIGHT, LENGTH, read

WEIGHT = Stated(low=0.27, high=0.30)
"""Range of the area weight that is stated, about the true 0.284 kg/m²."""
_LEVEL = 0.9
_PARTS = ("rates", "coverage", "other air", "stressors")


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Answers on all films, and what the acceptance asks of them."""
    if not (REFERENCE / "arcsim").is_dir():
        return dict(ABSENT)
    wanted = chosen(designs())
    if missing := [one for one in wanted if not path_of(one, FOLDER).exists()]:
        try:
            make(missing, folder=FOLDER, python=VTK.find())
        except NotFoundError as error:
            return {"left_out": f"{error.what}: {error.fix}"}
    torch.set_num_threads(1)
    found = network(None, lake=None, at=None)
    gate = gate_beside(found, false_alarm=Options().false_alarm)
    rows = [answers(one, found, gate, seed=seed) for one in wanted]
    sheet = {"model": found.estimator.name, **summary(rows), "films": rows}
    (out / "validate-films.md").write_text(page(sheet), encoding="utf-8")
    return sheet


def chosen(found: Sequence[Design]) -> list[Design]:
    """Those whose names match one of the patterns of FLAGDATA_FILMS_ONLY, all by default."""
    only = os.environ.get("FLAGDATA_FILMS_ONLY", "*").split()
    return [one for one in found if any(fnmatch(one.name, pattern) for pattern in only)]


def answers(design: Design, found: Network, gate: WindowGate, *, seed: int) -> dict[str, Any]:
    """One film, measured with its weight open and stated."""
    motion = read(REFERENCE, design.run)
    begun = time.perf_counter()
    size = FlagSize(length=LENGTH, height=HEIGHT)
    asked = {
        name: Options(size=size, seed=seed, area_weight=weight)
        for name, weight in (("open", None), ("stated", WEIGHT))
    }
    path = path_of(design, FOLDER)
    said = {name: answer(path, found, gate, options) for name, options in asked.items()}
    return {
        "name": design.name,
        "part": design.part,
        "wind": motion.wind,
        "rate": design.rate,
        "size": list(design.size),
        "seconds": time.perf_counter() - begun,
        **said,
    }


def answer(path: Path, found: Network, gate: WindowGate, options: Options) -> dict[str, Any]:
    """The answer for a film: wind and area weight with their intervals, or why it is refused."""
    (subject,) = subjects(str(path), query=None, lake=None, at=None, reading=FilmReading())
    try:
        measured = measure(
            subject.film,
            found.estimator,
            gate=gate,
            dependence=of_model(found.estimator),
            options=options,
        )
    except FlagdataError as error:
        return {"refused": True, "reasons": [kind_of(error)], "why": error.what}
    return {"refused": measured.verdict.refused, **_reasons(measured), **_quantities(measured)}


def kind_of(error: FlagdataError) -> str:
    """Returns the kind of the reason that an error states, and of any other error its own."""
    return next(
        (kind for kind, one in REASONS.items() if error.what.startswith(f"{one.sentence}: ")),
        error.kind,
    )


def _reasons(measured: Measurement) -> dict[str, Any]:
    verdict = measured.verdict
    if not verdict.refused:
        return {"reasons": [], "why": ""}
    return {"reasons": [one.kind for one in verdict.reasons], "why": verdict.reasons[0].what}


def _quantities(measured: Measurement) -> dict[str, Any]:
    """The estimate of a refused film too: what the refusal spares the user."""
    found = {}
    for short, name in (("wind", "wind_speed"), ("weight", "area_weight")):
        column = measured.draws[:, measured.names.index(name)]
        own = next(one for one in measured.quantities if one.name == name)
        low, high = own.span.ends()
        found[short] = {"value": float(column.mean()), "low": low, "high": high}
    return found


def contains(interval: Mapping[str, float | None], true: float) -> bool:
    """Returns whether an interval, whose ends may be open, contains the true value."""
    low, high = interval["low"], interval["high"]
    return (low is None or low <= true) and (high is None or true <= high)


def summary(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The acceptance's figures."""
    return {
        "refused": {
            part: Share.of(
                row["stated"]["refused"] for row in rows if row["part"] == part
            ).as_dict()
            for part in _PARTS[:3]
            if any(row["part"] == part for row in rows)
        },
        "errors": {
            part: {
                name: _errors([row for row in rows if row["part"] == part], name)
                for name in ("open", "stated")
            }
            for part in _PARTS[:3]
            if any(row["part"] == part for row in rows)
        },
        "rates": _rates([row for row in rows if row["part"] == "rates"]),
        "stressors": _stressed([row for row in rows if row["part"] == "stressors"]),
    }


def _errors(rows: Sequence[Mapping[str, Any]], name: str) -> dict[str, Any]:
    """Of the films that are answered: errors, signs, intervals."""
    answered = [(row["wind"], row[name]["wind"]) for row in rows if not row[name]["refused"]]
    if not answered:
        return {"films": 0}
    error = np.array([found["value"] - wind for wind, found in answered])
    width = [
        found["high"] - found["low"]
        for _, found in answered
        if None not in (found["low"], found["high"])
    ]
    return {
        "films": len(answered),
        "bias": float(error.mean()),
        "median_error": float(np.median(np.abs(error))),
        "rmse": float(np.sqrt(np.square(error).mean())),
        "too_low": int((error < 0).sum()),
        "covered": Share.of(contains(found, wind) for wind, found in answered).as_dict(),
        "width": float(np.mean(width)) if width else None,
    }


def _rates(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """By wind: the answer at each rate, and how far those of `COMPARED` are from their mean."""
    found: dict[str, Any] = {}
    for wind in sorted({row["wind"] for row in rows}):
        own = {row["rate"]: row for row in rows if row["wind"] == wind}
        of = {}
        for name in ("open", "stated"):
            values = {
                rate: row[name]["wind"]["value"] for rate, row in own.items() if "wind" in row[name]
            }
            compared = [values[rate] for rate in COMPARED if rate in values]
            of[name] = {
                "values": values,
                "refused": [rate for rate, row in own.items() if row[name]["refused"]],
                "largest_difference": max(compared) - min(compared) if compared else None,
            }
        found[f"{wind:g}"] = of
    return found


def _stressed(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """By stressor: the difference to the film without, of each base film, or the reason of the
    refusal."""
    by_name = {one.name: one for one in designs()}
    plain = {row["wind"]: row for row in rows if stressor_of(by_name[row["name"]]) == "none"}
    found: dict[str, dict[str, Any]] = {}
    for row in rows:
        said, base = row["stated"], plain[row["wind"]]["stated"]
        shift = (
            said["wind"]["value"] - base["wind"]["value"]
            if "wind" in said and "wind" in base
            else None
        )
        found.setdefault(stressor_of(by_name[row["name"]]), {})[f"{row['wind']:g}"] = {
            "shift": shift,
            "refused": said["refused"],
            "reasons": said["reasons"][:3],
            "why": said["why"],
        }
    return found


def page(sheet: Mapping[str, Any]) -> str:
    """The sheet in Markdown."""
    lines = [
        "# Films of another simulator by another renderer",
        "",
        (
            f"Model {sheet['model']}; ArcSim's runs filmed by VTK, {len(sheet['films'])} films, "
            "each measured with the "
            f"flag's size and once with the area weight open, once with {WEIGHT.low:g} to "
            f"{WEIGHT.high:g} kg/m² (true "
            f"{DENSITY:g}). The films were listed before the first was measured; their motion has "
            "nothing above 12.5 "
            "Hz (`python -m tests.studies films`)."
        ),
        "",
        (
            "| films | weight | refused | answered | 90 % intervals contain the wind | mean width "
            "[m/s] | median "
            "error [m/s] | bias [m/s] | read too low |"
        ),
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for part, of in sheet["errors"].items():
        for name, own in of.items():
            count = sum(row["part"] == part for row in sheet["films"])
            lines.append(
                f"| {part} | {name} | {count - own['films']} of {count} | "
                + _errors_row(own)
                + " |"
            )
    lines += ["", "## One view at all frame rates", ""]
    lines += _rates_table(sheet["rates"])
    lines += ["", "## Stressors, weight stated: difference to the film without [m/s]", ""]
    winds = sorted({wind for of in sheet["stressors"].values() for wind in of})
    lines += [
        "| stressor | " + " | ".join(f"{wind} m/s" for wind in winds) + " |",
        "|---" * (1 + len(winds)) + "|",
    ]
    lines += [
        f"| {name} | " + " | ".join(_stressor_cell(of.get(wind)) for wind in winds) + " |"
        for name, of in sheet["stressors"].items()
    ]
    lines += [
        "",
        "## All films",
        "",
        (
            "| film | rate | true wind [m/s] | weight open: wind [m/s] | weight [kg/m²] | weight "
            "stated: wind [m/s] | "
            "refused for |"
        ),
        "|---|---|---|---|---|---|---|",
        *(
            f"| {row['name']} | {row['rate']} | {row['wind']:g} | "
            f"{_cell(row['open'], 'wind', row['wind'])} | "
            f"{_cell(row['open'], 'weight', DENSITY)} | "
            f"{_cell(row['stated'], 'wind', row['wind'])} | "
            f"{', '.join(row['stated']['reasons'][:3])} |"
            for row in sheet["films"]
        ),
        "",
        (
            "An interval in bold does not contain the true value. Of refused films the estimate is "
            "that of `--anyway`."
        ),
    ]
    return "\n".join(lines) + "\n"


def _errors_row(own: Mapping[str, Any]) -> str:
    if not own["films"]:
        return "0 | | | | |"
    covered, width = own["covered"], own["width"]
    return (
        f"{own['films']} | {covered['hits']} ({covered['value']:.0%} [{covered['low']:.0%}, "
        f"{covered['high']:.0%}]) | "
        f"{'' if width is None else f'{width:.2f}'} | {own['median_error']:.2f} | "
        f"{own['bias']:+.2f} | "
        f"{own['too_low']} of {own['films']}"
    )


def _rates_table(found: Mapping[str, Any]) -> list[str]:
    rates = list(dict.fromkeys(rate for of in found.values() for rate in of["stated"]["values"]))
    lines = [
        "| true wind [m/s], weight | "
        + " | ".join(rates)
        + f" | largest difference of {', '.join(COMPARED)} |",
        "|---" * (2 + len(rates)) + "|",
    ]
    for wind, of in found.items():
        for name, own in of.items():
            cells = [
                ""
                if rate not in own["values"]
                else f"{own['values'][rate]:.2f}" + (" (refused)" if rate in own["refused"] else "")
                for rate in rates
            ]
            lines.append(
                f"| {wind}, {name} | "
                + " | ".join(cells)
                + f" | {_number(own['largest_difference'])} |"
            )
    return lines


def _stressor_cell(own: Mapping[str, Any] | None) -> str:
    if own is None:
        return ""
    shift = "" if own["shift"] is None else f"{own['shift']:+.2f}"
    return f"{shift} refused: {', '.join(own['reasons'])}" if own["refused"] else shift


def _cell(said: Mapping[str, Any], name: str, true: float) -> str:
    if name not in said:
        return ""
    own = said[name]
    interval = f"[{_number(own['low'])}, {_number(own['high'])}]"
    return f"{own['value']:.2f} {interval if contains(own, true) else f'**{interval}**'}"


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.2f}"
