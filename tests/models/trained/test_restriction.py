"""A posterior given what is known is Bayes' rule's: beside closed forms, and beside rejection of
many draws."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from flagdata.core.stated import parse
from flagdata.errors import InputError
from models.networks.mixture import Mixture
from models.networks.targets import ASPECT, Scaling
from models.trained.restriction import (
    ASPECT_SLACK,
    Known,
    restrict_mixtures,
    stated_aspect,
)
from tests.refusals import unrefused

SCALING = Scaling(names=("wind_speed", "fabric_area_weight", "anisotropy"))
DRAWS = 20_000


def _mixture(*, components: int = 3, clips: int = 2) -> Mixture:
    """Correlated mixtures, other ones of each clip."""
    generator = torch.Generator().manual_seed(5)
    weight = torch.rand((clips, components), generator=generator, dtype=torch.float64) + 0.2
    location = 0.8 * torch.randn((clips, components, 3), generator=generator, dtype=torch.float64)
    factor = (
        0.4
        * torch.randn((clips, components, 3, 3), generator=generator, dtype=torch.float64).tril()
    )
    factor.diagonal(dim1=-2, dim2=-1).abs_().add_(0.3)
    return Mixture(
        log_weight=(weight / weight.sum(dim=1, keepdim=True)).log(),
        location=location,
        factor=factor,
    )


def _given(mixture: Mixture, *known: Known, draws: int = DRAWS):
    generator = torch.Generator().manual_seed(1)
    found = restrict_mixtures(mixture, SCALING, known, draws=draws, generator=generator)
    return SCALING.values(found.logits).numpy(), found.log_mass.numpy()


def _weighed(text: str, *, clips: int = 2, name: str = "area_weight") -> Known:
    return Known.everywhere(name, parse(text), count=clips)


def _logit(value: float, column: int) -> float:
    low, high = (float(bound[column]) for bound in SCALING.bounds)
    return math.log((value - low) / (high - value))


@pytest.mark.parametrize("text", ["0.12:0.20", "0.30:0.40", "0.16±0.03"])
def test_draws_given_a_range_or_a_deviation_are_those_of_many_weighed_by_the_statement(
    text: str,
) -> None:
    mixture, stated = _mixture(), parse(text)
    values, log_mass = _given(mixture, _weighed(text))
    many = SCALING.values(mixture.sample(400_000, torch.Generator().manual_seed(2))).numpy()
    own = many[..., 1]
    likelihood = (
        np.exp(-0.5 * ((own - stated.low) / stated.sigma) ** 2)
        if stated.sigma
        else ((own >= stated.low) & (own <= stated.high)).astype(float)
    )
    # Standard errors of the rejection, of at least 10,000 effective draws, and of 20,000: 2 % of a
    # deviation.
    np.testing.assert_allclose(np.exp(log_mass[:, 0]), likelihood.mean(axis=1), rtol=0.03)
    share = likelihood / likelihood.sum(axis=1, keepdims=True)
    assert (1 / np.square(share).sum(axis=1)).min() > 10_000
    mean = (share[..., None] * many).sum(axis=1)
    spread = np.sqrt((share[..., None] * (many - mean[:, None]) ** 2).sum(axis=1))
    np.testing.assert_allclose((values.mean(axis=1) - mean) / spread, 0.0, atol=0.06)
    np.testing.assert_allclose(values.std(axis=1) / spread, 1.0, atol=0.04)
    if not stated.sigma:
        assert values[..., 1].min() >= stated.low
        assert values[..., 1].max() <= stated.high


def test_one_gaussian_given_an_exact_value_is_the_conditional_gaussian_far_outside_as_well() -> (
    None
):
    """Mean m + c (y − m_y)/v and variance s² − c²/v; the log area weight of the value is the normal
    one's."""
    mixture = _mixture(components=1, clips=1)
    covariance = (mixture.factor @ mixture.factor.mT)[0, 0].numpy()
    location = mixture.location[0, 0].numpy()
    for value in (0.15, 0.06):
        found = restrict_mixtures(
            mixture,
            SCALING,
            [_weighed(f"{value}", clips=1)],
            draws=DRAWS,
            generator=torch.Generator().manual_seed(3),
        )
        y = _logit(value, 1)
        rest = [0, 2]
        gain = covariance[rest, 1] / covariance[1, 1]
        mean = location[rest] + gain * (y - location[1])
        spread = np.sqrt(covariance[rest, rest] - gain * covariance[rest, 1])
        logits = found.logits[0].numpy()
        np.testing.assert_allclose(
            (logits[:, rest].mean(axis=0) - mean) / spread, 0.0, atol=4 / math.sqrt(DRAWS)
        )
        np.testing.assert_allclose(logits[:, rest].std(axis=0) / spread, 1.0, atol=0.02)
        np.testing.assert_allclose(logits[:, 1], y, atol=1e-9)
        deviation = (y - location[1]) / math.sqrt(covariance[1, 1])
        low, high = (float(bound[1]) for bound in SCALING.bounds)
        slope = (high - low) / ((value - low) * (high - value))  # of the logit
        area_weight = (
            math.exp(-0.5 * deviation**2) / math.sqrt(2 * math.pi * covariance[1, 1]) * slope
        )
        assert math.exp(found.log_mass[0, 0]) == pytest.approx(area_weight, rel=1e-9)


