"""A table's second time: the part of a second in a column of its own, or another clock's stamp of the same rows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from flagdata.ingest.anemometer.instants import counted
from flagdata.ingest.anemometer.instants.midnight import parse_as
from flagdata.ingest.anemometer.instants.stamps import Stamps, is_date_alone
from flagdata.ingest.anemometer.text.cells import numbers
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.times.timechoice import SHARE, TimeChoice, whole_numbers
from flagdata.ingest.anemometer.words.headings import names_time, words_of
from flagdata.timebase import NANOSECONDS

_PARTS: tuple[tuple[str, int, frozenset[str]], ...] = (
    ("%L", 999, frozenset({"ms", "msec", "msecs", "millis", "milli", "millisecond", "milliseconds"})),
    ("%U", 999_999, frozenset({"us", "usec", "usecs", "micros", "microsecond", "microseconds"})),
    ("%N", 999_999_999, frozenset({"ns", "nsec", "nsecs", "nanos", "nanosec", "nanosecond", "nanoseconds"})),
)
"""Parts of a second: directive, largest number, words of headings."""
_IN_WORDS = {"%L": "milliseconds", "%U": "microseconds", "%N": "nanoseconds"}
_ALIKE = 0.7
"""Scores of two times within this are those of times that their headings do not tell apart."""
_STAMP, _ABOUT_SURE = 2, 2.0
"""Columns that hold a stamp at most, and the score from which a choice is of a date and a time."""
_QUARTER, _NEAR = 900.0, 60.0
"""Quarters of an hour, which zones are apart, and what stamps of the same rows may differ by beside [s]."""
_EVENER = 0.5
"""A clock is steadier than another where its steps deviate by less than this share of the other's."""

TimeAs = Callable[[Layout, tuple[int, ...], str], TimeChoice | None]


def with_part_of_second(layout: Layout, choice: TimeChoice, time_as: TimeAs) -> TimeChoice:
    """A time to the second with the column of its milli-, micro- or nanoseconds, where there is one.

    A heading says so; without headings, whole numbers behind a Unix time do that make stamps which repeat rise.

    Args:
        time_as: reads columns as a format.
    """
    form = {"epoch-s": "%s", "iso": "%Y-%m-%d %H:%M:%S%z"}.get(choice.form or "", choice.form or "")
    form = form.removesuffix("%f")
    if not form.endswith(("%s", "%S", "%S%z")) or _read(layout, choice).step < NANOSECONDS:
        return choice
    named = any(layout.names)
    places = range(layout.number_of_columns()) if named else (choice.columns[-1] + 1,)
    for at in places:
        if at in choice.columns or at >= layout.number_of_columns():
            continue
        cells = [cell for cell in layout.column(at) if cell]
        words = words_of(layout.names[at])
        for directive, most, known in _PARTS:
            said = bool(words) and words[0] in known and len(words) == 1
            if not whole_numbers(cells, 0, most) or (named and not said) or (not named and form != "%s"):
                continue
            found = time_as(layout, (*choice.columns, at), f"{form} {directive}")
            if found is None or (not named and not _makes_rise(layout, choice, found)):
                continue
            remark = (
                f"column {at + 1} is taken as the {_IN_WORDS[directive]} of column {choice.columns[-1] + 1}: with them "
                "the stamps rise from row to row, and without they repeat"
            )
            return replace(found, zone=choice.zone, remark=choice.remark if named else remark)
    return choice


def settle(layout: Layout, best: TimeChoice, others: Sequence[TimeChoice]) -> TimeChoice:
    """The time among two clocks' stamps of the same rows, with what was chosen and why.

    Two columns that agree to the coarser one's resolution are one clock, and the finer one is taken. Of two clocks the
    one whose steps are steadier is taken, since a server's stamps wait for the network; else the better heading.
    """
    if not _whole(best):
        return best
    for other in others:
        if not _whole(other) or set(other.columns) & set(best.columns) or other.score < best.score - _ALIKE:
            continue
        one, two = _read(layout, best), _read(layout, other)
        if len(one.ns) != len(two.ns) or not (one.utc & two.utc).all() or not _moves(two) or not _moves(one):
            continue
        apart = (two.ns - one.ns) / NANOSECONDS
        if np.abs(apart).max() * NANOSECONDS < max(one.step, two.step):
            best = other if two.step < one.step else best
            continue
        steady = _unsteady(two) < _EVENER * _unsteady(one)
        taken, left = (other, best) if steady else (best, other)
        steadier = steady or _unsteady(one) < _EVENER * _unsteady(two)
        why = "its steps are steadier" if steadier else "it comes first, or its heading says more"
        remark = (
            f"{_shown(layout, best)} and {_shown(layout, other)} are both times, {apart.min():.4g} to "
            f"{apart.max():.4g} s apart: {_shown(layout, taken)} is taken, since {why}; to take "
            f"{_shown(layout, left)}, name it as time in --columns"
        )
        return replace(taken, remark=remark)
    return best


