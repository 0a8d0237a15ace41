"""No row and no name is lost where the last column of a table is empty from some row on, or has no name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from flagdata.ingest.anemometer import WindOptions, read_log
from flagdata.signals import WindLog

Read = Callable[..., WindLog]


def rows(last: Callable[[int], str], count: int = 240) -> str:
    """A row a second: stamp, speed from 3.00 m/s in steps of 0.01 m/s, direction 200 to 289°, and `last` of the row."""
    return "".join(
        f"2026-05-01T12:{at // 60:02d}:{at % 60:02d}Z,{3 + at / 100:.2f},{200 + at % 90},{last(at)}\n"
        for at in range(count)
    )


@pytest.mark.parametrize("value", ["12.5", "ok"], ids=["a-sensor", "a-remark"])
@pytest.mark.parametrize("filled", [1, 20, 60, 140, 239])
def test_a_last_column_that_is_empty_from_some_row_on_loses_none(read: Read, value: str, filled: int) -> None:
    log = read("time,wind speed (m/s),wind dir,other\n" + rows(lambda at: value if at < filled else ""))
    speed = log.series.channels["wind_speed"]
    assert len(speed) == 240
    assert speed[[0, filled - 1, 239]].tolist() == pytest.approx([3.0, 3 + (filled - 1) / 100, 5.39])


def test_so_it_is_where_no_line_names_the_columns(log_file: Callable[[str], Path]) -> None:
    path = log_file(rows(lambda at: "12.5" if at < 60 else ""))
    log = read_log(path, WindOptions(columns="time,wind_speed[m/s],wind_direction[deg],"))
    assert len(log.series) == 240
    assert not [found for found in log.findings if "left out" in found.what]


def test_delimiters_at_the_ends_of_all_rows_are_no_column(read: Read) -> None:
    log = read("time,wind speed (m/s),wind dir\n" + rows(lambda _: ""))
    assert log.series.channels["wind_speed"][[0, 239]].tolist() == pytest.approx([3.0, 5.39])
    assert not [found for found in log.findings if found.kind == "heading-doubtful"]


@pytest.mark.parametrize("last", [lambda _: "7", lambda at: "7" if at > 200 else ""], ids=["filled", "late"])
def test_a_heading_without_a_name_for_the_last_column_names_those_before_it(
    read: Read, last: Callable[[int], str]
) -> None:
    # A heading of R has one name less as well: there the first column, of row names, has none.
    log = read("time,wind speed (m/s),wind dir\n" + rows(last))
    assert log.series.channels["wind_speed"][[0, 239]].tolist() == pytest.approx([3.0, 5.39])
    told = [found.what for found in log.findings if found.kind == "heading-doubtful"]
    assert told == ["line 1 names 3 of 4 columns: taken as the first 3"]


def test_the_row_names_of_r_have_no_name(read: Read) -> None:
    body = "".join(f'"{at + 1}",{row}' for at, row in enumerate(rows(lambda _: "7").splitlines(keepends=True)))
    log = read('"time","wind speed (m/s)","wind dir","other"\n' + body)
    assert log.series.channels["wind_speed"][[0, 239]].tolist() == pytest.approx([3.0, 5.39])


def test_a_remark_below_an_empty_last_heading_loses_no_row(read: Read) -> None:
    rows = [f"2026-05-01T12:{at:02d}:00Z,{3 + at % 4}.5,{200 + at},{'=' if at == 7 else ''}" for at in range(20)]
    log = read("\n".join(["Time,Wind Speed (m/s),Wind Dir (deg),", *rows]) + "\n")
    assert len(log.series.time) == 20
    assert "malformed-lines" not in {found.kind for found in log.findings}
