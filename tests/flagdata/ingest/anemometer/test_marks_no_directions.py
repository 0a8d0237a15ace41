"""A column that holds nothing but 0 and 1 is a mark, whatever direction its heading names."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError
from flagdata.ingest.anemometer import WindOptions, read_log
from flagdata.signals import WindLog

Read = Callable[..., WindLog]


def _table(*headings: str, speed: str = "wind speed [m/s]") -> str:
    rows = (
        f"2026-05-01T12:{at:02d}:00Z,{5 + at % 4}.25,{at % 2}" + f",{180 + 9 * at}.5" * (len(headings) - 1)
        for at in range(12)
    )
    return "\n".join([f"time,{speed},{','.join(headings)}", *rows, ""])


def test_a_mark_is_no_direction_and_none_of_its_units_are_offered(read: Read) -> None:
    log = read(_table("WD_Active"))
    assert "wind_direction" not in log.series.channels
    assert "10 deg" not in " ".join(finding.what for finding in log.findings)


def test_the_direction_beside_a_mark_is_read(read: Read) -> None:
    log = read(_table("WD_Active", "WD_Vane"))
    assert np.degrees(log.series.channels["wind_direction"][0]) == pytest.approx(180.5)


def test_a_stated_unit_says_that_it_is_no_mark(read: Read) -> None:
    assert "wind_direction" in read(_table("wind direction [deg]")).series.channels


def test_the_line_of_columns_names_the_direction_not_the_mark(log_file: Callable[[str], Path]) -> None:
    text = _table("WD_Active", "WD_Vane", speed="uWind_80m").replace("T12:", "T12h")
    with pytest.raises(FlagdataError) as refused:
        read_log(log_file(text), WindOptions(unit="m/s"))
    assert "4=wind_direction" in (refused.value.fix or "") or ",,wind_direction[deg]" in (refused.value.fix or "")
    assert "wind_direction[?]" not in (refused.value.fix or "")


def test_where_no_direction_is_surely_the_wind_s_the_line_reads_the_first_and_works(read: Read) -> None:
    text = _table("WD_Active", "WD_Nacelle", "WD_Tower", speed="Wind_80m [m/s]")
    told = " ".join(finding.what for finding in read(text).findings)
    assert "none of the directions 'WD_Nacelle', 'WD_Tower' is surely that of" in told
    line = told.partition("if 'WD_Nacelle' is its direction: --columns \"")[2].partition('"')[0]
    log = read(text, columns=line)
    assert np.degrees(log.series.channels["wind_direction"][0]) == pytest.approx(180.5)
