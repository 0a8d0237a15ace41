"""The score test on summaries whose law is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binomtest, chi2, kstest, norm

from flagdata.core.arrays import FloatArray, IntArray
from flagdata.core.rng import stream
from measure.cloth import Experiments, score
from measure.cloth.score_test import ALIKE, Directions, Scene, Scored

SIZE, BASE, KINDS, EACH = 5, 400, 20, 8
UNITS = np.array([0.01, 1.0, 30.0, 0.2, 5.0])
COVARIANCE = (0.6 * np.eye(SIZE) + 0.4) * np.outer(UNITS, UNITS)
"""Of summaries that are correlated, and of unlike size."""
ONE, EITHER = 0, 1
CHANGES = np.array([[0.02, 0, 0, 0, 0], [0, 0, 60.0, 0, 0]])
ALONG = Directions(changes=CHANGES, signs=np.array([1, 0]))
MIDDLE, SIGMA = 0.2, 0.03
LEVEL = 0.05


def law(weights: FloatArray) -> FloatArray:
    """Means of the summaries by the area weight."""
    away = np.log(weights / MIDDLE)[:, None]
    return UNITS * (np.arange(SIZE) + away * np.arange(1, SIZE + 1) - 0.5 * away**2)


def flags(
    rng: np.random.Generator, count: int, *, weight: float | None = None, sigma: float = SIGMA
) -> Experiments:
    """Of the base model; by default of all weights."""
    weights = (
        np.exp(rng.uniform(np.log(0.05), np.log(0.45), count))
        if weight is None
        else np.full(count, weight)
    )
    noise = rng.multivariate_normal(np.zeros(SIZE), COVARIANCE, count)
    stated = weights * np.exp(sigma * rng.standard_normal(count))
    return Experiments(summaries=(law(weights) + noise,), stated=stated, sigma=sigma)


def moved(one: Experiments, by: FloatArray) -> Experiments:
    return replace(one, summaries=tuple(own + by for own in one.summaries))


KIND: IntArray = np.repeat(np.arange(KINDS), EACH)


def scene(
    own: Experiments, *, seed: int = 1, sigma: float = SIGMA, shift: FloatArray | None = None
) -> Scene:
    """Flags beside base and null flags.

    Args:
        shift: (null, k) of the null flags.
    """
    rng = stream(seed, "score test")
    base, null = flags(rng, BASE, sigma=sigma), flags(rng, KINDS * EACH, sigma=sigma)
    return Scene.of(own, base, null if shift is None else moved(null, shift), KIND, CHANGES)


def judged(
    own: Experiments, *, seed: int = 1, along: Directions = ALONG, shift: FloatArray | None = None
) -> Scored:
    """One flag by base and null flags, as `scene`."""
    rng = stream(seed, "score test")
    base, null = flags(rng, BASE), flags(rng, KINDS * EACH)
    return score(own, base, null if shift is None else moved(null, shift), KIND, along, level=LEVEL)


def test_z_is_standard_normal_and_the_misfit_chi_squared_where_the_base_model_holds() -> None:
    """Before any scale of null flags, which estimates both to some 6 %."""
    own = scene(flags(stream(7, "own"), 2000, weight=MIDDLE))
    found = own.axes().z(own.observed)
    for place in (ONE, EITHER):
        assert kstest(found[:, place], norm(0, 1).cdf).statistic < 0.06
        assert found[:, place].std() == pytest.approx(1.0, abs=0.06)
    root = chi2(SIZE).ppf([0.5, 0.95])
    exact = (np.cbrt(root / SIZE) - 1 + 2 / (9 * SIZE)) / np.sqrt(2 / (9 * SIZE))
    assert np.quantile(found[:, -1], [0.5, 0.95]) == pytest.approx(exact, abs=0.15)


@pytest.mark.parametrize("place", [ONE, EITHER])
def test_an_effect_moves_its_z_by_its_separation(place: int) -> None:
    """√(d'V⁻¹d), of V with the flags' own scatter and what the scale of the weight leaves open."""
    many = flags(stream(7, "own"), 2000, weight=MIDDLE)
    change = CHANGES[place]
    slope = UNITS * np.arange(1, SIZE + 1)
    exact = float(
        np.sqrt(change @ np.linalg.solve(COVARIANCE + SIGMA**2 * np.outer(slope, slope), change))
    )
    still, acted = scene(many), scene(moved(many, change))
    found = (acted.axes().z(acted.observed) - still.axes().z(still.observed))[:, place]
    assert found == pytest.approx(exact, rel=0.1)


def test_power_is_that_of_a_normal_distribution() -> None:
    """Of one direction that was suspected beforehand: Φ(separation − critical value), in twenty
    worlds."""
    slope = UNITS * np.arange(1, SIZE + 1)
    scatter = COVARIANCE + SIGMA**2 * np.outer(slope, slope)
    for place, size in ((ONE, 0.8), (EITHER, 1.3)):
        change = size * CHANGES[place]
        along = replace(ALONG, changes=size * CHANGES, suspected=(place, 1))
        found = [
            judged(flags(stream(s, "own"), 1, weight=MIDDLE), seed=s, along=along)
            for s in range(20)
        ]
        critical = [one.nulls.critical(LEVEL) for one in found]
        separation = float(np.sqrt(change @ np.linalg.solve(scatter, change)))
        exact = np.mean([norm.cdf(separation - (value or np.inf)) for value in critical])
        # Each stated by some 130 null flags that are alike: 0.04.
        assert np.mean([one.power[place] for one in found]) == pytest.approx(exact, abs=0.04)
        # Of so many flags the critical value is beyond that of 5 %, and hardly so.
        assert (
            norm.isf(LEVEL)
            < np.mean([value or np.inf for value in critical])
            < norm.isf(LEVEL) + 0.25
        )


def test_flags_of_the_base_model_are_rejected_at_the_level() -> None:
    """Each a world of its own, so that critical values differ; 80 of them."""
    found = [judged(flags(stream(s, "own"), 1, weight=MIDDLE), seed=s).p_value for s in range(80)]
    for level in (0.05, 0.2, 0.5):
        assert binomtest(sum(p <= level for p in found), len(found), level).pvalue > 1e-3
    assert min(found) >= 1 / (1 + KINDS * EACH)


def test_an_effect_of_one_sign_is_not_found_in_its_absence() -> None:
    """A change along d is found, and by its direction; the opposite is no sign of it, but of
    something."""
    for sign, place in ((1, ONE), (1, EITHER), (-1, EITHER)):
        found = judged(moved(flags(stream(2, "own"), 1, weight=MIDDLE), sign * 3 * CHANGES[place]))
        assert found.p_value <= LEVEL
        assert found.pointed
        assert np.sign(found.z[place]) == sign
        assert found.alone[place] <= LEVEL
    opposite = judged(moved(flags(stream(2, "own"), 1, weight=MIDDLE), -3 * CHANGES[ONE]))
    assert opposite.alone[ONE] > 0.9


def test_a_change_along_no_effect_is_seen_by_the_whole_misfit_and_points_to_none() -> None:
    aside = np.array([0, 0, 0, 0, 1.0])
    whole = np.linalg.inv(COVARIANCE)
    for change in CHANGES:  # what is left has no part along any effect
        aside = aside - change * (change @ whole @ aside) / (change @ whole @ change)
    aside *= 7 / np.sqrt(aside @ whole @ aside)
    found = judged(moved(flags(stream(3, "own"), 1, weight=MIDDLE), aside))
    assert found.p_value <= LEVEL
    assert found.whole > 3
    assert found.whole == found.statistic
    assert not found.pointed


def test_a_suspicion_sees_a_weaker_effect_and_nothing_else() -> None:
    weak = 0.9 * CHANGES[ONE]
    suspected = replace(ALONG, suspected=(ONE, 1))
    found = {True: 0, False: 0}
    for seed in range(30):
        own = moved(flags(stream(seed, "own"), 1, weight=MIDDLE), weak)
        for alone in found:
            found[alone] += judged(own, along=suspected if alone else ALONG).p_value <= LEVEL
    assert found[True] > found[False] + 2
    other = moved(
        flags(stream(2, "own"), 1, weight=MIDDLE), 4 * CHANGES[EITHER] * np.array([1, 1, -1, 1, 1])
    )
    assert judged(other).p_value <= LEVEL
    opposite = replace(ALONG, suspected=(EITHER, 1))
    assert judged(other, along=opposite).p_value > 0.9


def test_a_kind_that_is_odd_does_not_judge_itself() -> None:
    """Its flags are as far from the other kinds' as they are, whatever V would be with them in
    it."""
    shift = np.zeros((KINDS * EACH, SIZE))
    odd = KIND == 3
    shift[odd] = 4 * CHANGES[ONE]
    own = flags(stream(5, "own"), 1, weight=MIDDLE)
    with_it, others = scene(own, shift=shift), scene(own)  # in the second the kind is as all others
    far = with_it.standing(3).of(with_it.null[odd])
    assert far == pytest.approx(others.standing(3).of(with_it.null[odd]), rel=1e-9)
    assert with_it.standing(None).of(with_it.null[odd])[:, ONE].mean() < 0.8 * far[:, ONE].mean()


def test_null_flags_of_another_weight_do_not_judge_a_cloth_that_was_weighed() -> None:
    own = flags(stream(5, "own"), 1, weight=0.06)
    found = judged(own)
    assert own.stated is not None
    null = flags(stream(1, "score test"), BASE + KINDS * EACH)
    assert null.stated is not None
    assert 0.3 < found.comparable.mean() < 0.8
    assert len(found.nulls.null) == found.comparable.sum()
    unweighed = replace(own, stated=None)
    assert judged(unweighed).comparable.all()
    assert ALIKE == 1.0


def test_a_rougher_scale_hides_more() -> None:
    """What acts as another weight does is seen less, the less is known of the weight."""
    own = flags(stream(5, "own"), 1, weight=MIDDLE)
    slope = UNITS * np.arange(1, SIZE + 1)
    lengths = []
    for sigma in (0.01, 0.3):
        own_scene = scene(replace(own, sigma=sigma), sigma=sigma)
        white = own_scene.axes().white
        lengths.append(float(np.linalg.norm(white @ slope)))
    assert lengths[1] < 0.7 * lengths[0]
