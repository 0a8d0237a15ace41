"""A bit that was flipped in a stored record is never copied into a new artifact, whose own hash
would call it sound."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from flagdata.align import ClockOptions, Method, Pair, make_recording
from flagdata.align.methods import declared_clock
from flagdata.core.files.checksums import content_hash
from flagdata.core.rng import stream
from flagdata.core.schema import TOPIC_IMAGE, TOPIC_WIND, Kind
from flagdata.errors import CorruptError, FlagdataError
from flagdata.lake import Artifact, Lake
from flagdata.record import Record, RecordWriter, open_bytes, read_messages, read_summary
from flagdata.record.signals import Sensor, WindSeries

SECOND = 1_000_000_000
START = 1_780_000_000 * SECOND
FRAMES = 31
FLIPS = 20
COMPAT = Path(__file__).parents[2] / "compat"


@dataclass(frozen=True, kw_only=True)
class Kept:
    """A lake with a camera and a wind artifact, and the object that aligning them makes."""

    folder: Path
    camera: str
    wind: str
    expected: str


def align(folder: Path, camera: str, wind: str) -> str:
    """The object of the recording that the two make."""
    lake = Lake.open(folder)
    pair = Pair.of(lake, camera, wind)
    options = ClockOptions(by=Method.GIVEN, offset=1.0, offset_sigma=0.1)
    outcome = declared_clock(pair, options, recipe=options.recipe())
    return str(make_recording(lake, pair, outcome.alignment).recording.object)


def outcome(folder: Path, kept: Kept) -> tuple[str | None, str]:
    """The object of the recording, or `None` and where the error that refused it lies."""
    try:
        return align(folder, kept.camera, kept.wind), ""
    except FlagdataError as error:
        return None, str(error.where)


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Kept:
    folder = tmp_path_factory.mktemp("lake") / "lake"
    lake = Lake.create(folder)
    pictures = stream(3, "pictures").integers(0, 256, (FRAMES, 24, 32), dtype=np.uint8)
    with lake.transaction("scene") as transaction:
        path = transaction.staging(".mcap")
        with RecordWriter(
            path, metadata={"camera": {"codec": "made", "exposure": "0.01"}}
        ) as record:
            for k, image in enumerate(pictures):
                time = START + k * SECOND // 10
                record.frame(
                    log_time=time, publish_time=time, timestamp=time + 5_000_000, image=image
                )
        camera = Artifact(
            kind=Kind.CAMERA, name="cam", object=transaction.put(path), source_hash="a" * 64
        )
        transaction.add(camera)
        path = transaction.staging(".mcap")
        count = 300
        series = WindSeries(
            time=START + (np.arange(count, dtype=np.int64) - 100) * SECOND // 10,
            channels={
                "wind_speed": 5 + np.sin(np.arange(count) / 7),
                "wind_direction": np.full(count, 1.5),
            },
            flags=np.zeros(count, dtype=np.uint16),
            sensor=Sensor(name="sonic", height=2.0, accuracy=0.1),
        )
        with RecordWriter(path, metadata={}) as record:
            record.wind(series)
            record.attach("log.csv", b"speed\n5.0\n", media_type="text/csv", log_time=START)
        wind = Artifact(
            kind=Kind.WIND, name="mast", object=transaction.put(path), source_hash="b" * 64
        )
        transaction.add(wind)
    sound = folder.with_name("sound")
    shutil.copytree(folder, sound)
    return Kept(
        folder=folder, camera=camera.id, wind=wind.id, expected=align(sound, camera.id, wind.id)
    )


@pytest.fixture
def flipped(kept: Kept, tmp_path: Path) -> Callable[[str, int, int], tuple[Path, Path]]:
    """Copies of the lake in which one bit of an artifact's object differs; the lake and the
    object."""
    trials: Iterator[int] = iter(range(10_000))

    def make(artifact: str, byte: int, bit: int) -> tuple[Path, Path]:
        folder = tmp_path / f"trial-{next(trials)}"
        shutil.copytree(kept.folder, folder)
        path = object_of(folder, artifact)
        damaged = bytearray(path.read_bytes())
        damaged[byte] ^= 1 << bit
        path.chmod(0o644)
        path.write_bytes(damaged)
        return folder, path

    return make


def object_of(folder: Path, artifact: str) -> Path:
    lake = Lake.open(folder)
    return lake.object_path(str(lake.artifact(artifact).object))


def payload_bytes(path: Path, topic: str) -> np.ndarray:
    """Offsets of all bytes of the messages of a topic, with the times in their heads."""
    file = open_bytes(path)
    table = read_messages(file, read_summary(file, where=""), topic, where="")
    return np.concatenate(
        [
            np.arange(start - 16, start + length)
            for start, length in zip(table.offset, table.length, strict=True)
        ]
    )


@pytest.mark.parametrize(("which", "topic"), [("camera", TOPIC_IMAGE), ("wind", TOPIC_WIND)])
def test_align_refuses_every_flipped_bit_of_a_frame_or_sample_and_names_the_object(
    kept: Kept, flipped: Callable[[str, int, int], tuple[Path, Path]], which: str, topic: str
) -> None:
    artifact = getattr(kept, which)
    places = payload_bytes(object_of(kept.folder, artifact), topic)
    rng = stream(7, "flips", which)
    for byte, bit in zip(
        rng.choice(places, FLIPS, replace=False), rng.integers(0, 8, FLIPS), strict=True
    ):
        folder, path = flipped(artifact, int(byte), int(bit))
        head = Lake.open(folder).resolve(None)
        with pytest.raises(CorruptError) as refused:
            align(folder, kept.camera, kept.wind)
        assert str(path) in str(refused.value.where), f"byte {byte}, bit {bit}"
        assert Lake.open(folder).resolve(None) == head


@pytest.mark.parametrize("which", ["camera", "wind"])
def test_a_bit_flipped_anywhere_is_refused_or_leaves_the_recording_as_it_is(
    kept: Kept, flipped: Callable[[str, int, int], tuple[Path, Path]], which: str
) -> None:
    artifact = getattr(kept, which)
    size = object_of(kept.folder, artifact).stat().st_size
    rng = stream(8, "flips", which)
    refused = 0
    for byte, bit in zip(rng.integers(0, size, FLIPS), rng.integers(0, 8, FLIPS), strict=True):
        folder, path = flipped(artifact, int(byte), int(bit))
        made, where = outcome(folder, kept)
        assert made == kept.expected or str(path) in where, f"byte {byte}, bit {bit}: {where}"
        refused += made is None
    assert refused > FLIPS / 2


def test_a_record_without_checksums_is_hashed_before_it_becomes_a_parent(
    kept: Kept, tmp_path: Path
) -> None:
    """The record of format 1 was written before there were checksums; the bit lies in its metadata,
    which had none."""
    folder = tmp_path / "lake"
    shutil.copytree(kept.folder, folder)
    lake = Lake.open(folder)
    shutil.copyfile(COMPAT / "record-v1.mcap", tmp_path / "old.mcap")
    assert not Record.open(tmp_path / "old.mcap").has_checksums
    with lake.transaction("old") as transaction:
        stored = transaction.put(tmp_path / "old.mcap")
        old = Artifact(kind=Kind.WIND, name="old", object=stored, source_hash="c" * 64)
        transaction.add(old)
    path = lake.object_path(stored)
    assert Pair.of(lake, kept.camera, old.id).series().sensor.height == 2.0
    damaged = bytearray(path.read_bytes())
    place = damaged.index(b"height") + len(b"height") + 4
    assert damaged[place : place + 3] == b"2.0"
    damaged[place] ^= 1
    path.chmod(0o644)
    path.write_bytes(damaged)
    assert content_hash(path) != stored.partition("/")[2]
    with pytest.raises(CorruptError) as refused:
        Pair.of(lake, kept.camera, old.id)
    assert refused.value.where == str(path)
