"""Mixtures of Gaussians against scipy and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from scipy.stats import multivariate_normal, norm

from flagdata.errors import InputError
from models.networks.mixture import LEAST_DEVIATION, Mixture, MixtureHead

N, K, T = 5, 3, 4


def made(seed: int = 0) -> Mixture:
    g = torch.Generator().manual_seed(seed)
    lower = torch.randn(N, K, T, T, generator=g, dtype=torch.float64).tril(-1)
    diagonal = torch.rand(N, K, T, generator=g, dtype=torch.float64) + 0.3
    return Mixture(
        log_weight=torch.randn(N, K, generator=g, dtype=torch.float64).log_softmax(dim=1),
        location=2 * torch.randn(N, K, T, generator=g, dtype=torch.float64),
        factor=lower + torch.diag_embed(diagonal),
    )


def points() -> torch.Tensor:
    return torch.randn(N, T, generator=torch.Generator().manual_seed(9), dtype=torch.float64)


def test_the_density_is_scipys() -> None:
    mixture, y = made(), points()
    for i in range(N):
        expected = sum(
            float(mixture.log_weight[i, k].exp())
            * multivariate_normal(
                mixture.location[i, k].numpy(),
                (mixture.factor[i, k] @ mixture.factor[i, k].T).numpy(),
            ).pdf(y[i].numpy())
            for k in range(K)
        )
        assert mixture.log_prob(y)[i].item() == pytest.approx(np.log(expected), rel=1e-9)


def test_the_marginal_distribution_function_is_scipys() -> None:
    mixture, y = made(), points()
    weight = mixture.log_weight.exp().numpy()
    covariance = (mixture.factor @ mixture.factor.mT).numpy()
    expected = np.zeros((N, T))
    for k in range(K):
        deviation = np.sqrt(np.diagonal(covariance[:, k], axis1=1, axis2=2))
        expected += weight[:, k, None] * norm.cdf(
            y.numpy(), mixture.location[:, k].numpy(), deviation
        )
    np.testing.assert_allclose(mixture.cdf(y).numpy(), expected, rtol=1e-9)


def test_one_component_has_its_own_mean_covariance_and_entropy() -> None:
    """−E log p of N(μ, LLᵀ) is ½ t (1 + log 2π) + Σ log L_ii; at the mean, −log p is that less
    t/2."""
    whole = made()
    mixture = Mixture(
        log_weight=torch.zeros(N, 1, dtype=torch.float64),
        location=whole.location[:, :1],
        factor=whole.factor[:, :1],
    )
    torch.testing.assert_close(mixture.mean(), whole.location[:, 0])
    torch.testing.assert_close(mixture.covariance(), whole.factor[:, 0] @ whole.factor[:, 0].mT)
    volume = whole.factor[:, 0].diagonal(dim1=1, dim2=2).log().sum(dim=1)
    torch.testing.assert_close(
        -mixture.log_prob(mixture.mean()), T / 2 * np.log(2 * np.pi) + volume
    )


def test_two_points_apart_have_the_mean_and_variance_of_a_coin() -> None:
    """Components of deviation s at ±a with weights p and 1 − p: mean a(2p − 1), variance s² + 4 a²
    p (1 − p)."""
    p, a, s = 0.3, 2.0, 0.5
    mixture = Mixture(
        log_weight=torch.tensor([[p, 1 - p]], dtype=torch.float64).log(),
        location=torch.tensor([[[a], [-a]]], dtype=torch.float64),
        factor=torch.full((1, 2, 1, 1), s, dtype=torch.float64),
    )
    assert mixture.mean().item() == pytest.approx(a * (2 * p - 1))
    assert mixture.covariance().item() == pytest.approx(s**2 + 4 * a**2 * p * (1 - p))


def test_draws_have_the_mixtures_moments_and_uniform_ranks() -> None:
    """Means within five standard errors; the ranks' means are 1/2 within five of
    sqrt(1/12/count)."""
    mixture, count = made(), 20_000
    draws = mixture.sample(count, torch.Generator().manual_seed(4))
    assert draws.shape == (N, count, T)
    covariance = mixture.covariance()
    error = (covariance.diagonal(dim1=1, dim2=2) / count).sqrt()
    assert bool(((draws.mean(dim=1) - mixture.mean()).abs() < 5 * error).all())
    for i in range(N):
        found = torch.cov(draws[i].T)
        scale = covariance[i].diagonal().max()
        assert bool(((found - covariance[i]).abs() < 0.06 * scale).all())
    ranks = torch.stack([mixture.cdf(draws[:, j]) for j in range(400)], dim=1)
    assert bool(((ranks.mean(dim=1) - 0.5).abs() < 5 * (1 / 12 / 400) ** 0.5).all())


def test_draws_depend_on_the_generator_alone() -> None:
    mixture = made()
    first = mixture.sample(3, torch.Generator().manual_seed(1))
    torch.manual_seed(99)
    assert torch.equal(first, mixture.sample(3, torch.Generator().manual_seed(1)))
    assert not torch.equal(first, mixture.sample(3, torch.Generator().manual_seed(2)))


def test_a_change_of_units_changes_the_density_by_its_jacobian() -> None:
    mixture, y = made(), points()
    scale = torch.tensor([0.1, 2.0, 3.0, 0.5], dtype=torch.float64)
    shift = torch.tensor([4.0, -1.0, 0.0, 2.0], dtype=torch.float64)
    moved = mixture.rescale_by(scale=scale, shift=shift)
    torch.testing.assert_close(
        moved.log_prob(y * scale + shift), mixture.log_prob(y) - scale.log().sum()
    )
    torch.testing.assert_close(moved.cdf(y * scale + shift), mixture.cdf(y))
    torch.testing.assert_close(moved.mean(), mixture.mean() * scale + shift)


@pytest.mark.parametrize("targets", [1, 3])
def test_the_heads_mixture_is_proper_and_its_gradients_are_checked(targets: int) -> None:
    with torch.random.fork_rng():
        torch.manual_seed(2)
        head = MixtureHead(dimension=4, targets=targets, components=2).double()
        embedding = torch.randn(3, 4, dtype=torch.float64, requires_grad=True)
        y = torch.randn(3, targets, dtype=torch.float64)
    mixture = head(embedding)
    torch.testing.assert_close(
        mixture.log_weight.exp().sum(dim=1), torch.ones(3, dtype=torch.float64)
    )
    assert torch.equal(mixture.factor, mixture.factor.tril())
    assert float(mixture.factor.detach().diagonal(dim1=2, dim2=3).min()) > LEAST_DEVIATION
    assert torch.autograd.gradcheck(lambda e: head(e).log_prob(y), embedding)
    assert torch.autograd.gradcheck(lambda e: head(e).cdf(y), embedding)
    head(embedding).log_prob(y).sum().backward()
    assert all(p.grad is not None and bool((p.grad.abs() > 0).all()) for p in head.parameters())


def test_the_head_starts_at_about_the_prior_with_its_components_apart() -> None:
    """Without an embedding: unit covariances, equal weights, means at the quartiles' quantiles
    ±0.674 of N(0, 1)."""
    mixture = MixtureHead(dimension=4, targets=2, components=2)(torch.zeros(1, 4))
    torch.testing.assert_close(mixture.factor[0, 0], torch.eye(2))
    torch.testing.assert_close(mixture.log_weight[0].exp(), torch.tensor([0.5, 0.5]))
    torch.testing.assert_close(mixture.location[0, :, 0], torch.tensor([-0.6744898, 0.6744898]))


def test_a_head_learns_a_distribution_it_can_represent() -> None:
    """Targets ±1 with equal chances and deviation 0.1: the entropy is log 2 + log(0.1) + ½(1 + log
    2π) to 1e-6.

    The fit ends within 0.05 of the mean negative log-likelihood under the truth.
    """
    g = torch.Generator().manual_seed(5)
    sign = torch.randint(2, (512, 1), generator=g) * 2.0 - 1
    y = sign + 0.1 * torch.randn(512, 1, generator=g)
    with torch.random.fork_rng():
        torch.manual_seed(1)
        head = MixtureHead(dimension=1, targets=1, components=2)
    one = torch.ones(512, 1)
    optimiser = torch.optim.Adam(head.parameters(), lr=0.05)
    for _ in range(200):
        optimiser.zero_grad()
        loss = -head(one).log_prob(y).mean()
        loss.backward()
        optimiser.step()
    truth = (
        np.log(2)
        + np.log(0.1)
        + 0.5 * np.log(2 * np.pi)
        + 0.5 * ((y - sign) / 0.1).square().mean().item()
    )
    assert loss.item() == pytest.approx(truth, abs=0.05)


def test_shapes_that_do_not_fit_are_errors() -> None:
    mixture = made()
    with pytest.raises(InputError, match=r"give \(5, 4\)"):
        mixture.log_prob(torch.zeros(5, 3, dtype=torch.float64))
    with pytest.raises(InputError, match="at least 1"):
        mixture.sample(0, torch.Generator())
    with pytest.raises(InputError, match="at least 1 of each"):
        MixtureHead(dimension=3, targets=0, components=1)
    with pytest.raises(InputError, match=r"\(n, K, t, t\)"):
        Mixture(
            log_weight=torch.zeros(1, 2), location=torch.zeros(1, 2, 3), factor=torch.zeros(1, 2, 3)
        )


def test_marginals_are_those_of_the_whole_in_any_order() -> None:
    mixture, columns = made(), [2, 0]
    some = mixture.marginal(columns)
    np.testing.assert_allclose(some.mean().numpy(), mixture.mean()[:, columns].numpy(), rtol=1e-9)
    np.testing.assert_allclose(
        some.covariance().numpy(),
        mixture.covariance()[:, columns][:, :, columns].numpy(),
        rtol=1e-9,
        atol=1e-9,
    )
    np.testing.assert_allclose(
        some.cdf(points()[:, columns]).numpy(), mixture.cdf(points())[:, columns].numpy()
    )


def test_the_density_at_several_points_is_that_at_each() -> None:
    mixture = made()
    many = torch.stack([points(), points() + 0.5], dim=1)
    for place in range(2):
        np.testing.assert_allclose(
            mixture.log_density(many)[:, place], mixture.log_prob(many[:, place]), rtol=1e-12
        )


def test_a_head_without_memory_has_the_shapes_of_one_with_it() -> None:
    with torch.device("meta"):
        bare = MixtureHead(dimension=8, targets=3, components=2)
    head = MixtureHead(dimension=8, targets=3, components=2)
    shapes = {name: value.shape for name, value in head.state_dict().items()}
    assert {name: value.shape for name, value in bare.state_dict().items()} == shapes
