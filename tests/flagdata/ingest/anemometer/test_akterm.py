"""AKTERM: the units of direction and speed are those that the marks of each value say."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import TimeError
from flagdata.ingest.anemometer import WindOptions, read_log
from flagdata.signals import WindLog

Read = Callable[..., WindLog]


def _series(*values: str, comment: str = "Station made for a test, 2020") -> str:
    head = [
        f"* AKTERM-Zeitreihe, {comment}",
        "* erzeugt am Datum: 03.05.2021 Zeit 12:00",
        "+ Anemometerhoehen (0.1 m):   90  110",
    ]
    rows = [
        f"AK 12345 2020 05 {1 + at // 24:02d} {at % 24:02d} 00 {text} 1 3 1 -999 9" for at, text in enumerate(values)
    ]
    return "\n".join([*head, *rows, ""])


def test_marks_say_degrees_and_tenths_of_metres_a_second_or_tens_and_knots(read: Read) -> None:
    log = read(_series("2 3 193  39", "1 1 200  41", "1 2 210  51", "0 0  27  10", *["2 3 190  40"] * 30), zone="UTC")
    speed, direction = log.series.channels["wind_speed"], np.degrees(log.series.channels["wind_direction"])
    assert speed[:4].tolist() == pytest.approx([3.9, 4.1, 5.1, 10 * 1852 / 3600], abs=1e-3)
    assert direction[:4].tolist() == pytest.approx([193, 200, 210, 270])
    assert log.series.time[0] == np.datetime64("2020-05-01T00:00:00", "ns").astype(np.int64)
    assert not any("seems to name columns" in finding.what for finding in log.findings)


def test_values_that_are_marked_as_missing_and_winds_of_changing_direction_are_none(read: Read) -> None:
    log = read(_series("9 3 193  39", "2 9 200  41", "2 3 999  12", "2 3 -17  12", *["2 3 190  40"] * 30), zone="UTC")
    assert np.isnan(log.series.channels["wind_direction"][[0, 2, 3]]).all()
    assert np.isnan(log.series.channels["wind_speed"]).tolist()[:4] == [False, True, False, False]


def test_precipitation_behind_is_allowed_and_damaged_lines_are_counted(read: Read) -> None:
    text = (
        _series(*["2 3 190  40"] * 70).replace("-999 9", "-999 9   0 0")
        + "AK 12345 2020 13 01 00 00 2 3 1 1 1 3 1 -999 9\n"
    )
    log = read(text, zone="UTC")
    assert len(log.series.time) == 70
    assert [finding.count for finding in log.findings if finding.kind == "malformed-lines"] == [1]


def test_the_zone_is_asked_for_unless_a_comment_says_it(read: Read, log_file: Callable[[str], Path]) -> None:
    with pytest.raises(TimeError, match="zone"):
        read_log(log_file(_series(*["2 3 190  40"] * 30)), WindOptions())
    log = read(_series(*["2 3 190  40"] * 30, comment="Zeitzone: UTC+01:00"))
    assert log.series.time[0] == np.datetime64("2020-04-30T23:00:00", "ns").astype(np.int64)


def test_a_comment_of_stars_is_not_said_to_name_columns(read: Read) -> None:
    rows = "".join(f"2026-05-01 12:{at:02d} {5 + at % 4}.25 {180 + at} 7 8 9\n" for at in range(30))
    log = read(f"* Datum Zeit wind speed\n{rows}", columns="1=date,2=time,3=wind_speed[m/s]", zone="UTC")
    assert not any("seems to name columns" in finding.what for finding in log.findings)
