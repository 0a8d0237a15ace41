"""The score sheet as JSON, Markdown and a picture."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from flagdata.answer.markdown import plain, table
from flagdata.core.files.outputs import check_files, write_files
from flagdata.core.provenance import code_version
from tests.studies.challenge.classes import class_of
from tests.studies.challenge.rates import Power
from tests.studies.challenge.recipe import Kind
from tests.studies.challenge.score import ENOUGH, Sheet
from tests.studies.figure_bytes import png

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from tests.studies.challenge.outcome import Outcome

_MILLI = 1e3
_FILES = ("challenge-score.json", "challenge-score.md", "challenge-score.png")
_COMMAND = "challenge score"


def as_dict(sheet: Sheet) -> dict[str, Any]:
    """Everything of the sheet as JSON values."""
    coefficients, gaps = (
        sheet.coefficients,
        [o.control_gap for o in sheet.outcomes if o.control_gap is not None],
    )
    return {
        "schema": "flagdata.score/1",
        "title": sheet.title,
        "code_version": code_version(),
        "criteria": list(sheet.criteria),
        "sets": {kind.value: len(sheet.of_kind(kind)) for kind in Kind},
        "strong": len(sheet.strong),
        "gates": [gate.as_dict() for gate in sheet.gates],
        "shares": {name: share.as_dict() for name, share in sheet.shares.items()},
        "reduction": _spread(sheet.reductions, lowest=0.1),
        "coefficient": {
            "relative_error": _spread([abs(e) for e in coefficients.errors], lowest=0.9),
            "bias": float(np.median(coefficients.errors)) if coefficients.errors else None,
            "levels": list(coefficients.levels),
        },
        "control_gap": _spread(gaps, lowest=0.1),
        "power": {
            "by_class": _curve(sheet.power),
            "by_noise": _curve(sheet.by_noise),
            "by_rate": _curve(sheet.by_rate),
        },
        "half_strengths": {effect: asdict(half) for effect, half in sheet.half_strengths.items()},
        "seconds": _spread([o.seconds for o in sheet.outcomes], lowest=0.9),
        "confusion": confusion(sheet),
        "outcomes": [_row(outcome) for outcome in sheet.outcomes],
    }


def confusion(sheet: Sheet) -> dict[str, dict[str, int]]:
    """Truth → verdict → how often."""
    table: dict[str, Counter[str]] = {}
    for outcome in sheet.outcomes:
        table.setdefault(_truth(outcome), Counter())[_said(outcome)] += 1
    return {true: dict(sorted(said.items())) for true, said in sorted(table.items())}


def markdown(sheet: Sheet, *, picture: str | None = None) -> str:
    """The sheet for people."""
    kinds = ", ".join(f"{len(sheet.of_kind(kind))} {kind.value}" for kind in Kind)
    levels = ", ".join(f"{100 * level:g} %" for level in sheet.coefficients.levels)
    acted = [o for o in sheet.outcomes if o.key.impact > 0]
    half = _half_rows(
        "class", sheet.power, Counter(_class_name(o) for o in sheet.of_kind(Kind.ONE))
    )
    if sheet.power is not None:
        half.append(_half_row("class: any other", sheet.power.overall, "–"))
    half += _half_rows(
        "noise, mm", sheet.by_noise, Counter(f"{_MILLI * o.key.noise:g}" for o in acted)
    )
    half += _half_rows("frames a second", sheet.by_rate, Counter(str(o.key.rate) for o in acted))
    gates = [
        (
            g.name,
            _number(g.value),
            f"{'≤' if g.at_most else '≥'} {g.wanted:g}",
            "yes" if g.met else "no",
        )
        for g in sheet.gates
    ]
    shares = [
        (name, f"{one.hits}/{one.count}", _number(one.value), f"[{one.low:.2f}, {one.high:.2f}]")
        for name, one in sheet.shares.items()
    ]
    strengths = [
        (effect, f"{_digits(one.value)} [{_digits(one.low)}, {_digits(one.high)}]", one.unit)
        for effect, one in sheet.half_strengths.items()
    ]
    sets = [
        (
            o.key.name,
            _truth(o, strengths=True),
            f"{_MILLI * o.key.impact:.2g}",
            f"{_MILLI * o.key.noise:g}",
            str(o.key.rate),
            o.key.numerics,
            _said(o),
            _number(o.reduction),
            _number(o.control_gap),
            f"{o.seconds:.0f}",
        )
        for o in sheet.outcomes
    ]
    said = [
        (true, name, str(n)) for true, row in confusion(sheet).items() for name, n in row.items()
    ]
    spreads = (
        f"E_red: {_words(sheet.reductions, 0.1, 'worst decile')}.\n"
        "Relative error of the strength: "
        f"{_words([abs(e) for e in sheet.coefficients.errors], 0.9, 'worst decile')}.\n"
        f"Time for a set: {_words([o.seconds for o in sheet.outcomes], 0.9, 'slowest decile')} s."
    )
    strong = (
        "Half-detection strength, as displacement within 0.1 s, with 90 % bounds; strong effects "
        "are those of "
        f"{ENOUGH:g} times that, {len(sheet.strong)} sets; from outside the library "
        f"{len(sheet.strong_outside)}, by "
        "that of any other class."
    )
    parts = [
        f"# Score: {plain(sheet.title)}",
        f"{len(sheet.outcomes)} sets: {kinds}. Code {code_version()}.",
        table(("gate", "value", "wanted", "met"), gates),
        table(("share", "of", "value", "Clopper–Pearson 90 %"), shares),
        f"The true strengths are to lie in intervals stated at {levels}." if levels else "",
        spreads,
        strong,
        table(("group", "half detected at", "sets"), half),
        table(("effect", "half detected at", "unit"), strengths),
        f"![Power curves]({picture})" if picture is not None else "",
        table(("true", "said", "sets"), said),
        table(
            (
                "set",
                "true",
                "impact, mm",
                "noise, mm",
                "rate",
                "numerics",
                "said",
                "E_red",
                "control gap",
                "s",
            ),
            sets,
        ),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def write(sheet: Sheet, folder: Path) -> tuple[Path, ...]:
    """challenge-score.json, .md and .png into a folder, which is made; their paths.

    Raises:
        ConflictError: one of them is there and was not written by a score, or was changed since.
    """
    document, page, picture = _FILES
    content = (
        json.dumps(as_dict(sheet), indent=1, sort_keys=True, allow_nan=False, ensure_ascii=False)
        + "\n"
    )
    files = {document: content, page: markdown(sheet, picture=picture), picture: plot(sheet)}
    write_files(folder, files, command=_COMMAND)
    return tuple(folder / name for name in _FILES)


def check(folder: Path) -> None:
    """Refuse a folder in which `write` cannot write, before any key is opened; raises as
    `write`."""
    check_files(folder, *_FILES, command=_COMMAND)


def plot(sheet: Sheet) -> bytes:
    """PNG of power curves by class, noise and frame rate; cases above (detected) and below
    (not)."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13, 5.0), layout="constrained")
    panels = figure.subplots(1, 3, sharey=True)
    one = [o for o in sheet.of_kind(Kind.ONE) if o.key.impact > 0]
    acted = [o for o in sheet.outcomes if o.key.impact > 0]
    _panel(panels[0], "one effect, by class", sheet.power, [(_class_name(o), o) for o in one])
    _panel(
        panels[1],
        "any effect, by marker noise [mm]",
        sheet.by_noise,
        [(f"{_MILLI * o.key.noise:g}", o) for o in acted],
    )
    _panel(
        panels[2],
        "any effect, by frames a second",
        sheet.by_rate,
        [(str(o.key.rate), o) for o in acted],
    )
    panels[0].set_ylabel("chance of detection")
    return png(figure)


