"""Zones that a line above the rows tells in a sentence about its times."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from flagdata.errors import ZoneMissingError
from flagdata.ingest.anemometer import WindOptions, read_log
from flagdata.ingest.anemometer.instants.zones import stated

ROWS = "Zeit;Wind Speed (m/s)\n01.05.2026 12:00;3,1\n01.05.2026 12:10;3,4\n01.05.2026 12:20;3,3\n"


@pytest.mark.parametrize(
    ("line", "zone"),
    [
        ("Time sync: UTC +2,0 hrs;Unit 12", "+02:00"), ("all times in UTC-3.5", "-03:30"), ("# All times UTC", "UTC"),
        ("All times are local (UTC-5)", "-05:00"), ("Zeitangaben in MEZ", "+01:00"), ("Clock: UTC+05:45", "+05:45"),
        ("# times: GMT", "UTC"), ("Timestamps are local standard time, GMT-8", "-08:00"), ("horas en UTC", "UTC"),
    ],
)  # fmt: skip
def test_a_sentence_about_the_times_names_their_zone(line: str, zone: str) -> None:
    statement = stated([line])
    assert statement is not None
    assert statement.name == zone


@pytest.mark.parametrize(
    "line",
    ["Sensor 12, UTC", "time is in est of it", "Time (UTC),Speed", "Started at the time 10:00 UTC", "times in UTC+19"],
)
def test_other_sentences_name_none(line: str) -> None:
    assert stated([line]) is None


def test_the_zone_of_a_sentence_is_offered_where_none_was_named(log_file: Callable[[str], Path]) -> None:
    path = log_file(f"Lidar 12;Time sync: UTC +2,0 hrs;Height 40m\n{ROWS}")
    with pytest.raises(ZoneMissingError, match=r"Time sync: UTC \+2,0.*--zone \+02:00"):
        read_log(path)
    log = read_log(path, WindOptions(zone="+02:00"))
    assert int(log.series.time[0]) == 1_777_629_600_000_000_000
    assert not [finding for finding in log.findings if finding.kind == "zone-contradicts"]
    other = read_log(path, WindOptions(zone="UTC"))
    assert [finding.value for finding in other.findings if finding.kind == "zone-contradicts"] == [-2.0]