def test_components_are_as_probable_as_the_value_makes_them() -> None:
    """Two components a logit of 6 apart in the weight, winds of 2 and 8 m/s: the weight says which
    it is."""
    wind = torch.tensor([_logit(2.0, 0), _logit(8.0, 0)], dtype=torch.float64)
    location = torch.stack(
        [wind, torch.tensor([-3.0, 3.0], dtype=torch.float64), torch.zeros(2).double()], dim=1
    )
    mixture = Mixture(
        log_weight=torch.tensor([[0.9, 0.1]]).double().log(),
        location=location[None],
        factor=0.3 * torch.eye(3, dtype=torch.float64).expand(1, 2, 3, 3),
    )
    light, _ = _given(mixture, _weighed("0.07", clips=1))
    heavy, _ = _given(mixture, _weighed("0.37", clips=1))
    assert light[..., 0].mean() == pytest.approx(2.0, abs=0.05)
    assert heavy[..., 0].mean() == pytest.approx(8.0, abs=0.05)


def test_a_statement_that_says_nothing_changes_nothing() -> None:
    mixture = _mixture()
    values, log_mass = _given(mixture, _weighed("0.05:0.40"))
    free = SCALING.values(mixture.sample(DRAWS, torch.Generator().manual_seed(4))).numpy()
    np.testing.assert_allclose(
        np.exp(log_mass), 1.0, atol=0.03
    )  # but for the margin of the widened range
    np.testing.assert_allclose(
        (values.mean(axis=1) - free.mean(axis=1)) / free.std(axis=1), 0.0, atol=0.05
    )


def test_a_small_deviation_is_an_exact_value_and_so_is_a_small_range() -> None:
    mixture = _mixture()
    exact, _ = _given(mixture, _weighed("0.2"))
    for text in ("0.2±0.0002", "0.1998:0.2002"):
        near, _ = _given(mixture, _weighed(text))
        np.testing.assert_allclose(
            (near.mean(axis=1) - exact.mean(axis=1))[:, [0, 2]], 0.0, atol=0.06
        )


def test_two_quantities_that_are_known_are_conditioned_on_together_in_any_order() -> None:
    mixture = _mixture()
    many = SCALING.values(mixture.sample(400_000, torch.Generator().manual_seed(2))).numpy()
    cases = {
        ("0.12:0.20", "-0.5:0.3"): 0.06,
        ("0.16±0.03", "-0.5:0.3"): 0.06,
        ("0.16", "-0.5:0.3"): 0.10,  # of some 3,000 draws within 0.002
    }
    for (weight, lean), tolerance in cases.items():
        first = _weighed(weight), _weighed(lean, name="anisotropy")
        one, mass = _given(mixture, *first)
        other, _ = _given(mixture, *reversed(first))
        stated, own = parse(weight), many[..., 1]
        share = ((many[..., 2] >= -0.5) & (many[..., 2] <= 0.3)).astype(float)
        if stated.exact:
            share *= np.abs(own - stated.low) <= 0.002
        elif stated.sigma:
            share *= np.exp(-0.5 * ((own - stated.low) / stated.sigma) ** 2)
        else:
            share *= (own >= stated.low) & (own <= stated.high)
            np.testing.assert_allclose(np.exp(mass[:, 0]), share.mean(axis=1), rtol=0.03)
        wind = (share * many[..., 0]).sum(axis=1) / share.sum(axis=1)
        spread = many[..., 0].std(axis=1)
        for found in (one, other):
            np.testing.assert_allclose(
                (found[..., 0].mean(axis=1) - wind) / spread, 0.0, atol=tolerance
            )


