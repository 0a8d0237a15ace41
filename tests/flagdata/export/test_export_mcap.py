"""MCAP subsets, read back by the `mcap` package."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from flagdata.core.schema import Kind
from flagdata.dataset import TruthSeries
from flagdata.export import Export, export
from flagdata.lake import Artifact, Lake
from flagdata.record import Coding, Record, RecordWriter


@pytest.fixture(scope="module")
def folder(known: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    target = tmp_path_factory.mktemp("mcap") / "out"
    export(known.lake, Export(format="mcap"), target)
    return target


def decoded(path: Path, topic: str) -> list[tuple[Any, Any]]:
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        return [
            (message, data) for _, _, message, data in reader.iter_decoded_messages(topics=[topic])
        ]


def test_a_clip_holds_its_own_frames_and_no_other(known: Any, folder: Path) -> None:
    messages = decoded(folder / f"{known.clips[1]}.mcap", "/camera/image")
    assert [data.data for _, data in messages] == list(known.jpegs[30:60])
    assert [message.log_time for message, _ in messages] == known.times[30:60].tolist()
    assert [message.publish_time for message, _ in messages] == (
        known.times[30:60] - 7_000_000_000
    ).tolist()
    assert {data.format for _, data in messages} == {"jpeg"}


@pytest.mark.parametrize(("history", "before"), [(600.0, 600), (30.0, 60)])
def test_a_clip_holds_the_wind_that_its_ground_truth_was_worked_out_from(
    known: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, history: float, before: int
) -> None:
    # Ten minutes reach back beyond the log's start; half a minute is less than the truth window
    # before the first frame.
    monkeypatch.setattr("flagdata.export.mcap.HISTORY", history)
    export(known.lake, Export(format="mcap"), tmp_path / "mcap")
    messages = decoded(tmp_path / "mcap" / f"{known.clips[1]}.mcap", "/wind/samples")
    start, end = int(known.times[30]), int(known.times[59])
    wanted = (known.wind_time >= start - before * 10**9) & (known.wind_time <= end)
    assert [message.log_time for message, _ in messages] == known.wind_time[wanted].tolist()
    assert [data.speed for _, data in messages] == known.wind_speed[wanted].tolist()


def test_the_ground_truth_can_be_worked_out_again_from_the_clip_alone(
    known: Any, folder: Path
) -> None:
    wind = Record.open(folder / f"{known.clips[1]}.mcap").wind()
    assert wind is not None
    end = int(known.times[59])
    inside = (known.wind_time > end - 60 * 10**9) & (known.wind_time <= end)
    # Equal spacing: the mean over the window is the plain mean of the samples in it.
    assert TruthSeries.of(wind).before(end).wind == pytest.approx(
        float(np.mean(known.wind_speed[inside])), abs=1e-9
    )


def test_lineage_and_metadata_are_kept(known: Any, folder: Path) -> None:
    with (folder / f"{known.clips[1]}.mcap").open("rb") as stream:
        metadata = {item.name: item.metadata for item in make_reader(stream).iter_metadata()}
    assert metadata["provenance"] == {"source_name": "pier.mp4"}
    assert metadata["sensor"]["name"] == "cup"
    sample = metadata["sample"]
    assert (sample["artifact"], sample["parents"]) == (known.clips[1], known.recording)
    assert json.loads(sample["attachments_left_out"]) == ["log.csv"]
    label = json.loads(sample["label"])
    assert (label["wind"], label["wind_sigma"], label["frame_first"]) == (4.5, 0.125, 30)


def test_a_whole_recording_is_copied_byte_for_byte(known: Any, folder: Path) -> None:
    stored = known.lake.object_path(known.lake.artifact(known.recording).object)
    assert (folder / f"{known.recording}.mcap").read_bytes() == stored.read_bytes()


def test_the_project_s_own_reader_takes_a_subset_for_a_record(known: Any, folder: Path) -> None:
    record = Record.open(folder / f"{known.clips[2]}.mcap")
    assert record.frame_times.tolist() == known.times[60:].tolist()
    assert record.jpeg(29) == known.jpegs[89]


def test_a_subset_is_smaller_than_the_record_it_was_cut_from(known: Any, folder: Path) -> None:
    assert (folder / f"{known.clips[0]}.mcap").stat().st_size < (
        folder / f"{known.recording}.mcap"
    ).stat().st_size


def test_a_clip_of_h264_starts_at_a_key_frame_and_says_how_many_frames_lead_in(
    known: Any, tmp_path: Path
) -> None:
    lake = Lake.create(tmp_path / "lake")
    with lake.transaction("an archived recording") as tx:
        path = tx.staging(".mcap")
        with RecordWriter(path, metadata={}, coding=Coding.H264) as writer:
            for time, image in zip(known.times.tolist(), known.images, strict=True):
                writer.frame(log_time=time, publish_time=time, timestamp=time, image=image)
        name = tx.put(path)
        recording = Artifact(kind=Kind.RECORDING, name="archive", object=name)
        clip = Artifact(
            kind=Kind.CLIP,
            name="clip",
            object=name,
            recording=recording.id,
            frame_first=40,
            frame_count=30,
        )
        tx.add(recording)
        tx.add(clip)
    export(lake, Export(format="mcap", where="kind = 'clip'"), tmp_path / "out")
    subset = tmp_path / "out" / f"{clip.id}.mcap"
    messages = decoded(subset, "/camera/image")
    with subset.open("rb") as stream:
        metadata = {item.name: item.metadata for item in make_reader(stream).iter_metadata()}
    lead_in = int(metadata["sample"]["lead_in_frames"])
    assert len(messages) == lead_in + 30
    assert messages[lead_in][0].log_time == known.times[40]
    codec: Any = av.CodecContext.create("h264", "r")
    packets = [av.Packet(data.data) for _, data in messages]
    frames = [frame for packet in [*packets, None] for frame in codec.decode(packet)]
    pictures = np.stack([frame.to_ndarray(format="gray") for frame in frames])[lead_in:]
    # The codec's own loss on a smooth slope; a slip by one frame would be a mean difference of 1.
    assert abs((pictures.astype(int) - known.images[40:70]).mean()) < 0.5
