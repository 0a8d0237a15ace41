"""Stamps of special events, such as the last lightning, are not the time of a row; other stamps left out are named."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from flagdata.errors import InputError
from flagdata.ingest.anemometer.words.events import of_event
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
CheckRefused = Callable[..., None]
T0 = 1_777_636_800
EVENTS = [
    "lightning_time", "LightningTime", "last_strike", "lastRain", "Last rain", "Sunrise", "sunset_utc",
    "date installed", "calibration date", "lastboot", "Firmware date", "timeMaxGust", "Time of Min Temp",
    "최대풍속일자", "최대순간풍속시각", "最大風速起時",
]  # fmt: skip


def unread(log: WindLog) -> str:
    return "; ".join(finding.what for finding in log.findings if finding.kind == "columns-not-read")


@pytest.mark.parametrize("heading", EVENTS)
def test_headings_of_events_are_told(heading: str) -> None:
    assert of_event(heading)


@pytest.mark.parametrize(
    "heading",
    ["dateutc", "Date", "time", "Timestamp", "last_update", "Date Time, GMT+02:00", "start", "Last calm", "TIME_OBS"],
)
def test_headings_of_plain_times_are_no_events(heading: str) -> None:
    assert not of_event(heading)


@pytest.mark.parametrize("event", EVENTS)
@pytest.mark.parametrize(
    ("stamp", "heading"),
    [(str(T0 - 50_000), "dateutc"), (f"{T0 - 50_000}000", "date"), ("2026-04-30T21:11:00Z", "Timestamp")],
)
def test_a_plain_stamp_goes_before_that_of_an_event(read: Read, event: str, stamp: str, heading: str) -> None:
    rows = "".join(f"{stamp};2026-05-01 12:0{at}:00;{3 + at}.5\n" for at in range(5))
    found = read(f"{event};{heading};windspeedmph\n{rows}", zone=None if heading == "dateutc" else "UTC")
    assert found.series.time[0] == T0 * 1_000_000_000
    assert repr(event) in unread(found)


@pytest.mark.parametrize("stamp", [str(T0), "2026-05-01T12:00:00Z"])
def test_the_stamp_of_an_event_alone_is_refused_and_taken_at_its_users_word(
    read: Read, check_refused: CheckRefused, stamp: str
) -> None:
    text = "lightning_time;windspeedmph\n" + "".join(f"{stamp};{3 + at}.5\n" for at in range(1))
    check_refused(text.encode(), InputError, says="'lightning_time' is the time of a special event")
    assert len(read(text, columns="time,wind_speed[mph]").series) == 1


def test_a_clock_of_an_event_makes_no_time_with_the_date(read: Read) -> None:
    rows = "".join(f"2026-05-0{at},05:1{at},{3 + at}.5\n" for at in range(1, 6))
    found = read(f"Date,Sunrise,Wind Speed (m/s)\n{rows}", zone="UTC")
    assert int(found.series.time[0]) % (86_400 * 1_000_000_000) == 0


def test_a_second_time_that_is_not_taken_is_named(read: Read) -> None:
    rows = "".join(f"2026-05-01 14:0{at}:00,{T0 + 60 * at},{3 + at}.5\n" for at in range(5))
    found = read(f"local_time,unixtime,Wind Speed (m/s)\n{rows}")
    assert found.series.time[0] == T0 * 1_000_000_000
    assert "'local_time' is a time as well: left out" in unread(found)
