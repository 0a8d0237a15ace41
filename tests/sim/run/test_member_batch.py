"""Batches: a member's result is its own, whatever else is simulated with it; what fails is reported
and kept apart."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import torch

from flagdata.errors import UsageError
from sim.cloth import membrane
from sim.cloth.material import named_material
from sim.cloth.scene import assemble, flag
from sim.integrate import BackwardEuler, Symplectic
from sim.run import BatchOutcome, Crew, Stepper, parse, principal_strains, run
from tests.sim.run.conftest import make_recipe, small

SIZE = 4


def bits(outcome: BatchOutcome) -> bytes | None:
    return None if outcome.sequence is None else outcome.sequence.positions.tobytes()


def all_bits(outcomes: Sequence[BatchOutcome]) -> list[bytes | None]:
    return [bits(outcome) for outcome in outcomes]


@pytest.mark.parametrize(
    "additions",
    [
        {},
        {"more": '[integrator]\nname = "implicit"'},
        {"more": "[contact]\nthickness = 0.02"},
        {"more": "[effects.gusts]\nintensity = 0.2\n[effects.hysteresis]\ncouple = 1e-3"},
        {"more": "[effects.finite-span-loading]\nshare = 0.2\n[effects.wagner-lag]\nshare = 0.5"},
        {"more": '[integrator]\nbackend = "warp"'},
    ],
    ids=["explicit", "implicit", "contact", "effects", "air", "warp"],
)
def test_a_member_is_the_same_to_the_bit_whatever_it_is_simulated_with(additions: dict) -> None:
    crew = Crew(make_recipe(**additions))
    stepper = Stepper.of(crew)
    members = [crew.member(index) for index in range(SIZE)]
    together = all_bits(run(crew, stepper, members, size=SIZE))
    assert None not in together
    assert len(set(together)) == SIZE
    assert all_bits(run(crew, stepper, members[::-1], size=SIZE))[::-1] == together
    assert bits(run(crew, stepper, members[1:2], size=SIZE)[0]) == together[1]


def test_a_backend_that_cannot_run_a_recipe_is_refused_before_the_first_step() -> None:
    more = '[integrator]\nbackend = "warp"\n[effects.lift]\ncoefficient = 2.0'
    with pytest.raises(UsageError, match="only the base model, not effects"):
        Stepper.of(Crew(make_recipe(more=more)))


@pytest.mark.parametrize(
    ("contact", "steps"), [("", 50), ("[contact]\nthickness = 0.02", 150)], ids=["plain", "contact"]
)
def test_members_that_diverge_are_reported_and_leave_the_others_unharmed(
    contact: str, steps: int
) -> None:
    # Steps that soft members bear and stiff ones, up to a thousand times as stiff, do not.
    stiff = 'stretching-factor = { low = 1.0, high = 1e3, scale = "log" }'
    recipe = make_recipe(material=stiff, more=contact)
    crew = Crew(recipe)
    stepper = Stepper(recipe=recipe, method=None, steps=steps)
    members = sorted(
        (crew.member(index) for index in range(8)), key=lambda m: m.scene.material.stretching[1, 0]
    )
    members = [members[0], members[-1], members[1], members[-2]]
    outcomes = run(crew, stepper, members, size=SIZE)
    assert [o.failure[0] if o.failure else None for o in outcomes] == [
        None,
        "diverged",
        None,
        "diverged",
    ]
    assert outcomes[1].failure is not None
    assert "before 0.0" in outcomes[1].failure[1]  # within the first frames
    without = run(crew, stepper, [members[0], members[2]], size=SIZE)
    assert all_bits(without) == [bits(outcomes[0]), bits(outcomes[2])]


def test_a_solve_that_does_not_converge_is_a_divergence_of_that_member() -> None:
    # As many iterations as soft members need, and stiff ones, whose systems are worse conditioned,
    # do not get by with.
    stiff = 'stretching-factor = { low = 1.0, high = 1e5, scale = "log" }'
    recipe = make_recipe(material=stiff)
    crew = Crew(recipe)
    stepper = Stepper(recipe=recipe, method=BackwardEuler(iterations=60), steps=8)
    members = sorted(
        (crew.member(index) for index in range(8)), key=lambda m: m.scene.material.stretching[1, 0]
    )
    chosen = [members[0], members[-1], members[1], members[-2]]
    outcomes = run(crew, stepper, chosen, size=SIZE)
    assert [o.failure[0] if o.failure else None for o in outcomes] == [
        None,
        "diverged",
        None,
        "diverged",
    ]
    without = run(crew, stepper, [chosen[0], chosen[2]], size=SIZE)
    assert all_bits(without) == [bits(outcomes[0]), bits(outcomes[2])]


def test_steps_follow_from_the_recipe_and_not_from_the_draws() -> None:
    crew = Crew(make_recipe())
    stepper = Stepper.of(crew)
    frame = 1 / 25
    for index in range(8):
        system, _ = crew.assemble([crew.member(index)])
        assert Symplectic().steps(system, frame) <= stepper.steps
    assert Stepper.of(Crew(make_recipe(top="# the same"))).steps == stepper.steps


def test_each_material_of_a_recipe_has_its_own_steps() -> None:
    names = ["camel-ponte-roma", "white-dots-on-blk"]

    def crew(material: str) -> Crew:
        text = f"[scene]\ncolumns = 6\n[material]\n{material}\n[wind]\nspeed = 2.0\n"
        return Crew(parse(text, name="r", folder=Path(), where="r"))

    mixed = [Stepper.of(crew(f"names = {names}"), base).steps for base in (0, 1)]
    assert mixed == [Stepper.of(crew(f'name = "{name}"')).steps for name in names]
    assert mixed[1] > 2 * mixed[0]


def test_a_forced_step_beyond_the_limit_is_refused_with_it() -> None:
    with pytest.raises(UsageError, match=r"a step of 0\.02 s is unstable: the limit"):
        Stepper.of(Crew(make_recipe(more="[integrator]\nstep = 0.02")))
    assert Stepper.of(Crew(make_recipe(more="[integrator]\nstep = 5e-4"))).steps == 80
    assert (
        Stepper.of(Crew(make_recipe(more='[integrator]\nname = "implicit"\nstep = 0.02'))).steps
        == 2
    )


UNDAMPED = """
count = 2
batch = 2
[scene]
columns = 12
[material]
name = "camel-ponte-roma"
damping = {damping}
[wind]
speed = {{ low = 2.0, high = 8.0 }}
[time]
settle = {settle}
frames = 8
"""


@pytest.mark.parametrize(
    ("damping", "settle", "failure"),
    [(0.0, 1.6, "crumpled"), (0.25e-3, 1.6, None), (0.25e-3, 0.0, None)],
)
def test_an_undamped_flag_crumples_which_is_reported_and_not_stored(
    damping: float, settle: float, failure: str | None
) -> None:
    recipe = parse(
        UNDAMPED.format(damping=damping, settle=settle), name="r", folder=Path(), where="r"
    )
    crew = Crew(recipe)
    outcomes = run(crew, Stepper.of(crew), [crew.member(0), crew.member(1)], size=2)
    for outcome in outcomes:
        assert (outcome.failure[0] if outcome.failure else None) == failure
        assert (outcome.sequence is None) == (failure is not None)


def test_principal_strains_are_those_of_a_known_deformation() -> None:
    system, state = assemble(
        [flag(material=named_material("camel-ponte-roma"), wind_speed=0, columns=4)],
        dtype=torch.float64,
    )
    rest = torch.tensor(system.cloth.mesh.rest)
    # x = F X: stretched by 1.2 and 0.7 along axes turned by 0.4.
    turn = torch.tensor(
        [[math.cos(0.4), -math.sin(0.4)], [math.sin(0.4), math.cos(0.4)]], dtype=torch.float64
    )
    plane = rest @ (turn @ torch.diag(torch.tensor([1.2, 0.7], dtype=torch.float64)) @ turn.T).T
    position = torch.nn.functional.pad(plane, (0, 1)).unsqueeze(-1)
    strains = principal_strains(system.cloth, position)
    np.testing.assert_allclose(strains[:, 0], -0.3, atol=1e-12)
    np.testing.assert_allclose(strains[:, 1], 0.2, atol=1e-12)
    assert membrane.strain(system.cloth, state.position).g00.abs().max() < 1e-12


def test_energies_are_those_of_the_motion() -> None:
    recipe = make_recipe(more="")
    crew = Crew(recipe)
    outcome = run(crew, Stepper.of(crew), [crew.member(0)], size=1)[0]
    energies = outcome.diagnosis.energies
    assert {"kinetic", "stretching", "bending", "gravity", "handles"} <= set(energies)
    assert all(len(values) == recipe.time.frames for values in energies.values())
    assert outcome.sequence is not None
    mass = crew.mesh.vertex_areas * float(outcome.member.parameters["area_weight"])
    height = outcome.sequence.positions[..., 2].astype(np.float64)
    # float32 sums of 35 vertices.
    np.testing.assert_allclose(energies["gravity"], 9.81 * (height * mass).sum(axis=1), rtol=1e-5)


def test_frames_are_on_the_clock_of_the_run() -> None:
    crew = Crew(make_recipe())
    outcome = run(crew, Stepper.of(crew), [crew.member(0)], size=1)[0]
    assert outcome.sequence is not None
    # 0.1 s at 25 Hz are covered by three frames; the fourth is the first that is kept.
    assert outcome.sequence.time.tolist() == [120_000_000, 160_000_000, 200_000_000, 240_000_000]
    assert outcome.sequence.attributes["seed"] == crew.seed(0)


def test_a_run_without_settling_begins_with_the_start() -> None:
    text = small().replace("settle = 0.1", "settle = 0.0")
    crew = Crew(parse(text, name="r", folder=Path(), where="r"))
    outcome = run(crew, Stepper.of(crew), [crew.member(0)], size=1)[0]
    assert outcome.sequence is not None
    np.testing.assert_array_equal(
        outcome.sequence.positions[0], outcome.member.scene.position.astype(np.float32)
    )


@pytest.mark.parametrize("attachment", ["corners", "hoist"])
def test_recipes_of_all_shapes_run(attachment: str) -> None:
    shape = "flag" if attachment == "hoist" else "hanging-cloth"
    text = f"""
        [scene]
        shape = "{shape}"
        attachment = "{attachment}"
        columns = 5
        start-noise = 1e-4
        [material]
        names = ["gray-interlock", "paper"]
        [wind]
        speed = {{ low = 0.0, high = 6.0 }}
        toward = {{ low = 0.0, high = 6.28 }}
        [contact]
        [time]
        settle = 0.2
        frames = 3
    """
    crew = Crew(parse(text, name="r", folder=Path(), where="r"))
    members = [crew.member(index) for index in range(6)]
    outcomes = [
        outcome
        for base in (0, 1)
        for outcome in run(
            crew, Stepper.of(crew, base), [m for m in members if m.base == base], size=6
        )
    ]
    assert len(outcomes) == 6
    for outcome in outcomes:
        assert outcome.failure is None
        assert outcome.sequence is not None
        held = outcome.sequence.positions[:, list(crew.handles.vertices)]
        # Springs of 1e3 N/m that carry at most 0.3 kg and the wind's few newtons give way by
        # millimetres.
        assert np.abs(held - held[:1]).max() < 0.03