def _panel(
    axes: Axes, title: str, power: Power | None, cases: Sequence[tuple[str, Outcome]]
) -> None:
    from matplotlib import colormaps

    axes.set_title(title, fontsize=10)
    axes.set_xlabel("impact: displacement within 0.1 s [mm]")
    axes.set_ylim(-0.12, 1.12)
    if power is None:
        return
    impacts = np.array([o.key.impact for _, o in cases])
    grid = np.geomspace(impacts.min() / 2, impacts.max() * 2, 200)
    colours = colormaps["tab20" if len(power.half) > 10 else "tab10"]
    for index, name in enumerate(power.half):
        colour = colours(index)
        axes.semilogx(_MILLI * grid, power.at(grid, name), color=colour, label=name, lw=1.4)
        for group, outcome in cases:
            if group == name:
                height = 1.05 + 0.004 * index if outcome.detected else -0.05 - 0.004 * index
                axes.plot(_MILLI * outcome.key.impact, height, "o", color=colour, ms=4)
    axes.semilogx(
        _MILLI * grid, power.at(grid), color="black", lw=2, label="any other group", ls="--"
    )
    axes.legend(fontsize=7, ncols=3, loc="upper center", bbox_to_anchor=(0.5, -0.16), frameon=False)
    axes.grid(alpha=0.3)


