"""Share of the flat area that is seen."""

from __future__ import annotations

from measure.observables.chord import Window
from measure.observables.observable import Observable


def area(window: Window) -> float:
    """Computes the mean over the frames [1]."""
    return float(window.silhouettes.area.mean() / (window.length * window.height))


AREA = Observable(
    name="area",
    unit="1",
    meaning="mean area of the silhouette over the area of the flat flag",
    blind="whether cloth is hidden by folds or by the angle of the view",
    pixels=area,
    geometry=area,
    bias=-0.001,
    sigma=0.038,
)
