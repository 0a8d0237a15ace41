"""Extension of the chord."""

from __future__ import annotations

import numpy as np

from measure.observables.chord import Window, chord
from measure.observables.observable import Observable


def extension(window: Window) -> float:
    """Computes the mean over the frames [1]."""
    return float(np.hypot(*chord(window).T).mean() / window.length)


EXTENSION = Observable(
    name="extension",
    unit="1",
    meaning="mean length of the line from the middle of the hoist to that of the free edge over "
    "the flag's length",
    blind="folds along the hoist, and turns of the flag towards the camera, which the view's "
    "azimuth has to explain",
    pixels=extension,
    geometry=extension,
    bias=-0.016,
    sigma=0.027,
    counted_in="length",
)
