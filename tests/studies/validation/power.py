"""The power map: which observable shows which effect, in standard errors that a minute of film
gives, at each wind.

Flags of one cloth are simulated without and with each effect of the library, each with a strength
in the middle of its prior, in a wind that varies as gusts do, and seen from 70° to the wind. The
difference of an observable's mean is divided by the standard error of the mean of a minute: the
deviation between windows, with what pixels add to it. FLAGDATA_POWER_ONLY gives patterns of
effects. Cases that were simulated are kept in `out`, so that a run that was stopped goes on.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from flagdata.core.arrays import FloatArray
from measure.observables import OBSERVABLES, WINDOW, Observable, View, edges_of, seen_from
from sim.effects import EFFECTS, Parameter, Role
from sim.run import Crew, Stepper, parse
from sim.run import run as simulate
from tests.evidence import REFERENCE

WINDS = (3.0, 5.0, 7.0)
FLAGS = 8
SECONDS = 10.0
SETTLE = 4.0
RATE = 25.0
LENGTH, HEIGHT, COLUMNS = 1.5, 1.0, 12
SEEN = View(azimuth=math.radians(70))
INTENSITY = 0.1
"""Of the gusts that all flags fly in, with and without an effect."""
NO_EFFECT = "none"
LEFT_OUT = ("gusts", "logged-gusts")
"""They are what all flags fly in, or need a log."""
_TOLD, _SHORT = 3.0, 7.0
"""Standard errors from which on an observable shows an effect, of the library and of the reference
runs: twice what the differences are known to or more, of 32 windows and of four."""


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Standard errors a minute by effect, observable and wind."""
    torch.set_num_threads(1)
    only = os.environ.get("FLAGDATA_POWER_ONLY", "*").split()
    kept = out / f"power-{seed}"
    kept.mkdir(exist_ok=True)
    names = [
        n for n in EFFECTS if n not in LEFT_OUT and any(fnmatch(n, pattern) for pattern in only)
    ]
    values = {
        name: {
            f"{wind:g}": _once(name, wind, seed, kept / f"{name}-{wind:g}.json") for wind in WINDS
        }
        for name in (NO_EFFECT, *names)
    }
    sheet = {
        "reference": reference(),
        "strengths": {name: strength(name) for name in names},
        "map": {
            name: {
                wind: _errors(values[name][wind], values[NO_EFFECT][wind]) for wind in values[name]
            }
            for name in names
        },
    }
    (out / "validate-power.md").write_text(page(sheet), encoding="utf-8")
    return sheet


def reference() -> dict[str, dict[str, dict[str, float | None]]]:
    """The same of the reference simulator's runs: what acted → wind → observable → standard errors
    of a minute; nothing where the runs are not there."""
    folder = REFERENCE / "arcsim" / "jittered"
    found: dict[str, dict[str, dict[str, list[float | None]]]] = {}
    for path in sorted(folder.glob("*_w*.npz")):
        name, _, wind = path.stem.rpartition("_w")
        with np.load(path) as run:
            values = windows(run["q"] * 1e-4, faces=run["faces"], rest=run["rest"])
        found.setdefault(name, {})[wind] = values
    base = found.pop("null", {})
    return {
        name: {wind: _errors(of[wind], base[wind]) for wind in of} for name, of in found.items()
    }


def strength(name: str) -> dict[str, float]:
    """Values of an effect's strengths in the middle of their priors; shapes as they usually are."""
    found: Mapping[str, Parameter] = EFFECTS[name].parameters()
    return {key: _middle(one) for key, one in found.items() if one.role is Role.STRENGTH}


def _middle(one: Parameter) -> float:
    low, high = one.prior
    middle = (low + high) / 2
    return middle if abs(middle - one.null) > 1e-12 else (middle + high) / 2


def readings(name: str, wind: float, seed: int) -> dict[str, list[float | None]]:
    """Observable → a value a window of all flags."""
    effect = (
        ""
        if name == NO_EFFECT
        else "".join(
            [
                f"[effects.{name}]\n",
                *(
                    f"{key.replace('_', '-')} = {value!r}\n"
                    for key, value in strength(name).items()
                ),
            ]
        )
    )
    text = (
        f"seed = {seed}\ncount = {FLAGS}\nbatch = {FLAGS}\n"
        f"[scene]\nwidth = {LENGTH}\nheight = {HEIGHT}\ncolumns = {COLUMNS}\nstart-noise = 1e-3\n"
        f'[material]\nname = "camel-ponte-roma"\n[wind]\nspeed = {wind}\n{effect}'
        f"[effects.gusts]\nintensity = {INTENSITY}\nlength = 20.0\n"
        f"[time]\nsettle = {SETTLE}\nframes = {round(SECONDS * RATE)}\nrate = {RATE}\n"
    )
    recipe = parse(text, name="power", folder=Path(), where="power")
    crew = Crew(recipe)
    outcomes = simulate(
        crew, Stepper.of(crew), [crew.member(index) for index in range(FLAGS)], size=FLAGS
    )
    found: dict[str, list[float | None]] = {observable: [] for observable in OBSERVABLES}
    for outcome in outcomes:
        if outcome.sequence is None:
            continue
        own = windows(
            outcome.sequence.positions, faces=outcome.sequence.faces, rest=outcome.sequence.rest
        )
        for observable, values in own.items():
            found[observable] += values
    return found