def test_of_a_flag_that_was_measured_and_weighed_both_restrict_the_wind() -> None:
    """A Gaussian of wind, weight and aspect, all on logits: the wind's variance falls with each
    that is known."""
    scaling = Scaling(names=("outdoor_wind", "fabric_area_weight", "log_aspect"))
    covariance = torch.tensor(
        [[1.0, 0.7, 0.6], [0.7, 1.0, 0.1], [0.6, 0.1, 1.0]], dtype=torch.float64
    )
    mixture = Mixture(
        log_weight=torch.zeros((1, 1), dtype=torch.float64),
        location=torch.zeros((1, 1, 3), dtype=torch.float64),
        factor=torch.linalg.cholesky(covariance)[None, None],
    )
    weighed, measured = (
        _weighed("0.2", clips=1),
        Known.everywhere(ASPECT, stated_aspect(3.0, 2.0), count=1),
    )
    both = restrict_mixtures(
        mixture,
        scaling,
        [weighed, measured],
        draws=DRAWS,
        generator=torch.Generator().manual_seed(1),
    )
    values = scaling.values(both.logits)[0].numpy()
    np.testing.assert_allclose(values[:, 1], 0.2, rtol=1e-9)
    assert np.abs(values[:, 2] - math.log(1.5)).max() <= ASPECT_SLACK + 1e-9
    # 1 − cᵀ C⁻¹ c of the conditional; the aspect's range adds its own width, a tenth of a deviation
    # either way.
    gain = np.linalg.solve(covariance[1:, 1:].numpy(), covariance[0, 1:].numpy())
    variance = 1 - gain @ covariance[0, 1:].numpy()
    assert both.logits[0, :, 0].var().item() == pytest.approx(variance, rel=0.06)
    alone = restrict_mixtures(
        mixture, scaling, [weighed], draws=DRAWS, generator=torch.Generator().manual_seed(1)
    )
    assert alone.logits[0, :, 0].var().item() == pytest.approx(1 - 0.7**2, rel=0.04)


def test_each_draw_has_its_own_statement_and_one_that_is_impossible_has_no_mass() -> None:
    mixture = _mixture()
    scale = np.tile([0.5, 1.0, 2.0, 4.0], (2, 2_500))
    for text, impossible in (("0.2", {0.5: False, 4.0: False, 2.0: False}), ("0.36", {0.5: True})):
        stated = parse(text)
        values, log_mass = _given(
            mixture, Known(name="area_weight", statement=stated, scale=scale), draws=10_000
        )
        for factor in (0.5, 1.0, 2.0, 4.0):
            chosen = scale == factor
            assert np.isneginf(log_mass[chosen]).all() == impossible.get(factor, False)
            if not impossible.get(factor, False):
                np.testing.assert_allclose(values[..., 1][chosen], stated.low / factor, rtol=1e-9)
    ranged, mass = _given(
        mixture,
        Known(name="area_weight", statement=parse("0.2:0.3"), scale=scale),
        draws=10_000,
    )
    own = ranged[..., 1] * scale
    assert (own[scale > 0.5].min(), own[scale > 0.5].max()) == pytest.approx((0.2, 0.3), abs=0.002)
    assert np.isneginf(mass[scale == 0.5]).all()  # 0.4 to 0.6 kg/m² of 0.05 to 0.40


def test_a_statement_that_the_model_cannot_use_is_refused() -> None:
    cases = [
        ("area_weight", "0.01:0.10", "0.05 to 0.4"),
        ("area_weight", "0.5", "area weight is 0.5 kg/m²"),
        ("bending_scale", "-4.0", "does not estimate the bending_scale"),
    ]
    refuse = unrefused(
        lambda known: _given(_mixture(), _weighed(known[1], name=known[0])),
        [((name, text), message) for name, text, message in cases],
        InputError,
    )
    assert refuse == []
    with pytest.raises(InputError, match="once"):
        _given(_mixture(), _weighed("0.1"), _weighed("0.2"))


def test_a_statement_is_scaled_to_the_network_and_a_scale_that_cannot_be_is_refused() -> None:
    scale = np.array([[0.5], [2.0]])
    for text, low, high, sigma in (
        ("0.2", (0.4, 0.1), (0.4, 0.1), (0.0, 0.0)),
        ("0.2±0.01", (0.4, 0.1), (0.4, 0.1), (0.02, 0.005)),
        ("0.2:0.3", (0.4, 0.1), (0.6, 0.15), (0.0, 0.0)),
    ):
        known = Known(name="area_weight", statement=parse(text), scale=scale)
        found = np.concatenate([*known.ends, known.sigma], axis=1).T
        np.testing.assert_allclose(found, [low, high, sigma])
    wrong = [(np.ones(3), "shape"), (np.array([[1.0, 0.0]]), "above 0")]
    assert (
        unrefused(
            lambda given: Known(name="area_weight", statement=parse("0.2"), scale=given),
            wrong,
            InputError,
        )
        == []
    )
