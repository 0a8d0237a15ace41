"""Dates that stamps leave open: the order of their numbers, a year, a day, a start. The user gives
what is lacking.

%H:%M:%S and the like       of the day that the user gives, and those that follow %b %d %H:%M and
the like    of the year of that day; the next year begins where the date falls by half a year
elapsed-s and the like      since the instant that the user gives; a counter of 32 bits in ms or us
may run over
"""

from __future__ import annotations

import datetime as dt
import re
from collections.abc import Sequence
from typing import Literal

import numpy as np
import pyarrow as pa

from flagdata.core.arrays import IntArray
from flagdata.core.findings import Finding
from flagdata.core.shell import command_line
from flagdata.errors import TimeError
from flagdata.ingest.anemometer.instants import stamp_text
from flagdata.ingest.anemometer.instants.stamp_text import DAY, HOUR, NEXT_DAY, Stamps
from flagdata.timebase import NANOSECONDS, iso

Order = Literal["ymd", "dmy", "mdy"]
_DATE = re.compile(r"^\s*(\d{4}|\d{1,2})([-/.])(\d{1,2})\2(\d{4}|\d{1,2})(?!\d)")
_WORDS = {"dmy": "day/month", "mdy": "month/day", "ymd": "year/month"}
_TWELVE = re.compile(r"\d\s*[AaPp]\.?[Mm]\b")
"""A clock of twelve hours, which no locale has beside points."""
_LEAP = "2000"
"""The year in which stamps are read that name none: it has a 29 February."""
_OVERFLOW = {"elapsed-ms": 2**32 * 1_000_000, "elapsed-us": 2**32 * 1_000}


def _letters(form: str) -> set[str]:
    return set(re.findall(r"%(.)", form))


def is_elapsed(form: str) -> bool:
    """Checks whether a format counts from a start that the file does not state."""
    return form in stamp_text.ELAPSED


def is_time_of_day(form: str) -> bool:
    """Checks whether a format has directives of the time of day alone."""
    return bool(_letters(form) & set("HI")) and not _letters(form) & set("YymdjbBhe")


def is_yearless(form: str) -> bool:
    """Checks whether a format has a date in it but no year."""
    return bool(_letters(form) & set("mdjbBhe")) and not _letters(form) & set("Yy")


def needs_date(form: str) -> bool:
    """Checks whether a format lacks the date, or the year of one, so that the user gives that of
    the first row."""
    return is_time_of_day(form) or is_yearless(form)


def _with_date(form: str) -> tuple[str, str]:
    """Completes a format with the date that it lacks, and returns that date as text."""
    if is_time_of_day(form):
        return f"%Y-%m-%d {form}", "1970-01-01"
    return (f"%Y {form}", _LEAP) if is_yearless(form) else (form, "")


def check(form: str) -> None:
    """Refuse a format that cannot be read.

    Raises:
        UsageError: see `stamps.pattern`.
    """
    if form not in stamp_text.NAMED:
        stamp_text.pattern(_with_date(form)[0])


def parse(texts: Sequence[str] | pa.StringArray, form: str) -> tuple[Stamps, int]:
    """Parses stamps as `stamps.parse_mixed` does: times of day as of 1970-01-01, dates without a
    year as of 2000."""
    dated_form, before = _with_date(form)
    return stamp_text.parse_mixed(texts, dated_form, before=before)


