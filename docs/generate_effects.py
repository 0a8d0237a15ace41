"""The page of the effects, docs/effects.md, from their registries: `python -m
docs.generate_effects`."""

from __future__ import annotations

import inspect
import math
import sys
from pathlib import Path

from flagdata.recipes.registry import Registry
from sim.effects import EFFECTS, SENSOR_EFFECTS
from sim.effects.parameter import Parameter, Parametrised

PAGE = Path(__file__).with_name("effects.md")
_HEAD = """\
# Effects

This page is generated from the library. An effect is something that the base model of [the simulator](simulator.md)
leaves out. Each has a *null value*, at which it is exactly absent; a *prior*, the range of values to be expected in the
field; and the source of that range. A *strength* switches the effect on; a *shape* says how it looks once it is on.

A recipe of a simulation names an effect by its table, for example `[effects.lift]` with `coefficient = 2.0`; the value
`"prior"` draws one for each member. [Closing the loop](closing-the-loop.md) weighs the effects on the cloth one by one.

An effect is defined in torch. Where a few lines of C++ stand beside its file, `NAME.hpp` beside `NAME.py`, they run in
the simulator's compiled kernel, each in a library that is built when the effect is first used; gradients go by torch.
That holds for [an effect of your own](extending.md#an-effect) too. Where anything that acts has no C++, all that acts
beside the base model runs by torch, at three to ten times the base model's time.
"""


def reference() -> str:
    """The page."""
    on_cloth = "Forces, and changes of the wind, the cloth and its attachments."
    on_sensor = "What anemometers, clocks and cameras do to an observation."
    return "\n".join(
        [
            _HEAD,
            f"## On the cloth\n\n{on_cloth}\n",
            *_sections(EFFECTS),
            f"## On the observation\n\n{on_sensor}\n",
            *_sections(SENSOR_EFFECTS),
        ]
    )


def _sections(effects: Registry) -> list[str]:
    return [_section(name, effects[name]) for name in effects]


def _section(name: str, effect: type[Parametrised]) -> str:
    about = inspect.getdoc(sys.modules[effect.__module__]) or ""
    equation, _, attributes = (inspect.getdoc(effect) or "").partition("\nAttributes:\n")
    meanings = _meanings(attributes)
    parameters = effect.parameters().items()
    return "\n".join(
        [
            f"### {name}\n",
            f"{_plain(about.split(chr(10) * 2)[0])}\n",
            f"{_plain(equation)}\n",
            "| parameter | role | unit | prior | null value |",
            "|---|---|---|---|---|",
            *(
                f"| `{label}` | {e.role} | {e.unit} | {_range(e)} | {e.null:g} |"
                for label, e in parameters
            ),
            "",
            *(
                f"- `{label}`: {_plain(meanings[label])} Prior: {_plain(e.source)}."
                for label, e in parameters
            ),
            "",
        ]
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


def _range(entry: Parameter) -> str:
    return " to ".join("∞" if value == math.inf else f"{value:g}" for value in entry.prior)


def _plain(text: str) -> str:
    """Markdown in which no sign of an equation is taken for emphasis."""
    paragraphs = [" ".join(paragraph.split()) for paragraph in text.strip().split("\n\n")]
    return "\n\n".join(
        p.replace("*", "\\*").replace("_", "\\_").replace("<", "&lt;") for p in paragraphs if p
    )


if __name__ == "__main__":
    PAGE.write_text(reference(), encoding="utf-8")
