"""Refitted models decide which effects are named."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.core.rng import stream
from measure.forecasting import THETA, library, names
from measure.inference import Evidence, NullModel
from measure.loop import judge
from measure.loop.effect_selection import withdrawn
from measure.loop.refit import Refit
from measure.nulls import Reference
from measure.verdict import Conclusion
from tests.measure.loop.drawn_statistics import (
    COUNT,
    EXPECTED,
    SEGMENTS,
    drawn,
    judged,
    named,
    seen,
)

LIFT, HEM = names().index("lift.coefficient"), names().index("hem-mass.line_density")


def predicting(evidence: Evidence, each: float, *, leftover: float = 0.5, seed: int = 0) -> Refit:
    """A model that predicts every segment better than the base model by so much, and a deviation of
    1."""
    gained = each + stream(seed, "gains").normal(size=3 * SEGMENTS)
    return Refit(coefficient=0.3, gains=gained, leftover=leftover, evidence=evidence)


OTHERS = {
    column: None
    for column in range(len(THETA), len(THETA) + len(library()))
    if column not in (LIFT, HEM)
}


@pytest.mark.parametrize(
    ("hem", "left", "said", "concluded"),
    [
        # Both predict as well, a difference of 24 to a standard error of √24 = 4.9 or none, and the
        # recordings go the way of lift.
        (5.0, (0.5, 0.5), ["lift.coefficient"], Conclusion.EFFECT),
        (3.0, (0.5, 0.5), ["lift.coefficient"], Conclusion.EFFECT),
        (5.0, (0.5, 0.01), ["lift.coefficient"], Conclusion.EFFECT),
        # It does not pass, and with no other effect beside it predictions are better.
        (5.0, (0.01, 0.5), ["lift.coefficient"], Conclusion.EFFECT),
        # What predicts best is what the recordings do not go the way of.
        (20.0, (0.5, 0.5), [], Conclusion.OUTSIDE),
    ],
)
def test_what_is_named_is_the_first_of_those_that_predict_unseen_recordings(
    null: NullModel,
    reference: Reference,
    hem: float,
    left: tuple[float, float],
    said: list[str],
    concluded: Conclusion,
) -> None:
    data, rest = seen(null, {"lift.coefficient": 1.0}), seen(null, {}, seed=3)
    refits = {
        LIFT: predicting(rest, 5.0, leftover=left[0]),
        HEM: predicting(rest, hem, leftover=left[1], seed=1),
        **OTHERS,
    }
    found = judge(data, reference, level=0.02, refits=refits)
    assert (sorted(named(found)), found.conclusion) == (said, concluded)


def test_what_does_not_pass_explains_a_part_where_a_pair_predicts_better_and_does_not_pass_either(
    null: NullModel, reference: Reference
) -> None:
    data = seen(null, {"lift.coefficient": 1.0})
    three = {"hem-mass.line_density": 1.0, "tangential-quadratic-drag.coefficient": 1.0}
    refits = {
        LIFT: predicting(seen(null, three, seed=3), 5.0, leftover=0.01),
        HEM: predicting(seen(null, {}, seed=3), 5.0, seed=1),
        **OTHERS,
    }
    found = judge(data, reference, level=0.02, refits=refits)
    assert (named(found), found.conclusion) == (["lift.coefficient"], Conclusion.PARTLY)


def test_where_the_base_model_predicts_as_well_nothing_is_named(
    null: NullModel, reference: Reference
) -> None:
    """However well an effect fits what rejects the base model."""
    useless = Refit(
        coefficient=0.3,
        gains=np.tile([1.0, -1.0], 6),
        leftover=0.5,
        evidence=seen(null, {}, seed=3),
    )
    refits = dict.fromkeys((LIFT, HEM, *OTHERS), useless)
    found = judge(seen(null, {"lift.coefficient": 1.0}), reference, level=0.02, refits=refits)
    assert (found.conclusion, found.named, found.confident) == (Conclusion.OUTSIDE, (), ())


def test_a_cloth_that_diverges_is_no_model(null: NullModel, reference: Reference) -> None:
    data = seen(null, {"lift.coefficient": 1.0})
    assert named(judge(data, reference, level=0.02)) == ["lift.coefficient"]
    assert "lift.coefficient" not in named(judge(data, reference, level=0.02, refits={LIFT: None}))


def test_a_rerun_counts_in_place_of_the_linear(null: NullModel, reference: Reference) -> None:
    """An effect whose refitted model predicts nothing is not named."""
    rng = np.random.default_rng(2)
    delta = np.zeros((12, COUNT))
    place = names().index("lift.coefficient")
    delta[:, place] = EXPECTED[place]
    speeds = np.array([3.5, 5.0, 7.0])
    own = drawn(rng, delta, np.zeros((3, COUNT)), speeds)
    evidence = Evidence.of(own, speeds[own.recording], null)
    linear = judge(evidence, reference, level=0.02)
    assert linear.named == (place,)
    useless = Refit(coefficient=0.1, gains=np.full(12, -1.0), leftover=0.5, evidence=evidence)
    assert place not in judge(evidence, reference, level=0.02, refits={place: useless}).named


def test_an_effect_with_which_unseen_errors_rise_is_not_named(
    null: NullModel, reference: Reference
) -> None:
    found = withdrawn(judged(null, reference, {"lift.coefficient": 1.0}))
    assert (found.conclusion, named(found)) == (Conclusion.OUTSIDE, [])
    assert "unseen recordings are larger" in found.ranking[0].candidate.why_not