def left_out(layout: Layout, best: TimeChoice, choices: Sequence[TimeChoice]) -> tuple[int, ...]:
    """The columns of other stamps of a date and a time, by their headings and cells, beside the time that is taken."""
    found: set[int] = set()
    for choice in choices:
        if choice.counts or not _dated(choice.form) or len(choice.columns) > _STAMP or choice.score < _ABOUT_SURE:
            continue
        if not set(choice.columns) & set(best.columns) and all(names_time(layout.names[at]) for at in choice.columns):
            found |= set(choice.columns)
    return tuple(sorted(found))


def disagreement(layout: Layout, best: TimeChoice, choices: Sequence[TimeChoice]) -> str | None:
    """What is said of other stamps of the rows that are farther from the time than a row, their zones apart.

    Zones are whole quarters of an hour apart. Stamps by whose headings a period begins or ends lie a period apart.
    """
    if best.form is None or best.counts:
        return None
    one = _read(layout, best)
    others = set(left_out(layout, best, choices))
    for choice in choices:
        if choice.form is None or not _dated(choice.form) or not set(choice.columns) <= others:
            continue
        two = _read(layout, choice)
        if len(one.ns) != len(two.ns) or not _moves(one) or not _moves(two):
            continue
        apart = (two.ns - one.ns) / NANOSECONDS
        beside = apart - _QUARTER * np.round(np.median(apart) / _QUARTER)
        row = float(np.median(np.diff(one.ns))) / NANOSECONDS
        if np.abs(beside).max() > max(row, _NEAR) and np.ptp(apart) > _NEAR:
            return (
                f"{_shown(layout, choice)} is another time of the rows, {apart.min():.6g} to {apart.max():.6g} s from "
                f"{_shown(layout, best)}, which is taken: the two clocks do not agree; to take the other, name it as "
                "time in --columns"
            )
    return None


def _whole(choice: TimeChoice) -> bool:
    """Whether a choice is of instants, without anything left to say."""
    form = choice.form
    return form is not None and not choice.counts and choice.zoned and not is_date_alone(form)


def _dated(form: str | None) -> bool:
    """Whether a format is of a date with a time of day; one that is still to be said may be."""
    form = form or ""
    return not (is_date_alone(form) or counted.is_elapsed(form) or counted.needs_date(form))


def _read(layout: Layout, choice: TimeChoice) -> Stamps:
    texts = [" ".join(cells) for cells in zip(*(layout.column(at) for at in choice.columns), strict=True)]
    return parse_as(texts, choice.form or "")[0]


def _moves(found: Stamps) -> bool:
    """Whether stamps go on from row to row."""
    steps = np.diff(found.ns)
    return (
        bool(found.valid.all()) and len(steps) > 1 and float((steps >= 0).mean()) >= SHARE and bool(np.any(steps > 0))
    )


def _unsteady(found: Stamps) -> float:
    """The mean deviation of the steps from their median [ns]."""
    steps = np.diff(found.ns).astype(np.float64)
    return float(np.abs(steps - np.median(steps)).mean())


def _makes_rise(layout: Layout, choice: TimeChoice, found: TimeChoice) -> bool:
    """Whether stamps that repeat rise with the part of a second behind them."""
    before, after = _read(layout, choice), _read(layout, found)
    varied = len(set(numbers(layout.column(found.columns[-1])).value.tolist())) > 1
    repeated = bool(np.any(np.diff(before.ns) == 0))
    return varied and repeated and bool(after.valid.all()) and bool(np.all(np.diff(after.ns) > 0))


def _shown(layout: Layout, choice: TimeChoice) -> str:
    return " and ".join(
        f"column {layout.names[at]!r}" if layout.names[at] else f"column {at + 1}" for at in choice.columns
    )
