"""The constant, uniform wind of the reference simulator."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from flagdata.errors import InputError


@dataclass(frozen=True, kw_only=True)
class UniformWind:
    """The same velocity everywhere and always.

    Attributes:
        constant: (3, batch) where the air goes to [m/s].

    Raises:
        InputError: another shape, or a velocity that is not finite.
    """

    constant: Tensor

    def __post_init__(self) -> None:
        if self.constant.ndim != 2 or self.constant.shape[0] != 3:
            raise InputError(
                f"the wind has shape {tuple(self.constant.shape)}",
                where="uniform wind",
                fix="give (3, batch) in m/s",
            )
        bad = ~torch.isfinite(self.constant).all(0)
        if bad.any():
            member = int(torch.nonzero(bad)[0])
            raise InputError(
                "the wind velocity is not finite",
                where=f"uniform wind, member {member}",
                fix="give finite m/s",
            )

    def velocity(self, time: float) -> Tensor:
        """Returns the velocity (3, batch) [m/s]; `time` does not matter."""
        return self.constant
