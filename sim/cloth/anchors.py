"""Anchors that move one by one along tracks: a cloth carried by hands or by a robot."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from flagdata.errors import InputError
from sim.wind.sampled import Beyond, Even, between, place


@dataclass(frozen=True, kw_only=True, eq=False)
class AnchorTracks:
    """Displacements of anchors, linear between samples and constant beyond them.

    Attributes:
        start: time of the first sample [s].
        period: between samples [s].
        samples: (n, held, 3, batch) [m], from where the system has the anchors.

    Raises:
        InputError: fewer than two samples, another shape, values that are not finite, a period that
            is not positive.
    """

    start: float
    period: float
    samples: Tensor

    def __post_init__(self) -> None:
        shape = tuple(self.samples.shape)
        if (
            len(shape) != 4
            or shape[0] < 2
            or shape[2] != 3
            or not torch.isfinite(self.samples).all()
        ):
            raise InputError(
                f"the tracks of anchors have the shape {shape}, or are not finite",
                where="anchors",
                fix="give two or more samples, (n, held, 3, batch), in metres",
            )
        if not self.period > 0:
            raise InputError(
                f"the period is {self.period!r} s",
                where="anchors",
                fix="give seconds between samples",
            )

    def displacement(self, time: float) -> Tensor:
        """Interpolates displacements (held, 3, batch) [m] at a time [s]."""
        even = Even(start=self.start, period=self.period, count=len(self.samples))
        return between(self.samples, *place(even, time, Beyond.HOLD))
