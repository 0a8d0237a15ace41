"""A camera and a wind artifact become a recording: frames unchanged, on the wind's clock, with
clips, in one commit."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from flagdata.align import Pair
from flagdata.cli import root
from flagdata.core.rng import stream
from flagdata.core.schema import Kind
from flagdata.errors import ConflictError, RefusedError, UsageError
from flagdata.lake import Artifact, Lake
from flagdata.record import Record, RecordWriter
from flagdata.record.signals import Sensor, WindSeries

SECOND = 1_000_000_000
START = 1_780_000_000 * SECOND
OFFSET = 7.25  # s, the camera is behind the anemometer by this much
RATE = 10
SIZE = 48


def gust(seconds: np.ndarray) -> np.ndarray:
    """A wind without a period: incommensurable waves of 5 to 60 s."""
    rng = stream(5, "gust")
    total = np.zeros_like(seconds)
    for _ in range(40):
        total += np.sin(2 * np.pi * seconds / rng.uniform(5, 60) + rng.uniform(0, 2 * np.pi))
    return 6 + 0.25 * total


def film(seconds: np.ndarray) -> np.ndarray:
    """Frames of a striped cloth before a still wall, whose stripes move faster the stronger the
    wind was 0.4 s ago."""
    rows, columns = np.mgrid[:SIZE, :SIZE]
    phase = np.cumsum((gust(seconds - 0.4) / 6) ** 1.5) * 0.5
    wall = 100 + 30 * np.sin(rows / 3.0) + 20 * np.cos(columns / 4.0)
    frames = np.repeat(wall[None], len(seconds), axis=0)
    cloth = (slice(16, 34), slice(10, 30))
    frames[:, *cloth] = 120 + 60 * np.sin(columns[cloth][None] / 3.0 - phase[:, None, None])
    return np.clip(frames + stream(1, "grain").normal(0, 1.0, frames.shape), 0, 255).astype(
        np.uint8
    )


def fill(
    lake: Lake, *, steady: bool, seconds: int = 240, camera_session: str | None = "mast"
) -> tuple[str, str]:
    """A camera and a wind artifact of one scene; their ids."""
    with lake.transaction("scene") as transaction:
        true = np.arange(seconds * RATE) / RATE
        device = START + np.round((true - OFFSET) * SECOND).astype(np.int64)
        path = transaction.staging(".mcap")
        with RecordWriter(path, metadata={"camera": {"container": "made"}}) as record:
            for time, image in zip(device.tolist(), film(true), strict=True):
                record.frame(
                    log_time=time, publish_time=time, timestamp=time + 5_000_000, image=image
                )
        camera = Artifact(
            kind=Kind.CAMERA,
            name="cam",
            object=transaction.put(path),
            source_hash="a" * 64,
            session=camera_session,
            frame_count=len(true),
            start=int(device[0]),
            end=int(device[-1]),
        )
        transaction.add(camera)
        stamps = np.arange(-100, seconds + 100)
        fine = np.arange(20)[None, :] / 20
        speed = gust(stamps[:, None] - fine).mean(
            axis=1
        )  # the mean of the second before each stamp
        if steady:
            speed = 6 + 0.02 * stream(2, "sensor").standard_normal(len(stamps))
        path = transaction.staging(".mcap")
        series = WindSeries(
            time=START + stamps.astype(np.int64) * SECOND,
            channels={"wind_speed": speed},
            flags=np.zeros(len(stamps), dtype=np.uint16),
            sensor=Sensor(name="sonic", averaging=1.0, distance_constant=0.0),
        )
        with RecordWriter(path, metadata={}) as record:
            record.wind(series)
            record.attach("log.csv", b"speed\n", media_type="text/csv", log_time=START)
        wind = Artifact(
            kind=Kind.WIND,
            name="mast",
            object=transaction.put(path),
            source_hash="b" * 64,
            session="mast",
            start=int(series.time[0]),
            end=int(series.time[-1]),
        )
        transaction.add(wind)
    return camera.id, wind.id


@pytest.fixture(scope="module")
def gusty(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str, str]:
    folder = tmp_path_factory.mktemp("lakes") / "gusty"
    lake = Lake.create(folder)
    return folder, *fill(lake, steady=False)


def run(*arguments: str) -> dict[str, object]:
    result = CliRunner().invoke(
        root, [*arguments, "--json"], catch_exceptions=False, standalone_mode=False
    )
    return json.loads(result.stdout)


def test_an_estimate_makes_a_recording_on_the_winds_clock_with_clips_in_one_commit(
    gusty: tuple[Path, str, str], tmp_path: Path
) -> None:
    folder, camera, wind = gusty
    lake = Lake.open(folder)
    before = lake.resolve(None)
    plot = tmp_path / "lag.png"
    said = run(
        "align",
        camera[:12],
        wind[:12],
        "--lake",
        str(folder),
        "--search",
        "40",
        "--plot",
        str(plot),
    )
    assert plot.read_bytes().startswith(b"\x89PNG")
    assert lake.resolve(None) == before + 1  # one commit
    recording = lake.artifact(str(said["recording"]))
    assert recording.parents == (camera, wind)
    assert recording.session == "mast"
    assert recording.clock_method == "estimated"
    assert recording.clock_offset == pytest.approx(OFFSET, abs=0.5)  # the acceptance bound
    record = Record.open(lake.object_path(str(recording.object)))
    source = Record.open(lake.object_path(str(lake.artifact(camera).object)))
    assert record.jpeg(17) == source.jpeg(17)
    np.testing.assert_array_equal(record.device_frame_times, source.frame_times)
    shift = record.frame_times - source.frame_times
    # Written to the nanosecond; the offset itself is a double.
    np.testing.assert_allclose(shift / SECOND, float(recording.clock_offset or 0), atol=2e-9)
    np.testing.assert_array_equal(record.timestamps(0, 3), record.frame_times[:3] + 5_000_000)
    assert record.attachment("log.csv") == b"speed\n"
    clips = lake.rows(f"kind = 'clip' and recording = '{recording.id}'")
    assert clips.num_rows == 240 * RATE // 30
    assert set(clips["artifact"].to_pylist()) == set(said["clips"])  # type: ignore[call-overload]


def test_aligning_again_finds_the_recording_and_writes_nothing(
    gusty: tuple[Path, str, str],
) -> None:
    folder, camera, wind = gusty
    options = (
        "--by",
        "given",
        "--clock-offset",
        "7.25",
        "--offset-sigma",
        "0.1",
        "--lake",
        str(folder),
    )
    first = run("align", camera, wind, *options)
    head = Lake.open(folder).resolve(None)
    again = run("align", camera, wind, *options)
    assert (first["created"], again["created"]) == (True, False)
    assert again["recording"] == first["recording"]
    assert sorted(again["clips"]) == sorted(first["clips"])  # type: ignore[call-overload]
    assert Lake.open(folder).resolve(None) == head


def test_another_session_for_a_recording_that_is_there_is_a_conflict(
    gusty: tuple[Path, str, str],
) -> None:
    folder, camera, wind = gusty
    options = (
        "--by",
        "given",
        "--clock-offset",
        "6.5",
        "--offset-sigma",
        "0.1",
        "--lake",
        str(folder),
    )
    run("align", camera, wind, *options, "--session", "one")
    with pytest.raises(ConflictError, match="session 'one'"):
        run("align", camera, wind, *options, "--session", "two")


def test_an_offset_claimed_better_than_a_frame_is_flagged(gusty: tuple[Path, str, str]) -> None:
    folder, camera, wind = gusty
    said = run(
        "align",
        camera,
        wind,
        "--by",
        "given",
        "--clock-offset",
        "7",
        "--offset-sigma",
        "0.001",
        "--lake",
        str(folder),
    )
    assert "sigma-below-frame" in Lake.open(folder).artifact(str(said["recording"])).quality


def test_people_read_the_offset_with_its_interval(gusty: tuple[Path, str, str]) -> None:
    folder, camera, wind = gusty
    result = CliRunner().invoke(
        root,
        [
            "align",
            camera,
            wind,
            "--by",
            "given",
            "--clock-offset",
            "-3.2",
            "--offset-sigma",
            "0.25",
            "--dry-run",
            "--lake",
            str(folder),
        ],
        catch_exceptions=False,
    )
    # 1.645 × 0.25 = 0.411 either side.
    assert result.stdout.strip() == "offset -3.20 s [-3.61, -2.79] 90 %, given"


def test_realign_writes_a_new_object_and_names_what_it_supersedes(
    gusty: tuple[Path, str, str],
) -> None:
    folder, camera, wind = gusty
    lake = Lake.open(folder)
    old = str(
        run("align", camera, wind, "--by", "stamps", "--offset-sigma", "2", "--lake", str(folder))[
            "recording"
        ]
    )
    said = run(
        "realign",
        old,
        "--by",
        "given",
        "--clock-offset",
        "7",
        "--offset-sigma",
        "0.2",
        "--lake",
        str(folder),
    )
    new = lake.artifact(str(said["recording"]))
    assert new.object != lake.artifact(old).object
    assert new.parents == (camera, wind)
    assert new.recipe["supersedes"] == old
    assert new.clock_offset == 7.0
    assert new.clock_sigma == pytest.approx(0.2)
    assert lake.artifact(old).clock_offset == 0.0


def test_stamps_of_whole_seconds_add_their_own_uncertainty(gusty: tuple[Path, str, str]) -> None:
    folder, camera, wind = gusty
    said = run(
        "align",
        camera,
        wind,
        "--by",
        "stamps",
        "--offset-sigma",
        "0.4",
        "--dry-run",
        "--lake",
        str(folder),
    )
    assert said["recording"] is None
    assert said["clock"]["sigma"] == pytest.approx(np.hypot(0.4, 1 / np.sqrt(12)))  # type: ignore[index]


def test_a_film_shorter_than_what_is_compared_is_refused_before_a_frame_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lake = Lake.create(tmp_path / "lake")
    camera, wind = fill(lake, steady=False, seconds=100)
    monkeypatch.setattr(Pair, "motion", lambda *_, **__: pytest.fail("frames are read"))
    with pytest.raises(RefusedError, match="100 s of film beside 300 s of log") as refused:
        run("align", camera, wind, "--lake", str(lake.path))
    assert "is estimated from 120 s or more that both cover" in refused.value.what
    assert refused.value.exit_code == 3


def test_a_steady_wind_is_refused_and_nothing_is_committed(tmp_path: Path) -> None:
    lake = Lake.create(tmp_path / "lake")
    camera, wind = fill(lake, steady=True, seconds=150)
    head = lake.resolve(None)
    with pytest.raises(RefusedError, match="without gusts") as refused:
        run("align", camera, wind, "--lake", str(lake.path), "--search", "40")
    assert refused.value.exit_code == 3
    assert lake.resolve(None) == head


@pytest.mark.parametrize(
    ("options", "what"),
    [
        (["--by", "given"], "needs an offset"),
        (["--clock-offset", "3"], "needs no offset"),
        (["--by", "given", "--clock-offset", "3"], "needs the uncertainty"),
        (["--by", "stamps"], "needs the uncertainty"),
        (["--offset-sigma", "1"], "is estimated"),
        (
            ["--by", "given", "--clock-offset", "3", "--offset-sigma", "1", "--search", "5"],
            "searches nothing",
        ),
        (
            ["--by", "given", "--clock-offset", "nan", "--offset-sigma", "1"],
            "offset nan s is not finite",
        ),
        (["--by", "given", "--clock-offset", "1", "--offset-sigma", "0"], "uncertainty 0"),
        (["--by", "stamps", "--offset-sigma", "1", "--plot", "x.png"], "no search to draw"),
    ],
)
def test_options_that_a_method_cannot_use_are_refused(
    gusty: tuple[Path, str, str], options: list[str], what: str
) -> None:
    folder, camera, wind = gusty
    with pytest.raises(UsageError, match=what):
        run("align", camera, wind, "--lake", str(folder), *options)


def test_arguments_in_the_wrong_order_are_refused(gusty: tuple[Path, str, str]) -> None:
    folder, camera, wind = gusty
    with pytest.raises(UsageError, match="not a camera"):
        run("align", wind, camera, "--lake", str(folder))


def test_sessions_that_disagree_must_be_settled(tmp_path: Path) -> None:
    lake = Lake.create(tmp_path / "lake")
    camera, wind = fill(lake, steady=False, seconds=15, camera_session="beach")
    options = (
        "--by",
        "given",
        "--clock-offset",
        "7",
        "--offset-sigma",
        "0.2",
        "--lake",
        str(lake.path),
    )
    with pytest.raises(UsageError, match="'beach' and 'mast'"):
        run("align", camera, wind, *options)
    said = run("align", camera, wind, *options, "--session", "beach-mast")
    assert lake.artifact(str(said["recording"])).session == "beach-mast"
