"""What every effect on the cloth must hold to: parametrised over the table, so that an entry there
enrols it here.

The outcome that is compared is the state after a few steps of a small, folded, moving flag:
wherever an effect enters the equations (forces, wind, mass, attachment), it shows there.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

from flagdata.core.rng import stream
from flagdata.errors import InputError, UsageError
from sim.cloth import scene
from sim.cloth.handles import Handles
from sim.cloth.material import named_material
from sim.cloth.mesh import Mesh, grid
from sim.cloth.scene import Scene, assemble
from sim.cloth.state import State
from sim.cloth.system import System
from sim.effects import EFFECTS, Effect
from sim.integrate import Backend, BackwardEuler, Symplectic, advance
from tests.contract.strengths import nulled, nulls

NAMES = list(EFFECTS)
BATCH = 2
START = 12.0  # turning winds have begun by then


def flag(
    turn: np.ndarray | None = None,
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0),
    **options: Any,
):
    """A folded, moving flag with irregular faces and its system; turned and shifted as a whole."""
    turn = np.eye(3) if turn is None else turn
    mesh = grid(width=0.6, height=0.4, columns=4, rows=3)
    rest = mesh.rest.copy()
    inner = np.setdiff1d(np.arange(len(rest)), mesh.boundary)
    rest[inner] += 0.02 * np.sin(np.arange(2 * len(inner)).reshape(-1, 2) * 7.0)
    mesh = Mesh(rest=rest, faces=mesh.faces)
    u, v = rest.T
    start = np.stack(
        [0.98 * u, 0.15 * u + 0.03 * np.sin(9 * u) * np.cos(7 * v), v - 0.1 * u], axis=1
    )
    winds = np.array([(5.0, 1.0, 0.2), (4.0, -2.0, 0.0)])
    scenes = [
        Scene(
            mesh=mesh,
            position=start @ turn.T + shift,
            material=named_material(material),
            handles=Handles(vertices=(0, 3)),
            wind=tuple(turn @ wind),
        )
        for material, wind in zip(("camel-ponte-roma", "white-swim-solid"), winds, strict=True)
    ]
    system, state = assemble(scenes, **({"dtype": torch.float64} | options))
    speed = np.stack([np.cos(11 * v), 2 * np.sin(7 * u + 1), np.cos(5 * u) * v], axis=1) @ turn.T
    velocity = torch.tensor(speed, dtype=system.cloth.dtype).unsqueeze(-1).repeat(1, 1, BATCH)
    # Away from the anchors, so that the handles pull and cords are taut.
    pulled = torch.tensor(turn @ (0.05, 0.03, 0.04), dtype=system.cloth.dtype)[:, None]
    return system, replace(state, position=state.position + pulled, velocity=velocity, time=START)


def drawn(name: str, *path: str | int) -> Effect:
    return EFFECTS[name].drawn(stream(5, name, *path), batch=BATCH)


def with_effect(effect: Effect, system: System, state: State) -> tuple[System, State]:
    """As `effects.apply`, but also where the effect is at its null value."""
    return effect.for_batch(BATCH, dtype=system.cloth.dtype, device=system.cloth.device).apply(
        system, state
    )


def outcome(effect: Effect | None, batch: tuple[System, State], *, steps: int = 6) -> Tensor:
    """Positions and velocities after 1.2 ms: (2, vertex, 3, batch)."""
    system, state = batch if effect is None else with_effect(effect, *batch)
    final = advance(system, state, 0.0012, steps=steps, backend=Backend.TORCH)
    return torch.stack([final.position, final.velocity])


def implicit_outcome(effect: Effect | None, batch: tuple[System, State]) -> Tensor:
    """The same after two steps of 5 ms of backward Euler."""
    system, state = batch if effect is None else with_effect(effect, *batch)
    final = BackwardEuler(step=5e-3, tolerance=1e-10, backend=Backend.TORCH).advance(
        system, state, 0.01
    )
    return torch.stack([final.position, final.velocity])


@cache
def base(run: Callable[..., Tensor]) -> Tensor:
    """The base model's outcome."""
    return run(None, flag())


@cache
def single_base() -> Tensor:
    """The base model's outcome in single precision."""
    return outcome(None, flag(dtype=torch.float32))


@cache
def plain_outcome(name: str) -> Tensor:
    """An effect's outcome, as it is drawn."""
    return outcome(drawn(name), flag())


@pytest.mark.parametrize("name", NAMES)
def test_at_its_null_value_trajectories_are_those_of_the_base_model_to_the_bit(name: str) -> None:
    effect = nulled(drawn(name))
    assert effect.absent
    for run in (outcome, implicit_outcome):
        assert torch.equal(run(effect, flag()), base(run))


