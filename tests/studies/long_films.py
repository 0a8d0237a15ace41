"""Long films of the cloths that a model was trained on, with their truth, which show what its
windows have in common.

Films of a training set are two seconds long, in which two windows overlap. Here the same scenes are
simulated for longer, from seeds of their own, and filmed by one camera each, with the data set's
noise and coding. Nothing is stored.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from flagdata.core.arrays import FloatArray, UInt8Array
from flagdata.core.rng import child_seed
from flagdata.errors import InputError
from flagdata.recipes.typed_tables import Range
from flagdata.record import decode
from models.trained.estimator import Estimator
from models.training import DataSpec, FitFilm
from sim.assets import Assets
from sim.datasets import (
    EPOCH,
    Cast,
    DatasetRecipe,
    PlannedFilm,
    build_jobs,
    camera_picture,
    load,
    velocities,
)
from sim.datasets.cast import of_group
from sim.datasets.film_record import parameters_of
from sim.run import Crew, Recipe, recipe_of
from sim.run.members import Member

_SIDE = "train"
_BATCH = 8
"""Cloths that are simulated together; a long sequence of one takes 2 MB."""
_GUSTY_BATCH = 4
"""The same of films in gusts: cloths of one height and one attachment."""
_AIR_RATE = 25.0
"""Hz, at which the air is sampled."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LongFilm:
    """One cloth in one wind before one camera.

    Attributes:
        dataset: whose scene, light and camera it was drawn from.
        windows: (k, frames, height, width) uint8, gray, one right after the other.
        parameters: name → value, SI, as simulated records state them.
        winds: (k, 2) mean horizontal speed of the undisturbed air over both halves of each window
            [m/s].
    """

    dataset: str
    windows: UInt8Array
    parameters: dict[str, float]
    winds: FloatArray


def simulated(model: Estimator, *, count: int, windows: int, seed: int) -> Iterator[LongFilm]:
    """Films of so many windows of a model's length.

    The data sets that the network was trained on share the films as they share its training
    simulations. A cloth that cannot be simulated to the end is left out.

    Args:
        count: of films.
        windows: of each.
        seed: of all of them.

    Raises:
        InputError: a model whose card does not say what it was trained on.
    """
    for name, share in _shares(model, count).items():
        yield from _of_dataset(
            load(name), share, model, windows=windows, seed=child_seed(seed, "long-films", name)
        )


def gusty(
    model: Estimator,
    *,
    dataset: str,
    count: int,
    windows: int,
    seed: int,
    speed: tuple[float, float],
    intensity: tuple[float, float],
) -> Iterator[LongFilm]:
    """Films of the cloths of one data set in gusts of the von Kármán spectrum
    (`sim.effects.gusts`).

    Args:
        dataset: whose cloths, light and cameras are drawn.
        count: of films.
        windows: of each.
        seed: of all of them.
        speed: least and largest mean wind [m/s].
        intensity: least and largest standard deviation along the wind over its mean.
    """
    recipe = load(dataset)
    low, high = intensity
    overrides = {"effects": {"gusts": {"intensity": {"low": low, "high": high}}}}
    simulation = replace(
        recipe.simulation,
        wind=replace(recipe.simulation.wind, speed=Range(low=speed[0], high=speed[1])),
        effects=recipe_of("flag-outdoor-damped", overrides).effects,
    )
    blown = replace(recipe, simulation=simulation)
    yield from _of_dataset(
        blown,
        count,
        model,
        windows=windows,
        seed=child_seed(seed, "gusty-films", dataset),
        batch=_GUSTY_BATCH,
    )


def _shares(model: Estimator, count: int) -> dict[str, int]:
    """Data set → films, in proportion to its training sequences."""
    recipe = model.card.get("recipe")
    if not isinstance(recipe, dict) or "data" not in recipe:
        raise InputError(
            f"the card of the model {model.name!r} does not say what it was trained on",
            where="recipe.data",
            fix="give a model that was trained by a recipe",
        )
    names = DataSpec.of_identity(recipe["data"]).datasets
    each = np.array([load(name).side(_SIDE).sequences for name in names])
    ends = np.rint(count * np.cumsum(each) / each.sum()).astype(int)
    return dict(zip(names, np.diff(ends, prepend=0).tolist(), strict=True))


