"""Films that are made fit before networks learn from them: at the network's instants, whatever the
film's rate."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import flagdata
from flagdata.core.arrays import FloatArray, UInt8Array
from flagdata.core.json_values import json_values
from flagdata.errors import InputError, UnknownNameError, UsageError
from flagdata.lake import Lake
from models.training import (
    FitFilm,
    Prepared,
    TrainingRecipe,
    parse,
    prepare_clips,
    prepare_films,
    sides_of,
)
from models.training.stated_films import StatedFilms
from tests.models.conftest import fill
from tests.small import TRAINING

SIDE = 64
CONDITIONED = "variants = 2\nconditioned = true\n"
DUSK = "[input.augment.dusk]\nshare = 1.0\nlow = 0.3\nhigh = 0.6\n"


def swinging(times: FloatArray) -> UInt8Array:
    """(n, 64, 64) a bright patch on a still background, whose place across swings by 6 px in one
    second."""
    y, x = np.mgrid[:SIDE, :SIDE]
    background = 60 + 25 * np.sin(0.7 * x) * np.cos(0.9 * y)
    place = _place(times)[:, None, None]
    patch = np.exp(-(((x - place) / 9) ** 4) - ((y - 32) / 12) ** 4)
    return np.rint(background * (1 - patch) + 220 * patch).astype(np.uint8)


def _place(times: FloatArray) -> FloatArray:
    return 32 + 6 * np.sin(2 * np.pi * times)


@pytest.mark.parametrize("rate", [24.0, 30.0, 50.0, 60.0])
def test_a_film_of_any_rate_is_shown_at_the_networks_instants(rate: float) -> None:
    times = np.arange(round(1.7 * rate)) / rate
    film = replace(
        FitFilm.of(swinging(times), times, size=SIDE), frames=swinging(times)
    )  # nothing frozen
    first = int(film.starts(30, 25.0)[-1])
    clip, instants = film.clip(first, 30, 25.0)
    assert np.diff(instants) == pytest.approx(np.full(29, 0.04))
    weight = (clip[:, SIDE // 2] > 150).astype(float)
    centre = (weight * np.arange(SIDE)).sum(axis=1) / weight.sum(axis=1)
    # Shown by the nearer frame up to 0.25 of its period (0.4 at 24 Hz): 2π · 6 px/s times that, and
    # half a pixel.
    late = 2 * np.pi * 6 * (0.4 if rate < 25 else 0.25) / rate
    assert np.abs(centre - _place(instants)).max() <= late + 0.5


def test_a_film_that_is_too_slow_or_too_short_is_refused() -> None:
    for count, rate in ((40, 15.0), (28, 25.0)):
        times = np.arange(count) / rate
        film = FitFilm.of(swinging(times), times, size=SIDE)
        with pytest.raises(InputError, match="cannot give clips of 30 at 25 Hz"):
            film.starts(30, 25.0)


def test_where_two_things_move_the_one_in_the_middle_is_the_flag() -> None:
    """The other one moves more."""
    times = np.arange(40) / 25
    film = np.repeat(swinging(times), 2, axis=2)[:, :, : 2 * SIDE]
    film = np.pad(film, ((0, 0), (32, 32), (0, 0)), mode="edge")
    y, x = np.mgrid[: film.shape[1], : film.shape[2]]
    place = (8 + 7 * np.sin(9 * times))[:, None, None]
    film = np.where(np.abs(x - place) + np.abs(y - 12) < 10, 255, film).astype(np.uint8)
    fit = FitFilm.of(film, times, size=SIDE)
    assert len(fit.found.regions) >= 2
    left, top, right, bottom = fit.found.regions[fit.found.chosen].box
    assert left < film.shape[2] / 2 < right
    assert top < film.shape[1] / 2 < bottom


def recipe(text: str = "", *, extra: str = CONDITIONED) -> TrainingRecipe:
    return parse(TRAINING.replace("variants = 2\n", extra + text), name="small", where="small.toml")


@pytest.fixture(scope="module")
def fast(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A lake whose films have 30 frames a second."""
    path = tmp_path_factory.mktemp("fast") / "lake"
    fill(Lake.create(path), period=33_333_333)
    return path


def films(path: Path, folder: Path, of: TrainingRecipe) -> Prepared:
    pairs = sides_of(flagdata.open(path), of, "validation", at=None)
    return prepare_films(
        pairs,
        of.front_end,
        of.cropping,
        variants=2,
        folder=folder,
        workers=1,
        advance=lambda count: None,
        augment=of.augment,
    )


def test_films_of_another_rate_are_learned_from_once_they_are_conditioned(
    fast: Path, tmp_path: Path
) -> None:
    plain, source = recipe(extra="variants = 2\n"), flagdata.open(fast)
    stated = StatedFilms.of(source.lake, sides_of(source, plain, "train", at=None), at=None)
    with pytest.raises(InputError, match="another rate than the recipe's 25 Hz"):
        stated.check_learned(plain.front_end, plain.cropping)
    conditioned = recipe(extra=CONDITIONED.replace("2", "2\nrate = 25.0", 1))
    with pytest.raises(
        InputError, match=r"the film of 14 frames at 30 Hz cannot give clips of 12 at 25 Hz"
    ):
        films(fast, tmp_path, conditioned)  # 0.43 s of film, 0.44 s of clip
    shorter = parse(
        TRAINING.replace("variants = 2\n", CONDITIONED).replace("frames = 12", "frames = 10"),
        name="s",
        where="s.toml",
    )
    found = films(fast, tmp_path, shorter)
    assert found.maps.shape[:2] == (6, 2)
    pairs = sides_of(flagdata.open(fast), shorter, "validation", at=None)
    judged = prepare_clips(
        pairs,
        shorter.front_end,
        shorter.cropping,
        folder=tmp_path,
        workers=1,
        advance=lambda count: None,
    )
    assert len(judged) == len(pairs)
    assert np.isfinite(judged.batch(np.arange(2), np.zeros(2, dtype=np.int64)).numpy()).all()


def test_what_happens_to_films_shapes_their_inputs_and_the_recipes_hash(
    lake_path: Path, tmp_path: Path
) -> None:
    plain, dusky = recipe(), recipe(DUSK)
    assert (
        len(
            {
                recipe(extra="variants = 2\n").hash,
                plain.hash,
                dusky.hash,
                recipe(DUSK.replace("0.6", "0.5")).hash,
            }
        )
        == 4
    )
    assert dusky.identity()["augment"] == {"dusk": {"share": 1.0, "low": 0.3, "high": 0.6}}
    assert "augment" not in recipe(extra="variants = 2\n").identity()
    assert "conditioned" not in json_values(recipe(extra="variants = 2\n").cropping)
    entries, variant = np.arange(6), np.zeros(6, dtype=np.int64)
    one, other = (
        films(lake_path, tmp_path, of).batch(entries, variant).numpy() for of in (plain, dusky)
    )
    assert np.abs(one - other).max() > 0
    again = films(lake_path, tmp_path, dusky).batch(entries, variant).numpy()
    assert (again == other).all()


def test_disturbances_that_would_not_happen_or_are_unknown_are_refused() -> None:
    with pytest.raises(UsageError, match="not conditioned"):
        recipe(DUSK, extra="variants = 2\n")
    with pytest.raises(UnknownNameError, match="did you mean 'dusk'"):
        recipe(DUSK.replace("dusk", "dsuk"))
    with pytest.raises(UnknownNameError, match="did you mean 'share'"):
        recipe(DUSK.replace("share", "shaer"))
    with pytest.raises(InputError, match="dusk of a share"):
        recipe(DUSK.replace("0.6", "0.2"))
