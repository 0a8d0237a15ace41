"""Sensor recipes: what TOML says is what is read; what it should not say is refused with the
fix."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.core.schema import CHANNELS, SampleFlag
from flagdata.core.units import UNITS
from flagdata.errors import FlagdataError, InputError, UnknownNameError
from flagdata.ingest import WindOptions, read_log
from flagdata.ingest.anemometer import sensor_recipe as recipes
from flagdata.record.signals import WindLog
from flagdata.timebase import iso
from tests.flagdata.ingest.anemometer.conftest import read

PLAIN = """
name = "mine"
about = "a test"
source = "a test"
[time]
columns = ["t"]
format = "iso"
[channels.wind_speed]
column = "v"
unit = "m/s"
[sensor]
name = "mine"
"""


def by_recipe(tmp_path: Path, recipe: str, text: str, **options: object) -> WindLog:
    (tmp_path / "r.toml").write_text(recipe)
    path = tmp_path / "log.txt"
    path.write_text(text)
    return read_log(path, WindOptions(recipe=str(tmp_path / "r.toml"), **options))  # type: ignore[arg-type]


@pytest.mark.parametrize("name", recipes.SENSORS.names())
def test_every_recipe_of_the_catalog_loads_and_names_its_source(name: str) -> None:
    recipe = recipes.load(name)
    assert recipe.name == name
    assert recipe.source
    assert set(recipe.channels) <= set(CHANNELS)


@pytest.mark.parametrize("unit", ["m/s", "km/h", "kn", "mph", "ft/s", "ft/min"])
def test_any_speed_unit_becomes_metres_a_second(tmp_path: Path, unit: str) -> None:
    # 1 m/s is exactly 3.6 km/h, 3600/1852 kn, 1/0.44704 mph, 1/0.3048 ft/s, 60/0.3048 ft/min
    one = {
        "m/s": 1,
        "km/h": 3.6,
        "kn": 3600 / 1852,
        "mph": 1 / 0.44704,
        "ft/s": 1 / 0.3048,
        "ft/min": 60 / 0.3048,
    }[unit]
    log = by_recipe(
        tmp_path, PLAIN.replace('"m/s"', f'"{unit}"'), f"t,v\n2026-05-01T12:00:00Z,{one!r}\n"
    )
    assert log.series.channels["wind_speed"] == pytest.approx([1.0])


def test_gain_and_offset_are_applied_in_the_files_unit(tmp_path: Path) -> None:
    # 2 V · 5 (km/h)/V + 1 km/h = 11 km/h
    recipe = PLAIN.replace('unit = "m/s"', 'unit = "km/h"\ngain = 5.0\noffset = 1')
    log = by_recipe(tmp_path, recipe, "t,v\n2026-05-01T12:00:00Z,2\n")
    assert log.series.channels["wind_speed"] == pytest.approx([11 / 3.6])


@pytest.mark.parametrize(
    ("extra", "expected"),
    [
        ("", 90),
        ('convention = "to"', 270),
        ("rotation = 15", 105),
        ('convention = "to"\nrotation = 100', 10),
    ],
)
def test_directions_come_out_as_from_clockwise_from_north(
    tmp_path: Path, extra: str, expected: float
) -> None:
    recipe = PLAIN.replace(
        "[sensor]", f'[channels.wind_direction]\ncolumn = "d"\nunit = "deg"\n{extra}\n[sensor]'
    )
    log = by_recipe(tmp_path, recipe, "t,v,d\n2026-05-01T12:00:00Z,2,90\n")
    assert np.degrees(log.series.channels["wind_direction"]) == pytest.approx([expected])


def test_missing_codes_are_missing_whatever_their_spelling(tmp_path: Path) -> None:
    recipe = PLAIN.replace("[time]", '[file]\nmissing = [-9999, "99.9", "ERR"]\n[time]')
    rows = ["-9999", "-9999.00", "99.9", "err", "3.5"]
    log = by_recipe(
        tmp_path,
        recipe,
        "t,v\n" + "".join(f"2026-05-01T12:00:0{i}Z,{v}\n" for i, v in enumerate(rows)),
    )
    assert [bool(f & SampleFlag.MISSING) for f in log.series.flags] == [
        True,
        True,
        True,
        True,
        False,
    ]


def test_a_range_is_in_the_files_unit(tmp_path: Path) -> None:
    recipe = PLAIN.replace('unit = "m/s"', 'unit = "km/h"\nrange = [0, 100]')
    log = by_recipe(tmp_path, recipe, "t,v\n2026-05-01T12:00:00Z,99\n2026-05-01T12:00:01Z,101\n")
    assert log.series.flags.tolist() == [0, SampleFlag.OUT_OF_RANGE]


def test_preamble_comments_blanks_and_numbered_columns(tmp_path: Path) -> None:
    recipe = """
