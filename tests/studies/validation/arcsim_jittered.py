"""The loop closed on seven experiments of ArcSim whose undeclared effect is known, by three draws
of nulls.

Each is three winds of 10 s on an irregular mesh of 486 vertices: nothing undeclared, the pressure
of the air × 1.6, a linear tangential drag, an internal damping of 30 ms, a wind turned by 10°, one
that varies by 20 % at 0.5 Hz along itself, and a hoist that is attached along its length though two
corners are declared. A verdict is right if it names what acted, alone or as one of several, and
names nothing where only a calibrated parameter differs. All are judged by the same bank of nulls,
and then by banks that were drawn anew: verdicts that differ between them depend on the draw.
The verdicts are made twice: with the weight's uncertainty not given, and given as 2 %.

The others are damped by ArcSim's steps alone, like 2.5 ms where a motion is slow beside them and
less where it is not, so that only for that of 30 ms it is reported whether the interval of damping
contains the true value.
"""

from __future__ import annotations

import json
import math
import os
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from flagdata.answer import Quantity
from flagdata.core.json_values import json_values
from measure.closing import close_loop
from measure.forecasting import Setting
from measure.loop import LoopOptions
from measure.nulls import bank as banks
from measure.nulls import batches
from measure.trajectories import (
    AREA_WEIGHT_UNCERTAINTY,
    Experiment,
    Hold,
    Observation,
    Setup,
    WindTrack,
    from_arrays,
    observe,
)
from measure.verdict import CRITERIA, Conclusion, Verdict
from tests.evidence import ABSENT
from tests.studies.validation.arcsim import RATE, folder
from tests.studies.validation.flags_runs import CAMEL

WINDS = (3, 5, 7)
DRAWS = tuple(range(1, 1 + int(os.environ.get("FLAGDATA_DRAWS", "3"))))
"""Of the nulls, some 13 minutes of a core each; FLAGDATA_DRAWS says how many."""
KNOWN = tuple(
    float(known)
    for known in os.environ.get("FLAGDATA_KNOWN", f"{AREA_WEIGHT_UNCERTAINTY:g},0.02").split(",")
)
"""Relative standard uncertainties of the area weight that is declared: where it is not given, and
of a cloth that was weighed; FLAGDATA_KNOWN says which are tried."""
WORKERS = int(os.environ.get("FLAGDATA_WORKERS", "0")) or len(os.sched_getaffinity(0))
"""Processes that simulate the nulls; FLAGDATA_WORKERS says how many."""
_UNIT = 1e-4  # m, of the stored positions
_SHOWN = 7
"""Candidates that the page reports."""


@dataclass(frozen=True, kw_only=True)
class Truth:
    """What acted.

    Attributes:
        effect: name in the library; empty where none did.
        parameters: calibrated ones that are not the nominal cloth's.
    """

    effect: str = ""
    parameters: Mapping[str, float] = field(default_factory=dict[str, float])


