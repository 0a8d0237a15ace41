"""Days that spreadsheets count: offered where no line names the columns, and named by the lines above them (CRHM)."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.ingest.anemometer import WindOptions, read_log

Write = Callable[[str], Path]
_HOUR = np.timedelta64(3600, "s")


def _rows(first: float, count: int = 48) -> str:
    return "".join(f"{first + at / 24:.5f}\t-{at % 5}.31\t{70 + at % 9}.25\t{2 + at % 4}.15\n" for at in range(count))


@pytest.mark.parametrize(("first", "form"), [(46_143.0, "excel-days"), (740_103.0, "datenum")])
def test_serial_days_without_a_heading_are_offered_with_their_format(log_file: Write, first: float, form: str) -> None:
    path = log_file(_rows(first))
    with pytest.raises(InputError) as caught:
        read_log(path, WindOptions())
    line = re.search(r'--columns "([^"]+)"', caught.value.fix)
    assert line is not None
    assert line[1].startswith(f"time[{form}],")
    log = read_log(path, WindOptions(columns=line[1].replace("?,?,?", ",,wind_speed[m/s]"), zone="UTC"))
    stamps = log.series.time.astype("datetime64[ns]")
    assert stamps[0] == np.datetime64("2026-05-01T00:00")
    assert bool((np.diff(stamps) == _HOUR).all())


def test_days_that_are_yet_to_come_are_none(log_file: Write) -> None:
    rows = "".join(f"{762_186.002 + at / 4:.3f}\t20.{at % 5}3\t1.{at % 9}5\n" for at in range(48))  # October 2086
    with pytest.raises(InputError) as caught:
        read_log(log_file(rows), WindOptions())
    assert "datenum" not in str(caught.value.fix)


def test_a_count_that_is_no_serial_day_is_offered_as_before(log_file: Write) -> None:
    rows = "".join(f"{at * 0.5:.1f}\t-{at % 5}.31\t{70 + at % 9}.25\t{2 + at % 4}.15\n" for at in range(48))
    with pytest.raises(InputError, match=r"time\[\?\]"):
        read_log(log_file(rows), WindOptions())


def test_excel_is_another_word_for_excel_days(log_file: Write) -> None:
    log = read_log(log_file(_rows(46_143.0)), WindOptions(columns="time[excel],,,wind_speed[m/s]", zone="UTC"))
    assert log.series.time.astype("datetime64[ns]")[1] == np.datetime64("2026-05-01T01:00")


def test_names_and_counts_above_a_row_of_signs_name_the_columns(log_file: Write) -> None:
    path = log_file(f"made for a test\nt 1 (°C)\nrh 1\nu 1 (m/s)\n{'#' * 40}\n{_rows(46_143.0)}")
    log = read_log(path, WindOptions(wind="u (m/s)", zone="UTC"))
    assert any("column 'time' is the time, as excel-days" in reason for reason in log.reasons)
    assert {"wind_speed", "air_temperature"} <= set(log.series.channels)
    assert log.series.channels["wind_speed"][:2] == pytest.approx([2.15, 3.15])


def test_a_field_of_two_columns_and_a_time_of_five_are_told(log_file: Write) -> None:
    rows = "".join(f"2026 5 1 {at} 0  -1.5 {3 + at % 3}.5 {4 + at % 3}.5\n" for at in range(24))
    path = log_file(f"made for a test\n$ a remark\nt 1\nu 2\n####\n{rows}")
    log = read_log(path, WindOptions(wind="u2", unit="m/s", zone="UTC"))
    assert log.series.channels["wind_speed"][0] == pytest.approx(4.5)
    assert log.series.time.astype("datetime64[ns]")[-1] == np.datetime64("2026-05-01T23:00")
