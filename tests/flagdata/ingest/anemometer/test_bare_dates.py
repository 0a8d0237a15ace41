"""Rows that share a date without a time of day are refused with what is missing; no time of day is invented."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError, InputError, TimeError
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
N = 40
NAMES = "date,wind speed (m/s),wind dir (deg)\n"
NOON = 1_777_636_800 * 10**9
"""2026-05-01T12:00:00Z."""


def log(date: Callable[[int], str], names: str = NAMES) -> str:
    return names + "".join(f"{date(at)},{3 + at / 10:.1f},{200 + at}\n" for at in range(N))


DATES = {
    "one": lambda at: "2026-05-01",
    "four": lambda at: f"2026-05-{1 + at // 10:02d}",
    "no-order": lambda at: "01/05/2026",
    "in-words": lambda at: "01-May-2026",
    "eight-digits": lambda at: "20260501",
}


def refused(read: Read, text: str, **options: object) -> FlagdataError:
    with pytest.raises(FlagdataError) as caught:
        read(text, **options)
    return caught.value


@pytest.mark.parametrize("columns", [None, "date,wind_speed[m/s],wind_direction[deg]"])
@pytest.mark.parametrize("name", DATES)
def test_dates_that_rows_share_are_told_as_such_and_not_spread(name: str, columns: str | None, read: Read) -> None:
    order = "dmy" if name == "no-order" else None
    error = refused(read, log(DATES[name]), zone="UTC", columns=columns, date_order=order)
    assert isinstance(error, InputError)
    assert "'date' is a date without a time of day" in error.what
    (line,) = re.findall(r'--columns "([^"]*)" --start TIME --rate HZ', error.fix or "")
    found = read(log(DATES[name]), columns=line, start=NOON, rate=0.5)
    assert ((found.series.time - NOON) // 10**9).tolist() == list(range(0, 2 * N, 2))
    assert np.degrees(found.series.channels["wind_direction"]) == pytest.approx(np.arange(200, 200 + N))


def test_a_format_that_holds_no_time_of_day_is_refused_as_well(read: Read) -> None:
    columns = "time[%Y-%m-%d],wind_speed[m/s],wind_direction[deg]"
    assert "without a time of day" in refused(read, log(DATES["four"]), zone="UTC", columns=columns).what


def test_a_column_that_the_user_knows_for_the_clock_is_asked_for(read: Read) -> None:
    text = log(lambda at: f"2026-05-01,12u{at:02d}", "date,klok,wind speed (m/s),wind dir (deg)\n")
    error = refused(read, text, zone="UTC")
    (line,) = re.findall(r'--columns "([^"]*\?=time)"', error.fix or "")
    found = read(text, zone="UTC", columns=line.replace("?=time", "2=time[%Hu%M]"))
    assert ((found.series.time - NOON) // 60_000_000_000).tolist() == list(range(N))


def test_a_recipe_with_the_date_alone_is_refused(read: Read, tmp_path: Path) -> None:
    recipe = tmp_path / "dates.toml"
    recipe.write_text(
        'name = "dates"\nabout = "a"\nsource = "b"\n[file]\nheader = 1\n[time]\ncolumns = ["date"]\n'
        'format = "%Y-%m-%d"\n[channels.wind_speed]\ncolumn = "wind speed (m/s)"\nunit = "m/s"\n[sensor]\nname = "x"\n'
    )
    error = refused(read, log(DATES["four"]), zone="UTC", recipe=str(recipe))
    assert isinstance(error, TimeError)
    assert "dates without a time of day, and 40 of 40 rows share theirs" in error.what
    assert "--start TIME --rate HZ" in (error.fix or "")


@pytest.mark.parametrize("copies", [1, 2])
def test_a_row_a_day_is_still_read_at_midnight(copies: int, read: Read) -> None:
    text = NAMES + "".join(f"2026-05-{at:02d},{3 + at / 10:.1f},{200 + at}\n" * copies for at in range(1, 31))
    found = read(text, zone="UTC", columns="date,wind_speed[m/s],wind_direction[deg]")
    assert len(found.series) == 30
    assert "dates-alone" in {finding.kind for finding in found.findings}
