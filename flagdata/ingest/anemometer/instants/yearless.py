"""Stamps whose date has no year, or is a day's number from an unknown start: the user gives the first row's date.

%m %d, %b %d with a clock   of the year of that date; the next year begins where the date falls by half a year
%j or %J                    the same of days of the year
%D with a clock             a day's number; the first row's is that of the date
"""

# pyarrow.compute makes its functions at import, where a type checker cannot see them.
# pyright: reportAttributeAccessIssue=false
from __future__ import annotations

import datetime as dt

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from flagdata.errors import TimeError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.instants import stamps
from flagdata.ingest.anemometer.instants.stamps import DAY, Stamps

_LEAP = 2000
"""The year in which stamps are read that name none: it has a 29 February."""
_START = int(np.datetime64(f"{_LEAP}-01-01", "ns").astype(np.int64))


def is_yearless(form: str) -> bool:
    """Whether a format has a date in it but no year."""
    letters = {form[at + 1] for at in range(len(form) - 1) if form[at] == "%"}
    return bool(letters & set("mbdjJD")) and not letters & set("Yys")


def full(form: str) -> str:
    """The format with a year before it."""
    return f"%Y {form}"


def parse(text: pa.StringArray, form: str) -> Stamps:
    """Stamps as of a leap year, numbered days as since its beginning.

    Raises:
        UsageError: see `stamps.pattern`.
    """
    return stamps.parse(pc.binary_join_element_wise(str(_LEAP), text, " "), full(form))


def numbered(form: str) -> bool:
    """Whether the days are numbered from a start that is not stated."""
    return "%D" in form


def missing(form: str, first: int | None = None) -> tuple[str, str]:
    """What the stamps lack and how to say it.

    Args:
        first: the first row's stamp as `parse` reads it; `None` where it is not known.
    """
    if numbered(form):
        return (
            "the days are numbered, and the file does not say of which date they are",
            "give the day of the first row: --date DATE",
        )
    what = "the stamps have no year"
    if first is None or "%j" in form or "%J" in form:
        day = "" if first is None else f", number {(first - _START) // DAY + 1} of its year"
        return what, f"give the day of the first row{day}: --date DATE"
    month_and_day = str(np.datetime64(first, "ns"))[5:10]
    return what, f"give the day of the first row with its year: --date YYYY-{month_and_day}, the year in place of YYYY"


def on_years(
    wall: NDArray[np.int64], form: str, *, date: dt.date | None, line: NDArray[np.int64], where: str
) -> tuple[NDArray[np.int64], tuple[Finding, ...]]:
    """Wall-clock nanoseconds of stamps that `parse` has read, in the order of time, from the first row's date on.

    Raises:
        TimeError: nobody said the first row's date, it is another day of the year, or a year has no such day.
    """
    first = int(wall[0]) if len(wall) else 0
    if date is None:
        what, fix = missing(form, first)
        raise TimeError(what, where=f"{where}, line {line[0]}", fix=fix)
    given = int(np.datetime64(date, "ns").astype(np.int64))
    if numbered(form):
        what = f"numbered days; the first row is of {date.isoformat()}, as given"
        found = Finding(kind="date-given", severity=Severity.NOTE, what=what)
        return wall - (first - _START) // DAY * DAY - _START + given, (found,)
    falls = np.diff(wall) < -183 * DAY
    years = date.year + np.concatenate(([0], np.cumsum(falls)))
    time = _of_years(wall, years, ordinal="%j" in form or "%J" in form)
    lost = np.flatnonzero(time < 0)
    if len(lost):
        row = int(lost[0])
        what = f"{years[row]} has no such day as this row's"
        raise TimeError(
            what, where=f"{where}, line {line[row]}", fix="give --date with the year in which the log began"
        )
    if not given <= int(time[0]) < given + DAY + 1:  # 24:00 is of the day that ends
        day = np.datetime64(int(time[0]), "ns").astype("datetime64[D]")
        what = f"the first row is of {day}, if of {date.year}, and not of {date.isoformat()}"
        raise TimeError(what, where=f"{where}, line {line[0]}", fix=f"give its day with its year, such as --date {day}")
    passed = f"and {int(falls.sum())} new years follow"
    what = f"stamps without a year; the first row is of {date.isoformat()}, as given, {passed}"
    return time, (Finding(kind="date-given", severity=Severity.NOTE, what=what),)


def _of_years(wall: NDArray[np.int64], years: NDArray[np.int64], *, ordinal: bool) -> NDArray[np.int64]:
    """The stamps in other years than that in which they were read [ns]; -1 where a year has no such day."""
    start = (years - 1970).astype("datetime64[Y]").astype("datetime64[ns]").astype(np.int64)
    following = (years - 1969).astype("datetime64[Y]").astype("datetime64[ns]").astype(np.int64)
    if ordinal:
        time = start + wall - _START
        return np.where(time > following, -1, time)
    month = wall.astype("datetime64[ns]").astype("datetime64[M]")
    inside = wall - month.astype("datetime64[ns]").astype(np.int64)
    moved = month.astype(np.int64) + 12 * (years - _LEAP)
    time = moved.astype("datetime64[M]").astype("datetime64[ns]").astype(np.int64) + inside
    return np.where(time.astype("datetime64[ns]").astype("datetime64[M]").astype(np.int64) != moved, -1, time)
