"""What a model says of clips of which something is known besides their pictures: a weighed cloth, a
measured shape.

A network gives p(θ | x) = p(x | θ) π(θ) / p(x) under the prior π that it learned. A statement about
some of the quantities κ of θ is of one of three kinds, and acts by its likelihood L(κ):

- *exact*: L is a delta function; p(θ | x, κ) is the conditional distribution, on which π(κ) has no
  influence at all;
- *with a standard deviation*: L(κ) = N(value; κ, σ²), that of a measurement which is independent of
  the film given θ;
- *a range*: L(κ) is 1 within it and 0 outside.

By Bayes' rule p(θ | x, L) = p(θ | x) L(κ) / Z with Z = ∫ p(κ | x) L(κ) dκ. So within a range, and
within σ, the prior that the network learned stays; outside, the statement replaces it. Nothing is
approximated: p(θ | x) is a mixture of Gaussians in the targets' logits, of which p(κ | x) is a
marginal, in closed form. κ is drawn from p(κ | x) L(κ) by cells of a fine grid, and the rest from
the mixture's conditional given κ, in closed form too. A value far from what the network believes is
answered as exactly as one that it expects, as far as the mixture's tails can be relied on.

Z over the same integral under the prior, Z_π = ∫ π(κ) L(κ) dκ, is the Bayes factor p(x | L)/p(x):
how much more, or less, probable the statement makes the film.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from flagdata.core.arrays import FloatArray
from flagdata.core.stated import Stated
from flagdata.errors import InputError
from models.networks.mixture import Mixture
from models.networks.targets import ASPECT, Scaling, Target

CELLS = {1: 1024, 2: 96}
"""Cells of the grid along each axis, by how many quantities are stated inexactly; more than two are
refused."""
ASPECT_SLACK = 0.04
"""Half the width of the range that a stated length over height stands for, relative: a hem, a
rounded size."""
REACH = 8.0
"""Standard deviations either way that the grid of a value with an uncertainty covers."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Known:
    """A statement about a quantity, clip by clip, or draw by draw.

    Attributes:
        name: of the quantity, as "area_weight".
        statement: about it, in its unit.
        scale: (n, m) by which it is larger than the one of the network; m is 1, or the number of
            draws that are asked for, each of which then has its own.

    Raises:
        InputError: a scale of another shape, or not above 0.
    """

    name: str
    statement: Stated
    scale: FloatArray

    @classmethod
    def everywhere(cls, name: str, statement: Stated, *, count: int) -> Known:
        """Repeats a statement for all of `count` clips."""
        return cls(name=name, statement=statement, scale=np.ones((count, 1)))

    def __post_init__(self) -> None:
        if self.scale.ndim != 2 or not (self.scale > 0).all():
            raise InputError(
                f"the scale of the {self.name} has the shape {self.scale.shape}, or is not above 0",
                fix="give (n, m) above 0",
            )

    @property
    def exact(self) -> bool:
        """Whether a value is stated, without uncertainty."""
        return self.statement.exact

    @property
    def ends(self) -> tuple[FloatArray, FloatArray]:
        """(n, m) ends of its range in the network's terms, equal where a value is stated."""
        return self.statement.low / self.scale, self.statement.high / self.scale

    @property
    def sigma(self) -> FloatArray:
        """(n, m) standard deviations of values likewise; 0 of exact ones and of ranges."""
        return self.statement.sigma / self.scale

    def reach(self) -> tuple[FloatArray, FloatArray]:
        """Returns (n, m) ends of where the quantity can lie."""
        low, high = self.ends
        return low - REACH * self.sigma, high + REACH * self.sigma


def stated_aspect(length: float, height: float) -> Stated:
    """States the logarithm of length over height by a flag's size."""
    middle = math.log(length / height)
    return Stated(low=middle - ASPECT_SLACK, high=middle + ASPECT_SLACK)


