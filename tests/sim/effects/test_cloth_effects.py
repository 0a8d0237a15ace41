"""Effects inside the cloth: masses that add up, hems that count by their width, friction loops with
known areas."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import torch

from flagdata.errors import UsageError
from sim.cloth import bending
from sim.cloth.air import QuadraticNormal
from sim.cloth.handles import Handles
from sim.cloth.material import isotropic
from sim.cloth.mesh import Mesh, grid
from sim.effects import EFFECTS, HemMass, InternalDamping, apply
from sim.integrate import advance, stable_step
from tests.sim.conftest import PLAIN, make_system

HemStiffness = EFFECTS["hem-stiffness"]
Hysteresis = EFFECTS["hysteresis"]
RestCurvature = EFFECTS["rest-curvature"]
WetMass = EFFECTS["wet-mass"]


def rolled(mesh: Mesh, curvature: float) -> torch.Tensor:
    u, v = mesh.rest.T
    position = np.stack(
        [np.sin(curvature * u) / curvature, v, (1 - np.cos(curvature * u)) / curvature], axis=1
    )
    return torch.tensor(position)[..., None]


def test_a_hem_adds_its_line_density_times_the_perimeter() -> None:
    mesh = grid(width=1.5, height=1.0, columns=6, rows=4)
    system, state = make_system(mesh, [PLAIN])
    heavier, _ = apply([HemMass(line_density=0.01)], system, state)
    added = (heavier.cloth.mass - system.cloth.mass)[:, 0].numpy()
    assert added.sum() == pytest.approx(0.01 * 5.0, rel=1e-12)
    inner = np.setdiff1d(np.arange(mesh.vertex_count), mesh.boundary)
    assert (added[inner] == 0).all()


def test_wet_cloth_falls_as_fast_and_is_blown_less(square) -> None:
    system, state = make_system(square, [PLAIN], gravity=(0.0, 0.0, -9.81), wind=(5.0, 0.0, 0.0))
    wet, _ = apply([WetMass(uptake=0.6)], system, state)
    dry_push, wet_push = (
        s.external(s.wind.velocity(0.0), 0.0, state.position, state.velocity) for s in (system, wet)
    )
    dry, soaked = (
        push / s.cloth.mass.unsqueeze(1) for push, s in ((dry_push, system), (wet_push, wet))
    )
    torch.testing.assert_close(soaked[:, 2], dry[:, 2], rtol=1e-12, atol=0)
    torch.testing.assert_close(soaked[:, 0], dry[:, 0] / 1.6, rtol=1e-12, atol=0)


@pytest.mark.parametrize("columns", [4, 8])
def test_a_hem_stiffens_a_rolled_cloth_by_its_width_on_any_mesh(columns) -> None:
    """Rolled along u, only the creases along v bend; hems of width w at both their ends, r times
    stiffer on top, add 2 r w/H to the energy."""
    mesh = grid(width=1.0, height=0.8, columns=columns, rows=columns)
    system, state = make_system(mesh, [PLAIN])
    hemmed, _ = apply([HemStiffness(ratio=10.0, width=0.02)], system, state)
    position = rolled(mesh, 0.8)
    ratio = float(bending.energy(hemmed.cloth, position) / bending.energy(system.cloth, position))
    assert ratio == pytest.approx(1 + 2 * 10.0 * 0.02 / 0.8, rel=1e-9)


def test_a_hem_lowers_the_stable_step_no_more_than_bending_can(square) -> None:
    """Stiffness r on top in part of the cloth: the step shrinks, by at most √(1 + r)."""
    stiff = replace(PLAIN, bending=PLAIN.bending * 1e4)
    system, state = make_system(square, [stiff])
    hemmed, _ = apply([HemStiffness(ratio=24.0, width=0.03)], system, state)
    assert 1 < stable_step(system) / stable_step(hemmed) < 5


def test_cloth_rolled_at_its_rest_curvature_does_not_bend() -> None:
    mesh = grid(width=1.0, height=0.8, columns=7, rows=5)
    system, state = make_system(mesh, [PLAIN])
    curled, _ = apply([RestCurvature(curvature=1.5)], system, state)
    (curl,) = curled.effects
    position = rolled(mesh, 1.5)
    nothing = torch.zeros_like(position)
    elastic = bending.force(system.cloth, position, nothing)
    total = elastic + curl.force(system.cloth, 0.0, position, nothing, nothing[0])
    assert float(elastic.abs().max()) > 1e-4
    np.testing.assert_allclose(total, 0, atol=1e-15)


def test_damping_lets_a_vibration_decay_as_stated() -> None:
    """Stiffness-proportional damping d: ẍ + d ω² ẋ + ω² x = 0, so that the amplitude falls by e^(−d
    ω² t/2); ω is that of the undamped member of the same batch, a patch held at one edge and
    stretched along itself."""
    sheet = isotropic(name="sheet", area_weight=0.2, stretching=50.0, shear=40.0, bending=1e-4)
    mesh = grid(width=0.2, height=0.2, columns=1, rows=1)
    system, state = make_system(
        mesh,
        [sheet, sheet],
        air=QuadraticNormal(density=0.0),
        handles=Handles(vertices=(0, 1), stiffness=float("inf")),
    )
    damping = torch.tensor([0.0, 2e-3], dtype=torch.float64)
    system, state = apply([InternalDamping(time=damping)], system, state)
    pulled = state.position.clone()
    pulled[2:, 1] *= 1 + 1e-6
    state = replace(state, position=pulled)
    stretch = []
    for _ in range(250):
        state = advance(system, state, 1e-3, steps=3)
        stretch.append((state.position[2:, 1] - 0.2).mean(0).numpy() / 2e-7)
    free, damped = np.array(stretch).T
    crossings = np.flatnonzero(np.diff(np.sign(free)) != 0)
    omega = np.pi / (np.mean(np.diff(crossings)) * 1e-3)
    # The envelope at the peaks; leapfrog sees the damping half a step late, and peaks are sampled:
    # O(ω h) = 3e-2.
    peaks = np.flatnonzero((damped[1:-1] > damped[:-2]) & (damped[1:-1] > damped[2:])) + 1
    peaks = peaks[damped[peaks] > 1e-2]
    rate = -np.polyfit(peaks * 1e-3, np.log(damped[peaks]), 1)[0]
    assert rate == pytest.approx(2e-3 * omega**2 / 2, rel=0.03)


def folded(angle: float) -> torch.Tensor:
    """Two triangles on the edge from (0, 0) to (0, 1), the second turned up by an angle: (4, 3,
    1)."""
    c, s = np.cos(angle), np.sin(angle)
    return torch.tensor([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.5, 0.0], [c, 0.5, s]])[
        ..., None
    ].double()


@pytest.fixture
def hinge():
    rest = np.array([[0.0, 0.0], [0.0, 1.0], [-1.0, 0.5], [1.0, 0.5]])
    return make_system(Mesh(rest=rest, faces=np.array([[0, 1, 2], [1, 0, 3]])), [PLAIN])


def work_of_cycle(hinge, friction: Hysteresis, amplitude: float, steps: int) -> float:
    """Work that friction takes from the third steady cycle between fold angles ± amplitude [J]."""
    system, state = hinge
    system, state = apply([friction], system, replace(state, position=folded(0.0)))
    angles = amplitude * np.sin(2 * np.pi * np.arange(3 * steps + 1) / steps)
    memory, work = state.memory, 0.0
    still, calm = state.velocity, torch.zeros_like(system.gravity)
    for index, (before, after) in enumerate(pairwise(angles)):
        then = system.remember_step(memory, calm, 0.0, folded(after), still, elapsed=1e-3)
        if index >= 2 * steps:
            ends = ((memory[0], before), (then[0], after))
            pull = (friction.force(system.cloth, m, folded(a), still, calm) for m, a in ends)
            work -= float((sum(pull) / 2 * (folded(after) - folded(before))).sum())
        memory = then
    return work


@pytest.mark.parametrize("turned", [0.5, 2.0, 5.0])
def test_a_friction_cycle_takes_the_closed_form_of_work(hinge, turned) -> None:
    """Per area 4 H (A − α₀ tanh(A/α₀)), with α = ½ θ l/(a0 + a1): here l = 1, a0 + a1 = 1, so that
    α = θ/2."""
    friction = Hysteresis(couple=2e-3, curvature=0.1 / turned)
    expected = 4 * 2e-3 * (0.1 - 0.1 / turned * np.tanh(turned))
    assert work_of_cycle(hinge, friction, 0.2, 400) == pytest.approx(expected, rel=2e-3)


def test_friction_remembers_the_same_whatever_the_steps(hinge) -> None:
    """The update is exact for a monotone change: one step or twenty."""
    system, state = hinge
    friction = Hysteresis(couple=1e-3, curvature=0.05)
    once = friction.start(system.cloth, folded(0.0))
    many, still = once, (state.velocity, torch.zeros_like(system.gravity))
    for before, after in ((0.0, 0.3), (0.3, -0.1)):
        once = friction.update(system.cloth, once, folded(after), *still, 0.02)
        for angle in np.linspace(before, after, 21)[1:]:
            many = friction.update(system.cloth, many, folded(angle), *still, 0.001)
    torch.testing.assert_close(once, many, rtol=1e-12, atol=1e-12)


def test_a_state_without_memory_is_refused(hinge) -> None:
    system, state = hinge
    remembering, _ = apply([Hysteresis(couple=1e-4)], system, state)
    with pytest.raises(UsageError, match="memories"):
        advance(remembering, state, 1e-3, steps=1)
