"""Stamps that a spreadsheet cut to minutes and seconds ("42:10.0"), and dates before 1970: no time can be made of them.

A comma-separated file that was opened and saved in a spreadsheet holds what its cells showed, and a stamp with parts
of a second is shown as mm:ss.0 unless the user formats the cell. MCAP counts nanoseconds since 1970 without a sign.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from flagdata.ingest.anemometer.instants.midnight import parse_as
from flagdata.ingest.anemometer.instants.stamps import DAY
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.times.timechoice import TimeChoice
from flagdata.ingest.anemometer.words.headings import names_time, words_of
from flagdata.timebase import iso

_CUT = re.compile(r"(\d{1,2}):([0-5]\d)\.\d")
_DATE = re.compile(
    r"\s*(?:(?P<year>(?:19|20)\d\d)(?P<sign>[-/.]?)(?:0[1-9]|1[0-2])(?P=sign)(?:0[1-9]|[12]\d|3[01])"
    r"|\d{1,2}(?P<between>[-/.])\d{1,2}(?P=between)(?P<last>(?:19|20)\d\d))(?!\d)"
)
"""A date with a year of four digits."""
_OTHER_TIMES = (
    "leave the dates out by --columns, and give --start TIME --rate HZ, with a TIME from 1970 on: the true one where a "
    "clock was never set, else one that stands for it"
)
_YEAR_WORDS = frozenset({"year", "yr", "yyyy", "jahr", "année", "annee", "año", "ano", "anno", "jaar", "år", "rok"})
_LEAST, _STEADY = 3, 0.06
"""Rows that tell, and the difference from the middle step [s] that a clock of tenths leaves a steady rate."""


def before_1970(cells: Sequence[str]) -> bool:
    """Whether cells begin with dates of which most are before 1970."""
    years = [match["year"] or match["last"] for cell in cells if (match := _DATE.match(cell)) is not None]
    return len(years) >= max(_LEAST, 0.9 * len(cells)) and sum(year < "1970" for year in years) > 0.5 * len(years)


def years_before_1970(name: str, cells: Sequence[str]) -> bool:
    """Whether a column of years holds those before 1970 alone."""
    years = [cell for cell in cells if re.fullmatch(r"1[89]\d\d", cell)]
    return bool(_YEAR_WORDS & set(words_of(name))) and len(years) == len(cells) >= _LEAST and max(years) < "1970"


def too_early(column: str, cells: Sequence[str]) -> tuple[str, str]:
    """What is wrong with a column of dates before 1970, and what its owner can do."""
    what = f"column {column} holds dates before 1970 ({cells[0]!r}), which a recording cannot hold"
    return what, _OTHER_TIMES


def of_another_century(layout: Layout, time: TimeChoice, *, now: int) -> tuple[str, str] | None:
    """What is wrong with years of two digits that would all be after `now` [UTC ns]; `None` where they are not."""
    if time.form is None or "%y" not in time.form or time.counts:
        return None
    texts = [" ".join(cells) for cells in zip(*(layout.column(at) for at in time.columns), strict=True)]
    found = parse_as([text for text in texts if text.strip()], time.form)[0]
    if not found.valid.any() or int(found.ns[found.valid].min()) <= now + DAY:
        return None
    year = iso(int(found.ns[found.valid].min()))[:4]
    what = f"years of two digits would be {year} and later, after today, and a recording cannot hold dates before 1970"
    return what, _OTHER_TIMES


def doubt(layout: Layout) -> tuple[str, str] | None:
    """What a column of times lacks, and what its owner can do; `None` where no column was cut so or is too early."""
    for at, name in enumerate(layout.names):
        cells = [cell for cell in layout.column(at) if cell]
        if (names_time(name) and before_1970(cells)) or years_before_1970(name, cells):
            return too_early(repr(name), cells)
    for at, name in enumerate(layout.names):
        cells = [cell for cell in layout.column(at) if cell]
        found = [_CUT.fullmatch(cell) for cell in cells]
        parts = [(int(match[1]), float(match[0].split(":")[1])) for match in found if match is not None]
        if len(parts) < _LEAST or len(parts) < len(cells) or not names_time(name) or max(parts)[0] > 59:
            continue
        what = f"column {name!r} holds minutes and seconds only ({cells[0]!r}), as a spreadsheet shows whole stamps"
        fix = (
            "take the file as the logger wrote it, or show the whole stamp in the spreadsheet (a cell format such as "
            "yyyy-mm-dd hh:mm:ss.0) and export it again"
        )
        steps = np.diff([60.0 * minute + second for minute, second in parts]) % 3600.0
        step = float(np.median(steps))
        if step > 0 and float(np.abs(steps - step).max()) <= _STEADY:
            minute, second = parts[0]
            start = f"when the first row was written, its minutes and seconds being {minute:02d}:{second:04.1f}"
            fix += f"; or, as the first rows are {step:g} s apart: --rate {1 / step:g} --start TIME, with TIME {start}"
        return what, fix
    return None
