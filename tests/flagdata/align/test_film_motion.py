"""Motion energy: rises with motion in the picture, and with nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.align import MotionSeries, motion_energy
from flagdata.core.rng import stream
from flagdata.errors import InputError
from tests.refusals import unrefused

SIZE = 120
PERIOD = 40_000_000  # ns
ROWS, COLUMNS = np.mgrid[:SIZE, :SIZE].astype(np.float64)


def wall(shift: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    """A smooth pattern, seen by a camera that is `shift` (x, y) pixels off."""
    x, y = COLUMNS + shift[0], ROWS + shift[1]
    return 110 + 30 * np.sin(x / 13) * np.cos(y / 9) + 20 * np.sin((x + y) / 17)


def film(
    count: int,
    *,
    speed: float = 0.0,
    gain: np.ndarray | None = None,
    shake: np.ndarray | None = None,
    noise: float = 1.0,
    area: int = 40,
) -> list[tuple[int, np.ndarray]]:
    """A striped square of `area` pixels a side whose stripes move `speed` pixels a frame, before a
    wall."""
    grain = stream(3, "grain")
    frames = []
    for index in range(count):
        image = wall((0.0, 0.0) if shake is None else tuple(shake[index]))
        image[30 : 30 + area, 50 : 50 + area] = 120 + 70 * np.sin(
            (COLUMNS[:area, :area] - speed * index) / 6
        )
        image = image * (1.0 if gain is None else gain[index]) + grain.normal(0, noise, image.shape)
        frames.append((index * PERIOD, np.clip(np.round(image), 0, 255).astype(np.uint8)))
    return frames


def mean_energy(frames: list[tuple[int, np.ndarray]]) -> float:
    return float(np.mean(motion_energy(frames).energy))


def test_energy_rises_with_the_speed_of_the_cloth() -> None:
    energies = [mean_energy(film(12, speed=speed)) for speed in (0.0, 0.5, 1.0, 2.0, 4.0)]
    assert energies == sorted(energies)
    assert energies[0] < 0.02 * energies[-1]


def test_energy_is_the_mean_change_over_the_picture_for_a_known_motion() -> None:
    """Stripes 70 sin(x/6) moving 2 pixels a frame change by 140 sin(1/6) |cos|: 2/π of that on
    average, on 1/9."""
    expected = 140 * np.sin(1 / 6) * (2 / np.pi) * (40 / SIZE) ** 2 / 0.04
    # Averaging over 2-pixel blocks and the 3 σ taken off each change take a few per cent.
    assert mean_energy(film(12, speed=2.0, noise=0.3)) == pytest.approx(expected, rel=0.15)


def test_flicker_and_exposure_are_no_motion() -> None:
    gain = 1 + 0.1 * np.sin(np.arange(12) * 1.9)
    still, moving = mean_energy(film(12, gain=gain)), mean_energy(film(12, gain=gain, speed=2.0))
    assert still < 0.02 * moving
    assert moving == pytest.approx(mean_energy(film(12, speed=2.0)), rel=0.1)
    assert "brightness-flicker" in {
        finding.kind for finding in motion_energy(film(12, gain=gain)).findings
    }


def test_a_shaking_camera_is_noted_and_mostly_taken_out() -> None:
    shake = stream(4, "shake").normal(0, 0.7, (12, 2))
    moved = motion_energy(film(12, shake=shake, area=20))
    assert "camera-shake" in {finding.kind for finding in moved.findings}
    images = np.stack([image for _, image in film(12, shake=shake, area=20)]).astype(float)
    raw = np.abs(np.diff(images, axis=0)).mean() / 0.04
    assert np.mean(moved.energy) < 0.1 * raw


def test_noise_alone_is_no_motion() -> None:
    quiet, loud = mean_energy(film(12, noise=0.5)), mean_energy(film(12, noise=5.0))
    assert loud < 0.02 * mean_energy(film(12, noise=5.0, speed=2.0))
    assert quiet < 0.02 * mean_energy(film(12, noise=0.5, speed=2.0))


def test_a_constant_picture_says_that_nothing_moves() -> None:
    frames = [(index * PERIOD, np.full((60, 80), 90, dtype=np.uint8)) for index in range(5)]
    series = motion_energy(frames)
    assert not np.any(series.energy)
    assert [finding.kind for finding in series.findings] == ["no-motion"]


def test_energies_stand_midway_between_their_frames_and_gaps_are_not_compared() -> None:
    frames = film(6, speed=1.0)
    late = [
        (time if index < 3 else time + 2_000_000_000, image)
        for index, (time, image) in enumerate(frames)
    ]
    series = motion_energy(late)
    assert series.time[0] == PERIOD // 2
    assert np.isnan(series.energy).tolist() == [False, False, True, False, False]


def test_films_that_cannot_be_compared_say_so() -> None:
    cases = [
        ([], "two frames"),
        (film(1), "two frames"),
        ([*film(2), (3 * PERIOD, np.zeros((50, 60), dtype=np.uint8))], "one size"),
        ([film(2)[1], film(2)[0]], "in order"),
    ]
    assert not unrefused(lambda frames: motion_energy(frames), cases, InputError)


def test_series_that_make_no_sense_are_refused() -> None:
    cases = [
        ([0, 1], [1.0], "one energy a time"),
        ([1, 1], [1.0, 1.0], "do not increase"),
        ([0, 1], [1.0, -1.0], "negative"),
    ]
    assert (
        unrefused(
            lambda time, energy: MotionSeries(
                time=np.array(time, dtype=np.int64), energy=np.array(energy)
            ),
            cases,
            InputError,
        )
        == []
    )
