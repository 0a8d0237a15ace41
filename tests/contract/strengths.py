"""The strengths of an effect: at null it must not act."""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

from sim.effects import Parametrised, Value

Some = TypeVar("Some", bound=Parametrised)


def nulls(effect: Parametrised) -> dict[str, Value]:
    """Strength → its null value."""
    return {name: effect.parameters()[name].null for name in effect.strengths()}


def nulled(effect: Some) -> Some:
    """The effect with its strengths at null and its shapes as they are."""
    return replace(effect, **nulls(effect))
