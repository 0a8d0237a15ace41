"""Long films of a model's own cloths: their number, length, truth and seeds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flagdata.errors import InputError
from models.networks.targets import truth
from models.trained import estimator
from models.trained.estimator import Estimator
from sim.datasets import load
from tests.studies.dependence import columns_of, errors
from tests.studies.long_films import LongFilm, _casts, _shares, gusty, simulated


@pytest.fixture(scope="module")
def shipped() -> Estimator:
    return estimator.load_shipped("flow")


@pytest.fixture(scope="module")
def films(shipped: Estimator) -> list[LongFilm]:
    return list(simulated(shipped, count=5, windows=2, seed=3))


def test_data_sets_share_the_films_as_they_share_the_training_sequences(shipped: Estimator) -> None:
    # 2,400, 800 and 800 sequences.
    assert _shares(shipped, 5) == {"flagsim-wide": 3, "flagsim-fabrics": 1, "flagsim-damped": 1}
    assert _shares(shipped, 200) == {
        "flagsim-wide": 120,
        "flagsim-fabrics": 40,
        "flagsim-damped": 40,
    }


def test_a_film_goes_on_from_window_to_window_and_moves(
    films: list[LongFilm], shipped: Estimator
) -> None:
    assert [film.dataset for film in films] == ["flagsim-wide"] * 3 + [
        "flagsim-fabrics",
        "flagsim-damped",
    ]
    for film in films:
        assert film.windows.shape == (2, shipped.front_end.frames, 300, 300)
        assert film.windows.dtype == np.uint8
        steps = np.abs(np.diff(film.windows.reshape(-1, 300, 300).astype(float), axis=0)).mean(
            axis=(1, 2)
        )
        across = steps[shipped.front_end.frames - 1]
        assert 0 < across < 3 * np.median(steps)


def test_films_state_the_models_quantities(films: list[LongFilm], shipped: Estimator) -> None:
    known = truth(
        columns_of([film.parameters for film in films]), shipped.learners[0].scaling.names
    )
    assert np.isfinite(known).all()
    assert len(np.unique(known[:, 0])) == len(films)
    assert ((known[:3, 1] >= 0.10) & (known[:3, 1] <= 0.17)).all()


def test_the_same_seed_gives_the_same_films_and_another_others(
    films: list[LongFilm], shipped: Estimator
) -> None:
    again, other = (
        next(iter(simulated(shipped, count=5, windows=2, seed=seed))) for seed in (3, 4)
    )
    assert again.parameters == films[0].parameters
    np.testing.assert_array_equal(again.windows, films[0].windows)
    assert other.parameters["wind_speed"] != again.parameters["wind_speed"]


def test_what_cannot_be_measured_is_refused(films: list[LongFilm], shipped: Estimator) -> None:
    with pytest.raises(InputError, match="ten or more"):
        errors(shipped, films)
    bare = replace(shipped, card={"name": "bare"})
    with pytest.raises(InputError, match="what it was trained on"):
        next(simulated(bare, count=10, windows=2, seed=0))


def test_films_in_gusts_state_the_wind_of_each_half_of_a_window() -> None:
    model = estimator.load_shipped()
    (film,) = gusty(
        model,
        dataset="outdoor-damped",
        count=1,
        windows=2,
        seed=5,
        speed=(6.0, 7.0),
        intensity=(0.2, 0.25),
    )
    assert film.windows.shape[:2] == (2, model.front_end.frames)
    assert film.winds.shape == (2, 2)
    assert 0.2 <= film.parameters["gusts.intensity"] <= 0.25
    assert 6.0 <= film.parameters["wind_speed"] <= 7.0
    assert np.ptp(film.winds) > 0
    np.testing.assert_allclose(film.winds, film.parameters["wind_speed"], rtol=0.8)


def test_steady_films_have_one_wind(films: list[LongFilm]) -> None:
    for film in films:
        np.testing.assert_allclose(film.winds, film.parameters["wind_speed"], rtol=1e-6)


def test_cloths_that_are_drawn_by_batches_are_so_in_long_films_too_at_the_models_rate() -> None:
    recipe = load("outdoor")
    wanted = replace(
        recipe.simulation,
        seed=4,
        count=20,
        batch=8,
        time=replace(recipe.simulation.time, frames=90),
    )
    casts = list(_casts(recipe, wanted))
    assert [cast.simulation.count for cast in casts] == [8, 8, 4]
    assert len({cast.stated["height"] for cast in casts}) == 3
    assert len({cast.simulation.seed for cast in casts}) == 3
    assert {(cast.simulation.time.rate, cast.simulation.time.frames) for cast in casts} == {
        (25.0, 90)
    }
    (together,) = _casts(load("flagsim-wide"), wanted)
    assert together.simulation == wanted
