"""Effects the base model lacks: one a file, each with null value, unit, prior and source.

An entry here enrols it in the contract suite (`tests/contract/test_effects.py`).
"""

from __future__ import annotations

from flagdata.registry import Registry
from sim.effects.effect import Effect, apply
from sim.effects.parameter import Parameter, Role

__all__ = ["EFFECTS", "Effect", "Parameter", "Role", "apply"]

EFFECTS = Registry(
    "effect",
    {
        "tangential-linear-drag": "sim.effects.tangential_linear_drag:TangentialLinearDrag",
        "tangential-quadratic-drag": "sim.effects.tangential_quadratic_drag:TangentialQuadraticDrag",
    },
)
