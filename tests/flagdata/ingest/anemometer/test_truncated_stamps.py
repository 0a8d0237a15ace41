"""Stamps that a spreadsheet cut to minutes and seconds are refused with what brings their day back."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
START = 1_777_636_798_000_000_000  # 2026-05-01T11:59:58Z


def table(clocks: list[str]) -> str:
    rows = "".join(f"{clock},{3.0 + 0.1 * at:.1f},{220 + at}\n" for at, clock in enumerate(clocks))
    return f"time,wind speed [m/s],wind direction [deg]\n{rows}"


def test_the_hour_is_asked_for_with_the_rate_that_the_minutes_and_seconds_show(read: Read) -> None:
    text = table(["59:58.0", "59:58.5", "59:59.0", "59:59.5", "00:00.0", "00:00.5"])
    with pytest.raises(InputError, match=r"minutes and seconds only \('59:58.0'\)") as refused:
        read(text)
    assert "--rate 2 --start TIME" in (refused.value.fix or "")
    assert "59:58.0" in (refused.value.fix or "")
    log = read(text, start=START, rate=2.0)
    np.testing.assert_allclose((log.series.time - START) / 1e9, np.arange(6) / 2)


def test_no_rate_is_offered_where_rows_came_unevenly(read: Read) -> None:
    with pytest.raises(InputError, match="minutes and seconds only") as refused:
        read(table(["42:10.0", "42:11.0", "42:19.3", "42:20.1", "43:01.0"]))
    assert "--rate" not in (refused.value.fix or "")
    assert "export it again" in (refused.value.fix or "")


@pytest.mark.parametrize("form", ["{}{:02d}{:02d}", "{}-{:02d}-{:02d}", "{}/{:02d}/{:02d} 12:00"])
def test_dates_before_1970_are_no_count_and_are_named(read: Read, form: str) -> None:
    rows = "".join(f"{form.format(1969, 1, day)},{3.0 + 0.1 * day:.1f}\n" for day in range(1, 9))
    with pytest.raises(InputError, match="holds dates before 1970") as refused:
        read(f"DATE,wind speed [m/s]\n{rows}")
    assert "--start TIME" in (refused.value.fix or "")


def test_a_line_of_totals_is_no_site_of_its_own(read: Read) -> None:
    rows = "".join(f"Cape,{day:02d}/01/2010 12:00,{5.0 + 0.1 * day:.1f}\n" for day in range(1, 14))
    log = read(f"Station Name,Date,Wind Speed (m/s)\n{rows}Totals:,,83.2\n", zone="UTC")
    assert len(log.series.time) == 13
    np.testing.assert_allclose(log.series.channels["wind_speed"][[0, -1]], [5.1, 6.3])
