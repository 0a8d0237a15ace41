"""The ground truth's window that the user sets, a declared wind, and clocks that are hours
apart."""

from __future__ import annotations

import json
from pathlib import Path

import click
import numpy as np
import pytest
from click.testing import CliRunner

from flagdata.align import by_spans
from flagdata.align.apart import by_offset
from flagdata.cli import root
from flagdata.core.schema import Kind
from flagdata.dataset import Source, Tolerance
from flagdata.errors import InputError, UsageError
from flagdata.lake import Artifact, Lake
from flagdata.record import RecordWriter
from flagdata.record.signals import Sensor, WindSeries
from flagdata.verbs.option_types import DURATION

SECOND = 1_000_000_000
START = 1_780_000_000 * SECOND
FRAMES = 60
RATE = 10


def scene(folder: Path, *, log_shift: float = 0.0) -> tuple[Lake, str, str]:
    """Six seconds of film in a log whose speed is the second's number: its mean over a window
    identifies the window."""
    lake = Lake.create(folder)
    with lake.transaction("scene") as transaction:
        times = START + np.arange(FRAMES, dtype=np.int64) * (SECOND // RATE)
        path = transaction.staging(".mcap")
        with RecordWriter(path, metadata={}) as record:
            for time in times.tolist():
                image = np.full((16, 16), time // SECOND % 200, dtype=np.uint8)
                record.frame(log_time=time, publish_time=time, timestamp=time, image=image)
        camera = Artifact(
            kind=Kind.CAMERA,
            name="cam",
            object=transaction.put(path),
            source_hash="a" * 64,
            frame_count=FRAMES,
            start=int(times[0]),
            end=int(times[-1]),
            session="s",
        )
        seconds = np.arange(-1000, 60)
        log = WindSeries(
            time=START + seconds.astype(np.int64) * SECOND + round(log_shift * SECOND),
            channels={"wind_speed": 20 + seconds / 100},
            flags=np.zeros(len(seconds), dtype=np.uint16),
            sensor=Sensor(name="ramp", accuracy=0.1),
        )
        path = transaction.staging(".mcap")
        with RecordWriter(path, metadata={}) as record:
            record.wind(log)
        wind = Artifact(
            kind=Kind.WIND,
            name="mast",
            object=transaction.put(path),
            source_hash="b" * 64,
            session="s",
            start=int(log.time[0]),
            end=int(log.time[-1]),
        )
        transaction.add(camera)
        transaction.add(wind)
    return lake, camera.id, wind.id


def invoke(*arguments: str) -> tuple[dict[str, object], str]:
    result = CliRunner().invoke(
        root, [*arguments, "--json"], catch_exceptions=False, standalone_mode=False
    )
    return json.loads(result.stdout), result.stderr


STAMPS = ("--by", "stamps", "--offset-sigma", "0.01")


@pytest.mark.parametrize(
    ("given", "window"), [("10s", 10.0), ("2min", 120.0), ("800000ms", 800.0), (None, 60.0)]
)
def test_the_window_reaches_the_clips_and_their_recipe(
    tmp_path: Path, given: str | None, window: float
) -> None:
    lake, camera, wind = scene(tmp_path / "lake")
    option = ("--window", given) if given else ()
    said, _ = invoke("align", camera, wind, *STAMPS, *option, "--lake", str(lake.path))
    recording = lake.artifact(str(said["recording"]))
    assert recording.recipe.get("truth") == ({"window": window} if given else None)
    clips = [Artifact.from_row(row) for row in lake.rows("kind = 'clip'").to_pylist()]
    assert len(clips) == FRAMES // 30
    for clip in clips:
        assert clip.recipe["window"] == window
        # The samples of whole seconds in (end − window, end]: the mean of an arithmetic series.
        last = (int(clip.end or 0) - START) // SECOND
        assert clip.wind == pytest.approx(20 + (last - (window - 1) / 2) / 100, abs=1e-9)


def test_another_window_is_another_recording_and_realign_keeps_it(tmp_path: Path) -> None:
    lake, camera, wind = scene(tmp_path / "lake")
    usual, _ = invoke("align", camera, wind, *STAMPS, "--lake", str(lake.path))
    short, _ = invoke("align", camera, wind, *STAMPS, "--window", "10s", "--lake", str(lake.path))
    assert usual["recording"] != short["recording"]
    again, _ = invoke(
        "realign",
        str(short["recording"]),
        "--by",
        "stamps",
        "--offset-sigma",
        "0.02",
        "--lake",
        str(lake.path),
    )
    assert lake.artifact(str(again["recording"])).recipe["truth"] == {"window": 10.0}


def test_pairs_take_the_clips_window_and_ask_where_there_are_several(tmp_path: Path) -> None:
    lake, camera, wind = scene(tmp_path / "lake")
    invoke("align", camera, wind, *STAMPS, "--window", "10s", "--lake", str(lake.path))
    source = Source(lake)
    (first, *_) = source.pairs(tolerance=Tolerance()).table.wind.tolist()
    assert first == pytest.approx(20 + (2 - 4.5) / 100, abs=1e-9)
    invoke("align", camera, wind, *STAMPS, "--lake", str(lake.path))
    with pytest.raises(UsageError, match="over 10, 60 s"):
        source.pairs()
    both = source.pairs(window=10.0).table.wind
    assert sorted(set(np.round(both, 9).tolist())) == [pytest.approx(19.975), pytest.approx(20.005)]


@pytest.mark.parametrize("text", ["10", "ten s", "-5s", "0s", "2d", "nan s", "25h"])
def test_a_window_that_is_no_length_of_time_is_refused(tmp_path: Path, text: str) -> None:
    lake, camera, wind = scene(tmp_path / "lake")
    with pytest.raises((UsageError, click.BadParameter)):
        invoke("align", camera, wind, *STAMPS, "--window", text, "--lake", str(lake.path))
    assert lake.rows("kind = 'recording'").num_rows == 0


def test_a_length_of_time_has_a_unit() -> None:
    assert [DURATION.convert(text, None, None) for text in ("10s", "1.5 min", "500ms", "1h")] == [
        10,
        90,
        0.5,
        3600,
    ]


def test_a_declared_wind_is_the_truth_of_every_clip_with_its_sigma(tmp_path: Path) -> None:
    lake, camera, _ = scene(tmp_path / "lake")
    arguments = ("declare", camera, "--speed", "5.5", "--sigma", "0.2", "--lake", str(lake.path))
    said, _ = invoke(*arguments)
    clips = lake.rows(f"kind = 'clip' and recording = '{said['recording']}'").to_pylist()
    assert len(clips) == FRAMES // 30
    for clip in clips:
        assert (clip["wind"], clip["wind_sigma"]) == (pytest.approx(5.5), pytest.approx(0.2))
        assert clip["wind_coverage"] >= 1 - 1 / 60  # but for the time since the last sample
        assert "wind-declared" in clip["quality"]
    assert len(Source(lake).pairs()) == len(clips)
    head = lake.resolve(None)
    again, _ = invoke(*arguments)
    assert (again["recording"], again["created"], lake.resolve(None)) == (
        said["recording"],
        False,
        head,
    )


@pytest.mark.parametrize(
    ("speed", "sigma"), [("-1", "0.1"), ("5", "0"), ("nan", "0.1"), ("5", "inf")]
)
def test_a_declared_wind_without_sense_is_refused(tmp_path: Path, speed: str, sigma: str) -> None:
    lake, camera, wind = scene(tmp_path / "lake")
    with pytest.raises(UsageError):
        invoke("declare", camera, "--speed", speed, "--sigma", sigma, "--lake", str(lake.path))
    with pytest.raises(UsageError, match="not a camera"):
        invoke("declare", wind, "--speed", "5", "--sigma", "0.1", "--lake", str(lake.path))


def test_a_log_an_hour_from_its_film_is_warned_of_before_the_search(tmp_path: Path) -> None:
    lake, camera, wind = scene(tmp_path / "lake", log_shift=-3600.0)
    offset = ("--by", "given", "--clock-offset", "-3600", "--offset-sigma", "0.1")
    said, stderr = invoke("align", camera, wind, *offset, "--lake", str(lake.path))
    assert "hours" not in stderr  # by the given offset they meet
    recording = lake.artifact(str(said["recording"]))
    assert "clocks-hours-apart" in recording.quality
    (finding,) = json.loads(recording.report or "{}")["findings"]
    assert "1 h 00 min apart, about what zones differ by" in finding["what"]
    with pytest.raises(InputError, match="no wind sample"):
        invoke("align", camera, wind, *STAMPS, "--lake", str(lake.path))


def test_spans_hours_apart_are_reported_with_their_order() -> None:
    film, names = (START, START + 600 * SECOND), ("cam", "mast")
    early = (film[0] - 9000 * SECOND, film[0] - 5400 * SECOND)
    found = by_spans(film, early, names=names)
    assert found is not None
    assert found.value == -5400.0
    assert "mast ends 1 h 30 min before cam" in found.what
    late = by_spans(early, film, names=names)
    assert late is not None
    assert late.value == 5400.0
    assert by_spans(film, (film[0] - SECOND, film[0]), names=names) is None
    assert by_spans(film, (film[1] + 1700 * SECOND, film[1] + 1800 * SECOND), names=names) is None


def test_an_offset_of_minutes_is_no_matter_of_hours() -> None:
    assert by_offset(-1799.0, names=("cam", "mast")) is None
    odd = by_offset(-2345.0, names=("cam", "mast"))
    assert odd is not None
    assert "zones differ" not in odd.what