@pytest.mark.parametrize("name", NAMES)
def test_a_member_at_null_is_the_base_models_to_the_bit_whatever_the_others_have(name: str) -> None:
    effect = drawn(name)
    mixed = {
        label: torch.tensor([null, float(getattr(effect, label)[1])])
        for label, null in nulls(effect).items()
    }
    mixed = {label: value.double() for label, value in mixed.items()}
    for run in (outcome, implicit_outcome):
        changed = run(replace(effect, **mixed), flag())
        assert torch.equal(changed[..., 0], base(run)[..., 0])
        assert not torch.equal(changed[..., 1], base(run)[..., 1])


@pytest.mark.parametrize("name", NAMES)
def test_away_from_its_null_value_it_acts_in_both_integrators(name: str) -> None:
    effect = drawn(name)
    assert not effect.absent
    for run in (outcome, implicit_outcome):
        change = run(effect, flag())[1] - base(run)[1]
        assert torch.isfinite(change).all()
        # Rounding of float64 is 1e-15; the weakest prior moves something by micrometres a second.
        assert (change.abs().amax((0, 1)) > 1e-7).all()


@pytest.mark.parametrize("name", NAMES)
def test_turning_everything_about_the_vertical_turns_the_outcome(name: str) -> None:
    angle = 0.7
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    turned = outcome(drawn(name), flag(turn))
    expected = torch.einsum("ij,svjb->svib", torch.tensor(turn), plain_outcome(name))
    torch.testing.assert_close(turned, expected, rtol=0, atol=1e-10)


