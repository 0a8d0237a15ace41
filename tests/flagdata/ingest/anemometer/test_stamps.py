"""Stamps as text, wall clocks with daylight saving, and which number is the day."""

from __future__ import annotations

import datetime as dt
from zoneinfo import ZoneInfo

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flagdata.errors import TimeError, UsageError
from flagdata.ingest.anemometer.instants.dates import decide
from flagdata.ingest.anemometer.instants.stamps import parse
from flagdata.ingest.anemometer.instants.wall import to_utc
from flagdata.timebase import wall_status

S = 1_000_000_000
PLACE = ZoneInfo("Europe/Amsterdam")


def ns(text: str) -> int:
    return int(dt.datetime.fromisoformat(text).replace(tzinfo=dt.UTC).timestamp()) * S


@pytest.mark.parametrize(
    ("form", "text", "expected"),
    [
        ("iso", "2026-05-01T12:00:00Z", "2026-05-01T12:00:00"),
        ("iso", "2026-05-01 12:00:00", "2026-05-01T12:00:00"),
        ("iso", "2026-05-01 12:00", "2026-05-01T12:00:00"),
        ("iso", "2026-05-01T12:00:00+02:00", "2026-05-01T10:00:00"),
        ("iso", "2026-05-01T12:00:00-0330", "2026-05-01T15:30:00"),
        ("iso", "2024-02-29T00:00:00Z", "2024-02-29T00:00:00"),
        ("%d/%m/%Y %H:%M", "1/2/2026 3:04", "2026-02-01T03:04:00"),
        ("%m/%d/%y %I:%M:%S %p", "12/31/25 12:05:09 AM", "2025-12-31T00:05:09"),
        ("%m/%d/%y %I:%M:%S %p", "12/31/25 12:05:09 pm", "2025-12-31T12:05:09"),
        ("%d.%m.%Y %H:%M:%S", "05.11.2026 23:59:59", "2026-11-05T23:59:59"),
        ("%Y %J %H", "2001 58.83 20", "2001-02-27T20:00:00"),
        ("%Y %J %Q", "2001 58.83 20.0", "2001-02-27T20:00:00"),
        ("%Y %J %Q", "2001 59.00 23.95", "2001-02-27T23:57:00"),
        ("%Y %J %G", "2001 58.84 1215", "2001-02-27T20:15:00"),
        ("%Y %j %H:%M", "2024 366 01:02", "2024-12-31T01:02:00"),
        ("%d-%b-%Y %H:%M", "07-Jun-2012 13:00", "2012-06-07T13:00:00"),
        ("epoch-s", "1765296945", "2025-12-09T16:15:45"),
        ("epoch-ms", "1765296945000", "2025-12-09T16:15:45"),
    ],
)
def test_a_stamp_is_the_instant_it_says(form: str, text: str, expected: str) -> None:
    stamps = parse([text], form)
    assert stamps.valid.tolist() == [True]
    assert stamps.ns.tolist() == [ns(expected)]


@pytest.mark.parametrize(
    ("text", "nanoseconds"), [("00.05", 50_000_000), ("00.1", 100_000_000), ("00", 0), ("00.123456789", 123_456_789)]
)
def test_dropped_trailing_zeros_do_not_change_a_fraction(text: str, nanoseconds: int) -> None:
    stamps = parse([f"2026-05-01 12:00:{text}"], "%Y-%m-%d %H:%M:%S%f")
    assert stamps.ns.tolist() == [ns("2026-05-01T12:00:00") + nanoseconds]


def test_unix_time_keeps_its_last_digit() -> None:
    # 1765296945.951 s as a double is off by 1e-7 s; the integer is exact
    assert parse(["1765296945.951"], "epoch-s").ns.tolist() == [1_765_296_945_951_000_000]


