"""What an observable is: a number of a window with a unit, defined on pixels and on geometry."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeVar

from measure.observables.film_window import FilmWindow
from measure.observables.not_shown import UnseenError
from measure.observables.tracked_cloth import ClothWindow

__all__ = ["Observable", "UnseenError", "WindowReading"]

_Window = TypeVar("_Window")
WINDOW = 2.5
"""Length of a window [s]: some flutter periods, and short beside the changes of a wind's mean.
Longer averages over more flutter and over more change of the wind."""


@dataclass(frozen=True, kw_only=True)
class WindowReading:
    """What a window gives for an observable.

    Attributes:
        value: in the observable's unit; NaN where the window does not show it.
        reason: kind of why not, as reasons are counted; None where there is a value.
    """

    value: float
    reason: str | None = None


@dataclass(frozen=True, kw_only=True)
class Observable:
    """A number of a window of `WINDOW` seconds.

    Attributes:
        name: in the registry.
        unit: of the value.
        meaning: what it is, one sentence.
        blind: what it does not show.
        pixels, geometry: its two definitions; each raises `UnseenError` where its window does not
            show it.
        bias: median of pixels less geometry in filmed simulations, in the unit.
        sigma: robust deviation (1.48 times the median one) of the same for one window: what
            segmentation, blur and folds leave. Both are measured by `python -m tests.studies
            observables` (docs/results/validate-observables.md).
        counted_in: what of the flag the value is counted in; None where it is of no length.
        quadratic: whether it is a root mean square or a standard deviation, so that parts of a
            window are averaged in squares.
    """

    name: str
    unit: str
    meaning: str
    blind: str
    pixels: Callable[[FilmWindow], float]
    geometry: Callable[[ClothWindow], float]
    bias: float
    sigma: float
    counted_in: Literal["length", "height"] | None = None
    quadratic: bool = False

    @property
    def measured_in(self) -> str | None:
        """The unit of the value before it is divided by the flag's length or height."""
        return None if self.counted_in is None else "m" if self.unit == "1" else "m/s"

    def of_film(self, window: FilmWindow) -> WindowReading:
        """Reads the observable from pixels, less the bias."""
        reading = _read(self.pixels, window)
        return WindowReading(value=reading.value - self.bias, reason=reading.reason)

    def of_cloth(self, window: ClothWindow) -> WindowReading:
        """Reads the observable from geometry."""
        return _read(self.geometry, window)


def _read(definition: Callable[[_Window], float], window: _Window) -> WindowReading:
    try:
        return WindowReading(value=definition(window))
    except UnseenError as why:
        return WindowReading(value=math.nan, reason=why.kind)
