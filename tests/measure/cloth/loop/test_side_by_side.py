"""The film beside flags that the models simulate."""

from __future__ import annotations

import base64
import io
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from measure.cloth import LEAST_WINDOWS, RATE, Observed, solve, verdict_of
from measure.cloth.observed_recording import Excerpt
from measure.cloth.verdict_page import answer_of_films, drawn, side_by_side
from measure.observables import WINDOW, ClothWindow, FilmWindow
from sim.cloth.mesh import grid
from tests.measure.cloth.loop.conftest import options, recording

_BLUE = (31, 111, 156)


def film(*, scale: float = 40.0, side: float = 1.0) -> FilmWindow:
    """A white bar that moves by two columns a frame; the hoist is at column 50, or 100 for a flag
    that flies left."""
    times = np.arange(round(WINDOW * 25)) / 25
    column, frames = 75 - 25 * side, np.zeros((len(times), 150, 150), np.uint8)
    for number, frame in enumerate(frames):
        frame[:, 2 * number : 2 * number + 10] = 255
    return FilmWindow(
        times=times,
        frames=frames,
        masks=np.zeros(frames.shape, bool),
        shown=np.ones(len(times), bool),
        scale=scale,
        hoist=np.array([[column, 60.0], [column, 60.0 + scale]]),
        side=side,
        length=1.5,
        height=1.0,
    )


def with_film(one: Observed) -> Observed:
    return replace(one, excerpt=Excerpt(number=len(one.readings) - 4, window=film()))


def frames_of(url: str) -> list[Image.Image]:
    picture = Image.open(io.BytesIO(base64.b64decode(url.split(",", 1)[1])))
    found = []
    for number in range(getattr(picture, "n_frames", 1)):
        picture.seek(number)
        found.append(picture.convert("RGB"))
    return found


def test_the_excerpt_is_the_window_nearest_the_middle_of_the_second_half() -> None:
    windows = [film() for _ in range(16)]
    whole, gap = Excerpt.of(windows), Excerpt.of([*windows[:12], None, *windows[13:]])
    assert whole is not None
    assert gap is not None
    assert (whole.number, whole.window) == (12, windows[12])
    assert gap.number in (11, 13)
    assert Excerpt.of([*windows[:8], *([None] * 8)]) is None


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_cloth_is_drawn_as_large_as_in_the_film_and_from_the_films_hoist(side: float) -> None:
    mesh = grid(width=1.5, height=1.0, columns=6, rows=4)
    points = np.tile(mesh.rest - [0.0, 0.5], (2, 1, 1))
    along = mesh.rest[:, 0]
    cloth = ClothWindow(
        times=np.array([0.0, 0.1]),
        points=points,
        faces=mesh.faces,
        hoist=np.flatnonzero(along == 0)[::-1],
        free=np.flatnonzero(along == 1.5)[::-1],
        length=1.5,
        height=1.0,
    )
    picture = drawn(cloth, np.zeros(points.shape[:2]), film(side=side), _BLUE)[0].astype(int)
    rows, columns = np.nonzero(picture[..., 2] - picture[..., 0] > 60)
    # Twice as large as the film's pixels: 1.5 m × 1 m at 80 px/m.
    assert (rows.min(), rows.max()) == pytest.approx((120, 200), abs=1)
    assert (columns.min(), columns.max()) == pytest.approx(
        (100, 220) if side > 0 else (80, 200), abs=1
    )


def test_each_model_flies_in_the_windows_wind_beside_the_film(
    cheap: list[int], tmp_path: Path
) -> None:
    recordings = [
        with_film(recording(mean=4.0, seed=5, effects={"tangential-linear-drag.coefficient": 0.9}))
    ]
    outcome = solve(recordings, options(), folder=tmp_path)
    shown = side_by_side(outcome, 0, after="with drag")
    assert shown is not None
    assert shown.start == 16 * WINDOW
    assert shown.wind == pytest.approx(4 * (1 + 0.15 * math.sin(41.25 / 6)), rel=0.05)
    assert [one.label for one in shown.columns] == ["the film", "base model", "with drag"]
    pictures = [
        np.stack([np.asarray(frame) for frame in frames_of(one.url)]) for one in shown.columns
    ]
    assert {len(one) for one in pictures} == {round(WINDOW * RATE)}
    bar = [float(np.flatnonzero(frame[150, :, 0] > 128).mean()) for frame in pictures[0]]
    assert bar == pytest.approx(
        list(8 * np.arange(31) + 9.5), abs=1
    )  # at every other frame, twice as large
    brown, blue = (np.abs(np.diff(one.astype(int), axis=0)).sum() for one in pictures[1:])
    assert brown > 0
    assert blue > 0
    assert not np.array_equal(pictures[1], pictures[2])


def test_the_page_has_the_film_where_there_is_one(cheap: list[int], tmp_path: Path) -> None:
    one = recording(mean=4.0, seed=5)
    texts = []
    for recordings in ([one], [with_film(one)]):
        outcome = solve(recordings, options(), folder=tmp_path)
        texts.append(answer_of_films(verdict_of(outcome), outcome).page)
    assert "the film, in motion" not in texts[0]
    assert "the film, in motion" in texts[1]
    assert "base model, in motion" in texts[1]
    assert "with " not in texts[1].split("in motion")[-1][:200]


def test_a_recording_without_halves_is_not_shown(cheap: list[int], tmp_path: Path) -> None:
    one = recording(mean=4.0, seed=5)
    count = 2 * LEAST_WINDOWS - 1
    short = replace(
        with_film(one),
        readings=one.readings[:count],
        excerpt=Excerpt(number=count - 2, window=film()),
    )
    recordings = [short, recording(mean=6.5, seed=5)]  # one so short is not judged by itself
    assert side_by_side(solve(recordings, options(), folder=tmp_path), 0, after="") is None
