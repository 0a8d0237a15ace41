"""Clocks of twelve hours: with AM and PM in some rows alone, or in none."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable

import numpy as np
import pytest

from flagdata.errors import TimeError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.instants.stamps import parse
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
DAY = dt.datetime(2026, 5, 1)  # noqa: DTZ001
S = 1_000_000_000


def log(rows: range, form: Callable[[int], str], *, heading: str = "date,time") -> str:
    """Ten-minute rows by their numbers from midnight."""
    stamps = ((DAY + dt.timedelta(minutes=10 * at)).strftime(form(at)) for at in rows)
    return f"{heading},wind speed (m/s)\n" + "".join(f"{stamp},{3 + at % 2}.5\n" for at, stamp in enumerate(stamps))


def told(found: WindLog, kind: str) -> Finding:
    (one,) = [finding for finding in found.findings if finding.kind == kind]
    return one


def begins(found: WindLog, row: int) -> None:
    """The rows come ten minutes apart, the first at this row's time."""
    first = np.datetime64(DAY + dt.timedelta(minutes=10 * row), "ns").astype(np.int64)
    assert found.series.time.tolist() == (first + 600 * S * np.arange(len(found.series))).tolist()


@pytest.mark.parametrize("every", [30, 72])
def test_stamps_of_24_hours_among_those_with_am_and_pm_are_read_and_counted(read: Read, every: int) -> None:
    text = log(range(144), lambda at: "%Y-%m-%d,%H:%M" if at % every == 0 else "%Y-%m-%d,%I:%M %p")
    found = read(text, zone="UTC", columns="date[%Y-%m-%d],time[%I:%M %p],wind_speed[m/s]")
    begins(found, 0)
    finding = told(found, "mixed-clocks")
    assert (finding.severity, finding.count) == (Severity.WARNING, -(-144 // every))


def test_an_hour_above_12_with_pm_is_of_24() -> None:
    found = parse(
        ["2026-05-01 13:05PM", "2026-05-01 01:05 pm", "2026-05-01 12:05AM", "2026-05-01 0:05"], "%Y-%m-%d %H:%M%p"
    )
    assert found.valid.all()
    assert (found.ns % (86_400 * S) // (60 * S)).tolist() == [785, 785, 5, 5]


@pytest.mark.parametrize(
    ("rows", "form", "heading"),
    [
        (range(500), "%Y-%m-%d,%I:%M", "date,time"),
        (range(500), "%Y-%m-%d %I:%M:%S", "time"),
        (range(30, 144), "%Y-%m-%d,%I:%M", "date,time"),  # 05:00 to 23:50: the first half ends within the day
        (range(30, 102), "%Y-%m-%d,%I:%M", "date,time"),  # as 05:00 to 16:50
        (range(100, 250), "%Y-%m-%d,%I:%M", "date,time"),  # from the afternoon on
        (range(144, 400), "%Y-%m-%d,%I:%M", "date,time"),  # the last day ends before noon
    ],
)
def test_hours_without_am_or_pm_are_told_by_their_order_and_said(
    read: Read, rows: range, form: str, heading: str
) -> None:
    found = read(log(rows, lambda _: form, heading=heading), zone="UTC")
    begins(found, rows[0])
    assert told(found, "twelve-hours").severity is Severity.WARNING


@pytest.mark.parametrize("first", [3, 75])
def test_where_their_order_does_not_tell_the_half_of_the_day_the_user_does(read: Read, first: int) -> None:
    text = log(range(first, first + 45), lambda _: "%Y-%m-%d,%I:%M")
    with pytest.raises(TimeError, match="--start"):
        read(text, zone="UTC")
    at = DAY.replace(tzinfo=dt.timezone(dt.timedelta(hours=2))) + dt.timedelta(minutes=10 * first)
    found = read(text, zone="+02:00", start=round(at.timestamp()) * S)
    begins(found, first - 12)
    with pytest.raises(TimeError, match="correct --start"):
        read(text, zone="+02:00", start=round(at.timestamp()) * S + 5 * 3600 * S)


def test_a_clock_of_24_hours_that_was_set_back_is_none_of_twelve(read: Read) -> None:
    text = log(range(30, 144), lambda _: "%Y-%m-%d,%H:%M")
    assert not [f for f in read(text, zone="UTC").findings if f.kind == "twelve-hours"]
    # mornings alone, day after day
    rows = [row for day in range(4) for row in range(144 * day + 48, 144 * day + 77)]
    stamps = [(DAY + dt.timedelta(minutes=10 * row)).strftime("%Y-%m-%d,%H:%M") for row in rows]
    text = "date,time,wind speed (m/s)\n" + "".join(f"{stamp},{3 + at % 2}.5\n" for at, stamp in enumerate(stamps))
    found = read(text, zone="UTC")
    assert not [f for f in found.findings if f.kind == "twelve-hours"]
    assert len(found.series) == len(rows)
