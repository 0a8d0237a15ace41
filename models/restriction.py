"""What a model says of clips of which something is known: its posterior, restricted to where the known quantity lies.

Of a joint posterior p(θ | x) under a prior π, the posterior under the prior that is π within a range and 0 outside
is p(θ | x) restricted to that range (Bayes' rule). With a weighed flag the wind is that of a flag of that weight.
Draws outside are discarded; as only some are left, many more are drawn than are returned.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from flagdata.errors import InputError
from models.targets import Scaling

MORE = 32
"""Draws that are made for each one that is returned."""
FEWEST = 16
"""Draws that have to lie in the range; of a clip with fewer, those nearest to the range are taken."""


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

    def __post_init__(self) -> None:
        if self.low.shape != self.high.shape or not (self.low < self.high).all():
            raise InputError(f"a range of the {self.name} whose ends are not in order", fix="give the lower end first")


def restricted(logits: Tensor, scaling: Scaling, known: Known, *, draws: int) -> tuple[Tensor, NDArray[np.float64]]:
    """Draws within the known range.

    Args:
        logits: (n, m, target) draws as networks know them, m well above `draws`.
        scaling: between these and the targets.
        known: one range a clip.
        draws: how many are returned of each clip; fewer that lie within are repeated in turn.

    Returns:
        (n, draws, target) logits, and (n,) the share of draws within the range: what the model gave it.

    Raises:
        InputError: a quantity that the model does not estimate, or a range that leaves the model's.
    """
    column = _column(scaling, known.name)
    target = scaling.targets[column]
    if (known.low < target.low * (1 - 1e-9)).any() or (known.high > target.high * (1 + 1e-9)).any():
        raise InputError(
            f"a {target.about} of {known.low.min():.4g} to {known.high.max():.4g} {target.unit}; the model was trained "
            f"on {target.low:g} to {target.high:g}",
            fix="give a range within that",
        )  # fmt: skip
    values = scaling.values(logits.double())[..., column]
    low, high = (torch.from_numpy(end).to(values)[:, None] for end in (known.low, known.high))
    outside = torch.clamp(low - values, min=0) + torch.clamp(values - high, min=0)
    order = outside.argsort(dim=1, stable=True)
    within = (outside == 0).sum(dim=1)
    kept = within.clamp(min=FEWEST)
    place = torch.arange(draws, device=logits.device)[None, :] % kept[:, None]
    chosen = torch.gather(order, 1, place)
    picked = torch.gather(logits, 1, chosen[..., None].expand(-1, -1, logits.shape[2]))
    return picked, (within.double() / logits.shape[1]).cpu().numpy()


def _column(scaling: Scaling, name: str) -> int:
    if name not in scaling.quantities:
        raise InputError(
            f"the model does not estimate the {name}", fix=f"it estimates {', '.join(scaling.quantities) or 'nothing'}"
        )
    return scaling.quantities.index(name)
