"""Stamps that are not a date and a time: counts since the start, serial days, Unix time finer than milliseconds, and
times of day whose date the user gives.

    epoch-us, epoch-ns          Unix time
    excel-days                  days since 1899-12-30 (ECMA-376, part 1, 18.17.4.1), of the wall clock
    datenum                     days since year 0, 1 January being 1 (MATLAB, datenum), of the wall clock
    decimal-years               years with their passed share as a fraction, of the wall clock
    elapsed-s, -ms, -us, -min, -h, -d   since a start that the user gives; a counter of 32 bits in ms or us may run over
    %H:%M:%S and the like       of the day that the user gives, and those that follow
    %b %d %H:%M and the like    of the year of that day (see `yearless`)
"""

# pyarrow.compute makes its functions at import, where a type checker cannot see them.
# pyright: reportAttributeAccessIssue=false
from __future__ import annotations

import datetime as dt
from collections.abc import Sequence

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from flagdata.errors import TimeError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.instants import stamps, yearless
from flagdata.ingest.anemometer.instants.stamps import DAY, Stamps
from flagdata.timebase import NANOSECONDS, iso

_EPOCH = {"epoch-us": 1_000, "epoch-ns": 1}
_SERIAL = {"excel-days": 25_569, "datenum": 719_529}
"""Number of the day 1970-01-01."""
_YEARS = "decimal-years"
_FIRST_YEAR, _LAST_YEAR = 1990, 2100
_ELAPSED = {
    "elapsed-s": NANOSECONDS, "elapsed-ms": 1_000_000, "elapsed-us": 1_000, "elapsed-min": 60 * NANOSECONDS,
    "elapsed-h": 3600 * NANOSECONDS, "elapsed-d": DAY,
}  # fmt: skip
_LONG = ("elapsed-min", "elapsed-h", "elapsed-d")
"""Counts whose fractions are rounded seconds."""
_OVERFLOW = {"elapsed-ms": 2**32 * 1_000_000, "elapsed-us": 2**32 * 1_000}
UNITS = tuple(_ELAPSED)
"""Formats of counts since a start."""
FORMS = (*_EPOCH, *_SERIAL, _YEARS, *_ELAPSED)
"""Formats of this module that are names."""


def _of_years(value: NDArray[np.float64]) -> NDArray[np.int64]:
    """Nanoseconds since 1970 of decimal years, to the second: a double holds them to 15 us, tables to half a minute."""
    year = np.floor(value).astype(np.int64)
    begin = (year - 1970).astype("datetime64[Y]").astype("datetime64[s]").astype(np.int64)
    end = (year - 1969).astype("datetime64[Y]").astype("datetime64[s]").astype(np.int64)
    return (begin + np.round((value - year) * (end - begin)).astype(np.int64)) * NANOSECONDS


def is_elapsed(form: str) -> bool:
    """Whether a format counts from a start that the file does not state."""
    return form in _ELAPSED


def is_time_of_day(form: str) -> bool:
    """Whether a format has directives of the time of day alone."""
    return (
        "%" in form
        and not any(f"%{letter}" in form for letter in "YymdjbJEsD")
        and any(f"%{letter}" in form for letter in "HIQGK")
    )


def needs_date(form: str) -> bool:
    """Whether a format lacks the date, or the year of one, so that the user gives that of the first row."""
    return is_time_of_day(form) or yearless.is_yearless(form)


def check(form: str) -> None:
    """Refuse a format that cannot be read.

    Raises:
        UsageError: see `stamps.pattern`.
    """
    if form not in (*stamps.EPOCH, *FORMS):
        date = "%Y-%m-%d " if is_time_of_day(form) else ""
        stamps.pattern(yearless.full(form) if yearless.is_yearless(form) else f"{date}{form}")


