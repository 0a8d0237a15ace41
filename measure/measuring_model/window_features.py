"""What each window of a film shows, in numbers, and where in its picture the flag is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import torch

from flagdata.core.arrays import BoolArray, Float32Array, FloatArray, UInt8Array
from flagdata.errors import RefusedError
from measure.estimate.film_posterior import WIND
from measure.film.conditioned_film import ConditionedFilm
from measure.film.similarity import POWERS, FlagSize, trained_on
from measure.film.windows import WindowLayout, WindowReader
from measure.observables.film_window import FilmWindow
from measure.observables.watching import Watcher
from models.trained.estimator import Estimator

SUMMARY = "summary-"
"""What the names of a summary's numbers begin with."""
VERSION = 1
"""Raised when the same film gives other features."""
THUMBNAIL = 64
"""Longer side of the picture by which a place is known again [px]. Larger shows more detail of the
place, and more of what moves in it."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Place:
    """Where the camera stands, as far as its picture shows it.

    Attributes:
        hoist: (2, 2) upper and lower end of the hoist: column and row, in longer sides of the
            picture; NaN where it was not found.
        side: 1 where the flag flies to the right, -1 to the left.
        background: (rows, columns) float32 the picture averaged down to `THUMBNAIL` [gray levels].
        bare: (rows, columns) where no cloth moves.
    """

    hoist: FloatArray
    side: float
    background: Float32Array
    bare: BoolArray


@dataclass(frozen=True, kw_only=True, eq=False)
class Features:
    """Windows of a film, one after another.

    Attributes:
        film: its name.
        starts: (w,) of the windows [s from the film's first frame], `layout.step` apart.
        layout: of the windows.
        values: (w, feature), a row of NaN where frames are missing.
        names: of the features.
        summaries: (w, dimension) of the network's first learner, by which films are compared; NaN
            likewise.
        winds: (w,) that the network reads by itself [m/s]; NaN likewise.
        clip: (frames, height, width) of the first whole window.
        place: of the camera.
    """

    film: str
    starts: FloatArray
    layout: WindowLayout
    values: FloatArray
    names: tuple[str, ...]
    summaries: Float32Array
    winds: FloatArray
    clip: UInt8Array
    place: Place

    @property
    def whole(self) -> BoolArray:
        """(w,) windows that have all their frames."""
        return np.asarray(np.isfinite(self.summaries).all(axis=1))


@torch.no_grad()
def features_of(
    film: ConditionedFilm,
    model: Estimator,
    size: FlagSize,
    *,
    first: float | None = None,
    last: float | None = None,
    advance: Callable[[int, int], None] | None = None,
) -> Features:
    """Computes the features of a film's windows.

    Args:
        size: of the flag.
        first, last: part of the film [s].
        advance: called after each window with how many there are and 1.

    Raises:
        RefusedError: nothing moves like cloth, or no window is whole.
        UsageError, InputError: a part that the film does not have.
    """
    scale = size.scale(trained_on(model.targets))
    reader = WindowReader(film, model, [scale], first=first, last=last)
    layout = reader.layout
    summaries: Float32Array | None = None
    rows: dict[int, Float32Array] = {}
    winds = np.full(layout.count, np.nan)
    clip: UInt8Array | None = None
    hoist = _Hoist()
    watcher = Watcher(
        film, size, begin=layout.first, count=layout.count, seconds=layout.step, deliver=hoist.take
    )
    reader.look = watcher.look
    for window in reader.windows(advance):
        embeddings = model.embeddings(model.inputs(window.clips))
        summary = embeddings[0][0].cpu().numpy().astype(np.float32)
        if summaries is None:
            summaries, clip = (
                np.full((layout.count, len(summary)), np.nan, np.float32),
                window.clips[0],
            )
        summaries[window.index] = summary
        rows[window.index] = np.concatenate(
            [embedding[0].cpu().numpy() for embedding in embeddings]
        )
        values = model.learners[0].scaling.values(model.posterior(embeddings).mean().float())
        winds[window.index] = float(values[0, 0]) * scale ** POWERS[WIND]
    if summaries is None or clip is None:
        raise RefusedError(
            "no window of the film has all its frames",
            where=film.name,
            fix="choose another part by --start and --end",
        )
    watcher.finish()
    features = np.full((layout.count, len(next(iter(rows.values())))), np.nan)
    features[list(rows)] = list(rows.values())
    return Features(
        film=film.name,
        starts=layout.first + layout.step * np.arange(layout.count, dtype=np.float64),
        layout=layout,
        values=np.concatenate([features, winds[:, None]], axis=1),
        names=(*(f"{SUMMARY}{k}" for k in range(features.shape[1])), "network-wind"),
        summaries=summaries,
        winds=winds,
        clip=clip,
        place=_place_of(film, *hoist.found()),
    )


class _Hoist:
    """Where the hoist is in the conditioned picture."""

    def __init__(self) -> None:
        self._ends: list[FloatArray] = []
        self._side = 0.0

    def take(self, windows: Sequence[FilmWindow | None]) -> None:
        """Takes the next windows."""
        for window in windows:
            if window is not None:
                self._ends.append(window.hoist / window.masks.shape[2])
                self._side += window.side

    def found(self) -> tuple[FloatArray, float]:
        """Returns the hoist's ends (2, 2) in the picture's sides, NaN where no window shows them,
        and the side the flag flies to."""
        if not self._ends:
            return np.full((2, 2), np.nan), 0.0
        return np.median(self._ends, axis=0), float(np.sign(self._side))


def _place_of(film: ConditionedFilm, hoist: FloatArray, side: float) -> Place:
    """Returns the place, as the last reading of the film shows it."""
    detection, reference = film.found, film.reference
    if detection is None or reference is None or detection.region is None:
        raise RefusedError(
            "no motion like cloth's was found in the film",
            where=film.name,
            fix="give another film, or --crop around the flag",
        )
    rows, columns = reference.shape
    longer = max(rows, columns)
    shape = (max(1, round(THUMBNAIL * rows / longer)), max(1, round(THUMBNAIL * columns / longer)))
    background = cv2.resize(reference.astype(np.float32), shape[::-1], interpolation=cv2.INTER_AREA)
    bare = np.ones(shape, bool)
    for region in detection.regions:
        left, top, right, bottom = (
            edge / detection.scale / longer * THUMBNAIL for edge in region.box
        )
        bare[
            max(0, int(top) - 1) : int(np.ceil(bottom)) + 1,
            max(0, int(left) - 1) : int(np.ceil(right)) + 1,
        ] = False
    square = detection.square
    corner = np.array([square.x, square.y], dtype=np.float64)
    return Place(
        hoist=(corner + hoist * square.side) / longer,
        side=side,
        background=np.asarray(background, np.float32),
        bare=bare,
    )
