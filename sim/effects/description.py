"""What an effect says of itself in words: the first paragraph of its module, its equation, and the
meaning of each parameter, from docstrings."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Mapping
from dataclasses import dataclass

from sim.effects.parameter import Parametrised


@dataclass(frozen=True, kw_only=True)
class EffectDescription:
    """An effect in words.

    Attributes:
        about: what it is, in a sentence or two.
        equation: what it does.
        meanings: parameter → what it is, with its sign.
    """

    about: str
    equation: str
    meanings: Mapping[str, str]


def describe(effect: type[Parametrised]) -> EffectDescription:
    """Describes an effect by its docstrings; of one that has none by nothing."""
    about = inspect.getdoc(sys.modules[effect.__module__]) or ""
    equation, _, attributes = (inspect.getdoc(effect) or "").partition("\nAttributes:\n")
    return EffectDescription(
        about=" ".join(about.split("\n\n")[0].split()),
        equation=equation.strip(),
        meanings=_meanings(attributes),
    )


def _meanings(attributes: str) -> dict[str, str]:
    """Parameter → sentence, from the lines "a, b: what they are" of a docstring."""
    found: dict[str, str] = {}
    labels: list[str] = []
    for line in inspect.cleandoc(attributes).splitlines():
        if line and not line.startswith(" "):
            names, _, text = line.partition(":")
            labels = [label.strip() for label in names.split(",")]
            found.update(dict.fromkeys(labels, text.strip()))
        else:
            found.update({label: f"{found[label]} {line.strip()}" for label in labels})
    return found