def parse(texts: Sequence[str] | pa.StringArray, form: str) -> Stamps:
    """Read counts, or times of day as nanoseconds since midnight.

    Raises:
        UsageError: see `stamps.pattern`.
    """
    text = pc.utf8_trim_whitespace(texts if isinstance(texts, pa.StringArray) else pa.array(texts, pa.string()))
    if is_time_of_day(form):
        return stamps.parse(pc.binary_join_element_wise("1970-01-01", text, " "), f"%Y-%m-%d {form}")
    if yearless.is_yearless(form):
        return yearless.parse(text, form)
    none = np.zeros(len(text), dtype=bool)
    if form in _EPOCH:
        whole = pc.match_substring_regex(text, r"^\d{15,19}$")
        valid = whole.to_numpy(zero_copy_only=False).astype(bool)
        ns = pc.cast(pc.if_else(whole, text, "0"), pa.int64()).to_numpy(zero_copy_only=False)
        valid = valid & (ns * (_EPOCH[form] / NANOSECONDS) > 631_152_000) & (ns * (_EPOCH[form] / NANOSECONDS) < 4.1e9)
        return Stamps(
            ns=np.where(valid, ns, 0) * _EPOCH[form], utc=valid.copy(), valid=valid, distant=none, step=_EPOCH[form]
        )
    pointed = pc.replace_substring(text, ",", ".")
    number = pc.match_substring_regex(pointed, r"^\d{1,15}(\.\d*)?([eE][-+]?\d{1,2})?$")
    valid = number.to_numpy(zero_copy_only=False).astype(bool)
    value = pc.cast(pc.if_else(number, pointed, "0"), pa.float64()).to_numpy(zero_copy_only=False)
    fraction = pc.replace_substring_regex(pointed, r"^[^.]*\.?|[eE].*$", "")
    digits = int(pc.max(pc.binary_length(fraction)).as_py() or 0)
    if form in _SERIAL:
        days = value - _SERIAL[form]
        valid = valid & (days > 7_305) & (days < 47_482)  # years 1990 to 2100, as for Unix time
        # A double holds a day's number to a microsecond or so; loggers that write days do not resolve that.
        ns = np.round(np.where(valid, days, 0.0) * 86_400e6).astype(np.int64) * 1_000
        # Days have no round seconds: noise of the last digits below a millisecond is rounding.
        near = np.abs(ns - np.round(ns / 1e6) * 1e6) < 100_000
        ns = np.where(near, np.round(ns / 1e6).astype(np.int64) * 1_000_000, ns)
        step = max(1_000, round(DAY / 10**digits))
        minute = np.round(ns / (60 * NANOSECONDS)).astype(np.int64) * 60 * NANOSECONDS
        if step > 1_000_000 and bool(np.all(np.abs(ns - minute) <= step)):
            ns = minute  # minutes and hours are no decimal fractions of a day
        return Stamps(ns=ns, utc=none, valid=valid, distant=none.copy(), step=step)
    if form == _YEARS:
        valid = valid & (value >= _FIRST_YEAR) & (value < _LAST_YEAR)
        return Stamps(
            ns=_of_years(np.where(valid, value, 1990.0)), utc=none, valid=valid, distant=none.copy(), step=NANOSECONDS
        )
    scale = _ELAPSED[form]
    valid = valid & (value * (scale / NANOSECONDS) < 3.2e8)  # ten years
    ns = np.round(np.where(valid, value, 0.0) * scale).astype(np.int64)
    step = max(1, scale // 10 ** min(digits, 9))
    if form in _LONG and step < NANOSECONDS:
        # Thirds and sixths of an hour are no decimal fractions: what is within the last digit of a second is one.
        second = np.round(ns / NANOSECONDS).astype(np.int64) * NANOSECONDS
        ns = np.where(np.abs(ns - second) <= step, second, ns)
    return Stamps(ns=ns, utc=none, valid=valid, distant=none.copy(), step=step)


def since_start(
    count: NDArray[np.int64], form: str, *, start: int | None, line: NDArray[np.int64], where: str
) -> tuple[NDArray[np.int64], tuple[Finding, ...]]:
    """UTC nanoseconds of counts since a start; `start` is the instant of the first row.

    Raises:
        TimeError: nobody said when the log starts, or its count starts again.
    """
    if start is None:
        raise TimeError(
            f"the stamps count from a start ({form}), not from a date", where=f"{where}, line {line[0]}",
            fix="give the instant of the first row: --start 2026-05-01T12:00:00+02:00",
        )  # fmt: skip
    found: list[Finding] = []
    span = _OVERFLOW.get(form)
    if span is not None and len(count) > 1:
        over = np.diff(count) < -0.9 * span
        if over.any():
            at = line[1:][over][0]
            what = f"the counter of 32 bits runs over {int(over.sum())} times; the rows after it go on"
            found.append(Finding(
                kind="counter-overflow", severity=Severity.NOTE, count=int(over.sum()), what=what, where=f"line {at}"
            ))  # fmt: skip
            count = count + np.concatenate(([0], np.cumsum(over))) * span
    _refuse_restarts(count, line=line, where=where)
    what = f"the stamps count from a start; the first row was at {iso(start)}, as given"
    if int(count[0]) > max(int(np.diff(count[:2]).max(initial=0)), NANOSECONDS):
        what += f", its count being {count[0] / NANOSECONDS:g} s; if that was the zero of the count instead, "
        what += f"give --start {iso(start + int(count[0]))}"
    found.append(Finding(kind="elapsed-time", severity=Severity.NOTE, what=what))
    return count - count[0] + start, tuple(found)


def _refuse_restarts(count: NDArray[np.int64], *, line: NDArray[np.int64], where: str) -> None:
    """Refuse a count that starts again, as after a reset: the file does not say when the second stretch began."""
    if len(count) < 3:
        return
    steps = np.diff(count)
    usual = int(np.median(steps[steps > 0])) if np.any(steps > 0) else 0
    back = np.flatnonzero((steps < 0) & (count[1:] <= count[0] + 2 * usual)) + 1
    back = [row for row in back.tolist() if row + 1 < len(count) and count[row] <= count[row + 1] < count[row - 1]]
    if back:
        row, times = back[0], f"{len(back)} times" if len(back) > 1 else "once"
        fix = "make a file of each stretch and give each its own --start"
        raise TimeError(
            f"the count starts again {times}, first at line {line[row]}, and the file does not say how long after",
            where=where, fix=fix,
        )  # fmt: skip


def on_days(
    clock: NDArray[np.int64], *, date: dt.date | None, line: NDArray[np.int64], where: str
) -> tuple[NDArray[np.int64], tuple[Finding, ...]]:
    """Wall-clock nanoseconds of times of day: of `date`, and of the next day after each midnight that is passed.

    Raises:
        TimeError: nobody said which day it was.
    """
    if date is None:
        raise TimeError(
            "the stamps are times of day without a date", where=f"{where}, line {line[0]}",
            fix="give the day of the first row: --date 2026-05-01",
        )  # fmt: skip
    midnight = np.concatenate(([False], np.diff(clock) < -DAY // 2))
    day = (date - dt.date(1970, 1, 1)).days + np.cumsum(midnight)
    what = f"times of day; the first row is of {date.isoformat()}, as given, and {int(midnight.sum())} midnights follow"
    return clock + day * DAY, (Finding(kind="date-given", severity=Severity.NOTE, what=what),)
