"""Dates without a time of day, which several rows share: nothing tells when within the day each row was read."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

from flagdata.ingest.anemometer.instants.stamps import is_date_alone
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.times.timechoice import SHARE, TimeChoice
from flagdata.ingest.anemometer.words.headings import names_time

_DATE = re.compile(
    r"\s*(?:\d{4}(?P<y>[-/.])\d{1,2}(?P=y)\d{1,2}|\d{1,2}(?P<d>[-/.])\d{1,2}(?P=d)(?:\d{4}|\d{2})"
    r"|\d{1,2}(?P<m>[-/ ])[A-Za-z]{3,9}(?P=m)(?:\d{4}|\d{2}))\s*"
)
_EIGHT = re.compile(r"\s*(?:19|20)\d\d(?:0[1-9]|1[0-2])(?:0[1-9]|[12]\d|3[01])\s*")
"""A date in one number, which is one only below a heading that says so."""
SHARED = 0.5
"""Share of the rows that have the date of another, from which it is no log of a row a day."""


def column(layout: Layout) -> int | None:
    """The first column of dates without a time of day that rows share; `None` where there is none."""
    own = _others(layout.rows)
    for index, name in enumerate(layout.names):
        cells = [row[index].strip() for row in own if row[index].strip()]
        dates = sum(bool(_DATE.fullmatch(cell) or (names_time(name) and _EIGHT.fullmatch(cell))) for cell in cells)
        if cells and dates >= SHARE * len(own) and _share_dates([(cell,) for cell in cells]):
            return index
    return None


def are_time(layout: Layout, time: TimeChoice, site: tuple[int, str] | None) -> bool:
    """Whether a time is of dates alone, which the rows of one anemometer share.

    Args:
        site: column and text of the rows that are its own, where a table mixes sites.
    """
    if time.form is None or not is_date_alone(time.form):
        return False
    own = [row for row in _others(layout.rows) if site is None or row[site[0]].strip() == site[1]]
    return _share_dates([tuple(row[index] for index in time.columns) for row in own])


def _others(rows: Sequence[tuple[str, ...]]) -> Sequence[tuple[str, ...]]:
    """The rows without copies of them."""
    return tuple(dict.fromkeys(rows))


def _share_dates(dates: Sequence[tuple[str, ...]]) -> bool:
    """Whether most of a log's rows have the date of another."""
    return sum(count for count in Counter(dates).values() if count > 1) >= max(1, SHARED * len(dates))