def usable_aspect(targets: Sequence[Target], length: float, height: float) -> Stated | None:
    """States the aspect as `stated_aspect` does, for a model of these targets; None where it
    estimates no aspect, or none so large or small."""
    aspect = stated_aspect(length, height)
    estimated = next((target for target in targets if target.name == ASPECT), None)
    return (
        aspect
        if estimated is not None and estimated.low <= aspect.low and aspect.high <= estimated.high
        else None
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Restricted:
    """A posterior given what is known.

    Attributes:
        logits: (n, draw, target) draws, on the targets' logits.
        log_mass: (n, draw) log Z of the statement that each draw was made under, −∞ of one that is
            impossible within the network's ranges; its draw means nothing then. It has the unit of
            L: compare it with that of a prior.
    """

    logits: Tensor
    log_mass: Tensor


def restrict_mixtures(
    mixture: Mixture,
    scaling: Scaling,
    known: Sequence[Known],
    *,
    draws: int,
    generator: torch.Generator,
) -> Restricted:
    """Draws from mixtures restricted by statements about some of their quantities.

    Args:
        mixture: n of them, over the targets' logits, float64.
        scaling: between these and the targets.
        known: of different quantities; at most two of them inexact.
        draws: from each mixture.
        generator: on the device of the mixture.

    Raises:
        InputError: a quantity that the model does not estimate or that is named twice, a statement
            that leaves the model's range for all draws, or more than two that are inexact.
    """
    order = sorted(known, key=lambda statement: statement.exact)
    columns = [_column(scaling, statement.name) for statement in order]
    soft = sum(not statement.exact for statement in order)
    if not order or len(set(columns)) < len(columns) or soft > max(CELLS):
        raise InputError(
            f"{len(order)} statements about "
            f"{', '.join(statement.name for statement in order) or 'nothing'}",
            fix=f"state each quantity once, at most {max(CELLS)} of them inexactly",
        )
    for statement, column in zip(order, columns, strict=True):
        _check(statement, scaling, column)
    ends = _Ends.of(scaling, columns, like=mixture.location)
    marginal = mixture.marginal(columns)
    exact = [ends.tensor(statement.ends[0]) for statement in order[soft:]]
    if soft:
        values, log_mass = _drawn(
            marginal, ends, order[:soft], exact, draws=draws, generator=generator
        )
    else:
        values = torch.stack(torch.broadcast_tensors(*exact), dim=-1)
        log_mass = marginal.log_density(ends.logits(values)) + ends.log_slope(values)
        log_mass = torch.where(ends.inside(values), log_mass, -torch.inf)
    values = values.expand(-1, draws, -1)
    logits = mixture.sample_given(columns, ends.logits(values), generator)
    return Restricted(logits=logits, log_mass=log_mass.expand(-1, draws))


def _drawn(
    marginal: Mixture,
    ends: _Ends,
    soft: Sequence[Known],
    exact: Sequence[Tensor],
    *,
    draws: int,
    generator: torch.Generator,
) -> tuple[Tensor, Tensor]:
    """Draws (n, draw, s) values of what is stated, the inexact first, from p(κ | x) L(κ), and
    computes (n, m) log Z."""
    cells = CELLS[len(soft)]
    at = (
        torch.cartesian_prod(*[torch.arange(cells)] * len(soft))
        .reshape(-1, len(soft))
        .to(marginal.location.device)
    )
    log_likelihood = torch.zeros(1).to(marginal.location)
    below, above, points = [], [], []
    for column, statement in enumerate(soft):
        reach = [
            ends.tensor(end).clamp(ends.least[column], ends.most[column])
            for end in statement.reach()
        ]
        first, last = reach[0].amin(dim=1, keepdim=True), reach[1].amax(dim=1, keepdim=True)
        edges = first + (last - first) * torch.linspace(0, 1, cells + 1).to(first)
        lower, upper = edges[:, None, :-1], edges[:, None, 1:]
        middle = (lower + upper) / 2
        low, high, sigma = (
            ends.tensor(end)[..., None] for end in (*statement.ends, statement.sigma)
        )
        if statement.sigma.any():
            likelihood = (upper - lower).log() - 0.5 * ((middle - low) / sigma).square()
        else:
            lower, upper = torch.maximum(lower, low), torch.minimum(upper, high)
            likelihood = (upper - lower).clamp(min=0).log()
        log_likelihood = log_likelihood + likelihood[..., at[:, column]]
        points.append(middle[..., at[:, column]])
        below.append(lower[..., at[:, column]])
        above.append(upper[..., at[:, column]])
    points += [value[..., None].expand(-1, -1, len(at)) for value in exact]
    centre = torch.stack(torch.broadcast_tensors(*points), dim=-1)
    density = marginal.log_density(ends.logits(centre).flatten(1, 2)).reshape(
        centre.shape[:-1]
    ) + ends.log_slope(centre)
    weight = torch.where(ends.inside(centre), density, -torch.inf) + log_likelihood
    log_mass = torch.logsumexp(weight, dim=-1)
    share = torch.where(log_mass[..., None] > -torch.inf, weight, 0.0).softmax(dim=-1)
    count = draws if share.shape[1] == 1 else 1
    cell = torch.multinomial(share.flatten(0, 1), count, replacement=True, generator=generator)
    cell = cell.reshape(len(share), draws, 1)
    values = []
    for lower, upper in zip(below, above, strict=True):
        low, high = (end.expand(-1, draws, -1).gather(2, cell).squeeze(2) for end in (lower, upper))
        values.append(
            low
            + (high - low)
            * torch.rand(low.shape, generator=generator, dtype=low.dtype, device=low.device)
        )
    return torch.stack(torch.broadcast_tensors(*values, *exact), dim=-1), log_mass


@dataclass(frozen=True, kw_only=True, eq=False)
class _Ends:
    """(s,) ranges of stated quantities: the network's, and the wider ones that logits are of."""

    least: Tensor
    most: Tensor
    low: Tensor
    high: Tensor

    @classmethod
    def of(cls, scaling: Scaling, columns: Sequence[int], *, like: Tensor) -> _Ends:
        low, high = (bound.to(like)[list(columns)] for bound in scaling.bounds)
        targets = [scaling.targets[column] for column in columns]
        least, most = (
            torch.tensor([[t.low, t.high] for t in targets], dtype=torch.float64).to(like).T
        )
        return cls(least=least, most=most, low=low, high=high)

    def tensor(self, values: FloatArray) -> Tensor:
        return torch.from_numpy(values).to(self.low)

    def inside(self, values: Tensor) -> Tensor:
        """Returns whether values (…, s) lie in the network's ranges, but for rounding: (…,)."""
        slack = _SLACK * (self.most - self.least)
        return ((values >= self.least - slack) & (values <= self.most + slack)).all(dim=-1)

    def logits(self, values: Tensor) -> Tensor:
        """Transforms values (…, s) to logits (…, s); one beyond the network's range is taken at its
        end."""
        return torch.logit(self._share(values))

    def log_slope(self, values: Tensor) -> Tensor:
        """Computes the logarithm of the logits' density over that of the values, (…,)."""
        share = self._share(values)
        return -(share.log() + (-share).log1p() + (self.high - self.low).log()).sum(dim=-1)

    def _share(self, values: Tensor) -> Tensor:
        return (torch.minimum(torch.maximum(values, self.least), self.most) - self.low) / (
            self.high - self.low
        )


_SLACK = 1e-9


def _check(statement: Known, scaling: Scaling, column: int) -> None:
    """Raises:
    InputError: a statement that leaves the model's range everywhere.
    """
    target = scaling.targets[column]
    slack = _SLACK * (target.high - target.low)
    lows, highs = statement.ends
    inside = (lows >= target.low - slack) & (highs <= target.high + slack)
    if not inside.any():
        low, high = lows.min(), highs.max()
        extent = f"{low:.4g}" if low == high else f"{low:.4g} to {high:.4g}"
        raise InputError(
            f"the {target.about} is {extent} {target.unit}; the model was trained on "
            f"{target.low:g} to {target.high:g}",
            fix="give one within that",
        )


def _column(scaling: Scaling, name: str) -> int:
    if name not in scaling.quantities:
        raise InputError(
            f"the model does not estimate the {name}",
            fix=f"it estimates {', '.join(scaling.quantities) or 'nothing'}",
        )
    return scaling.quantities.index(name)
