"""Effects on how the cloth is held."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from flagdata.errors import UsageError
from sim.cloth.air import QuadraticNormal
from sim.cloth.handles import Handles, corners
from sim.cloth.mesh import grid
from sim.effects import EFFECTS, Slack, apply
from sim.integrate import BackwardEuler, JointBatch, SplitEuler, advance
from tests.sim.conftest import PLAIN, make_system

FullHoist = EFFECTS["full-hoist"]
TiltedPole = EFFECTS["tilted-pole"]

STILL = QuadraticNormal(density=0.0)


@pytest.fixture
def held():
    """A flag on two corners, and its start; options as for the system."""
    mesh = grid(width=0.6, height=0.4, columns=6, rows=4)

    def make(**options):
        handles = Handles(vertices=corners(mesh.rest), stiffness=options.pop("stiffness", 1e3))
        return make_system(mesh, [PLAIN], handles=handles, air=STILL, **options)

    return make


def test_lacing_pulls_with_its_stiffness_per_length_of_hoist(held) -> None:
    """Moved by d as a whole, the hoist between its corners' half cells, 0.4 − 2·0.05 m, pulls back
    with that."""
    system, state = held()
    laced, _ = apply([FullHoist(stiffness=5e3)], system, state)
    shift = torch.tensor([0.01, -0.02, 0.03], dtype=torch.float64)[:, None]
    (lace,) = laced.ties
    force = lace.force(laced.cloth, 0.0, state.position + shift).sum(0)
    torch.testing.assert_close(force, -5e3 * 0.3 * shift, rtol=1e-12, atol=0)


@pytest.mark.parametrize("integrator", ["implicit", "symplectic"])
def test_tight_lacing_keeps_the_hoist_in_place_and_loose_does_not(held, integrator) -> None:
    """Under gravity of 10 m/s² in the y direction each of the hoist's vertices carries about its
    column's mass: with 1e5 N/m² of lacing, 0.2 · 0.6 · 10 / 1e5 is 12 µm, at most doubled as the
    load comes at once."""
    system, state = held(gravity=(10.0, 0.0, 0.0))
    laced, _ = apply([FullHoist(stiffness=1e5)], system, state)
    middle = 2
    travel = []
    for each in (system, laced):
        start = state
        if integrator == "implicit":
            final = BackwardEuler(step=2e-3).advance(each, start, 0.06)
        else:
            final = advance(each, start, 0.06, steps=300)
        travel.append(float((final.position - state.position)[middle].norm()))
    assert travel[0] > 5e-3
    assert travel[1] < 1.5 * 24e-6


def test_a_hoist_held_throughout_needs_no_lacing() -> None:
    mesh = grid(width=0.6, height=0.4, columns=3, rows=1)
    system, state = make_system(mesh, [PLAIN], handles=Handles(vertices=(0, 1)))
    with pytest.raises(UsageError, match="held already"):
        apply([FullHoist(stiffness=1e3)], system, state)


@pytest.mark.parametrize("distance", [0.0, 0.02, 0.05, 0.2])
def test_a_cord_pulls_only_beyond_its_length(held, distance) -> None:
    system, state = held()
    slack, _ = apply([Slack(length=0.05)], system, state)
    direction = torch.tensor([0.6, 0.0, -0.8], dtype=torch.float64)[:, None]
    moved = state.position + distance * direction
    drive = slack.drive(0.0, 0.01)
    total = slack.force(drive, 0.0, 0.0, moved, state.velocity) - slack.internal(
        moved, state.velocity
    )
    expected = -1e3 * max(distance - 0.05, 0.0) * direction
    for vertex in (0, 4):
        torch.testing.assert_close(total[vertex], expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("integrator", ["implicit", "symplectic", "split"])
def test_within_its_slack_the_cloth_falls_freely(held, integrator) -> None:
    """v = −g t for every vertex: springs, their damping and, in backward Euler, their stiffness are all gone."""
    tight = held(gravity=(0.0, 0.0, -9.81))
    system, state = apply([Slack(length=0.5)], *tight)
    base = BackwardEuler(step=5e-3, tolerance=1e-12)
    if integrator == "implicit":
        final = base.advance(system, state, 0.1)
    elif integrator == "split":  # beside a batch that is held tightly
        joint, start = JointBatch.of([tight, (system, state)])
        final = SplitEuler(base=base).advance_jointly(joint, start, 0.1).select(slice(1, 2))
        np.testing.assert_array_equal(
            SplitEuler(base=base).advance(system, state, 0.1).velocity, final.velocity
        )
    else:
        final = advance(system, state, 0.1, steps=500)
    np.testing.assert_allclose(final.velocity[:, 2, 0], -0.981, rtol=1e-6)


def test_slack_needs_springs(held) -> None:
    system, state = held(stiffness=float("inf"))
    with pytest.raises(UsageError, match="springs"):
        apply([Slack(length=0.05)], system, state)


def test_a_tilted_pole_turns_everything_rigidly_by_its_angle(held) -> None:
    system, state = held()
    for effect, toward in ((TiltedPole(lean=0.4), [0.0, 1.0]), (TiltedPole(sway=0.4), [-1.0, 0.0])):
        tilted, start = apply([effect], system, state)
        pole = (tilted.anchors[1] - tilted.anchors[0])[:, 0].numpy()
        # The flag stands in the y–z plane with its fly toward +y; its left is −x.
        expected = [*(0.4 * np.sin(0.4) * np.array(toward)), 0.4 * np.cos(0.4)]
        np.testing.assert_allclose(pole, expected, rtol=0, atol=1e-12)
        before, after = (
            torch.cdist(p[..., 0], p[..., 0]) for p in (state.position, start.position)
        )
        torch.testing.assert_close(after, before, rtol=0, atol=1e-7)
        torch.testing.assert_close(start.position[list(system.handles.vertices)], tilted.anchors)


def test_a_pole_without_attachments_cannot_be_tilted(square) -> None:
    system, state = make_system(square, [PLAIN])
    with pytest.raises(UsageError, match="nothing holds"):
        apply([TiltedPole(lean=0.1)], system, state)


def test_lacing_moves_with_the_handles() -> None:
    mesh = grid(width=0.6, height=0.4, columns=6, rows=4)
    handles = Handles(
        vertices=corners(mesh.rest), times=(0.0, 1.0), offsets=((0.0, 0.0, 0.0), (0.0, 0.5, 0.0))
    )
    system, state = make_system(mesh, [PLAIN], handles=handles)
    system, state = apply([FullHoist(stiffness=5e3)], system, replace(state))
    (lace,) = system.ties
    moved = state.position + torch.tensor([0.0, 0.25, 0.0], dtype=torch.float64)[:, None]
    torch.testing.assert_close(
        lace.force(system.cloth, 0.5, moved), torch.zeros_like(moved), rtol=0, atol=1e-12
    )
