"""The line from the middle of the hoist to the free edge, frame by frame."""

from __future__ import annotations

import numpy as np

from flagdata.core.arrays import FloatArray
from measure.observables.film_window import FilmWindow
from measure.observables.not_shown import EDGE_ON, NO_SILHOUETTE, UnseenError
from measure.observables.tracked_cloth import ClothWindow

Window = FilmWindow | ClothWindow
"""Both have `times`, `free_edge`, `middle`, `silhouettes`, `length` and `height`."""
_NARROWEST = 0.12
"""Share of the flat area that is seen below which the view is along the flag: one that hangs in
folds shows more. Lower reads chords that are noise; higher refuses flags that droop in folds."""


def chord(window: Window) -> FloatArray:
    """Finds where the middle of the free edge is, (n, 2) from the middle of the hoist: away from
    the hoist, and up [m]. Frames that show no cloth are left out.

    Raises:
        UnseenError: the flag is seen edge-on, or is hardly seen.
    """
    places = window.free_edge
    places = places[np.isfinite(places).all(axis=1)]
    if len(places) < 2:
        raise UnseenError(NO_SILHOUETTE)
    if window.silhouettes.area.mean() < _NARROWEST * window.length * window.height:
        raise UnseenError(EDGE_ON)
    return places
