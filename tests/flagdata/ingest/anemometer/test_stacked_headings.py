"""Headings stacked over several lines, on made tables."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.ingest.anemometer import WindOptions, anemometers, read_log

Write = Callable[[str], Path]

BY_PLACE = """                       Wind        Wind       Max
Date       Time        Speed       Direction  Gust
                       km/h        deg        km/h
"""


def test_words_above_each_other_and_the_unit_below_them(log_file: Write) -> None:
    rows = "".join(f"2020-01-01 {hour:02d}:00       {18 * hour / 5:4.1f}        180        40.1\n" for hour in range(6))
    log = read_log(log_file(BY_PLACE + rows), WindOptions(zone="UTC"))
    np.testing.assert_allclose(log.series.channels["wind_speed"], np.arange(6.0))
    np.testing.assert_allclose(log.series.channels["wind_direction"], np.pi)
    assert "stacked-headings" in {finding.kind for finding in log.findings}


def test_a_merged_cell_is_that_of_the_columns_up_to_the_next(log_file: Write) -> None:
    text = "Report\n,10 m,,50 m,,Air\nTime,Wind Speed,Wind Dir,Wind Speed,Wind Dir,Temp\n,m/s,deg,m/s,deg,C\n"
    text += "".join(f"2020-01-01T{hour:02d}:00:00Z,{hour},90,{hour + 2},100,12\n" for hour in range(6))
    path = log_file(text)
    names = anemometers(path, WindOptions())
    assert len(names) == 2
    first, second = (read_log(path, WindOptions(wind=name)).series for name in names)
    assert (second.channels["wind_speed"] - first.channels["wind_speed"]).tolist() == [2.0] * 6
    np.testing.assert_allclose(np.rad2deg(second.channels["wind_direction"]), 100)


@pytest.mark.parametrize("title", ["Wind speed and direction of the roof", "Wind Report"])
def test_a_title_is_no_part_of_the_headings(log_file: Write, title: str) -> None:
    text = f"{title}\nDate Time Speed_m/s Dir_deg\n"
    text += "".join(f"2020-01-01 {hour:02d}:00 {hour}.5 180\n" for hour in range(6))
    log = read_log(log_file(text), WindOptions(zone="UTC", columns="date,time,wind_speed[m/s],wind_direction[deg]"))
    assert log.series.channels["wind_speed"].tolist() == [hour + 0.5 for hour in range(6)]
    assert "stacked-headings" not in {finding.kind for finding in log.findings}
