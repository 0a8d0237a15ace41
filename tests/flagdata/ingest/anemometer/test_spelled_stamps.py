"""Stamps before an instrument's lines and in tables, as people and programs write them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import TimeError
from flagdata.ingest.anemometer import WindOptions, read_log, sniff

Write = Callable[[str], Path]


def _first(path: Path, **options: str) -> np.datetime64:
    return read_log(path, WindOptions(**options)).series.time.astype("datetime64[ns]")[0]  # type: ignore[arg-type]


def _gill(at: int) -> str:
    body = f"Q,{200 + at:03d},{3 + at % 5:03d}.25,M,00,"
    check = 0
    for letter in body:
        check ^= ord(letter)
    return f"\x02{body}\x03{check:02X}"


@pytest.mark.parametrize(
    ("stamp", "options", "first"),
    [
        ("14/03/2026 10:00:{:02d}", {}, "2026-03-14T10:00:00"),
        ("03/14/2026 10:00:{:02d} PM", {}, "2026-03-14T22:00:00"),
        ("14.03.2026,10:00:{:02d},", {}, "2026-03-14T10:00:00"),
        ("[14.03.26 10:00:{:02d}]", {}, "2026-03-14T10:00:00"),
        ("09/08/06,15:50:{:02d},", {"date_order": "ymd"}, "2009-08-06T15:50:00"),
        ("09/08/06,15:50:{:02d},", {"date_order": "dmy"}, "2006-08-09T15:50:00"),
    ],
)
def test_an_instrument_is_read_after_a_stamp_of_any_writing(
    log_file: Write, stamp: str, options: dict[str, str], first: str
) -> None:
    path = log_file("".join(f"{stamp.format(at)} {_gill(at)}\n" for at in range(12)))
    assert sniff(path)[0].format == "gill"
    assert _first(path, zone="UTC", **options) == np.datetime64(first)


def test_a_date_before_an_instruments_line_that_may_be_two_is_asked_about(log_file: Write) -> None:
    path = log_file("".join(f"09/08/06,15:50:{at:02d}, {_gill(at)}\n" for at in range(12)))
    with pytest.raises(TimeError) as caught:
        _first(path, zone="UTC")
    assert "--date-order" in (caught.value.fix or "")
    assert sniff(path)[0].kind == "anemometer"


def test_lines_after_times_of_day_are_known_before_the_day_is_said(log_file: Write) -> None:
    path = log_file("".join(f"10:00:{at:02d} {_gill(at)}\n" for at in range(12)))
    assert sniff(path)[0].kind == "anemometer"


@pytest.mark.parametrize(
    ("stamp", "first"),
    [
        ("2026-03-14 10:00:{:02d} CET", "2026-03-14T09:00"), ("2026-03-14 10:00:{:02d} EST", "2026-03-14T15:00"),
        ("Mar 14 2026 10:00:{:02d} JST", "2026-03-14T01:00"), ("14/03/2026 10:00:{:02d} CEST", "2026-03-14T08:00"),
    ],
)  # fmt: skip
def test_the_abbreviation_of_a_zone_is_its_offset(log_file: Write, stamp: str, first: str) -> None:
    rows = "".join(f"{stamp.format(at)};{3 + at % 5}.5\n" for at in range(12))
    assert _first(log_file(f"Time;Wind speed (m/s)\n{rows}")) == np.datetime64(first)


def test_letters_that_mean_several_zones_are_not_read_and_the_zone_is_asked_for(log_file: Write) -> None:
    rows = "".join(f"2026-03-14 10:00:{at:02d} CST;{3 + at % 5}.5\n" for at in range(12))
    path = log_file(f"Time;Wind speed (m/s)\n{rows}")
    with pytest.raises(TimeError, match="zone"):
        _first(path)
    assert _first(path, zone="+08:00") == np.datetime64("2026-03-14T02:00")


@pytest.mark.parametrize(("date", "first"), [("14 03 2026", "2026-03-14"), ("2026 03 14", "2026-03-14")])
def test_a_date_divided_by_blanks_is_a_date(log_file: Write, date: str, first: str) -> None:
    rows = "".join(f"{date} 10:{at:02d},{3 + at % 5}.5\n" for at in range(12))
    assert _first(log_file(f"Date/Time,Wind speed (m/s)\n{rows}"), zone="UTC") == np.datetime64(f"{first}T10:00")


def test_commas_divide_rows_without_names_whose_dates_and_hours_hold_blanks(log_file: Write) -> None:
    path = log_file("".join(f"2026 03 14 {at:02d},{3 + at % 5}.5,\n" for at in range(12)))
    log = read_log(path, WindOptions(columns="time[%Y %m %d %H],wind_speed[m/s]", zone="UTC"))
    assert log.series.time.astype("datetime64[ns]")[-1] == np.datetime64("2026-03-14T11:00")
    assert log.series.channels["wind_speed"][1] == 4.5


def test_cells_behind_a_stamp_and_a_blank_are_offered_as_columns(log_file: Write) -> None:
    path = log_file("".join(f"2026-03-14T10:00:{at:02d}Z {3 + at % 5}.5;{200 + at};+21\n" for at in range(12)))
    log = read_log(path, WindOptions(columns="time,wind_speed[m/s],wind_direction[deg],"))
    np.testing.assert_allclose(np.rad2deg(log.series.channels["wind_direction"][:2]), [200, 201])


@pytest.mark.parametrize("ahead", [True, False])
def test_a_line_that_is_a_stamp_is_that_of_the_readings_beside_it(log_file: Write, ahead: bool) -> None:
    text = ""
    for at in range(12):
        stamp, values = f"2026-03-14 10:00:{at:02d}\n", f"Wind speed: 3.{at % 10} m/s\nWind direction: {200 + at} deg\n"
        text += (stamp + values if ahead else values + stamp) + "\n"
    series = read_log(log_file(text), WindOptions(zone="UTC")).series
    assert series.time.astype("datetime64[ns]")[0] == np.datetime64("2026-03-14T10:00:00")
    np.testing.assert_allclose(np.rad2deg(series.channels["wind_direction"]), 200 + np.arange(12))


def test_a_column_that_may_be_the_direction_is_told_with_the_line_that_reads_it(log_file: Write) -> None:
    rows = "".join(f"2026-03-14T10:00:{at:02d}Z,{3 + at % 5}.5,{200 + at}\n" for at in range(12))
    path = log_file(f"time,wind speed (m/s),Degrees\n{rows}")
    remark = next(finding.what for finding in read_log(path).findings if finding.kind == "columns-not-read")
    line = remark.split('"')[1]
    channels = read_log(path, WindOptions(columns=line)).series.channels
    np.testing.assert_allclose(np.rad2deg(channels["wind_direction"]), 200 + np.arange(12))


def test_one_reading_needs_no_clock_that_moves(log_file: Write) -> None:
    path = log_file("2026-03-14T10:00:00.5Z $IIMWV,032,R,03.9,N,A*18\n2026-03-14T10:00:00.5Z $IIMTW,+15.0,C*3C\n")
    assert len(read_log(path).series.time) == 1


def test_a_line_that_states_units_names_no_columns(log_file: Write) -> None:
    head = "Place: 0N 140W\nUnits: Winds (m/s), W.Dir (deg), T (C)\nYYYYMMDD HHMM WSPD WDIR QQ SS\n"
    rows = "".join(f"20260314 10{at:02d}  {3 + at % 5}.5 {200 + at}.0 22 11\n" for at in range(12))
    channels = read_log(log_file(head + rows), WindOptions(zone="UTC", unit="m/s")).series.channels
    assert channels["wind_speed"][0] == 3.5
