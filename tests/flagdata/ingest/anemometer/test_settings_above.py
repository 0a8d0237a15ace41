"""Settings above a table, such as a namelist of Fortran, name no columns, be they comments or not."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest

from flagdata.errors import FlagdataError
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
NAMES = "time wspd_ms wdir_deg qc"
ABOVE = (
    "! &header nlev=3 /", "!&header nlev=3, ntime=12 /", "&wind speed=3 dir=1 /",
    "# &data n=30, unit='m/s', dir='deg' /", "# station = Foo", "! speed=3, dir=1, n=2, x='a'", "!&list\n! n=3\n! /",
)  # fmt: skip


def rows(delimiter: str) -> str:
    cells = ([f"2026-05-01T12:{at:02d}:00Z", f"{3 + at % 7}.5", f"{200 + at}", f"{at % 3}"] for at in range(30))
    return "".join(delimiter.join(row) + "\n" for row in cells)


@pytest.mark.parametrize("delimiter", [" ", ","])
@pytest.mark.parametrize("above", ABOVE)
def test_settings_name_no_columns(above: str, delimiter: str, read: Read) -> None:
    with pytest.raises(FlagdataError) as caught:
        read(f"{above}\n{rows(delimiter)}")
    assert "the columns are no names" in caught.value.what
    (line,) = re.findall(r'--columns "([^"]*)"', caught.value.fix or "")
    assert line == "time,?,?,?"
    found = read(f"{above}\n{rows(delimiter)}", columns="time,wind_speed[m/s],wind_direction[deg],")
    assert found.series.channels["wind_speed"][:2].tolist() == [3.5, 4.5]


@pytest.mark.parametrize("delimiter", [" ", ","])
@pytest.mark.parametrize("above", ABOVE)
@pytest.mark.parametrize("first", [True, False])
def test_names_above_or_below_settings_are_still_the_columns(
    above: str, delimiter: str, first: bool, read: Read
) -> None:
    heading = NAMES.replace(" ", delimiter)
    lines = (heading, above) if first else (above, heading)
    found = read("\n".join([*lines, rows(delimiter)]))
    assert set(found.series.channels) == {"wind_speed", "wind_direction"}
    assert len(found.series) == 30


@pytest.mark.parametrize("name", ["flag(0=ok)", "flag=1", "WD=wind_dir"])
def test_a_name_with_a_sign_of_equality_is_still_one(name: str, read: Read) -> None:
    found = read(f"time,wspd_ms,wdir_deg,{name}\n{rows(',')}")
    assert found.series.channels["wind_speed"][:2].tolist() == [3.5, 4.5]
