"""Columns of the wind that are not read are named, with the line that reads them."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.ingest.anemometer import WindOptions, read_log

Write = Callable[[str], Path]


def _note(path: Path, **options: object) -> str:
    findings = read_log(path, WindOptions(**options)).findings  # type: ignore[arg-type]
    return " ".join(finding.what for finding in findings if finding.kind == "columns-not-read")


def _table(*extra: str, unit: str = "") -> str:
    heading = ",".join(["time", f"wind speed{unit}", *extra])
    rows = (f"2026-05-01T12:{at:02d}:00Z,{3 + at % 4}.5{f',{5 + at % 3}.25' * len(extra)}\n" for at in range(12))
    return f"{heading}\n{''.join(rows)}"


@pytest.mark.parametrize(
    "heading",
    [
        "max wind", "gust", "Gust (km/h)", "wind_gust_max_10min", "WSpeed_Max", "wind_speed_min", "wind_speed_std",
        "WindGust", "wind_force_avg_10min", "Böe", "rafale", "wind speed sd",
    ],
)  # fmt: skip
def test_a_column_of_the_wind_that_is_not_read_is_named(log_file: Write, heading: str) -> None:
    assert repr(heading) in _note(log_file(_table(heading)), unit="m/s")


@pytest.mark.parametrize("heading", ["max temp", "window state", "battery min", "humidity max", "Windchill"])
def test_a_column_of_another_quantity_is_not_named_among_them(log_file: Write, heading: str) -> None:
    assert "of the wind" not in _note(log_file(_table(heading)), unit="m/s")


def test_one_note_names_all_and_has_the_line_that_reads_the_highest(log_file: Write) -> None:
    path = log_file(_table("wind_min", "wind_std", "wind_gust", unit=" [km/h]"))
    note = _note(path)
    assert "'wind_min', 'wind_std', 'wind_gust' speak of the wind" in note
    line = re.search(r'--columns "([^"]+)"', note)
    assert line is not None
    channels = read_log(path, WindOptions(columns=line[1])).series.channels
    np.testing.assert_allclose(channels["wind_speed"] * 3.6, [5.25, 6.25, 7.25] * 4)


def test_an_interval_of_minutes_is_no_minimum(log_file: Write) -> None:
    assert '4=wind_speed[m/s]"' in _note(log_file(_table("wind_force_10min", "wind_gust_10min")), unit="m/s")


@pytest.mark.parametrize("angle", ["GustAngle", "gust bearing", "gust vane"])
def test_the_direction_of_a_gust_is_not_offered_as_its_speed(log_file: Write, angle: str) -> None:
    assert '4=wind_speed[m/s]"' in _note(log_file(_table(angle, "GustStrength")), unit="m/s")


def test_of_columns_that_the_user_does_not_name_the_note_says_no_more_than_their_names(log_file: Write) -> None:
    note = _note(log_file(_table("gust")), columns="time,wind_speed[m/s]")
    assert note == "column 'gust' is not read"


@pytest.mark.parametrize("name", ["wind_heading", "Wind Course", "windHeading"])
def test_the_heading_of_a_wind_in_degrees_is_its_direction_with_a_warning(log_file: Write, name: str) -> None:
    rows = "".join(f"2026-05-01T12:{at:02d}:00Z,{at},{200 + 22.5 * (at % 3)}\n" for at in range(12))
    log = read_log(log_file(f"time,wind_speed_avg,{name}\nutc,km/h,degrees\n{rows}"))
    np.testing.assert_allclose(np.rad2deg(log.series.channels["wind_direction"]), [200, 222.5, 245] * 4)
    assert any("comes from" in finding.what and repr(name) in finding.what for finding in log.findings)


def test_the_heading_of_a_boat_is_no_direction_of_the_wind(log_file: Write) -> None:
    rows = "".join(f"2026-05-01T12:{at:02d}:00Z,{at},{200 + at}\n" for at in range(12))
    log = read_log(log_file(f"time,wind speed (m/s),heading (deg)\n{rows}"))
    assert "wind_direction" not in log.series.channels


def test_the_latest_speed_and_the_gust_of_a_station_program_are_named(log_file: Write) -> None:
    fields = [*"0123456789"] * 6
    fields[40] = "31.5"
    line = f"17/05/26 22:00:00 14.1 71 8.9 17.3 25.6 231 0 0 1 W 3 kts C {' '.join(fields[15:])}\n"
    note = _note(log_file(line), zone="UTC")
    assert "latest" in note
    assert "gust" in note
    offered = re.search(r'--columns "([^"]+)"', note)
    assert offered is not None
    gust = read_log(log_file(line), WindOptions(zone="UTC", columns=offered[1])).series
    np.testing.assert_allclose(gust.channels["wind_speed"], 31.5 * 1852 / 3600)


def test_the_gust_of_weather_displays_line_is_named(log_file: Write) -> None:
    fields = ["0"] * 150
    fields[:7] = ["12345", "5.0", "8.5", "232", "12.3", "77", "1012.4"]
    fields[29:32], fields[35:37], fields[141] = ["22", "00", "00"], ["17", "5"], "2026"
    assert "gust" in _note(log_file(" ".join(fields) + "\n"), zone="UTC")


def test_a_table_with_a_place_and_an_attitude_is_of_a_platform_that_may_move(log_file: Write) -> None:
    """As a sailing robot's, whose position is empty and whose speeds and angles are from its bow."""
    rows = "".join(
        f"2026-05-01T12:{at:02d}:00Z,None,None,{at % 3}.5,{100 + at}.0,-1{at}.0\n" for at in range(12)
    )  # fmt: skip
    path = log_file(f"time,gps_lat,gps_lon,Data_Wind_spd,Data_Wind_dir,IMU_roll\n{rows}")
    with pytest.raises(InputError, match="'IMU_roll' shows that the platform moves"):
        read_log(path, WindOptions(unit="kn"))
    log = read_log(path, WindOptions(unit="kn", platform="moving"))
    assert {"apparent_wind_speed", "apparent_wind_direction"} <= set(log.series.channels)
    still = read_log(log_file(f"time,a,b,wind_spd,wind_dir,roll\n{rows}"), WindOptions(unit="kn"))
    assert not any("platform moves" in finding.what for finding in still.findings)


def test_a_gust_is_offered_with_the_wind_in_whose_rows_it_stands(log_file: Write) -> None:
    rapid = [f"2026-05-01T12:{at:02d}:00Z,{at % 4}.5,{100 + at},,," for at in range(0, 24, 2)]
    means = [f"2026-05-01T12:{at:02d}:00Z,,,{at % 3}.5,{200 + at},{4 + at % 3}.5" for at in range(1, 24, 2)]
    heading = "time,rapid wind speed [m/s],rapid wind direction,wind speed [m/s],wind direction,wind gust [m/s]"
    path = log_file("\n".join([heading, *sorted(rapid + means)]) + "\n")
    assert '"1=time,5=wind_direction[deg],6=wind_speed[m/s]"' in _note(path, wind="rapid wind speed [m/s]")
