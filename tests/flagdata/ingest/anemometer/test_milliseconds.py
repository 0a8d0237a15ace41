"""Stamps with milliseconds, whatever divides their numbers, are read to the millisecond or refused."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import InputError, TimeError
from flagdata.ingest.anemometer import WindOptions, read_log

Write = Callable[[str], Path]
START = dt.datetime(2021, 5, 3, 12, 0, 0, 23_000, tzinfo=dt.UTC)
STEP = 100  # ms


def _rows(form: str) -> str:
    lines: list[str] = []
    for at in range(60):
        instant = START + dt.timedelta(milliseconds=STEP * at)
        stamp = instant.strftime(form).replace("FFF", f"{instant.microsecond // 1000:03d}")
        lines.append(f"{stamp},{2 + at % 7 / 10:.1f},{200 + at}\n")
    return "".join(lines)


def _check(path: Path, options: WindOptions) -> None:
    series = read_log(path, options).series
    first = np.datetime64("2021-05-03T12:00:00.023").astype("datetime64[ns]").astype(np.int64)
    np.testing.assert_array_equal(series.time, first + STEP * 1_000_000 * np.arange(60))
    np.testing.assert_allclose(series.channels["wind_speed"], [2 + at % 7 / 10 for at in range(60)])


@pytest.mark.parametrize(
    "form",
    [
        "%Y-%m-%d %H:%M:%S.FFF", "%Y-%m-%d %H.%M.%S.FFF", "%Y.%m.%d %H:%M:%S.FFF", "%Y.%m.%d.%H.%M.%S.FFF",
        "%Y%m%d-%H%M%S.FFF", "%Y%m%d-%H:%M:%S.FFF", "%Y%m%d-%H%M%S-FFF", "%Y%m%d_%H%M%SFFF", "%Y%m%d%H%M%SFFF",
        "%Y-%m-%d %H:%M:%S:FFF",
    ],
)  # fmt: skip
def test_stamps_in_one_cell_are_read_to_the_millisecond(log_file: Write, form: str) -> None:
    _check(log_file("time,speed [m/s],direction [deg]\n" + _rows(form)), WindOptions(zone="UTC"))


@pytest.mark.parametrize(
    "form", ["%Y-%m-%d,%H.%M.%S.FFF", "%Y%m%d,%H.%M.%S.FFF", "%d.%m.%Y,%H.%M.%S.FFF", "%Y-%m-%d,%H:%M:%S:FFF"]
)
def test_a_date_and_a_clock_in_two_cells_are_read_to_the_millisecond(log_file: Write, form: str) -> None:
    path = log_file("date,time,speed [m/s],direction [deg]\n" + _rows(form))
    order = "dmy" if form.startswith("%d") else None
    _check(path, WindOptions(zone="UTC", date_order=order))


@pytest.mark.parametrize("form", ["%H.%M.%S.FFF", "%H:%M:%S:FFF"])
def test_a_clock_alone_asks_for_the_day_and_is_read_with_it(log_file: Write, form: str) -> None:
    path = log_file("time,speed [m/s],direction [deg]\n" + _rows(form))
    with pytest.raises(TimeError) as caught:
        read_log(path, WindOptions(zone="UTC"))
    assert "--date" in caught.value.fix
    _check(path, WindOptions(zone="UTC", date=START.date()))


def test_two_digits_behind_a_colon_are_no_milliseconds(log_file: Write) -> None:
    rows = _rows("%Y-%m-%d %H:%M:%S:FFF").splitlines()
    text = "\n".join(f"{row[:22]}{row[23:]}" for row in rows)
    with pytest.raises(InputError, match="no column is a time"):
        read_log(log_file(f"time,speed [m/s],direction [deg]\n{text}\n"), WindOptions(zone="UTC"))
