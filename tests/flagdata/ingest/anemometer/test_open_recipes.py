"""Recipes that the heading of a file completes: a user's own and those of the catalog, and what a
plan says of them."""

from __future__ import annotations

from collections.abc import Callable
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

import flagdata
from flagdata.core.provenance import digest
from flagdata.core.schema import UNUSABLE, SampleFlag
from flagdata.errors import FlagdataError, InputError
from flagdata.ingest import FORMATS, WindOptions, read_log
from flagdata.ingest.anemometer.formats import described
from flagdata.recipes.documents import from_toml, to_toml

Write = Callable[..., Path]

RECIPE = """
name = "mast"
about = "two versions of one logger"
source = "its manual"
[match]
header = ["time.*", "(Avg )?Wind Speed.*"]
within = 4
cell = '(?P<name>[^(]*?)\\s*(\\((?P<unit>.*)\\))?'
[time]
columns = ["time"]
format = ["%d.%m.%Y %H:%M", "iso"]
zone = "UTC"
[channels.wind_speed]
column = ["Wind Speed", "Avg Wind Speed"]
unit = { in = "heading", else = "kn" }
gain = 2.0
range = [0, 60]
[channels.wind_direction]
column = ["Dir [from]"]
unit = "deg"
optional = true
[sensor]
name = "mast {wind_speed}"
"""


@pytest.mark.parametrize(
    ("text", "speed", "label"),
    [
        ("time;Wind Speed (km/h);Dir [from]\n01.05.2026 12:00;18,0;90\n", 10.0, "Wind Speed"),
        (
            "Logger 3\n\nt0\ntime,Avg Wind Speed (mph),x\n2026-05-01T12:00:00Z,10,1\n",
            8.9408,
            "Avg Wind Speed",
        ),
        ("time,Wind Speed,x\n2026-05-01T12:00:00Z,10,1\n", 2 * 10 * 1852 / 3600, "Wind Speed"),
    ],
)
def test_a_recipe_takes_names_units_and_place_from_the_heading(
    log_file: Write, text: str, speed: float, label: str
) -> None:
    recipe = log_file(RECIPE, "mast.toml")
    log = read_log(log_file(text), WindOptions(recipe=str(recipe)))
    assert log.series.time[0] == 1_777_636_800_000_000_000
    assert log.series.channels["wind_speed"] == pytest.approx([speed])
    assert log.series.sensor.name == f"mast {label}"
    assert ("wind_direction" in log.series.channels) == ("Dir" in text)
    assert log.plan["recipe"] == digest(RECIPE)
    assert not log.drafted


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("within = 4", "wihtin = 4", "wihtin"),
        ('else = "kn"', 'esle = "kn"', "esle"),
        ('in = "heading"', 'in = "footer"', "in no heading"),
        ("gain = 2.0", "gian = 2.0", "gian"),
        ("[sensor]", "[senser]", "senser"),
        ("optional = true", "", "no column of wind direction"),
        ('"Wind Speed", "Avg Wind Speed"', '"Speed"', "no column of wind speed"),
        ('else = "kn"', 'else = ""', "its unit is ''"),
        ('"time.*"', '"Zeit"', "no heading"),
        ("range = [0, 60]", "range = [0]", r"range is \[0\]"),
    ],
)
def test_what_an_open_recipe_or_the_file_lacks_is_refused_with_its_name(
    log_file: Write, old: str, new: str, says: str
) -> None:
    recipe = log_file(RECIPE.replace(old, new), "mast.toml")
    path = log_file("time,Wind Speed,x\n2026-05-01T12:00:00Z,10,1\n")
    with pytest.raises(FlagdataError, match=says) as caught:
        read_log(path, WindOptions(recipe=str(recipe)))
    assert caught.value.fix


def test_a_range_beside_a_unit_of_the_heading_is_in_si(log_file: Write) -> None:
    recipe = str(log_file(RECIPE.replace("[0, 60]", "[0, 10]"), "mast.toml"))
    rows = "".join(
        f"2026-05-01T12:00:0{at}Z,{speed},1\n" for at, speed in enumerate((17.0, 19.0, 5.0))
    )
    log = read_log(log_file(f"time,Wind Speed (km/h),x\n{rows}"), WindOptions(recipe=recipe))
    # twice 17, 19 and 5 km/h: 9.4, 10.6 and 2.8 m/s
    assert [finding.count for finding in log.findings if finding.kind == "out-of-range"] == [1]


