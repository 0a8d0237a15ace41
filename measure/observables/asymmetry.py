"""Asymmetry between the halves of the silhouette."""

from __future__ import annotations

from measure.observables.chord import Window, chord
from measure.observables.observable import Observable


def asymmetry(window: Window) -> float:
    """Computes the mean area above the mean chord less the mean area below it, over their sum
    [1]."""
    across, up = chord(window).mean(axis=0)
    shapes = window.silhouettes
    above = shapes.rows[:, None] * across > shapes.columns[None, :] * up
    total = shapes.masks.sum()
    return float(2 * (shapes.masks & above).sum() / total - 1)


ASYMMETRY = Observable(
    name="asymmetry",
    unit="1",
    meaning="area of the silhouette above the mean line from the middle of the hoist to the middle "
    "of the free edge, "
    "less the area below it, over their sum",
    blind="asymmetries that the view from above or below makes as well",
    pixels=asymmetry,
    geometry=asymmetry,
    bias=-0.026,
    sigma=0.067,
)
