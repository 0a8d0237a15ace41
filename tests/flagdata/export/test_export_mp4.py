"""MP4 + CSV exports, read back by PyAV and pandas."""

from __future__ import annotations

import itertools
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
import pandas as pd
import pytest

from flagdata.errors import InputError, UsageError
from flagdata.export import Export, export
from flagdata.export.mp4 import presentation_times

CLIPS = "kind = 'clip'"


@pytest.fixture(scope="module")
def folder(known: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    target = tmp_path_factory.mktemp("mp4") / "out"
    export(
        known.lake,
        Export(format="mp4", where="kind = 'recording' or name = 'pier 1'", options={"crf": 10}),
        target,
    )
    return target


def test_the_video_is_h264_and_keeps_every_frames_time(known: Any, folder: Path) -> None:
    with av.open(str(folder / f"{known.recording}.mp4")) as container:
        stream = container.streams.video[0]
        assert stream.codec_context.name == "h264"
        seconds = [Fraction(frame.pts) * frame.time_base for frame in container.decode(stream)]
    wanted = [Fraction(int(time - known.times[0]), 10**9) for time in known.times]
    assert len(seconds) == 90
    # Presentation times are whole microseconds: half of one is the most that rounding can take.
    assert max(abs(a - b) for a, b in zip(seconds, wanted, strict=True)) <= Fraction(1, 2_000_000)
    assert len({b - a for a, b in itertools.pairwise(seconds)}) > 1


def test_the_pictures_are_those_that_were_recorded(known: Any, folder: Path) -> None:
    with av.open(str(folder / f"{known.clips[1]}.mp4")) as container:
        frames = [frame.to_ndarray(format="gray") for frame in container.decode(video=0)]
    difference = np.stack(frames).astype(int) - known.images[30:60]
    # Two lossy codecs on a smooth slope; a shift by one frame would be a difference of 1 in the
    # mean, a limited range taken for a full one a slope of 0.86.
    assert abs(difference.mean()) < 0.5
    assert np.abs(difference).max() <= 6


def test_the_videos_start_is_in_its_metadata(known: Any, folder: Path) -> None:
    with av.open(str(folder / f"{known.recording}.mp4")) as container:
        assert container.metadata["creation_time"].startswith("2026-05-01T12:01:20")
        assert known.recording in container.metadata["comment"]


def test_the_frames_csv_is_exact_to_the_nanosecond(known: Any, folder: Path) -> None:
    table = pd.read_csv(folder / f"{known.clips[1]}.frames.csv")
    times = (
        pd.to_datetime(table["time"], format="ISO8601")
        .astype("datetime64[ns, UTC]")
        .astype("int64")
    )
    device = (
        pd.to_datetime(table["device_time"], format="ISO8601")
        .astype("datetime64[ns, UTC]")
        .astype("int64")
    )
    assert times.tolist() == known.times[30:60].tolist()
    assert device.tolist() == (known.times[30:60] - 7_000_000_000).tolist()


def test_the_wind_csv_covers_the_minute_before_and_the_clip_itself(
    known: Any, folder: Path
) -> None:
    table = pd.read_csv(folder / f"{known.clips[1]}.wind.csv")
    times = (
        pd.to_datetime(table["time"], format="ISO8601")
        .astype("datetime64[ns, UTC]")
        .astype("int64")
        .to_numpy()
    )
    start, end = known.times[30], known.times[59]
    assert times.min() >= start - 60 * 10**9
    assert times.min() < start - 58 * 10**9
    assert end - 2 * 10**9 < times.max() <= end
    # One sample a second, each a second's mean: the speed grows by 0.05 m/s a second, so a bin's
    # sample is the one of its last second or the one at its end.
    expected = np.interp(times, known.wind_time, known.wind_speed)
    assert np.abs(table["wind_speed [m/s]"].to_numpy() - expected).max() <= 0.05 + 1e-9
    assert (table["wind_sigma [m/s]"] > 0).all()


def test_the_index_names_each_file_with_its_ground_truth(known: Any, folder: Path) -> None:
    index = pd.read_csv(folder / "index.csv").set_index("file")
    row = index.loc[f"{known.clips[1]}.mp4"]
    assert (row["wind [m/s]"], row["wind_sigma [m/s]"], row["session"]) == (4.5, 0.125, "pier")
    assert row["start [ns]"] == known.times[30]


def test_lossless_video_is_asked_for_by_crf_zero(known: Any, tmp_path: Path) -> None:
    export(
        known.lake,
        Export(format="mp4", where="name = 'pier 0'", options={"crf": 0}),
        tmp_path / "out",
    )
    with av.open(str(tmp_path / "out" / f"{known.clips[0]}.mp4")) as container:
        frames = [frame.to_ndarray(format="gray") for frame in container.decode(video=0)]
    # Only the JPEG of quality 95 stands between.
    assert np.abs(np.stack(frames).astype(int) - known.images[:30]).max() <= 3


def test_frames_within_a_microsecond_are_refused() -> None:
    with pytest.raises(InputError, match="closer than a microsecond"):
        presentation_times(np.array([0, 400, 800], dtype=np.int64))


def test_a_rate_factor_outside_the_codecs_range_is_refused(known: Any, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="rate factor"):
        export(known.lake, Export(format="mp4", where=CLIPS, options={"crf": 52}), tmp_path / "out")
