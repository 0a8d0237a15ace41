"""Rows that share a stamp get instants of their own, by the rate at which they came; none is lost, none invented."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from flagdata.findings import Severity
from flagdata.ingest.anemometer.reading import Reading
from flagdata.ingest.anemometer.samples.order import in_order
from flagdata.ingest.anemometer.samples.quality import gaps
from flagdata.rng import stream
from flagdata.schema import SampleFlag
from flagdata.signals import Sensor, WindLog

S = 1_000_000_000
MS = 1_000_000
T0 = 1_777_636_800 * S
Read = Callable[..., WindLog]


def smooth(n: int) -> np.ndarray:
    """Wind whose neighbours are alike, as of a sensor that is read faster than the gusts change."""
    noise = stream(4, "spread", n).normal(0, 1, n + 30)
    return 6 + np.convolve(noise, np.ones(31) / 6, mode="valid")


def ordered(time: np.ndarray, values: np.ndarray, *, step: int) -> Reading:
    reading = Reading(
        time=T0 + np.asarray(time, dtype=np.int64), channels={"wind_speed": values},
        flags=np.zeros(len(time), dtype=np.uint16), line=np.arange(2, len(time) + 2), sensor=Sensor(name="x"),
        step=step,
    )  # fmt: skip
    return in_order(reading, where="x")


@pytest.mark.parametrize(("rate", "hold"), [(10, 60), (1, 60), (10, 5)])
@pytest.mark.parametrize("phase", [0, 17])
def test_rows_of_a_held_stamp_come_at_the_sensors_own_rate(rate: int, hold: int, phase: int) -> None:
    n = 20 * rate * hold
    row = np.arange(n) + phase
    log = ordered(row // (rate * hold) * hold * S, smooth(n), step=S)
    assert (log.time - T0).tolist() == pytest.approx((row * S // rate).tolist(), abs=2)
    (finding,) = log.findings
    assert (finding.kind, finding.severity, finding.value) == ("held-stamps", Severity.WARNING, pytest.approx(1 / rate))
    assert f"({rate} Hz)" in finding.what
    assert "rows came evenly" in finding.what
    assert bool(np.all(log.flags & SampleFlag.TIME_UNSURE))
    assert gaps(log) == ()


def test_rows_whose_number_does_not_follow_the_stamps_did_not_come_evenly() -> None:
    counts = np.tile([2, 9, 4, 14, 6, 20, 3, 11], 5)
    log = ordered(np.repeat(np.arange(40) * 60, counts) * S, smooth(int(counts.sum())), step=S)
    (finding,) = [found for found in log.findings if found.kind == "held-stamps"]
    assert "came evenly" not in finding.what
    assert "came in no bursts" in finding.what
    assert "unsure by up to 60 s" in finding.what


def test_rows_lost_between_held_stamps_are_a_gap_of_their_length() -> None:
    row = np.arange(2400)
    log = ordered((row // 60 * 60 + 600 * (row >= 1200)) * S, smooth(2400), step=S)
    (gap,) = gaps(log)
    assert (gap.count, gap.value) == (1, pytest.approx(601, abs=1e-6))


def test_bursts_are_told_from_held_stamps_by_the_jump_of_the_readings() -> None:
    # ten rows within a second, once a minute, in a wind that is another by then
    level = np.repeat(stream(5, "bursts").uniform(2, 12, 200), 10)
    values = level + stream(6, "bursts").normal(0, 0.1, 2000)
    log = ordered(np.repeat(np.arange(200) * 60 * S, 10), values, step=S)
    within = (log.time - T0) % (60 * S)
    assert int(within.max()) < S
    assert "bursts" in log.findings[0].what
    assert log.findings[0].fix


def test_readings_that_do_not_vary_leave_it_open_whether_rows_came_in_bursts() -> None:
    log = ordered(np.repeat(np.arange(20) * 60 * S, 60), np.full(1200, 3.0), step=S)
    assert "do not show" in log.findings[0].what


@pytest.mark.parametrize("early", [True, False])
def test_rows_that_waited_in_a_buffer_are_spread_over_the_room_they_left(early: bool) -> None:
    # 200 Hz; every fiftieth row carries the stamp of the row before it, or of the one after
    row = np.arange(1, 3000)
    stamp = np.where(row % 50 == 0, row - 1 if early else row + 1, row)
    log = ordered(stamp * 5 * MS, smooth(2999), step=MS)
    assert (log.time - T0).tolist() == (row * 5 * MS).tolist()
    (finding,) = log.findings
    assert (finding.kind, finding.value) == ("equal-stamps", pytest.approx(0.005))
    assert gaps(log) == ()


def test_equal_milliseconds_of_a_fast_logger_lose_no_row() -> None:
    time = np.arange(2000) * 5 * MS
    log = ordered(np.insert(time, 1000, time[1000]), smooth(2001), step=MS)
    assert len(log.time) == 2001
    assert [f.kind for f in log.findings] == ["equal-stamps"]


def test_a_first_row_that_shares_the_second_ones_stamp_lies_a_period_before_it() -> None:
    time = np.concatenate(([0], np.arange(100) * 50 * MS))
    log = ordered(time, smooth(101), step=MS)
    assert (log.time - T0).tolist() == [50 * MS * k for k in range(-1, 100)]


def test_two_records_of_a_slow_logger_for_one_instant_are_one_too_many() -> None:
    log = ordered(np.array([0, 1, 2, 2, 3, 4, 5]) * 600 * S, smooth(7), step=60 * S)
    assert len(log.time) == 6
    assert [(f.kind, f.severity) for f in log.findings] == [("duplicate-stamps", Severity.ERROR)]


def test_a_timer_of_16_ms_is_a_clock_read_less_often_than_the_sensor() -> None:
    log = ordered(np.arange(3000) // 3 * 16 * MS, smooth(3000), step=MS)
    assert np.diff(log.time) == pytest.approx(16 * MS / 3, abs=1)
    assert [f.kind for f in log.findings] == ["held-stamps"]


def test_a_single_long_renewal_of_a_stamp_moves_no_row_to_its_end() -> None:
    log = ordered(np.repeat([0, 13_800 * S], [5, 4]), smooth(9), step=60 * S)
    assert (log.time[:5] - T0).max() < 60 * S
    assert log.time[5] - T0 == 13_800 * S


def test_rows_that_come_unevenly_stay_within_the_minute_of_their_stamp() -> None:
    noise = stream(11, "spread")
    minutes = np.unique(noise.integers(0, 2000, 150))
    rows = noise.integers(1, 6, len(minutes))
    log = ordered(np.repeat(minutes, rows) * 60 * S, smooth(int(rows.sum())), step=60 * S)
    assert len(log.time) == int(rows.sum())
    assert ((log.time - T0) // (60 * S)).tolist() == np.repeat(minutes, rows).tolist()
    assert (log.flags > 0).tolist() == np.repeat(rows > 1, rows).tolist()
    (finding,) = log.findings
    assert (finding.kind, finding.severity) == ("uneven-stamps", Severity.WARNING)
    assert "60 s" in finding.what


def test_no_row_of_a_held_stamp_comes_before_it() -> None:
    rows = stream(12, "spread").choice([1, 1, 2, 3], 60)
    rows[0] = 4
    log = ordered(np.repeat(np.arange(60) * 60 * S, rows), smooth(int(rows.sum())), step=60 * S)
    assert int(log.time[0]) >= T0
    assert len(log.time) == int(rows.sum())


def test_two_first_records_of_a_slow_logger_do_not_begin_the_log_earlier() -> None:
    log = ordered(np.array([0, 0, 1, 2, 3, 4, 5]) * 600 * S, smooth(7), step=60 * S)
    assert int(log.time[0]) == T0
    assert [(f.kind, f.severity) for f in log.findings] == [("duplicate-stamps", Severity.ERROR)]


def twice(values: np.ndarray, seconds: int) -> str:
    """Rows of which each stands twice, but for a cell that is no reading."""
    start = np.datetime64("2026-05-01T00:00:00", "s")
    rows = [f"{start + at // 2 * seconds}Z,{values[at // 2]:.3f},{at % 2}" for at in range(2 * len(values))]
    return "\n".join(["time,wind speed [m/s],pass", *rows]) + "\n"


def test_readings_said_again_under_their_stamp_are_taken_once(read: Read) -> None:
    values = np.round(smooth(20), 3)
    found = read(twice(values, 3600))
    assert found.series.channels["wind_speed"].tolist() == values.tolist()
    assert np.diff(found.series.time).tolist() == [3600 * S] * 19
    assert "readings-repeated" in {finding.kind for finding in found.findings}


def test_rows_of_one_stamp_with_readings_of_their_own_are_all_kept() -> None:
    assert len(ordered(np.repeat(np.arange(20), 2) * 3600 * S, smooth(40), step=3600 * S).time) == 40


def test_equal_readings_of_a_fast_log_are_all_kept(read: Read) -> None:
    assert len(read(twice(smooth(20), 1)).series.time) == 40
