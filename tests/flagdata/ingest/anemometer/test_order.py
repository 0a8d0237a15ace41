"""Rows into strictly increasing time: none is lost without a word, none gets a time that the file
does not state."""

from __future__ import annotations

import datetime as dt
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from flagdata.core.findings import Severity
from flagdata.core.rng import stream
from flagdata.core.schema import SampleFlag
from flagdata.errors import TimeError, UsageError
from flagdata.ingest import ClockChoice, Reading, gaps
from flagdata.ingest.anemometer.instants.log_clock import longest_rise
from flagdata.ingest.anemometer.samples.order import in_order
from flagdata.record.signals import WindLog
from tests.flagdata.ingest.anemometer.conftest import made, read

START = 1_777_636_800 * 10**9


def kinds(found: Reading | WindLog) -> list[str]:
    return [one.kind for one in found.findings]


def seconds(found: Reading) -> list[float]:
    return ((found.time - START) / 1e9).tolist()


MS, FAST = 0.001, 0.005 * np.arange(1, 3000)
EVERY = np.arange(1, 3000) % 50 == 0
SPREAD: dict[str, tuple[Sequence[float] | np.ndarray, float, Sequence[float] | np.ndarray, str]] = {
    "four a second, the log begins and ends within a second": (
        [0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3],
        1,
        0.25 * np.arange(2, 13),
        "coarse-stamps",
    ),
    "12 a minute under stamps of minutes": (
        np.repeat(60 * np.arange(20), 12),
        60,
        5 * np.arange(240),
        "held-stamps",
    ),
    "a timer of 16 ms": (
        np.arange(3000) // 3 * 0.016,
        MS,
        np.arange(3000) * 0.016 / 3,
        "held-stamps",
    ),
    "every fiftieth row of 200 Hz with the stamp before it": (
        np.where(EVERY, FAST - 0.005, FAST),
        MS,
        FAST,
        "equal-stamps",
    ),
    "every fiftieth row of 200 Hz with the stamp after it": (
        np.where(EVERY, FAST + 0.005, FAST),
        MS,
        FAST,
        "equal-stamps",
    ),
    "a first row with the stamp of the second": (
        [0, *(0.05 * np.arange(100))],
        MS,
        0.05 * np.arange(-1, 100),
        "equal-stamps",
    ),
    "two records of a slow logger for one instant": (
        600 * np.array([0, 1, 2, 2, 3, 4, 5]),
        60,
        600 * np.arange(6),
        "duplicate-stamps",
    ),
    "two first records of a slow logger": (
        600 * np.array([0, 0, 1, 2, 3, 4, 5]),
        60,
        600 * np.arange(6),
        "duplicate-stamps",
    ),
}
"""Stamps [s], their resolution [s], the instants that the rows get [s] and the finding that says
so."""


@pytest.mark.parametrize("name", SPREAD)
def test_rows_that_share_a_stamp_get_instants_of_their_own(name: str) -> None:
    stamps, step, expected, kind = SPREAD[name]
    found = in_order(made(stamps, step=step), where="x")
    assert seconds(found) == pytest.approx(list(expected), abs=1e-8)
    (finding,) = found.findings
    assert (finding.kind, finding.severity) == (
        kind,
        Severity.ERROR if kind == "duplicate-stamps" else Severity.WARNING,
    )
    assert "by up to" in finding.what or kind == "duplicate-stamps"
    moved = found.time != made(stamps).time[: len(found.time)]
    assert kind == "duplicate-stamps" or bool(np.all(found.flags[moved] & SampleFlag.TIME_UNSURE))
    assert gaps(found).findings == found.findings


def test_equal_milliseconds_of_a_fast_logger_lose_no_row() -> None:
    time = np.arange(2000) * 0.005
    found = in_order(made(np.insert(time, 1000, time[1000]), step=MS), where="x")
    assert len(found.time) == 2001
    assert kinds(found) == ["equal-stamps"]


