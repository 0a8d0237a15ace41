"""Columns empty in the first thousand rows, as a lidar's upper heights, are read where later rows fill them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.ingest.anemometer import WindOptions, anemometers, read_log, sniff

Write = Callable[..., Path]
_LOW, _HIGH = "Wind Speed 40m [m/s]", "Wind Speed 160m [m/s]"
_ROWS, _EMPTY = 1500, 1300


def _profile(missing: str, *, tail: str = "") -> str:
    """Two heights, of which the upper one has no value in the first 1300 of 1500 minutes."""
    heads = f"Timestamp,{_LOW},Wind Direction 40m [deg],{_HIGH},Wind Direction 160m [deg]{tail and ',Note'}"
    rows = [heads]
    for at in range(_ROWS):
        upper = f"{missing},{missing}" if at < _EMPTY else f"{9 + at % 3},{300 + at % 5}"
        when = f"2026-05-{1 + at // 1440:02d}T{at // 60 % 24:02d}:{at % 60:02d}:00Z"
        rows.append(f"{when},{4 + at % 3},{200 + at % 5},{upper}{tail}")
    return "\n".join([*rows, ""])


@pytest.mark.parametrize("missing", ["NaN", "", "9999", "-999.0"])
@pytest.mark.parametrize("tail", ["", ",7"])
def test_a_height_that_later_rows_fill_is_an_anemometer(log_file: Write, missing: str, tail: str) -> None:
    path = log_file(_profile(missing, tail=tail))
    assert anemometers(path) == (_LOW, _HIGH)
    assert sniff(path)[0].winds == (_LOW, _HIGH)
    series = read_log(path, WindOptions(wind=_HIGH)).series
    speed, away = series.channels["wind_speed"], np.rad2deg(series.channels["wind_direction"])
    assert np.isnan(speed[:_EMPTY]).all()
    assert np.isnan(away[:_EMPTY]).all()
    np.testing.assert_allclose(speed[_EMPTY:], 9 + np.arange(_EMPTY, _ROWS) % 3)
    np.testing.assert_allclose(away[_EMPTY:], 300 + np.arange(_EMPTY, _ROWS) % 5)


def test_one_late_value_is_enough(log_file: Write) -> None:
    lines = _profile("").splitlines()
    lines[_EMPTY + 1 : -1] = [line.rsplit(",", 2)[0] + ",," for line in lines[_EMPTY + 1 : -1]]
    path = log_file("\n".join([*lines, ""]))
    speed = read_log(path, WindOptions(wind=_HIGH)).series.channels["wind_speed"]
    assert np.isfinite(speed).sum() == 1
    assert speed[-1] == 9 + (_ROWS - 1) % 3


def test_a_height_that_no_row_fills_is_none(log_file: Write) -> None:
    lines = _profile("").splitlines()[: _EMPTY + 1]
    assert anemometers(log_file("\n".join([*lines, ""]))) == ()
