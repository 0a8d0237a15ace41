"""Tables of the GeoCSV format, by its specification."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError
from flagdata.ingest.anemometer import WindOptions, read_log

Write = Callable[[str], Path]


def geocsv(*, units: str = "ISO_8601| knots| degrees", missing: str = "| -99| -99") -> str:
    rows = [f"2016-05-01T0{hour}:00:00Z| {hour + 3}.0| {210 + hour}" for hour in range(6)]
    rows[2] = "2016-05-01T02:00:00Z| -99| -99"
    head = ["# dataset: GeoCSV 2.0", "# delimiter: |", f"# field_unit: {units}", f"# field_missing: {missing}"]
    return "\n".join([*head, "# attribution: a station", "Time| WindSpeed| WindDirection", *rows]) + "\n"


def test_units_and_gaps_are_those_of_the_keywords(log_file: Write) -> None:
    log = read_log(log_file(geocsv()), WindOptions())
    speed = log.series.channels["wind_speed"]
    there = ~np.isnan(speed)
    hours = np.array([0, 1, 3, 4, 5])
    np.testing.assert_allclose(speed[there], (hours + 3) * 1852 / 3600)
    np.testing.assert_allclose(np.rad2deg(log.series.channels["wind_direction"][there]) % 360, 210 + hours)
    start = np.datetime64("2016-05-01T00:00", "ns")
    np.testing.assert_array_equal(log.series.time[there], (start + hours * np.timedelta64(1, "h")).astype(np.int64))


def test_units_that_are_none_are_asked_for(log_file: Write) -> None:
    with pytest.raises(FlagdataError, match="unit of column"):
        read_log(log_file(geocsv(units="ISO_8601| unitless| degrees")), WindOptions())
