"""The reactive loading against −m_a (∂t + U ∂x)² η, written out for waves."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from sim.cloth.mesh import grid
from sim.effects import ReactiveLoading
from tests.sim.conftest import PLAIN, make_system

U, K, OMEGA, AMPLITUDE, MASS = 6.0, 9.0, 100.0, 1e-4, 0.4


def convective_error(make_system, plain, columns: int) -> float:
    """Largest error of the convective load per area of a travelling wave, over its size, away from
    the edges."""
    mesh = grid(width=1.0, height=0.3, columns=columns, rows=max(3, columns // 4))
    system, _ = make_system(mesh, [plain])
    u, v = mesh.rest.T
    phase = K * u
    height, rate = AMPLITUDE * np.sin(phase), -OMEGA * AMPLITUDE * np.cos(phase)
    position = torch.tensor(np.stack([u, v, height], axis=1))[..., None]
    velocity = torch.tensor(np.stack([0 * u, 0 * u, rate], axis=1))[..., None]
    wind = torch.tensor([U, 0.0, 0.0], dtype=torch.float64)[:, None]
    force = ReactiveLoading(mass=MASS).force(system.cloth, 0.0, position, velocity, wind)
    load = force[:, 2, 0].numpy() / mesh.vertex_areas
    # η = A sin(k x − ω t) at t = 0: 2 U η_xt = 2 U k ω A sin, U² η_xx = −U² k² A sin.
    expected = -MASS * (2 * U * K * OMEGA - U**2 * K**2) * height
    inner = (u > 0.25) & (u < 0.75) & (v > 0.08) & (v < 0.22)
    return float(np.abs(load - expected)[inner].max() / np.abs(expected).max())


def test_the_load_of_a_travelling_wave_converges_at_second_order() -> None:
    errors = [convective_error(make_system, PLAIN, columns) for columns in (20, 40, 80)]
    assert errors[2] < 0.02
    rates = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    # Central differences on a wide stencil: (k Δ)²/3 for each derivative, 0.4 % at 80 columns.
    assert rates.min() > 1.75


def test_a_rigid_plate_in_steady_translation_feels_no_load(square, inclined) -> None:
    """Its normal and its velocity relative to the air are constant: D V = 0, at any incidence."""
    system, _ = make_system(square, [PLAIN])
    position = inclined(square, 0.6)
    velocity = torch.tensor([1.0, -2.0, 0.5], dtype=torch.float64)[:, None].expand_as(position)
    wind = torch.tensor([6.0, 1.0, 0.0], dtype=torch.float64)[:, None]
    force = ReactiveLoading(mass=MASS).force(system.cloth, 0.0, position, velocity, wind)
    np.testing.assert_allclose(force, 0, atol=1e-11)


def test_a_pitching_plate_feels_the_coriolis_load(square) -> None:
    """η = x φ(t) with φ = 0 now: (∂t + U ∂x)² η = x φ̈ + 2 U φ̇; the convective part is 2 U φ̇ everywhere."""
    system, _ = make_system(square, [PLAIN])
    u, v = square.rest.T
    position = torch.tensor(np.stack([u, v, 0 * u], axis=1))[..., None]
    rate = 0.8
    velocity = torch.tensor(np.stack([0 * u, 0 * u, rate * u], axis=1))[..., None]
    wind = torch.tensor([U, 0.0, 0.0], dtype=torch.float64)[:, None]
    force = ReactiveLoading(mass=MASS).force(system.cloth, 0.0, position, velocity, wind)
    np.testing.assert_allclose(
        force[:, 2, 0], -MASS * 2 * U * rate * square.vertex_areas, rtol=1e-10
    )


def test_a_still_curved_sheet_in_a_stream_is_pushed_away_from_its_centre() -> None:
    """η = κ x²/2: the load is −m_a U² κ everywhere, the centrifugal force that acts as compression on a flag."""
    mesh = grid(width=1.0, height=0.3, columns=40, rows=12)
    system, _ = make_system(mesh, [PLAIN])
    u, v = mesh.rest.T
    position = torch.tensor(np.stack([u, v, 0.01 * u**2 / 2], axis=1))[..., None]
    wind = torch.tensor([U, 0.0, 0.0], dtype=torch.float64)[:, None]
    force = ReactiveLoading(mass=MASS).force(
        system.cloth, 0.0, position, torch.zeros_like(position), wind
    )
    inner = (u > 0.1) & (u < 0.9) & (v > 0.05) & (v < 0.25)
    # Slopes reach 0.01: their squares are left out of the closed form. The total, because a patch
    # of a quadratic is not exact vertex by vertex on diagonals that alternate.
    total = force[inner, 2, 0].sum() / mesh.vertex_areas[inner].sum()
    assert float(total) == pytest.approx(-MASS * U**2 * 0.01, rel=0.01)


def test_a_curved_sheet_in_steady_translation_sheds_the_energy_it_gives() -> None:
    """A gutter of radius R from φ = −φ₀ to φ₀ moves at c along its axis of symmetry through still
    air.

    There V = c cos φ, s = c sin φ e_φ, and nothing changes in time: D V = c²/R (½ cos² φ − sin² φ).
    The work on the air, ∫ m_a V (D V) R dφ, is what leaves at the edges φ = ±φ₀, ½ m_a V² s at
    each: m_a c³ cos² φ₀ sin φ₀.
    """
    radius, speed, half = 0.4, 3.0, 1.2
    mesh = grid(width=2 * half * radius, height=0.2, columns=96, rows=8)
    system, _ = make_system(mesh, [PLAIN])
    angle = mesh.rest[:, 0] / radius - half
    position = np.stack([radius * np.cos(angle), radius * np.sin(angle), mesh.rest[:, 1]], axis=1)
    x = torch.tensor(position)[..., None]
    velocity = torch.tensor([speed, 0.0, 0.0], dtype=torch.float64)[:, None].expand_as(x)
    still = torch.zeros((3, 1), dtype=torch.float64)
    force = ReactiveLoading(mass=MASS).force(system.cloth, 0.0, x, velocity, still)[..., 0].numpy()
    load = -MASS * speed**2 / radius * (np.cos(angle) ** 2 / 2 - np.sin(angle) ** 2)
    rows = angle.round(9)
    for value in np.unique(rows)[4:-4]:
        row = rows == value
        outwards = np.array([np.cos(value), np.sin(value), 0.0])
        # Second order in the cell, 0.025 rad; by rows, since alternating diagonals share a row's
        # areas unevenly.
        density = (force[row] @ outwards).sum() / mesh.vertex_areas[row].sum()
        assert density == pytest.approx(load[row][0], abs=5e-3 * np.abs(load).max())
    shed = MASS * speed**3 * np.cos(half) ** 2 * np.sin(half) * 0.2
    given = -force[:, 0].sum() * speed
    # Of first order at the two free edges.
    assert given == pytest.approx(shed, abs=0.02 * MASS * speed**3 * 0.2)


@pytest.mark.parametrize("speed", [0.0, 8.0])
def test_the_loads_terms_scale_as_powers_of_the_stream(square, speed) -> None:
    """For a still, wavy sheet only U² η_xx is left."""
    system, _ = make_system(square, [PLAIN])
    u, v = square.rest.T
    position = torch.tensor(np.stack([u, v, 1e-5 * np.sin(4 * u)], axis=1))[..., None]
    load = ReactiveLoading(mass=MASS)
    wind = torch.tensor([1.0, 0.0, 0.0], dtype=torch.float64)[:, None]
    once = load.force(system.cloth, 0.0, position, torch.zeros_like(position), wind)
    many = load.force(system.cloth, 0.0, position, torch.zeros_like(position), speed * wind)
    torch.testing.assert_close(many, speed**2 * once, rtol=1e-10, atol=1e-16)
