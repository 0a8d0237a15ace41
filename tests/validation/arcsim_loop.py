"""The loop closed on ArcSim's runs of a flag, another simulator's numerics: as they are declared, and with something
that acts in them declared wrongly.

Two winds, 10 s each after 10 s, 651 vertices as markers, the paper's 5 ms steps. What is declared wrongly is an effect
that the base model lacks: less air than the run had is a dynamic pressure larger by a factor, a wind said to rise is
one that falls. No bank is given; all nulls are of this cloth, its markers and winds.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from measure.closing.close import close_loop
from measure.loop.run import Options
from measure.observe import Hold, Observation, Setup, from_arrays, observe
from measure.observe.trajectory import WindTrack
from measure.verdict.record import Candidate, Verdict
from sim.air import QuadraticNormal
from tests.validation.arcsim import RATE, folder
from tests.validation.flags_runs import CAMEL

RUNS = {"flag_w4_dt5": 4.0, "flag_w8_dt5": 8.0}
SETTLED = 250
"""Frames of a run that are left out: the flag was let go from rest."""


@dataclass(frozen=True, kw_only=True)
class Declared:
    """What is said of the runs.

    Attributes:
        density: of the air [kg/m³]; the runs have 1.
        rise: of the wind above the horizontal [rad]; the runs' is level.
        true: effect → its strength by these.
    """

    density: float = 1.0
    rise: float = 0.0
    true: Mapping[str, float]


CASES = {
    "as it is": Declared(true={}),
    "air declared too thin": Declared(density=0.65, true={"air-density": 1 / 0.65 - 1}),
    "wind declared to rise": Declared(rise=0.12, true={"vertical-wind": -0.12}),
}


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Verdicts; what is missing where the reference runs are."""
    runs = folder()
    if runs is None:
        return {"missing": "no ArcSim runs in the reference data (set FLAGDATA_REFERENCE)"}
    return {name: _told(_verdict(runs, declared, seed), declared) for name, declared in CASES.items()}


def _verdict(runs: Path, declared: Declared, seed: int) -> Verdict:
    setup = Setup(
        material=CAMEL, pins=Hold.HOIST_CORNERS, air=QuadraticNormal(density=declared.density), vertices=200
    )  # fmt: skip
    found = observe([_recording(runs, name, declared.rise) for name in RUNS], setup)
    return close_loop(found.experiment, Options(seed=seed, workers=len(os.sched_getaffinity(0))))


def _recording(runs: Path, name: str, rise: float) -> Observation:
    with np.load(runs / f"{name}.npz") as content:
        positions, rest, faces = (content[part] for part in ("positions", "rest", "faces"))
    speed = RUNS[name]
    return from_arrays(
        name=name, positions=positions[SETTLED:].astype(np.float64), rest=rest, faces=faces, rate=RATE,
        wind=WindTrack.constant((speed * math.cos(rise), 0.0, speed * math.sin(rise))),
    )  # fmt: skip


def _told(verdict: Verdict, declared: Declared) -> dict[str, Any]:
    return {
        "true": dict(declared.true), "said": verdict.conclusion.value, "named": list(verdict.named),
        "words": verdict.words, "statistic": verdict.test.statistic, "p": verdict.test.p_value.value,
        "level": verdict.test.level, "nulls": verdict.test.nulls, "seconds": round(verdict.seconds),
        "first": [_candidate(candidate) for candidate in verdict.ranking[:3]],
        "E_red": [comparison.share for comparison in verdict.comparisons],
    }  # fmt: skip


def _candidate(candidate: Candidate) -> dict[str, Any]:
    strength = candidate.strength
    return {
        "effect": candidate.effect, "strength": strength.value, "low": strength.low, "high": strength.high,
        "level": strength.level, "unit": strength.unit, "z": candidate.z, "p": candidate.p_family,
        "held-out gain": candidate.gain, "p of what it leaves": candidate.leftover, "why not": candidate.why_not,
    }  # fmt: skip
