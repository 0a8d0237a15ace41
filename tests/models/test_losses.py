"""Losses against values worked out by hand, and their gradients against finite differences."""

from __future__ import annotations

from itertools import combinations

import pytest
import torch

from flagdata.errors import InputError
from models.losses import Standardisation, contrastive_loss, negative_log_likelihood, regression_loss
from models.mixture import Mixture

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
    assert torch.autograd.gradcheck(lambda e: contrastive_loss(e, SEEDS, margin=2.0, positive_share=0.3), x)


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


def standardisation() -> Standardisation:
    return Standardisation(mean=torch.tensor([5.0, 0.2]), deviation=torch.tensor([2.0, 0.1]))


def test_the_regression_loss_counts_errors_in_deviations_of_the_training_set() -> None:
    """Errors of 1 and 0 deviations of the first target, 2 and 0 of the second: means 0.5 and 2."""
    target = torch.tensor([[5.0, 0.2], [7.0, 0.3]])
    prediction = torch.tensor([[1.0, 2.0], [1.0, 1.0]])
    loss = regression_loss(prediction, target, standardisation=standardisation())
    assert loss.item() == pytest.approx(1.25, rel=1e-5)
    weighed = regression_loss(prediction, target, standardisation=standardisation(), weights=torch.tensor([3.0, 1.0]))
    assert weighed.item() == pytest.approx((3 * 0.5 + 2) / 4, rel=1e-5)


def test_predicting_the_training_mean_costs_one() -> None:
    target = torch.randn(50, 2, generator=torch.Generator().manual_seed(3), dtype=torch.float64) * 7 - 3
    loss = regression_loss(torch.zeros_like(target), target, standardisation=Standardisation.of(target))
    assert loss.item() == pytest.approx(1)


def test_standardising_is_undone() -> None:
    scale = standardisation()
    target = torch.tensor([[3.0, 0.15]])
    torch.testing.assert_close(scale.restored(scale.standardised(target)), target)


def test_gradients_of_the_regression_loss_agree_with_finite_differences() -> None:
    target = torch.tensor([[4.0, 0.3]], dtype=torch.float64)
    prediction = torch.tensor([[0.3, -0.2]], dtype=torch.float64, requires_grad=True)
    scale = Standardisation(mean=target[0] - 1, deviation=target[0])
    weights = torch.tensor([1.0, 3.0], dtype=torch.float64)
    assert torch.autograd.gradcheck(
        lambda p: regression_loss(p, target, standardisation=scale, weights=weights), prediction
    )


def test_the_likelihood_is_of_standardised_targets() -> None:
    """A standard normal mixture at one deviation from the mean: ½ log 2π + ½, in one dimension."""
    mixture = Mixture(log_weight=torch.zeros(2, 1), location=torch.zeros(2, 1, 1), factor=torch.ones(2, 1, 1, 1))
    scale = Standardisation(mean=torch.tensor([5.0]), deviation=torch.tensor([2.0]))
    loss = negative_log_likelihood(mixture, torch.tensor([[7.0], [3.0]]), standardisation=scale)
    assert loss.item() == pytest.approx(0.5 * 1.8378771 + 0.5, rel=1e-6)


def test_unfit_targets_are_errors() -> None:
    scale = standardisation()
    with pytest.raises(InputError, match="leave that target out"):
        Standardisation.of(torch.tensor([[1.0, 2.0], [1.0, 3.0]]))
    with pytest.raises(InputError, match=r"give \(n, 2\)"):
        regression_loss(torch.zeros(3, 1), torch.zeros(3, 2), standardisation=scale)
    with pytest.raises(InputError, match="none negative"):
        regression_loss(torch.zeros(3, 2), torch.zeros(3, 2), standardisation=scale, weights=torch.tensor([1.0, -1.0]))
