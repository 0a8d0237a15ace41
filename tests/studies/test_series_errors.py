"""How a series of windows errs: constants recovered from errors drawn with known ones, and films of
half steps."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.core.rng import stream
from flagdata.errors import InputError
from tests.studies.long_films import LongFilm
from tests.studies.series_errors import FilmErrors, half_steps, series_errors, size_of, spread


def drawn(shared: float, own: float, *, films: int, seed: int) -> list[FilmErrors]:
    """Errors of 19 windows half a window apart: white noise of half windows, w₂ₖ + w₂ₖ₊₁, gives a
    correlation of a half at half a step and none from one step on."""
    rng = stream(seed, "films")
    out = []
    for _ in range(films):
        sigma = rng.uniform(0.15, 0.25) * np.ones(19)
        white = rng.normal(size=20) / np.sqrt(2)
        out.append(
            FilmErrors(
                off=sigma * (shared * rng.normal() + own * (white[:-1] + white[1:])), sigma=sigma
            )
        )
    return out


def test_the_constants_of_errors_that_were_drawn_are_found() -> None:
    opened, stated = drawn(0.9, 0.5, films=3000, seed=1), drawn(0.4, 0.6, films=3000, seed=2)
    found = series_errors(opened, stated, source="drawn")
    assert found.opened.shared == pytest.approx(0.9, abs=0.03)
    assert found.opened.own == pytest.approx(0.5, abs=0.01)
    assert found.stated.shared == pytest.approx(0.4, abs=0.03)
    assert found.stated.own == pytest.approx(0.6, abs=0.01)
    assert found.halves == pytest.approx(0.5, abs=0.02)
    assert found.neighbours == pytest.approx(0.0, abs=0.02)


def test_films_without_a_shared_error_have_none() -> None:
    films = drawn(0.0, 0.5, films=2000, seed=3)
    assert series_errors(films, films, source="drawn").opened.shared < 0.1


def test_the_spread_contains_what_was_drawn() -> None:
    films = drawn(0.8, 0.5, films=20, seed=4)
    low, high = spread(films, films, seed=0)["open.shared"]
    assert low < 0.8 < high
    assert high - low < 0.8


def test_too_few_films_are_refused() -> None:
    films = drawn(0.8, 0.5, films=9, seed=5)
    with pytest.raises(InputError, match="ten or more"):
        series_errors(films, films, source="drawn")


def test_windows_half_a_window_apart_have_the_wind_of_their_own_time() -> None:
    frames = np.arange(3 * 4, dtype=np.uint8).reshape(3, 4, 1, 1)
    film = LongFilm(
        dataset="made",
        windows=frames,
        parameters={"width": 1.5, "height": 1.2},
        winds=np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]]),
    )
    windows, winds = half_steps(film)
    assert windows[:, 0, 0, 0].tolist() == [0, 2, 4, 6, 8]
    assert winds.tolist() == [1.5, 2.5, 3.5, 4.5, 5.5]
    assert (size_of(film).length, size_of(film).height) == (1.5, 1.2)
