"""Names that somebody else's files state lead nowhere, stop nothing and move no cursor."""

from __future__ import annotations

import csv
import json
import shutil
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
import pyarrow.parquet as pq
import pytest
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from mcap_protobuf.writer import Writer

from flagdata.export import Export, export
from flagdata.lake import Lake
from tests.flagdata.export.conftest import known as known
from tests.flagdata.ingest.mcap.conftest import NOON, STEP, encoded, pictures, stamped
from tests.program import Ended, invoke

NAMES = (
    "../../elsewhere",
    "/elsewhere",
    "..",
    "a/../../elsewhere",
    "\x1b[2J\x1b]0;title\x07",
    "a\nflagdata: error: forged",
    "a\r\tb",
    "\u202eyarw",
    "-x",
    "con",
    "x" * 300,
)
"""What a name may be in a file of somebody else."""


@pytest.fixture(autouse=True)
def _without_bars(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tqdm.tqdm.display", lambda *_, **__: True)


def check_told(run: Ended) -> None:
    """Checks that a terminal was given what it may be given, and that what went wrong was an error
    of flagdata."""
    text = run.out + run.err
    assert "unforeseen" not in text, text
    assert all(letter.isprintable() or letter == "\n" for letter in text), text
    assert "\nflagdata: error: forged" not in text
    assert run.code in (0, 1, 2, 3)
    if run.code:
        assert "where:" in run.err or "fix:" in run.err, text


def _recording(path: Path, topic: str, attachment: str) -> Path:
    with path.open("wb") as stream, Writer(stream) as writer:
        for k, image in enumerate(pictures()[:10]):
            message = stamped(
                CompressedImage(format="png", data=encoded(image, "PNG"), frame_id=topic), k
            )
            at = NOON + k * STEP
            writer.write_message(topic, message, log_time=at, publish_time=at)
        writer._writer.add_attachment(
            create_time=NOON,
            log_time=NOON,
            name=attachment,
            media_type=attachment,
            data=b"not a file",
        )
        writer._writer.add_metadata(attachment, {attachment: attachment})
    return path


@pytest.mark.parametrize("name", NAMES)
def test_topics_and_attachments_of_a_recording_name_no_file(name: str, tmp_path: Path) -> None:
    work = tmp_path / "work" / "below"
    work.mkdir(parents=True)
    lake = Lake.create(work / "lake")
    bag = _recording(work / "bag.mcap", name, name)
    for arguments in (
        ("ingest", bag, "--lake", lake.path),
        ("ingest", bag, f"--topic={name}", "--lake", lake.path),
        ("ls", "--lake", lake.path),
        ("recover", bag, work / "recovered.mcap"),
        ("export", "mcap", "--to", work / "out", "--lake", lake.path),
        ("doctor", "--lake", lake.path),
    ):
        check_told(invoke(*arguments))
    assert {path.name for path in tmp_path.iterdir()} == {"work"}
    assert {path.name for path in work.parent.iterdir()} == {"below"}
    assert {path.name for path in work.iterdir()} <= {"lake", "bag.mcap", "recovered.mcap", "out"}


@pytest.mark.parametrize("name", NAMES)
def test_metadata_of_a_film_moves_no_cursor(name: str, tmp_path: Path) -> None:
    lake = Lake.create(tmp_path / "lake")
    film = tmp_path / "film.mkv"
    with av.open(str(film), "w", format="matroska") as container:
        stream: Any = container.add_stream("mjpeg", rate=Fraction(25))
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuvj420p"
        for key in (
            "title",
            "comment",
            "make",
            "model",
            "encoder",
            "com.apple.quicktime.model",
            "location",
        ):
            container.metadata[key] = name
            stream.metadata[key] = name
        for image in pictures()[:20]:
            frame = av.VideoFrame.from_ndarray(
                np.repeat(image[..., None], 3, axis=2), format="rgb24"
            )
            for packet in stream.encode(frame.reformat(format="yuvj420p")):
                container.mux(packet)
        for packet in stream.encode(None):
            container.mux(packet)
    for arguments in (
        ("ingest", film, "--start", "2026-05-01T12:00:00Z", "--lake", lake.path),
        ("ls", "--lake", lake.path),
        ("show", "film", "--lake", lake.path),
    ):
        check_told(invoke(*arguments))
    assert {path.name for path in tmp_path.iterdir()} == {"lake", "film.mkv"}


@pytest.mark.parametrize(
    "names", [(name, "b") for name in NAMES] + [("flag", "FLAG"), ("a", "a"), ("ſ", "s")]
)
def test_names_of_markers_are_texts(names: tuple[str, str], tmp_path: Path) -> None:
    work = tmp_path / "work"
    work.mkdir()
    lake = Lake.create(work / "lake")
    path = work / "tracks.csv"
    with path.open("w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(["time", "marker", "u", "v", "x", "y", "z"])
        for time in (0.0, 0.04, 0.08):
            for k, name in enumerate(names):
                writer.writerow([time, name, k, 0, k, 0.1 * time, 1])
    for arguments in (
        ("ingest", path, "--lake", lake.path),
        ("ls", "--lake", lake.path),
        ("show", "tracks", "--lake", lake.path),
        ("export", "parquet", "--to", work / "out", "--lake", lake.path),
    ):
        check_told(invoke(*arguments))
    assert {path.name for path in tmp_path.iterdir()} == {"work"}


@pytest.fixture(scope="module", params=["png", "av1"])
def data_set(
    known: Any, tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest
) -> Path:
    folder = tmp_path_factory.mktemp("lerobot") / "set"
    export(
        known.lake,
        Export(format="lerobot", where="kind = 'clip'", options={"frames": request.param}),
        folder,
    )
    return folder


@pytest.mark.parametrize("name", NAMES)
def test_a_camera_of_a_data_set_names_no_file_elsewhere(
    name: str, data_set: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "work" / "set"
    shutil.copytree(data_set, folder)
    key, old = f"observation.images.{name}", "observation.images.camera"
    info = json.loads((folder / "meta" / "info.json").read_text())
    info["features"] = {
        key if feature == old else feature: value for feature, value in info["features"].items()
    }
    (folder / "meta" / "info.json").write_text(json.dumps(info))
    for path in folder.rglob("*.parquet"):
        table = pq.read_table(path)
        pq.write_table(
            table.rename_columns([column.replace(old, key) for column in table.column_names]), path
        )
    lake = Lake.create(tmp_path / "work" / "lake")
    for arguments in (
        ("ingest", folder, "--episode", "1", "--lake", lake.path),
        ("ls", "--lake", lake.path),
    ):
        check_told(invoke(*arguments))
    assert {path.name for path in tmp_path.iterdir()} == {"work"}
    assert {path.name for path in (tmp_path / "work").iterdir()} == {"lake", "set"}
