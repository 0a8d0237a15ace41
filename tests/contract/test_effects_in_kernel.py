"""Which effects the compiled kernel has, and that what it computes is what torch defines.

An effect's C++ stands beside its torch file; where any part of what acts has none, all of it runs
by torch.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import torch

from flagdata.core.rng import stream
from flagdata.errors import UsageError
from sim.cloth import scene
from sim.cloth.air import AIR_FORCES, Stokes
from sim.cloth.material import named_material
from sim.cloth.scene import assemble
from sim.cloth.state import State
from sim.cloth.system import System
from sim.effects import EFFECTS, FieldEffect, Seen, load
from sim.integrate import Backend, BackwardEuler, JointBatch, SplitEuler, advance
from sim.kernel import Kernel
from tests.contract.strengths import nulls
from tests.contract.test_effects import START, drawn, flag, with_effect

EFFECTS_BY_TORCH: dict[str, str] = {}
"""Registered effects that have no C++, with the reason."""
AIR_BY_TORCH = {
    "stokes": "the paper's text in place of the reference simulator's air, used by no data set"
}
"""Wind forces that have none."""
IN_THE_BASE = (
    "internal-damping",
    "hem-mass",
    "hem-stiffness",
    "wet-mass",
    "gusts",
    "logged-gusts",
    "direction-change",
    "vertical-wind",
    "full-hoist",
    "slack",
    "tilted-pole",
)
"""They change what the base model is given (wind, masses, attachments), so that they need no C++ of
their own."""
BESIDE = [name for name in EFFECTS if name not in (*IN_THE_BASE, *EFFECTS_BY_TORCH)]


class Pull(FieldEffect):
    """A field as proposals write it: read when it is run, so that no C++ stands beside it."""

    def acceleration(self, seen: Seen) -> torch.Tensor:
        return seen.upward


def kernel_of(system: System) -> Kernel:
    kernel = Kernel.of(system)
    assert kernel is not None
    return kernel


@pytest.mark.parametrize("name", list(EFFECTS))
def test_every_registered_effect_runs_in_the_kernel_but_for_those_that_are_listed(
    name: str,
) -> None:
    system, _ = with_effect(drawn(name), *flag())
    assert system.extra == (name not in IN_THE_BASE)
    assert (kernel_of(system).beside is None) == (name in EFFECTS_BY_TORCH)


@pytest.mark.parametrize("name", list(AIR_FORCES))
def test_every_wind_force_runs_in_the_kernel_but_for_those_that_are_listed(name: str) -> None:
    system, _ = flag()
    changed = replace(system, air=AIR_FORCES[name]())
    assert (kernel_of(changed).beside is None) == (name in AIR_BY_TORCH)


@pytest.mark.parametrize("other", [Pull(), None], ids=["a field", "other air"])
def test_beside_what_has_no_code_all_that_acts_runs_by_torch(other: Any) -> None:
    system, state = with_effect(drawn("lift"), *flag())
    system = replace(system, air=Stokes()) if other is None else other.apply(system, state)[0]
    assert kernel_of(system).beside is None
    runs = [
        advance(system, state, 0.0012, steps=6, backend=b).velocity
        for b in (Backend.AUTO, Backend.TORCH)
    ]
    torch.testing.assert_close(runs[0], runs[1], rtol=0, atol=1e-10)


# Sums of some tens of terms, in another order: some tens of roundings of the largest force, or of
# the air's, of whose differences flows are.
@pytest.mark.parametrize(("dtype", "tolerance"), [(torch.float64, 1e-13), (torch.float32, 2e-5)])
@pytest.mark.parametrize("name", BESIDE)
def test_forces_are_those_of_torch(name: str, dtype: torch.dtype, tolerance: float) -> None:
    system, state = with_effect(drawn(name), *flag(dtype=dtype))
    drive = system.drive(state.time, state.time + 0.01)
    moved = 0.97 * state.position.roll(1, 1) + state.position
    level = state.velocity.roll(1, 0)
    memory = system.remember_step(
        state.memory, drive.wind[0], state.time, moved, level, elapsed=0.2
    )
    expected = system.extra_force(
        drive, 0.3, state.time, moved, state.velocity, memory=memory, effect_velocity=level
    )
    computed = kernel_of(system).extra(drive, 0.3, moved, state.velocity, level, memory=memory)
    air = system.air.plain.force(system.cloth, moved, state.velocity, drive.wind[0])
    assert float(expected.abs().max()) > 0
    assert float((computed - expected).abs().max()) < tolerance * max(
        float(f.abs().max()) for f in (expected, air)
    )


@pytest.mark.parametrize("name", BESIDE)
def test_members_of_every_block_have_their_own_numbers(name: str) -> None:
    """Twenty members in single precision: a full block, and one with spare lanes."""
    scenes = [
        scene.flag(material=named_material("camel-ponte-roma"), wind_speed=3 + 0.2 * b, columns=4)
        for b in range(20)
    ]
    system, state = assemble(scenes)
    system, state = (
        EFFECTS[name]
        .drawn(stream(5, name), batch=20)
        .for_batch(20, dtype=torch.float32, device=torch.device("cpu"))
        .apply(system, state)
    )
    moved = state.position + 0.02 * torch.sin(30 * state.position.roll(1, 1))
    velocity = torch.cos(11 * moved.roll(1, 0))
    drive = system.drive(START, START + 0.01)
    memory = system.remember_step(state.memory, drive.wind[0], START, moved, velocity, elapsed=0.2)
    expected = system.extra_force(drive, 0.3, START, moved, velocity, memory=memory)
    computed = kernel_of(system).extra(drive, 0.3, moved, velocity, velocity, memory=memory)
    air = system.air.plain.force(system.cloth, moved, velocity, drive.wind[0])
    scale = torch.maximum(expected.abs().amax((0, 1)), air.abs().amax((0, 1)))
    assert (expected.abs().amax((0, 1)) > 0).all()
    assert ((computed - expected).abs().amax((0, 1)) < 2e-5 * scale).all()


def leapfrog(system: System, state: State) -> State:
    return advance(system, state, 0.0012, steps=6, backend=Backend.KERNEL)


def implicit(system: System, state: State) -> State:
    return BackwardEuler(step=5e-3, tolerance=1e-10, backend=Backend.KERNEL).advance(
        system, state, 0.01
    )


@pytest.mark.parametrize("run", [leapfrog, implicit])
@pytest.mark.parametrize("dtype", [torch.float64, torch.float32])
@pytest.mark.parametrize("name", BESIDE)
def test_a_member_at_null_is_the_base_models_to_the_bit(
    name: str, dtype: torch.dtype, run: Callable[[System, State], State]
) -> None:
    effect: Any = drawn(name)
    mixed = {
        label: torch.tensor([null, float(getattr(effect, label)[1])])
        for label, null in nulls(effect).items()
    }
    changed, base = (
        run(*with_effect(replace(effect, **mixed), *flag(dtype=dtype))),
        run(*flag(dtype=dtype)),
    )
    for field in ("position", "velocity"):
        assert torch.equal(getattr(changed, field)[..., 0], getattr(base, field)[..., 0])
    assert not torch.equal(changed.velocity[..., 1], base.velocity[..., 1])


@pytest.mark.parametrize("run", [leapfrog, implicit])
def test_all_effects_together_agree_with_torch(run: Callable[[System, State], State]) -> None:
    system, state = flag()
    for name in EFFECTS:
        system, state = with_effect(drawn(name), system, state)
    assert kernel_of(system).beside is not None
    final = run(system, state)
    if run is leapfrog:
        expected = advance(system, state, 0.0012, steps=6, backend=Backend.TORCH)
    else:
        expected = BackwardEuler(step=5e-3, tolerance=1e-10, backend=Backend.TORCH).advance(
            system, state, 0.01
        )
    for field in ("position", "velocity"):
        torch.testing.assert_close(
            getattr(final, field), getattr(expected, field), rtol=0, atol=1e-9
        )
    for past, defined in zip(final.memory, expected.memory, strict=True):
        torch.testing.assert_close(past, defined, rtol=0, atol=1e-9)


@pytest.mark.parametrize("run", [leapfrog, implicit])
@pytest.mark.parametrize("name", list(EFFECTS))
def test_both_integrators_with_an_effect_agree_with_torch(
    name: str, run: Callable[[System, State], State]
) -> None:
    system, state = with_effect(drawn(name), *flag())
    final = run(system, state)
    if run is leapfrog:
        expected = advance(system, state, 0.0012, steps=6, backend=Backend.TORCH)
    else:
        expected = BackwardEuler(step=5e-3, tolerance=1e-10, backend=Backend.TORCH).advance(
            system, state, 0.01
        )
    torch.testing.assert_close(final.velocity, expected.velocity, rtol=0, atol=1e-9)


def splitting(backend: Backend) -> SplitEuler:
    return SplitEuler(base=BackwardEuler(step=5e-3, tolerance=1e-11, backend=backend))


@pytest.mark.parametrize("dtype", [torch.float64, torch.float32])
def test_batches_of_all_effects_split_jointly_in_one_call_as_torch_splits_each(
    dtype: torch.dtype, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Blocks hold members of several batches; what forces remember is carried from frame to
    frame."""
    base = flag(dtype=dtype)
    batches = [with_effect(drawn(name), *base) for name in EFFECTS]
    batches = [
        (system, replace(state, velocity=torch.cos(11 * state.position.roll(1, 0))))
        for system, state in batches
    ]
    expected = batches
    for _ in range(2):
        expected = [
            (own, splitting(Backend.TORCH).advance(own, state, 0.01)) for own, state in expected
        ]
    monkeypatch.setattr(
        Kernel, "extra", lambda *_, **__: pytest.fail("impulses are taken batch by batch")
    )
    joint, together = JointBatch.of(batches)
    for _ in range(2):
        together = splitting(Backend.AUTO).advance_jointly(joint, together, 0.01)
    tolerance = 1e-8 if dtype == torch.float64 else 2e-4
    for field in ("position", "velocity"):
        whole = torch.cat([getattr(state, field) for _, state in expected], dim=-1)
        torch.testing.assert_close(getattr(together, field), whole, rtol=0, atol=tolerance)
    remembered = [past for _, state in expected for past in state.memory]
    assert remembered
    for past, defined in zip(together.memory, remembered, strict=True):
        torch.testing.assert_close(past, defined, rtol=0, atol=tolerance)
    alone, start = batches[list(EFFECTS).index("added-mass")]
    once, defined = (
        splitting(b).advance(alone, start, 0.01) for b in (Backend.AUTO, Backend.TORCH)
    )
    torch.testing.assert_close(once.velocity, defined.velocity, rtol=0, atol=tolerance)


