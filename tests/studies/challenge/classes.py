"""Classes of effects that confusions are forgiven within, as the effects state them."""

from __future__ import annotations

from collections.abc import Mapping

from sim.effects import CLASSES, EFFECTS


def classes() -> Mapping[str, tuple[str, ...]]:
    """Class → its effects."""
    return {
        name: tuple(effect for effect, kind in EFFECTS.usable() if kind.effect_class == name)
        for name in CLASSES
    }


def class_of(effect: str) -> str:
    """The class of an effect: its own name where it shares one with no other."""
    return (EFFECTS[effect].effect_class if effect in EFFECTS else "") or effect
