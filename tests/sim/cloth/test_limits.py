"""Strain limits: what they hold, what they keep, and that kernel and definition agree."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from flagdata.errors import InputError
from sim.cloth.handles import Handles
from sim.cloth.limits import StrainLimits, correction, limit_strains, stretches
from sim.cloth.material import named_material
from sim.cloth.mesh import grid
from sim.cloth.state import State
from sim.integrate import Backend, BackwardEuler, Symplectic, advance
from tests.sim.conftest import make_system


def test_a_single_triangle_is_brought_to_the_limits_with_its_centroid_kept() -> None:
    # Stretched by 1.3 along u and to 0.8 along v: principal stretches 1.05 and 0.95 afterwards.
    mesh = grid(width=1.0, height=1.0, columns=1, rows=1)
    one = type(mesh)(rest=mesh.rest[[0, 2, 3]], faces=[[0, 1, 2]])
    system, state = make_system(one, [named_material("paper")])
    position = state.position * torch.tensor([1.0, 1.3, 0.8], dtype=torch.float64)[:, None]
    moved = position + correction(system.cloth, StrainLimits(), position)
    large, small = stretches(system.cloth, moved)
    assert float(large) == pytest.approx(1.05)
    assert float(small) == pytest.approx(0.95)
    torch.testing.assert_close(moved.mean(0), position.mean(0))


def test_within_the_limits_nothing_moves(distorted) -> None:
    system, state = make_system(distorted, [named_material("paper")])
    bent = state.position.clone()
    bent[:, 0] = 0.01 * torch.sin(8 * bent[:, 1])
    assert float(correction(system.cloth, StrainLimits(), bent).abs().max()) < 1e-15


def test_a_correction_keeps_the_centre_of_mass_and_turns_with_the_cloth(distorted) -> None:
    system, state = make_system(distorted, [named_material("camel-ponte-roma")])
    position = state.position * 1.2 + 0.05 * torch.sin(9 * state.position.roll(1, 1))
    move = correction(system.cloth, StrainLimits(), position)
    assert float(move.abs().max()) > 1e-3
    momentum = (system.cloth.mass.unsqueeze(1) * move).sum(0)
    assert float(momentum.abs().max()) < 1e-14
    turn = torch.tensor([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], dtype=torch.float64)
    turned = correction(system.cloth, StrainLimits(), torch.einsum("ij,vjb->vib", turn, position))
    torch.testing.assert_close(turned, torch.einsum("ij,vjb->vib", turn, move))


@pytest.mark.parametrize(
    ("method", "limits"),
    [(Symplectic(step=3e-4), StrainLimits()), (BackwardEuler(), StrainLimits(sweeps=50))],
)
def test_a_heavy_hanging_cloth_stretches_to_the_limit_and_not_beyond(method, limits) -> None:
    # A fiftieth of the measured stiffness, at most 10.7 N/m: its weight, 2.8 N/m, stretches it by a
    # quarter and more.
    mesh = grid(width=0.2, height=1.0, columns=4, rows=20)
    top = tuple(int(i) for i in np.flatnonzero(mesh.rest[:, 1] > 1 - 1e-9))
    handles = Handles(vertices=top, stiffness=math.inf)
    soft = named_material("camel-ponte-roma").scaled(stretching=0.02)
    system, state = make_system(mesh, [soft], handles=handles, gravity=(0.0, 0.0, -9.81))
    longest = {}
    for bounds in (None, limits):
        moving, run = replace(system, limits=bounds), state
        for _ in range(25):
            run = method.advance(moving, run, 0.04)
        longest[bounds] = float(stretches(system.cloth, run.position)[0].max())
    assert longest[None] > 1.2
    assert longest[limits] < 1.07


def test_accelerated_sweeps_keep_the_momentum_and_come_closer(distorted) -> None:
    # By the distance from the limits that is left, root mean square over the faces: 30 plain sweeps
    # against 30 of which 22 are accelerated.
    system, state = make_system(distorted, [named_material("camel-ponte-roma")])
    start = state.position * torch.tensor([1.0, 1.3, 1.2], dtype=torch.float64)[:, None]
    bounds = StrainLimits(sweeps=30)
    free = torch.ones_like(start[:, :1])
    plain = start
    for _ in range(bounds.sweeps):
        plain = plain + correction(system.cloth, bounds, plain)
    after, velocity = limit_strains(
        system.cloth, bounds, start, torch.zeros_like(start), 0.01, free
    )

    def left(position: torch.Tensor) -> float:
        large, _ = stretches(system.cloth, position)
        return float(((large - bounds.high).clamp(min=0) ** 2).mean().sqrt())

    assert left(after) < 0.3 * left(plain)
    torch.testing.assert_close(velocity, (after - start) / 0.01, rtol=0, atol=1e-10)
    mass = system.cloth.mass.unsqueeze(1)
    assert float((mass * velocity).sum(0).abs().max()) < 1e-13


@pytest.mark.parametrize("backend", [Backend.TORCH, Backend.KERNEL])
@pytest.mark.parametrize("stiffness", [math.inf, 1e3])
def test_what_handles_hold_is_not_moved_by_the_limits(backend, stiffness, distorted) -> None:
    # The start is beyond the limits, and forces have no time: membranes that pull a gram with 10 N
    # move it by 5 nm.
    handles = Handles(vertices=(0, 4), stiffness=stiffness)
    system, state = make_system(distorted, [named_material("camel-ponte-roma")], handles=handles)
    start = State(position=state.position * 1.2, velocity=torch.zeros_like(state.position))
    if math.isfinite(stiffness):
        system = replace(system, anchors=start.position[system.held])
    system = replace(system, limits=StrainLimits(sweeps=20))
    moved = (advance(system, start, 1e-6, steps=1, backend=backend).position - start.position)[
        ..., 0
    ].norm(dim=1)
    assert float(moved[[0, 4]].max()) < 1e-8
    others = [i for i in range(len(moved)) if i not in (0, 4)]
    assert float(moved[others].min()) > 1e-3


@pytest.mark.parametrize("stiffness", [math.inf, 1e3])
@pytest.mark.parametrize("sweeps", [2, 12])
@pytest.mark.parametrize(("dtype", "tolerance"), [(torch.float64, 1e-9), (torch.float32, 1e-4)])
def test_kernel_and_torch_limit_alike(dtype, tolerance, sweeps, stiffness, distorted) -> None:
    handles = Handles(vertices=(0, 4), stiffness=stiffness)
    system, state = make_system(
        distorted,
        [named_material("camel-ponte-roma"), named_material("gray-interlock")],
        handles=handles,
        wind=(5.0, 0.0, 0.0),
        dtype=dtype,
    )
    system = replace(system, limits=StrainLimits(sweeps=sweeps))
    start = State(position=state.position * 1.1, velocity=torch.cos(9 * state.position.roll(1, 1)))
    results = [
        advance(system, start, 2e-3, steps=20, backend=b) for b in (Backend.TORCH, Backend.KERNEL)
    ]
    torch.testing.assert_close(results[1].position, results[0].position, rtol=0, atol=tolerance)
    torch.testing.assert_close(
        results[1].velocity, results[0].velocity, rtol=0, atol=1e3 * tolerance
    )


@pytest.mark.parametrize(
    "fields", [{"low": 1.0}, {"high": 1.0}, {"low": -0.1}, {"high": math.nan}, {"sweeps": 0}]
)
def test_impossible_limits_are_refused(fields: dict[str, float]) -> None:
    with pytest.raises(InputError, match="strain limits"):
        StrainLimits(**fields)  # type: ignore[arg-type]
