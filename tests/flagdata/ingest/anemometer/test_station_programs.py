"""What station programs print and publish: NOAA's monthly summaries, the last hour, daily values, one time for all."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError
from flagdata.ingest.anemometer import WindOptions, anemometers, read_log
from flagdata.timebase import NANOSECONDS

Write = Callable[[str], Path]
START = 1_777_636_800 * NANOSECONDS
SUMMARY = """                   MONTHLY CLIMATOLOGICAL SUMMARY for {title}


NAME: Here                  CITY:      STATE:
ELEV: 20 meters    LAT: 41-21.60 N    LONG: 002-22.20 E


                   TEMPERATURE (C), RAIN (cm), WIND SPEED ({unit})

                                         HEAT   COOL         AVG
      MEAN                               DEG    DEG          WIND                   DOM
DAY   TEMP   HIGH   TIME    LOW   TIME   DAYS   DAYS   RAIN  SPEED   HIGH   TIME    DIR
---------------------------------------------------------------------------------------
"""


def days(direction: str) -> str:
    rows = (f"{day:3d}   12.9   16.2  12:15   10.3  02:38    5.4    0.0   0.00  {3.6 * day:5.1f}   99.9  14:05  "
            f"{direction}\n" for day in range(1, 29))  # fmt: skip
    return (
        "".join(rows)
        + "-" * 80
        + "\n       12.4   19.0     09    4.0     24  150.1    0.0   1.20   21.0   99.9     14    230\n"
    )


@pytest.mark.parametrize(("title", "unit", "scale"), [("Feb 2026", "kph", 1 / 3.6), ("FEB. 2026", "mph", 0.44704)])
@pytest.mark.parametrize("direction", ["270", "W"])
def test_a_monthly_summary_is_the_mean_of_each_day(
    log_file: Write, title: str, unit: str, scale: float, direction: str
) -> None:
    path = log_file(SUMMARY.format(title=title, unit=unit) + days(direction))
    with pytest.raises(FlagdataError, match="zone"):
        read_log(path, WindOptions())
    series = read_log(path, WindOptions(zone="UTC")).series
    np.testing.assert_allclose(series.channels["wind_speed"], 3.6 * scale * np.arange(1, 29))
    np.testing.assert_allclose(np.rad2deg(series.channels["wind_direction"]), 270)
    assert series.time.astype("datetime64[ns]").astype("datetime64[D]").tolist()[0].isoformat() == "2026-02-01"
    assert len(series) == 28


def test_the_last_hour_is_a_row_a_minute_from_the_start_that_the_user_gives(log_file: Write) -> None:
    speeds, gusts, directions = ([first + at % 7 for at in range(60)] for first in (3, 6, 130))
    cells = [12345, *speeds, *gusts, *directions, *[f"{20 + at % 5}.5" for at in range(60)], "!!H10.37R!!"]
    path = log_file(" ".join(map(str, cells)))
    with pytest.raises(FlagdataError) as caught:
        read_log(path, WindOptions())
    assert "--start" in (caught.value.fix or "")
    series = read_log(path, WindOptions(start=START)).series
    np.testing.assert_allclose(series.channels["wind_speed"], np.array(speeds) * 1852 / 3600)
    np.testing.assert_allclose(np.rad2deg(series.channels["wind_direction"]), directions)
    np.testing.assert_array_equal(series.time, START + np.arange(60) * 60 * NANOSECONDS)


@pytest.mark.parametrize("change", ["short", "word"])
def test_a_damaged_last_hour_is_refused(log_file: Write, change: str) -> None:
    cells = ["12345", *["3"] * (200 if change == "short" else 240), "!!H10.37R!!"]
    if change == "word":
        cells[7] = "x"
    with pytest.raises(FlagdataError):
        read_log(log_file(" ".join(cells)), WindOptions(start=START))


@pytest.mark.parametrize("heading", ["POSTE;DATE", "NUM_POSTE;AAAAMMJJ"])
def test_daily_values_of_meteo_france_are_in_metres_a_second(log_file: Write, heading: str) -> None:
    posts = ("33042005", "33281001")
    values = "{};202605{:02d};15,0;1;{},5;1;{},0;1\n"
    rows = "".join(values.format(post, day, day, day + 5) for post in posts for day in range(1, 9))
    path = log_file(f"{heading};TM;QTM;FFM;QFFM;FXI;QFXI\n{rows}")
    with pytest.raises(FlagdataError, match="zone"):
        read_log(path, WindOptions(wind="33042005"))
    series = read_log(path, WindOptions(wind="33042005", zone="UTC")).series
    assert series.channels["wind_speed"].tolist() == [day + 0.5 for day in range(1, 9)]


def test_stations_without_a_time_are_at_that_of_the_object_around_them(log_file: Write) -> None:
    stations = [{"station": name, "speed": speed, "direction": "East"} for name, speed in (("Pier", 9), ("Peak", 18))]
    path = log_file(json.dumps({"updated_at": "2026-05-01 12:00:00", "records": stations}, indent=1))
    assert set(anemometers(path, WindOptions(unit="km/h", zone="UTC"))) == {"Pier", "Peak"}
    series = read_log(path, WindOptions(unit="km/h", zone="UTC", wind="Peak")).series
    assert (series.channels["wind_speed"].tolist(), series.time.tolist()) == ([5.0], [START])


def test_reports_without_a_month_are_refused_with_the_way_to_date_them(log_file: Write) -> None:
    report = "METAR EFHK {day:02d}1850Z 08006KT 3000 -SN BKN004 00/M00 Q0989 NOSIG\n"
    with pytest.raises(FlagdataError) as caught:
        read_log(log_file("".join(report.format(day=day) for day in range(1, 9))), WindOptions())
    assert "202601271850 METAR EFHK 271850Z" in (caught.value.fix or "")
    dated = "".join(f"202605{day:02d}1850 {report.format(day=day)}" for day in range(1, 9))
    np.testing.assert_allclose(read_log(log_file(dated), WindOptions()).series.channels["wind_speed"], 6 * 1852 / 3600)
