"""A cloth's silhouettes in a window: what a film and a simulation show in the same form."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import InputError

BESIDE = 0.15
"""Share of the chord next to the hoist that counts as held, not as free."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Silhouettes:
    """Masks of one cloth, frame by frame, turned so that it flies to the right.

    Attributes:
        times: (n,) of the frames, strictly ascending [s].
        masks: (n, rows, columns) where the cloth is, all rows without any cloth in frames that show none.
        scale: of the flag's plane at its hoist [px/m].
        hoist: (2,) middle of the hoist: column and row [px], the first pixel's middle at 0.5.
        length, height: of the flat flag [m].

    Raises:
        InputError: shapes that disagree, or times that do not ascend.
    """

    times: NDArray[np.float64]
    masks: NDArray[np.bool_]
    scale: float
    hoist: NDArray[np.float64]
    length: float
    height: float

    def __post_init__(self) -> None:
        if self.masks.ndim != 3 or len(self.masks) != len(self.times) or not (np.diff(self.times) > 0).all():
            raise InputError(
                f"masks of shape {self.masks.shape} at {len(self.times)} instants", where="silhouettes",
                fix="give one mask a frame, in the order of time",
            )  # fmt: skip

    @cached_property
    def area(self) -> NDArray[np.float64]:
        """(n,) [m²] of the picture's plane."""
        return self.masks.sum(axis=(1, 2)) / self.scale**2

    @cached_property
    def columns(self) -> NDArray[np.float64]:
        """(columns,) distance of the middles of the mask's columns from the hoist, away from it [m]."""
        return (np.arange(self.masks.shape[2]) + 0.5 - self.hoist[0]) / self.scale

    @cached_property
    def rows(self) -> NDArray[np.float64]:
        """(rows,) height of the middles of the mask's rows above the middle of the hoist [m]."""
        return (self.hoist[1] - np.arange(self.masks.shape[1]) - 0.5) / self.scale

    def middle_of(self, low: float, high: float) -> NDArray[np.float64]:
        """(n, 2) centroid [m] of the cloth between two shares of its area, counted away from the hoist; NaN without."""
        profile = self.masks.sum(axis=1).astype(np.float64)
        held = np.where(profile > 0, profile, 1.0)
        total = np.where(profile.any(axis=1), profile.sum(axis=1), np.nan)[:, None]
        begins = (np.cumsum(profile, axis=1) - profile) / total
        inside = np.clip(begins + profile / total, low, high) - np.clip(begins, low, high)
        up = np.einsum("nrc,r->nc", self.masks, self.rows) / held
        return np.stack([(inside * self.columns).sum(axis=1), (inside * up).sum(axis=1)], axis=1) / (high - low)
