"""Which effects the compiled kernel has, and that what it computes is what torch defines.

An effect's C++ stands beside its torch file; where any part of what acts has none, all of it runs by torch.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
import torch

from sim.air import AIR_FORCES, Stokes
from sim.effects import EFFECTS
from sim.effects.field import FieldEffect, Seen
from sim.integrate.backend import Backend
from sim.integrate.implicit import BackwardEuler
from sim.integrate.symplectic import advance
from sim.kernel.fused import Kernel
from sim.state import State
from sim.system import System
from tests.contract.test_effects import drawn, flag, with_effect

EFFECTS_BY_TORCH: dict[str, str] = {}
"""Registered effects that have no C++, with the reason."""
AIR_BY_TORCH = {"stokes": "the paper's text in place of the reference simulator's air, used by no data set"}
"""Wind forces that have none."""
IN_THE_BASE = (
    "internal-damping", "hem-mass", "hem-stiffness", "wet-mass", "gusts", "logged-gusts", "direction-change",
    "vertical-wind", "full-hoist", "slack", "tilted-pole",
)  # fmt: skip
"""They change what the base model is given (wind, masses, attachments), so that they need no C++ of their own."""
BESIDE = [name for name in EFFECTS if name not in (*IN_THE_BASE, *EFFECTS_BY_TORCH)]


class Pull(FieldEffect):
    """A field as proposals write it: read when it is run, so that no C++ stands beside it."""

    def acceleration(self, seen: Seen) -> torch.Tensor:
        return seen.upward


def kernel_of(system: System) -> Kernel:
    kernel = Kernel.of(system)
    assert kernel is not None
    return kernel


@pytest.mark.parametrize("name", list(EFFECTS))
def test_every_registered_effect_runs_in_the_kernel_but_for_those_that_are_listed(name: str) -> None:
    system, _ = with_effect(drawn(name), *flag())
    assert system.extra == (name not in IN_THE_BASE)
    assert (kernel_of(system).beside is None) == (name in EFFECTS_BY_TORCH)


@pytest.mark.parametrize("name", list(AIR_FORCES))
def test_every_wind_force_runs_in_the_kernel_but_for_those_that_are_listed(name: str) -> None:
    system, _ = flag()
    changed = replace(system, air=AIR_FORCES[name]())
    assert (kernel_of(changed).beside is None) == (name in AIR_BY_TORCH)


@pytest.mark.parametrize("other", [Pull(), None], ids=["a field", "other air"])
def test_beside_what_has_no_code_all_that_acts_runs_by_torch(other: Any) -> None:
    system, state = with_effect(drawn("lift"), *flag())
    system = replace(system, air=Stokes()) if other is None else other.apply(system, state)[0]
    assert kernel_of(system).beside is None
    runs = [advance(system, state, 0.0012, steps=6, backend=b).velocity for b in (Backend.AUTO, Backend.TORCH)]
    torch.testing.assert_close(runs[0], runs[1], rtol=0, atol=1e-10)


# Sums of some tens of terms, in another order: some tens of roundings of the largest force, or of the air's, of whose
# differences flows are.
@pytest.mark.parametrize(("dtype", "tolerance"), [(torch.float64, 1e-13), (torch.float32, 2e-5)])
@pytest.mark.parametrize("name", BESIDE)
def test_forces_are_those_of_torch(name: str, dtype: torch.dtype, tolerance: float) -> None:
    system, state = with_effect(drawn(name), *flag(dtype=dtype))
    drive = system.drive(state.time, state.time + 0.01)
    moved = 0.97 * state.position.roll(1, 1) + state.position
    memory = system.remembered(state.memory, moved)
    level = state.velocity.roll(1, 0)
    expected = system.extra_force(drive, 0.3, state.time, moved, state.velocity, memory=memory, effect_velocity=level)
    computed = kernel_of(system).extra(drive, 0.3, moved, state.velocity, level, memory=memory)
    air = system.air.plain.force(system.cloth, moved, state.velocity, drive.wind[0])
    assert float(expected.abs().max()) > 0
    assert float((computed - expected).abs().max()) < tolerance * max(float(f.abs().max()) for f in (expected, air))


def leapfrog(system: System, state: State) -> State:
    return advance(system, state, 0.0012, steps=6, backend=Backend.KERNEL)


def implicit(system: System, state: State) -> State:
    return BackwardEuler(step=5e-3, tolerance=1e-10, backend=Backend.KERNEL).advance(system, state, 0.01)


@pytest.mark.parametrize("run", [leapfrog, implicit])
@pytest.mark.parametrize("dtype", [torch.float64, torch.float32])
@pytest.mark.parametrize("name", BESIDE)
def test_a_member_at_null_is_the_base_models_to_the_bit(
    name: str, dtype: torch.dtype, run: Callable[[System, State], State]
) -> None:
    effect: Any = drawn(name)
    nulls = {label: effect.parameters()[label].null for label in effect.strengths()}
    mixed = {label: torch.tensor([null, float(getattr(effect, label)[1])]) for label, null in nulls.items()}
    changed, base = run(*with_effect(replace(effect, **mixed), *flag(dtype=dtype))), run(*flag(dtype=dtype))
    for field in ("position", "velocity"):
        assert torch.equal(getattr(changed, field)[..., 0], getattr(base, field)[..., 0])
    assert not torch.equal(changed.velocity[..., 1], base.velocity[..., 1])


@pytest.mark.parametrize("run", [leapfrog, implicit])
def test_all_effects_together_agree_with_torch(run: Callable[[System, State], State]) -> None:
    system, state = flag()
    for name in EFFECTS:
        system, state = with_effect(drawn(name), system, state)
    assert kernel_of(system).beside is not None
    final = run(system, state)
    if run is leapfrog:
        expected = advance(system, state, 0.0012, steps=6, backend=Backend.TORCH)
    else:
        expected = BackwardEuler(step=5e-3, tolerance=1e-10, backend=Backend.TORCH).advance(system, state, 0.01)
    for field in ("position", "velocity"):
        torch.testing.assert_close(getattr(final, field), getattr(expected, field), rtol=0, atol=1e-9)
    for past, defined in zip(final.memory, expected.memory, strict=True):
        torch.testing.assert_close(past, defined, rtol=0, atol=1e-9)


@pytest.mark.parametrize("run", [leapfrog, implicit])
@pytest.mark.parametrize("name", list(EFFECTS))
def test_both_integrators_with_an_effect_agree_with_torch(name: str, run: Callable[[System, State], State]) -> None:
    system, state = with_effect(drawn(name), *flag())
    final = run(system, state)
    if run is leapfrog:
        expected = advance(system, state, 0.0012, steps=6, backend=Backend.TORCH)
    else:
        expected = BackwardEuler(step=5e-3, tolerance=1e-10, backend=Backend.TORCH).advance(system, state, 0.01)
    torch.testing.assert_close(final.velocity, expected.velocity, rtol=0, atol=1e-9)
