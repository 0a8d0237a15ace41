"""Losses of heads and pairs against values worked out by hand, and their gradients against finite
differences."""

from __future__ import annotations

import math
from itertools import combinations

import pytest
import torch
from torch import Tensor, nn

from flagdata.errors import InputError
from models.networks.learner import Learner, Loss, contrastive_loss

SEEDS = torch.tensor([1, 1, 2, 3])


def embedding() -> torch.Tensor:
    return torch.tensor([[0.0, 0.0], [0.3, 0.4], [0.0, 0.6], [3.0, 4.0]], dtype=torch.float64)


def test_the_contrastive_loss_is_hadsells_by_hand() -> None:
    """D = 0.5 for the positive pair; of the negatives (0, 2) D = 0.6, (1, 2) D = sqrt(0.13), others beyond 1."""
    positive, negative = 0.25, 0.4**2 + (1 - 0.13**0.5) ** 2
    assert contrastive_loss(embedding(), SEEDS).item() == pytest.approx((positive + negative) / 6)
    shared = contrastive_loss(embedding(), SEEDS, positive_share=0.5)
    assert shared.item() == pytest.approx(0.5 * positive + 0.5 * negative / 5)


def test_the_contrastive_loss_is_the_mean_over_all_pairs() -> None:
    x = torch.randn(7, 3, generator=torch.Generator().manual_seed(1), dtype=torch.float64)
    seed = [0, 0, 1, 1, 1, 2, 3]
    terms = []
    for i, j in combinations(range(7), 2):
        distance = (x[i] - x[j]).norm().item()
        terms.append(distance**2 if seed[i] == seed[j] else max(0.0, 1.5 - distance) ** 2)
    found = contrastive_loss(x, torch.tensor(seed), margin=1.5)
    assert found.item() == pytest.approx(sum(terms) / 21)


def test_gradients_of_the_contrastive_loss_agree_with_finite_differences() -> None:
    x = embedding().requires_grad_()
    assert torch.autograd.gradcheck(lambda e: contrastive_loss(e, SEEDS), x)
    assert torch.autograd.gradcheck(
        lambda e: contrastive_loss(e, SEEDS, margin=2.0, positive_share=0.3), x
    )


def test_coincident_embeddings_have_finite_gradients() -> None:
    x = torch.zeros(4, 2, requires_grad=True)
    contrastive_loss(x, SEEDS).backward()
    assert x.grad is not None
    assert bool(torch.isfinite(x.grad).all())


def test_a_loss_of_zero_is_where_positives_coincide_and_negatives_are_a_margin_apart() -> None:
    x = torch.tensor([[0.0], [0.0], [1.0], [-1.0]])
    assert contrastive_loss(x, SEEDS).item() == 0
    assert contrastive_loss(x, SEEDS, margin=1.1).item() > 0


def test_a_batch_without_positive_or_negative_pairs_is_an_error() -> None:
    with pytest.raises(InputError, match="at least two clips of each"):
        contrastive_loss(embedding(), torch.arange(4))
    with pytest.raises(InputError, match="at least two simulations"):
        contrastive_loss(embedding(), torch.zeros(4, dtype=torch.int64))
    with pytest.raises(InputError, match="margin above 0"):
        contrastive_loss(embedding(), SEEDS, positive_share=1.0)
    with pytest.raises(InputError, match=r"\(n, dimension\)"):
        contrastive_loss(embedding(), SEEDS[:3])


class Passing(nn.Module):
    """A network whose embedding is what it is given."""

    dimension = 2

    def forward(self, inputs: Tensor) -> Tensor:
        return inputs


def regression() -> Learner:
    """A learner of two targets whose head passes the embedding on; means 5 and 0.2, deviations 2
    and 0.1."""
    learner = Learner(Passing(), loss=Loss.REGRESSION, targets=("wind_speed", "area_weight"))
    assert isinstance(learner.head, nn.Linear)
    with torch.no_grad():
        learner.head.weight.copy_(torch.eye(2))
        learner.head.bias.zero_()
    learner.fit_scale(torch.tensor([[3.0, 0.1], [7.0, 0.3]]))
    return learner


def test_the_regression_loss_counts_errors_in_deviations_of_the_training_set() -> None:
    """Errors of 1 and 0 deviations of the first target, 2 and 0 of the second: means of squares 0.5
    and 2."""
    target = torch.tensor([[5.0, 0.2], [7.0, 0.3]])
    embedding = torch.tensor([[1.0, 2.0], [1.0, 1.0]])
    assert regression().loss(embedding, target, torch.arange(2)).item() == pytest.approx(
        1.25, rel=1e-5
    )


def test_predicting_the_training_mean_costs_one() -> None:
    target = torch.randn(50, 2, generator=torch.Generator().manual_seed(3)) * 7 - 3
    learner = regression()
    learner.fit_scale(target)
    assert learner.loss(torch.zeros_like(target), target, torch.arange(50)).item() == pytest.approx(
        1, rel=1e-5
    )


def test_what_a_regression_predicts_is_in_the_targets_units() -> None:
    values = regression().point_estimates(torch.tensor([[1.0, -1.0]]))
    torch.testing.assert_close(values, torch.tensor([[7.0, 0.1]]))


def test_the_posterior_loss_is_the_mean_negative_log_likelihood_of_standardised_logits() -> None:
    """One component at zero with unit deviation, targets one deviation from their mean: ½ log 2π +
    ½ a dimension."""
    learner = Learner(Passing(), loss=Loss.POSTERIOR, targets=("wind_speed",), components=1)
    values = torch.tensor([[4.0], [9.0]])
    learner.fit_scale(values)
    with torch.no_grad():
        for parameter in learner.head.parameters():
            parameter.zero_()
    mixture = learner.mixture(torch.zeros(1, 2))
    scale = mixture.factor.flatten().item()
    assert mixture.location.abs().max().item() == 0
    found = learner.loss(torch.zeros(2, 2), values, torch.arange(2)).item()
    assert found == pytest.approx(0.5 * 1.8378771 + math.log(scale) + 0.5 / scale**2, rel=1e-5)


def test_a_target_of_one_value_is_an_error() -> None:
    with pytest.raises(InputError, match="leave it out"):
        regression().fit_scale(torch.tensor([[1.0, 2.0], [1.0, 3.0]]))
