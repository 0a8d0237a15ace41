"""Columns of an unknown table that are a time whose date has no year, or is a day's number."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

import numpy as np

from flagdata.errors import TimeError
from flagdata.ingest.anemometer.instants import counted
from flagdata.ingest.anemometer.instants.dates import Order, decide
from flagdata.ingest.anemometer.text.cells import numbers
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.times.dateparts import CLOCKS, read
from flagdata.ingest.anemometer.times.timechoice import SHARE, TimeChoice, fits, share, whole_numbers
from flagdata.ingest.anemometer.words.headings import names_time, words_of

_NAME = r"(?:jan|feb|mar|apr|may|jun|jul|aug|sep|oct|nov|dec)[a-z]{0,6}\.?"
_NAMED = re.compile(
    rf"\s*(?P<weekday>(?:mon|tue|wed|thu|fri|sat|sun)[a-z]{{0,6}}\.?,?\s+)?"
    rf"(?:{_NAME}(?P<after>[ /-])\s?\d{{1,2}}|\d{{1,2}}(?P<before>[ /-]){_NAME})"
    r"(?:,?\s+(?P<clock>\d{1,2}:\d\d.*))?\s*$",
    re.IGNORECASE,
)
_NUMBERED = re.compile(r"\s*(\d{1,2})([-/.])(\d{1,2})(\.?)(?:,?\s+(?P<clock>\d{1,2}[:h]\d\d.*))?\s*$")
_MONTH = re.compile(rf"\s*{_NAME}\s*$", re.IGNORECASE)
_DAY = re.compile(r"\s*\d{1,2}\s*$")
_CLOCK = re.compile(r"\s*\d{1,2}:\d{2}")
_ON = 0.5
"""Share of the falls of a clock at which the number of the day must rise for it to be one."""
_SCORE = 1.9
"""Below a time with its year, above a time of day alone."""


def choices(
    layout: Layout, columns: Sequence[Sequence[str]], clocks: Sequence[int], order: Order | None
) -> Iterator[TimeChoice]:
    """Times without a year.

    Args:
        columns: the cells of each.
        clocks: columns that are times of day.
        order: of dates written with numbers only, as the user says.
    """
    for index, cells in enumerate(columns):
        filled = [cell for cell in cells if cell]
        if not filled or not (share(_NAMED, filled) or share(_NUMBERED, filled)):
            continue
        whole = [match for cell in filled if (match := _NAMED.match(cell) or _NUMBERED.match(cell))]
        if sum(match["clock"] is not None for match in whole) > len(whole) / 2:
            yield from _dated(layout, columns, (index,), order)
        elif names_time(layout.names[index]) or whole[0].re is _NAMED or "/" in filled[0]:
            for clock in clocks:
                yield from _dated(layout, columns, (index, clock), order)
    for index in range(len(columns) - 2):
        parts = [[cell for cell in columns[at] if cell] for at in range(index, index + 3)]
        if all(parts) and all(share(*pair) for pair in zip((_MONTH, _DAY, _CLOCK), parts, strict=True)):
            taken, forms = (index, index + 1, index + 2), [f"%b %d {clock}" for clock in CLOCKS]
            yield from read(layout, columns, taken, forms, score=_SCORE)
    for index, heading in enumerate(layout.names):
        if words_of(heading) in (["day"], ["day", "number"], ["day", "no"], ["day", "index"]):
            for clock in clocks:
                if _counts_days(columns[index], columns[clock]):
                    forms = [f"%D {clock_form}" for clock_form in CLOCKS[:2]]
                    yield from read(layout, columns, (index, clock), forms, score=_SCORE)


def _dated(
    layout: Layout, columns: Sequence[Sequence[str]], taken: tuple[int, ...], order: Order | None
) -> Iterator[TimeChoice]:
    """A date without its year in the first of these columns, with the clock behind it or in the second."""
    cells = [cell for cell in columns[taken[0]] if cell]
    match = _NAMED.match(cells[0])
    if match is not None:
        sign = match["after"] or match["before"]
        date = f"%b{sign}%d" if match["after"] else f"%d{sign}%b"
        date = f"%a {date}" if match["weekday"] else date
    else:
        padded = [_NUMBERED.sub(r"\1/\3/2000", cell) for cell in cells]
        found = _NUMBERED.match(cells[0])
        sign, end = (found[2], found[4]) if found is not None else ("/", "")
        padded = [text.replace("/", sign) for text in padded]
        try:
            decision = decide(padded, told=order, where="")
        except TimeError as error:
            yield TimeChoice(
                columns=taken, form=None, zone=None, zoned=False, score=_SCORE, doubt=error.what.replace("/2000", ""),
                fix=error.fix,
            )  # fmt: skip
            return
        date = decision.directives().removesuffix(f"{sign}%Y") + end
    yield from read(layout, columns, taken, [f"{date} {clock}" for clock in CLOCKS], score=_SCORE)


def _counts_days(days: Sequence[str], clock: Sequence[str]) -> bool:
    """Whether a column of whole numbers goes on by days where the clock beside it falls."""
    if not whole_numbers(days, 0, 99_999):
        return False
    form = next((form for form in CLOCKS[:2] if fits(counted.parse(clock, form))), None)
    if form is None:
        return False
    time, day = counted.parse(clock, form).ns, np.diff(numbers(days).value)
    falls = np.diff(time) < 0
    if not falls.any():
        return False
    # Where the rows of another device begin, the days begin again.
    return float((day[falls] >= 1).mean()) >= _ON and float((day[~falls] == 0).mean()) >= SHARE
