"""What is simulated: pairs of the base model's flags, null experiments, and batches with effects
and other meshes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flagdata.core.rng import stream
from measure.cloth import (
    TOGETHER,
    Design,
    Discretisation,
    Flag,
    FlagBatch,
    Log,
    lasting,
    nulls,
    pairs,
    weighable,
)

FLAG = Flag(length=1.5, height=1.0)
EFFECTS = {one.name: one for one in weighable(FLAG)}


@pytest.fixture(scope="module")
def design() -> Design:
    times = np.arange(-20.0, 62.0)
    return Design(
        flag=FLAG,
        log=Log(times=times, speed=5.0 + np.sin(times / 5), distance=3.0),
        duration=60.0,
        count=64,
    )


def few(design: Design) -> FlagBatch:
    """One flag of it in 5 s."""
    batch = design.batches()[-1]
    return replace(
        batch,
        values={name: own[:1] for name, own in batch.values.items()},
        places=batch.places[:1],
        seeds=batch.seeds[:1],
        duration=5.0,
        columns=6,
    )


def test_a_pair_shares_cloth_place_and_turbulence_with_a_flag_without_the_effect(
    design: Design,
) -> None:
    made = pairs(design, EFFECTS["lift.coefficient"], until=40.0)
    seeds = [seed for batch in design.batches() for seed in batch.seeds]
    values = design.values()
    for number, batch in enumerate(made.batches):
        own = made.indices[number * TOGETHER : (number + 1) * TOGETHER]
        assert [seeds[place] for place in own] == list(batch.seeds)
        assert np.array_equal(values["area_weight"][own], batch.values["area_weight"])
        assert np.array_equal(values["azimuth"][own], batch.places[:, 0, 0])
        assert batch.until == 40.0
        assert batch.step == max(one.step or 0.0 for one in design.batches())
    assert ((made.strengths >= 0.3) & (made.strengths <= 8.0)).all()


def test_more_kinds_of_nulls_leave_the_first_ones_as_they_are(design: Design) -> None:
    (few_kinds,), (many,) = (nulls([design], [0], kinds=kinds, seed=3) for kinds in (2, 5))
    for one, other in zip(few_kinds, many[:2], strict=True):
        assert one.content() == other.content()


def test_a_null_cloth_is_one_in_all_recordings_and_so_is_a_shared_place(design: Design) -> None:
    shared = nulls([design, design], [0, 0], kinds=1, seed=3)
    apart = nulls([design, design], [0, 1], kinds=1, seed=3)
    for name in ("area_weight", "bending", "damping", "stretching", "fabric"):
        assert np.array_equal(apart[0][0].values[name], apart[1][0].values[name])
    assert np.array_equal(shared[0][0].places, shared[1][0].places)
    assert not np.array_equal(apart[0][0].places, apart[1][0].places)


def test_cloths_that_damp_little_are_simulated_by_leapfrog_and_no_others(design: Design) -> None:
    (made,) = nulls([design], [0], kinds=40, seed=3)
    explicit = [batch.values["damping"].max() for batch in made if batch.step is None]
    others = [batch.values["damping"].min() for batch in made if batch.step is not None]
    assert max(explicit) <= 1e-3 <= min(others)
    assert 4 <= len(explicit) <= 20  # ln 4 / ln 160 of 40 are 11


@pytest.mark.parametrize(("recordings", "seconds"), [(1, 60.0), (2, 60.0), (3, 40.0), (12, 20.0)])
def test_flags_with_effects_are_simulated_in_two_minutes_of_all_recordings(
    design: Design, recordings: int, seconds: float
) -> None:
    assert lasting(recordings) == seconds


def test_a_film_of_which_a_part_is_simulated_shows_the_same_in_it(design: Design) -> None:
    whole, part = few(design).read(), replace(few(design), until=2.5).read()
    assert part.shape[2] == 1
    assert np.array_equal(whole[:, :, :1], part, equal_nan=True)


def test_an_effect_moves_what_a_flag_shows_and_none_at_its_null_value(design: Design) -> None:
    plain, column = (
        replace(few(design), until=2.5),
        EFFECTS["tangential-linear-drag.coefficient"].column,
    )
    none, strong = (replace(plain, effects=((column, np.array([s])),)).read() for s in (0.0, 1.0))
    assert np.array_equal(plain.read(), none, equal_nan=True)
    assert abs(strong - none)[0, 0, 0, 1] > 0.01  # extension


def test_another_mesh_covers_the_same_cloth() -> None:
    fit = FLAG.mesh(12)
    for seed in range(4):
        kind = Discretisation.drawn(stream(seed, "tests", "kind"), explicit=0.0)
        mesh = kind.mesh(fit)
        assert np.allclose(
            [mesh.rest.min(axis=0), mesh.rest.max(axis=0)],
            [fit.rest.min(axis=0), fit.rest.max(axis=0)],
        )
        assert len(FLAG.handles(mesh).vertices) == 2
