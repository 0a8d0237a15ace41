"""The demonstration's recording: files as a user brings them, which state nothing of what is to be
found."""

from __future__ import annotations

import csv
from datetime import datetime
from pathlib import Path

import av
import numpy as np
import pytest

from flagdata.errors import InputError
from measure.demo import BEFORE, START, RecordingRecipe
from measure.demo.demo_recording import HIDDEN, Recording, make_recording
from sim.effects import EFFECTS

RECIPE = RecordingRecipe(seed=5, duration=10, columns=6, width=120, rows=90, samples=1)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Recording, int]:
    """A short film of a coarse flag, and the frames that were counted."""
    frames: list[int] = []
    return make_recording(
        RECIPE, tmp_path_factory.mktemp("made"), workers=1, advance=frames.append
    ), sum(frames)


def test_the_film_is_a_colour_file_of_a_camera_with_its_time(made: tuple[Recording, int]) -> None:
    recording, counted = made
    with av.open(str(recording.video)) as container:
        assert container.streams.video[0].codec_context.name == "h264"
        assert container.metadata["creation_time"].startswith("2026-05-14T09:30:00")
        frames = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
    assert len(frames) == 300
    assert counted == 2 * 300
    assert frames[0].shape == (90, 120, 3)
    assert (
        np.ptp(np.stack(frames).astype(float), axis=0).max() > 60
    )  # something moves in front of the background


def test_the_log_runs_by_a_clock_that_is_off_by_the_hidden_offset(
    made: tuple[Recording, int],
) -> None:
    """Against the true wind, which the cups follow late: the logger's stamps less the offset are
    the camera's time."""
    recording, _ = made
    with recording.log.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file, delimiter=";"))
    stamps = [
        datetime.strptime(f"{row['Date']} {row['Time']} +0200", "%d.%m.%Y %H:%M:%S.%f %z")
        for row in rows
    ]
    since = np.array([(stamp - START).total_seconds() for stamp in stamps])
    speed = np.array([float(row["Wind speed [km/h]"].replace(",", ".")) for row in rows]) / 3.6
    true = np.arange(len(recording.wind)) / 10 - BEFORE

    def error(offset: float) -> float:
        return float(np.mean((np.interp(since - offset - 0.9, true, recording.wind) - speed) ** 2))

    tried = recording.clock_offset + np.arange(-5, 5.1, 0.25)
    assert (
        abs(tried[np.argmin([error(offset) for offset in tried])] - recording.clock_offset) <= 0.5
    )
    assert abs(recording.clock_offset) <= 46


def test_no_file_states_what_acts_or_what_the_cloth_weighs(made: tuple[Recording, int]) -> None:
    recording, _ = made
    texts = [path.read_text(encoding="utf-8") for path in (recording.log, recording.sensor)]
    with av.open(str(recording.video)) as container:
        texts.append(repr(container.metadata))
    assert recording.acting is not None
    for word in (
        *EFFECTS,
        "damping",
        f"{recording.area_weight:.3f}",
        f"{recording.clock_offset:.2f}",
    ):
        assert not [text for text in texts if word in text], word


@pytest.mark.parametrize("acting", HIDDEN, ids=lambda acting: acting.effect)
def test_what_acts_is_admissible(acting: object) -> None:
    own = next(one for one in HIDDEN if one == acting)
    assert EFFECTS[own.effect].parameters()[own.parameter].admits(own.strength)
    assert own.strength != 0


def test_a_film_too_short_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="at least 10 s"):
        RecordingRecipe(seed=1, duration=5)
