"""Stamps as text, wall clocks with daylight saving, and which number is the day."""

from __future__ import annotations

import datetime as dt
from zoneinfo import ZoneInfo

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flagdata.errors import TimeError, UsageError
from flagdata.ingest import WindOptions, draft
from flagdata.ingest.anemometer.instants import dates
from flagdata.ingest.anemometer.instants.dates import date_form
from flagdata.ingest.anemometer.instants.stamp_text import parse
from flagdata.ingest.anemometer.instants.zones import to_utc
from flagdata.timebase import wall_status
from tests.flagdata.ingest.anemometer.conftest import read

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
        ("%Y %j %H:%M", "2024 366 01:02", "2024-12-31T01:02:00"),
        ("%d-%b-%Y %H:%M", "07-Jun-2012 13:00", "2012-06-07T13:00:00"),
        ("epoch-s", "1765296945", "2025-12-09T16:15:45"),
        ("epoch-ms", "1765296945000", "2025-12-09T16:15:45"),
        ("epoch-us", "1765296945000000", "2025-12-09T16:15:45"),
        ("epoch-ns", "1765296945000000000", "2025-12-09T16:15:45"),
        ("epoch-s", "1.765296945e9", "2025-12-09T16:15:45"),
        ("epoch-ms", "1.765296945E+12", "2025-12-09T16:15:45"),
        ("epoch-ns", "1.765296945e+18", "2025-12-09T16:15:45"),
        # LabVIEW's zero is 24107 days before 1970, Windows' 11644473600 s, .NET's 719162 days, noon
        # of -4712 2440587.5
        ("labview-s", "3848141745", "2025-12-09T16:15:45"),
        ("filetime", "134097705450000000", "2025-12-09T16:15:45"),
        ("ticks", "639008937450000000", "2025-12-09T16:15:45"),
        ("excel-days-1904", "44681.520833", "2026-05-01T12:30:00"),
        ("julian-days", "2461162.020833", "2026-05-01T12:30:00"),
        ("julian-days-modified", "61161.520833", "2026-05-01T12:30:00"),
        # 46143 is 2026-05-01 (1900-01-01 is 1, and 1900-02-29, which never was, is counted); 730486
        # is 2000-01-01
        ("excel-days", "46143.520833", "2026-05-01T12:30:00"),
        ("datenum", "730486.75", "2000-01-01T18:00:00"),
    ],
)
def test_a_stamp_is_the_instant_it_says(form: str, text: str, expected: str) -> None:
    stamps = parse([text], form)
    assert stamps.valid.tolist() == [True]
    assert stamps.ns.tolist() == [ns(expected)]


@pytest.mark.parametrize(
    ("text", "nanoseconds"),
    [("00.05", 50_000_000), ("00.1", 100_000_000), ("00", 0), ("00.123456789", 123_456_789)],
)
def test_dropped_trailing_zeros_do_not_change_a_fraction(text: str, nanoseconds: int) -> None:
    stamps = parse([f"2026-05-01 12:00:{text}"], "%Y-%m-%d %H:%M:%S%f")
    assert stamps.ns.tolist() == [ns("2026-05-01T12:00:00") + nanoseconds]


def test_unix_time_keeps_its_last_digit() -> None:
    # 1765296945.951 s as a double is off by 1e-7 s; the integer is exact
    assert parse(["1765296945.951"], "epoch-s").ns.tolist() == [1_765_296_945_951_000_000]


