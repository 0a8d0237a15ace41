"""Zones that a file states above its rows, and zones that the user gives."""

from __future__ import annotations

import pytest

from flagdata.ingest.anemometer.instants.zones import stated_zone
from flagdata.record.signals import WindLog
from tests.flagdata.ingest.anemometer.conftest import read

_NRG = (
    "SymphoniePRO Desktop Application\tVersion 3\nTime Zone: UTC-05:00\nChannel: 1\nDescription: "
    "cup\n\n"
    "Timestamp\tCh1_Anem_30.00m_S_Avg_m/s\n"
    + "".join(f"2026-03-14 08:{minute:02d}:00\t{4 + minute / 10}\n" for minute in range(0, 60, 5))
)


def kinds(log: WindLog) -> list[str]:
    return [finding.kind for finding in log.findings]


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("Time Zone: UTC+01:00", "UTC+01:00"),
        ("UTC Offset,+2", "+02:00"),
        ("Timezone=UTC", "UTC"),
        ("GMT Offset:,+01:00", "+01:00"),
        ("#DEBUG: Time Zone     -> America/New_York", "America/New_York"),
        ("GMT Offset=+0530", "+05:30"),
        ("TimeZone=Etc/GMT-1", "Etc/GMT-1"),
        ("Timezone (UTC+)=1", "+01:00"),
        ("Timezone (UTC+)=0", "+00:00"),
    ],
)
def test_a_zone_that_lines_above_the_rows_state_is_found(text: str, name: str) -> None:
    statement = stated_zone(text.split("\n"))
    assert statement is not None
    assert statement.name == name


@pytest.mark.parametrize(
    "text",
    [
        "Time zone: local",
        "UTC Offset,99",
        "zone 5 of the site",
        "Time Zone: UTC\nGMT Offset: -5",
        "Timestamp,UTC",
    ],
)
def test_what_names_no_zone_or_two_states_none(text: str) -> None:
    assert stated_zone(text.split("\n")) is None


def test_a_zone_that_contradicts_the_preamble_is_reported_by_every_reader() -> None:
    for name in ("nrg", "delimited"):
        log = read(_NRG, format=name, zone="+01:00")
        found = [finding for finding in log.findings if finding.kind == "zone-contradicts"]
        assert [finding.value for finding in found] == [6.0]
        assert "zone-contradicts" not in kinds(read(_NRG, format=name, zone="-05:00"))