UNEVEN = np.unique(stream(11, "spread").integers(0, 2000, 150))
SHARED: dict[str, tuple[np.ndarray, float]] = {
    "a receiver's clock that is read once a minute": (np.arange(6000) // 600 * 60, 1),
    "bursts of ten rows a minute": (np.repeat(np.arange(200) * 60, 10), 1),
    "a number of rows that does not follow the stamps": (
        np.repeat(np.arange(40) * 60, np.tile([2, 9, 4, 14, 6, 20, 3, 11], 5)),
        60,
    ),
    "rows that come when something happens": (
        60 * np.repeat(UNEVEN, stream(12, "spread").integers(1, 6, len(UNEVEN))),
        60,
    ),
    "dates that rows share": (np.repeat(np.arange(4), 10) * 86_400, 86_400),
}
"""Stamps that stand for rows whose own times the file does not state."""


@pytest.mark.parametrize("name", SHARED)
def test_where_the_file_does_not_say_when_a_row_was_read_it_is_refused(name: str) -> None:
    stamps, step = SHARED[name]
    with pytest.raises(TimeError, match="does not say when each was read") as caught:
        in_order(made(stamps, step=step), where="x")
    assert "--rate HZ" in (caught.value.fix or "")
    assert "[rows]" in (caught.value.fix or "")


def test_rows_lost_between_coarse_stamps_are_a_gap_of_their_length() -> None:
    row = np.arange(2400)
    found = gaps(in_order(made(row // 4 + 600 * (row >= 1200), step=1), where="x"))
    (gap,) = [one for one in found.findings if one.kind == "gaps"]
    assert (gap.count, gap.value) == (1, pytest.approx(600.25, abs=1e-6))


@pytest.mark.parametrize(
    "copies", [[5] * 30, [2] * 3, [1, 1, 1, 1, 5, *[1] * 7], [1, 2, 1], [5], [3, 1, 2, 4]]
)
def test_copies_of_a_row_are_left_out_and_never_spread(copies: Sequence[int]) -> None:
    plain = made(60 * np.arange(len(copies)))
    found = in_order(plain.take(np.repeat(np.arange(len(copies)), copies)), where="x")
    assert seconds(found) == (60 * np.arange(len(copies))).tolist()
    assert found.channels["wind_speed"].tolist() == plain.channels["wind_speed"].tolist()
    assert [(one.kind, one.count) for one in found.findings] == [
        ("duplicate-rows", sum(copies) - len(copies))
    ]


def test_readings_that_change_within_a_stamp_are_no_copies() -> None:
    speed = np.round(stream(4, "coarse").uniform(3, 4, 400), 1)  # one in ten repeats the one before
    assert len(in_order(made(np.arange(400) // 4, speed, step=1), where="x").time) == 400


def test_a_download_that_overlaps_the_one_before_is_left_out() -> None:
    plain = made(np.arange(1200))
    found = in_order(plain.take(np.concatenate([np.arange(800), np.arange(700, 1200)])), where="x")
    assert seconds(found) == list(range(1200))
    assert found.channels["wind_speed"].tolist() == plain.channels["wind_speed"].tolist()
    assert [(one.kind, one.count) for one in found.findings] == [("repeated-stretch", 100)]


def test_an_empty_row_takes_no_reading_with_it_where_it_is_out_of_order_and_stays_where_it_is_not() -> (
    None
):
    speed = np.arange(30.0)
    speed[[7, 21]] = np.nan
    stamps = np.arange(30)
    stamps[21:] -= 3
    stamps[22:] += 2
    for beside in (stamps, np.where(np.arange(30) == 21, 20, stamps)):
        found = in_order(made(beside, speed), where="x")
        assert found.line.tolist() == [line for line in range(2, 32) if line != 23]
        assert kinds(found) == ["empty-rows"]


def test_order_is_kept_and_nothing_lost_when_rows_come_a_little_late() -> None:
    found = in_order(made([0, 1, 3, 2, 4], [0, 1, 3, 2, 4]), where="x")
    assert found.channels["wind_speed"].tolist() == [0, 1, 2, 3, 4]
    assert found.flags.tolist() == [0, 0, SampleFlag.TIME_UNSURE, 0, 0]
    assert kinds(found) == ["time-backwards"]


WILD: dict[str, dict[int, float]] = {
    "stamps of other years": {20: 1e6, 50: -1e6, 51: -1e6},
    "the first row": {0: 3e6},
    "the last row": {99: -3e6},
    "two rows that changed places": {30: 5, 35: -5},
}


@pytest.mark.parametrize("choice", [None, "first", "last"])
@pytest.mark.parametrize("name", WILD)
def test_the_fewest_possible_rows_are_left_out_for_wild_stamps(
    name: str, choice: ClockChoice | None
) -> None:
    time = np.arange(100.0)
    for row, by in WILD[name].items():
        time[row] += by
    found = in_order(made(time), where="x", choice=choice)
    assert sorted(set(range(2, 102)) - set(found.line.tolist())) == [row + 2 for row in WILD[name]]
    (finding,) = [one for one in found.findings if one.kind == "time-backwards"]
    assert (finding.count, finding.severity) == (len(WILD[name]), Severity.ERROR)


def test_the_longest_rise_is_the_longest() -> None:
    assert longest_rise(np.array([3, 1, 2, 9, 4, 5])).tolist() == [1, 2, 4, 5]


N = 300
UNSTEADY = np.cumsum(stream(10, "disorder").integers(1, 9, N)) * 60.0
ROWS = {
    "shuffled": stream(9, "disorder").permutation(N),
    "blocks from the last to the first": np.arange(N).reshape(6, 50)[::-1].ravel(),
    "blocks": np.arange(N).reshape(6, 50)[[3, 0, 4, 1, 2, 5]].ravel(),
    "two halves": np.arange(N).reshape(2, 150)[::-1].ravel(),
    "blocks each from its end": np.arange(N).reshape(6, 50)[:, ::-1].ravel(),
}


@pytest.mark.parametrize("name", ROWS)
def test_rows_out_of_order_are_asked_about_and_sorted_where_the_user_says_so(name: str) -> None:
    plain, order = made(600 * np.arange(N)), ROWS[name]
    with pytest.raises(TimeError) as caught:
        in_order(plain.take(order), where="x")
    assert "--clock sort" in (caught.value.fix or "")
    found = in_order(plain.take(order), where="x", choice="sort")
    assert found.line.tolist() == plain.line.tolist()
    assert not found.flags.any()
    (finding,) = found.findings
    assert (finding.kind, finding.severity) == ("rows-sorted", Severity.NOTE)
    assert finding.count == N - len(longest_rise(order))


def test_rows_that_come_unevenly_may_be_out_of_order_and_the_message_says_how_to_sort_them() -> (
    None
):
    plain = made(UNSTEADY)
    moved = np.r_[0:100, 140:200, 100:140, 200:N]
    try:
        found = in_order(plain.take(moved), where="x")
        fixes = [one.fix or "" for one in found.findings if one.kind == "clock-set-back"]
    except TimeError as error:
        fixes = [error.fix or ""]
    assert fixes
    assert all("--clock sort" in fix for fix in fixes)


def test_a_table_is_sorted_by_its_wall_clock_before_daylight_saving_is_looked_at() -> None:
    """The clocks of Amsterdam go back on 25 October 2026 at 03:00; rows of two hours, in an order
    of their own."""
    start = dt.datetime(2026, 10, 24, 13)  # noqa: DTZ001
    stamps = [start + dt.timedelta(minutes=120 * at) for at in range(30)]
    rows = [f"{stamps[at]},{3 + at / 10:.1f}\n" for at in [*range(10, 30), *range(10)]]
    found = read("time,wind_speed\n" + "".join(rows), zone="Europe/Amsterdam", clock="sort")
    assert found.series.channels["wind_speed"] == pytest.approx(3 + np.arange(30) / 10)
    assert found.series.time[0] == np.datetime64("2026-10-24T11:00", "ns").astype(np.int64)


def test_a_word_on_the_clock_is_offered_only_where_it_would_have_the_rows_read() -> None:
    """So many steps back are of no clock that was set."""
    many = np.cumsum([17, 61, 23, 140, 9, 88, 35, 201, 47, 12] * 4)[
        np.argsort((7 * np.arange(40)) % 41)
    ]
    for choice in (None, "first"):
        with pytest.raises(TimeError, match="rows would have to go") as caught:
            in_order(made(many), where="x", choice=choice)
        assert "--clock first" not in (caught.value.fix or "")
        assert "--clock sort" in (caught.value.fix or "")
    assert len(in_order(made(many), where="x", choice="sort").time) == 40


@pytest.mark.parametrize("choice", ["first", "last", "sort"])
def test_a_clock_option_that_nothing_calls_for_is_reported_as_unused(choice: ClockChoice) -> None:
    (finding,) = in_order(made(np.arange(100)), where="x", choice=choice).findings
    assert f"--clock {choice} is not used" in finding.what


def test_a_stream_has_no_rows_to_sort() -> None:
    lines = (f"$GPZDA,12000{s},01,05,2026,00,00\n$WIMWV,10.0,R,{3 + s % 3},M,A\n" for s in range(9))
    with pytest.raises(UsageError, match="order in which they came"):
        read("".join(lines), clock="sort")


def test_a_date_a_row_is_its_midnight(tmp_path: Path) -> None:
    recipe = tmp_path / "dates.toml"
    recipe.write_text(
        'name = "dates"\nabout = "a"\nsource = "b"\n[time]\ncolumns = ["time"]\nformat = '
        '"%Y-%m-%d"\n'
        '[channels.wind_speed]\ncolumn = "v"\nunit = "m/s"\n[sensor]\nname = "x"\n'
    )
    rows = "".join(f"2026-05-{at:02d},{3 + at / 10:.1f}\n" for at in range(1, 31))
    log = read("time,v\n" + rows, zone="UTC", recipe=str(recipe))
    assert set(np.diff(log.series.time)) == {86_400 * 10**9}
