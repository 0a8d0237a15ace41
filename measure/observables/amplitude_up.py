"""Amplitude of the free edge up and down."""

from __future__ import annotations

from measure.observables.chord import Window, chord
from measure.observables.observable import Observable


def amplitude_up(window: Window) -> float:
    """Computes the standard deviation over the frames [flag heights]."""
    return float(chord(window)[:, 1].std() / window.height)


AMPLITUDE_UP = Observable(
    name="amplitude-up",
    unit="1",
    meaning="standard deviation of the middle of the free edge up and down in the picture, in flag "
    "heights",
    blind="motion along the line of sight; slower changes of the wind than a window",
    pixels=amplitude_up,
    geometry=amplitude_up,
    bias=-0.016,
    sigma=0.027,
    counted_in="height",
    quadratic=True,
)
