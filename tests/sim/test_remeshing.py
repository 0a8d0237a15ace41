"""Remeshing: what each operation keeps, what the sizing field asks for, and a flag that is remeshed
while it flies."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import torch

from flagdata.core.arrays import FloatArray
from flagdata.errors import InputError, UsageError
from sim.cloth.contact import Contact
from sim.cloth.limits import StrainLimits, correction, least_correction, stretches
from sim.cloth.material import named_material
from sim.cloth.mesh import Mesh, grid
from sim.cloth.scene import Scene, assemble, flag
from sim.cloth.sizing import Remeshing, bound_metric, face_metrics, larger, vertex_metrics
from sim.effects import EFFECTS, apply
from sim.integrate import BackwardEuler
from sim.remeshing.adapting import Adapted, adapt_mesh
from sim.remeshing.triangles import Triangles
from sim.run.simulation_loop import Batch, Divergence
from tests.sim.conftest import make_system

NOTHING = Remeshing(
    refine_angle=1e6, refine_compression=1e6, refine_velocity=1e6, size_min=0.01, size_max=0.3
)
SHEET = grid(width=1.5, height=1.0, columns=6, rows=4)


def flat(mesh: Mesh) -> FloatArray:
    return np.column_stack([mesh.rest, np.zeros(mesh.vertex_count)])


def rolled(mesh: Mesh, radius: float) -> FloatArray:
    """The sheet on a cylinder whose axis is along v."""
    angle = mesh.rest[:, 0] / radius
    return np.column_stack([radius * np.sin(angle), mesh.rest[:, 1], radius * np.cos(angle)])


def momentum(mesh: Mesh, velocity: FloatArray) -> FloatArray:
    """(3,) of a cloth of 1 kg/m² with lumped masses."""
    return mesh.vertex_areas @ velocity


def split(triangles: Triangles) -> None:
    for i, j in triangles.edges():
        triangles.split(i, j)


def flip(triangles: Triangles) -> None:
    flipped = [triangles.flip(i, j) for i, j in triangles.edges() if triangles.adjacent(i, j)]
    assert any(flipped)


def collapse(triangles: Triangles) -> None:
    before = len(triangles.edges())
    for i, j in triangles.edges():
        if triangles.adjacent(i, j) and triangles.collapsible(i, j):
            triangles.collapse(i, j)
    assert len(triangles.edges()) < before / 2


def edited(operation: Callable[[Triangles], None]) -> Adapted:
    triangles = Triangles(SHEET, fixed=frozenset({0, 4}))
    operation(triangles)
    mesh, vertices = triangles.mesh()  # refuses a triangle that is turned over or has no area
    return Adapted(mesh=mesh, triangles=triangles, vertices=vertices)


OPERATIONS = pytest.mark.parametrize("operation", [split, flip, collapse])


@OPERATIONS
def test_an_operation_keeps_the_area_the_outline_and_the_held_corners(
    operation: Callable[[Triangles], None],
) -> None:
    new = edited(operation)
    assert new.mesh.areas.sum() == pytest.approx(1.5, abs=1e-12)
    assert new.mesh.vertex_areas.sum() == pytest.approx(1.5, abs=1e-12)
    assert np.ptp(new.mesh.rest, axis=0).tolist() == [1.5, 1.0]
    assert {0, 4} <= set(new.vertices.tolist())
    # Euler: V − E + F = 1 for a disc.
    assert (
        new.mesh.vertex_count - len(new.mesh.hinges) - len(new.mesh.boundary) + len(new.mesh.faces)
        == 1
    )


@OPERATIONS
def test_an_operation_keeps_the_momentum_of_a_velocity_that_is_linear_in_the_material(
    operation: Callable[[Triangles], None],
) -> None:
    # Σ a v̄ is the integral of a linear field on any mesh of the cloth.
    new = edited(operation)
    velocity = SHEET.rest @ np.array([[1.0, -2.0, 0.5], [3.0, 0.7, -1.0]]) + np.array(
        [0.1, 0.2, 0.3]
    )
    np.testing.assert_allclose(
        momentum(new.mesh, new.carried(velocity)), momentum(SHEET, velocity), atol=1e-12
    )


def test_splits_keep_the_momentum_of_any_velocity() -> None:
    new = edited(split)
    velocity = np.random.default_rng(1).normal(size=(SHEET.vertex_count, 3))
    np.testing.assert_allclose(
        momentum(new.mesh, new.carried(velocity)), momentum(SHEET, velocity), atol=1e-12
    )


def test_a_flip_on_a_parallelogram_changes_the_momentum_by_the_difference_of_its_diagonals() -> (
    None
):
    # (ρ a/6) (v_k + v_l − vᵢ − vⱼ) for a flip of i–j into k–l, here on a unit square of 1 kg/m².
    square = Mesh(rest=[[0, 0], [1, 0], [1, 1], [0, 1]], faces=[[0, 1, 2], [0, 2, 3]])
    triangles = Triangles(square)
    assert triangles.flip(0, 2) == (3, 1)
    mesh, vertices = triangles.mesh()
    velocity = np.random.default_rng(1).normal(size=(4, 3))
    change = momentum(mesh, velocity[vertices]) - momentum(square, velocity)
    np.testing.assert_allclose(
        change, (velocity[1] + velocity[3] - velocity[0] - velocity[2]) / 6, atol=1e-15
    )


def test_a_vertex_of_a_corner_or_of_a_held_edge_stays() -> None:
    triangles = Triangles(SHEET, fixed=frozenset({0, 1}))
    corners = [i for i, (u, v) in enumerate(SHEET.rest.tolist()) if u in (0, 1.5) and v in (0, 1)]
    assert not any(
        triangles.collapsible(i, j) for i in (*corners, 1) for j in triangles.neighbours(i)
    )
    assert triangles.held(0, 1)
    # A vertex inside is not merged into the rim's other side: the outline would be crossed.
    assert any(triangles.collapsible(2, j) for j in (1, 3))


def test_a_flat_sheet_at_rest_stays_flat_and_becomes_as_coarse_as_it_may() -> None:
    fine = grid(width=1.5, height=1.0, columns=30, rows=20)
    new = adapt_mesh(fine, flat(fine), np.zeros((fine.vertex_count, 3)), NOTHING, fixed=(0, 20))
    assert len(new.mesh.faces) < 200
    assert new.mesh.areas.sum() == pytest.approx(1.5, abs=1e-12)
    # Every vertex lies where the material has it, and no edge is longer than the largest size.
    np.testing.assert_allclose(new.carried(flat(fine)), flat(new.mesh), atol=1e-15)
    assert new.mesh.hinge_lengths.max() <= 0.3 + 1e-12


def test_edges_that_are_too_long_are_split_until_none_is() -> None:
    new = adapt_mesh(
        SHEET, flat(SHEET), np.zeros((SHEET.vertex_count, 3)), replace(NOTHING, size_max=0.1)
    )
    assert new.mesh.hinge_lengths.max() <= 0.1
    again = adapt_mesh(new.mesh, flat(new.mesh), 0 * flat(new.mesh), replace(NOTHING, size_max=0.1))
    assert len(again.mesh.faces) == pytest.approx(len(new.mesh.faces), rel=0.05)


@pytest.mark.parametrize("radius", [0.2, 1.0])
def test_on_a_cylinder_edges_across_it_may_turn_by_the_angle(radius: float) -> None:
    # Curvature 1/R: an edge across the axis of length α R turns by α. Along the axis nothing limits
    # it but `size_max`.
    mesh = grid(width=1.0, height=0.5, columns=40, rows=10)
    metric = face_metrics(
        mesh, rolled(mesh, radius), 0 * flat(mesh), replace(NOTHING, refine_angle=0.1)
    )
    centres = mesh.rest[mesh.faces].mean(axis=1)
    inside = (np.abs(centres - [0.5, 0.25]) < [0.4, 0.2]).all(axis=1)
    # The chords of 25 mm are shorter than their arcs by a share of (l/R)²/24.
    np.testing.assert_allclose(metric[inside, 0, 0] ** -0.5, 0.1 * radius, rtol=2e-3)
    np.testing.assert_allclose(metric[inside, 1, 1] ** -0.5, 0.3, rtol=1e-6)


def test_a_gradient_of_velocity_and_a_compression_ask_for_the_lengths_that_they_say() -> None:
    mesh = grid(width=1.0, height=1.0, columns=4, rows=4)
    shear = np.column_stack([0 * mesh.rest, 5 * mesh.rest[:, 1]])  # 5 1/s across u
    metric = face_metrics(mesh, flat(mesh), shear, replace(NOTHING, refine_velocity=0.4))
    np.testing.assert_allclose(
        metric, np.broadcast_to(np.diag([0.3**-2, 0.08**-2]), metric.shape), rtol=1e-9
    )
    # (1 − 0.6²)/2 = 0.32 of compression along u, none along v: 0.05/√0.32 m.
    squeezed = flat(mesh) * [0.6, 1, 1]
    metric = face_metrics(mesh, squeezed, 0 * shear, replace(NOTHING, refine_compression=0.05))
    wanted = np.broadcast_to(np.diag([0.32 / 0.05**2, 0.3**-2]), metric.shape)
    np.testing.assert_allclose(metric, wanted, rtol=1e-9, atol=1e-9)


def test_of_two_metrics_none_is_larger_than_the_larger_one_in_any_direction() -> None:
    rng = np.random.default_rng(3)
    roots = rng.normal(size=(2, 50, 2, 2))
    first, second = roots @ roots.swapaxes(-1, -2)
    both = larger(first, second)
    for other in (first, second):
        assert np.linalg.eigvalsh(both - other).min() > -1e-9
    # The smallest of that kind touches both of them.
    excess = np.abs(np.linalg.det([both - first, both - second])) / np.linalg.det(both)
    assert excess.min(axis=0).max() < 1e-9


def test_bounds_hold_for_sizes_and_aspect() -> None:
    metric = np.array([np.diag([1e9, 1e-9]), np.diag([4.0, 400.0])])
    sizes = (
        np.linalg.eigvalsh(
            bound_metric(metric, Remeshing(size_min=0.02, size_max=2.0, aspect_min=0.2))
        )
        ** -0.5
    )
    np.testing.assert_allclose(sizes, [[0.1, 0.02], [0.25, 0.05]])


def test_a_wave_gets_finer_where_it_bends_and_short_edges_lie_across_it() -> None:
    mesh = grid(width=1.0, height=0.5, columns=40, rows=20)
    waved = flat(mesh)
    waved[:, 2] = np.where(mesh.rest[:, 0] < 0.5, 0, 0.02 * np.sin(8 * np.pi * mesh.rest[:, 0]))
    new = adapt_mesh(mesh, waved, 0 * waved, replace(NOTHING, refine_angle=0.3, aspect_min=0.2))
    left = new.mesh.rest[new.mesh.faces].mean(axis=1)[:, 0] < 0.45
    right = new.mesh.rest[new.mesh.faces].mean(axis=1)[:, 0] > 0.55
    assert right.sum() > 4 * left.sum()
    arms = np.abs(new.mesh.arms[right]).mean(axis=(0, 1))
    assert arms[0] < 0.6 * arms[1]


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"refine_angle": 0.0}, "refine_angle"),
        ({"size_min": 0.5, "size_max": 0.1}, "the smaller one first"),
        ({"size_max": float("inf")}, "finite"),
        ({"aspect_min": 1.5}, "from 0 to 1"),
    ],
)
def test_impossible_criteria_are_refused(changes: dict[str, float], word: str) -> None:
    with pytest.raises(InputError, match=word):
        Remeshing(**changes)


# What the loop does with it.
FLAG: Scene = replace(
    flag(
        material=named_material("camel-ponte-roma"),
        wind_speed=5.0,
        width=0.9,
        height=0.6,
        columns=6,
    ),
    remeshing=Remeshing(size_min=0.05),
)


def test_a_flag_is_remeshed_while_it_flies_and_keeps_its_mass_and_its_pole() -> None:
    system, state = assemble([replace(FLAG, limits=StrainLimits(sweeps=50))], dtype=torch.float64)
    mass, anchors = float(system.cloth.mass.sum()), system.anchors[..., 0].numpy()
    batch = Batch(
        system=system,
        state=state,
        integrator=BackwardEuler(tolerance=1e-4),
        divergence=Divergence.REFUSE,
    )
    counts = []
    for reached in batch.states(range(7), 25.0):
        counts.append(len(batch.system.cloth.faces))
        assert float(batch.system.cloth.mass.sum()) == pytest.approx(mass, rel=1e-12)
        # Springs of 1 kN/m under a flag of 1.5 N and its air.
        held = reached.position[list(batch.system.handles.vertices), :, 0].numpy()
        assert np.abs(held - anchors).max() < 0.02
    assert counts[-1] > 2 * counts[0]
    large, small = stretches(batch.system.cloth, batch.state.position)
    assert 0.8 < float(small.min()) < float(large.max()) < 1.3


def test_layers_keep_apart_on_a_mesh_that_changes() -> None:
    # A sheet folded over to 4 mm above itself: contact of 10 mm pushes the layers away from each
    # other.
    system, state = assemble(
        [replace(FLAG, wind=(0.0, 0.0, 0.0), contact=Contact(friction=0.0))], dtype=torch.float64
    )
    rest = system.cloth.mesh.rest
    folded = np.column_stack(
        [np.where(rest[:, 0] > 0.45, 0.004, 0), 0.45 - np.abs(rest[:, 0] - 0.45), rest[:, 1]]
    )
    state = replace(state, position=torch.tensor(folded)[..., None])
    system = replace(
        system, anchors=state.position[system.held].clone(), gravity=0 * system.gravity
    )
    batch = Batch(
        system=system,
        state=state,
        integrator=BackwardEuler(tolerance=1e-4),
        divergence=Divergence.REFUSE,
    )
    meshes = [batch.system.cloth.mesh for _ in batch.states(range(3), 100.0)]
    assert meshes[0] is not meshes[-1]
    upper = torch.tensor(meshes[-1].rest[:, 0] > 0.7)
    assert float(batch.state.position[upper, 0].mean()) > 0.0045


@pytest.mark.parametrize("name", ["hem-mass", "full-hoist", "hysteresis"])
def test_effects_that_know_the_vertices_are_refused_by_name(name: str) -> None:
    system, state = assemble([FLAG], dtype=torch.float64)
    effect = EFFECTS[name](
        **{key: torch.tensor([entry.prior[1]]) for key, entry in EFFECTS[name].parameters().items()}
    )
    system, state = apply([effect], system, state)
    with pytest.raises(UsageError, match="cannot follow a mesh that changes"):
        Batch(system=system, state=state, integrator=BackwardEuler(), divergence=Divergence.REFUSE)


def test_several_members_and_positions_in_one_array_are_refused() -> None:
    system, state = assemble([FLAG, FLAG])
    with pytest.raises(UsageError, match="2 members are simulated together"):
        Batch(system=system, state=state, integrator=BackwardEuler(), divergence=Divergence.REFUSE)
    system, state = assemble([FLAG])
    batch = Batch(
        system=system, state=state, integrator=BackwardEuler(), divergence=Divergence.REFUSE
    )
    with pytest.raises(UsageError, match="no single array"):
        batch.positions(range(2), 25.0)


# Strain limits among slivers.
def test_the_least_moves_are_those_of_the_nearest_deformation_where_sides_are_equal() -> None:
    equal = Mesh(rest=[[0, 0], [1, 0], [0.5, np.sqrt(0.75)]], faces=[[0, 1, 2]])
    system, state = make_system(equal, [named_material("paper")])
    position = state.position * torch.tensor([1.0, 1.3, 0.8], dtype=torch.float64)[:, None]
    ways = [
        sweep(system.cloth, StrainLimits(), position) for sweep in (correction, least_correction)
    ]
    torch.testing.assert_close(*ways, rtol=1e-9, atol=1e-12)


def test_sweeps_of_the_least_moves_bring_slivers_to_the_limits() -> None:
    mesh = grid(width=1.0, height=0.05, columns=4, rows=4)
    system, state = make_system(mesh, [named_material("paper")])
    generator = torch.Generator().manual_seed(1)
    position = state.position + 0.01 * torch.randn(
        state.position.shape, generator=generator, dtype=torch.float64
    )
    areas = torch.tensor(mesh.vertex_areas)[:, None, None]
    middle = (areas * position).sum(0) / areas.sum()
    for _ in range(400):
        position = position + least_correction(system.cloth, StrainLimits(), position)
    large, small = stretches(system.cloth, position)
    assert float(large.max()) < 1.06
    assert float(small.min()) > 0.94
    # Each face's moves add up to nothing, so that the centre of mass stays.
    torch.testing.assert_close((areas * position).sum(0) / areas.sum(), middle, rtol=0, atol=1e-12)


def test_metrics_at_vertices_are_means_of_their_faces() -> None:
    mesh = grid(width=1.0, height=1.0, columns=2, rows=2)
    shear = np.column_stack([0 * mesh.rest, 5 * mesh.rest[:, 1]])
    metrics = vertex_metrics(
        mesh, flat(mesh), shear, replace(NOTHING, refine_velocity=0.4, aspect_min=0.0)
    )
    np.testing.assert_allclose(
        metrics, np.broadcast_to(np.diag([0.3**-2, 0.08**-2]), metrics.shape), rtol=1e-9
    )
