"""What stands in cells beside the number: a word behind the clock, a direction told twice, a speed below the limit."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable

import numpy as np
import pytest

from flagdata.schema import SampleFlag
from flagdata.signals import WindLog
from flagdata.timebase import NANOSECONDS

Read = Callable[..., WindLog]
MINUTES = 40
START = 1_777_636_800  # s, 2026-05-01T12:00:00Z
POINTS = ("N", "NNE", "NE", "ENE", "E", "ESE", "SE", "SSE", "S", "SSW", "SW", "WSW", "W", "WNW", "NW", "NNW")


def speed(minute: int) -> float:
    return round(3 + minute % 7 / 10, 1)


def angle(minute: int) -> int:
    return minute * 9 % 360


def point(degrees: float) -> str:
    return POINTS[round(degrees / 22.5) % 16]


def kinds(log: WindLog) -> set[str]:
    return {finding.kind for finding in log.findings}


def check_times(log: WindLog) -> None:
    np.testing.assert_array_equal(log.series.time, (START + 60 * np.arange(MINUTES)) * NANOSECONDS)
    np.testing.assert_allclose(log.series.channels["wind_speed"], [speed(minute) for minute in range(MINUTES)])


@pytest.mark.parametrize(
    "clock", ["12:{:02d} Uhr", "12.{:02d} Uhr", "12:{:02d}:00 Uhr", "12:{:02d} h", "12:{:02d}hs", "kl. 12:{:02d}"]
)
def test_a_word_beside_the_clock_is_left_out(read: Read, clock: str) -> None:
    rows = "".join(f"01.05.2026 {clock.format(k)};{speed(k):.1f};{angle(k)}\n" for k in range(MINUTES))
    log = read(f"Zeit;Wind (m/s);Windrichtung (deg)\n{rows}", zone="UTC", date_order="dmy")
    check_times(log)
    assert "clock-in-words" in kinds(log)


def test_words_of_the_afternoon_stay(read: Read) -> None:
    rows = "".join(f"01.05.2026 01:{k:02d} PM;{speed(k):.1f}\n" for k in range(MINUTES))
    log = read(f"time;wind (m/s)\n{rows}", zone="UTC", date_order="dmy")
    assert log.series.time[0] == (START + 3600) * NANOSECONDS
    assert "clock-in-words" not in kinds(log)


def test_a_letter_behind_a_number_that_is_no_clock_stays(read: Read) -> None:
    lines = "".join(
        f"12:{k:02d}:00 S {speed(k):05.2f} D {angle(k)} T 01.{70 + k} H 38.{50 + k}\n" for k in range(MINUTES)
    )
    log = read(lines, zone="UTC", date=dt.date(2026, 5, 1))
    assert "clock-in-words" not in kinds(log)
    np.testing.assert_allclose(log.series.channels["relative_humidity"], [0.385 + k / 1e4 for k in range(MINUTES)])


@pytest.mark.parametrize("cell", ["{p} ({d}°)", "{d}° {p}", "{d}°({p})", "{d} ({p})", "{p} {d}", "{p}({d})"])
def test_a_direction_that_is_told_twice_is_read_by_its_angle(read: Read, cell: str) -> None:
    rows = "".join(
        f"2026-05-01T12:{k:02d}:00Z,{speed(k):.1f},{cell.format(p=point(angle(k)), d=angle(k))}\n"
        for k in range(MINUTES)
    )
    log = read(f"time,wind speed (m/s),wind direction\n{rows}")
    check_times(log)
    told = np.rad2deg(log.series.channels["wind_direction"])
    np.testing.assert_allclose(told, [angle(k) for k in range(MINUTES)], atol=1e-9)
    assert "direction-told-twice" in kinds(log)


def test_the_angle_settles_whether_o_is_east_or_west(read: Read) -> None:
    letters = {"N": 0, "NO": 45, "O": 90, "SO": 135, "S": 180, "SW": 225, "W": 270, "NW": 315}
    cells = [f"{name} ({degrees}°)" for name, degrees in letters.items()] * 5
    rows = "".join(f"2026-05-01T12:{k:02d}:00Z,{speed(k):.1f},{cell}\n" for k, cell in enumerate(cells))
    told = np.rad2deg(read(f"time,wind speed (m/s),direction\n{rows}").series.channels["wind_direction"])
    np.testing.assert_allclose(told, [*letters.values()] * 5, atol=1e-9)


def test_a_cell_whose_two_directions_differ_has_none_and_is_counted(read: Read) -> None:
    cells = [f"{point(angle(k))} ({angle(k)}°)" for k in range(MINUTES)]
    cells[7] = "N (180°)"
    rows = "".join(f"2026-05-01T12:{k:02d}:00Z,{speed(k):.1f},{cell}\n" for k, cell in enumerate(cells))
    log = read(f"time,wind speed (m/s),wind direction\n{rows}")
    assert np.flatnonzero(np.isnan(log.series.channels["wind_direction"])).tolist() == [7]
    assert [finding.count for finding in log.findings if finding.kind == "directions-differ"] == [1]


def test_a_longitude_is_no_direction(read: Read) -> None:
    rows = "".join(f"2026-05-01T12:{k:02d}:00Z,{speed(k):.1f},90 E\n" for k in range(MINUTES))
    log = read(f"time,wind speed (m/s),longitude\n{rows}")
    check_times(log)
    assert "direction-told-twice" not in kinds(log)


@pytest.mark.parametrize(
    ("cell", "unit", "limit"), [("<0.3", "m/s", 0.3), ("< 0.5", "m/s", 0.5), ("<1.8", "km/h", 0.5)]
)
def test_a_speed_below_the_limit_is_zero_with_the_limit_as_threshold(
    read: Read, cell: str, unit: str, limit: float
) -> None:
    cells = [cell if k % 8 == 5 else f"{speed(k):.1f}" for k in range(MINUTES)]
    rows = "".join(f"2026-05-01T12:{k:02d}:00Z,{text},{angle(k)}\n" for k, text in enumerate(cells))
    log = read(f"time,wind speed ({unit}),wind direction (deg)\n{rows}")
    still = [5, 13, 21, 29, 37]
    assert np.flatnonzero(log.series.channels["wind_speed"] == 0).tolist() == still
    assert np.flatnonzero(log.series.flags & SampleFlag.DEAD_ZONE).tolist() == still
    assert log.series.sensor.threshold == pytest.approx(limit)
    said = [finding for finding in log.findings if finding.kind == "below-threshold"]
    assert [(finding.count, finding.where) for finding in said] == [(5, "line 7")]
    assert said[0].value == pytest.approx(limit)
    assert "missing-values" not in kinds(log)


def test_it_is_so_with_decimal_commas_and_beyond_the_first_rows(read: Read) -> None:
    cells = ["<0,4" if k == 1500 else f"{3 + k % 7 / 10:.1f}".replace(".", ",") for k in range(1600)]
    rows = "".join(
        f"2026-05-01 {k // 3600:02d}:{k // 60 % 60:02d}:{k % 60:02d}Z;{text}\n" for k, text in enumerate(cells)
    )
    log = read(f"time;wind speed (m/s)\n{rows}")
    assert np.flatnonzero(log.series.channels["wind_speed"] == 0).tolist() == [1500]
    assert log.series.sensor.threshold == pytest.approx(0.4)


def test_below_a_limit_in_another_column_is_no_value(read: Read) -> None:
    cells = ["<5" if k % 8 == 5 else "40" for k in range(MINUTES)]
    rows = "".join(f"2026-05-01T12:{k:02d}:00Z,{speed(k):.1f},{text}\n" for k, text in enumerate(cells))
    log = read(f"time,wind speed (m/s),humidity (%)\n{rows}")
    check_times(log)
    assert "below-threshold" not in kinds(log)
    humidity = log.series.channels.get("relative_humidity")
    assert humidity is None or np.isnan(humidity[5])