def _half_rows(what: str, power: Power | None, counts: Counter[str]) -> list[tuple[str, str, str]]:
    half = {} if power is None else power.half
    return [
        _half_row(f"{what}: {name}", bounds, str(counts[name])) for name, bounds in half.items()
    ]


def _half_row(group: str, bounds: tuple[float, float, float], count: str) -> tuple[str, str, str]:
    half, low, high = (_digits(_MILLI * value) for value in bounds)
    return group, f"{half} [{low}, {high}] mm", count


def _curve(power: Power | None) -> dict[str, Any] | None:
    if power is None:
        return None
    bounds = {
        name: dict(zip(("half", "low", "high"), values, strict=True))
        for name, values in power.half.items()
    }
    return {"slope": power.slope, "unit": "m", "groups": bounds, "level": 0.9}


def _spread(values: Sequence[float], *, lowest: float) -> dict[str, float | int | None]:
    """Median and the decile that is the worse."""
    if not values:
        return {"median": None, "worst_decile": None, "count": 0}
    return {
        "median": float(np.median(values)),
        "worst_decile": float(np.quantile(values, lowest)),
        "count": len(values),
    }


def _words(values: Sequence[float], worst: float, name: str) -> str:
    if not values:
        return "no cases"
    middle, decile = float(np.median(values)), float(np.quantile(values, worst))
    return f"median {_digits(middle)}, {name} {_digits(decile)}, n = {len(values)}"


def _digits(value: float) -> str:
    """Two digits, and all before the point."""
    return f"{value:.0f}" if abs(value) >= 100 else f"{value:.2g}"


def _row(o: Outcome) -> dict[str, Any]:
    return {
        "key": o.key.as_dict(),
        "conclusion": o.conclusion.value if o.conclusion is not None else "refused",
        "named": list(o.named),
        "detected": o.detected,
        "top_1": o.first_right,
        "class_level": o.class_right,
        "reduction": o.reduction,
        "control_gap": o.control_gap,
        "seconds": o.seconds,
    }


def _class_name(outcome: Outcome) -> str:
    return class_of(outcome.key.effects[0].effect)


def _truth(outcome: Outcome, *, strengths: bool = False) -> str:
    if not outcome.key.effects:
        return "nothing"
    names = [
        f"{a.effect} {a.value:.2g} {a.unit}" if strengths else a.effect for a in outcome.key.effects
    ]
    return " + ".join(names) + (" (outside)" if outcome.key.kind is Kind.OUTSIDE else "")


def _said(outcome: Outcome) -> str:
    if outcome.conclusion is None:
        return "refused"
    return outcome.conclusion.value + (": " + ", ".join(outcome.named) if outcome.named else "")


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}"
