"""Verification 1: what free motion conserves, and how well."""

from __future__ import annotations

import math

import numpy as np
import torch

from sim.cloth.material import named_material
from sim.cloth.state import State
from sim.integrate import BackwardEuler, advance
from tests.verification.cases import KICKED_MESH, energy_drift, kicked
from tests.verification.systems import build


def test_free_flight_keeps_momentum_and_angular_momentum() -> None:
    system, state = build(
        KICKED_MESH, [named_material("camel-ponte-roma"), named_material("ivory-rib-knit")]
    )
    state = kicked(state)
    mass = system.cloth.mass.unsqueeze(1)

    def momenta(state: State) -> tuple[torch.Tensor, torch.Tensor]:
        momentum = mass * state.velocity
        return momentum.sum(0), torch.linalg.cross(state.position, momentum, dim=1).sum(0)

    linear, angular = momenta(state)
    for integrate in (
        lambda s: advance(system, s, 0.2, steps=1000),
        lambda s: BackwardEuler(step=2e-3, tolerance=1e-12).advance(system, s, 0.02),
    ):
        after_linear, after_angular = momenta(integrate(state))
        # Internal forces cancel in pairs to rounding: 1000 steps × 1e-16 of the largest summand,
        # with room.
        torch.testing.assert_close(after_linear, linear, rtol=0, atol=1e-10)
        if integrate(state).time > 0.1:
            # Forces have no moment about the positions they are taken at, so leapfrog keeps angular
            # momentum too; the linearised backward Euler step does not.
            torch.testing.assert_close(after_angular, angular, rtol=0, atol=1e-10)


def test_undamped_vibration_keeps_energy_to_second_order_in_the_step() -> None:
    # A symplectic method of order 2 conserves a modified energy, H + O(h²): the error stays bounded
    # and falls by 4 as h halves (Hairer, Lubich, Wanner, Geometric Numerical Integration, IX.8).
    def worst(duration: float, share: float) -> float:
        return float(np.abs(energy_drift(duration=duration, share=share)).max())

    coarse, fine, finer = (worst(0.5, share) for share in (0.4, 0.2, 0.1))
    assert coarse < 0.02
    assert 1.8 < math.log2(coarse / fine) < 2.2
    assert 1.8 < math.log2(fine / finer) < 2.2
    # Bounded: a drift would grow fourfold in four times the duration; a longer look at a bounded
    # swing does not.
    assert worst(2.0, 0.2) < 2.5 * fine


def test_declared_damping_takes_energy_and_nothing_gives_any() -> None:
    system, state = build(KICKED_MESH, [named_material("camel-ponte-roma")])
    state = kicked(state)
    first = lowest = float(sum(system.energies(state).values()))
    for _ in range(20):
        state = advance(system, state, 0.02, steps=400)
        energy = float(sum(system.energies(state).values()))
        # The stiffness is frozen at each strain, so that this material's energy is not exact: 2 %
        # of room.
        assert energy < 1.02 * lowest
        lowest = min(lowest, energy)
    assert lowest < 0.98 * first
