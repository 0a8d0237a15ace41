"""Tables of the SMET format, by its specification."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import InputError, ZoneMissingError
from flagdata.ingest.anemometer import read_log
from flagdata.signals import WindLog

Read = Callable[..., WindLog]


def smet(*header: str, first: str = "2008-12-01T{hour:02d}:00") -> str:
    lines = ["SMET 1.1 ASCII", "[HEADER]", "station_id = HERE   # a comment", "nodata = -999", *header,
             "fields = timestamp TA VW RH DW VW_MAX HS", "[DATA]"]  # fmt: skip
    for hour in range(20):
        speed = "-999" if hour == 3 else f"{2 + hour % 5 / 10:.1f}"
        lines.append(f"{first.format(hour=hour)}   265.95  {speed} 88.0  {200 + hour}  9.9  142.0 ")
    return "\n".join([*lines, ""])


SCALED = ("units_multiplier = 1 1 1 0.01 1 1 0.01", "units_offset = 0 0 0 0 0 0 0")


def test_fields_units_zone_and_missing_values_are_those_of_the_header(read: Read) -> None:
    log = read(smet("tz = 1", *SCALED))
    channels = log.series.channels
    speeds = np.array([2 + hour % 5 / 10 for hour in range(20)])
    assert np.flatnonzero(np.isnan(channels["wind_speed"])).tolist() == [3]
    np.testing.assert_allclose(np.delete(channels["wind_speed"], 3), np.delete(speeds, 3))
    np.testing.assert_allclose(np.rad2deg(channels["wind_direction"]), 200 + np.arange(20))
    np.testing.assert_allclose(channels["relative_humidity"], 0.88)
    np.testing.assert_allclose(channels["air_temperature"], 265.95)
    assert np.datetime64(int(log.series.time[0]), "ns") == np.datetime64("2008-11-30T23:00")
    assert any("gust" in finding.what for finding in log.findings if finding.kind == "columns-not-read")


def test_an_offset_and_a_multiplier_make_si_units(read: Read) -> None:
    scaled = ("units_multiplier = 1 1 0.277777778 0.01 1 1 0.01", "units_offset = 0 10 0 0 0 0 0")
    channels = read(smet("tz = -3.5", *scaled)).series.channels
    assert channels["wind_speed"][0] == pytest.approx(2 / 3.6)
    assert channels["air_temperature"][0] == pytest.approx(275.95)


def test_the_zone_of_a_stamp_goes_before_the_headers(read: Read) -> None:
    log = read(smet("tz = 1", *SCALED, first="2008-12-01T{hour:02d}:00:00Z"))
    assert np.datetime64(int(log.series.time[0]), "ns") == np.datetime64("2008-12-01T00:00")


def test_a_header_without_a_zone_asks_for_it(log_file: Callable[[str], Path]) -> None:
    with pytest.raises(ZoneMissingError):
        read_log(log_file(smet(*SCALED)))


def test_multipliers_that_do_not_fit_the_fields_are_not_guessed(log_file: Callable[[str], Path]) -> None:
    with pytest.raises(InputError) as caught:
        read_log(log_file(smet("tz = 1", "units_multiplier = 1 0.01")))
    assert "--columns" in caught.value.fix


def test_lines_of_data_that_are_damaged_are_counted(read: Read) -> None:
    log = read(smet("tz = 1", *SCALED).replace("2008-12-01T05:00 ", "2008-12-01T05: "))
    (left_out,) = [finding for finding in log.findings if finding.kind == "malformed-lines"]
    assert left_out.count == 1
    assert len(log.series) == 19
