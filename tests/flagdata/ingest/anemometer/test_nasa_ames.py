"""NASA Ames files of index 1001, of EBAS and ICARTT too, by their specifications."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError, ZoneMissingError
from flagdata.ingest.anemometer import WindOptions, read_log

Write = Callable[[str], Path]

EBAS = (
    "end_time of measurement; days from the file reference point",
    "wind_speed, m/s, Location=instrument inlet, Matrix=met, Statistics=arithmetic mean",
    "wind_direction, deg, Location=instrument inlet, Matrix=met",
    "wind_speed, m/s, Statistics=percentile:84.13",
    "numflag wind_speed, no unit",
)


def ames(
    names: tuple[str, ...], rows: list[str], *, time: str, scales: str, missing: str, comments: tuple[str, ...] = (),
    sign: str = " ",
) -> str:  # fmt: skip
    """A file by the specification: the number of header lines in its first."""
    above = [
        "Ruiz, Ana", "Institute of Air", "mast", "campaign", f"1{sign}1",
        f"2019{sign}02{sign}03{sign}2020{sign}03{sign}05", "0", time, str(len(names)), scales, missing, *names,
        "0", str(len(comments)), *comments,
    ]  # fmt: skip
    return "\n".join([f"{len(above) + 1}{sign}1001", *above, *rows]) + "\n"


def ebas(*comments: str) -> str:
    rows = [
        f"{hour / 24:.6f} {(hour + 1) / 24:.6f} {hour + 0.5:.2f} {200 + hour}.0 {hour + 1:.2f} 0.000"
        for hour in range(8)
    ]
    rows[3] = f"{3 / 24:.6f} {4 / 24:.6f} 99.99 999.9 99.99 0.999"
    return ames(
        EBAS, rows, time="days from the file reference point", scales="1 1 1 1 1",
        missing="9999.999999 99.99 999.9 99.99 9.999", comments=("Station name: Hill", *comments, "start end ws wd f"),
    )  # fmt: skip


def test_days_from_the_reference_point_are_instants_and_the_mean_wind_is_taken(log_file: Write) -> None:
    log = read_log(log_file(ebas("Timezone: UTC")), WindOptions())
    hours = np.array([0, 1, 2, 4, 5, 6, 7])
    expected = np.datetime64("2019-02-03T00:00", "ns") + hours * np.timedelta64(1, "h")
    speed = log.series.channels["wind_speed"]
    there = ~np.isnan(speed)
    np.testing.assert_array_equal(log.series.time[there], expected.astype(np.int64))
    np.testing.assert_allclose(speed[there], hours + 0.5)
    np.testing.assert_allclose(np.rad2deg(log.series.channels["wind_direction"][there]) % 360, 200 + hours)


def test_rows_that_are_flagged_are_told(log_file: Write) -> None:
    found = read_log(log_file(ebas("Timezone: UTC")), WindOptions()).findings
    assert [one.count for one in found if one.kind == "flags-not-heeded"] == [1]


def test_a_header_without_a_zone_asks_for_it(log_file: Write) -> None:
    with pytest.raises(ZoneMissingError):
        read_log(log_file(ebas()), WindOptions())


def icartt(unit: str) -> str:
    rows = [f"{36000 + 60 * minute}, {10 * minute + 25}, {90 + minute}, 288.1" for minute in range(6)]
    rows[2] = "36120, -9999, -9999, 288.1"
    return ames(
        (f"WindSpeed, {unit}, Met_WindSpeed_InSitu_None", "WindDirection, degrees, Met", "StaticTemp, K, Met"), rows,
        time="Time_Start, seconds, number of seconds from midnight", scales="0.1, 1, 1", missing="-9999, -9999, -9999",
        sign=",",
    )  # fmt: skip


def test_icartt_is_in_utc_and_its_values_are_times_their_scale(log_file: Write) -> None:
    log = read_log(log_file(icartt("m/s")), WindOptions())
    speed = log.series.channels["wind_speed"]
    there = ~np.isnan(speed)
    minutes = np.array([0, 1, 3, 4, 5])
    start = np.datetime64("2019-02-03T10:00", "ns")
    np.testing.assert_array_equal(log.series.time[there], (start + minutes * np.timedelta64(1, "m")).astype(np.int64))
    np.testing.assert_allclose(speed[there], minutes + 2.5)


def test_a_variable_without_a_unit_asks_for_it(log_file: Write) -> None:
    with pytest.raises(FlagdataError, match="unit of column"):
        read_log(log_file(icartt("none")), WindOptions())
