"""The strip in time: what flutters, what does not, and how its lines are read off."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.errors import InputError
from tests.studies.validation.paper_flag.candidates import Load, effects
from tests.studies.validation.paper_flag.limit_cycle import (
    StripMotion,
    StripRun,
    as_columns,
    simulate,
)

LENGTH, DENSITY = 0.1385, 1.0888
RUN = StripRun(columns=12, stretching=40.0, settle=0.35, duration=0.25, rate=250.0)


def test_a_push_dies_in_the_base_model_and_grows_to_a_limit_cycle_with_reactive_loading() -> None:
    loads = [Load(), Load(), Load(reactive=0.25), Load(reactive=0.25)]
    motion = simulate(
        length=LENGTH,
        mass=0.08,
        rigidity=1.315e-4,
        density=DENSITY,
        speeds=[4.5, 9.0, 2.0, 4.5],
        effects=effects(loads, length=LENGTH, density=DENSITY),
        run=RUN,
    )
    travel = np.ptp(motion.across[:, -1], axis=0) / 2 / LENGTH
    # Pushed by 5 % of the length; the onset with M = ρL/4 is at 3.6 m/s by linear stability.
    assert (travel[:3] < 0.05).all()
    assert 0.2 < travel[3] < 0.45  # measured flags of any kind: 0.2–0.4 L
    # Paper does not stretch: the strip is as long as its rest shape, to the strain of its softened
    # membrane.
    steps = np.hypot(np.diff(motion.along, axis=1), np.diff(motion.across, axis=1)).sum(axis=1)
    assert steps[:, 3] == pytest.approx(LENGTH + LENGTH / (2 * 11.5), rel=0.06)


def test_a_line_is_read_at_fixed_columns_and_not_where_it_is_folded_or_ends() -> None:
    along = np.array([[0.0, 1.0, 2.0], [0.0, 1.0, 0.5]])[..., None]
    across = np.array([[0.0, 2.0, 0.0], [0.0, 1.0, 1.0]])[..., None]
    motion = StripMotion(time=np.arange(2.0), along=along, across=across, arc=np.arange(3.0))
    heights = as_columns(motion, 0, np.array([0.5, 1.5, 2.5]))
    assert heights[0, :2] == pytest.approx([1.0, 1.0])
    assert np.isnan(heights[0, 2])
    assert np.isnan(heights[1]).all()


def test_a_strip_that_cannot_be_simulated_is_refused() -> None:
    with pytest.raises(InputError, match="cannot be simulated"):
        StripRun(columns=2)


def test_the_masses_of_air_follow_the_length() -> None:
    reactive = effects([Load(reactive=0.5)], length=2.0, density=1.2)[0]
    assert float(reactive.mass) == pytest.approx(0.5 * 1.2 * 2.0)
