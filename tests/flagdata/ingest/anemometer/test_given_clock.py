"""A table on the clock of a start and a rate: what is told of it speaks of the columns that the file has."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest

from flagdata.errors import FlagdataError
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
_START = 1_777_636_800 * 10**9


def _headed(rows: int = 12) -> str:
    lines = (f"{5 + at % 4}.25,{180 + 9 * at},{7 + at % 3}.5,{60 + at}" for at in range(rows))
    return "\n".join(["wind speed [m/s],wind bearing,gust [m/s],battery load", *lines, ""])


def _told(log: WindLog) -> str:
    return " ".join(finding.what for finding in log.findings)


def test_the_added_column_is_neither_counted_nor_called_a_time_of_the_file(read: Read) -> None:
    log = read(_headed(), start=_START, rate=4.0)
    assert log.reasons[:2] == (
        "a table of 4 columns, named by a line above the rows",
        "the time is counted from the start given, at the rate given",
    )
    assert "iso" not in " ".join(log.reasons)


def test_no_line_is_said_to_name_columns_where_none_does(read: Read) -> None:
    rows = "".join(f"{5 + at % 4}.25\t{180 + 9 * at}\n" for at in range(12))
    log = read(rows, start=_START, rate=4.0, columns="wind_speed[m/s],wind_direction[deg]")
    assert log.reasons[0] == "a table of 2 columns, which no line names"


def test_lines_to_paste_name_columns_of_the_file_alone_and_work(read: Read) -> None:
    told = _told(read(_headed(), start=_START, rate=4.0))
    lines = re.findall(r'--columns "([^"]*)"', told)
    assert lines
    assert "give --start and --rate as well with each line of --columns" in told
    for line in lines:
        assert "time" not in line
        read(_headed(), start=_START, rate=4.0, columns=line)


@pytest.mark.parametrize("column", ["5", "time by the clock given"])
def test_the_added_column_cannot_be_named(read: Read, column: str) -> None:
    with pytest.raises(FlagdataError) as refused:
        read(_headed(), start=_START, rate=4.0, columns=f"1=wind_speed[m/s],{column}=wind_direction[deg]")
    assert f"unknown column {column!r}" in refused.value.what
    assert "clock given" not in (refused.value.fix or "")


def test_a_refusal_lists_the_columns_and_the_first_row_of_the_file(read: Read) -> None:
    rows = "".join(f"{5 + at % 4}.25,{10 + 9 * at}\n" for at in range(12))
    with pytest.raises(FlagdataError) as refused:
        read(f"uWind,other\n{rows}", start=_START, rate=4.0, unit="m/s")
    fix = refused.value.fix or ""
    assert "(the first row is 1: 5.25; 2: 10)" in fix
    assert "time" not in "".join(re.findall(r'--columns "([^"]*)"', fix))


def test_a_line_of_question_marks_says_names_to_write(read: Read) -> None:
    rows = "".join(f"{5 + at % 4}.25,{-3 + at % 2}.5,{at % 3}.5\n" for at in range(12))
    with pytest.raises(FlagdataError) as refused:
        read(rows)
    fix = refused.value.fix or ""
    assert '--columns "?,?,?" with a name (time, date, wind_speed[m/s], wind_direction[deg], wind_x[m/s], site' in fix
