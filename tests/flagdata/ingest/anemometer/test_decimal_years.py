"""Years with their passed share as a fraction are a time."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
DAYS = [74.0, 90.5, 106.25, 122.0, 140.75]  # of 2020, which has 366 days, from 0 on
YEARS = [2020 + day / 366 for day in DAYS]
BEGIN = np.datetime64("2020-01-01", "ns").astype(np.int64)


def times() -> np.ndarray:
    return BEGIN + (np.array(DAYS) * 86_400e9).astype(np.int64)


def test_a_column_with_the_heading_is_read_to_the_second(read: Read) -> None:
    rows = "".join(f"{year:.9f},{4 + at}.5\n" for at, year in enumerate(YEARS))
    series = read(f"decimal year,wind speed (m/s)\n{rows}", zone="UTC").series
    np.testing.assert_allclose(series.time, times(), atol=1_000_000_000)


@pytest.mark.parametrize("form", ["{:.18e}", "{:.8f}"])
def test_a_column_without_a_heading_is_offered_as_years(read: Read, form: str) -> None:
    rows = "".join(f"{form.format(year)},{4 + at}.5\n" for at, year in enumerate(YEARS))
    with pytest.raises(InputError) as refused:
        read(rows)
    (line,) = re.findall(r'--columns "([^"]*)"', refused.value.fix or "")
    assert line == "time[decimal-years],?"
    series = read(rows, columns=line.replace("?", "wind_speed[m/s]"), zone="UTC").series
    np.testing.assert_allclose(series.time, times(), atol=1_000_000_000)
