"""A force the library lacks is found, its file reproduces it, and nulls give no proposal."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from flagdata.errors import InputError, UsageError
from measure.loop.columns import EffectColumn
from measure.loop.inference import Evidence
from measure.loop.reference import NullBank
from measure.observe.trajectory import Experiment, Specimen, WindTrack
from measure.propose.effect_file import write
from measure.propose.outcome import Decision, Outcome
from measure.propose.propose import Options, made_ready, weigh
from measure.propose.search import search
from measure.propose.words import words
from sim.effects.field import FieldEffect, Seen
from sim.effects.files import load
from sim.scene import assemble, flag


def silent(what: str, done: int, total: int) -> None:
    """Progress nobody looks at."""


@pytest.fixture(scope="module")
def found(pushed: Experiment, columns: tuple[EffectColumn, ...], bank: NullBank) -> Outcome:
    return weigh(made_ready(pushed), columns, bank, options=Options(), stage=silent)


def test_nineteen_of_twenty_nulls_give_no_proposal(bank: NullBank) -> None:
    """Every kind of numerics in turn against the nulls of the others."""
    pool = list(range(4, len(bank.columns)))
    tried = taken = 0
    for kind in np.unique(bank.nulls.numerics):
        inside = bank.nulls.numerics != kind
        others = replace(bank, nulls=bank.nulls.select(inside))
        evidence = Evidence.of_nulls(bank.nulls.select(~inside), others.model())
        reference = others.reference(4, noise=NOISE, seed=0)
        recordings = np.unique(evidence.recording)
        for pair in recordings.reshape(-1, 2):
            own = evidence.select(np.isin(evidence.recording, pair))
            steps = search(own, reference, bank.columns, pool, level=0.03)
            tried, taken = tried + 1, taken + steps[0].taken
    assert tried == 24
    assert taken <= tried / 20


def test_a_planted_push_is_kept(found: Outcome) -> None:
    assert found.decision is Decision.KEPT, words(found)
    assert found.retest is not None
    assert found.retest.reduction.low > 0
    assert any(strength.name.startswith("leftward") for strength in found.strengths)
    assert "kept" in words(found)


def test_the_effect_of_the_file_is_the_planted_field(found: Outcome, specimen: Specimen, tmp_path: Path) -> None:
    made = load(write(found, tmp_path).spec)
    effect = made(**{strength.name: strength.estimate.value for strength in found.strengths})
    assert isinstance(effect, FieldEffect)
    system, state = assemble([flag(material=specimen.material, wind_speed=4.5, columns=6)], dtype=torch.float64)
    seen = Seen(
        cloth=system.cloth, position=state.position, offset=state.position - system.anchors.mean(0),
        velocity=state.velocity, wind=system.wind.velocity(0.0),
    )  # fmt: skip
    field = effect.acceleration(seen).expand(state.position.shape)[..., 0].numpy()
    share = system.cloth.mesh.rest[:, 1] / system.cloth.mesh.rest[:, 1].max()
    planted = 5 / (1 + np.exp(-(0.5 - share) * 0.5 / 0.06))
    # The wave of the terms and the edge of the push differ by 0.05 of its root mean square; errors of the fit add.
    error = np.sqrt(np.mean((field[:, 1] - planted) ** 2))
    assert error < 0.3 * np.sqrt(np.mean(planted**2))


def test_a_steady_force_is_seen_to_be_steady(found: Outcome) -> None:
    strength = next(s for s in found.strengths if s.name.startswith("leftward"))
    course = strength.course
    assert len(course.by_recording) == 4
    for mean in course.by_recording:
        assert mean.low < strength.estimate.high
        assert mean.high > strength.estimate.low


def test_a_recording_in_calm_air_is_refused(pushed: Experiment) -> None:
    first = pushed.recordings[0]
    calm = replace(first, wind=WindTrack.constant((0.1, 0.0, 0.0)))
    with pytest.raises(InputError, match="no direction"):
        made_ready(replace(pushed, recordings=(calm, *pushed.recordings[1:])))


@pytest.mark.parametrize("wrong", [{"level": 0.0}, {"level": 1.5}, {"nulls": 10}, {"workers": 0}])
def test_options_that_make_no_sense_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(UsageError):
        Options(**wrong)  # pyright: ignore[reportArgumentType]
