"""Added mass makes and loses no energy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from sim.air import QuadraticNormal
from sim.effects.added_mass import AddedMass
from sim.effects.effect import apply
from sim.inertia import mean_normal_rates, mean_normals
from sim.integrate.symplectic import Backend, advance
from sim.mesh import grid


def test_a_tumbling_sheet_keeps_its_own_and_the_airs_energy(make_system, plain) -> None:
    """Σ ½ m v² + ½ m_a A (v·n)² + elastic, of a sheet that spins, folds and shakes without gravity or wind. The force
    −m_a V̇ n has the power −d(½ m_a V²)/dt; the integrator's error is of second order."""
    mesh = grid(width=0.6, height=0.4, columns=4, rows=3)
    system, state = make_system(mesh, [plain], air=QuadraticNormal(density=0.0))
    u, v = mesh.rest.T
    spin = np.stack([3 * np.sin(5 * u) + 2 * v, 4 * v - 1, -4 * u + np.cos(7 * v)], axis=1)
    system, state = apply([AddedMass(mass=0.5)], system, replace(state, velocity=torch.tensor(spin)[..., None]))
    areas = torch.tensor(mesh.vertex_areas)[:, None]

    def energy(at) -> float:
        across = (at.velocity * mean_normals(system.cloth, at.position)).sum(1)
        return float((sum(system.energies(at).values()) + (0.25 * areas * across**2).sum(0))[0])

    finals = [advance(system, state, 0.4, steps=steps, backend=Backend.TORCH) for steps in (800, 1600)]
    errors = [abs(energy(final) / energy(state) - 1) for final in finals]
    assert errors[1] < 2e-3
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


def test_normals_turn_at_the_rate_of_differences(make_system, plain, distorted) -> None:
    system, state = make_system(distorted, [plain])
    wave = 0.05 * torch.sin(9 * state.position[:, 1:2])
    position = state.position + torch.cat([wave, 0 * wave, 0 * wave], dim=1)
    velocity = torch.cos(7 * position.roll(1, 1))
    step = 1e-5
    above, below = (mean_normals(system.cloth, position + sign * step * velocity) for sign in (1, -1))
    # Central differences: errors of the order of the step squared.
    torch.testing.assert_close(
        mean_normal_rates(system.cloth, position, velocity), (above - below) / (2 * step), rtol=0, atol=1e-7
    )  # fmt: skip
