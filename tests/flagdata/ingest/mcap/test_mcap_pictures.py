"""Pictures of a topic: their grays and instants are those that were written, however they are
coded."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zstandard
from mcap.writer import CompressionType, Writer

from flagdata.errors import CorruptError, InputError, LimitError, UnknownNameError, UsageError
from flagdata.ingest import (
    CameraIngest,
    CameraOptions,
    classify,
    guesses,
    ingest_camera,
    messages,
    open_camera,
    topics,
)
from flagdata.ingest.mcap.mcap_pictures import TopicSource
from flagdata.ingest.mcap.topics import index
from flagdata.lake import Lake
from flagdata.record import salvage, unpacking
from tests.flagdata.ingest.mcap.conftest import FRAMES, NOON, STEP

zstd_compress = zstandard.compress


def options(topic: str | None = None) -> CameraOptions:
    return CameraOptions(topic=topic, rate="native", size=64)


@pytest.mark.parametrize(
    ("topic", "error"), [("/png", 0), ("/jpeg", 1), ("/raw", 0), ("/video", 2)]
)
def test_each_picture_has_its_gray_and_the_instant_that_its_message_states(
    drive: Path, topic: str, error: int
) -> None:
    assert classify(drive, topic=topic).kind == "camera"
    with open_camera(drive, options(topic)) as stream:
        frames = list(stream)
    assert [frame.time for frame in frames] == [NOON + k * STEP for k in range(FRAMES)]
    grays = np.array([frame.image[32].mean() for frame in frames])
    # JPEG and H.264 of one gray round it; H.264's range is the limited one.
    np.testing.assert_allclose(grays, 40 + 3 * np.arange(FRAMES), atol=error)
    assert {finding.kind for finding in stream.findings} >= {"topics-not-read"}
    assert not [finding for finding in stream.findings if finding.kind == "corrupt-frames"]


def test_several_topics_of_pictures_are_named_and_none_is_guessed(drive: Path) -> None:
    with pytest.raises(InputError, match="4 topics hold pictures") as raised:
        open_camera(drive, options())
    assert "--topic" in raised.value.fix
    with pytest.raises(UnknownNameError, match="/pngs") as unknown:
        classify(drive, topic="/pngs")
    assert "/png" in unknown.value.fix
    assert [guess.kind for guess in guesses(drive)] == ["camera"] * 4


def test_a_topic_becomes_a_camera_of_the_lake_once(drive: Path, lake: Lake) -> None:
    ingest = CameraIngest(camera=options("/png"))
    result = ingest_camera(lake, drive, ingest)
    assert result.created
    assert result.artifact.frame_count == FRAMES
    assert result.artifact.start == NOON
    assert not ingest_camera(lake, drive, ingest).created
    assert ingest_camera(lake, drive, CameraIngest(camera=options("/raw"))).created


def test_runs_are_spread_over_the_topic_whatever_its_coding(drive: Path) -> None:
    for topic in ("/png", "/video"):
        runs = list(TopicSource(drive, options(topic)).samples(3, 4, 2))
        firsts = [NOON + k * STEP for k in (0, 16, 33)]
        late = 10 * STEP if topic == "/video" else 0  # the next key frame
        assert [len(run) for run in runs] == [4, 4, 4]
        assert all(
            first <= (run[0].stamp or 0) <= first + late
            for run, first in zip(runs, firsts, strict=True)
        )
        for run in runs:
            assert [int((one.stamp or 0) - (run[0].stamp or 0)) for one in run] == [
                2 * k * STEP for k in range(4)
            ]
            for one in run:
                gray = one.luma()
                level = (
                    (np.asarray(gray.image).mean() - gray.black) / (gray.white - gray.black) * 255
                )
                assert level == pytest.approx(40 + 3 * ((one.stamp or 0) - NOON) / STEP, abs=2)


def test_a_topic_of_a_video_file_is_refused(video: Path) -> None:
    with pytest.raises(UsageError, match="no MCAP"):
        open_camera(video, options("/png"))


def test_a_file_that_was_cut_off_is_refused_with_the_command_that_salvages_it(
    drive: Path, tmp_path: Path
) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(drive.read_bytes()[:-2000])
    with pytest.raises(CorruptError) as raised:
        open_camera(cut, options("/png"))
    assert "flagdata recover" in raised.value.fix
    salvaged = tmp_path / "salvaged.mcap"
    salvage(cut, salvaged)
    assert classify(salvaged, topic="/png").kind == "camera"
    with open_camera(salvaged, options("/png")) as stream:
        assert [frame.time for frame in stream] == [NOON + k * STEP for k in range(FRAMES)]


def test_pictures_that_cannot_be_decoded_are_counted_and_left_out(
    write_json: Callable[..., Path], drive: Path
) -> None:
    import base64

    from tests.flagdata.ingest.mcap.conftest import encoded, pictures

    good = [base64.b64encode(encoded(image, "PNG")).decode() for image in pictures()[:4]]
    data = [good[0], good[1][: len(good[1]) // 2], good[2], good[3]]
    path = write_json(
        {"/foxglove.CompressedImage": [{"format": "png", "data": one} for one in data]}
    )
    with open_camera(path, options()) as stream:
        times = [frame.time for frame in stream]
    assert times == [NOON, NOON + 200_000_000, NOON + 300_000_000]
    assert [finding.what for finding in stream.findings if finding.kind == "corrupt-frames"] == [
        "1 of 4 frames cannot be decoded and were left out"
    ]


@pytest.mark.parametrize(
    "wrong",
    [
        {"data": 10**12},
        {"data": "A"},
        {"data": None},
        {"step": -4},
        {"step": "4"},
        {"width": 1e300},
        {"height": None},
        {"data": ["a"]},
    ],
)
def test_plain_pixels_whose_numbers_or_bytes_make_no_sense_are_left_out(
    write_json: Callable[..., Path], wrong: dict[str, Any]
) -> None:
    sound = {"encoding": "mono8", "width": 2, "height": 2, "step": 2, "data": [9, 9, 9, 9]}
    with open_camera(
        write_json({"/foxglove.RawImage": [sound, sound | wrong, sound]}), options()
    ) as stream:
        assert len(list(stream)) == 2
    assert [finding.count for finding in stream.findings if finding.kind == "corrupt-frames"] == [1]


def test_more_pictures_than_the_summary_states_are_counted_as_they_are_read(drive: Path) -> None:
    with pytest.raises(LimitError, match="more than 3 messages"):
        index(drive, "/png", limit=3)
    assert index(drive, "/png", limit=FRAMES).places.shape == (FRAMES, 3)


def test_a_chunk_that_would_unpack_to_more_than_the_limit_is_refused_before_it_is_read(
    write_json: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(unpacking, "UNPACKED_LIMIT", 20)
    with pytest.raises(LimitError, match="claims to unpack"):
        topics(write_json({"/a": [{"x": 1.0}]}))


def test_a_chunk_that_unpacks_to_more_than_it_states_is_damage(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "bomb.mcap"
    monkeypatch.setattr(zstandard, "compress", lambda data: zstd_compress(bytes(5000) + data))
    with path.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.ZSTD)
        writer.start()
        channel = writer.register_channel(topic="/a", message_encoding="json", schema_id=0)
        writer.add_message(channel, log_time=NOON, publish_time=NOON, data=b"{}")
        writer.finish()
    with pytest.raises(CorruptError, match="unpacks to more than"):
        next(messages(path, "/a"))
