"""What a model says of clips of which something is known: its posterior, restricted to where the known quantities lie.

Of a joint posterior p(θ | x) under a prior π, the posterior under the prior that is π within a range and 0 outside
is p(θ | x) restricted to that range (Bayes' rule). With a weighed flag the wind is that of a flag of that weight.
Draws outside are discarded; as only some are left, many more are drawn than are returned. Of a flag that was measured
and weighed, two quantities are known, `Known.of_aspect` and its area weight: the posterior is restricted to both.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from flagdata.errors import InputError
from models.targets import ASPECT, Scaling

MORE = 32
"""Draws that are made for each one that is returned."""
FEWEST = 16
"""Draws that have to lie in the ranges; of a clip with fewer, those nearest to them are taken."""
ASPECT_SLACK = 0.04
"""Half the width of the range that a stated length over height stands for, relative: a hem, a rounded size."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Known:
    """A quantity that is known to lie in a range, clip by clip.

    Attributes:
        name: of the quantity, as "density".
        low, high: (n,) ends of the range for each clip, in the quantity's unit.

    Raises:
        InputError: ends that are not in order.
    """

    name: str
    low: NDArray[np.float64]
    high: NDArray[np.float64]

    @classmethod
    def everywhere(cls, name: str, low: float, high: float, *, count: int) -> Known:
        """The same range for all of `count` clips."""
        return cls(name=name, low=np.full(count, low), high=np.full(count, high))

    @classmethod
    def of_aspect(cls, length: float, height: float, *, count: int) -> Known:
        """The ratio of a flag's length to its height, of a model that estimates it, the same for all of `count` clips.

        Args:
            length, height: of the flag, in one unit.
        """
        middle = math.log(length / height)
        return cls.everywhere(ASPECT, middle - ASPECT_SLACK, middle + ASPECT_SLACK, count=count)

    def __post_init__(self) -> None:
        if self.low.shape != self.high.shape or not (self.low < self.high).all():
            raise InputError(f"a range of the {self.name} whose ends are not in order", fix="give the lower end first")


def restricted(logits: Tensor, scaling: Scaling, *known: Known, draws: int) -> tuple[Tensor, NDArray[np.float64]]:
    """Draws within the known ranges.

    Args:
        logits: (n, m, target) draws as networks know them, m well above `draws`.
        scaling: between these and the targets.
        known: quantities, each with one range a clip; one or more.
        draws: how many are returned of each clip; fewer that lie within are repeated in turn.

    Returns:
        (n, draws, target) logits, and (n,) the share of draws within all of the ranges: what the model gave them.

    Raises:
        InputError: a quantity that the model does not estimate, or a range that leaves the model's.
    """
    values = scaling.values(logits.double())
    outside = sum((_outside(values, scaling, one) for one in known), torch.zeros_like(values[..., 0]))
    order = outside.argsort(dim=1, stable=True)
    within = (outside == 0).sum(dim=1)
    kept = within.clamp(min=FEWEST)
    place = torch.arange(draws, device=logits.device)[None, :] % kept[:, None]
    chosen = torch.gather(order, 1, place)
    picked = torch.gather(logits, 1, chosen[..., None].expand(-1, -1, logits.shape[2]))
    return picked, (within.double() / logits.shape[1]).cpu().numpy()


def _outside(values: Tensor, scaling: Scaling, known: Known) -> Tensor:
    """(n, m) how far draws (n, m, target) lie outside of what is known, in widths of the quantity's whole range.

    Raises:
        InputError: as `restricted`.
    """
    column = _column(scaling, known.name)
    target = scaling.targets[column]
    width = target.high - target.low
    if (known.low < target.low - 1e-9 * width).any() or (known.high > target.high + 1e-9 * width).any():
        raise InputError(
            f"a {target.about} of {known.low.min():.4g} to {known.high.max():.4g} {target.unit}; the model was trained "
            f"on {target.low:g} to {target.high:g}",
            fix="give a range within that",
        )  # fmt: skip
    own = values[..., column]
    low, high = (torch.from_numpy(end).to(own)[:, None] for end in (known.low, known.high))
    return (torch.clamp(low - own, min=0) + torch.clamp(own - high, min=0)) / width


def _column(scaling: Scaling, name: str) -> int:
    if name not in scaling.quantities:
        raise InputError(
            f"the model does not estimate the {name}", fix=f"it estimates {', '.join(scaling.quantities) or 'nothing'}"
        )
    return scaling.quantities.index(name)
