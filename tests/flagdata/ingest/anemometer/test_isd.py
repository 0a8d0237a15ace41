"""NOAA's Integrated Surface Database in lines of fixed columns, by positions of its documentation."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

Read = Callable[..., Any]


def _line(hour: int, wind: str, warm: str = "+02441") -> str:
    """A report: each part stands at the position that the documentation gives it, counted from 1."""
    line = list("." * 110)
    parts = {
        1: "0123", 5: "725030", 11: "14732", 16: "20230701", 24: f"{hour:02d}51", 28: "4", 29: "+40783", 35: "-073883",
        42: "FM-15", 47: "+0003", 52: "KLGA ", 57: "V020", 61: wind, 88: warm, 106: "ADD",
    }  # fmt: skip
    for position, text in parts.items():
        line[position - 1 : position - 1 + len(text)] = text
    return "".join(line)


def test_wind_time_and_station_are_read_by_their_positions(read: Read) -> None:
    winds = ["2301N00461", "9999C00001", "9999V00151", "1001N99999", "1003N00621", "1001N00623", "3601N01231"]
    log = read("\n".join(_line(hour, wind) for hour, wind in enumerate(winds)) + "\n")
    series = log.series
    assert series.time[0] == np.datetime64("2023-07-01T00:51:00", "ns").astype(np.int64)
    assert np.unique(np.diff(series.time)).tolist() == [3_600_000_000_000]
    np.testing.assert_allclose(series.channels["wind_speed"], [4.6, 0.0, 1.5, np.nan, 6.2, np.nan, 12.3])
    away = np.rad2deg(series.channels["wind_direction"])
    np.testing.assert_allclose(np.mod(away, 360), [230, np.nan, np.nan, 100, np.nan, 100, 0], atol=1e-9)
    np.testing.assert_allclose(series.channels["air_temperature"], 273.15 + 24.4)


def test_missing_and_erroneous_temperatures_are_left_out(read: Read) -> None:
    lines = [_line(0, "2301N00461", "+99999"), _line(1, "2301N00461", "-00123"), _line(2, "2301N00461", "-00121")]
    warm = read("\n".join(lines) + "\n").series.channels["air_temperature"]
    np.testing.assert_allclose(warm, [np.nan, np.nan, 273.15 - 1.2])
