"""`flagdata calibrate`: what it refuses, prints and keeps."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from click.testing import CliRunner, Result
from pyarrow import csv

from flagdata.core.schema import Kind
from flagdata.errors import InputError, RefusedError
from flagdata.lake import Artifact, Lake
from flagdata.record import RecordWriter
from flagdata.record.signals import Sensor, WindSeries
from flagdata.timebase import NANOSECONDS
from measure.cloth import of_table
from measure.commands.calibrate import calibrate
from measure.film import FlagSize
from tests.golden_answers import changes
from tests.measure.cloth.calibration.conftest import readings


def _table(
    path: Path, *, windows: int = 48, heading: str | None = None, weight: float = 0.2, seed: int = 3
) -> Path:
    speed = 5.0 + 1.5 * np.sin(np.arange(windows) / 1.7)
    values = {
        "area_weight": np.array([weight]),
        "gain": np.array([1.0]),
        "damping": np.array([0.01]),
        "azimuth": np.array([math.radians(70)]),
    }
    own = readings(values, speed, seed=seed)[0, :, :3]
    names = heading or "time,wind,droop,extension,middle-speed"
    rows = [
        f"{2.5 * number},{u},{','.join(map(str, row))}"
        for number, (u, row) in enumerate(zip(speed.tolist(), own.tolist(), strict=True))
    ]
    path.write_text("\n".join([names, *rows]) + "\n")
    return path


def _run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(calibrate, [str(one) for one in arguments])


@pytest.mark.usefixtures("cheap")
def test_a_table_is_weighed_kept_and_shown(tmp_path: Path) -> None:
    lake, page = tmp_path / "lake", tmp_path / "page.html"
    Lake.create(lake)
    table = _table(tmp_path / "monday.csv")
    given = (
        table,
        "--flag-size",
        "1.5x1.0",
        "--azimuth",
        "70±7",
        "--lake",
        lake,
        "--report",
        page,
        "--json",
    )
    done = _run(*given)
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert found["schema"] == "flagdata.calibrate/1"
    assert changes("calibrate", found, relative=1e-5) == []
    assert found["cloth"]["area_weight"]["value"] == pytest.approx(0.2, rel=0.08)
    assert found["recordings"][0]["observables"] == ["droop", "extension", "middle-speed"]
    row = Lake.open(lake).artifact(found["artifact"])
    assert row.kind == "measurement"
    assert json.loads(str(row.parameters))["area_weight"] == found["cloth"]["area_weight"]["value"]
    text = page.read_text()
    assert "area weight" in text
    assert found["area_weight_stated"] in text
    assert "70 ± 8.6°" in text  # with the 5° to which a logged direction is lined up
    assert "monday, from 0 s on" in text
    again = _run(*given[:-2], tmp_path / "other.html", "--json")
    assert json.loads(again.stdout)["artifact"] == found["artifact"]
    assert len(Lake.open(lake).rows({"kind": "measurement"})) == 1


@pytest.mark.usefixtures("cheap")
def test_a_weight_that_is_withheld_is_exit_code_3_and_no_option(tmp_path: Path) -> None:
    rows = [line.split(",") for line in _table(tmp_path / "t.csv").read_text().splitlines()]
    strange = [",".join([*rows[0], "area"]), *(",".join([*row, "3.0"]) for row in rows[1:])]
    (tmp_path / "t.csv").write_text("\n".join(strange) + "\n")
    done = _run(tmp_path / "t.csv", "--flag-size", "1.5x1.0", "--azimuth", "70±7")
    assert done.exit_code == 3
    assert done.stdout.startswith(
        "area weight: withheld, since no simulated flag looks like t: area"
    )
    assert "--area-weight" not in done.output


@pytest.mark.usefixtures("cheap")
def test_a_cloth_lighter_than_any_of_the_prior_is_bounded_and_no_option_is_given(
    tmp_path: Path,
) -> None:
    page = tmp_path / "page.html"
    table = _table(tmp_path / "t.csv", weight=0.045)
    done = _run(table, "--flag-size", "1.5x1.0", "--azimuth", "70±7", "--report", page)
    assert done.exit_code == 0, done.output
    assert done.stdout.startswith("area weight at most 0.0")
    assert "only a bound is given" in done.stderr
    assert "--area-weight" not in done.output + page.read_text()


@pytest.mark.usefixtures("cheap")
def test_a_weight_that_is_not_determined_is_exit_code_3(tmp_path: Path) -> None:
    """Of what is shown only the damping and the view remain."""
    table = _table(tmp_path / "t.csv", heading="time,wind,bandwidth,extension,middle-speed")
    rows = [line.split(",") for line in table.read_text().splitlines()]
    table.write_text("\n".join(",".join([*row[:2], *row[3:]]) for row in rows) + "\n")
    done = _run(table, "--flag-size", "1.5x1.0", "--azimuth", "70±7")
    assert done.stdout.startswith("area weight: not determined by 48 windows")
    assert done.exit_code == 3
    assert "--area-weight" not in done.output


@pytest.mark.usefixtures("cheap")
def test_one_bad_recording_of_three_is_left_out_with_a_warning_that_names_it(
    tmp_path: Path,
) -> None:
    page = tmp_path / "page.html"
    (tmp_path / "hidden.csv").write_text(
        "\n".join(["time,wind,droop", *(f"{2.5 * number},5.0," for number in range(20))]) + "\n"
    )
    good = [
        _table(tmp_path / f"{name}.csv", seed=seed)
        for seed, name in ((3, "monday"), (4, "tuesday"))
    ]
    given = (tmp_path / "hidden.csv", *good, "--flag-size", "1.5x1.0", "--azimuth", "70±7")
    done = _run(*given, "--json", "--report", page)
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert [one["name"] for one in found["recordings"]] == ["monday", "tuesday"]
    assert found["cloth"]["area_weight"]["value"] == pytest.approx(0.2, rel=0.08)
    (left,) = [one for one in found["findings"] if one["kind"] == "left-out"]
    assert left["what"].startswith(
        f"{tmp_path}/hidden.csv is left out: no observable could be read in 60%"
    )
    assert "hidden.csv is left out: no observable could be read" in page.read_text()


def test_of_three_bad_recordings_no_weight_is_given_and_each_is_named(tmp_path: Path) -> None:
    paths = [tmp_path / f"{name}.csv" for name in ("monday", "tuesday", "wednesday")]
    for path in paths:
        path.write_text(
            "\n".join(["time,wind,droop", *(f"{2.5 * number},5.0," for number in range(20))]) + "\n"
        )
    done = _run(*paths, "--flag-size", "1.5x1.0")
    assert isinstance(done.exception, RefusedError)
    assert done.exception.exit_code == 3
    assert done.exception.what.startswith("none of 3 recordings can be used: ")
    assert all(f"{path}: no observable could be read" in done.exception.what for path in paths)


def test_recordings_that_are_together_too_short_are_refused_before_anything_is_read(
    tmp_path: Path,
) -> None:
    done = _run(_table(tmp_path / "t.csv", windows=6), "--flag-size", "1.5x1.0")
    assert isinstance(done.exception, InputError)
    assert done.exception.what == "only 15 s of film have a log beside them"
    assert "give 20 s or more in all" in done.exception.fix


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "the flag's size is missing"),
        (("--flag-size", "1.5x1.0", "--azimuth", "190"), "give degrees from 1 to 179"),
        (("--flag-size", "1.5x1.0", "--crop", "0,0,9,9"), "a table of observables has no pictures"),
        (("--flag-size", "1.5x1.0", "--start", "110s"), "10 s of film have a log beside them"),
    ],
)
@pytest.mark.usefixtures("cheap")
def test_what_cannot_be_calibrated_is_refused_and_nothing_is_written(
    tmp_path: Path, arguments: tuple[str, ...], said: str
) -> None:
    page = tmp_path / "page.html"
    done = _run(_table(tmp_path / "t.csv"), *arguments, "--report", page)
    assert done.exit_code != 0
    assert said in f"{done.exception} {done.output}"
    assert not page.exists()


@pytest.mark.parametrize(
    ("heading", "said"),
    [
        ("time,wind,droop,extension,colour", "columns colour are not known"),
        ("time,area,droop,extension,middle-speed", "no column wind"),
    ],
)
def test_a_table_of_other_columns_is_refused(tmp_path: Path, heading: str, said: str) -> None:
    done = _run(_table(tmp_path / "t.csv", heading=heading), "--flag-size", "1.5x1.0")
    assert said in f"{done.exception}"


def test_parquet_with_reasons_is_read_as_the_text(tmp_path: Path) -> None:
    (text,) = of_table(_table(tmp_path / "t.csv"), FlagSize(length=1.5, height=1.0))
    table = csv.read_csv(tmp_path / "t.csv")
    table = table.append_column("droop-reason", pa.array([None] * len(table), pa.string()))
    table = table.append_column("droop-sigma", pa.array([0.03] * len(table)))
    pq.write_table(table, tmp_path / "t.parquet")
    (found,) = of_table(tmp_path / "t.parquet", FlagSize(length=1.5, height=1.0))
    assert found.sigma.tolist() == [0.03] + [0.0] * 7
    assert np.array_equal(found.readings, text.readings, equal_nan=True)
    assert np.array_equal(found.log.speed, text.log.speed)


def test_a_table_without_a_flag_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    rows = [f"{2.5 * number},5.0," for number in range(20)]
    path.write_text("\n".join(["time,wind,droop", *rows]) + "\n")
    done = _run(path, "--flag-size", "1.5x1.0")
    assert "no observable could be read" in f"{done.exception}"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--log", "cup"), "name the lake that it was ingested into"),
        (("--clock-offset", "1±0.1"), "an offset needs a log"),
        (("--end", "30s"), "rows against wind have no times"),
    ],
)
def test_options_that_a_table_has_no_use_for_are_refused(
    tmp_path: Path, arguments: tuple[str, ...], said: str
) -> None:
    path = tmp_path / "t.csv"
    path.write_text("wind,duration,droop\n5.0,60,0.3\n")
    done = _run(path, "--flag-size", "1.5x1.0", *arguments)
    assert said in f"{done.exception}"


@pytest.mark.usefixtures("cheap")
def test_a_table_beside_a_log_of_the_lake_is_weighed_and_the_log_is_its_parent(
    tmp_path: Path,
) -> None:
    seconds = np.arange(-30, 160, dtype=np.int64)
    series = WindSeries(
        time=(1_780_000_000 + seconds) * NANOSECONDS,
        flags=np.zeros(len(seconds), dtype=np.uint16),
        channels={"wind_speed": 5.0 + 1.5 * np.sin(seconds / 4.0)},
        sensor=Sensor(name="cup", distance_constant=0.0),
    )
    lake = Lake.create(tmp_path / "lake")
    with lake.transaction("a log") as transaction:
        staged = transaction.staging(".mcap")
        with RecordWriter(staged, metadata={}) as writer:
            writer.wind(series)
        log = Artifact(
            kind=Kind.WIND, name="cup", object=transaction.put(staged), recipe={"of": "log"}
        )
        transaction.add(log)
    path = _table(tmp_path / "t.csv")
    rows = [line.split(",") for line in path.read_text().splitlines()]
    without = [
        [rows[0][0], *rows[0][2:]],
        *([str(1_780_000_000 + float(row[0])), *row[2:]] for row in rows[1:]),
    ]
    path.write_text("\n".join(",".join(row) for row in without) + "\n")
    given = (
        path,
        "--flag-size",
        "1.5x1.0",
        "--lake",
        tmp_path / "lake",
        "--log",
        log.id,
        "--clock-offset",
        "2.5±0.1",
    )
    done = _run(*given, "--json")
    assert done.exit_code == 3, (
        done.output
    )  # the table's droop follows another wind than this log's
    found = json.loads(done.stdout)
    assert "the change of droop with the wind" in found["withheld"]
    assert list(Lake.open(tmp_path / "lake").artifact(found["artifact"]).parents) == [log.id]
    assert "+2.500 ± 0.100 s" in found["recordings"][0]["source"]
