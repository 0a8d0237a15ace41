"""Stamps as programs for the file system and serial monitors write them: hyphens in the clock, letters behind it."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable

import numpy as np
import pytest

from flagdata.errors import FlagdataError
from flagdata.ingest.anemometer.words.headings import understand
from flagdata.signals import WindLog
from flagdata.timebase import iso

Read = Callable[..., WindLog]


@pytest.mark.parametrize(
    ("stamp", "options"),
    [
        ("26-05-01 12-{:02d}", {"date_order": "ymd"}), ("2026-05-01 12-{:02d}-00", {}), ("2026-05-01_12-{:02d}-00", {}),
        ("01-05-26--12:{:02d}:00", {"date_order": "dmy"}),
    ],
)  # fmt: skip
def test_hyphens_in_a_clock_are_no_offset(read: Read, stamp: str, options: dict[str, object]) -> None:
    rows = "".join(f"{stamp.format(at)},{3 + at},{200 + at}\n" for at in range(60))
    log = read(f"time,wind speed (m/s),wind dir\n{rows}", zone="UTC", **options)
    assert [iso(int(log.series.time[at])) for at in (0, 59)] == ["2026-05-01T12:00:00Z", "2026-05-01T12:59:00Z"]
    assert log.series.channels["wind_speed"][[0, 59]].tolist() == [3, 62]


@pytest.mark.parametrize(
    "day", ["20260501-1200", "20260501_1200", "20260501 1200", "2026-05-01 12.00.", "2026.05.01 12:00:"]
)
def test_milliseconds_behind_a_clock_without_colons_are_kept(read: Read, day: str) -> None:
    rows = "".join(f"{day}{at // 10:02d}.{at % 10}25,{3 + at % 7}\n" for at in range(60))
    log = read(f"time,wind speed (m/s)\n{rows}", zone="UTC")
    assert iso(int(log.series.time[0])) == "2026-05-01T12:00:00.025Z"
    assert set(np.diff(log.series.time)) == {100_000_000}


def test_whole_hours_with_hyphens_are_no_offset_either(read: Read) -> None:
    rows = "".join(f"2026-05-01 {at:02d}-00,{3 + at},{200 + at}\n" for at in range(24))
    log = read(f"time,wind speed (m/s),wind dir\n{rows}", zone="+02:00")
    assert iso(int(log.series.time[0])) == "2026-04-30T22:00:00Z"
    assert len(log.series) == 24


@pytest.mark.parametrize("offset", ["+02", "+0200", "+02:00"])
def test_offsets_behind_minutes_are_offsets(read: Read, offset: str) -> None:
    rows = "".join(f"01.05.2026 14:{at:02d}{offset},{3 + at},{200 + at}\n" for at in range(20))
    log = read(f"time,wind speed (m/s),wind dir\n{rows}")
    assert iso(int(log.series.time[0])) == "2026-05-01T12:00:00Z"


def test_letters_of_a_zone_behind_a_stamp_are_no_cell(read: Read) -> None:
    rows = "".join(f"2026-05-01 12:00:{at:02d} UTC,{at},{3 + at}.5,{200 + at}\n" for at in range(20))
    log = read(f"created_at,entry_id,field1,field2\n{rows}", columns="time,,wind_speed[m/s],wind_direction[deg]")
    assert iso(int(log.series.time[0])) == "2026-05-01T12:00:00Z"
    assert log.series.channels["wind_speed"][[0, 19]].tolist() == [3.5, 22.5]


def test_cells_behind_the_arrow_of_a_serial_monitor_are_columns(read: Read) -> None:
    rows = "".join(f"12:00:{at:02d}.250 -> {3 + at}.5,{200 + at}\n" for at in range(20))
    columns = "time,wind_speed[m/s],wind_direction[deg]"
    log = read(rows, columns=columns, date=dt.date(2026, 5, 1), zone="UTC")
    assert iso(int(log.series.time[0])) == "2026-05-01T12:00:00.250Z"
    assert log.series.channels["wind_speed"][[0, 19]].tolist() == [3.5, 22.5]


@pytest.mark.parametrize("name", ["speed_z", "velocity z (m/s)", "vel_z"])
def test_a_speed_along_one_axis_is_no_speed_of_wind(name: str) -> None:
    assert understand(name).channel == "wind_z"


def test_the_vertical_speed_beside_a_speed_is_no_anemometer(read: Read) -> None:
    rows = "".join(f"{1777636800 + at},{200 + at},{3 + at},0.1\n" for at in range(20))
    log = read(f"timestamp,direction,speed,speed_z\n{rows}", unit="m/s")
    assert log.series.channels["wind_speed"][[0, 19]].tolist() == [3, 22]


def test_a_stamp_behind_its_key_and_an_equals_sign_is_the_lines(read: Read) -> None:
    lines = [f"time=2026-05-01T10:00:{at:02d}Z wind_speed={3 + at % 4}.5 wind_dir={200 + at}" for at in range(12)]
    series = read("\n".join([*lines, ""]), unit="m/s").series
    assert series.channels["wind_speed"].tolist() == [3.5 + at % 4 for at in range(12)]
    assert str(np.datetime64(int(series.time[1]), "ns"))[:19] == "2026-05-01T10:00:01"


def test_points_beside_am_and_pm_do_not_tell_the_day(read: Read) -> None:
    text = "time,wind [m/s]\n" + "".join(f"06.07.20 01:{at:02d}:11 PM,{3 + at % 4}.5\n" for at in range(12))
    with pytest.raises(FlagdataError) as caught:
        read(text, zone="UTC")
    assert "--date-order" in (caught.value.fix or "")
    assert np.datetime64(int(read(text, zone="UTC", date_order="mdy").series.time[0]), "ns") == np.datetime64(
        "2020-06-07T13:00:11"
    )
