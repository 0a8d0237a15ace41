"""How an experiment was set up is judged apart from what acts on the cloth: the log's direction,
the hoist."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from measure.forecasting import TURNED, names
from measure.inference import Evidence, NullModel
from measure.loop import HOIST, finalists, judge
from measure.loop.set_up import SetUp
from measure.nulls import Reference
from measure.verdict import Conclusion
from tests.measure.loop.drawn_statistics import COUNT, SEGMENTS, drawn, named, seen


def logged(null: NullModel, angle: float, tolerance: float) -> Evidence:
    """Of a wind that is turned by an angle from its log, whose direction has a tolerance [rad]."""
    rng = np.random.default_rng(2)
    delta = np.zeros((3 * SEGMENTS, COUNT))
    delta[:, names().index(TURNED)] = angle
    speeds = np.array([3.5, 5.0, 7.0])
    own = drawn(rng, delta, np.tile(rng.normal(size=COUNT), (3, 1)), speeds)
    off = np.zeros((len(own.r), COUNT, 3))
    off[..., 1] = tolerance * own.response[..., names().index(TURNED)]
    return Evidence.of(replace(own, log=off), speeds[own.recording], null)


def test_a_wind_turned_beyond_its_tolerance_is_the_verdict(
    null: NullModel, reference: Reference
) -> None:
    found = judge(logged(null, 0.8, 0.2), reference, level=0.02, set_up=SetUp(tolerance=0.2))
    assert (found.conclusion, named(found)) == (Conclusion.EFFECT, [TURNED])
    assert found.direction is not None
    assert 0.2 < found.direction.low < 0.8 < found.direction.high
    shown = next(w for w in found.ranking if w.column == names().index(TURNED))
    assert shown.candidate.strength == found.direction
    assert names().index(TURNED) in finalists(found)


def test_a_wind_turned_within_its_tolerance_is_no_effect(
    null: NullModel, reference: Reference
) -> None:
    found = judge(logged(null, 0.8, 0.8), reference, level=0.02, set_up=SetUp(tolerance=0.8))
    assert TURNED not in named(found)
    shown = next(w for w in found.ranking if w.column == names().index(TURNED))
    assert not shown.admissible
    assert "46° of tolerance" in shown.unlike


def test_a_hoist_that_stands_still_leads_whatever_the_test_says(
    null: NullModel, reference: Reference
) -> None:
    found = judge(seen(null, {}), reference, level=0.02, set_up=SetUp(attached=True))
    assert found.test.p > 0.02
    assert (found.conclusion, named(found)) == (Conclusion.EFFECT, [HOIST])
    assert names().index(HOIST) in finalists(found)
