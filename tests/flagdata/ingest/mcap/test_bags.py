"""A bag's folder is one recording; bags of other kinds are refused by name, with what leads to one
that is read."""

from __future__ import annotations

import gzip
import shutil
import sqlite3
import subprocess
from pathlib import Path

import numpy as np
import pytest
import zstandard
from click.testing import CliRunner

from flagdata.cli import root
from flagdata.errors import FlagdataError, InputError, UsageError
from flagdata.ingest import (
    CameraIngest,
    CameraOptions,
    WindOptions,
    classify,
    examine,
    ingest_camera,
    open_camera,
    read_log,
)
from flagdata.lake import Lake
from tests.flagdata.ingest.mcap.conftest import NOON
from tests.flagdata.ingest.mcap.ros import WIND, bag, channel, film, wind
from tests.flagdata.ingest.mcap.test_mcap_layout import COLUMNS, grays

NAMED = (
    "rosbag2_bagfile_information:\n  version: 8\n  storage_identifier: mcap\n  "
    "relative_file_paths:\n"
)


def recorded(folder: Path, parts: int = 12, *, described: bool = True) -> Path:
    """A bag of pictures, five a part, whose parts are numbered without zeros."""
    folder.mkdir()
    for part in range(parts):
        film(folder / f"bag_{part}.mcap", range(part * 5, part * 5 + 5))
    if described:
        (folder / "metadata.yaml").write_text(
            NAMED + "".join(f"    - bag_{k}.mcap\n" for k in range(parts))
        )
    return folder


@pytest.mark.parametrize("described", [True, False])
def test_the_folder_of_a_bag_is_read_as_one_recording(
    tmp_path: Path, lake: Lake, described: bool
) -> None:
    folder = recorded(tmp_path / "bag", described=described)
    (folder / "._bag_0.mcap").write_bytes(b"\0\5\x16\7 beside")
    assert classify(folder).kind == "camera"
    found, kinds = grays(folder)
    assert found == list(range(60))
    assert "chapters-joined" in kinds
    assert [stream.count for stream in examine(folder).streams] == [60]
    options = CameraIngest(camera=CameraOptions(rate="native", size=64))
    assert ingest_camera(lake, folder, options).artifact.frame_count == 60
    assert not ingest_camera(lake, folder, options).created


def test_the_readings_of_a_bag_in_parts_are_one_log(tmp_path: Path) -> None:
    folder = tmp_path / "bag"
    folder.mkdir()
    for part in range(11):
        with bag(folder / f"bag_{part}.mcap") as writer:
            mast = channel(writer, "/mast", "my/msg/Wind", WIND)
            for k in range(part * 5, part * 5 + 5):
                at = NOON + k * 10**9
                writer.add_message(mast, at, wind(at, 3 + k % 7 / 10), at)
    series = read_log(folder, WindOptions(columns=COLUMNS)).series
    np.testing.assert_array_equal(series.time, NOON + 10**9 * np.arange(55))
    np.testing.assert_allclose(series.channels["wind_speed"], [3 + k % 7 / 10 for k in range(55)])


def test_a_part_that_is_missing_is_named(tmp_path: Path) -> None:
    folder = recorded(tmp_path / "bag", parts=3)
    (folder / "bag_1.mcap").unlink()
    with pytest.raises(InputError, match=r"bag_1\.mcap, which is not there"):
        grays(folder)
    (folder / "metadata.yaml").unlink()  # as the fix says
    assert grays(folder)[0] == [0, 1, 2, 3, 4, 10, 11, 12, 13, 14]


def test_files_of_a_folder_that_were_recorded_at_the_same_time_are_not_joined(
    tmp_path: Path,
) -> None:
    folder = tmp_path / "bag"
    folder.mkdir()
    film(folder / "left.mcap", range(0, 140, 2))
    film(folder / "right.mcap", range(1, 140, 2))
    with pytest.raises(InputError, match="not successive parts"):
        grays(folder)


