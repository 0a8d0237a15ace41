"""Cells of a verdict's tables: numbers as people read them, with the number as it is for
programs."""

from __future__ import annotations

from markupsafe import Markup, escape

from flagdata.answer import Quantity
from measure.report import verdict_sentences
from measure.verdict import quantity


def estimate_cell(
    estimate: Quantity | None, display_as: quantity.Display | None = None, *, note: str = ""
) -> Markup:
    """Writes the value over its interval.

    Args:
        note: below it.
    """
    value, ends = quantity.estimate_parts(estimate, display_as=display_as)
    below = Markup('<span class="ends">{}</span>')
    written = _data(estimate.point if estimate else None, value) + below.format(ends)
    return written + below.format(note) if note else written


def full_cell(estimate: Quantity | None) -> Markup:
    """Writes the value, its interval and the interval's level."""
    value, ends = quantity.estimate_parts(estimate)
    ends_text = f"{ends} {quantity.level_text(estimate.level)}" if estimate and ends else ""
    number = _data(estimate.point if estimate else None, value)
    return number + Markup('<span class="ends">{}</span>').format(ends_text)


def parameter_cell(estimate: Quantity) -> Markup:
    """Writes the parameter, unless the data leave it open."""
    text = verdict_sentences.parameter_text(estimate)
    is_plain = text == quantity.with_level(estimate)
    return full_cell(estimate) if is_plain else _data(estimate.point, text)


def number_cell(value: float | None, unit: str = "1") -> Markup:
    """Writes a number without an uncertainty."""
    return _data(value, quantity.number(value)) + ("" if unit == "1" else f" {unit}")


def count_cell(value: int) -> Markup:
    """Writes a count."""
    return _data(value, str(value))


def probability_cell(value: float | None) -> Markup:
    """Writes a p-value."""
    return _data(value, quantity.probability(value))


def errors_cell(value: float | None) -> Markup:
    """Writes a number of standard errors."""
    return _data(value, quantity.in_errors(value))


def share_cell(value: float | None) -> Markup:
    """Writes a fraction."""
    return _data(value, quantity.share(value))


def cell_with_error(value: float, error: float) -> Markup:
    """Writes a number with its standard error."""
    return _data(value, quantity.with_error(value, error))


def name_cell(name: str, note: str = "", *, marked: bool = False) -> Markup:
    """Writes the name of a row.

    Args:
        note: below it.
        marked: whether the row is one of those that the verdict names.
    """
    written = Markup("<b>{}</b>" if marked else "{}").format(name)
    return written + Markup('<br><span class="small">{}</span>').format(note) if note else written


def _data(value: float | None, text: str) -> Markup:
    return (
        Markup(f'<span class="none">{text}</span>')
        if text == quantity.NONE
        else Markup(f'<data value="{value!r}">{escape(text)}</data>')
    )
