"""Backward Euler: its solver, its orders, and what it does to motion."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from flagdata.errors import UsageError
from sim.cloth import membrane
from sim.cloth.air import QuadraticNormal
from sim.cloth.handles import Handles
from sim.cloth.material import isotropic, named_material
from sim.cloth.mesh import grid
from sim.cloth.state import State
from sim.integrate import AirShape, Backend, BackwardEuler, Symplectic
from sim.integrate.implicit import conjugate_gradients
from tests.refusals import unrefused
from tests.sim.conftest import make_system


def matrix(seed: int) -> torch.Tensor:
    values = np.random.default_rng(seed).normal(size=(30, 30))
    return torch.tensor(values @ values.T + 5 * np.eye(30))


def test_conjugate_gradients_solve_each_member_and_freeze_it_when_done() -> None:
    systems = torch.stack([matrix(1), matrix(2) * 100, torch.eye(30, dtype=torch.float64)], dim=-1)
    right = torch.tensor(np.random.default_rng(3).normal(size=(10, 3, 3)))

    def operator(field: torch.Tensor) -> torch.Tensor:
        return torch.einsum(
            "ijb,jb->ib", systems[..., : field.shape[-1]], field.reshape(30, -1)
        ).reshape(field.shape)

    diagonal = torch.einsum("iib->ib", systems).reshape(10, 3, 3)
    found = conjugate_gradients(operator, right, diagonal, tolerance=1e-12, iterations=200)
    for b in range(3):
        exact = torch.linalg.solve(systems[..., b], right[..., b].reshape(30))
        torch.testing.assert_close(found[..., b].reshape(30), exact, rtol=1e-8, atol=1e-10)
    alone = conjugate_gradients(
        operator, right[..., :1], diagonal[..., :1], tolerance=1e-12, iterations=200
    )
    torch.testing.assert_close(alone[..., 0], found[..., 0], rtol=1e-12, atol=1e-14)


def test_a_member_that_does_not_converge_is_marked_and_the_others_are_solved() -> None:
    systems = torch.stack([matrix(1), torch.eye(30, dtype=torch.float64)], dim=-1)
    right = torch.ones((10, 3, 2), dtype=torch.float64)

    def operator(field: torch.Tensor) -> torch.Tensor:
        return torch.einsum("ijb,jb->ib", systems, field.reshape(30, -1)).reshape(field.shape)

    found = conjugate_gradients(
        operator, right, torch.ones_like(right), tolerance=1e-10, iterations=2
    )
    assert torch.isnan(found[..., 0]).all()
    torch.testing.assert_close(found[..., 1], right[..., 1])


def test_a_free_mass_point_under_gravity_falls_as_the_method_says(distorted) -> None:
    # v_n = g n h exactly, x_n = g h² n(n+1)/2.
    system, state = make_system(
        distorted, [named_material("camel-ponte-roma")], gravity=(0.0, 0.0, -10.0)
    )
    final = BackwardEuler(step=0.01, tolerance=1e-12).advance(system, state, 0.1)
    torch.testing.assert_close(final.velocity[:, 2], torch.full_like(final.velocity[:, 2], -1.0))
    fall = final.position[:, 2] - state.position[:, 2]
    torch.testing.assert_close(fall, torch.full_like(fall, -10 * 1e-4 * 55), rtol=0, atol=1e-10)


def test_backward_euler_converges_to_leapfrog_with_first_order() -> None:
    material = isotropic(
        name="soft", area_weight=0.3, stretching=20.0, shear=20.0, bending=1e-4, damping=1e-3
    )
    mesh = grid(width=0.4, height=0.3, columns=4, rows=3)
    handles = Handles(vertices=(0, 3), stiffness=math.inf)
    system, state = make_system(
        mesh, [material], handles=handles, gravity=(1.0, 0.0, -9.81), wind=(3.0, 0.0, 0.0)
    )
    exact = Symplectic(step=2e-5).advance(system, state, 0.1).position
    errors = []
    for step in (1e-3, 5e-4, 2.5e-4):
        final = BackwardEuler(step=step, tolerance=1e-10).advance(system, state, 0.1).position
        errors.append(float((final - exact).abs().max()))
    # First order; observed 0.9 and 0.8 at these steps.
    assert 0.7 < math.log2(errors[0] / errors[1]) < 1.2
    assert 0.7 < math.log2(errors[1] / errors[2]) < 1.2


def test_backward_euler_damps_a_slow_mode_as_declared_damping_of_one_step_does() -> None:
    # A linear mode with ω h ≪ 1: backward Euler multiplies it by 1/√(1 + ω² h²) ≈ exp(−ω² h²/2) a
    # step, Kelvin–Voigt damping d by exp(−d ω² h/2): the same for d = h. Here ω ≈ √(K/ρ)/width · √2
    # ≈ 14/s, so that ω h = 0.07.
    spring = isotropic(name="spring", area_weight=1.0, stretching=100.0, shear=0.0, bending=0.0)
    mesh = grid(width=1.0, height=0.5, columns=1, rows=1)
    handles = Handles(vertices=(0, 1), stiffness=math.inf)
    h = 5e-3

    def energy_left(damping: float, method: BackwardEuler | Symplectic) -> float:
        system, state = make_system(mesh, [replace(spring, damping=damping)], handles=handles)
        velocity = torch.zeros_like(state.velocity)
        velocity[2:, 1] = 1e-3
        state = State(position=state.position, velocity=velocity)
        first = float(sum(system.energies(state).values()))
        return float(sum(system.energies(method.advance(system, state, 2.0)).values())) / first

    numerical = energy_left(0.0, BackwardEuler(step=h, tolerance=1e-12))
    assert energy_left(h, Symplectic()) == pytest.approx(numerical, rel=0.15)
    assert energy_left(h / 2, Symplectic()) > 1.5 * numerical
    assert numerical < 0.3


def test_impossible_settings_are_refused() -> None:
    cases = [{"step": 0.0}, {"step": math.nan}, {"tolerance": 0.0}, {"tolerance": 2.0}]
    assert not unrefused(
        lambda fields: BackwardEuler(**fields), zip(cases), UsageError, "integrator implicit"
    )


@pytest.mark.parametrize("stiffness", [1e3, math.inf])
@pytest.mark.parametrize("shape", list(AirShape))
@pytest.mark.parametrize(("dtype", "tolerance"), [(torch.float64, 1e-9), (torch.float32, 1e-4)])
def test_kernel_and_torch_take_the_same_step(stiffness, shape, dtype, tolerance, distorted) -> None:
    handles = Handles(
        vertices=(0, 4),
        stiffness=stiffness,
        times=(0.0, 0.1),
        offsets=((0, 0, 0), (0.02, 0.0, 0.01)),
    )
    materials = [
        named_material(name) for name in ("camel-ponte-roma", "11oz-black-denim", "gray-interlock")
    ]
    system, state = make_system(
        distorted,
        materials,
        handles=handles,
        gravity=(0.0, 0.0, -9.81),
        wind=(5.0, 1.0, 0.0),
        air=QuadraticNormal(density=1.2, drag=0.4),
        dtype=dtype,
    )
    bump = 0.02 * torch.sin(23 * state.position[:, 1])
    start = State(
        position=state.position + bump.unsqueeze(1),
        velocity=torch.cos(11 * state.position.roll(1, 1)),
    )
    results = [
        BackwardEuler(air_shape=shape, backend=backend, tolerance=1e-2 * tolerance).advance(
            system, start, 0.02
        )
        for backend in (Backend.TORCH, Backend.KERNEL)
    ]
    # Both solve to the tolerance; float32 sums in another order.
    torch.testing.assert_close(results[1].position, results[0].position, rtol=0, atol=tolerance)
    torch.testing.assert_close(
        results[1].velocity, results[0].velocity, rtol=0, atol=200 * tolerance
    )


@pytest.mark.parametrize("backend", [Backend.TORCH, Backend.KERNEL])
def test_a_diverged_member_is_marked_and_does_not_change_the_others(backend, distorted) -> None:
    system, state = make_system(
        distorted, [named_material("camel-ponte-roma")] * 2, wind=(5.0, 0.0, 0.0)
    )
    broken = state.position.clone()
    broken[7, 0, 1] = torch.nan
    method = BackwardEuler(backend=backend)
    healthy = method.advance(system, state, 0.02)
    final = method.advance(system, replace(state, position=broken), 0.02)
    assert final.healthy().tolist() == [True, False]
    assert torch.equal(final.position[..., 0], healthy.position[..., 0])


def test_stiff_materials_take_the_papers_steps() -> None:
    # Aluminium foil of 0.07 kg/m² and 1.8 MN/m: an explicit step would have to be below a
    # microsecond.
    mesh = grid(width=0.3, height=0.2, columns=6, rows=4)
    handles = Handles(vertices=(0, 4))
    system, state = make_system(
        mesh,
        [named_material("aluminium")],
        handles=handles,
        gravity=(0.0, 0.0, -9.81),
        wind=(3.0, 0.0, 0.0),
    )
    final = BackwardEuler().advance(system, state, 0.4)
    assert bool(final.healthy().all())
    # Inextensible to 0.1 %, and it has swung out of its plane.
    strain = membrane.strain(system.cloth, final.position)
    assert float(strain.g00.abs().max()) < 1e-3
    assert float(final.position[:, 0].max()) > 0.02


@pytest.mark.parametrize("stiffness", [1e3, math.inf])
def test_steps_in_one_call_are_those_taken_one_by_one_to_the_bit(
    distorted, stiffness: float
) -> None:
    handles = Handles(
        vertices=(0, 4),
        stiffness=stiffness,
        times=(0.0, 0.1),
        offsets=((0, 0, 0), (0.02, 0.0, 0.01)),
    )
    system, state = make_system(
        distorted,
        [named_material("camel-ponte-roma"), named_material("white-swim-solid")],
        handles=handles,
        gravity=(0.0, 0.0, -9.81),
    )

    class Rising:
        def velocity(self, time: float) -> torch.Tensor:
            return torch.tensor([[5.0, 3.0], [1.0, 0.0], [0.0, 0.0]], dtype=torch.float64) * (
                1 + 10 * time
            )

    system, method = (
        replace(system, wind=Rising()),
        BackwardEuler(step=2e-3, backend=Backend.KERNEL),
    )
    together, alone = method.advance(system, state, 0.04), state
    for _ in range(20):
        alone = method.take_step(system, alone, system.drive(alone.time, alone.time + 2e-3), 2e-3)
    assert torch.equal(together.position, alone.position)
    assert torch.equal(together.velocity, alone.velocity)
    assert together.time == alone.time
