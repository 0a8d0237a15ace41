"""Films from files and records: instants, parts and crops."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.ingest.films.film import CameraFilm, RecordFilm
from flagdata.record import Record, RecordWriter
from flagdata.timebase import NANOSECONDS
from tests.measure.estimate.conftest import pictures, write_video

START = 1_700_000_000 * NANOSECONDS


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """150 frames at 25 Hz."""
    path = tmp_path_factory.mktemp("records") / "film.mcap"
    with RecordWriter(path, metadata={"camera": {"name": "made"}}) as writer:
        for k, image in enumerate(pictures(150)):
            time = START + k * NANOSECONDS // 25
            writer.frame(log_time=time, publish_time=time, timestamp=time, image=image)
    return path


def test_a_video_has_the_rate_and_the_instants_of_its_stamps(tmp_path: Path) -> None:
    film = CameraFilm(write_video(tmp_path / "film.mkv", pictures(20), rate=50))
    assert film.rate == pytest.approx(50)
    assert film.duration == pytest.approx(19 / 50)
    np.testing.assert_allclose([time for time, _ in film.frames(0.1, 0.2)], np.arange(5, 11) / 50)
    assert film.start is None


def test_a_high_speed_film_has_the_rate_that_the_camera_really_ran_at(tmp_path: Path) -> None:
    film = CameraFilm(write_video(tmp_path / "film.mkv", pictures(20), rate=25), true_fps=100.0)
    assert film.rate == pytest.approx(100)
    assert film.duration == pytest.approx(19 / 100)
    np.testing.assert_allclose([time for time, _ in film.frames(0, 1)], np.arange(20) / 100)


def test_a_record_is_read_in_order_beyond_one_reading_and_within_its_part(recorded: Path) -> None:
    film = RecordFilm(recorded, name="film")
    assert film.rate == pytest.approx(25)
    assert film.start == START
    times = [time for time, _ in film.frames(0.0, 5.96)]
    np.testing.assert_allclose(times, np.arange(150) / 25)
    part = list(film.frames(0.4, 0.8))
    np.testing.assert_allclose([time for time, _ in part], np.arange(10, 21) / 25)
    np.testing.assert_array_equal(part[0][1], Record.open(recorded).frames(10, 1)[0])


def test_a_clip_begins_at_its_own_first_frame(recorded: Path) -> None:
    film = RecordFilm(recorded, name="clip", first=30, count=12)
    assert film.duration == pytest.approx(11 / 25)
    time, image = next(film.frames(0.0, 1.0))
    assert time == 0
    np.testing.assert_array_equal(image, Record.open(recorded).frames(30, 1)[0])
    with pytest.raises(InputError, match="1 frames"):
        RecordFilm(recorded, name="clip", first=30, count=1)


def test_a_video_of_any_shape_is_the_whole_picture_as_it_is_stored(tmp_path: Path) -> None:
    images = pictures(4, height=30, width=44)
    film = CameraFilm(write_video(tmp_path / "film.mkv", images))
    assert (film.width, film.height) == (44, 30)
    np.testing.assert_array_equal(np.stack([image for _, image in film.frames(0, 1)]), images)
    assert "letterboxed" not in {finding.kind for finding in film.findings()}
