"""What the base model lacks as impulses on an outer step, against every step and closed forms."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

from flagdata.core.rng import stream
from flagdata.errors import UsageError
from sim.cloth.air import NO_AIR, Stokes
from sim.cloth.handles import Handles
from sim.cloth.material import named_material
from sim.cloth.mesh import grid
from sim.cloth.scene import assemble, flag
from sim.effects import EFFECTS, Lift, TangentialLinearDrag, apply
from sim.integrate import Backend, Symplectic, advance
from tests.sim.conftest import PLAIN, make_system

STEP = 4e-4


def drawn(name: str, *, batch: int = 2) -> Any:
    return EFFECTS[name].drawn(stream(5, name), batch=batch)


def flying(
    *effects: Any, winds: tuple[float, ...] = (4.0, 5.0), dtype: torch.dtype = torch.float64
):
    """Flags of 9 columns, a tenth of a second under way without the effects, and the system with
    them."""
    scenes = [
        flag(material=named_material("camel-ponte-roma"), wind_speed=speed, columns=9)
        for speed in winds
    ]
    system, state = assemble(scenes, dtype=dtype)
    state = replace(Symplectic(step=STEP).advance(system, state, 0.1), time=0.0)
    return apply(effects, system, state)


def test_friction_slows_a_sliding_sheet_exponentially_and_at_second_order_of_the_outer_step() -> (
    None
):
    """σ v̇ = −c v along the sheet: v₀ e^(−c t/σ), here e^(−1)."""
    mesh = grid(width=1.0, height=1.0, columns=2, rows=2)
    system, state = make_system(mesh, [PLAIN], air=NO_AIR)
    sliding = torch.tensor([0.0, 3.0, 0.0], dtype=torch.float64)[:, None].expand_as(state.position)
    system, state = apply(
        [TangentialLinearDrag(coefficient=0.4)], system, replace(state, velocity=sliding)
    )
    errors = []
    for outer in (10, 20, 40):
        final = advance(system, state, 0.5, steps=320, outer=outer)
        errors.append(float((final.velocity[:, 1] - 3 * math.exp(-1)).abs().max()))
    assert errors[2] < 4e-4
    # The next term of the error is larger by a factor of c H/σ = 0.1 at the longest step.
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.08)


def test_the_error_falls_with_the_square_of_the_outer_step(distorted) -> None:
    # Neither damping nor air in the base model, whose own error would depend on how often it starts
    # afresh.
    system, state = make_system(
        distorted,
        [PLAIN],
        handles=Handles(vertices=(0, 4)),
        gravity=(0.0, 0.0, -9.81),
        wind=(5.0, 1.0, 0.0),
        air=NO_AIR,
    )
    system, state = apply([Lift(coefficient=1.0)], system, state)
    fine = advance(system, state, 0.064, steps=1280, outer=1280)
    errors = []
    for outer in (16, 32, 64):
        final = advance(system, state, 0.064, steps=1280, outer=outer)
        errors.append(float((final.position - fine.position).norm(dim=1).mean()))
    # Against a reference of finite step the last ratio is a little above 4.
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.2)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.2)


@pytest.mark.parametrize("name", list(EFFECTS))
def test_outer_steps_agree_with_every_step(name: str) -> None:
    system, state = flying(drawn(name))
    base = flying()
    every, outer = (
        Symplectic(step=STEP, outer=longer).advance(system, state, 0.1) for longer in (None, 2e-3)
    )
    none = Symplectic(step=STEP).advance(*base, 0.1)
    error = (outer.position - every.position).norm(dim=1).mean(0)
    moved = (every.position - none.position).norm(dim=1).mean(0)
    if not system.extra:
        assert float(error.max()) == 0
    # The base model's own error of its step, over as many steps, is 0.1 mm.
    assert (error < 0.01 * moved + 1e-4).all()


def test_kernel_and_torch_take_the_same_outer_steps() -> None:
    effects = [
        drawn(name)
        for name in (
            "lift",
            "porosity",
            "pole-wake",
            "added-mass",
            "hysteresis",
            "full-hoist",
            "slack",
        )
    ]
    system, state = flying(*effects)
    results = [
        advance(system, state, 0.008, steps=20, outer=5, backend=b)
        for b in (Backend.TORCH, Backend.KERNEL)
    ]
    torch.testing.assert_close(results[1].position, results[0].position, rtol=0, atol=1e-10)
    torch.testing.assert_close(results[1].velocity, results[0].velocity, rtol=0, atol=1e-8)
    assert len(results[0].memory) == 1
    torch.testing.assert_close(results[1].memory[0], results[0].memory[0], rtol=0, atol=1e-7)


def test_a_members_result_does_not_depend_on_the_others_to_the_bit() -> None:
    outcomes = []
    for other in (0.3, 1.9):
        lift = Lift(coefficient=torch.tensor([0.8, other], dtype=torch.float64))
        system, state = flying(lift, winds=(4.0, 3.0 + other), dtype=torch.float32)
        outcomes.append(
            Symplectic(step=STEP, outer=2e-3).advance(system, state, 0.04).position[..., 0]
        )
    assert torch.equal(*outcomes)


def test_air_of_another_kind_may_act_as_impulses() -> None:
    system, state = flying()
    system = replace(system, air=Stokes(viscosity=0.05))
    every, outer = (
        Symplectic(step=STEP, outer=longer).advance(system, state, 0.1) for longer in (None, 2e-3)
    )
    # The flag falls by 0.1 m; the base model's own error of its step, over as many steps, is 0.2
    # mm.
    assert float((outer.position - every.position).norm(dim=1).mean()) < 3e-4


def test_gradients_go_through_outer_steps() -> None:
    coefficient = torch.tensor([0.5, 0.9], dtype=torch.float64, requires_grad=True)

    def outcome(value: torch.Tensor) -> torch.Tensor:
        system, state = flying(Lift(coefficient=value))
        return (advance(system, state, 0.004, steps=10, outer=2).position[-1] ** 2).sum()

    (gradient,) = torch.autograd.grad(outcome(coefficient), coefficient)
    shift = torch.tensor([1e-3, 1e-3], dtype=torch.float64)
    with torch.no_grad():
        difference = (outcome(coefficient + shift) - outcome(coefficient - shift)) / 2e-3
    # The outcome is all but linear in a weak force over 4 ms.
    np.testing.assert_allclose(float(gradient.sum()), float(difference), rtol=1e-5)


def test_an_outer_step_that_is_too_long_is_refused_with_the_limit() -> None:
    # A force per mass of −r v with r = 300 /s overshoots in steps of 10 ms: the estimate is 0.5/r =
    # 1.7 ms.
    system, state = flying(TangentialLinearDrag(coefficient=300 * 0.284))
    with pytest.raises(UsageError, match=r"within 0\.001[67].* s, the longest"):
        Symplectic(step=STEP, outer=0.01).advance(system, state, 0.04)


def test_impossible_outer_steps_are_refused() -> None:
    for outer in (0.0, -1e-3, math.nan, math.inf):
        with pytest.raises(UsageError, match="outer step"):
            Symplectic(outer=outer)
    system, state = flying(Lift(coefficient=1.0))
    with pytest.raises(UsageError, match="do not divide"):
        advance(system, state, 0.04, steps=100, outer=33)
