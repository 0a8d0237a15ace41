"""Stamps, headings and rows that are written otherwise than most: a point before a fraction, colons, a sign behind."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.ingest.anemometer import WindOptions, read_log

Write = Callable[..., Path]
Read = Callable[..., Any]
MINUTE = 60_000_000_000
START = np.datetime64("2014-10-07T01:00:00", "ns").astype(np.int64)


def _degrees(series: Any) -> list[float]:
    return np.rad2deg(series.channels["wind_direction"]).round(6).tolist()


@pytest.mark.parametrize("seconds", ["%S.%f", "%S%f", "%S.000"])
def test_the_point_before_a_fraction_may_be_written_or_not(log_file: Write, seconds: str) -> None:
    rows = [f"2014-10-07;01:{at:02d}:00.000;{2 + 0.1 * at:.1f}" for at in range(5)]
    path = log_file("\n".join(["date;time;wind", *rows]) + "\n")
    columns = f"date[%Y-%m-%d],time[%H:%M:{seconds}],wind_speed[m/s]"
    series = read_log(path, WindOptions(columns=columns, zone="UTC")).series
    assert (series.time - START).tolist() == [MINUTE * at for at in range(5)]


@pytest.mark.parametrize("sign", [" ", ",", ";"])
def test_dates_with_colons(read: Read, sign: str) -> None:
    """As EXIF has them; the date and the time of day in one column, or in two where blanks divide them."""
    heading = "date time wind" if sign == " " else f"time{sign}wind"
    rows = [f"2014:10:07 01:{at:02d}:00.000{sign}{2 + 0.1 * at:.1f}" for at in range(5)]
    series = read("\n".join([heading, *rows]) + "\n", unit="m/s", zone="UTC").series
    assert (series.time - START).tolist() == [MINUTE * at for at in range(5)]


@pytest.mark.parametrize("columns", [None, "time[%d/%m/%Y %H:%M],wind_speed[m/s]"])
def test_dates_before_1970_are_refused_for_what_they_are(log_file: Write, columns: str | None) -> None:
    rows = [f"{at + 1:02d}/03/1965 12:00;{2 + 0.1 * at:.1f}" for at in range(20)]
    path = log_file("\n".join(["date;ws [m/s]", *rows]) + "\n")
    with pytest.raises(InputError, match="dates before 1970"):
        read_log(path, WindOptions(columns=columns, zone="UTC"))


def test_a_sign_behind_the_last_cell_leaves_the_heading_its_names(read: Read) -> None:
    """Rows end in the delimiter, the heading does not, and cells at the end are always empty (rp5)."""
    names = ["Local time in Test", "T", "U", "DD", "Ff", "ff10", "N", "WW", "Tn", "Tx"]
    points = ["north-east", "south", "west-southwest", "southeast"]
    rows = [
        [f"01.04.2021 {3 * at:02d}:00", "5.1", "80", f"Wind blowing from the {point}", f"{2 + at}", *[""] * 5]
        for at, point in enumerate(points)
    ]
    lines = ["# Weather station Test", ";".join(f'"{name}"' for name in names)]
    lines += [";".join(f'"{cell}"' for cell in row) + ";" for row in rows]
    series = read("\n".join(lines) + "\n", unit="m/s", zone="UTC").series
    assert series.channels["wind_speed"].tolist() == [2, 3, 4, 5]
    assert _degrees(series) == [45.0, 180.0, 247.5, 135.0]


def test_the_velocity_beside_a_direction_is_the_speed(read: Read) -> None:
    rows = [f"2021-05-01T{at:02d}:00:00Z,{15 * at},{2 + 0.1 * at:.1f}" for at in range(24)]
    series = read("\n".join(["time,W_dir,W_vel", *rows]) + "\n", unit="m/s").series
    np.testing.assert_allclose(series.channels["wind_speed"], 2 + 0.1 * np.arange(24))
    assert _degrees(series)[:3] == [0.0, 15.0, 30.0]


def test_w_behind_u_and_v_is_the_vertical_component(read: Read) -> None:
    rows = [f"2021-05-01T{at:02d}:00:00Z,{1 + 0.1 * at:.1f},{2 - 0.1 * at:.1f},0.1,{15 * at}" for at in range(9)]
    series = read("\n".join(["time,U_vel,V_vel,W_vel,W_dir", *rows]) + "\n", unit="m/s").series
    assert series.channels["wind_z"].tolist() == [0.1] * 9


def test_a_gust_that_is_named_as_the_wind_is_warned_of(read: Read) -> None:
    rows = [f"2021-05-01T{at:02d}:00:00Z,{5 + 0.1 * at:.1f},{15 * at}" for at in range(9)]
    log = read("\n".join(["time,WMAX,dir", *rows]) + "\n", unit="m/s", wind="WMAX")
    assert "the heading of 'WMAX' is of a gust, an extreme or a spread: taken as you said" in [
        f.what for f in log.findings
    ]


def test_a_comma_behind_pm_is_no_clock_of_24_hours(log_file: Write) -> None:
    rows = [f'"{11 - (at > 5)}:{10 * (at % 6):02d} PM, Tue Jul 14 2020",{5 + at}' for at in range(6)]
    path = log_file("\n".join(["stamp,mph", *rows]) + "\n")
    options = WindOptions(columns="time[%I:%M %p, %a %b %d %Y],wind_speed[mph]", zone="UTC")
    log = read_log(path, options)
    assert "mixed-clocks" not in {finding.kind for finding in log.findings}
    assert log.series.time[0] == np.datetime64("2020-07-14T23:00:00", "ns").astype(np.int64)
