"""Droop of the chord."""

from __future__ import annotations

import numpy as np

from measure.observables.chord import Window, chord
from measure.observables.observable import Observable


def droop(window: Window) -> float:
    """Computes the mean over the frames [rad]."""
    across, up = chord(window).T
    return float(np.arctan2(-up, across).mean())


DROOP = Observable(
    name="droop",
    unit="rad",
    meaning="mean angle below the horizontal of the line from the middle of the hoist to the "
    "middle of the free edge",
    blind="weight and the air's dynamic pressure in one steady wind: only their ratio is shown",
    pixels=droop,
    geometry=droop,
    bias=-0.010,
    sigma=0.030,
)
