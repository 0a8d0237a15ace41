"""A window of a film that was made fit, with the cloth's masks in it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flagdata.core.arrays import BoolArray, FloatArray, UInt8Array
from flagdata.errors import InputError
from measure.observables.not_shown import NO_SILHOUETTE, UnseenError
from measure.observables.silhouettes import Silhouettes

_LARGEST = 1.15
"""Mean area over that of the flat flag above which the hoist's height, and with it the scale, is
wrong."""
_SHOWN = 0.8
"""Share of a window's frames whose outline is to be found."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FilmWindow:
    """A window of a film.

    Attributes:
        times: (n,) ascending [s].
        frames: (n, size, size) gray, steadied and cropped (`models.conditioning`).
        masks: (n, size, size) where the cloth is.
        shown: (n,) whether the frame's mask was found.
        scale: of the flag's plane at its hoist, from its given height [px/m].
        hoist: (2, 2) upper and lower end of the hoist: column and row, the first pixel's middle at
            0.5 [px].
        side: 1 where the flag flies to the right, −1 to the left.
        length, height: of the flat flag [m].

    Raises:
        InputError: shapes that disagree.
    """

    times: FloatArray
    frames: UInt8Array
    masks: BoolArray
    shown: BoolArray
    scale: float
    hoist: FloatArray
    side: float
    length: float
    height: float

    def __post_init__(self) -> None:
        n = len(self.times)
        if (
            self.frames.shape != self.masks.shape
            or len(self.frames) != n
            or self.shown.shape != (n,)
        ):
            raise InputError(
                f"{self.frames.shape} frames, {self.masks.shape} masks at {n} instants",
                where="window of a film",
                fix="give one frame and one mask of the same size at each instant",
            )

    @cached_property
    def silhouettes(self) -> Silhouettes:
        """Of the frames that show the cloth.

        Raises:
            UnseenError: too few of them do.
        """
        if self.shown.mean() < _SHOWN or self.shown.sum() < 2:
            raise UnseenError(NO_SILHOUETTE)
        masks, middle = self.masks[self.shown], self.hoist.mean(axis=0)
        if self.side < 0:
            masks, middle = masks[:, :, ::-1], np.array([masks.shape[2] - middle[0], middle[1]])
        if masks.sum(axis=(1, 2)).mean() > _LARGEST * self.length * self.height * self.scale**2:
            raise UnseenError(NO_SILHOUETTE)
        return Silhouettes(
            times=self.times[self.shown],
            masks=masks,
            scale=self.scale,
            hoist=middle,
            length=self.length,
            height=self.height,
        )

    @cached_property
    def free_edge(self) -> FloatArray:
        """(n, 2) middle of the free edge, as far as the outline shows it: away from the middle of
        the hoist, and above it [m]."""
        return self.silhouettes.free_edge()

    @cached_property
    def middle(self) -> FloatArray:
        """(n, 2) centroid of the middle third of the silhouette's area, likewise."""
        return self.silhouettes.middle_of(1 / 3, 2 / 3)
