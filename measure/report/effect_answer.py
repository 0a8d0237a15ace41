"""An effect of the registry as an answer: its equation and parameters, how strong verdicts weigh
it, which recordings show it, and where on a flag it acts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import torch

from flagdata.answer.answer import Answer, Figure, Head, Section, Table
from flagdata.answer.charts import Chart
from flagdata.core.arrays import FloatArray
from flagdata.core.json_values import json_values
from measure.forecasting.strengths import Strengths, every_strength, why_unweighed
from measure.report.error_maps import moved_chart
from sim.cloth.material import named_material
from sim.cloth.scene import assemble, flag
from sim.cloth.state import State
from sim.effects import EFFECTS
from sim.effects.description import describe
from sim.effects.parameter import Parameter
from sim.effects.weighing import CLASSES, Need
from sim.integrate.split import SplitEuler

_WIND, _COLUMNS = 5.0, 12
_SETTLE, _STARTS, _APART = 2.0, 24, 0.1
_HORIZON = 0.04
_FIELD = (
    f"By how much {{}} of {{}} moves a flag of 1.5 m × 1.0 m in {_HORIZON:g} s, on average over "
    f"{_STARTS} moments of its flutter in {_WIND:g} m/s along x; z is up."
)


def answer_effect(name: str) -> Answer:
    """Answers what an effect of the registry is.

    Raises:
        UnknownNameError: none of that name; the nearest is named.
        PlugInError: a package's effect that cannot be used.
    """
    effect = EFFECTS[name]
    described = describe(effect)
    strengths = [one for one in every_strength() if one.column.effect == name]
    rows = {label: _parameter(one) for label, one in effect.parameters().items()}
    for one in strengths:
        rows[one.column.parameter] |= {
            "weighed": [one.low, one.high],
            "expected": one.expected,
            "signs": list(one.signs),
            "step": one.column.step,
        }
    for label, row in rows.items():
        row["meaning"] = described.meanings.get(label, "")
    shown = _shown(name)
    alike = [
        other
        for other, kind in EFFECTS.usable()
        if effect.effect_class and kind.effect_class == effect.effect_class and other != name
    ]
    document = {
        "effect": name,
        "about": described.about,
        "equation": described.equation,
        "package": EFFECTS.package(name),
        "parameters": rows,
        "recordings": shown,
        "class": effect.effect_class or None,
        "confused_with": alike,
        "copied": None if effect.copied is None else vars(effect.copied),
    }
    return Answer(
        question="catalog",
        subject=name,
        sentence=described.about,
        document=json_values(document),
        head=Head(remarks=[described.equation], facts=_facts(name, shown, alike)),
        make_sections=lambda: [
            Section(title="Parameters", parts=parameter_tables(rows)),
            Section(title="Where it acts", parts=_figures(strengths)),
        ],
    )


def parameter_tables(rows: Mapping[str, Mapping[str, Any]]) -> list[Table]:
    """Makes the tables of an effect's parameters, as `answer_effect` has them: numbers, words."""
    numbers = [
        [
            name,
            row["unit"],
            f"{row['null']:g}",
            _ends(row["prior"]),
            _ends(row["weighed"]) if "weighed" in row else row["role"],
            _expected(row),
        ]
        for name, row in rows.items()
    ]
    columns = ["parameter", "unit", "none", "prior", "weighed", "expected"]
    words = {name: f"{row['meaning']} Prior: {row['source']}." for name, row in rows.items()}
    return [
        Table(columns=columns, rows=numbers, caption="Weighed are strengths beyond none."),
        Table.of_values(words),
    ]


def _parameter(described: Parameter) -> dict[str, Any]:
    names = ("unit", "null", "prior", "source")
    return {"role": described.role.value, **{name: getattr(described, name) for name in names}}


def _ends(values: tuple[float, float]) -> str:
    return " to ".join(f"{value:g}" for value in values)


def _expected(row: Mapping[str, Any]) -> str:
    if "expected" not in row:
        return ""
    sign = {(1,): "+", (-1,): "−"}.get(tuple(row["signs"]), "±")
    return f"{sign}{row['expected']:.2g}"


def _shown(name: str) -> dict[str, str]:
    """Kind of recordings → whether verdicts on them weigh an effect, or why they do not."""
    shown: dict[str, str] = {}
    kinds = {Need.MARKERS, Need.FILMS}
    for kind in sorted(kinds):
        why_not = why_unweighed({*Need} - (kinds - {kind}) - {Need.MAST}).get(name)
        beside = [f"{need} ({why})" for need, why in EFFECTS[name].needs.items() if need != kind]
        where = f"weighed, given {' and '.join(beside)}" if beside else "weighed"
        shown[kind.value] = where if why_not is None else f"not weighed: {why_not}"
    return shown


def _facts(name: str, shown: Mapping[str, str], alike: list[str]) -> dict[str, str]:
    effect = EFFECTS[name]
    kinds = [" or ".join(shown)] if len({*shown.values()}) == 1 else shown
    facts = {f"from {kind}": text for kind, text in zip(kinds, shown.values(), strict=False)}
    if alike:
        facts["hardly separated from"] = f"{', '.join(alike)} ({CLASSES[effect.effect_class]})"
    if (copied := effect.copied) is not None:
        facts["done as well by"] = f"{copied.by}; shown by {copied.shown_by} ({copied.how})"
    if (package := EFFECTS.package(name)) is not None:
        facts["from"] = package
    return facts


def _figures(strengths: list[Strengths]) -> list[Figure]:
    figures = []
    for one in strengths:
        amount = one.expected * one.signs[0]
        unit = "" if one.column.unit == "1" else f" {one.column.unit}"
        said = _FIELD.format(one.column.parameter.replace("_", " "), f"{amount:.2g}{unit}")
        figures.append(Figure(title=said, content=lambda one=one: field_chart(one), caption=said))
    return figures


def field_chart(strength: Strengths) -> Chart:
    """Draws by how much an effect of its expected strength moves a fluttering flag, in each
    direction, over the cloth."""
    rest, moved = move_by(strength)
    return moved_chart(rest.tolist(), moved)


def move_by(strength: Strengths) -> tuple[FloatArray, FloatArray]:
    """Computes by how much an effect of its expected strength moves a flag that flutters.

    Returns:
        Rest coordinates (vertex, 2) and displacements (moment, vertex, 3) [m].
    """
    scene = flag(material=named_material("camel-ponte-roma"), wind_speed=_WIND, columns=_COLUMNS)
    rest, integrator = scene.mesh.rest, SplitEuler()
    along = np.stack([rest[:, 0], 0.02 * np.sin(7 * rest[:, 0]), rest[:, 1]], axis=1)
    scene = replace(scene, position=along)
    system, state = assemble([scene])
    state = integrator.advance(system, state, _SETTLE)
    starts: list[State] = []
    for _ in range(_STARTS):
        starts.append(state)
        state = integrator.advance(system, state, _APART)
    many, begin = assemble([scene] * _STARTS)
    begin = replace(
        begin,
        position=torch.cat([one.position for one in starts], dim=-1),
        velocity=torch.cat([one.velocity for one in starts], dim=-1),
    )
    amount = strength.expected * strength.signs[0]
    acted = strength.column.apply_strength(amount, many, begin)
    ends = [integrator.advance(*pair, _HORIZON).position for pair in ((many, begin), acted)]
    return rest, (ends[1] - ends[0]).permute(2, 0, 1).double().numpy()
