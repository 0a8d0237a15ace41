"""Anchors that move one by one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from flagdata.errors import InputError, UsageError
from sim.cloth import handles
from sim.cloth.anchors import AnchorTracks
from sim.cloth.handles import Handles
from sim.cloth.material import named_material
from sim.cloth.mesh import grid
from sim.cloth.scene import Scene, assemble, upright
from sim.cloth.state import State
from sim.cloth.system import System
from sim.effects import Slack, apply
from sim.integrate import BackwardEuler, JointBatch, SplitEuler, Symplectic

MESH = grid(width=0.3, height=0.3, columns=4, rows=4)
STEP = 0.1
INTEGRATORS = (
    BackwardEuler(tolerance=1e-10),
    Symplectic(),
    SplitEuler(base=BackwardEuler(tolerance=1e-10)),
)


def _hung(*, stiffness: float = 1e3, offsets: float = 0.0) -> tuple[System, State]:
    """A cloth held at its two upper corners; with handles that move along x by so much in a tenth
    of a second."""
    held = Handles(
        vertices=handles.top_corners(MESH.rest),
        stiffness=stiffness,
        times=(0.0, STEP),
        offsets=((0.0, 0.0, 0.0), (offsets, 0.0, 0.0)),
    )
    scene = Scene(
        mesh=MESH, position=upright(MESH), material=named_material("camel-ponte-roma"), handles=held
    )
    return assemble([scene], dtype=torch.float64)


def _tracks(ends: list[list[float]]) -> AnchorTracks:
    """From no displacement to these (held, 3) in a tenth of a second."""
    end = torch.tensor(ends, dtype=torch.float64)[..., None]
    return AnchorTracks(start=0.0, period=STEP, samples=torch.stack([0 * end, end]))


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("stiffness", [1e3, float("inf")])
def test_anchors_that_all_move_alike_are_handles_that_move(
    integrator: BackwardEuler | Symplectic | SplitEuler, stiffness: float
) -> None:
    system, state = _hung(stiffness=stiffness)
    moving, same = _hung(stiffness=stiffness, offsets=0.02)
    tracked = replace(system, motion=_tracks([[0.02, 0.0, 0.0]] * 2))
    expected = integrator.advance(moving, same, STEP).position
    # To rounding and the tolerance of the solves.
    torch.testing.assert_close(
        integrator.advance(tracked, state, STEP).position, expected, rtol=0, atol=1e-9
    )
    assert (expected - integrator.advance(system, state, STEP).position).abs().max() > 0.01


def test_rigid_anchors_are_where_their_own_tracks_take_them() -> None:
    system, state = _hung(stiffness=float("inf"))
    ends = [[0.0, 0.02, 0.0], [-0.01, 0.0, 0.03]]
    after = BackwardEuler().advance(replace(system, motion=_tracks(ends)), state, STEP)
    moved = (after.position - state.position)[list(system.handles.vertices), :, 0]
    np.testing.assert_allclose(moved.numpy(), ends, atol=1e-12)


def test_batches_with_tracks_move_jointly_as_they_do_alone() -> None:
    batches = [
        (replace(system, motion=_tracks([[x, 0.0, 0.0], [0.0, x, 0.0]])), state)
        for x, (system, state) in ((0.01, _hung()), (-0.02, _hung()))
    ]
    integrator = SplitEuler(base=BackwardEuler(tolerance=1e-12))
    joint, start = JointBatch.of(batches)
    together = integrator.advance_jointly(joint, start, STEP).position
    alone = torch.cat([integrator.advance(*batch, STEP).position for batch in batches], dim=-1)
    torch.testing.assert_close(together, alone, rtol=0, atol=1e-9)
    still, start = JointBatch.of([batches[0], _hung()])
    with pytest.raises(UsageError, match="anchors that move"):
        integrator.advance_jointly(still, start, STEP)


def test_tracks_are_constant_beyond_their_ends_and_linear_between() -> None:
    tracks = _tracks([[0.02, 0.0, -0.04]])
    for time, share in ((-1.0, 0.0), (0.0, 0.0), (STEP / 4, 0.25), (STEP, 1.0), (5.0, 1.0)):
        np.testing.assert_allclose(
            tracks.displacement(time)[0, :, 0].numpy(),
            [0.02 * share, 0.0, -0.04 * share],
            atol=1e-15,
        )


def test_tracks_without_two_samples_and_ties_that_would_stay_behind_are_refused() -> None:
    with pytest.raises(InputError, match="two or more samples"):
        AnchorTracks(start=0.0, period=STEP, samples=torch.zeros(1, 2, 3, 1))
    system, state = _hung()
    loose, _ = apply([Slack(length=0.01)], system, state)
    with pytest.raises(UsageError, match="move one by one"):
        replace(loose, motion=_tracks([[0.0] * 3] * 2))
