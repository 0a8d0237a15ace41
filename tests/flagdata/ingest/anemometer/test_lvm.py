"""Measurement files of LabVIEW, by its specification."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from flagdata.errors import FlagdataError, ZoneMissingError
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
FILE = """LabVIEW Measurement\t
Writer_Version\t2
Separator\tTab
Decimal_Separator\t{point}
X_Columns\t{columns}
Date\t2026/05/01
Time\t10:00:00
***End_of_Header***\t
"""
SEGMENT = """\t
Channels\t2\t\t
Samples\t3\t3\t
Date\t2026/05/01\t2026/05/01\t
Time\t{time}\t{time}\t
Y_Unit_Label\tm/s\tdegC\t
X0\t0.5\t0.5\t
Delta_X\t0.25\t0.25\t
***End_of_Header***\t\t\t
X_Value\tWind Speed\tAir temperature\tComment
"""


def instants(log: WindLog) -> list[str]:
    return [str(np.datetime64(int(at), "ns"))[:23] for at in log.series.time]


def test_rows_count_from_the_date_and_time_of_their_segment(read: Read) -> None:
    text = FILE.format(point=".", columns="One")
    text += SEGMENT.format(time="12:00:00.5") + "0.0\t4.1\t20.0\n0.25\t4.2\t20.0\n0.5\t4.3\t20.0\n"
    text += SEGMENT.format(time="12:00:10") + "0.0\t5.1\t21.0\n0.25\t5.2\t21.0\n"
    with pytest.raises(ZoneMissingError):
        read(text)
    log = read(text, zone="UTC")
    assert log.series.channels["wind_speed"].tolist() == [4.1, 4.2, 4.3, 5.1, 5.2]
    np.testing.assert_allclose(log.series.channels["air_temperature"], [293.15] * 3 + [294.15] * 2)
    assert instants(log) == [
        f"2026-05-01T12:00:{second}" for second in ("00.500", "00.750", "01.000", "10.000", "10.250")
    ]


def test_rows_without_x_follow_x0_and_delta_x(read: Read) -> None:
    text = FILE.format(point=",", columns="No") + SEGMENT.format(time="12:00:00").replace("0.", "0,")
    log = read(text + "\t4,1\t20,0\n\t4,2\t20,0\n\t4,3\t20,0\n", zone="UTC")
    assert log.series.channels["wind_speed"].tolist() == [4.1, 4.2, 4.3]
    assert instants(log) == ["2026-05-01T12:00:00.500", "2026-05-01T12:00:00.750", "2026-05-01T12:00:01.000"]


@pytest.mark.parametrize("columns", ["Multi", "One"])
def test_segments_that_do_not_go_together_are_refused(read: Read, columns: str) -> None:
    text = FILE.format(point=".", columns=columns)
    text += SEGMENT.format(time="12:00:00") + "0.0\t4.1\t20.0\n0.25\t4.2\t20.0\n"
    text += SEGMENT.format(time="12:00:10").replace("Wind Speed", "Voltage") + "0.0\t5.1\t21.0\n"
    with pytest.raises(FlagdataError):
        read(text, zone="UTC")


@pytest.mark.parametrize("x", ["1e30", "nan", "x", "-1e12"])
def test_rows_whose_x_is_no_instant_are_left_out_and_told(read: Read, x: str) -> None:
    text = FILE.format(point=".", columns="One") + SEGMENT.format(time="12:00:00")
    log = read(text + f"0.0\t4.1\t20.0\n{x}\t9.9\t20.0\n0.25\t4.2\t20.0\n0.5\t4.3\t20.0\n", zone="UTC")
    assert log.series.channels["wind_speed"].tolist() == [4.1, 4.2, 4.3]
    assert any("1 " in finding.what and "left out" in finding.what for finding in log.findings)
