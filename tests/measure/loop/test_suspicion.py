"""An effect that is suspected before the recordings are looked at, and what would have been
seen."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.errors import InputError, UnknownNameError
from measure.forecasting import Suspicion, names, on_films, on_markers
from measure.inference import NullModel
from measure.loop import judge
from measure.loop.run import _suspected_effect  # pyright: ignore[reportPrivateUsage]
from measure.nulls import Reference
from measure.verdict import CRITERIA, Conclusion
from tests.measure.loop.drawn_statistics import drawn, made, named, seen, strengths

LEVEL = 0.05
LIFT = names().index("lift.coefficient")
WIND = names().index("vertical-wind.inclination")
WEAK = 0.25
"""Of the expected strength: where most tests along a lift alone see one, and hardly any along
all."""


@pytest.fixture(scope="module")
def looked() -> tuple[NullModel, Reference]:
    """Of nulls whose moments are looked at as well."""
    bank = made(seed=11, moments=True)
    return bank.model(bank.nulls.design), bank.reference(12, noise=0.0, seed=1)


def test_a_suspected_effect_is_seen_where_it_is_weaker_and_its_opposite_never(
    null: NullModel, reference: Reference
) -> None:
    """Twenty experiments, five of which or more are seen by the one and not by the other."""
    alone, opposite = reference.along(LIFT, 1), reference.along(LIFT, -1)
    counted = {"all": 0, "alone": 0, "opposite": 0}
    for seed in range(20):
        weak = seen(null, {"lift.coefficient": WEAK}, seed=100 + seed)
        for called, own in (("all", reference), ("alone", alone), ("opposite", opposite)):
            counted[called] += own.test(weak).p <= LEVEL
    assert counted["alone"] >= counted["all"] + 5
    assert counted["opposite"] == 0


def test_its_level_holds_and_other_effects_are_not_taken_for_it(
    null: NullModel, reference: Reference
) -> None:
    """At 5 %, of 60 nulls 3 are expected, and more than 8 come once in 200 times."""
    alone = reference.along(WIND, 1)
    chances = [alone.test(seen(null, {}, seed=300 + seed)).p for seed in range(60)]
    assert sum(p <= LEVEL for p in chances) <= 8
    assert np.median(chances) > 0.3
    dragged = [
        alone.test(seen(null, {"tangential-quadratic-drag.coefficient": 1.0}, seed=seed)).p
        for seed in range(10)
    ]
    assert sum(p <= LEVEL for p in dragged) <= 2


def test_moments_count_along_it_as_well(looked: tuple[NullModel, Reference]) -> None:
    null, reference = looked
    alone = reference.along(LIFT, 1)
    found = [
        alone.test(seen(null, {}, moments={"lift.coefficient": share}, seed=8))
        for share in (0.0, 0.5, 1.0)
    ]
    assert found[0].statistic < found[1].statistic < found[2].statistic
    assert found[0].p > LEVEL >= found[2].p


def test_what_is_suspected_and_found_is_named(null: NullModel, reference: Reference) -> None:
    data = seen(null, {"lift.coefficient": 1.0})
    found = judge(data, reference.along(LIFT, 1), level=LEVEL)
    assert (found.conclusion, named(found)) == (Conclusion.EFFECT, ["lift.coefficient"])
    away = judge(data, reference.along(LIFT, -1), level=LEVEL)
    assert (away.conclusion in (Conclusion.SUFFICIENT, Conclusion.UNDECIDED), away.named) == (
        True,
        (),
    )


def test_pulls_have_the_sign_of_the_coefficient_and_the_size_of_the_drop(null: NullModel) -> None:
    for strength in (1.0, -1.0):
        data = seen(null, {"lift.coefficient": strength})
        pulls = data.pulls()
        np.testing.assert_allclose(pulls**2, data.drops(), rtol=1e-12)
        assert np.sign(pulls[LIFT]) == np.sign(data.fit([LIFT]).of(LIFT)[0]) == strength


def test_power_is_that_of_what_is_tested_for(null: NullModel, reference: Reference) -> None:
    quiet, up, down = seen(null, {}), reference.along(LIFT, 1), reference.along(WIND, -1)
    tested = reference.test(quiet)
    every_one = reference.power(tested, LEVEL)
    assert [one.name for one, _ in every_one] == [one.name for one in on_markers()]
    assert all(0 <= share <= 1 for _, share in every_one)
    ((lift, alone),) = up.power(up.test(quiet), LEVEL)
    assert (lift.name, lift.expected > 0) == ("lift.coefficient", True)
    assert alone >= {own.name: share for own, share in every_one}["lift.coefficient"]
    ((wind, _),) = down.power(down.test(quiet), LEVEL)
    assert wind.expected == -next(
        one.expected for one in on_markers() if one.name == "vertical-wind.inclination"
    )
    assert reference.power(tested, 1 / 60) == ()
    # A stricter test sees less.
    assert sum(share for _, share in reference.power(tested, 0.2)) > sum(
        share for _, share in every_one
    )


def test_a_base_model_that_is_not_rejected_is_undecided_where_little_would_have_been_seen(
    null: NullModel, reference: Reference
) -> None:
    quiet = max(
        (seen(null, {}, seed=seed) for seed in range(8)), key=lambda own: reference.test(own).p
    )
    found = judge(quiet, reference, level=LEVEL)
    assert found.test.p > 2 * LEVEL
    enough = float(np.mean([share for _, share in found.power])) >= CRITERIA.least_power
    assert found.conclusion is (Conclusion.SUFFICIENT if enough else Conclusion.UNDECIDED)
    assert ("with a chance of" in "".join(found.open)) is not enough


@pytest.mark.parametrize(("times", "near"), [(1.01, True), (1.99, True), (2.01, False)])
def test_p_near_the_level_is_undecided(
    null: NullModel, reference: Reference, times: float, near: bool
) -> None:
    data = seen(null, {}, seed=1)
    p = reference.test(data).p
    found = judge(data, reference, level=p / times)
    assert ("within a factor of 2 of the level" in "".join(found.open)) is near
    assert not near or found.conclusion is Conclusion.UNDECIDED


def test_only_what_markers_weigh_can_be_suspected_of_them() -> None:
    assert {one.name for one in on_films()} - {one.name for one in on_markers()} == {"slack.length"}
    with pytest.raises(UnknownNameError):
        Suspicion.parse("slack", on_markers())


def test_what_the_cloth_cannot_have_is_refused_as_a_suspicion() -> None:
    suspicion = Suspicion.parse("lift", on_markers())
    found = drawn(
        np.random.default_rng(1),
        strengths({}),
        np.zeros((3, len(names()))),
        np.array([3.5, 5.0, 7.0]),
    )
    assert _suspected_effect(found, suspicion) == (LIFT, 1)
    assert _suspected_effect(found, None) is None
    found.response[:, LIFT] = 0.0
    with pytest.raises(InputError, match="moves nothing of this cloth") as refused:
        _suspected_effect(found, suspicion)
    assert refused.value.where == "--suspect"