def date_form(
    texts: Sequence[str], *, given_order: Order | None, where: str
) -> tuple[str, Order, str]:
    """Finds the date at the start of texts as directives, the order of its numbers, and what
    decides it.

    A number above 12 is a day, one above 31 a year; points stand between numbers of which the first
    is the day (every locale of the Unicode CLDR that writes them so). Nothing else decides.

    Args:
        given_order: by the user; refused when a date contradicts it.

    Raises:
        TimeError: no date, none that fits the order, or several orders that all fit.
    """
    filled = [text for text in texts if text.strip()]
    dated = [match for text in filled if (match := _DATE.match(text))]
    if not dated or 2 * len(dated) <= len(filled):
        raise TimeError(
            "the rows do not begin with a date", where=where, fix="describe the file by a recipe"
        )
    first, sign = dated[0][0].strip(), dated[0][2]
    widths = [len(dated[0][group]) for group in (1, 3, 4)]
    numbers = np.array([[int(match[group]) for group in (1, 3, 4)] for match in dated])
    orders: tuple[Order, ...] = ("ymd",) if widths[0] == 4 else ("dmy", "mdy")
    if 4 not in widths and (sign == "-" or given_order == "ymd"):
        orders = (*orders, "ymd")
    highest = {"d": 31, "m": 12, "y": 9999}
    fit: list[Order] = [
        order_of_date
        for order_of_date in orders
        if bool((numbers <= [highest[letter] for letter in order_of_date]).all())
    ]
    chosen: list[Order] = (
        fit
        if given_order is None
        else [order_of_date for order_of_date in fit if order_of_date == given_order]
    )
    points = len(chosen) > 1 and sign == "." and not any(map(_TWELVE.search, filled))
    if not fit:
        raise TimeError(
            "the dates are in no one order",
            where=where,
            fix="the file mixes several orders: split it",
        )
    if not chosen:
        fix = f"leave out --date-order, it is {' or '.join(fit)}"
        raise TimeError(
            f"dates are not {given_order}, as {first} and the others show", where=where, fix=fix
        )
    if len(chosen) > 1 and not points:
        readings = " or ".join(_WORDS[order_of_date] for order_of_date in chosen)
        message = f"{first} may be {readings}, and nothing in the log decides it"
        raise TimeError(
            message, where=where, fix=f"give --date-order {' or '.join(map(command_line, chosen))}"
        )
    reason = f"no other order fits the first {len(dated)} dates"
    if given_order is not None or points:
        reason = (
            f"the order {given_order} was given"
            if given_order
            else "dates with points are written with the day first"
        )
    parts = {"y": "%Y" if 4 in widths else "%y", "m": "%m", "d": "%d"}
    return sign.join(parts[letter] for letter in chosen[0]), chosen[0], reason


