"""What a first screen says of when, where and with what recordings were made."""

from __future__ import annotations

from flagdata.answer.circumstances import Circumstances, list_circumstances
from flagdata.record.signals import Sensor
from flagdata.timebase import parse

NOON = parse("2026-05-01T12:00:03Z")


def test_what_no_file_states_is_left_out() -> None:
    assert list_circumstances([Circumstances(seconds=60.0)]) == {}


def test_one_recording_has_its_period_in_the_clocks_of_its_place() -> None:
    one = Circumstances(
        start=NOON,
        seconds=61.5,
        zone="Europe/Amsterdam",
        session="dike",
        sensor=Sensor(name="cup", height=2.5).words,
        clock=0.0412,
        clock_method="estimate",
    )
    assert list_circumstances([one]) == {
        "date and time": "1 May 2026, 14:00:03 to 14:01:04, local time (Europe/Amsterdam)",
        "session": "dike",
        "anemometer": "cup, 2.5 m above ground",
        "clock": "recording and log on one clock to ± 0.041 s (1 σ), by estimate",
    }


def test_several_recordings_have_one_period_and_each_sensor_once() -> None:
    first = Circumstances(start=NOON, seconds=10.0, sensor="cup", clock=0.1)
    later = Circumstances(start=parse("2026-05-03T09:00:00Z"), seconds=10.0, sensor="cup")
    sonic = Circumstances(sensor="sonic")
    assert list_circumstances([later, first, sonic]) == {
        "date and time": "1 May 2026, 12:00:03 to 3 May 2026, 09:00:10, UTC",
        "anemometer": "cup, sonic",
        "clock": "recording and log on one clock to ± 0.1 s (1 σ)",
    }


def test_a_part_begins_later() -> None:
    part = Circumstances(start=NOON, seconds=60.0).part(7.0, 5.0)
    assert list_circumstances([part]) == {"date and time": "1 May 2026, 12:00:10 to 12:00:15, UTC"}
