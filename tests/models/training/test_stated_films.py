"""Films as the catalog states them, beside what networks take: each refusal names what to write."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.errors import InputError
from models.maps.crops import Cropping
from models.maps.frontend import FrontEnd
from models.training.stated_films import StatedFilms

FRONT_END = FrontEnd(maps="wave-maps", size=24, frames=30, rate=25.0)
AS_TAKEN, CONDITIONED = Cropping(size=24), Cropping(size=24, conditioned=True)


def films(*of: tuple[int, float]) -> StatedFilms:
    """Films of so many frames at so many Hz."""
    count, rate = np.array([n for n, _ in of]), np.array([hz for _, hz in of])
    return StatedFilms(
        recordings=[f"film-{k}" for k in range(len(of))], count=count, seconds=(count - 1) / rate
    )


@pytest.mark.parametrize(
    ("made", "cropping", "told", "fix"),
    [
        (
            films((60, 25.0), (60, 30.0)),
            AS_TAKEN,
            "1 of 2 films have another rate",
            "write conditioned = true in [input]",
        ),
        (
            films((60, 30.0), (90, 30.0)),
            AS_TAKEN,
            "2 of 2 films have another rate",
            "write rate = 30 in [input]",
        ),
        (
            films((60, 25.0), (22, 25.0)),
            AS_TAKEN,
            "1 of 2 films are shorter",
            "write frames = 22 in [input]",
        ),
        (
            films((3, 25.0)),
            AS_TAKEN,
            "1 of 1 films are shorter",
            "learn from films of 4 frames or more",
        ),
        (
            films((60, 30.0), (60, 16.0)),
            CONDITIONED,
            "1 of 2 films are too slow",
            "write rate = 16 in [input]",
        ),
        (
            films((31, 60.0)),
            CONDITIONED,
            "1 of 1 films are shorter",
            "write frames = 13 in [input]",
        ),
    ],
)
def test_what_a_recipe_cannot_be_trained_on_is_refused_with_the_line_that_mends_it(
    made: StatedFilms, cropping: Cropping, told: str, fix: str
) -> None:
    with pytest.raises(InputError) as refused:
        made.check_learned(FRONT_END, cropping)
    assert told in refused.value.what
    assert fix in refused.value.fix
    assert refused.value.where is not None
    assert refused.value.where.startswith("recording film-")


@pytest.mark.parametrize(
    "fixed",
    [
        FrontEnd(maps="wave-maps", size=24, frames=13),
        FrontEnd(maps="wave-maps", size=24, rate=60.0),
    ],
)
def test_the_line_that_is_named_mends_it(fixed: FrontEnd) -> None:
    films((31, 60.0)).check_learned(fixed, CONDITIONED)


def test_films_of_any_rate_are_judged_that_are_long_and_fast_enough() -> None:
    films((60, 25.0), (60, 30.0), (30, 25.2), (50, 20.0)).check_judged(
        FRONT_END, AS_TAKEN, model="m"
    )
    with pytest.raises(
        InputError, match=r"2 of 3 films cannot give clips of 30 frames at 25 Hz, .* the model 'm'"
    ):
        films((60, 25.0), (60, 19.0), (29, 25.0)).check_judged(FRONT_END, AS_TAKEN, model="m")