@pytest.mark.parametrize(
    ("texts", "step"),
    [(["12:00:00.5", "12:00:01"], S // 10), (["12:00:01"], S), (["12:00:00"], 60 * S)],
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


@pytest.mark.parametrize(
    "form", ["%Y-%m %H:%M", "%Y", "%Y-%m-%d %M", "%H:%M", "%K", "%Y-%m-%d %H:%M %Y", "%"]
)
def test_a_format_without_a_whole_instant_is_refused(form: str) -> None:
    with pytest.raises(UsageError):
        parse(["2026-05-01"], form)


@given(st.datetimes(min_value=dt.datetime(1970, 1, 1), max_value=dt.datetime(2199, 12, 31)))  # noqa: DTZ001
def test_days_agree_with_the_calendar_of_python(moment: dt.datetime) -> None:
    expected = round((moment - dt.datetime(1970, 1, 1)) / dt.timedelta(microseconds=1)) * 1000  # noqa: DTZ001
    stamps = parse([moment.strftime("%Y-%m-%d %H:%M:%S.%f")], "iso")
    assert stamps.ns.tolist() == [expected]


PLACES = [
    "Europe/Amsterdam",
    "America/New_York",
    "Australia/Lord_Howe",
    "Asia/Kathmandu",
    "America/St_Johns",
]


@settings(deadline=None)
@given(
    st.lists(st.integers(ns("1996-01-01") // S, ns("2036-01-01") // S), min_size=1, max_size=5),
    st.sampled_from(PLACES),
)
def test_wall_clocks_agree_with_zoneinfo_wherever_they_are_unique(
    seconds: list[int], name: str
) -> None:
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


@pytest.mark.parametrize("step", [10, 15, 20, 30])
def test_a_log_of_averages_runs_through_the_repeated_hour_twice(step: int) -> None:
    rows = 60 // step
    wall = [
        *minutes("2026-10-25T01:00:00", 120)[::step],
        *minutes("2026-10-25T02:00:00", 120)[::step],
    ]
    assert set(np.diff(utc(wall))) == {60 * S * step}
    assert len(wall) == 4 * rows


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


ORDERS: dict[str, tuple[list[str], str | None, str]] = {
    "a number above 12": (["13/6/2026 10:00", "1/6/2026 10:00"], None, "%d/%m/%Y"),
    "a second number above 12": (["6/13/2026 10:00"], None, "%m/%d/%Y"),
    "a year in front": (["2026-06-01 10:00"], None, "%Y-%m-%d"),
    "points": (["1.6.2026 0:00"], None, "%d.%m.%Y"),
    "points and a year of two digits": (["30.11.26 0:00"], None, "%d.%m.%y"),
    "years of two digits above 31": (["96-03-14 10:00"], None, "%y-%m-%d"),
    "given": (["5/6/2026 10:00"], "mdy", "%m/%d/%Y"),
    "given beside points": (["5.6.2026 10:00"], "mdy", "%m.%d.%Y"),
    "given with a year of two digits in front": (["09/08/06 15:50"], "ymd", "%y/%m/%d"),
}
"""Stamps, the order that the user gives, and the date's form."""


@pytest.mark.parametrize("name", ORDERS)
def test_the_order_of_a_date_is_decided_by_its_numbers_or_given(name: str) -> None:
    texts, given_order, form = ORDERS[name]
    assert date_form(texts, given_order=given_order, where="x")[0] == form  # type: ignore[arg-type]


UNDECIDED: dict[str, tuple[list[str], str | None, str]] = {
    "no number above 12": (["5/6/2026 10:00"], None, "give --date-order dmy or mdy"),
    "dates that go on in one order alone": (
        ["1/6/2026 0:00", "2/6/2026 0:00", "3/6/2026 0:00"],
        None,
        "dmy or mdy",
    ),
    "points beside a clock of twelve hours": (["5.6.2026 10:00 PM"], None, "dmy or mdy"),
    "two digits that may be a year or a day": (["26-03-14 10:00"], None, "dmy or ymd"),
    "another order than the given one": (
        ["2026-06-01 10:00"],
        "dmy",
        "leave out --date-order, it is ymd",
    ),
    "an order that a number contradicts": (
        ["13/6/2026 10:00"],
        "mdy",
        "leave out --date-order, it is dmy",
    ),
    "two orders": (["13/6/2026 10:00", "6/13/2026 10:00"], None, "split it"),
    "no date": (["10:00", "10:01"], None, "recipe"),
}


@pytest.mark.parametrize("name", UNDECIDED)
def test_what_nothing_decides_is_refused_with_the_option(name: str) -> None:
    texts, given_order, fix = UNDECIDED[name]
    with pytest.raises(TimeError) as caught:
        date_form(texts, given_order=given_order, where="x")  # type: ignore[arg-type]
    assert fix in (caught.value.fix or "")


@pytest.mark.parametrize("year", [1900, 1969, 2201, 3000])
def test_a_year_outside_the_accepted_ones_is_distinguished_from_what_is_no_date(year: int) -> None:
    stamps = parse(
        [f"{year}-05-01T12:00:00Z", "2026-02-30T12:00:00Z", "2026-05-01T12:00:00Z", "noon"], "iso"
    )
    assert stamps.valid.tolist() == [False, False, True, False]
    assert stamps.distant.tolist() == [True, False, False, False]


def test_a_fraction_may_stand_behind_a_sign_that_is_no_point() -> None:
    found = parse(["20150101_001000_000000", "20150101_001000_250000"], "%Y%m%d_%H%M%S_%f")
    assert found.valid.all()
    assert (found.ns - ns("2015-01-01T00:10:00")).tolist() == [0, S // 4]


MONTHS = (
    "Jan",
    "feb",
    "March",
    "APR",
    "may",
    "June",
    "Jul",
    "aug",
    "Sept",
    "October",
    "Nov",
    "December",
)


def test_months_are_read_by_their_english_names_whole_or_cut_short_and_by_no_others() -> None:
    found = parse([f"7 {name} 2026 1:00" for name in MONTHS], "%d %b %Y %H:%M")
    assert found.ns.tolist() == [ns(f"2026-{month:02d}-07T01:00:00") for month in range(1, 13)]
    others = ("Mai", "marraskuu", "Mars", "Maerz", "Juin", "Okt", "septembre", "ma")
    assert not parse([f"7 {name} 2026 1:00" for name in others], "%d %b %Y %H:%M").valid.any()


MIXED: dict[str, tuple[str, list[str], list[str], int]] = {
    "dates alone are midnight": (
        "iso",
        ["2026-05-01 23:50:00", "2026-05-02", "2026-05-02 00:10:00"],
        ["2026-05-01T23:50:00", "2026-05-02T00:00:00", "2026-05-02T00:10:00"],
        1,
    ),
    "and in a form of their own": (
        "%d.%m.%Y %I:%M %p",
        ["01.05.2026 11:50 PM", "02.05.2026", "02.05.2026 12:10 AM"],
        ["2026-05-01T23:50:00", "2026-05-02T00:00:00", "2026-05-02T00:10:00"],
        1,
    ),
    "the end of a day with seconds": (
        "%Y-%m-%d %H:%M",
        ["2026-05-01 23:00", "2026-05-01 24:00:00", "2026-05-02 01:00"],
        ["2026-05-01T23:00:00", "2026-05-02T00:00:00", "2026-05-02T01:00:00"],
        0,
    ),
    "and without": (
        "%Y-%m-%d %H:%M:%S",
        ["2026-05-01 23:00:00", "2026-05-01 24:00", "2026-05-02 01:00:00"],
        ["2026-05-01T23:00:00", "2026-05-02T00:00:00", "2026-05-02T01:00:00"],
        0,
    ),
}


@pytest.mark.parametrize("name", MIXED)
def test_stamps_among_others_that_leave_out_or_add_what_is_zero(name: str) -> None:
    form, texts, expected, dates_alone = MIXED[name]
    found, bare = dates.parse(texts, form)
    assert found.valid.all()
    assert (found.ns.tolist(), bare) == ([ns(text) for text in expected], dates_alone)


def test_an_empty_time_of_day_is_no_midnight() -> None:
    found, _ = dates.parse(["23:59:58", "23:59:59", ""], "%H:%M:%S")
    assert found.valid.tolist() == [True, True, False]


TWELVE = ("%Y-%m-%d %H:%M", "%H:%M")


@pytest.mark.parametrize("form", TWELVE)
def test_a_clock_of_twelve_hours_without_am_or_pm_is_refused_and_no_other(form: str) -> None:
    day, lines = ns("2026-05-01T00:00:00"), np.arange(1000)

    def refused(hours: np.ndarray) -> bool:
        wall = (hours * 3600).astype(np.int64) * S + (day if "%d" in form else 0)
        try:
            dates.refuse_twelve(wall, line=lines, where="x")
        except TimeError as error:
            return "AM and PM" in (error.fix or "")
        return False

    sixth = np.arange(500) / 6
    days, clock = sixth // 24 * 24 * ("%d" in form), sixth % 24
    twelve = np.where(clock % 12 < 1, clock % 12 + 12, clock % 12)
    assert refused(days + twelve)
    assert refused((days + twelve)[30:144])
    assert not refused(days + clock)
    mornings = np.concatenate(
        [24 * at * ("%d" in form) + np.arange(8, 12.8, 1 / 6) for at in range(4)]
    )
    assert not refused(mornings)
    with pytest.raises(UsageError, match="hours of 12"):
        dates.check(form.replace("%H", "%I"))


EVE = dt.datetime(2023, 12, 31, 22)  # noqa: DTZ001
YEARLESS = (
    "%b %d %H:%M:%S",
    "%d-%b %H:%M",
    "%d/%m %H:%M",
    "%d %B %H:%M",
    "%b %d %I:%M %p",
    "%m %d %H %M",
    "%j %H:%M",
)


def completed(form: str, stamps: list[dt.datetime], date: dt.date | None) -> np.ndarray:
    found, _ = dates.parse([stamp.strftime(form) for stamp in stamps], form)
    assert found.valid.all()
    time, (said,) = dates.complete_dates(
        found.ns, form, date=date, line=np.arange(2, 2 + len(stamps)), where="x"
    )
    assert "as given" in said.what
    return time


def every(minutes: int, count: int, start: dt.datetime = EVE) -> list[dt.datetime]:
    return [start + dt.timedelta(minutes=minutes * at) for at in range(count)]


@pytest.mark.parametrize("form", [*YEARLESS, "%H:%M:%S"])
def test_the_first_rows_date_completes_all_over_a_new_year(form: str) -> None:
    time = completed(form, every(10, 60), EVE.date())
    assert time[0] == ns("2023-12-31T22:00:00")
    assert set(np.diff(time)) == {600 * S}


@pytest.mark.parametrize("given_date", [dt.date(2023, 12, 30), dt.date(2024, 1, 1), None])
def test_another_day_than_the_first_rows_is_refused_with_the_right_one(
    given_date: dt.date | None,
) -> None:
    for form in YEARLESS[:6]:
        with pytest.raises(TimeError) as caught:
            completed(form, every(10, 60), given_date)
        assert f"--date {given_date.year if given_date else 'YYYY'}-12-31" in (
            caught.value.fix or ""
        )


@pytest.mark.parametrize("form", ["%b %d %H:%M", "%j %H:%M"])
def test_a_leap_day_is_of_a_leap_year_alone(form: str) -> None:
    start = dt.datetime(2024, 2, 28) if "b" in form else dt.datetime(2024, 12, 30)  # noqa: DTZ001
    assert set(np.diff(completed(form, every(60, 48, start), start.date()))) == {3600 * S}
    with pytest.raises(TimeError, match=r"2023 has no such day|not of 2023"):
        completed(form, every(60, 48, start), start.date().replace(year=2023))


def test_lines_of_an_instrument_after_dates_without_a_year() -> None:
    text = "".join(
        f"{at:%b %d %H:%M:%S} $WIMWV,{k}.0,R,{3 + k % 2}.5,M,A\n"
        for k, at in enumerate(every(10, 20))
    )
    with pytest.raises(TimeError, match="--date YYYY-12-31"):
        read(text, zone="UTC")
    found = read(text, zone="UTC", date=EVE.date())
    assert found.series.time[0] == ns("2023-12-31T22:00:00")
    assert set(np.diff(found.series.time)) == {600 * S}
    with pytest.raises(TimeError, match="--date 2023-12-31"):
        read(text, zone="UTC", date=dt.date(2023, 12, 30))


def test_a_time_of_day_beside_a_date_that_does_not_read_is_not_the_time() -> None:
    rows = [f"{at:%b %d,%I:%M %p},3.5" for at in every(10, 60)]
    found = draft(["date,time,wind speed (m/s)", *rows], WindOptions(zone="UTC"))
    assert found is not None
    assert [question.key for question in found.open] == ["columns"]


COUNTS: dict[str, tuple[str, list[str], list[float]]] = {
    "milliseconds that run over 32 bits": (
        "elapsed-ms",
        [str((2**32 - 3000 + at * 1000) % 2**32) for at in range(12)],
        list(range(12)),
    ),
    "hours to the fourth digit": ("elapsed-h", ["0.1667", "0.3333", "0.5"], [0, 600, 1200]),
    "seconds": ("elapsed-s", ["7.25", "7.5", "1e1"], [0, 0.25, 2.75]),
}


@pytest.mark.parametrize("name", COUNTS)
def test_counts_go_on_from_the_start_that_the_user_gives(name: str) -> None:
    form, texts, expected = COUNTS[name]
    found, _ = dates.parse(texts, form)
    lines = np.arange(len(texts))
    time, said = dates.since_start(
        found.ns, form, start=ns("2026-05-01T12:00:00"), line=lines, where="x"
    )
    assert ((time - ns("2026-05-01T12:00:00")) / S).tolist() == expected
    assert ("counter-overflow" in [one.kind for one in said]) == ("run over" in name)
    with pytest.raises(TimeError, match="count from a start"):
        dates.since_start(found.ns, form, start=None, line=lines, where="x")
    with pytest.raises(TimeError, match="starts again once, first at line 5"):
        dates.since_start(
            np.array([0, 1, 2, 3, 4, 0, 1]) * S, form, start=0, line=np.arange(7), where="x"
        )
