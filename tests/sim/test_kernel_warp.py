"""The Warp kernel computes what the torch source defines, on Warp's own device for the
processor."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from flagdata.errors import UsageError
from sim.cloth.air import QuadraticNormal, Stokes
from sim.cloth.contact import Contact
from sim.cloth.handles import Handles
from sim.cloth.limits import StrainLimits
from sim.cloth.material import named_material
from sim.cloth.mesh import grid
from sim.cloth.scene import assemble, flag
from sim.cloth.state import State
from sim.cloth.stiffness_tables import Evaluation
from sim.integrate import Backend, BackwardEuler, Symplectic, advance
from sim.kernel_warp import warp_batch
from sim.run import Recipe, parse
from tests.sim.conftest import PLAIN, make_system

wp = pytest.importorskip("warp", reason="warp-lang is not installed: pip install 'flagdata[gpu]'")
FABRICS = ("camel-ponte-roma", "white-swim-solid", "royal-target")


@pytest.fixture
def flapping(distorted):
    """Three fabrics in a breeze, held by springs at two corners: a system and its start."""
    return make_system(
        distorted,
        [named_material(name) for name in FABRICS],
        handles=Handles(vertices=(0, 28)),
        gravity=(0.0, 0.0, -9.81),
        wind=(3.0, 0.5, 0.0),
        dtype=torch.float32,
    )


def test_a_second_of_flags_is_the_compiled_kernels_to_a_tenth_of_a_millimetre() -> None:
    # Where rounding grows little: the compiled kernel in float64 is 1e-5 m away by then. On fine
    # meshes, where it grows a hundredfold in 0.2 s, no two ways of adding up agree for a second.
    flags = [
        flag(material=named_material("camel-ponte-roma"), wind_speed=speed, columns=6)
        for speed in (1.0, 2.0, 3.0)
    ]
    system, start = assemble(flags)
    steps = Symplectic().steps(system, 0.04)
    ends = []
    for backend in (Backend.WARP, Backend.KERNEL):
        state = start
        for _ in range(25):
            state = advance(system, state, 0.04, steps=steps, backend=backend)
        ends.append(state.position)
    assert float((ends[1] - start.position).norm(dim=1).amax(0).min()) > 1.0
    assert float((ends[0] - ends[1]).norm(dim=1).max()) < 1e-4


@pytest.mark.parametrize("evaluation", list(Evaluation))
@pytest.mark.parametrize("stiffness", [1e3, float("inf")])
def test_twenty_steps_agree_with_torch_to_rounding(evaluation, stiffness, distorted) -> None:
    handles = Handles(
        vertices=(0, 4),
        stiffness=stiffness,
        times=(0.0, 0.1),
        offsets=((0, 0, 0), (0.02, 0.0, 0.01)),
    )
    system, state = make_system(
        distorted,
        [named_material(name) for name in FABRICS],
        handles=handles,
        gravity=(0.0, 0.0, -9.81),
        wind=(5.0, 1.0, 0.0),
        air=QuadraticNormal(density=1.2, drag=0.4),
        evaluation=evaluation,
        dtype=torch.float32,
    )
    x = state.position
    bump = 0.05 * torch.sin(23 * x[:, 1]) * torch.cos(17 * x[:, 2])
    folded = x * 1.02 + torch.stack([bump, 0.1 * bump, torch.zeros_like(bump)], dim=1)
    start = State(position=folded, velocity=3 * torch.cos(11 * folded.roll(1, 1)))
    final, defined = (
        advance(system, start, 0.002, steps=20, backend=b) for b in (Backend.WARP, Backend.TORCH)
    )
    # As for the compiled kernel in float32.
    torch.testing.assert_close(final.position, defined.position, rtol=0, atol=2e-5)
    torch.testing.assert_close(final.velocity, defined.velocity, rtol=0, atol=2e-2)


@pytest.fixture
def whole_blocks() -> Iterator[None]:
    wp.config.enable_cpu_blocks = True
    yield
    wp.config.enable_cpu_blocks = False


@pytest.mark.usefixtures("whole_blocks")
def test_threads_of_a_block_give_the_bits_that_one_thread_gives(flapping) -> None:
    system, start = flapping
    together = advance(system, start, 0.002, steps=20, backend=Backend.WARP)
    wp.config.enable_cpu_blocks = False
    alone = advance(system, start, 0.002, steps=20, backend=Backend.WARP)
    assert torch.equal(together.position, alone.position)
    assert torch.equal(together.velocity, alone.velocity)


def test_a_diverging_member_leaves_the_others_unharmed(flapping) -> None:
    system, start = flapping
    broken = State(position=start.position.clone(), velocity=start.velocity)
    broken.position[5, 1, 1] = torch.nan
    expected = advance(system, start, 0.002, steps=20, backend=Backend.WARP)
    final = advance(system, broken, 0.002, steps=20, backend=Backend.WARP)
    assert final.healthy().tolist() == [True, False, True]
    assert torch.equal(final.position[..., [0, 2]], expected.position[..., [0, 2]])


class _Push:
    def force(self, cloth, time, position, velocity, wind):
        return torch.zeros_like(position)


@pytest.mark.parametrize(
    ("more", "named_"),
    [
        ({"effects": (_Push(),)}, "effects"),
        ({"remembering": (_Push(),)}, "forces that remember"),
        ({"contact": Contact()}, "contact"),
        ({"limits": StrainLimits()}, "strain limits"),
        ({"air": Stokes()}, "the wind force Stokes"),
    ],
)
def test_what_it_does_not_have_is_refused_by_name(more, named_, flapping) -> None:
    system, start = flapping
    with pytest.raises(UsageError, match=f"only the base model, not {named_}"):
        advance(replace(system, **more), start, 0.002, steps=20, backend=Backend.WARP)


def test_implicit_steps_float64_and_gradients_are_refused(flapping, distorted) -> None:
    system, start = flapping
    with pytest.raises(UsageError, match="only leapfrog steps"):
        BackwardEuler(backend=Backend.WARP).advance(system, start, 0.04)
    tracked = State(position=start.position.clone().requires_grad_(), velocity=start.velocity)
    with pytest.raises(UsageError, match="no gradients"):
        advance(system, tracked, 0.002, steps=2, backend=Backend.WARP)
    double, begin = make_system(distorted, [PLAIN])
    with pytest.raises(UsageError, match="float64"):
        advance(double, begin, 0.002, steps=2, backend=Backend.WARP)


def test_a_mesh_that_does_not_fit_is_refused(flapping, monkeypatch) -> None:
    # 651 vertices, 1,200 faces and 1,750 hinges take 68,528 bytes as compiled for the H200, which
    # has 232,448.
    warp_batch._check_room(grid(width=1.5, height=1.0, columns=30, rows=20), 68_528)
    with pytest.raises(UsageError, match="bytes of shared memory"):
        warp_batch._check_room(grid(width=1.5, height=1.0, columns=60, rows=40), 232_448)
    monkeypatch.setattr(warp_batch, "FACES_LIMIT", 47)
    with pytest.raises(UsageError, match="the mesh has 48 faces"):
        advance(flapping[0], flapping[1], 0.002, steps=2, backend=Backend.WARP)


def test_a_device_that_is_not_there_and_warp_that_is_not_installed_are_errors(
    flapping, monkeypatch
) -> None:
    system, start = flapping
    with pytest.raises(UsageError, match="no device 'cuda:7'"):
        warp_batch._code(torch.device("cuda", 7))
    monkeypatch.setitem(sys.modules, "warp", None)
    monkeypatch.delitem(sys.modules, "sim.kernel_warp.leapfrog", raising=False)
    with pytest.raises(UsageError, match=r"pip install 'flagdata\[gpu\]'"):
        advance(system, start, 0.002, steps=2, backend=Backend.WARP)


def test_a_recipe_names_the_backend_and_its_hash_changes_only_then() -> None:
    scene = (
        '[scene]\nshape = "flag"\n[material]\nname = "paper"\n[wind]\nspeed = 4.0\n[integrator]\n'
    )

    def recipe(integrator: str) -> Recipe:
        return parse(scene + integrator, name="r", folder=Path(), where="r")

    assert recipe('backend = "warp"').integrator.backend is Backend.WARP
    assert recipe('backend = "auto"').identity() == recipe("").identity()
    assert recipe('backend = "warp"').identity() != recipe("").identity()
    with pytest.raises(UsageError, match="only leapfrog steps"):
        recipe('name = "implicit"\nbackend = "warp"')


def test_threads_may_run_batches_at_once() -> None:
    # As `flagdata simulate --workers` does; the mesh is one that no other test has had compiled.
    mesh = grid(width=0.5, height=0.3, columns=5, rows=3)

    def one(_: int) -> torch.Tensor:
        system, start = make_system(mesh, [PLAIN], wind=(3.0, 0.5, 0.0), dtype=torch.float32)
        return advance(system, start, 0.002, steps=20, backend=Backend.WARP).position

    with ThreadPoolExecutor(4) as pool:
        first, *others = pool.map(one, range(8))
    assert all(torch.equal(other, first) for other in others)
