"""The pages of the effects, docs/effects.md and the folder beside it, from their registries:
`python -m docs.generate_effects`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from measure.report.effect_answer import answer_effect
from sim.effects import EFFECTS, SENSOR_EFFECTS
from sim.effects.description import describe
from sim.effects.effect import (
    ClothEffect,
    Effect,
    FlowEffect,
    ForceEffect,
    PressureEffect,
    WindEffect,
)
from sim.effects.parameter import Parameter, Parametrised
from sim.effects.sensor import AnemometerEffect, CameraEffect, ClockEffect

PAGE = Path(__file__).with_name("effects.md")
FOLDER = Path(__file__).with_name("effects")
_HEAD = """\
# Effects

This page is generated from the library; `flagdata catalog effects NAME` says the same of one effect, also of an installed
package's, and with `--report FILE` draws where on a flag it acts. An effect is something that the base model of [the simulator](simulator.md)
leaves out. Each has a *null value*, at which it is exactly absent; a *prior*, the range of values to be expected in the
field; and the source of that range. A *strength* switches the effect on; a *shape* says how it looks once it is on.

A recipe of a simulation names an effect by its table, for example `[effects.lift]` with `coefficient = 2.0`; the value
`"prior"` draws one for each member. [Closing the loop](closing-the-loop.md) weighs the effects on the cloth one by one.

An effect is defined in torch. Where a few lines of C++ stand beside its file, `NAME.hpp` beside `NAME.py`, they run in
the simulator's compiled kernel, each in a library that is built when the effect is first used; gradients go by torch.
That holds for [an effect of your own](extending.md#an-effect) too. Where anything that acts has no C++, all that acts
beside the base model runs by torch, at three to ten times the base model's time.
"""
Shown = Mapping[str, type[Parametrised]]


@dataclass(frozen=True)
class Family:
    """Effects on a page of their own.

    Attributes:
        name: of the page's file.
        title: of the page.
        about: what they have in common.
        kinds: classes, one of which each effect derives from first.
        more: names of others that belong here.
    """

    name: str
    title: str
    about: str
    kinds: tuple[type[Parametrised], ...]
    more: tuple[str, ...] = ()


FAMILIES = (
    Family(
        "forces",
        "Forces of the air",
        "Forces on the faces of the cloth, and factors on the base model's force.",
        (ForceEffect, PressureEffect),
        ("wagner-lag",),
    ),
    Family(
        "wind", "Wind", "Changes of the wind that blows on the cloth.", (WindEffect, FlowEffect)
    ),
    Family(
        "cloth",
        "Cloth and attachment",
        "Changes of the cloth itself, and of how it is held.",
        (ClothEffect, Effect),
    ),
    Family(
        "anemometers",
        "Anemometers",
        "What an anemometer and its place do to the wind that it logs.",
        (AnemometerEffect,),
    ),
    Family(
        "clocks-and-cameras",
        "Clocks and cameras",
        "What clocks and cameras do to an observation.",
        (ClockEffect, CameraEffect),
    ),
)


def pages() -> dict[Path, str]:
    """The pages with their text: the list of all effects, and one page a family."""
    groups = [(family, _members(family)) for family in FAMILIES]
    rows = [
        _row(family, name, effect) for family, found in groups for name, effect in found.items()
    ]
    listed = f"{_HEAD}\n| family | effect | what it is |\n|---|---|---|\n" + "\n".join(rows) + "\n"
    return {PAGE: listed} | {
        FOLDER / f"{family.name}.md": _page(family, found) for family, found in groups
    }


def _members(family: Family) -> Shown:
    others = {name for one in FAMILIES if one is not family for name in one.more}
    return {
        name: registry[name]
        for registry in (EFFECTS, SENSOR_EFFECTS)
        for name in registry
        if name not in others and (name in family.more or registry[name].__mro__[1] in family.kinds)
    }


def _row(family: Family, name: str, effect: type[Parametrised]) -> str:
    link = f"[`{name}`](effects/{family.name}.md#{name})"
    return f"| {family.title} | {link} | {_plain(describe(effect).about)} |"


def _page(family: Family, effects: Shown) -> str:
    head = (
        f"# Effects: {family.title.lower()}\n\n{family.about} This page is generated from the library; "
        "[effects](../effects.md) lists all, and says what null value, prior, strength and shape mean.\n"
    )
    return "\n".join([head, *(_section(name, effect) for name, effect in effects.items())])


def _section(name: str, effect: type[Parametrised]) -> str:
    described = describe(effect)
    parameters = effect.parameters().items()
    weighed = _weighed(name, effect) if issubclass(effect, Effect) else []
    return "\n".join(
        [
            f"## {name}\n",
            f"{_plain(described.about)}\n",
            f"{_plain(described.equation)}\n",
            "| parameter | role | unit | prior | null value |",
            "|---|---|---|---|---|",
            *(
                f"| `{label}` | {e.role} | {e.unit} | {_range(e)} | {e.null:g} |"
                for label, e in parameters
            ),
            "",
            *(
                f"- `{label}`: {_plain(described.meanings[label])} Prior: {_plain(e.source)}."
                for label, e in parameters
            ),
            *(["", *weighed] if weighed else []),
            "",
        ]
    )


def _weighed(name: str, effect: type[Effect]) -> list[str]:
    """How verdicts weigh it, as `flagdata catalog effects NAME` says it."""
    answer = answer_effect(name)
    strengths = [
        f"`{label}` {' to '.join(f'{end:g}' for end in row['weighed'])}"
        + (f" {row['unit']}" if row["unit"] != "1" else "")
        for label, row in answer.document["parameters"].items()
        if "weighed" in row and not effect.unweighed
    ]
    facts = [f"{fact}: {_plain(text)}" for fact, text in answer.head.facts.items()]
    said = [*([f"strengths beyond null {', '.join(strengths)}"] if strengths else []), *facts]
    return ["Closing the loop: " + "; ".join(said) + "."]


def _range(entry: Parameter) -> str:
    return " to ".join("∞" if value == math.inf else f"{value:g}" for value in entry.prior)


def _plain(text: str) -> str:
    """Markdown in which no sign of an equation is taken for emphasis."""
    paragraphs = [" ".join(paragraph.split()) for paragraph in text.strip().split("\n\n")]
    return "\n\n".join(
        p.replace("*", "\\*").replace("_", "\\_").replace("<", "&lt;") for p in paragraphs if p
    )


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for path, text in pages().items():
        path.write_text(text, encoding="utf-8")