def windows(
    positions: NDArray[np.floating], *, faces: NDArray[np.integer], rest: NDArray[np.floating]
) -> dict[str, list[float | None]]:
    """Observable → a value a window of a flag (frame, vertex, 3) at `RATE`."""
    hoist, free = edges_of(rest)
    found: dict[str, list[float | None]] = {observable: [] for observable in OBSERVABLES}
    frames = round(WINDOW * RATE)
    for first in range(0, len(positions) - frames + 1, frames):
        cloth = seen_from(
            SEEN,
            positions[first : first + frames],
            times=np.arange(frames) / RATE,
            faces=faces,
            hoist=hoist,
            free=free,
            length=LENGTH,
            height=HEIGHT,
        )
        for observable, values in found.items():
            value = OBSERVABLES[observable].of_cloth(cloth).value
            values.append(None if math.isnan(value) else value)
    return found


def _once(name: str, wind: float, seed: int, path: Path) -> dict[str, list[float | None]]:
    if not path.exists():
        path.write_text(json.dumps(readings(name, wind, seed)), encoding="utf-8")
    return json.loads(path.read_text(encoding="utf-8"))


def _errors(
    own: Mapping[str, list[float | None]], base: Mapping[str, list[float | None]]
) -> dict[str, float | None]:
    """Observable → standard errors of a minute; None where fewer than half of the windows show
    it."""
    found: dict[str, float | None] = {}
    for name in OBSERVABLES:
        observable: Observable = OBSERVABLES[name]
        with_effect, without = _shown(own[name]), _shown(base[name])
        if (
            len(with_effect) < 0.5 * len(own[name])
            or len(without) < 0.5 * len(base[name])
            or len(with_effect) < 3
        ):
            found[name] = None
            continue
        variance = (with_effect.var(ddof=1) + without.var(ddof=1)) / 2 + observable.sigma**2
        found[name] = float(
            (with_effect.mean() - without.mean()) / math.sqrt(variance * WINDOW / 60.0)
        )
    return found


def _shown(values: list[float | None]) -> FloatArray:
    return np.array([value for value in values if value is not None])


def page(sheet: Mapping[str, Any]) -> str:
    """The sheet in Markdown."""
    winds = " / ".join(f"{wind:g}" for wind in WINDS)
    lines = [
        "# Power map: effect × observable × wind",
        "",
        (
            f"Standard errors that a minute of film gives, at {winds} m/s: the difference that the "
            "effect makes "
            "to the mean of an observable, over the standard error of the mean of a minute. "
            f"{FLAGS} flags of {SECONDS:g} s each, 1.5 × 1.0 m, Camel Ponte Roma, {COLUMNS} "
            "columns, "
            f"gusts of {INTENSITY:.0%}, seen from 70° to the wind; the "
            "deviation between windows with the sigma of pixels. The difference itself is known to "
            "about "
            f"{math.sqrt(2 * 60 / (FLAGS * SECONDS)):.1f} of these (`python -m tests.studies "
            "power`)."
        ),
        "",
        *table(sheet),
    ]
    if sheet["reference"]:
        lines += [
            "",
            "## The reference simulator's runs",
            "",
            "ArcSim, 10 s at 3 / 5 / 7 m/s without gusts.",
            "",
        ]
        lines += reference_table(sheet)
    lines += [
        "",
        (
            f"In bold: {_TOLD:g} or more, of ArcSim's {_SHORT:g}. A dash: fewer than half of the "
            "windows show it."
        ),
    ]
    return "\n".join(lines) + "\n"


def table(sheet: Mapping[str, Any]) -> list[str]:
    """Lines of the library's map, as in the sheet and in docs/method/films.md: effects that more
    observables show clearly come first."""
    seen = _seen(sheet["map"])
    lines = ["| effect, strength | " + " | ".join(seen) + " |", "|---" * (1 + len(seen)) + "|"]
    for name, of in sorted(sheet["map"].items(), key=lambda one: -clear(one[1])):
        strengths = ", ".join(f"{value:.3g}" for value in sheet["strengths"][name].values())
        cells = [
            " / ".join(_cell(own[observable], _TOLD) for own in of.values()) for observable in seen
        ]
        lines.append(f"| {name}, {strengths} | " + " | ".join(cells) + " |")
    return lines


def reference_table(sheet: Mapping[str, Any]) -> list[str]:
    """Lines of the reference simulator's map, as in the sheet and in docs/method/films.md."""
    seen = _seen(sheet["reference"])
    lines = ["| what acted | " + " | ".join(seen) + " |", "|---" * (1 + len(seen)) + "|"]
    for name, of in sheet["reference"].items():
        cells = [" / ".join(_cell(of[wind][one], _SHORT) for wind in sorted(of)) for one in seen]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return lines


def _seen(maps: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> list[str]:
    """The observables of a map, which may be older than some."""
    return [
        one for one in OBSERVABLES if all(one in own for of in maps.values() for own in of.values())
    ]


def clear(of: Mapping[str, Mapping[str, float | None]]) -> int:
    """In how many observables and winds a minute shows an effect."""
    return sum(
        value is not None and abs(value) >= _TOLD for own in of.values() for value in own.values()
    )


def _cell(value: float | None, clear: float) -> str:
    if value is None:
        return "–"
    text = f"{value:+.0f}".replace("-", "−")
    return f"**{text}**" if abs(value) >= clear else text
