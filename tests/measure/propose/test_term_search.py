"""A force the library lacks is found, its file reproduces it, and nulls give no proposal."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from flagdata.answer import Quantity
from flagdata.errors import InputError, UsageError
from measure.forecasting import Column, EffectColumn
from measure.nulls import NullBank, NullOptions
from measure.propose import Decision, ProposalOutcome, made_ready, write
from measure.propose.outcome import Retest
from measure.propose.proposal_words import words
from measure.propose.term_search import weigh
from measure.trajectories import Experiment, Specimen, WindTrack
from sim.cloth.scene import assemble, flag
from sim.effects import FieldEffect, Seen, load
from tests.measure.propose.conftest import PUSH


def silent(what: str, done: int, total: int) -> None:
    """Progress nobody looks at."""


@pytest.fixture(scope="module")
def found(
    pushed: Experiment,
    columns: tuple[EffectColumn, ...],
    bank: NullBank,
    directions: tuple[Column, ...],
) -> ProposalOutcome:
    return weigh(made_ready(pushed), columns, bank, directions, options=NullOptions(), stage=silent)


def test_a_planted_push_is_kept(found: ProposalOutcome) -> None:
    assert found.decision is Decision.KEPT, words(found)
    assert found.retest is not None
    assert found.retest.helped.low > 0
    # Beside terms of another direction, and above what the numerics leave.
    assert found.retest.control is not None
    assert found.retest.apart is not None
    assert found.retest.apart.point > 0
    # What is left with the right term is about what numerics alone leave.
    assert 0.5 < found.retest.floor.point / found.retest.after.point < 2.0
    assert any(strength.name.startswith("leftward") for strength in found.strengths)
    assert "kept" in words(found)


def test_the_effect_of_the_file_is_the_planted_field(
    found: ProposalOutcome, specimen: Specimen, tmp_path: Path
) -> None:
    made = load(write(found, tmp_path).spec)
    effect = made(**{strength.name: strength.estimate.point for strength in found.strengths})
    assert isinstance(effect, FieldEffect)
    system, state = assemble(
        [flag(material=specimen.material, wind_speed=4.5, columns=6)], dtype=torch.float64
    )
    seen = Seen(
        cloth=system.cloth,
        position=state.position,
        offset=state.position - system.anchors.mean(0),
        velocity=state.velocity,
        wind=system.wind.velocity(0.0),
    )
    field = effect.acceleration(seen).expand(state.position.shape)[..., 0].numpy()
    share = system.cloth.mesh.rest[:, 1] / system.cloth.mesh.rest[:, 1].max()
    planted = PUSH / (1 + np.exp(-(0.5 - share) * 0.5 / 0.06))
    # The wave of the terms and the edge of the push differ by 0.05 of its root mean square; errors
    # of the fit add.
    error = np.sqrt(np.mean((field[:, 1] - planted) ** 2))
    assert error < 0.3 * np.sqrt(np.mean(planted**2))


def test_a_steady_force_is_seen_to_be_steady(found: ProposalOutcome) -> None:
    strength = next(s for s in found.strengths if s.name.startswith("leftward"))
    course = strength.course
    assert len(course.by_recording) == 4
    means = [mean.point for mean in course.by_recording]
    # A force that grew with the wind's square would differ by (6/3.5)² = 2.9 between the
    # recordings; a steady one, by what the numerics leave in each: less than the square root of
    # that.
    assert max(means) / min(means) < 6 / 3.5


def test_a_recording_in_calm_air_is_refused(pushed: Experiment) -> None:
    first = pushed.recordings[0]
    calm = replace(first, wind=WindTrack.constant((0.1, 0.0, 0.0)))
    with pytest.raises(InputError, match="no direction"):
        made_ready(replace(pushed, recordings=(calm, *pushed.recordings[1:])))


def outcome_of(*, low: float, apart: tuple[float, float] | None) -> tuple[Decision, str]:
    """The decision for a gain with a lower end, and a control with a difference and its lower end
    [nat]."""
    some = Quantity.of(value=0.01, low=0.009, high=0.011, unit="m")
    control = (
        None if apart is None else Quantity.of(value=apart[0], low=apart[1], high=0.01, unit="1")
    )
    return Retest(
        what="",
        segments=6,
        before=some,
        after=some,
        reduction=some,
        floor=some,
        share=None,
        helped=Quantity.of(value=0.01, low=low, high=0.011, unit="m"),
        control=None if apart is None else some,
        apart=control,
        control_names=("drag",),
    ).decision


@pytest.mark.parametrize(
    ("low", "apart", "decision", "said"),
    [
        (-1e-4, None, Decision.REJECTED, "not significantly lower"),
        (1e-4, (-1e-4, -2e-4), Decision.REJECTED, "as much"),
        (1e-4, (1e-4, -1e-4), Decision.KEPT, "form is open"),
        (1e-4, (1e-3, 5e-4), Decision.KEPT, "spent on drag"),
        (1e-4, None, Decision.KEPT, "no term of another direction"),
    ],
)
def test_what_helps_no_more_than_a_wrong_term_is_rejected(
    low: float, apart: tuple[float, float] | None, decision: Decision, said: str
) -> None:
    found, reason = outcome_of(low=low, apart=apart)
    assert found is decision
    assert said in reason


@pytest.mark.parametrize("wrong", [{"level": 0.0}, {"level": 1.5}, {"nulls": 10}, {"workers": 0}])
def test_options_that_make_no_sense_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(UsageError):
        NullOptions(**wrong)  # pyright: ignore[reportArgumentType]