KESTREL = (
    "Device Name,K\nDevice Model,5500\nTime,Wind Speed,Temp,Dir\nx,m/s,C,d\n"
    "2026-05-01 12:00:00,3,20,90\n2026-05-01 12:00:02,4,20,90\n"
)


def test_another_text_of_a_catalogs_format_is_another_plan(
    log_file: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = log_file(KESTREL)
    text = (files("catalogs") / "sensors/formats/kestrel.toml").read_text(encoding="utf-8")
    first = read_log(path, WindOptions(zone="UTC"))
    assert first.plan["recipe"] == digest(text)
    changed = text.replace("range = [0, 60]", "range = [0, 50]")
    opened = described.recipes.parse_open(changed, where="changed")
    real = described.open_format
    monkeypatch.setattr(
        described,
        "open_format",
        lambda name: (changed, opened) if name == "kestrel" else real(name),
    )
    second = read_log(path, WindOptions(zone="UTC"))
    assert second.plan["recipe"] == digest(changed)
    assert (
        second.series.channels["wind_speed"].tolist()
        == first.series.channels["wind_speed"].tolist()
    )


def test_every_format_of_the_catalog_is_in_the_table_and_open() -> None:
    names = {
        entry.name.removesuffix(".toml")
        for entry in (files("catalogs") / "sensors/formats").iterdir()
    }
    assert names <= set(FORMATS)
    for name in names:
        text, recipe = described.open_format(name)
        assert recipe.name == name
        assert from_toml(to_toml(recipe.data)) == from_toml(text)


def test_a_recipe_of_the_catalogs_kind_may_be_given_for_a_file_that_no_format_claims(
    log_file: Write,
) -> None:
    text = (files("catalogs") / "sensors/formats/davis.toml").read_text(encoding="utf-8")
    own = str(
        log_file(
            text.replace("Avg Wind Speed", "Mittlerer Wind").replace(
                "avg wind speed", "mittlerer wind"
            ),
            "own.toml",
        )
    )
    path = log_file('"Date & Time","Mittlerer Wind - km/h"\n"5/13/26 12:05 AM","18.0"\n')
    log = read_log(path, WindOptions(recipe=own, zone="UTC"))
    assert log.series.channels["wind_speed"] == pytest.approx([5.0])
    with pytest.raises(InputError, match="no heading"):
        read_log(log_file("a,b\n1,2\n"), WindOptions(recipe=own, zone="UTC"))


STATE = RECIPE + '[[check]]\ncolumn = "state.*"\nvalues = ["ok"]\nabout = "state"\n'
STATED = (
    "time,Wind Speed,State of it\n2026-05-01T12:00:00Z,10,ok\n2026-05-01T12:00:01Z,90,E\n"
    "2026-05-01T12:00:02Z,11,ok\n"
)


def test_rows_that_a_check_marks_are_kept_and_have_no_speed_in_python(log_file: Write) -> None:
    path, recipe = log_file(STATED), log_file(STATE, "mast.toml")
    wind = flagdata.wind(path, sensor=recipe)
    assert np.isnan(wind.speed).tolist() == [False, True, False]
    assert (wind.flags & UNUSABLE != 0).tolist() == [False, True, False]
    # the recipe's gain of 2
    assert wind.channels["wind_speed"] == pytest.approx(np.array([20.0, 180.0, 22.0]) * 1852 / 3600)
    assert "columns-not-read" not in {finding.kind for finding in wind.findings}


@pytest.mark.parametrize("name", ["statt", "State"])
def test_a_check_of_a_column_that_is_not_there_is_refused_unless_it_is_optional(
    log_file: Write, name: str
) -> None:
    misspelt = STATE.replace("state.*", name)
    with pytest.raises(InputError, match=f"called {name}, which the recipe checks") as caught:
        read_log(log_file(STATED), WindOptions(recipe=str(log_file(misspelt, "misspelt.toml"))))
    assert "State of it" in str(caught.value.fix)
    assert caught.value.where.endswith("line 1")
    optional = log_file(f"{misspelt}optional = true\n", "optional.toml")
    log = read_log(log_file(STATED), WindOptions(recipe=str(optional)))
    assert not (log.series.flags & SampleFlag.SENSOR_FAULT).any()
    assert "columns-not-read" in {finding.kind for finding in log.findings}