@pytest.mark.parametrize(
    ("texts", "step"), [(["12:00:00.5", "12:00:01"], S // 10), (["12:00:01"], S), (["12:00:00"], 60 * S)]
)
def test_the_resolution_of_stamps_is_the_last_digit_ever_used(texts: list[str], step: int) -> None:
    assert parse([f"2026-05-01 {t}" for t in texts], "iso").step == step


@pytest.mark.parametrize(
    "text",
    [
        "2026-02-29 12:00:00",
        "2026-04-31 12:00:00",
        "2026-00-01 12:00:00",
        "2026-05-01 24:00:01",
        "2026-05-01 24:01:00",
        "",
        "x",
        "12:00",
    ],
)
def test_what_is_no_date_is_not_valid(text: str) -> None:
    assert parse([text], "iso").valid.tolist() == [False]


@pytest.mark.parametrize("form", ["%Y-%m %H:%M", "%Y", "%Y-%m-%d %M", "%H:%M", "%K", "%Y-%m-%d %H:%M %Y", "%"])
def test_a_format_without_a_whole_instant_is_refused(form: str) -> None:
    with pytest.raises(UsageError):
        parse(["2026-05-01"], form)


@given(st.datetimes(min_value=dt.datetime(1970, 1, 1), max_value=dt.datetime(2199, 12, 31)))  # noqa: DTZ001
def test_days_agree_with_the_calendar_of_python(moment: dt.datetime) -> None:
    expected = round((moment - dt.datetime(1970, 1, 1)) / dt.timedelta(microseconds=1)) * 1000  # noqa: DTZ001
    stamps = parse([moment.strftime("%Y-%m-%d %H:%M:%S.%f")], "iso")
    assert stamps.ns.tolist() == [expected]


PLACES = ["Europe/Amsterdam", "America/New_York", "Australia/Lord_Howe", "Asia/Kathmandu", "America/St_Johns"]


@settings(deadline=None)
@given(
    st.lists(st.integers(ns("1996-01-01") // S, ns("2036-01-01") // S), min_size=1, max_size=5), st.sampled_from(PLACES)
)
def test_wall_clocks_agree_with_zoneinfo_wherever_they_are_unique(seconds: list[int], name: str) -> None:
    place = ZoneInfo(name)
    walls = [dt.datetime.fromtimestamp(s, dt.UTC).replace(tzinfo=None) for s in sorted(seconds)]
    unique = [w for w in walls if wall_status(w, place) == "unique"]
    wall = np.array([ns(w.isoformat()) for w in unique], dtype=np.int64)
    time, _ = to_utc(wall, place, lines=np.arange(len(wall)), where="x")
    assert time.tolist() == [round(w.replace(tzinfo=place).timestamp()) * S for w in unique]


def minutes(start: str, count: int) -> list[int]:
    return [ns(start) + 60 * S * i for i in range(count)]


def utc(wall: list[int]) -> list[int]:
    return to_utc(np.array(wall), PLACE, lines=np.arange(1, len(wall) + 1), where="log")[0].tolist()


def test_a_log_that_runs_through_the_repeated_hour_twice_is_an_hour_longer() -> None:
    # 2026-10-25 03:00 CEST → 02:00 CET; wall 01:00 to 02:59, again 02:00 to 03:29
    wall = [*minutes("2026-10-25T01:00:00", 120), *minutes("2026-10-25T02:00:00", 90)]
    time = utc(wall)
    assert time[0] == ns("2026-10-24T23:00:00")
    assert set(np.diff(time)) == {60 * S}
    assert time[-1] == ns("2026-10-25T02:29:00")


def test_a_log_that_ends_in_the_repeated_hour_without_a_break_is_in_its_first_pass() -> None:
    assert utc(minutes("2026-10-25T01:50:00", 30))[-1] == ns("2026-10-25T00:19:00")


def test_a_log_that_begins_in_the_repeated_hour_and_leaves_it_is_in_its_second_pass() -> None:
    assert utc(minutes("2026-10-25T02:40:00", 30))[0] == ns("2026-10-25T01:40:00")


def test_a_log_that_runs_through_the_repeated_hour_once_was_not_set_back() -> None:
    with pytest.raises(TimeError, match="was not set back"):
        utc(minutes("2026-10-25T01:30:00", 120))


def test_a_log_that_jumps_over_the_hour_that_is_skipped_has_no_gap() -> None:
    # 2026-03-29 02:00 CET → 03:00 CEST
    wall = [*minutes("2026-03-29T01:30:00", 30), *minutes("2026-03-29T03:00:00", 30)]
    assert set(np.diff(utc(wall))) == {60 * S}


def test_a_log_that_runs_through_the_skipped_hour_was_not_set_forward() -> None:
    with pytest.raises(TimeError, match="does not exist") as caught:
        utc(minutes("2026-03-29T01:30:00", 60))
    assert caught.value.where == "log, line 31"


@pytest.mark.parametrize(
    ("texts", "order"),
    [
        (["13/6/2026 10:00"], "dmy"),
        (["6/13/2026 10:00"], "mdy"),
        (["2026-06-01 10:00"], "ymd"),
        (["1/6/2026 0:00", "2/6/2026 0:00", "3/6/2026 0:00"], "dmy"),
        (["6/1/2026 0:00", "6/2/2026 0:00", "6/3/2026 0:00"], "mdy"),
        (["30.11.26 0:00"], "dmy"),
    ],
)
def test_the_order_of_a_date_is_decided_by_evidence(texts: list[str], order: str) -> None:
    assert decide(texts, given=None, where="x").order == order


def test_a_told_order_for_dates_that_begin_with_the_year_is_refused() -> None:
    with pytest.raises(TimeError, match="2026-06-01"):
        decide(["2026-06-01 10:00"], given="dmy", where="x")


def test_an_order_without_evidence_is_refused_unless_told() -> None:
    with pytest.raises(TimeError):
        decide(["5/6/2026 10:00"], given=None, where="x")
    assert decide(["5/6/2026 10:00"], given="mdy", where="x").order == "mdy"


@pytest.mark.parametrize("year", [1900, 1969, 2201, 3000])
def test_a_year_outside_the_accepted_ones_is_told_from_what_is_no_date(year: int) -> None:
    stamps = parse([f"{year}-05-01T12:00:00Z", "2026-02-30T12:00:00Z", "2026-05-01T12:00:00Z", "noon"], "iso")
    assert stamps.valid.tolist() == [False, False, True, False]
    assert stamps.distant.tolist() == [True, False, False, False]


def test_a_fraction_may_stand_behind_a_sign_that_is_no_point() -> None:
    for form in ("%Y%m%d_%H%M%S_%f", "%Y%m%d_%H%M%S_%U"):
        found = parse(["20150101_001000_000000", "20150101_001000_250000"], form)
        assert found.valid.all()
        assert (found.ns - ns("2015-01-01T00:10:00")).tolist() == [0, S // 4]
