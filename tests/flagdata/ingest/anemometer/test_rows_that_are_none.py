"""Rows that are no readings: empty ones out of order, copies that differ in other columns, counters taken for sites."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from flagdata.errors import InputError, TimeError
from flagdata.ingest.anemometer.restating import packed_letters
from flagdata.signals import WindLog

Read = Callable[..., WindLog]


def kinds(log: WindLog) -> set[str]:
    return {found.kind for found in log.findings}


def test_an_empty_row_out_of_order_takes_no_reading_with_it(read: Read) -> None:
    rows = [f"2026-05-01 12:{minute:02d}:25,{3 + minute % 4}.5,{200 + minute}" for minute in range(30)]
    rows.insert(21, "2026-05-01 12:18:25,None,None")
    log = read("time,ws [m/s],wd [deg]\n" + "\n".join(rows) + "\n", zone="UTC")
    assert len(log.series.time) == 30
    assert "empty-rows" in kinds(log)
    assert "time-backwards" not in kinds(log)


def test_empty_rows_in_order_stay_as_missing_values(read: Read) -> None:
    rows = [
        f"2026-05-01 12:{minute:02d}:25,{'' if minute == 7 else 3 + minute % 4},{200 + minute}" for minute in range(30)
    ]
    log = read("time,ws [m/s],wd [deg]\n" + "\n".join(rows) + "\n", zone="UTC")
    assert len(log.series.time) == 30
    assert "empty-rows" not in kinds(log)


def test_rows_of_one_fine_stamp_that_differ_in_another_column_are_one_reading(read: Read) -> None:
    rows = [
        f"{1_777_636_800_000 + 600_000 * step},{3 + step % 4}.5,{200 + step},{surface}"
        for step in range(12)
        for surface in (("Dry", "Wet") if step == 4 else ("Dry",))
    ]
    log = read("time_ms,ws [m/s],wd [deg],pavement\n" + "\n".join(rows) + "\n")
    assert len(log.series.time) == 12
    assert not np.any(log.series.time % 10**9)


def test_a_count_of_rows_tells_no_sites(read: Read) -> None:
    text = "id,timestamp,wind_speed [m/s],wind_deg\n"
    text += "".join(
        f"{7 + row + row // 5},2026-05-01 {row:02d}:00:00,{3 + row % 4}.5,{100 + row}\n" for row in range(20)
    )
    log = read(text, zone="UTC")
    assert len(log.series.time) == 20


def test_rows_of_several_places_that_nothing_tells_apart_are_refused(read: Read) -> None:
    text = "id,timestamp,wind_speed [m/s],wind_deg\n"
    hours = (10, 11, 12, 13, 10, 10, 10, 11, 10, 12, 16, 11, 10, 10, 13, 12, 10, 11, 10, 14)
    text += "".join(
        f"{1 + row},2026-05-01 {hour:02d}:00:00,{3 + row % 7}.5,{100 + 9 * row}\n" for row, hour in enumerate(hours)
    )
    with pytest.raises(TimeError, match="several stations"):
        read(text, zone="UTC")


_PACKED = [
    f"2026-05-01T12:00:{second:02d} A0{752 + second}B{100 + second}C0002D00{10 + second}*2F" for second in range(30)
]


def test_numbers_behind_letters_become_columns_that_the_user_names(read: Read) -> None:
    text = "\n".join(_PACKED) + "\n"
    with pytest.raises(InputError, match="'A', 'B', 'C', 'D'"):
        read(text, zone="UTC")
    log = read(text, zone="UTC", columns="time,,wind_direction[deg],,wind_speed[0.1 m/s]")
    assert log.series.channels["wind_speed"] == pytest.approx([(10 + second) / 10 for second in range(30)])
    assert np.degrees(log.series.channels["wind_direction"][3]) == pytest.approx(103)


@pytest.mark.parametrize(
    "lines",
    [
        [f"2026-05-01T12:00:{second:02d} 0R1,Sm={second}.5M" for second in range(30)],
        [f"2026-05-01T12:00:{second:02d} A12" for second in range(30)],
        [f"A0752B135C0002D{second:04d}" for second in range(30)],
    ],
)
def test_other_lines_are_no_packed_letters(lines: list[str]) -> None:
    assert not packed_letters.matches(lines)


def test_a_summary_row_beside_a_report_of_the_same_stamp_moves_none(read: Callable[..., WindLog]) -> None:
    rows = [f"2026-05-{1 + at // 24:02d}T{at % 24:02d}:00:00Z,{3 + at % 5},," for at in range(72)]
    for day in (2, 1):
        rows.insert(24 * day, f"2026-05-{1 + day:02d}T00:00:00Z,,5.7,summary")
    log = read("\n".join(["Time,Wind speed (m/s),rain,remark", *rows]) + "\n")
    expected = np.datetime64("2026-05-01", "ns").astype(np.int64) + np.arange(72) * 3600 * 10**9
    np.testing.assert_array_equal(log.series.time, expected)
    kinds = {found.kind for found in log.findings}
    assert "empty-rows" in kinds
    assert not kinds & {"uneven-stamps", "duplicate-stamps", "equal-stamps"}
