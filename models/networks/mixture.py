"""A distribution for each clip: a mixture of Gaussians with full covariances, and the head that
predicts it.

Bishop, Mixture Density Networks, 1994; full covariances by Cholesky factors after Williams, Neural
Computation 8, 1996.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn.functional import softplus

from flagdata.errors import InputError

LEAST_DEVIATION = 1e-3
"""Least diagonal entry of a Cholesky factor, in standard deviations of the prior: a likelihood
without bound, where a component sits on one training clip, is kept out by it."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Mixture:
    """Mixtures of K Gaussians over t targets, one for each of n clips.

    Attributes:
        log_weight: (n, K), logarithms of weights that sum to 1.
        location: (n, K, t), the components' means.
        factor: (n, K, t, t), lower triangular Cholesky factors of their covariances.
    """

    log_weight: Tensor
    location: Tensor
    factor: Tensor

    def __post_init__(self) -> None:
        shape = tuple(self.location.shape)
        if (
            self.location.ndim != 3
            or self.log_weight.shape != self.location.shape[:2]
            or self.factor.shape != (*shape, shape[2])
        ):
            raise InputError(
                f"weights {tuple(self.log_weight.shape)}, means {shape}, factors "
                f"{tuple(self.factor.shape)}",
                fix="give (n, K), (n, K, t) and (n, K, t, t)",
            )

    def log_prob(self, y: Tensor) -> Tensor:
        """Computes the logarithm of the density at y (n, t): (n,)."""
        self._require(y)
        return self.log_density(y[:, None])[:, 0]

    def log_density(self, y: Tensor) -> Tensor:
        """Computes the logarithm of the density at p points of each clip, y (n, p, t): (n, p)."""
        return torch.logsumexp(self._log_joint(y), dim=1)

    def _log_joint(self, y: Tensor) -> Tensor:
        """Logarithms of each component's weight times its density at y (n, p, t): (n, K, p)."""
        offset = (y[:, None] - self.location[:, :, None]).mT
        whitened = torch.linalg.solve_triangular(self.factor, offset, upper=False)
        log_volume = self.factor.diagonal(dim1=-2, dim2=-1).log().sum(dim=-1)
        constant = 0.5 * y.shape[2] * math.log(2 * math.pi)
        component = -0.5 * whitened.square().sum(dim=-2) - log_volume[..., None] - constant
        return self.log_weight[..., None] + component

    def marginal(self, columns: Sequence[int]) -> Mixture:
        """Returns the mixture of some targets, in the order that is given."""
        chosen = list(columns)
        factor = self.factor[..., chosen, :]
        return Mixture(
            log_weight=self.log_weight,
            location=self.location[..., chosen],
            factor=torch.linalg.cholesky(factor @ factor.mT),
        )

    def sample_given(
        self, columns: Sequence[int], values: Tensor, generator: torch.Generator
    ) -> Tensor:
        """Draws from the distribution of all targets given some of them: (n, p, t).

        With the given targets first, a component's covariance has the Cholesky factor [[A, 0], [B,
        C]]; given y of them, the others have the mean m + B A⁻¹ (y − m_y) and the covariance C Cᵀ,
        and the component's weight is proportional to its density at y.

        Args:
            columns: of the targets that are given.
            values: (n, p, given) of them, one draw for each.
            generator: on the device of the tensors.
        """
        rest = [column for column in range(self.location.shape[2]) if column not in columns]
        order = [*columns, *rest]
        conditioned = len(columns)
        ordered = self.marginal(order)
        first = Mixture(
            log_weight=ordered.log_weight,
            location=ordered.location[..., :conditioned],
            factor=ordered.factor[..., :conditioned, :conditioned],
        )
        share = first._log_joint(values).softmax(dim=1).mT
        component = torch.multinomial(share.flatten(0, 1), 1, generator=generator).reshape(
            values.shape[:2]
        )
        row = torch.arange(len(values), device=values.device)[:, None]
        location, factor = ordered.location[row, component], ordered.factor[row, component]
        offset = (values - location[..., :conditioned]).unsqueeze(-1)
        whitened = torch.linalg.solve_triangular(
            factor[..., :conditioned, :conditioned], offset, upper=False
        )
        noise = torch.randn(
            (*values.shape[:2], len(rest), 1),
            generator=generator,
            dtype=values.dtype,
            device=values.device,
        )
        deviation = (
            factor[..., conditioned:, :conditioned] @ whitened
            + factor[..., conditioned:, conditioned:] @ noise
        )
        drawn = torch.cat([values, location[..., conditioned:] + deviation.squeeze(-1)], dim=-1)
        return drawn[..., torch.tensor(order).argsort()]

    def mean(self) -> Tensor:
        """Computes the mean of each target: (n, t)."""
        return (self.log_weight.exp()[..., None] * self.location).sum(dim=1)

    def covariance(self) -> Tensor:
        """Computes the covariance of the targets, within and between components: (n, t, t)."""
        weight = self.log_weight.exp()[..., None, None]
        offset = (self.location - self.mean()[:, None]).unsqueeze(-1)
        return (weight * (self.factor @ self.factor.mT + offset @ offset.mT)).sum(dim=1)

    def cdf(self, y: Tensor) -> Tensor:
        """Computes the marginal cumulative probability of each target at y (n, t): (n, t). Uniform
        on [0, 1] if calibrated."""
        self._require(y)
        deviation = self.factor.square().sum(dim=-1).sqrt()
        score = (y[:, None] - self.location) / deviation
        return (self.log_weight.exp()[..., None] * torch.special.ndtr(score)).sum(dim=1)

    def sample(self, count: int, generator: torch.Generator) -> Tensor:
        """Draws from each mixture: (n, count, t).

        Args:
            count: draws of each.
            generator: on the device of the tensors.
        """
        if count < 1:
            raise InputError(f"{count} draws are too few", fix="ask for at least 1")
        component = torch.multinomial(
            self.log_weight.exp(), count, replacement=True, generator=generator
        )
        row = torch.arange(len(component), device=component.device)[:, None]
        location, factor = self.location[row, component], self.factor[row, component]
        noise = torch.randn(
            location.shape, generator=generator, dtype=location.dtype, device=location.device
        )
        return location + (factor @ noise.unsqueeze(-1)).squeeze(-1)

    def rescale_by(self, *, scale: Tensor, shift: Tensor) -> Mixture:
        """Returns the mixture of scale · y + shift, scale (t,) above 0 and shift (t,), or (n, 1, t)
        for each clip."""
        return Mixture(
            log_weight=self.log_weight,
            location=self.location * scale + shift,
            factor=self.factor * scale[:, None],
        )

    def rows(self, places: Sequence[int]) -> Mixture:
        """Selects the mixtures of some of the clips."""
        chosen = list(places)
        return Mixture(
            log_weight=self.log_weight[chosen],
            location=self.location[chosen],
            factor=self.factor[chosen],
        )

    def double(self) -> Mixture:
        """Converts the mixture to float64."""
        return Mixture(
            log_weight=self.log_weight.double(),
            location=self.location.double(),
            factor=self.factor.double(),
        )

    def _require(self, y: Tensor) -> None:
        expected = (self.location.shape[0], self.location.shape[2])
        if tuple(y.shape) != expected:
            raise InputError(
                f"the targets have the shape {tuple(y.shape)}",
                fix=f"give {expected} for these mixtures",
            )


