"""Speed of the outline's free part."""

from __future__ import annotations

import numpy as np

from measure.observables.chord import Window
from measure.observables.not_shown import FEW_FRAMES, UnseenError
from measure.observables.observable import Observable
from measure.observables.place_courses import RATE
from measure.observables.silhouettes import BESIDE


def outline_speed(window: Window) -> float:
    """Computes the area that the outline sweeps a second, over its free length [flag lengths a
    second]."""
    shapes = window.silhouettes
    step = max(1, round(1 / RATE / float(np.median(np.diff(shapes.times)))))
    free = shapes.columns > BESIDE * shapes.length
    masks = shapes.masks[:, :, free]
    intervals = shapes.times[step:] - shapes.times[:-step]
    usable = intervals < 2 / RATE
    if usable.sum() < 2:
        raise UnseenError(FEW_FRAMES)
    swept = (masks[step:] ^ masks[:-step]).sum(axis=(1, 2))[usable] / shapes.scale**2
    around = 2 * (shapes.length * (1 - BESIDE)) + shapes.height
    return float((swept / intervals[usable]).mean() / around / shapes.length)


OUTLINE_SPEED = Observable(
    name="outline-speed",
    unit="1/s",
    meaning="mean speed across itself, in flag lengths, of the outline of the free part: the area "
    "that it sweeps a "
    "second, over the free edges' length (twice 85 % of the flag's length and its height)",
    blind="motion inside the outline and along the line of sight",
    pixels=outline_speed,
    geometry=outline_speed,
    bias=-0.053,
    sigma=0.038,
    counted_in="length",
)
