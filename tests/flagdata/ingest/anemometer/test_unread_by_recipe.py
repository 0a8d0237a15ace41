"""What a recipe of the catalog does not read is told, with lines that work; a user's own recipe is silent."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np

from flagdata.ingest.anemometer import WindOptions, read_log
from flagdata.signals import WindLog

Write = Callable[..., Path]
_TABLE = """Date,Time,Wind speed [km/h],Gust [km/h],Wind direction [°]
2026-05-01,12:00:00,10.8,18.0,210
2026-05-01,12:00:01,14.4,21.6,212
2026-05-01,12:00:02,7.2,10.8,215
"""
_OWN = """name = "own"
about = "the speed alone"
source = "made"
[file]
delimiter = ","
header = 1
[time]
columns = ["Date", "Time"]
format = "%Y-%m-%d %H:%M:%S%f"
[channels.wind_speed]
column = "Wind speed [km/h]"
unit = "km/h"
[sensor]
name = "cups"
"""


def _told(log: WindLog) -> str:
    return "; ".join(finding.what for finding in log.findings if finding.kind == "columns-not-read")


def test_columns_of_no_wind_that_a_recipe_leaves_are_named_too(log_file: Write) -> None:
    names, *rows = _TABLE.splitlines()
    table = "\n".join([f"{names},Battery,Note", *(f"{row},12.{at},ok" for at, row in enumerate(rows)), ""])
    told = _told(read_log(log_file(table), WindOptions(zone="UTC")))
    assert "columns 'Battery', 'Note' are not read" in told


def test_columns_that_a_recipe_of_the_catalog_leaves_are_told_and_the_lines_read_them(log_file: Write) -> None:
    path = log_file(_TABLE)
    told = _told(read_log(path, WindOptions(zone="UTC")))
    lines = re.findall(r'--columns "([^"]*)"', told)
    assert "Gust [km/h]" in told
    assert len(lines) == 2
    with_direction, gusts = (read_log(path, WindOptions(zone="UTC", columns=line)).series for line in lines)
    np.testing.assert_allclose(with_direction.channels["wind_speed"], [3, 4, 2])
    np.testing.assert_allclose(np.rad2deg(with_direction.channels["wind_direction"]), [210, 212, 215])
    np.testing.assert_allclose(gusts.channels["wind_speed"], [5, 6, 3])


def test_a_recipe_that_reads_all_of_the_wind_tells_nothing(log_file: Write) -> None:
    text = "\n".join(line.rsplit(",", 2)[0] for line in _TABLE.splitlines()) + "\n"
    assert _told(read_log(log_file(text), WindOptions(zone="UTC"))) == ""


def test_a_users_own_recipe_names_what_is_wanted(log_file: Write) -> None:
    recipe = log_file(_OWN, "own.toml")
    assert _told(read_log(log_file(_TABLE), WindOptions(recipe=str(recipe), zone="UTC"))) == ""