OWN = '''
from dataclasses import dataclass
from typing import Annotated
from sim.cloth.air import face_wind
from sim.effects.effect import ForceEffect
from sim.effects.parameter import Value, strength


@dataclass(frozen=True, kw_only=True)
class Sideways(ForceEffect):
    """A face is pushed along its normal in proportion to the wind across it."""

    size: Annotated[Value, strength(unit="kg/(m² s)", prior=(0.0, 1.0), source="none")] = 0.0

    def force(self, cloth, time, position, velocity, wind):
        seen = face_wind(cloth, position, velocity, wind)
        return cloth.shared_out((cloth.areas / 3)[:, None, None] * self.size * seen.across * seen.normal)
'''
OWN_CODE = """
#include "effect.hpp"
struct Sideways {
  template <typename V>
  static void act(const V* number, const Face<V>& seen, Vector3<V>& push) {
    push = add(push, scale(seen.normal, number[0] * seen.across));
  }
};
EFFECT(FaceForce, Sideways)
"""


def of_file(folder: Path, code: str) -> tuple[System, State]:
    """A flag with an effect of a file, and that C++ beside it."""
    # A file is loaded once for its content, wherever it lies.
    (folder / "own.py").write_text(f"{OWN}\n# {folder.name}\n")
    (folder / "own.hpp").write_text(code)
    return with_effect(load(f"{folder / 'own.py'}:Sideways")(size=0.4), *flag())  # pyright: ignore[reportCallIssue]