CASES = {
    "null": Truth(),
    "pressure-x1.6": Truth(effect="air-density"),
    "tangential-linear-drag-0.4": Truth(effect="tangential-linear-drag"),
    "internal-damping-30ms": Truth(parameters={"damping": 30e-3}),
    "wind-turned-10deg": Truth(effect="direction-change"),
    "wind-varies-20pct-0.5hz": Truth(effect="gusts"),
    "full-hoist-attached": Truth(effect="full-hoist"),
}


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Verdicts; what is missing where the reference runs are. Nulls and verdicts of a draw stay in
    `out`, so that a run that was stopped goes on where it was."""
    runs = folder()
    if runs is None or not (runs / "jittered").is_dir():
        return dict(ABSENT)
    experiments = {
        known: {name: _experiment(runs / "jittered", name, known) for name in CASES}
        for known in KNOWN
    }
    results: dict[str, Any] = {"criteria": json_values(CRITERIA)}
    setting = Setting.of(experiments[KNOWN[0]]["null"])
    for draw in DRAWS:
        place = out / f"arcsim-jittered-{seed}-{draw}"
        wanted = batches(setting, kinds=CRITERIA.simulated_kinds, seed=100 * seed + draw)
        banks.build(
            place / "nulls",
            wanted,
            workers=WORKERS,
            progress=lambda done: _report(f"nulls + {done}"),
        )
        for known, group in experiments.items():
            heading = _heading(draw, known)
            results[heading] = {name: _once(place, name, own, seed) for name, own in group.items()}
            _report(
                f"{heading}: {sum(own['right'] for own in results[heading].values())} of "
                f"{len(group)} right"
            )
    (out / "validate-arcsim-jittered.md").write_text(_page(results), encoding="utf-8")
    return results


def _report(what: str) -> None:
    sys.stderr.write(f"arcsim-jittered: {what}\n")


def _heading(draw: int, known: float) -> str:
    return f"draw {draw}, area weight known to {100 * known:.0f} %"


def _once(place: Path, name: str, experiment: Experiment, seed: int) -> dict[str, Any]:
    """A verdict as the page reports it, from its file where it was made before."""
    kept = place / f"{name}-{experiment.specimen.area_weight_uncertainty:g}.json"
    if not kept.exists():
        record = _record(
            close_loop(experiment, LoopOptions(bank=place / "nulls", seed=seed)), CASES[name]
        )
        kept.write_text(json.dumps(record, allow_nan=False), encoding="utf-8")
    return json.loads(kept.read_text(encoding="utf-8"))


def _experiment(runs: Path, name: str, known: float = AREA_WEIGHT_UNCERTAINTY) -> Experiment:
    setup = Setup(material=CAMEL, area_weight_uncertainty=known, pins=Hold.HOIST_CORNERS)
    return observe(
        [_recording(runs / f"{name}_w{wind}.npz", wind) for wind in WINDS], setup
    ).experiment


def _recording(path: Path, wind: int) -> Observation:
    with np.load(path) as content:
        positions, rest, faces = (content[part] for part in ("q", "rest", "faces"))
    return from_arrays(
        name=f"{wind} m-s",
        positions=_UNIT * positions.astype(np.float64),
        rest=rest.astype(np.float64),
        faces=faces.astype(np.int64),
        rate=RATE,
        wind=WindTrack.constant((float(wind), 0.0, 0.0)),
    )


def _record(verdict: Verdict, truth: Truth) -> dict[str, Any]:
    wanted = {"area_weight": 1.0, "bending": 1.0} | dict(truth.parameters)
    shown = {p.name: p.before if p.after is None else p.after for p in verdict.parameters}
    return {
        "said": verdict.conclusion.value,
        "named": list(verdict.named),
        "right": _right(verdict, truth),
        "p": verdict.test.p_value.point,
        "p low": verdict.test.p_value.low,
        "p high": verdict.test.p_value.high,
        "statistic": verdict.test.statistic,
        "critical": verdict.test.critical,
        "kinds": verdict.test.kinds,
        "parameters": {name: _interval(own, wanted.get(name)) for name, own in shown.items()},
        "candidates": [
            {
                "effect": c.effect,
                "low": c.strength.low,
                "value": c.strength.point,
                "high": c.strength.high if math.isfinite(c.strength.high) else None,
                "gain": c.gain,
                "behind": c.behind,
                "leftover": c.leftover,
                "heterogeneity": c.heterogeneity,
                "why not": c.why_not,
            }
            for c in verdict.ranking[:_SHOWN]
        ],
        "unseen": [
            {
                "what": c.what,
                "before": c.before.point,
                "after": c.after.point,
                "floor": c.floor.point,
            }
            for c in verdict.comparisons
        ],
        "words": verdict.words,
        "seconds": round(verdict.seconds),
    }


def _right(verdict: Verdict, truth: Truth) -> bool:
    """Whether it names what acted, alone or as one of several, or nothing where nothing did,
    whether that is decided or not. A parameter of the base model that is not the nominal cloth's is
    no effect."""
    if not truth.effect:
        return verdict.conclusion in (Conclusion.SUFFICIENT, Conclusion.UNDECIDED)
    return (
        verdict.conclusion in (Conclusion.EFFECT, Conclusion.ONE_OF)
        and truth.effect in verdict.named
    )


def _interval(found: Quantity, true: float | None) -> dict[str, Any]:
    covers = None if true is None else found.low <= true <= found.high
    return {"low": found.low, "value": found.value, "high": found.high, "covers": covers}


def _page(results: Mapping[str, Any]) -> str:
    """The verdicts as a page."""
    lines = ["# The loop on seven experiments of ArcSim", ""]
    for known in KNOWN:
        for draw in DRAWS:
            heading = _heading(draw, known)
            lines += _table(f"Nulls of {heading}", results[heading])
    return "\n".join(lines)


def _table(heading: str, verdicts: Mapping[str, Any]) -> list[str]:
    lines = [
        f"## {heading}",
        "",
        (
            "| what acted | verdict | p | area weight, of nominal | bending, of nominal | damping [ms] "
            "| right | s |"
        ),
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, own in verdicts.items():
        found = own["parameters"]
        lines.append(
            f"| {name} | {own['said']}{': ' * bool(own['named'])}{', '.join(own['named'])} | "
            f"{own['p']:.3f} "
            f"[{own['p low']:.3f}, {own['p high']:.3f}] | {_span(found['area_weight'])} | "
            f"{_span(found['bending'])} | "
            f"{_span(found['damping'], 1e3)} | {'yes' if own['right'] else 'no'} | "
            f"{own['seconds']} |"
        )
    unseen = [
        f"| {name} | {c['what']} | {1e3 * c['before']:.1f} | {1e3 * c['after']:.1f} | "
        f"{1e3 * c['floor']:.1f} |"
        for name, own in verdicts.items()
        for c in own["unseen"]
    ]
    if unseen:
        lines += [
            "",
            "| what acted | unseen | before [mm] | after [mm] | floor [mm] |",
            "|---|---|---|---|---|",
            *unseen,
        ]
    named = [
        f"| {name} | {c['effect']} | {_strength(c)} |"
        for name, own in verdicts.items()
        for c in own["candidates"]
        if c["effect"] in own["named"]
    ]
    if named:
        lines += ["", "| what acted | named | strength, 90 % |", "|---|---|---|", *named]
    return [*lines, ""]


def _strength(candidate: Mapping[str, Any]) -> str:
    """Writes a strength with its interval, and as a bound where it has no upper end."""
    if candidate["high"] is None:
        return f"at least {candidate['low']:.3g}"
    return f"{candidate['value']:.3g} [{candidate['low']:.3g}, {candidate['high']:.3g}]"


def _span(found: Mapping[str, Any], unit: float = 1.0) -> str:
    interval = (
        f"{unit * found['value']:.3g} [{unit * found['low']:.3g}, {unit * found['high']:.3g}]"
    )
    return f"{interval}, misses" if found["covers"] is False else interval
