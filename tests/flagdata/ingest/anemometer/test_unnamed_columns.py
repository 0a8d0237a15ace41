"""Times in columns that no line names, and names that a list above the table gives."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError
from flagdata.ingest.anemometer import WindOptions, anemometers, read_log
from flagdata.timebase import iso

Write = Callable[[str], Path]


def _offer(path: Path, **options: str) -> str:
    """The line of columns that a refusal offers."""
    with pytest.raises(FlagdataError) as caught:
        read_log(path, WindOptions(**options))  # type: ignore[arg-type]
    found = re.search(r'--columns "([^"]*)"', caught.value.fix or "")
    assert found is not None
    return found[1]


def _with_speed(offered: str, column: int) -> str:
    """The offered line as its user completes it: the column of the speed, and nothing for what is not needed."""
    entries = offered.split(",")
    if "=" in offered:
        return ",".join([*(entry for entry in entries if "?" not in entry), f"{column}=wind_speed[m/s]"])
    kept = ["" if "?" in entry else entry for entry in entries]
    return ",".join([*kept[: column - 1], "wind_speed[m/s]", *kept[column:]])


def _two_clocks(count: int = 4, more: str = "") -> str:
    return "".join(
        f"77001 20260501 {at // 12:02d}{5 * at % 60:02d} 20260430 {17 + at // 12:02d}{5 * at % 60:02d}  -0.5 21.{at} "
        f"{2 + at / 10:.2f} 0{more}\n"
        for at in range(1, count + 1)
    )  # fmt: skip


@pytest.mark.parametrize(("more", "begins"), [("", "?,date,time[%H%M],"), (" 0" * 8, "2=date,3=time[%H%M],")])
def test_a_date_of_eight_digits_and_a_clock_beside_it_are_offered_each_by_its_name(
    log_file: Write, more: str, begins: str
) -> None:
    path = log_file(_two_clocks(more=more))
    offered = _offer(path)
    assert offered.startswith(begins)
    log = read_log(path, WindOptions(columns=_with_speed(offered, 8), zone="UTC"))
    assert [iso(int(at))[:16] for at in log.series.time] == [f"2026-05-01T00:{5 * at:02d}" for at in range(1, 5)]
    assert log.series.channels["wind_speed"].tolist() == pytest.approx([2.1, 2.2, 2.3, 2.4])


def test_two_pairs_of_date_and_clock_tell_their_zones(log_file: Write) -> None:
    with pytest.raises(FlagdataError) as caught:
        read_log(log_file(_two_clocks()), WindOptions(wind="8", unit="m/s"))
    assert "7 h earlier" in (caught.value.fix or "")
    assert "--zone UTC" in (caught.value.fix or "")
    assert "--zone +07:00" in (caught.value.fix or "")


def test_a_zone_is_not_told_by_pairs_whose_distance_changes(log_file: Write) -> None:
    text = _two_clocks().replace("1720", "1719")
    with pytest.raises(FlagdataError) as caught:
        read_log(log_file(text), WindOptions(wind="8", unit="m/s"))
    assert "earlier" not in (caught.value.fix or "")


def test_year_month_day_and_hours_with_minutes_without_zeros_are_offered(log_file: Write) -> None:
    clocks = [10, 20, 30, 40, 50, 100, 110]
    rows = "".join(f"2026,5,1,{clock},{2 + at / 10:.1f},0.4,{200 + at}\n" for at, clock in enumerate(clocks))
    path = log_file(rows)
    offered = _offer(path)
    assert offered.startswith("year,month,day,time[%H%M]")
    log = read_log(path, WindOptions(columns="year,month,day,time[%H%M],wind_speed[m/s]", zone="UTC"))
    assert [iso(int(at))[11:16] for at in log.series.time] == [
        "00:10", "00:20", "00:30", "00:40", "00:50", "01:00", "01:10",
    ]  # fmt: skip


_FIELDS = (
    "Year", "Month", "Day", "Hour and minute as hhmm", "Wind Speed (m/s) at 40 m", "3sec-Gust Wind Speed (m/s) at 40 m",
    "Wind Speed (m/s) at 60.5 m", "Wind Direction (deg) at 60.5 m", "Flag for Wind Speed at 40 m",
)  # fmt: skip


@pytest.mark.parametrize("mark", ["  {}. {}", "Column {}: {}", "#{} - {}", "{}) {},,,,,,,,"])
@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_a_list_of_fields_above_a_table_names_its_columns(log_file: Write, mark: str, delimiter: str) -> None:
    above = [
        "A mast",
        "Fields in each record:",
        *(mark.format(at, name) for at, name in enumerate(_FIELDS, start=1)),
        "",
    ]
    rows = [
        delimiter.join(["2026", "5", "1", str(10 * at), f"3.{at}", f"5.{at}", f"4.{at}", str(200 + at), "1"])
        for at in range(1, 6)
    ]
    path = log_file("\n".join([*above, *rows]) + "\n")
    zone = WindOptions(zone="UTC")
    assert anemometers(path, zone) == ("Wind Speed (m/s) at 40 m", "Wind Speed (m/s) at 60.5 m")
    log = read_log(path, WindOptions(zone="UTC", wind="Wind Speed (m/s) at 60.5 m"))
    assert log.series.sensor is not None
    assert log.series.sensor.height == 60.5
    assert log.series.channels["wind_speed"].tolist() == pytest.approx([4.1, 4.2, 4.3, 4.4, 4.5])
    assert np.degrees(log.series.channels["wind_direction"]).tolist() == pytest.approx([201, 202, 203, 204, 205])
    assert iso(int(log.series.time[0]))[:16] == "2026-05-01T00:10"


def test_a_list_of_other_than_the_columns_names_none(log_file: Write) -> None:
    above = "1. Read the manual\n2. Mount the mast\n3. Wait\n\n"
    path = log_file(above + "time,wind (m/s)\n" + "".join(f"2026-05-01T12:00:{at:02d}Z,2.{at}\n" for at in range(6)))
    assert "fields-listed" not in {finding.kind for finding in read_log(path).findings}


@pytest.mark.parametrize("heading", ["hhmm", "HHMM", "Hour and minute", "time (hhmm)"])
def test_small_hours_and_minutes_in_one_number_are_minutes(log_file: Write, heading: str) -> None:
    rows = "".join(f"2026,5,1,{10 * at},{2 + at / 10:.1f}\n" for at in range(3))
    log = read_log(log_file(f"year,month,day,{heading},wind (m/s)\n{rows}"), WindOptions(zone="UTC"))
    assert [iso(int(at))[11:16] for at in log.series.time] == ["00:00", "00:10", "00:20"]


@pytest.mark.parametrize("first", [0, 1])
def test_a_date_of_eight_digits_and_the_hour_beside_it_are_offered_in_an_hourly_log(
    log_file: Write, first: int
) -> None:
    hours = range(first, first + 24)
    rows = (f"260,2026050{day},{hour:5d},{10 * hour + day:4d}\n" for day in range(1, 4) for hour in hours)
    path = log_file("".join(rows))
    offered = _offer(path)
    assert offered.split(",")[1:3] == ["date", "hour"]
    log = read_log(path, WindOptions(columns=",date,hour,wind_speed[0.1 m/s]", zone="UTC"))
    assert iso(int(log.series.time[0])) == f"2026-05-01T0{first}:00:00Z"
    assert iso(int(log.series.time[-1])) == ("2026-05-03T23:00:00Z" if first == 0 else "2026-05-04T00:00:00Z")
    assert set(np.diff(log.series.time)) == {3_600_000_000_000}
    assert ("heading-doubtful" in {finding.kind for finding in log.findings}) == (first == 1)


def test_a_column_written_shorter_than_the_date_before_it_is_no_minute(log_file: Write) -> None:
    """A direction in whole degrees behind an hour, in a table with zeros before all parts of the date."""
    rows = "".join(f"BRW 2026 05 01 {hour:02d} {(7 * hour) % 50:4d} {4 + hour % 3}.5\n" for hour in range(14))
    path = log_file(rows)
    assert _offer(path) == ",year,month,day,hour,?,?"
    log = read_log(path, WindOptions(columns=",year,month,day,hour,wind_direction[deg],wind_speed[m/s]", zone="UTC"))
    assert set(np.diff(log.series.time)) == {3_600_000_000_000}
    np.testing.assert_allclose(np.rad2deg(log.series.channels["wind_direction"][:3]), [0, 7, 14], atol=1e-9)


def test_the_hours_of_a_dozen_rows_are_told_and_those_of_a_few_are_not(log_file: Write) -> None:
    rows = [f"2026  5   1  {hour}   {0.1 * hour:.1f}   273.{hour}   0.{hour}\n" for hour in range(1, 13)]
    assert _offer(log_file("".join(rows))).startswith("year,month,day,hour,?")
    assert "hour" not in _offer(log_file("".join(rows[:5])))


def test_a_speed_that_the_user_names_by_its_number_tells_that_no_direction_is_read(log_file: Write) -> None:
    rows = "".join(f"20260501-12{at:02d}00 4.4 87.8 {1 + at / 10:.1f} {20 + at}.5 0.8\n" for at in range(12))
    log = read_log(log_file(rows), WindOptions(wind="4", unit="m/s", zone="UTC"))
    told = " ".join(finding.what for finding in log.findings if finding.kind == "columns-not-read")
    assert '--columns "1=time,4=wind_speed[m/s],?=wind_direction[deg]"' in told
    read = read_log(log_file(rows), WindOptions(columns="1=time,5=wind_direction[deg],4=wind_speed[m/s]", zone="UTC"))
    np.testing.assert_allclose(np.rad2deg(read.series.channels["wind_direction"][:2]), [20.5, 21.5], atol=1e-9)


def test_a_date_that_stands_twice_before_the_clock_is_read_once(log_file: Write) -> None:
    """Year, day of the year, month, day and a clock, as tables of Antarctic stations have them."""
    rows = "".join(
        f"2014 {32 + at // 24:3d} {2:2d} {1 + at // 24:2d} {at % 24:02d}00 {-6.7 - at % 3:6.1f} {1.5 + at % 4:6.1f}\n"
        for at in range(72)
    )
    path = log_file(f"Year: 2014  Month: 02  ID: BAT\n{rows}")
    log = read_log(path, WindOptions(wind="7", unit="m/s", zone="UTC"))
    assert iso(int(log.series.time[0])) == "2014-02-01T00:00:00Z"
    assert np.unique(np.diff(log.series.time)).tolist() == [3600 * 10**9]
    assert len(log.series) == 72
