"""Classes of effects that confusions are forgiven within (`catalogs/effect-classes.toml`)."""

from __future__ import annotations

import functools
import tomllib
from collections.abc import Mapping
from importlib.resources import files


@functools.cache
def classes() -> Mapping[str, tuple[str, ...]]:
    """Class → its effects."""
    text = (files("catalogs") / "effect-classes.toml").read_text(encoding="utf-8")
    return {name: tuple(entry["effects"]) for name, entry in tomllib.loads(text).items()}


def class_of(effect: str) -> str:
    """The class of an effect: its own name where it shares one with no other."""
    return next((name for name, effects in classes().items() if effect in effects), effect)
