"""Counts of hours and days since a start are offered where a first column rises steadily, and are read."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError
from flagdata.ingest.anemometer import WindOptions, read_log, sniff
from flagdata.timebase import NANOSECONDS

Write = Callable[[str], Path]
_START = 1_777_636_800 * NANOSECONDS


def _rows(step: float, form: str = "{:.7e}", count: int = 20) -> str:
    rows = ((step * at, 9 + at % 4 + 0.3, 190 + at * 1.5) for at in range(count))
    return "".join("   ".join(form.format(cell) for cell in row) + "\n" for row in rows)


@pytest.mark.parametrize(
    ("step", "unit", "seconds"),
    [(1 / 6, "h", 600), (0.5, "h", 1800), (1.0, "h", 3600), (10.0, "min", 600), (1 / 24, "d", 3600), (0.25, "s", 0.25)],
)
def test_a_count_in_any_unit_is_read_from_the_start(log_file: Write, step: float, unit: str, seconds: float) -> None:
    columns = f"time[elapsed-{unit}],wind_speed[m/s],wind_direction[deg]"
    series = read_log(log_file(_rows(step)), WindOptions(columns=columns, start=_START)).series
    expected = _START + np.round(np.arange(20) * seconds * NANOSECONDS).astype(np.int64)
    np.testing.assert_array_equal(series.time, expected)
    assert series.channels["wind_speed"][:2].tolist() == [9.3, 10.3]


@pytest.mark.parametrize("step", [1.0, 0.5, 0.1667])
def test_a_steady_first_column_is_offered_as_time_in_all_units(log_file: Write, step: float) -> None:
    path = log_file(_rows(step, "{:.4f}"))
    fix = sniff(path)[0].fix or ""
    assert '"time[?],?,?"' in fix
    assert {"elapsed-s", "elapsed-min", "elapsed-h", "elapsed-d"} <= set(re.findall(r"elapsed-\w+", fix))
    assert "--start" in fix


def test_an_uneven_first_column_is_no_count(log_file: Write) -> None:
    rows = "".join(f"{value} 9.{at} 20{at}\n" for at, value in enumerate((1.1, 3.4, 4.0, 9.2, 9.9, 12.0)))
    assert "time[?]" not in (sniff(log_file(rows))[0].fix or "")


def test_a_count_whose_unit_is_wrong_for_the_rows_is_still_named_with_all_units(log_file: Write) -> None:
    path = log_file("t,wind speed (m/s)\n" + "".join(f"{at * 0.5},4.{at}\n" for at in range(9)))
    with pytest.raises(FlagdataError, match="unit is not stated") as caught:
        read_log(path)
    assert "elapsed-h" in (caught.value.fix or "")


@pytest.mark.parametrize("heading", ["hour", "ObsTime", "時"])
def test_hours_without_a_date_count_from_the_start_that_the_user_gives(log_file: Write, heading: str) -> None:
    path = log_file(f"{heading},wind speed (m/s)\n" + "".join(f"{at:02d},{3 + at % 4}.2\n" for at in range(1, 25)))
    with pytest.raises(FlagdataError, match="elapsed-h") as caught:
        read_log(path, WindOptions())
    assert "--start" in (caught.value.fix or "")
    series = read_log(path, WindOptions(start=_START)).series
    np.testing.assert_array_equal(series.time, _START + np.arange(24) * 3600 * NANOSECONDS)