def test_files_to_join_are_refused_with_the_commands_that_make_them_one(
    tmp_path: Path, lake: Lake
) -> None:
    folder = recorded(tmp_path / "bag")
    run = CliRunner()
    parts = [str(folder / f"bag_{k}.mcap") for k in range(12)]
    done = run.invoke(root, ["ingest", *parts, "--join", "--lake", str(lake.path)])
    assert isinstance(done.exception, UsageError)
    assert f"flagdata ingest {folder}" in done.exception.fix
    assert (
        run.invoke(
            root, ["ingest", str(folder), "--rate", "native", "--lake", str(lake.path)]
        ).exit_code
        == 0
    )
    assert [row["frame_count"] for row in lake.rows().to_pylist()] == [60]
    (folder / "metadata.yaml").unlink()
    with pytest.raises(UsageError) as raised:
        open_camera(Path(parts[0]), CameraOptions(chapters=tuple(map(Path, parts[1:]))))
    make = raised.value.fix.partition(": ")[2].partition("; flagdata")[0]
    subprocess.run(make, shell=True, check=True, cwd=tmp_path)
    assert grays(tmp_path / "whole")[0] == list(range(60))


@pytest.mark.parametrize("order", [("film", "log"), ("log", "film"), ("log", "log2")])
def test_what_is_no_film_is_not_joined(
    video: Path, tmp_path: Path, lake: Lake, order: tuple[str, str]
) -> None:
    rows = "".join(f"2026-05-01T12:00:{k:02d}Z,{3 + k % 7 / 10}\n" for k in range(60))
    paths = {
        "film": shutil.copy(video, tmp_path / "a.mp4"),
        "log": tmp_path / "b.csv",
        "log2": tmp_path / "c.csv",
    }
    for name in ("log", "log2"):
        Path(paths[name]).write_text("time,wind_speed (m/s)\n" + rows)
    done = CliRunner().invoke(
        root, ["ingest", *(str(paths[one]) for one in order), "--join", "--lake", str(lake.path)]
    )
    assert isinstance(done.exception, UsageError)
    assert "a wind log cannot be joined" in done.exception.what
    assert lake.rows().num_rows == 0


def sqlite_bag(path: Path) -> Path:
    with sqlite3.connect(path) as base:
        base.execute(
            "create table topics(id integer primary key, name text, type text, "
            "serialization_format text)"
        )
        base.execute(
            "create table messages(id integer primary key, topic_id integer, timestamp integer, "
            "data blob)"
        )
    base.close()
    return path


def test_bags_of_other_kinds_are_refused_by_name(tmp_path: Path) -> None:
    other = tmp_path / "a.bag"
    other.write_bytes(b"#ROSBAG V2.0\n" + bytes(4000))
    for path, what, fix in (
        (sqlite_bag(tmp_path / "a.db3"), "SQLite", "mcap convert {folder}/a.db3 {folder}/a.mcap"),
        (other, "ROS 1", "mcap convert {folder}/a.bag {folder}/a.mcap"),
    ):
        for look in (classify, examine):
            with pytest.raises(FlagdataError, match=what) as raised:
                look(path)
            assert fix.format(folder=tmp_path) in raised.value.fix
    folder = tmp_path / "bag"
    folder.mkdir()
    sqlite_bag(folder / "bag_0.db3")
    (folder / "metadata.yaml").write_text(NAMED.replace("mcap", "sqlite3") + "    - bag_0.db3\n")
    with pytest.raises(InputError, match="SQLite"):
        classify(folder)


@pytest.mark.parametrize("ending", ["mcap.zstd", "mcap.zst", "mcap.gz"])
def test_a_bag_that_was_compressed_as_a_whole_is_read_once_it_is_unpacked_as_the_fix_says(
    tmp_path: Path, ending: str
) -> None:
    data = film(tmp_path / "a.mcap", range(5)).read_bytes()
    path = tmp_path / f"b.{ending}"
    path.write_bytes(gzip.compress(data) if ending.endswith("gz") else zstandard.compress(data))
    with pytest.raises(InputError, match="compressed as a whole") as raised:
        classify(path)
    command = raised.value.fix.partition(": ")[2].partition(";")[0]
    if shutil.which(command.split()[0]) is None:
        pytest.skip(f"there is no {command.split()[0]} here")
    subprocess.run(command, shell=True, check=True, cwd=tmp_path)
    assert grays(tmp_path / "b.mcap")[0] == list(range(5))


def test_messages_that_were_compressed_one_by_one_are_named(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with bag(path) as writer:
        mast = channel(writer, "/mast", "my/msg/Wind", WIND)
        writer.add_message(mast, NOON, zstandard.compress(wind(NOON, 3.0)), NOON)
    (finding,) = [one for one in examine(path).findings if one.kind == "topic-unread"]
    assert "compressed one by one" in finding.what
