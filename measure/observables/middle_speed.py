"""Speed of the middle of the cloth."""

from __future__ import annotations

from measure.observables.chord import Window
from measure.observables.observable import Observable
from measure.observables.place_courses import speed


def middle_speed(window: Window) -> float:
    """Computes the root mean square over the frames [flag lengths a second]."""
    return speed(window.silhouettes.times, window.middle) / window.length


MIDDLE_SPEED = Observable(
    name="middle-speed",
    unit="1/s",
    meaning="root mean square speed, in flag lengths, of the centroid of the middle third of the "
    "silhouette",
    blind="motion along the line of sight",
    pixels=middle_speed,
    geometry=middle_speed,
    bias=-0.004,
    sigma=0.048,
    counted_in="length",
    quadratic=True,
)