def _of_dataset(
    recipe: DatasetRecipe,
    count: int,
    model: Estimator,
    *,
    windows: int,
    seed: int,
    batch: int = _BATCH,
) -> Iterator[LongFilm]:
    frames = model.front_end.frames
    time = replace(recipe.simulation.time, frames=windows * frames, rate=model.front_end.rate)
    simulation = replace(
        recipe.simulation,
        name=f"{recipe.name}-long",
        seed=seed,
        count=count,
        batch=batch,
        time=time,
    )
    for cast in _casts(recipe, simulation):
        crew = Crew(cast.simulation)
        bases: dict[int, list[int]] = {}
        for index in range(cast.simulation.count):
            bases.setdefault(crew.member(index).base, []).append(index)
        for base, indices in bases.items():
            for first in range(0, len(indices), batch):
                yield from _batch(
                    recipe, cast, base, indices[first : first + batch], model, windows
                )


def _casts(recipe: DatasetRecipe, simulation: Recipe) -> Iterator[Cast]:
    """The films' cloths: together, or batch by batch where each draws its own shape; the rate is
    the model's."""
    side = recipe.side(_SIDE)
    if recipe.groups is None:
        yield Cast(side=side, session=None, simulation=simulation)
        return
    groups = replace(recipe.groups, rates=(simulation.time.rate,))
    for first in range(0, simulation.count, simulation.batch):
        few = replace(simulation, count=min(simulation.batch, simulation.count - first))
        yield of_group(few, groups, side, seed=child_seed(simulation.seed, "group", first))


def _batch(
    recipe: DatasetRecipe,
    cast: Cast,
    base: int,
    indices: Sequence[int],
    model: Estimator,
    windows: int,
) -> Iterator[LongFilm]:
    assets, simulation = Assets(photos=recipe.photos), cast.simulation
    for outcome in build_jobs.simulate(simulation, base, indices, "cpu").outcomes:
        if outcome.sequence is None:
            continue
        member = outcome.member
        seed = child_seed(simulation.seed, "film", member.index)
        job = PlannedFilm(
            name=f"{simulation.name}-{member.index}",
            dataset=recipe.name,
            cast=cast,
            index=member.index,
            sequence="",
            seed=seed,
            sequence_seed=member.seed,
            look=seed,
            begin=EPOCH,
            filming={},
        )
        zeta, drawn = (
            recipe.prior.draw(seed, assets),
            camera_picture.settings(recipe.camera, seed=seed),
        )
        seen = build_jobs.shot(recipe, job, outcome.sequence, zeta, assets, device="cpu").numpy()
        film = np.stack(
            decode(
                camera_picture.encode_pictures(seen, drawn, recipe.camera, seed=seed),
                where=job.name,
            )
        )
        if model.cropping.conditioned:
            film = FitFilm.of(film, np.arange(len(film)) / simulation.time.rate).frames
        yield LongFilm(
            dataset=recipe.name,
            windows=film.reshape(windows, -1, *film.shape[1:]),
            parameters=parameters_of(
                member, zeta, {**cast.stated, **drawn}, recipe.anemometer.truth
            ),
            winds=_winds(Crew(simulation), member, windows),
        )


def _winds(crew: Crew, member: Member, windows: int) -> FloatArray:
    """Mean horizontal speed of the undisturbed air at the flag over both halves of each window (k,
    2) [m/s]."""
    time = crew.recipe.time
    half = time.frames / time.rate / windows / 2
    count = round(half * _AIR_RATE)
    times = time.first + (np.arange(2 * windows * count) + 0.5) / count * half
    velocity = velocities(crew.assemble([member])[0], times)
    return np.hypot(velocity[:, 0], velocity[:, 1]).reshape(windows, 2, count).mean(axis=2)
