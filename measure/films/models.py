"""The models of a verdict on films as recipes that `flagdata simulate` runs: the base one, and that with the effect."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from measure.calibrate.simulation import COLUMNS, SETTLE, mean_bending
from measure.closing.models import NamedModel, acting
from measure.films.run import Outcome
from measure.forecasting.regressors import SHAPES
from measure.verdict.record import Verdict
from sim.effects import EFFECTS
from sim.material import named

FABRIC = "camel-ponte-roma"
"""Whose tables are multiplied: of which cloth a filmed flag is, is not known."""
_STEP = 4e-3
_FRAMES, _RATE = 100, 25.0
_ROUGH = 1e-3


def models(verdict: Verdict, outcome: Outcome, *, name: str) -> tuple[NamedModel, ...]:
    """The base model as calibrated and, where an effect is named, the larger one.

    Args:
        name: that theirs begin with.
    """
    made = [NamedModel(name=f"{name}-base", content=_content(verdict, outcome, f"{name}-base", {}))]
    if effects := acting(verdict)[:1]:
        (one,) = effects
        described = EFFECTS[one.effect].parameters()[one.parameter]
        own = {
            one.parameter.replace("_", "-"): described.nearest(one.strength.value),
            **dict(SHAPES.get(one.effect, ())),
        }
        larger = f"{name}-{one.effect}"
        made.append(NamedModel(name=larger, content=_content(verdict, outcome, larger, {one.effect: own})))
    return tuple(made)


def _content(
    verdict: Verdict, outcome: Outcome, title: str, effects: Mapping[str, Mapping[str, float]]
) -> Mapping[str, Any]:
    calibration = outcome.options.calibration
    fitted = {p.name: (p.after if effects and p.after is not None else p.before).value for p in verdict.parameters}
    speeds = [float(one.speed.mean()) for one in outcome.recordings]
    speed: Any = speeds[0] if min(speeds) == max(speeds) else {"low": min(speeds), "high": max(speeds)}
    content: dict[str, Any] = {
        "title": title, "seed": calibration.seed, "batch": 1,
        "scene": {
            "shape": "flag", "width": calibration.flag.length, "height": calibration.flag.height, "columns": COLUMNS,
            "attachment": calibration.flag.attachment, "start-noise": _ROUGH,
        },
        "wind": {"speed": speed},
        "integrator": {"name": "implicit", "step": _STEP},
        "time": {"settle": SETTLE, "frames": _FRAMES, "rate": _RATE},
        "material": {
            "name": FABRIC, "density": fitted["area_weight"],
            "bending-factor": fitted["bending"] / mean_bending(named(FABRIC)),
            "damping": max(fitted["damping"] - _STEP, 0.0),
        },
    }  # fmt: skip
    return {**content, "effects": effects} if effects else content