def refuse_twelve(wall: IntArray, *, line: IntArray, where: str) -> None:
    """Refuse stamps of a clock of twelve hours without AM or PM.

    They have hours of 1 to 12 alone and go on, but for the falls from 12:59 to 1:00 within a day.

    Args:
        wall: (n,) nanoseconds as read with hours of 0 to 23, in the order of the rows.

    Raises:
        TimeError: the file does not say which half of the day a row is of.
    """
    hours, half = wall % DAY // HOUR, wall % (12 * HOUR)
    falls = np.flatnonzero((np.diff(wall) < 0) & (np.diff(wall // DAY) == 0))
    if (
        len(falls) == 0
        or int(hours.min()) < 1
        or int(hours.max()) != 12
        or not np.all(hours[falls] == 12)
    ):
        return
    forward = np.diff(half)
    usual = int(np.median(forward[forward > 0])) if np.any(forward > 0) else 0
    if np.all((wall[falls + 1] - wall[falls]) % (12 * HOUR) <= max(3 * usual, 1)):
        raise TimeError(
            "the hours run from 1 to 12 without AM or PM, so that the file does not say of which "
            "half of the day they "
            "are",
            where=f"{where}, line {line[falls[0] + 1]}",
            fix="export the log with a clock of 24 hours, or with AM and PM",
        )


def complete_dates(
    wall: IntArray, form: str, *, date: dt.date | None, line: IntArray, where: str
) -> tuple[IntArray, tuple[Finding, ...]]:
    """Completes wall-clock nanoseconds of stamps without a date or a year that `parse` has read, in
    the order of time.

    Args:
        wall: (n,) as read; n > 0.
        date: of the first row.

    Raises:
        TimeError: no date is given, the first row's is another, or a year has no such day.
    """
    where_first = f"{where}, line {line[0]}"
    if is_time_of_day(form):
        if date is None:
            fix = "give the day of the first row: --date 2026-05-01"
            raise TimeError(
                "the stamps are times of day without a date", where=where_first, fix=fix
            )
        midnight = np.concatenate(([False], np.diff(wall) < -NEXT_DAY))
        time = wall + ((date - dt.date(1970, 1, 1)).days + np.cumsum(midnight)) * DAY
        return time, _date_given("times of day", date, f"{int(midnight.sum())} midnights")
    day = wall // DAY
    month_and_day = str(np.datetime64(int(day[0]), "D"))[5:]
    if date is None:
        fix = "give the day of the first row with its year: --date YYYY-"
        fix += "MM-DD" if "%j" in form else f"{month_and_day}, the year in place of YYYY"
        raise TimeError("the stamps have no year", where=where_first, fix=fix)
    passed = np.concatenate(([False], np.diff(wall) < -183 * DAY))
    start = (date.year + np.cumsum(passed) - 1970).astype("datetime64[Y]")
    month = day.astype("datetime64[D]").astype("datetime64[M]")
    first = start.astype("datetime64[M]") + (month - np.datetime64(f"{_LEAP}-01", "M"))
    into = day - month.astype("datetime64[D]").astype(np.int64)
    length = (first + np.timedelta64(1, "M")).astype("datetime64[D]") - first.astype(
        "datetime64[D]"
    )
    if "%j" in form:
        first, into = (
            start.astype("datetime64[M]"),
            day - np.datetime64(f"{_LEAP}-01-01", "D").astype(np.int64),
        )
        length = (start + np.timedelta64(1, "Y")).astype("datetime64[D]") - start.astype(
            "datetime64[D]"
        )
    lost = np.flatnonzero(into >= length.astype(np.int64))
    if len(lost):
        message = f"{start[lost[0]]} has no such day as this row's"
        fix = "give --date with the year in which the log began"
        raise TimeError(message, where=f"{where}, line {line[lost[0]]}", fix=fix)
    time = (first.astype("datetime64[D]").astype(np.int64) + into) * DAY + wall % DAY
    given_day = (date - dt.date(1970, 1, 1)).days * DAY
    if not given_day <= int(time[0]) <= given_day + DAY:  # 24:00 is of the day that ends
        date_of_first = np.datetime64(int(time[0]), "ns").astype("datetime64[D]")
        message = (
            f"the first row is of {date_of_first}, if of {date.year}, and not of {date.isoformat()}"
        )
        fix = f"give its day with its year, such as {command_line('--date', date_of_first)}"
        raise TimeError(message, where=where_first, fix=fix)
    return time, _date_given("stamps without a year", date, f"{int(passed.sum())} new years")


def _date_given(what: str, date: dt.date, follow: str) -> tuple[Finding, ...]:
    text = f"{what}; the first row is of {date.isoformat()}, as given, and {follow} follow"
    return (Finding.of("date-given", text),)


def since_start(
    count: IntArray, form: str, *, start: int | None, line: IntArray, where: str
) -> tuple[IntArray, tuple[Finding, ...]]:
    """Converts counts since a start to UTC nanoseconds; `start` is the instant of the first row.

    Raises:
        TimeError: no start is given, or the count starts again: the file does not say when its
            second stretch began.
    """
    if start is None:
        raise TimeError(
            f"the stamps count from a start ({form}), not from a date",
            where=f"{where}, line {line[0]}",
            fix="give the instant of the first row: --start 2026-05-01T12:00:00+02:00",
        )
    findings: list[Finding] = []
    span = _OVERFLOW.get(form)
    over = np.concatenate(
        ([False], np.diff(count) < -0.9 * span if span else np.zeros(len(count) - 1, dtype=bool))
    )
    if span and over.any():
        message = (
            f"the counter of 32 bits runs over {int(over.sum())} times; the rows after it go on"
        )
        findings.append(
            Finding.of(
                "counter-overflow", message, count=int(over.sum()), where=f"line {line[over][0]}"
            )
        )
        count = count + np.cumsum(over) * span
    steps = np.diff(count)
    usual = int(np.median(steps[steps > 0])) if np.any(steps > 0) else 0
    again = (
        (steps[:-1] < 0)
        & (count[1:-1] <= count[0] + 2 * usual)
        & (steps[1:] >= 0)
        & (count[2:] < count[:-2])
    )
    if again.any():
        row, times = (
            int(np.flatnonzero(again)[0]) + 1,
            f"{int(again.sum())} times" if again.sum() > 1 else "once",
        )
        raise TimeError(
            f"the count starts again {times}, first at line {line[row]}, and the file does not say "
            "how long after",
            where=where,
            fix="make a file of each stretch and give each its own --start",
        )
    message = f"the stamps count from a start; the first row was at {iso(start)}, as given"
    if int(count[0]) > max(int(np.diff(count[:2]).max(initial=0)), NANOSECONDS):
        message += (
            f", its count being {count[0] / NANOSECONDS:g} s; if that was the zero of the count "
            "instead, "
        )
        message += f"give {command_line('--start', iso(start + int(count[0])))}"
    findings.append(Finding.of("elapsed-time", message))
    return count - count[0] + start, tuple(findings)