name = "x"
about = "x"
source = "x"
[file]
delimiter = "space"
preamble = 2
header = 0
comment = "#"
[time]
columns = [1, 2]
format = "%d.%m.%y %H:%M:%S%f"
zone = "+01:00"
[channels.wind_speed]
column = 4
unit = "kt"
[sensor]
name = "x"
"""
    text = "logger 5\n\n01.05.26  12:00:00.5   270  10\n# pause\n01.05.26  12:00:01.5   270  20\n"
    log = by_recipe(tmp_path, recipe, text)
    assert [iso(t) for t in log.series.time] == [
        "2026-05-01T11:00:00.500Z",
        "2026-05-01T11:00:01.500Z",
    ]
    assert log.series.channels["wind_speed"] == pytest.approx([5.14444, 10.28889], abs=1e-5)


def test_the_users_zone_goes_before_the_recipes(tmp_path: Path) -> None:
    recipe = PLAIN.replace('format = "iso"', 'format = "iso"\nzone = "Europe/Amsterdam"')
    text = "t,v\n2026-07-01 12:00:00,2\n"
    assert iso(int(by_recipe(tmp_path, recipe, text).series.time[0])) == "2026-07-01T10:00:00Z"
    assert (
        iso(int(by_recipe(tmp_path, recipe, text, zone="UTC").series.time[0]))
        == "2026-07-01T12:00:00Z"
    )


def test_a_zero_offset_of_the_recipe_is_subtracted_and_reported(tmp_path: Path) -> None:
    recipe = PLAIN + "[quality]\nzero-offset = -0.35\n"
    log = by_recipe(
        tmp_path, recipe, "t,v\n2026-05-01T12:00:00Z,-0.35\n2026-05-01T12:00:01Z,4.65\n"
    )
    assert log.series.channels["wind_speed"] == pytest.approx([0.0, 5.0])
    assert [f.value for f in log.findings if f.kind == "zero-offset-given"] == [-0.35]


def test_sensor_facts_reach_the_series(tmp_path: Path) -> None:
    recipe = (
        PLAIN + "height = 3.5\ndistance-constant = 2.7\naveraging = 1\nthreshold = "
        "0.4\naccuracy-relative = 0.02\n"
    )
    sensor = by_recipe(tmp_path, recipe, "t,v\n2026-05-01T12:00:00Z,3\n").series.sensor
    assert (sensor.height, sensor.distance_constant, sensor.averaging, sensor.threshold) == (
        3.5,
        2.7,
        1.0,
        0.4,
    )
    assert (sensor.accuracy, sensor.accuracy_relative) == (None, 0.02)


def test_an_optional_column_may_be_absent(tmp_path: Path) -> None:
    recipe = PLAIN.replace(
        "[sensor]",
        '[channels.air_temperature]\ncolumn = "T"\nunit = "degC"\noptional = true\n[sensor]',
    )
    assert list(by_recipe(tmp_path, recipe, "t,v\n2026-05-01T12:00:00Z,3\n").series.channels) == [
        "wind_speed"
    ]
    with_it = by_recipe(tmp_path, recipe, "t,v,T\n2026-05-01T12:00:00Z,3,20\n")
    assert with_it.series.channels["air_temperature"] == pytest.approx([293.15])


def test_a_testo_style_export_is_identified_and_read() -> None:
    text = "Date;Time;m/s;°C\n01.05.2026;12:00:00;3,25;21,5\n01.05.2026;12:00:01;----;21,5\n"
    log = read(text, zone="+02:00")
    assert "testo-csv" in log.reasons[0]
    assert log.series.channels["wind_speed"][0] == 3.25
    assert log.series.flags.tolist() == [0, SampleFlag.MISSING]
    assert iso(int(log.series.time[0])) == "2026-05-01T10:00:00Z"


def test_a_skywatch_style_export_is_identified_and_read() -> None:
    text = (
        "Date,Time,Wind speed [km/h],Temperature "
        "[°C]\n2026-05-01,12:00:00,36.0,20\n2026-05-01,12:00:01,18.0,20\n"
    )
    log = read(text, zone="UTC")
    assert "skywatch-csv" in log.reasons[0]
    assert log.series.channels["wind_speed"] == pytest.approx([10.0, 5.0])


@pytest.mark.parametrize("encoding", ["utf-16", "utf-8-sig", "utf-32"])
def test_a_byte_order_mark_settles_the_encoding(
    log_file: Callable[[bytes], Path], encoding: str
) -> None:
    log = read_log(log_file("time,wind_speed [m/s]\n2026-05-01T12:00:00Z,3.25\n".encode(encoding)))
    assert log.series.channels["wind_speed"].tolist() == [3.25]
    assert log.findings == ()


def test_line_ends_of_any_kind_count_lines_alike() -> None:
    rows = [
        "time,wind_speed",
        "2026-05-01T12:00:00Z,3",
        "2026-05-01T12:00:01Z,x",
        "2026-05-01T12:00:02Z,4",
    ]
    for end in ("\n", "\r\n", "\r"):
        assert [f.where for f in read(end.join([*rows, ""])).findings] == ["line 3"]


GILL = "laptop_time,raw_line\n" + "".join(
    f'2026-05-01T12:00:0{i}.25,"\x02Q,229,{speed},{unit},{status},\x0316"\n'
    for i, (speed, unit, status) in enumerate(
        [
            ("002.74", "M", "00"),
            ("003.00", "M", "00"),
            ("003.10", "M", "04"),
            ("005.83", "N", "00"),
            ("002.50", "M", "00"),
        ]
    )
)


def test_a_sonics_own_status_and_unit_decide_what_is_used() -> None:
    log = read(GILL, zone="UTC")
    assert "gill-windsonic" in log.reasons[2]
    assert log.series.channels["wind_speed"][:2].tolist() == [2.74, 3.0]
    assert np.degrees(log.series.channels["wind_direction"]) == pytest.approx([229] * 5)
    fault = SampleFlag.SENSOR_FAULT
    assert log.series.flags.tolist() == [0, 0, fault, fault, 0]
    assert sorted((f.count, f.where) for f in log.findings if f.kind == "sensor-fault") == [
        (1, "line 4"),
        (1, "line 5"),
    ]


def test_a_checked_column_of_a_table_flags_the_rows_it_rejects(tmp_path: Path) -> None:
    recipe = PLAIN + '[[check]]\ncolumn = "ok"\nvalues = ["A"]\nabout = "status"\n'
    log = by_recipe(
        tmp_path, recipe, "t,v,ok\n2026-05-01T12:00:00Z,3,A\n2026-05-01T12:00:01Z,4,V\n"
    )
    assert log.series.flags.tolist() == [0, SampleFlag.SENSOR_FAULT]


def test_a_log_that_lists_the_newest_row_first_is_read_from_its_end(tmp_path: Path) -> None:
    # backwards through the hour that occurs twice: 03:00 CET, 02:59 … 02:00 CET, 02:59 … 02:00
    # CEST, 01:59 CEST
    hour = [f"2026-10-25 02:{m:02d}:00" for m in range(59, -1, -1)]
    walls = ["2026-10-25 03:00:00", *hour, *hour, "2026-10-25 01:59:00"]
    text = "t,v\n" + "".join(f"{w},{i}\n" for i, w in enumerate(walls))
    log = by_recipe(tmp_path, PLAIN, text, zone="Europe/Amsterdam")
    assert log.series.channels["wind_speed"].tolist() == list(range(121, -1, -1))
    assert set(np.diff(log.series.time)) == {60 * 10**9}
    assert iso(int(log.series.time[0])) == "2026-10-24T23:59:00Z"
    assert "newest-first" in {f.kind for f in log.findings}


BAD: list[tuple[str, str, str, str]] = [
    ("key", 'name = "mine"', 'nmae = "mine"', "did you mean 'name'"),
    ("table", "[sensor]", "[sensors]", "did you mean 'sensor'"),
    ("file-key", "[time]", '[file]\ndelimeter = ","\n[time]', "did you mean 'delimiter'"),
    ("channel", "wind_speed]", "wind_sped]", "did you mean 'wind_speed'"),
    ("channel-key", 'unit = "m/s"', 'unit = "m/s"\ngian = 2', "did you mean 'gain'"),
    ("unit", '"m/s"', '"m/hour"', "unknown unit"),
    ("unit-of-another-quantity", '"m/s"', '"degC"', "measured in m/s"),
    ("zone", 'format = "iso"', 'format = "iso"\nzone = "Europe/Amsterdm"', "Europe/Amsterdam"),
    ("no-name", 'name = "mine"\nabout', "about", "the key name is missing"),
    ("no-sensor", '[sensor]\nname = "mine"', "", "the key name is missing"),
    ("no-channels", '[channels.wind_speed]\ncolumn = "v"\nunit = "m/s"', "", "no channels"),
    ("no-column", 'column = "v"\n', "", "the key column is missing"),
    ("column-zero", 'column = "v"', "column = 0", "a whole number of at least 1"),
    ("column-a-list", 'column = "v"', "column = []", "text in quotes or a whole number"),
    ("no-time-column", 'columns = ["t"]\n', "", "no time column"),
    ("gain-zero", 'unit = "m/s"', 'unit = "m/s"\ngain = 0', "gain is 0"),
    ("gain-text", 'unit = "m/s"', 'unit = "m/s"\ngain = "2"', "a finite number"),
    ("gain-nan", 'unit = "m/s"', 'unit = "m/s"\ngain = nan', "not finite"),
    ("range-empty", 'unit = "m/s"', 'unit = "m/s"\nrange = [5, 1]', "range"),
    ("range-of-three", 'unit = "m/s"', 'unit = "m/s"\nrange = [5, 1, 2]', "range is [5, 1, 2]"),
    ("convention", 'unit = "m/s"', 'unit = "m/s"\nconvention = "towards"', "convention"),
    ("delimiter", "[time]", '[file]\ndelimiter = "::"\n[time]', "delimiter"),
    ("decimal-is-delimiter", "[time]", '[file]\ndecimal = ","\n[time]', "also the delimiter"),
    ("header-negative", "[time]", "[file]\nheader = -1\n[time]", "header"),
    ("header-text", "[time]", '[file]\nheader = "one"\n[time]', "a whole number"),
    ("names-without-header", "[time]", "[file]\nheader = 0\n[time]", "no header names"),
    ("accuracy-negative", 'name = "mine"\n', 'name = "mine"\naccuracy = -1\n', "accuracy"),
    ("stale-after-zero", "[sensor]", "[quality]\nstale-after = 0\n[sensor]", "stale-after"),
    (
        "zero-offset-word",
        "[sensor]",
        '[quality]\nzero-offset = "guess"\n[sensor]',
        "zero-offset is",
    ),
    (
        "frame-rate-of-unknown",
        "[sensor]",
        '[quality]\nframe-rate-of = ["fluter"]\n[sensor]',
        "unknown channel",
    ),
    (
        "check-without-values",
        "[sensor]",
        '[[check]]\ncolumn = 2\nabout = "x"\n[sensor]',
        "the key values is missing",
    ),
    (
        "check-without-column",
        "[sensor]",
        '[[check]]\nvalues = ["A"]\nabout = "x"\n[sensor]',
        "the key column is missing",
    ),
    ("check-key", "[sensor]", "[[check]]\ncolum = 2\n[sensor]", "did you mean 'column'"),
    ("check-no-table", 'name = "mine"', 'check = [1]\nname = "mine"', "not a table"),
    ("not-toml", "[time]", "[time", "not TOML"),
    ("directive", '"iso"', '"%Y-%m-%d %W"', "directive %W is unknown"),
]


@pytest.mark.parametrize(("old", "new", "says"), [b[1:] for b in BAD], ids=[b[0] for b in BAD])
def test_a_wrong_recipe_is_refused_with_its_place(
    tmp_path: Path, old: str, new: str, says: str
) -> None:
    at = PLAIN.rindex(old) if old == 'name = "mine"\n' else PLAIN.index(old)
    recipe = PLAIN[:at] + new + PLAIN[at + len(old) :]
    with pytest.raises(FlagdataError) as caught:
        by_recipe(tmp_path, recipe, "t,v\n2026-05-01T12:00:00Z,3\n")
    assert says in str(caught.value)
    assert caught.value.fix
    assert isinstance(caught.value, (InputError, UnknownNameError))


def test_units_of_the_table_all_have_a_channel_or_are_known() -> None:
    assert {c.unit for c in CHANNELS.values()} <= {u.si for u in UNITS.values()}
