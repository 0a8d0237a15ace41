"""Rows that a logger wrote before its clock was set, or its receiver knew the time."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from flagdata.errors import InputError
from flagdata.ingest.anemometer import read_log

Write = Callable[[str], Path]
HEADING = "gps_time_utc,lat,wind_speed [m/s],temp\n"
STAMPED = "".join(f"2026-05-01 12:00:{at:02d},52.1,{3 + at / 10},18\n" for at in range(8))


def test_rows_before_the_first_stamp_are_left_out_and_counted(log_file: Write) -> None:
    log = read_log(log_file(HEADING + ",,2.5,18\n" * 40 + STAMPED))
    assert log.series.channels["wind_speed"] == pytest.approx([3 + at / 10 for at in range(8)])
    told = [finding for finding in log.findings if finding.kind == "unreadable-stamps"]
    assert [finding.count for finding in told] == [40]
    assert "40 rows before the first stamp have none" in told[0].what


def test_rows_without_a_stamp_between_others_are_those_of_another_format(log_file: Write) -> None:
    rows = STAMPED.splitlines(keepends=True)
    with pytest.raises(InputError, match="16 of 24 are rows without a stamp"):
        read_log(log_file(HEADING + "".join(row + ",,2.5,18\n" * 2 for row in rows)))
