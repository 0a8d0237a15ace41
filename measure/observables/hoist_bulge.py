"""How far the cloth beside the pole departs from it between its two ends."""

from __future__ import annotations

import numpy as np

from measure.observables.chord import Window, chord
from measure.observables.not_shown import NO_SILHOUETTE, UnseenError
from measure.observables.observable import Observable

_BETWEEN = 0.45
"""Share of the hoist's height above and below its middle in which the cloth's edge is looked at: at
the ends it is held, and its corners blur."""
_ROWS = 0.5
"""Share of these rows that is to show cloth."""


def hoist_bulge(window: Window) -> float:
    """Computes how far the cloth next to the pole is from the line that joins the hoist's ends,
    away from the pole: the mean over frames and rows between the ends [flag lengths]. Cloth on the
    line's other side counts as on it, since a film's masks end there.

    Raises:
        UnseenError: as `chord`, or hardly any row between the ends shows cloth.
    """
    chord(window)
    shapes = window.silhouettes
    between = np.abs(shapes.rows) <= _BETWEEN * shapes.height
    masks = shapes.masks[:, between]
    has_cloth = masks.any(axis=2)
    if not has_cloth.size or has_cloth.mean() < _ROWS:
        raise UnseenError(NO_SILHOUETTE)
    # The first cloth's edge is half a pixel before its middle.
    first = shapes.columns[masks.argmax(axis=2)] - 0.5 / shapes.scale
    return float(np.maximum(first, 0.0)[has_cloth].mean() / shapes.length)


HOIST_BULGE = Observable(
    name="hoist-bulge",
    unit="1",
    meaning="mean distance, in flag lengths, of the cloth beside the pole from the line that joins "
    "the hoist's two "
    "ends, away from the pole",
    blind="cloth that bulges to the other side of the pole, and a pole that hides the gap",
    pixels=hoist_bulge,
    geometry=hoist_bulge,
    bias=0.001,
    sigma=0.003,
    counted_in="length",
)
