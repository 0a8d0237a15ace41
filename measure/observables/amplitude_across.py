"""Amplitude of the free edge to and from the hoist."""

from __future__ import annotations

from measure.observables.chord import Window, chord
from measure.observables.observable import Observable


def amplitude_across(window: Window) -> float:
    """Computes the standard deviation over the frames [flag heights]."""
    return float(chord(window)[:, 0].std() / window.height)


AMPLITUDE_ACROSS = Observable(
    name="amplitude-across",
    unit="1",
    meaning="standard deviation of the middle of the free edge to and from the hoist in the "
    "picture, in flag heights",
    blind="motion along the line of sight; slower changes of the wind than a window",
    pixels=amplitude_across,
    geometry=amplitude_across,
    bias=-0.009,
    sigma=0.019,
    counted_in="height",
    quadratic=True,
)
