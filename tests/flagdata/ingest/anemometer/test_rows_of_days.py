"""Tables of a row a day: the heading may give the time of its readings, and rows of midnight are told as days."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from flagdata.ingest.anemometer.words.hours import minute_of
from flagdata.signals import WindLog

Read = Callable[..., WindLog]


def _days(heading: str, clock: str = "") -> str:
    return f"Date,{heading}\n" + "".join(f"2026-05-{at:02d}{clock},{at % 7},{2 + at % 9}\n" for at in range(1, 21))


def _kinds(log: WindLog) -> set[str]:
    return {finding.kind for finding in log.findings}


@pytest.mark.parametrize(
    ("heading", "minute"),
    [
        ("WindSpeed9am", 540), ("3pm wind speed (km/h)", 900), ("WS_12pm", 720), ("ws 12 a.m.", 0), ("ff_0900", 540),
        ("ws1500", 900), ("speed at 09:30", 570), ("Wind 10m", None), ("speed10m avg", None), ("ws1000", None),
        ("wind 9 amps", None), ("WindSpeed", None),
    ],
)  # fmt: skip
def test_a_heading_gives_the_minute_of_its_readings(heading: str, minute: int | None) -> None:
    assert minute_of(heading) == minute


@pytest.mark.parametrize(
    ("wind", "first"), [("WindSpeed9am", "2026-05-01T07:00"), ("WindSpeed3pm", "2026-05-01T13:00")]
)
def test_readings_of_a_stated_hour_are_put_there(read: Read, wind: str, first: str) -> None:
    log = read(_days("WindSpeed9am,WindSpeed3pm"), wind=wind, unit="km/h", zone="Europe/Amsterdam")
    assert log.series.time.astype("datetime64[ns]")[0] == np.datetime64(first)
    assert "dates-alone" not in _kinds(log)
    told = next(finding for finding in log.findings if finding.kind == "time-of-heading")
    assert repr(wind) in told.what


def test_stamps_that_are_all_of_midnight_are_told_as_days(read: Read) -> None:
    told = "dates-alone"
    assert told in _kinds(read(_days("wind speed (m/s),x", " 00:00"), zone="UTC"))
    assert told in _kinds(read(_days("wind speed (m/s),x"), zone="UTC"))
    assert told not in _kinds(read(_days("wind speed (m/s),x", " 12:00"), zone="UTC"))


def test_daily_values_of_a_weather_service_are_told_as_days(read: Read) -> None:
    names = "# STN,YYYYMMDD,DDVEC,FHVEC,   FG,  FHX,  FHN,  FXX\n"
    rows = "".join(
        f"  225,202605{at:02d},  {200 + at},   {40 + at},   {45 + at},  80,  20,  120\n" for at in range(1, 9)
    )
    log = read(f"# YYYYMMDD = Date\n# FG = Daily mean windspeed (in 0.1 m/s)\n#\n{names}{rows}")
    assert "published-table" in _kinds(log)
    assert "dates-alone" in _kinds(log)


def test_days_at_uneven_intervals_are_no_clock_that_was_set(read: Read) -> None:
    days = (4, 7, 12, 14, 18, 21, 25)  # three and a half days apart in the median
    rows = "".join(f"6/{day}/18,{3 + day % 5}\n" for day in days)
    log = read(f"date,avg wind\n{rows}", unit="mph", zone="UTC", date_order="mdy")
    assert len(log.series.time) == len(days)
    assert "dates-alone" in _kinds(log)
    assert not {kind for kind in _kinds(log) if kind.startswith("clock-set")}


def test_a_day_that_is_written_twice_leaves_the_dates_a_time(read: Read) -> None:
    rows = [f"2026-03-{day:02d},A,{day}.5,{1 + day % 7}.2" for day in range(1, 29)]
    text = "\n".join(["date,station,gust [m/s],wind speed [m/s]", *rows[:20], rows[19], *rows[20:]])
    assert len(read(f"{text}\n", zone="UTC").series.time) == 28
