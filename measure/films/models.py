"""The models of a verdict on films as recipes that `flagdata simulate` runs: the base one, and that with the effect."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from measure.calibrate.simulation import COLUMNS, SETTLE, mean_bending
from measure.closing.models import NamedModel, acted, acting, fitted
from measure.films.run import Outcome
from measure.verdict.record import Candidate, Verdict
from sim.material import named

FABRIC = "camel-ponte-roma"
"""Whose tables are multiplied where it is not stated of which fabric a flag is."""
_STEP = 4e-3
_FRAMES, _RATE = 100, 25.0
_ROUGH = 1e-3


def models(verdict: Verdict, outcome: Outcome, *, name: str) -> tuple[NamedModel, ...]:
    """The base model as calibrated and, where an effect is named, the larger one.

    Args:
        name: that theirs begin with.
    """
    made = [NamedModel(name=f"{name}-base", content=_content(verdict, outcome, f"{name}-base", ()))]
    if effects := acting(verdict)[:1]:
        larger = f"{name}-{effects[0].effect}"
        made.append(NamedModel(name=larger, content=_content(verdict, outcome, larger, effects)))
    return tuple(made)


def _content(verdict: Verdict, outcome: Outcome, title: str, effects: Sequence[Candidate]) -> Mapping[str, Any]:
    calibration, own = outcome.options.calibration, fitted(verdict, effects)
    speeds = [float(one.speed.mean()) for one in outcome.recordings]
    fabric = FABRIC if calibration.material is None else calibration.material.tables[0]
    speed: Any = speeds[0] if min(speeds) == max(speeds) else {"low": min(speeds), "high": max(speeds)}
    return {
        "title": title,
        "seed": calibration.seed,
        "batch": 1,
        "scene": {
            "shape": "flag",
            "width": calibration.flag.length,
            "height": calibration.flag.height,
            "columns": COLUMNS,
            "attachment": calibration.flag.attachment,
            "start-noise": _ROUGH,
        },
        "wind": {"speed": speed},
        "integrator": {"name": "implicit", "step": _STEP},
        "time": {"settle": SETTLE, "frames": _FRAMES, "rate": _RATE},
        "material": {
            "name": fabric,
            "density": own["area_weight"],
            "bending-factor": own["bending"] / mean_bending(named(fabric)),
            "damping": max(own["damping"] - _STEP, 0.0),
        },
        **acted(effects),
    }