class MixtureHead(nn.Module):
    """Embeddings (n, dimension) → `Mixture` of n clips over standardised targets.

    One linear layer gives the weights' logarithms, the means and the Cholesky factors, whose
    diagonals are softplus(·) + `LEAST_DEVIATION`. At the start all covariances are the unit
    matrix's and the means stand at quantiles of the standard normal distribution, apart from each
    other: equal components would get equal gradients.

    Args:
        dimension: of the embedding.
        targets: t.
        components: K.
    """

    def __init__(self, *, dimension: int, targets: int, components: int) -> None:
        super().__init__()
        if min(dimension, targets, components) < 1:
            raise InputError(
                f"the head has dimension {dimension}, {targets} targets and {components} "
                "components",
                fix="give at least 1 of each",
            )
        self.targets = targets
        self.components = components
        below = targets * (targets - 1) // 2
        self.linear = nn.Linear(dimension, components * (1 + 2 * targets + below))
        rows, columns = np.tril_indices(targets, -1)
        self.register_buffer("below", torch.from_numpy(rows * targets + columns), persistent=False)
        if self.linear.weight.is_meta:  # no memory, see `models.networks.blocks.initialise`
            return
        with torch.no_grad():
            self.linear.weight.mul_(0.1)
            bias = torch.zeros(components, 1 + 2 * targets + below)
            level = (torch.arange(components) + 0.5) / components
            bias[:, 1 : 1 + targets] = torch.special.ndtri(level)[:, None]
            bias[:, 1 + targets : 1 + 2 * targets] = math.log(math.expm1(1 - LEAST_DEVIATION))
            self.linear.bias.copy_(bias.flatten())

    def forward(self, embedding: Tensor) -> Mixture:
        """Returns the mixtures of a batch of embeddings (n, dimension)."""
        t = self.targets
        raw = self.linear(embedding).unflatten(1, (self.components, -1))
        logit, location, diagonal, below = raw.split([1, t, t, raw.shape[2] - 1 - 2 * t], dim=2)
        lower = torch.zeros((*raw.shape[:2], t * t), dtype=raw.dtype, device=raw.device)
        index = torch.as_tensor(self.below).expand(*raw.shape[:2], -1)
        factor = torch.diag_embed(softplus(diagonal) + LEAST_DEVIATION) + lower.scatter(
            2, index, below
        ).unflatten(2, (t, t))
        return Mixture(
            log_weight=logit.squeeze(2).log_softmax(dim=1), location=location, factor=factor
        )
