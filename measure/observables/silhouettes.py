"""A cloth's silhouettes in a window: what a film and a simulation show in the same form."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from flagdata.core.arrays import BoolArray, FloatArray
from flagdata.errors import InputError

_TAIL = 0.06
"""Share of a silhouette's area that stands for its free end. Larger moves the free end toward the
middle of the cloth; smaller follows single pixels."""
BESIDE = 0.15
"""Share of the chord next to the hoist that counts as held, not as free. Larger leaves less outline
to measure the speed of; smaller counts what the pole holds."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Silhouettes:
    """Masks of one cloth, frame by frame, turned so that it flies to the right.

    Attributes:
        times: (n,) of the frames, strictly ascending [s].
        masks: (n, rows, columns) where the cloth is, all rows without any cloth in frames that show
            none.
        scale: of the flag's plane at its hoist [px/m].
        hoist: (2,) middle of the hoist: column and row [px], the first pixel's middle at 0.5.
        length, height: of the flat flag [m].

    Raises:
        InputError: shapes that disagree, or times that do not ascend.
    """

    times: FloatArray
    masks: BoolArray
    scale: float
    hoist: FloatArray
    length: float
    height: float

    def __post_init__(self) -> None:
        if (
            self.masks.ndim != 3
            or len(self.masks) != len(self.times)
            or not (np.diff(self.times) > 0).all()
        ):
            raise InputError(
                f"masks of shape {self.masks.shape} at {len(self.times)} instants",
                where="silhouettes",
                fix="give one mask a frame, in the order of time",
            )

    @cached_property
    def area(self) -> FloatArray:
        """(n,) [m²] of the picture's plane."""
        return self.masks.sum(axis=(1, 2)) / self.scale**2

    @cached_property
    def columns(self) -> FloatArray:
        """(columns,) distance of the middles of the mask's columns from the hoist, away from it
        [m]."""
        return (np.arange(self.masks.shape[2]) + 0.5 - self.hoist[0]) / self.scale

    @cached_property
    def rows(self) -> FloatArray:
        """(rows,) height of the middles of the mask's rows above the middle of the hoist [m]."""
        return (self.hoist[1] - np.arange(self.masks.shape[1]) - 0.5) / self.scale

    def middle_of(self, low: float, high: float) -> FloatArray:
        """Computes the centroid (n, 2) [m] of the part of the cloth's area between two shares,
        counted from the hoist outwards; NaN where there is no cloth."""
        profile = self.masks.sum(axis=1).astype(np.float64)
        divisor = np.where(profile > 0, profile, 1.0)
        total = np.where(profile.any(axis=1), profile.sum(axis=1), np.nan)[:, None]
        begins = (np.cumsum(profile, axis=1) - profile) / total
        inside = np.clip(begins + profile / total, low, high) - np.clip(begins, low, high)
        up = np.einsum("nrc,r->nc", self.masks, self.rows) / divisor
        return np.stack(
            [(inside * self.columns).sum(axis=1), (inside * up).sum(axis=1)], axis=1
        ) / (high - low)

    def free_edge(self) -> FloatArray:
        """Finds the middle of the free edge as far as an outline shows it, (n, 2) [m]: midway
        between the middle quarter of the free outline and the centroid of the `_TAIL` of the area
        that is farthest along the chord; NaN without cloth.

        If the flag droops, the outline's middle is above the mean of the true edge's points and the
        tail's centroid below it; their middle errs less.
        """
        edge = np.full((len(self.masks), 2), np.nan)
        for k, mask in enumerate(self.masks):
            if mask.any():
                edge[k] = (self._along_outline(mask) + self._tail(mask)) / 2
        return edge

    def _tail(self, mask: BoolArray) -> FloatArray:
        rows, columns = np.nonzero(mask)
        places = np.stack([self.columns[columns], self.rows[rows]], axis=1)
        along = places @ places.mean(axis=0)
        return places[along >= np.quantile(along, 1 - _TAIL)].mean(axis=0)

    def _along_outline(self, mask: BoolArray) -> FloatArray:
        """Returns the mean of the middle quarter of the free outline: the outline is cut at the
        points nearest to the hoist's two ends."""
        contours, _ = cv2.findContours(
            mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE
        )
        border = np.asarray(max(contours, key=len), np.int64)[:, 0]
        places = np.stack([self.columns[border[:, 0]], self.rows[border[:, 1]]], axis=1)
        upper, lower = (
            int(np.hypot(places[:, 0], places[:, 1] - end).argmin())
            for end in (self.height / 2, -self.height / 2)
        )
        places = np.roll(places, -upper, axis=0)
        first_path, second_path = (
            places[: (lower - upper) % len(places) + 1],
            places[(lower - upper) % len(places) :],
        )
        free = first_path if first_path[:, 0].mean() >= second_path[:, 0].mean() else second_path
        length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(free, axis=0).T))])
        middle = np.abs(length - length[-1] / 2) <= length[-1] / 8
        return free[middle].mean(axis=0)
