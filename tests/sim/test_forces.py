"""Laws that hold for the internal forces and the air's, whatever the shape."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from flagdata.errors import InputError
from sim.cloth import bending, membrane
from sim.cloth.air import QuadraticNormal, Stokes
from sim.cloth.material import Material, named_material
from sim.cloth.mesh import Mesh
from sim.cloth.stiffness_tables import Evaluation
from tests.refusals import unrefused
from tests.sim.conftest import PLAIN, make_system


def crumpled(mesh: Mesh, batch: int) -> torch.Tensor:
    """A smooth, strongly folded and stretched shape: (vertex, 3, batch)."""
    u, v = mesh.rest.T
    members = []
    for b in range(batch):
        x = 0.1 * np.sin(9 * u + b) * np.cos(7 * v)
        members.append(np.stack([x, 1.05 * u + 0.03 * v, 0.98 * v + 0.02 * np.sin(11 * u)], axis=1))
    return torch.tensor(np.stack(members, axis=-1))


def velocity_like(position: torch.Tensor) -> torch.Tensor:
    return torch.sin(13 * position.roll(1, 1)) * 2


@pytest.mark.parametrize("part", [membrane, bending])
def test_force_is_minus_the_gradient_of_the_energy_for_constant_stiffness(part, distorted) -> None:
    system, _ = make_system(distorted, [PLAIN, PLAIN])
    position = crumpled(distorted, 2).requires_grad_()
    (gradient,) = torch.autograd.grad(part.energy(system.cloth, position).sum(), position)
    force = part.force(system.cloth, position.detach(), torch.zeros_like(position))
    torch.testing.assert_close(force, -gradient, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("part", [membrane, bending])
@pytest.mark.parametrize("evaluation", list(Evaluation))
def test_internal_forces_turn_with_the_cloth_and_do_not_see_where_it_is(
    part, evaluation, distorted
) -> None:
    system, _ = make_system(distorted, [named_material("camel-ponte-roma")], evaluation=evaluation)
    position = crumpled(distorted, 1)
    velocity = velocity_like(position)
    turn = torch.tensor(Rotation.from_rotvec([0.3, -1.1, 0.7]).as_matrix())
    shift = torch.tensor([3.0, -2.0, 1.0], dtype=torch.float64)[:, None]
    force = part.force(system.cloth, position, velocity)
    moved = part.force(
        system.cloth,
        torch.einsum("ij,vjb->vib", turn, position) + shift,
        torch.einsum("ij,vjb->vib", turn, velocity),
    )
    torch.testing.assert_close(
        moved, torch.einsum("ij,vjb->vib", turn, force), rtol=1e-9, atol=1e-11
    )


@pytest.mark.parametrize("part", [membrane, bending])
def test_internal_forces_have_no_resultant_and_no_moment(part, distorted) -> None:
    system, _ = make_system(distorted, [named_material("white-swim-solid")])
    position = crumpled(distorted, 1)
    force = part.force(system.cloth, position, velocity_like(position))
    scale = float(force.abs().sum())
    moment = torch.linalg.cross(position, force, dim=1).sum(0)
    assert float(force.sum(0).abs().max()) < 1e-12 * scale
    # The floor on hinge altitudes is not reached here, so the fold gradient is exact and moments
    # balance as well.
    assert float(moment.abs().max()) < 1e-11 * scale


@pytest.mark.parametrize("part", [membrane, bending])
def test_rigid_motion_is_not_damped_and_damping_takes_energy(part, distorted) -> None:
    system, _ = make_system(distorted, [named_material("camel-ponte-roma")])
    position = crumpled(distorted, 1)
    still = part.force(system.cloth, position, torch.zeros_like(position))
    spin = torch.tensor([0.4, -2.0, 1.3], dtype=torch.float64)[None, :, None].expand_as(position)
    rigid = torch.linalg.cross(spin, position, dim=1) + 1.7
    torch.testing.assert_close(
        part.force(system.cloth, position, rigid), still, rtol=1e-9, atol=1e-12
    )
    velocity = velocity_like(position)
    power = ((part.force(system.cloth, position, velocity) - still) * velocity).sum()
    assert float(power) < 0


def test_patch_a_uniform_stretch_leaves_inner_vertices_free_on_a_distorted_mesh(distorted) -> None:
    # Patch test: constant strain gives constant stress, whose forces cancel at inner vertices.
    system, state = make_system(distorted, [named_material("camel-ponte-roma")])
    stretch = torch.tensor(
        [[1.0, 0.0, 0.0], [0.0, 1.08, 0.05], [0.0, 0.02, 0.97]], dtype=torch.float64
    )
    position = torch.einsum("ij,vjb->vib", stretch, state.position)
    force = membrane.force(system.cloth, position, state.velocity)
    inner = np.setdiff1d(np.arange(distorted.vertex_count), distorted.boundary)
    assert float(force[inner].abs().max()) < 1e-12
    assert float(force.abs().max()) > 0.1


def test_uniaxial_stretch_pulls_with_stiffness_times_strain(distorted) -> None:
    # One dimension: force per width = K λ (λ² − 1)/2 (first Piola–Kirchhoff stress of K G²/2), K =
    # 50 N/m, λ = 1.1, width 0.4 m: 50 · 1.1 · 0.105 · 0.4 = 2.31 N.
    system, state = make_system(distorted, [PLAIN])
    position = state.position * torch.tensor([1.0, 1.1, 1.0], dtype=torch.float64)[:, None]
    force = membrane.force(system.cloth, position, state.velocity)
    free_edge = np.flatnonzero(distorted.rest[:, 0] > 0.6 - 1e-9)
    assert float(force[free_edge, 1].sum()) == pytest.approx(-2.31, rel=1e-12)


def test_fold_angle_and_moment_of_two_triangles_by_hand() -> None:
    # A square folded along its diagonal by 60° into a valley: θ = π/3; S = 2/(2 · 1) = 1; α = ½ θ
    # √2 = 0.740 1/m.
    material = Material(
        name="m",
        source="test",
        area_weight=1.0,
        damping=0.0,
        stretching=np.ones((6, 4)),
        bending=np.full((3, 5), 0.3),
    )
    mesh = Mesh(rest=[[0, 0], [1, 0], [1, 1], [0, 1]], faces=[[0, 1, 2], [0, 2, 3]])
    system, _ = make_system(mesh, [material])
    h = 1 / math.sqrt(2)
    along = np.array([1, 1, 0]) * h
    out = np.array([1, -1, 0]) * h
    middle = np.array([0.5, 0.5, 0])
    tilt = np.radians(30)
    corner1 = middle + h * (np.cos(tilt) * out + np.sin(tilt) * np.array([0, 0, 1]))
    corner3 = middle + h * (-np.cos(tilt) * out + np.sin(tilt) * np.array([0, 0, 1]))
    position = torch.tensor(np.stack([[0, 0, 0], corner1, np.sqrt(2) * along, corner3]))[..., None]
    fold = bending.fold(system.cloth, position)
    assert float(fold.angle) == pytest.approx(np.pi / 3)
    assert float(bending.energy(system.cloth, position)) == pytest.approx(
        0.3 * (np.pi / 3) ** 2 / 4
    )
    # The moment k S θ / 2 acts on the corners with arm h, pressing them back towards flat.
    force = bending.force(system.cloth, position, torch.zeros_like(position))
    assert float(force[1].norm()) == pytest.approx(0.3 * (np.pi / 3) / 2 / h)
    assert float(force[1, 2]) < 0


def test_air_force_on_a_flat_sheet_is_area_density_speed_squared(distorted) -> None:
    system, state = make_system(distorted, [PLAIN])
    air = QuadraticNormal(density=1.2, drag=0.7)
    wind = torch.tensor([[3.0], [4.0], [0.0]], dtype=torch.float64)
    force = air.force(system.cloth, state.position, state.velocity, wind)
    # The sheet lies across x: 1.2 · 0.24 m² · 3² along x, 0.7 · 0.24 · 4 along y.
    np.testing.assert_allclose(force.sum(0)[:, 0], [1.2 * 0.24 * 9, 0.7 * 0.24 * 4, 0], atol=1e-12)


def test_air_acts_on_relative_velocity_only(distorted) -> None:
    system, _ = make_system(distorted, [PLAIN])
    position = crumpled(distorted, 1)
    velocity = velocity_like(position)
    wind = torch.tensor([[3.0], [-1.0], [0.5]], dtype=torch.float64)
    for air in (QuadraticNormal(drag=0.3), Stokes()):
        force = air.force(system.cloth, position, velocity, wind)
        shifted = air.force(system.cloth, position, velocity + 2.5, wind + 2.5)
        torch.testing.assert_close(shifted, force, rtol=1e-10, atol=1e-14)
        still = air.force(system.cloth, position, wind.expand_as(position), wind)
        assert float(still.abs().max()) == 0.0


def test_stokes_on_a_single_mass_is_a_spheres_drag(distorted) -> None:
    # 6 π η R w with R = √(A/π): for A = 0.01 m², w = 2 m/s, η = 1.789e-5: 3.805e-5 N.
    system, state = make_system(distorted, [PLAIN])
    wind = torch.tensor([[2.0], [0.0], [0.0]], dtype=torch.float64)
    force = Stokes().force(system.cloth, state.position, state.velocity, wind)
    corner_area = distorted.vertex_areas[0]
    assert float(force[0, 0]) == pytest.approx(3.805e-5 * math.sqrt(corner_area / 0.01), rel=1e-3)


def test_null_values_of_the_air_give_exactly_no_force(distorted) -> None:
    system, _ = make_system(distorted, [PLAIN])
    position = crumpled(distorted, 1)
    wind = torch.ones((3, 1), dtype=torch.float64)
    for air in (QuadraticNormal(density=0.0), Stokes(viscosity=0.0)):
        assert (
            float(air.force(system.cloth, position, velocity_like(position), wind).abs().max())
            == 0.0
        )


def test_negative_parameters_of_the_air_are_refused() -> None:
    cases = [QuadraticNormal, Stokes]
    assert (
        unrefused(
            lambda air: air(**{"density" if air is QuadraticNormal else "viscosity": -1.0}),
            zip(cases),
            InputError,
            "wind force",
        )
        == []
    )


def test_linearised_stiffness_is_the_derivative_of_the_force_at_small_strain(distorted) -> None:
    # At rest the terms that the linearisation leaves out vanish.
    system, state = make_system(distorted, [PLAIN])
    field = velocity_like(crumpled(distorted, 1))
    step = 1e-6
    for part, kind, slots in (
        (membrane, membrane.LinearisedMembrane, system.cloth.face_slots),
        (bending, bending.LinearisedBending, system.cloth.hinge_slots),
    ):
        at = kind.at(system.cloth, state.position)
        from sim.cloth.cloth_batch import gather_sum

        product = gather_sum(at.corner_products(field), slots)
        forward = part.force(system.cloth, state.position + step * field, state.velocity)
        backward = part.force(system.cloth, state.position - step * field, state.velocity)
        torch.testing.assert_close(
            product, -(forward - backward) / (2 * step), rtol=1e-6, atol=1e-6
        )
        diagonal = gather_sum(at.diagonal(), slots)
        unit = torch.zeros_like(field)
        unit[7, 1] = 1.0
        assert float(diagonal[7, 1]) == pytest.approx(
            float(gather_sum(at.corner_products(unit), slots)[7, 1])
        )