@pytest.mark.parametrize("name", NAMES)
def test_moving_everything_moves_the_outcome(name: str) -> None:
    shift = (3.0, -2.0, 1.0)
    moved, still = outcome(drawn(name), flag(shift=shift)), plain_outcome(name)
    torch.testing.assert_close(
        moved[0] - torch.tensor(shift)[:, None], still[0], rtol=0, atol=1e-11
    )
    # Strains lose digits to the shift, and stiff faces amplify that into velocities.
    torch.testing.assert_close(moved[1], still[1], rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_single_precision_is_near_double(name: str) -> None:
    single = outcome(drawn(name), flag(dtype=torch.float32)).double()
    double = plain_outcome(name)
    rounding = single_base().double() - base(outcome)
    # The base model's own rounding is the measure: the effect may add as much again, and 1e-5 of
    # what moves.
    allowed = 3 * rounding.abs().amax((1, 2, 3)) + 1e-5 * double.abs().amax((1, 2, 3))
    assert ((single - double).abs().amax((1, 2, 3)) <= allowed).all()


@pytest.mark.parametrize("name", NAMES)
def test_gradients_of_parameters_and_shape_are_those_of_differences(name: str) -> None:
    effect = drawn(name, "gradient")
    names = list(effect.parameters())
    system, state = flag()
    direction = torch.sin(torch.arange(state.position.numel(), dtype=torch.float64)).reshape(
        state.position.shape
    )

    def run(scale: Tensor, *values: Tensor) -> Tensor:
        start = replace(state, position=state.position + scale * direction)
        changed = replace(effect, **dict(zip(names, values, strict=True)))
        final = outcome(changed, (system, start), steps=2)
        return (
            final * torch.cos(torch.arange(final.numel(), dtype=torch.float64)).reshape(final.shape)
        ).sum()

    inputs = [torch.zeros((), dtype=torch.float64), *(getattr(effect, label) for label in names)]
    inputs = [value.clone().requires_grad_() for value in inputs]
    # Steps are relative to the parameters' ranges, which differ by orders of magnitude.
    steps = [1e-7, *(1e-5 * (p.prior[1] - p.prior[0]) for p in effect.parameters().values())]
    gradients = torch.autograd.grad(run(*inputs), inputs)
    for index, (gradient, step) in enumerate(zip(gradients, steps, strict=True)):
        difference = torch.zeros_like(gradient)
        with torch.no_grad():
            for member in range(max(1, inputs[index].numel())):
                moved = [[v.clone() for v in inputs] for _ in range(2)]
                moved[0][index].view(-1)[member] += step
                moved[1][index].view(-1)[member] -= step
                difference.view(-1)[member] = (run(*moved[0]) - run(*moved[1])) / (2 * step)
        label = ["position", *names][index]
        torch.testing.assert_close(
            gradient,
            difference,
            rtol=1e-4,
            atol=1e-7 * float(difference.abs().max()) + 1e-9 / step * 1e-5,
            msg=label,
        )


@pytest.mark.parametrize("name", NAMES)
def test_a_gradient_is_there_at_the_null_value(name: str) -> None:
    """Attribution asks for the sensitivity at the base model."""
    effect = nulled(drawn(name))
    values = {
        label: torch.zeros(BATCH, dtype=torch.float64) + effect.parameters()[label].null
        for label in effect.strengths()
    }
    values = {label: value.requires_grad_() for label, value in values.items()}
    effect = replace(effect, **values)
    assert not effect.absent
    gradients = torch.autograd.grad(
        outcome(effect, flag(), steps=2)[1].abs().sum(), list(values.values())
    )
    for gradient in gradients:
        assert torch.isfinite(gradient).all()


@pytest.mark.parametrize("name", NAMES)
def test_a_member_does_not_feel_the_values_of_another(name: str) -> None:
    effect = drawn(name)
    different = drawn(name, "other")
    values = {
        label: (getattr(effect, label)[0], getattr(different, label)[1])
        for label in effect.parameters()
    }
    other = replace(effect, **{label: torch.stack(pair) for label, pair in values.items()})
    for run in (outcome, implicit_outcome):
        first, second = run(effect, flag()), run(other, flag())
        assert torch.equal(first[..., 0], second[..., 0])
        assert not torch.equal(first[..., 1], second[..., 1])


@pytest.mark.parametrize("name", NAMES)
def test_one_number_is_the_same_as_that_number_for_each_member(name: str) -> None:
    effect = drawn(name)
    values = {label: float(getattr(effect, label)[0]) for label in effect.parameters()}
    same = {
        label: torch.full((BATCH,), value, dtype=torch.float64) for label, value in values.items()
    }
    one, each = outcome(replace(effect, **values), flag()), outcome(replace(effect, **same), flag())
    torch.testing.assert_close(one, each, rtol=0, atol=1e-13)


@pytest.mark.parametrize("name", NAMES)
def test_the_kernel_with_the_effect_agrees_with_torch(name: str) -> None:
    system, state = with_effect(drawn(name), *flag())
    kernel, torch_only = (
        advance(system, state, 0.0012, steps=6, backend=b) for b in (Backend.AUTO, Backend.TORCH)
    )
    torch.testing.assert_close(kernel.velocity, torch_only.velocity, rtol=0, atol=1e-10)


@pytest.mark.parametrize("name", NAMES)
def test_compiled_and_eager_forces_agree(name: str) -> None:
    system, state = with_effect(drawn(name), *flag())
    drive = system.drive(START, START + 0.01)

    def force(position: Tensor, velocity: Tensor) -> Tensor:
        return system.extra_force(
            drive, 0.5, START + 0.005, position, velocity, memory=state.memory
        )

    # Traced, not code-generated: that is torch's own business and takes ten seconds an effect.
    compiled = torch.compile(force, backend="aot_eager")
    torch.testing.assert_close(
        compiled(state.position, state.velocity),
        force(state.position, state.velocity),
        rtol=1e-12,
        atol=1e-12,
    )
    torch.compiler.reset()


@pytest.mark.parametrize("name", NAMES)
def test_a_flag_lives_through_half_a_second_at_both_ends_of_the_prior(name: str) -> None:
    """With the integrator's own step, in single precision, in winds of 3 and 8 m/s."""
    scenes = [
        scene.flag(material=named_material("camel-ponte-roma"), wind_speed=w, columns=6)
        for w in (3.0, 8.0)
    ]
    for end in (0, 1):
        values = {
            label: torch.full((BATCH,), p.prior[end])
            for label, p in EFFECTS[name].parameters().items()
        }
        system, state = with_effect(replace(drawn(name), **values), *assemble(scenes))
        integrator = Symplectic()
        for _ in range(5):
            state = integrator.advance(system, state, 0.1)
        assert state.healthy(speed_limit=40.0).all()
        # Backward Euler takes effects explicitly, at steps fifty times as long.
        system, state = with_effect(replace(drawn(name), **values), *assemble(scenes))
        assert BackwardEuler(step=5e-3).advance(system, state, 0.1).healthy(speed_limit=40.0).all()


def test_all_effects_together_run_and_agree_between_kernel_and_torch() -> None:
    system, state = flag()
    for name in NAMES:
        system, state = with_effect(drawn(name), system, state)
    kernel, torch_only = (
        advance(system, state, 0.0012, steps=6, backend=b) for b in (Backend.AUTO, Backend.TORCH)
    )
    torch.testing.assert_close(kernel.velocity, torch_only.velocity, rtol=0, atol=1e-9)
    assert BackwardEuler(step=5e-3).advance(system, state, 0.02).healthy(speed_limit=40.0).all()


@pytest.mark.parametrize("name", NAMES)
def test_values_that_do_not_fit_are_refused_by_name(name: str) -> None:
    effect = drawn(name)
    for label, parameter in effect.parameters().items():
        with pytest.raises(InputError, match=label):
            replace(effect, **{label: float("nan")})
        if np.isfinite(parameter.admissible[1]):
            with pytest.raises(InputError, match=label):
                replace(effect, **{label: parameter.admissible[1] + 1.0})
        with pytest.raises(UsageError, match=label):
            with_effect(replace(effect, **{label: torch.full((5,), parameter.null)}), *flag())


@pytest.mark.parametrize("name", NAMES)
def test_it_travels_between_processes(name: str) -> None:
    again = pickle.loads(pickle.dumps(drawn(name)))
    assert torch.equal(outcome(again, flag()), plain_outcome(name))
