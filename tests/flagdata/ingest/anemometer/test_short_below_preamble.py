"""Short logs below a preamble that is longer than they are, as the daily files of a lidar begin."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from flagdata.errors import InputError
from flagdata.ingest.anemometer import WindOptions, read_log

Write = Callable[[str], Path]

PREAMBLE = "".join(
    f"{name}={value}\n"
    for name, value in [
        ("HeaderSize", 16), ("Version", "1.1.13"), ("ID System", "X7-164"), ("Location", "a hill"), ("Comments", ""),
        ("FCR Option", "OFF"), ("Sampling Frequency (Hz)", "250000000.000"), ("Init Position (deg)", 90),
        ("DirectionOffset (deg)", "-84.000"), ("CNR threshold (dB)", "-23.000"), ("Pulse (ns)", 200),
        ("VrThreshold (m/s)", "1.700"), ("Altitudes (m)", "\t40\t80"),
    ]
)  # fmt: skip
NAMES = "Timestamp (end of interval)\tInt Temp (C)\tExt Temp (C)\t40m Wind Speed (m/s)\t40m Wind Direction (deg)\n"
ROWS = "".join(f"2026/11/24 0{at}:10\t31.{at}\t8.{at}\t4.{at}\t29{at}.4\n" for at in range(4))


def test_four_rows_below_a_long_preamble_are_a_table(log_file: Write) -> None:
    log = read_log(log_file(PREAMBLE + NAMES + ROWS), WindOptions(zone="UTC"))
    assert log.series.channels["wind_speed"] == pytest.approx([4.0, 4.1, 4.2, 4.3])


def test_the_temperature_inside_an_instrument_is_not_that_of_the_air(log_file: Write) -> None:
    log = read_log(log_file(PREAMBLE + NAMES + ROWS), WindOptions(zone="UTC"))
    assert log.series.channels["air_temperature"] == pytest.approx([281.15, 281.25, 281.35, 281.45])


def test_a_few_rows_at_the_end_of_a_report_without_names_are_no_table(log_file: Write) -> None:
    with pytest.raises(InputError, match="not a log of a known format"):
        read_log(log_file(PREAMBLE + PREAMBLE + ROWS), WindOptions(zone="UTC"))
