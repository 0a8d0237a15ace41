"""Batches through time: which instants are looked at, and what a divergence leads to, are the
caller's words."""

from __future__ import annotations

import math
import pickle
from dataclasses import dataclass, replace

import numpy as np
import pytest
import torch

from flagdata.errors import FlagdataError
from sim.cloth.material import named_material
from sim.cloth.scene import assemble, flag
from sim.cloth.state import SPEED_LIMIT, State
from sim.cloth.system import System
from sim.run.simulation_loop import Batch, DivergedError, Divergence, after

RATE = 4.0


@dataclass(frozen=True)
class Climbing:
    """An integrator in whose hands cloths climb at 1 m/s; one of them is lost at an instant [s], in
    one way."""

    lost: int | None = None
    at: float = 0.75
    speed: float = math.nan

    def advance(self, system: System, state: State, duration: float) -> State:
        position, velocity = state.position.clone(), state.velocity.clone()
        position[:, 2] += duration
        velocity[:, 2] = 1.0
        if self.lost is not None and state.time < self.at <= state.time + duration + 1e-9:
            velocity[:, 2, self.lost] = self.speed
            position[:, 2, self.lost] += 0 * self.speed
        return replace(state, position=position, velocity=velocity, time=state.time + duration)


def batch(method: Climbing, divergence: Divergence, *, speed_limit: float = SPEED_LIMIT) -> Batch:
    scenes = [
        flag(material=named_material("camel-ponte-roma"), wind_speed=2.0, columns=3)
        for _ in range(3)
    ]
    system, state = assemble(scenes, dtype=torch.float64)
    return Batch(
        system=system,
        state=state,
        integrator=method,
        divergence=divergence,
        speed_limit=speed_limit,
    )


def climbed(run: np.ndarray) -> np.ndarray:
    """(frame, member) mean height [m] above the first frame's first member."""
    return run[:, :, 2].mean(axis=1) - run[0, :, 2].mean(axis=0)[0]


def test_frames_are_those_asked_for_and_the_first_is_the_start() -> None:
    run = batch(Climbing(), Divergence.KEEP).positions(range(4), RATE)
    np.testing.assert_allclose(climbed(run)[:, 0], [0.0, 0.25, 0.5, 0.75], atol=1e-12)


def test_a_recording_begins_a_period_after_the_time_to_settle() -> None:
    numbers = after(1.0, 0.75, RATE)
    assert list(numbers) == [5, 6, 7]
    looked: list[float] = []
    run = batch(Climbing(), Divergence.KEEP).positions(
        numbers, RATE, look=lambda state: looked.append(state.time)
    )
    assert looked == [1.25, 1.5, 1.75]
    assert len(run) == 3


def test_instants_that_are_apart_are_one_call_each() -> None:
    assert [state.time for state in batch(Climbing(), Divergence.KEEP).states([1, 6], RATE)] == [
        0.25,
        1.5,
    ]


@pytest.mark.parametrize("speed", [math.nan, 301.0])
def test_a_divergence_that_is_refused_says_which_member_and_when(speed: float) -> None:
    run = batch(Climbing(lost=1, speed=speed), Divergence.REFUSE)
    with pytest.raises(DivergedError, match=r"member 1 .* before 0\.750 s") as caught:
        run.positions(range(9), RATE)
    assert (caught.value.member, caught.value.time) == (1, 0.75)
    assert isinstance(caught.value, FlagdataError)
    assert pickle.loads(pickle.dumps(caught.value)).member == 1


def test_a_member_that_begins_anew_is_named_and_the_others_go_on() -> None:
    run = batch(Climbing(lost=1), Divergence.RESTART)
    heights = climbed(run.positions(range(6), RATE))
    assert run.diverged == {1: 0.75}
    np.testing.assert_allclose(heights[:, 0], np.arange(6) / RATE, atol=1e-12)
    np.testing.assert_allclose(heights[:, 1], [0.0, 0.25, 0.5, 0.0, 0.25, 0.5], atol=1e-12)


def test_a_run_that_keeps_all_shows_where_a_member_is_lost() -> None:
    run = batch(Climbing(lost=2), Divergence.KEEP)
    finite = np.asarray(np.isfinite(run.positions(range(5), RATE)).all(axis=(1, 2)))
    np.testing.assert_array_equal(finite[:, 2], [True, True, True, False, False])
    assert finite[:, :2].all()
    assert not run.diverged


def test_without_a_speed_limit_fast_cloth_goes_on() -> None:
    run = batch(Climbing(lost=0, speed=1e4), Divergence.REFUSE, speed_limit=math.inf)
    assert len(run.positions(range(9), RATE)) == 9
