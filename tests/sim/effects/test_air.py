"""Effects of the air against closed forms on flat plates, and in fall and swing."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from flagdata.errors import UsageError
from sim.cloth.air import QuadraticNormal, Stokes
from sim.cloth.handles import Handles
from sim.cloth.inertia import mean_normal_rates, mean_normals
from sim.cloth.material import isotropic, named_material
from sim.cloth.mesh import grid
from sim.cloth.scene import Scene, assemble
from sim.effects import (
    EFFECTS,
    AddedMass,
    Lift,
    Permeability,
    Porosity,
    PowerLawDrag,
    TangentialLinearDrag,
    apply,
)
from sim.integrate import advance
from tests.sim.conftest import PLAIN, make_system

AirDensityChange = EFFECTS["air-density"]
TangentialQuadraticDrag = EFFECTS["tangential-quadratic-drag"]

NO_AIR = QuadraticNormal(density=0.0)


def test_linear_friction_along_a_plate_is_c_times_area_times_speed(
    square, inclined, total_force
) -> None:
    system, state = make_system(square, [PLAIN], air=NO_AIR)
    state = replace(state, position=inclined(square, 0.3))
    along = (4 * np.cos(0.3), 0.0, 4 * np.sin(0.3))
    across = (-4 * np.sin(0.3), 0.0, 4 * np.cos(0.3))
    drag = TangentialLinearDrag(coefficient=0.02)
    force = total_force(system, state, drag, wind=along)[:, 0]
    np.testing.assert_allclose(force, 0.02 * np.array(along), rtol=0, atol=1e-12)
    np.testing.assert_allclose(total_force(system, state, drag, wind=across)[:, 0], 0, atol=1e-12)


def test_quadratic_friction_along_a_plate_is_rho_c_area_speed_squared(
    square, inclined, total_force
) -> None:
    system, state = make_system(square, [PLAIN], air=NO_AIR)
    state = replace(state, position=inclined(square, 0.0))
    force = total_force(
        system, state, TangentialQuadraticDrag(coefficient=0.01, density=1.2), wind=(3.0, 4.0, 2.0)
    )
    # w_t = (3, 4, 0), of size 5.
    np.testing.assert_allclose(
        force[:, 0], 1.2 * 0.01 * 5 * np.array([3.0, 4.0, 0.0]), rtol=0, atol=1e-12
    )


@pytest.mark.parametrize("angle", [0.2, -0.4, 1.2])
def test_lift_is_perpendicular_to_the_wind_and_sine_times_cosine(
    square, inclined, total_force, angle
) -> None:
    system, state = make_system(square, [PLAIN], air=NO_AIR)
    state = replace(state, position=inclined(square, angle))
    force = total_force(system, state, Lift(coefficient=2.0, density=1.2), wind=(5.0, 0.0, 0.0))[
        :, 0
    ]
    # A plate that rises downstream (angle > 0) is pushed down: it turns the stream up.
    expected = -0.5 * 1.2 * 2.0 * 25 * np.sin(angle) * np.cos(angle)
    np.testing.assert_allclose(force, [0, 0, expected], rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("effect", "share"), [(Porosity(open_share=0.3), 0.7), (AirDensityChange(change=-0.2), 0.8)]
)
def test_the_normal_force_is_scaled_at_every_speed(
    square, inclined, total_force, effect, share
) -> None:
    system, state = make_system(square, [PLAIN])
    state = replace(state, position=inclined(square, 0.7))
    for speed in (0.1, 10.0):
        base = total_force(system, state, wind=(speed, 0.0, 0.0))
        torch.testing.assert_close(
            total_force(system, state, effect, wind=(speed, 0.0, 0.0)),
            share * base,
            rtol=1e-12,
            atol=1e-14,
        )


def test_factors_on_the_normal_force_multiply(square, inclined, total_force) -> None:
    system, state = make_system(square, [PLAIN])
    state = replace(state, position=inclined(square, 0.7))
    effects = (Porosity(open_share=0.3), AirDensityChange(change=-0.2))
    base = total_force(system, state, wind=(5.0, 0.0, 0.0))
    both = total_force(system, state, *effects, wind=(5.0, 0.0, 0.0))
    torch.testing.assert_close(both, 0.56 * base, rtol=1e-12, atol=1e-14)


def test_seeping_air_and_pressure_balance(square, inclined, total_force) -> None:
    """On a plate across the wind the pressure p = F/A obeys p = ρ (w − κ p)²."""
    system, state = make_system(square, [PLAIN], air=QuadraticNormal(density=1.3))
    state = replace(state, position=inclined(square, np.pi / 2))
    for speed in (0.5, 3.0, 12.0):
        force = total_force(system, state, Permeability(permeability=0.02), wind=(speed, 0.0, 0.0))
        pressure = float(force.norm())
        assert pressure == pytest.approx(1.3 * (speed - 0.02 * pressure) ** 2, rel=1e-12)


def test_factors_need_a_normal_force(square) -> None:
    system, state = make_system(square, [PLAIN], air=Stokes())
    with pytest.raises(UsageError, match="quadratic-normal"):
        apply([Porosity(open_share=0.1)], system, state)


@pytest.mark.parametrize("exponent", [-0.3, 0.0, 0.5, 1.0])
def test_a_falling_sheet_reaches_the_terminal_velocity_of_its_power_law(exponent) -> None:
    """σ g = ρ v² (v/U₀)^(−m): v = (σ g U₀^(−m)/ρ)^(1/(2 − m)); it is approached as e^(−(2 − m) g
    t/v), here e^(−9) or less, and leapfrog sees the drag half a step late, which leaves the balance
    itself untouched."""
    mesh = grid(width=1.0, height=1.0, columns=2, rows=2)
    system, state = make_system(
        mesh, [PLAIN], gravity=(0.0, 0.0, -9.81), air=QuadraticNormal(density=1.2)
    )
    flat = torch.tensor(np.stack([*mesh.rest.T, np.zeros(9)], axis=1))[..., None]
    system, state = apply(
        [PowerLawDrag(exponent=exponent, speed=3.0)], system, replace(state, position=flat)
    )
    final = advance(system, state, 2.0, steps=400)
    expected = (0.2 * 9.81 * 3.0**-exponent / 1.2) ** (1 / (2 - exponent))
    np.testing.assert_allclose(final.velocity[:, 2, 0], -expected, rtol=2e-4)


def test_added_mass_slows_a_swing_by_the_root_of_the_mass_ratio() -> None:
    """A plate that hangs by its upper edge and swings through a small angle: gravity restores the
    cloth's mass, the inertia is that and the air's: periods are as √(1 + m_a/σ) = 2 for m_a = 3
    σ."""
    sheet = isotropic(name="sheet", area_weight=0.2, stretching=40.0, shear=30.0, bending=0.05)
    mesh = grid(width=0.3, height=0.4, columns=1, rows=2)
    system, state = make_system(
        mesh,
        [sheet, sheet],
        gravity=(0.0, 0.0, -9.81),
        air=NO_AIR,
        handles=Handles(vertices=(2, 5), stiffness=float("inf")),
    )
    depth = 0.4 - state.position[:, 2:]
    tilted = state.position + 0.01 * torch.cat([depth, 0 * depth, 0 * depth], dim=1)
    air = AddedMass(mass=torch.tensor([0.0, 0.6], dtype=torch.float64))
    system, state = apply([air], system, replace(state, position=tilted))
    # The sheet hangs through a little first: it starts unstretched, and bobs, without changing what
    # is compared.
    times, tips = [], []
    for _ in range(320):
        state = advance(system, state, 0.01, steps=5)
        times.append(state.time)
        tips.append(state.position[0, 0].numpy())
    zero = [
        np.array(times)[1:][np.diff(np.sign(np.array(tips)[:, member])) != 0] for member in range(2)
    ]
    half_periods = [np.mean(np.diff(crossings)) for crossings in zero]
    # Crossings are known to 0.01 s out of 0.5 s, and averaged over several.
    assert half_periods[1] / half_periods[0] == pytest.approx(2.0, rel=0.02)


def test_added_mass_does_not_change_motion_in_the_plane(square) -> None:
    system, state = make_system(square, [PLAIN], gravity=(0.0, 3.0, -4.0), air=NO_AIR)
    system, state = apply([AddedMass(mass=0.7)], system, state)
    # The sheet stands in the y–z plane and falls freely within it.
    final = advance(system, state, 0.1, steps=20)
    np.testing.assert_allclose(
        final.velocity[:, :, 0], np.tile([0.0, 0.3, -0.4], (49, 1)), rtol=0, atol=1e-12
    )


def test_friction_slows_a_sliding_sheet_exponentially_and_at_second_order_of_the_step() -> None:
    """σ v̇ = −c v along the sheet: v₀ e^(−c t/σ), here e^(−1). Effects see the velocity at the time
    of the force."""
    mesh = grid(width=1.0, height=1.0, columns=2, rows=2)
    system, state = make_system(mesh, [PLAIN], air=NO_AIR)
    sliding = torch.tensor([0.0, 3.0, 0.0], dtype=torch.float64)[:, None].expand_as(state.position)
    system, state = apply(
        [TangentialLinearDrag(coefficient=0.4)], system, replace(state, velocity=sliding)
    )
    errors = []
    for steps in (40, 80):
        final = advance(system, state, 0.5, steps=steps)
        errors.append(float((final.velocity[:, 1] - 3 * np.exp(-1)).abs().max()))
    assert errors[1] < 1e-4
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


def test_pressure_and_weight_are_confounded_where_stiffness_is_free() -> None:
    """Newton's law by the mass: a = g + (pressure + inner forces)/m. So a pressure that is 1.6
    times as large moves a cloth as one that is 1.6 times lighter, and as many times softer in
    stretching and in bending, and no other."""
    flat = grid(width=0.6, height=0.4, columns=6, rows=4)
    cloth = replace(named_material("camel-ponte-roma"), damping=2e-3)
    ends = []
    for material, change in (
        (cloth, 0.6),
        (cloth.scaled(area_weight=1 / 1.6, stretching=1 / 1.6, bending=1 / 1.6), 0.0),
        (cloth.scaled(area_weight=1 / 1.6, bending=1 / 1.6), 0.0),
    ):
        start = np.stack([flat.rest[:, 0], 0 * flat.rest[:, 0], flat.rest[:, 1]], axis=1)
        held = tuple(int(v) for v in np.flatnonzero(flat.rest[:, 0] == 0))
        scene = Scene(
            mesh=flat,
            position=start + 1e-3 * np.sin(7 * flat.rest[:, :1] + 1),
            material=material,
            wind=(4.0, 0.5, 0.0),
            handles=Handles(vertices=held, stiffness=math.inf),
        )
        system, state = assemble([scene])
        if change:
            system, state = apply([AirDensityChange(change=change)], system, state)
        ends.append(advance(system, state, 0.2, steps=800).position.numpy())
    denser, lighter, stiff = ends
    np.testing.assert_allclose(denser, lighter, rtol=0, atol=1e-6)
    assert np.abs(denser - start[..., None]).max() > 0.05
    assert np.abs(denser - stiff).max() > 1e-4


def test_a_tumbling_sheet_keeps_its_own_and_the_airs_energy() -> None:
    """Σ ½ m v² + ½ m_a A (v·n)² + elastic, of a sheet that spins, folds and shakes without gravity
    or wind. The force −m_a V̇ n has the power −d(½ m_a V²)/dt; the integrator's error is of second
    order."""
    mesh = grid(width=0.6, height=0.4, columns=4, rows=3)
    system, state = make_system(mesh, [PLAIN], air=QuadraticNormal(density=0.0))
    u, v = mesh.rest.T
    spin = np.stack([3 * np.sin(5 * u) + 2 * v, 4 * v - 1, -4 * u + np.cos(7 * v)], axis=1)
    system, state = apply(
        [AddedMass(mass=0.5)], system, replace(state, velocity=torch.tensor(spin)[..., None])
    )
    areas = torch.tensor(mesh.vertex_areas)[:, None]

    def energy(at) -> float:
        across = (at.velocity * mean_normals(system.cloth, at.position)).sum(1)
        return float((sum(system.energies(at).values()) + (0.25 * areas * across**2).sum(0))[0])

    finals = [advance(system, state, 0.2, steps=steps) for steps in (400, 800)]
    errors = [abs(energy(final) / energy(state) - 1) for final in finals]
    assert errors[1] < 2e-3
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


def test_normals_turn_at_the_rate_of_differences(distorted) -> None:
    system, state = make_system(distorted, [PLAIN])
    wave = 0.05 * torch.sin(9 * state.position[:, 1:2])
    position = state.position + torch.cat([wave, 0 * wave, 0 * wave], dim=1)
    velocity = torch.cos(7 * position.roll(1, 1))
    step = 1e-5
    above, below = (
        mean_normals(system.cloth, position + sign * step * velocity) for sign in (1, -1)
    )
    # Central differences: errors of the order of the step squared.
    torch.testing.assert_close(
        mean_normal_rates(system.cloth, position, velocity),
        (above - below) / (2 * step),
        rtol=0,
        atol=1e-7,
    )