def test_an_effect_of_a_file_runs_in_the_kernel_by_the_code_beside_it(tmp_path: Path) -> None:
    system, state = of_file(tmp_path, OWN_CODE)
    assert kernel_of(system).beside is not None
    final, expected = (
        leapfrog(system, state),
        advance(system, state, 0.0012, steps=6, backend=Backend.TORCH),
    )
    torch.testing.assert_close(final.velocity, expected.velocity, rtol=0, atol=1e-10)


def test_code_that_does_not_compile_is_reported_and_torch_runs(tmp_path: Path) -> None:
    system, state = of_file(tmp_path, OWN_CODE.replace("number[0]", "nonsense"))
    with pytest.warns(RuntimeWarning, match=r"(?s)own.hpp is left aside .*nonsense"):
        final = leapfrog(system, state)
    expected = advance(system, state, 0.0012, steps=6, backend=Backend.TORCH)
    torch.testing.assert_close(final.velocity, expected.velocity, rtol=0, atol=1e-10)


def test_code_of_another_kind_is_refused(tmp_path: Path) -> None:
    other = OWN_CODE.replace(
        "const Face<V>& seen, Vector3<V>& push", "const Vector3<V>&, Vector3<V>&"
    )
    other = other.replace("push = add(push, scale(seen.normal, number[0] * seen.across));", "")
    system, _ = of_file(tmp_path, other.replace("FaceForce", "Flow"))
    with pytest.raises(UsageError, match=r"C\+\+ of Sideways is of the kind FLOW"):
        Kernel.of(system)
