"""Charts as SVG that takes its colours from the page: axes, lines, points, intervals.

A chart is 640 units wide by default. Everything it writes is escaped; classes are styled in
`page.css`.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

from markupsafe import Markup, escape

from measure.verdict.quantity import number

_CHARACTER = 6.6  # width of a digit at the charts' 11-unit type
_LINE = 18.0  # height of a line, with some air
_MOST_POINTS = 900  # of a line; more than a screen shows


class Scale(ABC):
    """A way from values to places along an axis.

    Args:
        low, high: the values at its ends.
        start, stop: the places of its ends, in the chart's units.
    """

    def __init__(self, low: float, high: float, start: float, stop: float) -> None:
        self.low, self.high, self.start, self.stop = low, high, start, stop

    def __call__(self, value: float) -> float:
        low, high = self.measure(self.low), self.measure(self.high)
        return self.start + (self.measure(value) - low) / (high - low) * (self.stop - self.start)

    @abstractmethod
    def measure(self, value: float) -> float:
        """Computes what is linear along the axis."""

    @abstractmethod
    def ticks(self, room: Callable[[str], float]) -> list[tuple[float, str]]:
        """Values and their labels, so few that none needs more than its `room` along the axis."""

    @abstractmethod
    def shows(self, value: float) -> bool:
        """Returns whether a value has a place on the axis."""


class Linear(Scale):
    """Equal steps."""

    @classmethod
    def over(
        cls, values: Iterable[float], start: float, stop: float, *, at_least: Sequence[float] = ()
    ) -> Linear:
        """Spans the finite `values` with a margin, and exactly `at_least` where that reaches
        further."""
        finite = [v for v in values if math.isfinite(v)]
        low, high = min([*finite, *at_least], default=0.0), max([*finite, *at_least], default=1.0)
        if low == high:
            low, high = low - max(0.5 * abs(low), 1e-9), high + max(0.5 * abs(high), 1e-9)
        margin = 0.04 * (high - low)
        return cls(
            low if low in at_least else low - margin,
            high if high in at_least else high + margin,
            start,
            stop,
        )

    def measure(self, value: float) -> float:
        return value

    def shows(self, value: float) -> bool:
        return self.low <= value <= self.high

    def ticks(self, room: Callable[[str], float]) -> list[tuple[float, str]]:
        for wanted in range(8, 1, -1):
            step = _round_step((self.high - self.low) / wanted)
            places = max(0, -math.floor(math.log10(step) + 1e-9))
            first, last = math.ceil(self.low / step - 1e-9), math.floor(self.high / step + 1e-9)
            values = [round(n * step, places) + 0.0 for n in range(first, last + 1)]
            labels = [_plain(v, places) for v in values]
            spacing = abs(self(step) - self(0.0))
            if max(map(room, labels), default=0.0) <= spacing:
                return list(zip(values, labels, strict=True))
        return []


class Logarithmic(Scale):
    """Equal ratios; positive values only."""

    @classmethod
    def over(cls, values: Iterable[float], start: float, stop: float) -> Logarithmic:
        """Spans the positive `values`, with a margin."""
        positive = [v for v in values if math.isfinite(v) and v > 0]
        low, high = min(positive, default=0.1), max(positive, default=1.0)
        margin = max((high / low) ** 0.04, 1.1)
        return cls(low / margin, high * margin, start, stop)

    def measure(self, value: float) -> float:
        return math.log10(value)

    def shows(self, value: float) -> bool:
        return value > 0 and self.low <= value <= self.high

    def ticks(self, room: Callable[[str], float]) -> list[tuple[float, str]]:
        first, last = math.ceil(math.log10(self.low)), math.floor(math.log10(self.high))
        if last - first < 2:
            return self._spaced_ticks(
                [(v, number(v, digits=1)) for v in _within_decade(self.low, self.high)], room
            )
        return self._spaced_ticks([(10.0**n, _decade(n)) for n in range(first, last + 1)], room)

    def _spaced_ticks(
        self, ticks: list[tuple[float, str]], room: Callable[[str], float]
    ) -> list[tuple[float, str]]:
        """Selects as many of the ticks, from the first on, as do not touch."""
        spaced: list[tuple[float, str]] = []
        for value, label in ticks:
            if (
                not spaced
                or abs(self(value) - self(spaced[-1][0])) >= (room(label) + room(spaced[-1][1])) / 2
            ):
                spaced.append((value, label))
        return spaced


@dataclass(kw_only=True)
class Chart:
    """A chart being drawn.

    Attributes:
        title: what it shows, for those who cannot see it.
        description: what it shows, likewise.
        x, y: scales; y grows upwards when its `start` lies below its `stop`.
        x_label, y_label: quantity and unit.
        width, height: of the whole.
        marks: what was drawn so far.
    """

    title: str
    description: str
    x: Scale
    y: Scale
    x_label: str
    y_label: str
    width: float = 640
    height: float = 260
    marks: list[str] = field(default_factory=list)

    def line(self, xs: Sequence[float], ys: Sequence[float], kind: str) -> None:
        """Draws a line through the points; broken where a value is missing."""
        path = path_through(*thin_line([(self.x, xs), (self.y, ys)]))
        if path:
            self.marks.append(f'<path class="line {kind}" d="{path}"/>')

    def point(self, x: float, y: float, kind: str) -> None:
        """Draws a dot."""
        if self.x.shows(x) and self.y.shows(y):
            self.marks.append(
                f'<circle class="{kind}" cx="{self.x(x):.1f}" cy="{self.y(y):.1f}" r="4"/>'
            )

    def bar(self, left: float, right: float, height: float, kind: str) -> None:
        """Draws a bar of a histogram, from the axis up."""
        top, bottom = self.y(height), self.y(self.y.low)
        self.marks.append(
            f'<rect class="{kind}" x="{self.x(left):.1f}" y="{top:.1f}" '
            f'width="{max(self.x(right) - self.x(left) - 1, 0.5):.1f}" '
            f'height="{bottom - top:.1f}"/>'
        )

    def upright(self, x: float, kind: str) -> None:
        """Draws a line across the chart at `x`."""
        if self.x.shows(x):
            self.marks.append(
                f'<path class="line {kind}" d="M{self.x(x):.1f} '
                f'{self.y.start:.1f}V{self.y.stop:.1f}"/>'
            )

    def note(self, x: float, y: float, text: str, anchor: str) -> None:
        """Writes text at a place of the chart, in the chart's units."""
        self.marks.append(
            f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{escape(text)}</text>'
        )

    def svg(self) -> Markup:
        """Renders the finished chart."""
        inside = "".join([*self._frame(), *self.marks])
        return drawing(self.width, self.height, self.title, self.description, inside)

    def _frame(self) -> list[str]:
        left, right, bottom, top = self.x.start, self.x.stop, self.y.start, self.y.stop
        parts = []
        for value, label in self.y.ticks(room_below):
            at = self.y(value)
            parts.append(f'<path class="grid" d="M{left:.1f} {at:.1f}H{right:.1f}"/>')
            parts.append(
                f'<text x="{left - 6:.1f}" y="{at + 4:.1f}" '
                f'text-anchor="end">{escape(label)}</text>'
            )
        for value, label in self.x.ticks(room_beside):
            at = self.x(value)
            parts.append(f'<path class="tick" d="M{at:.1f} {bottom:.1f}v4"/>')
            parts.append(
                f'<text x="{at:.1f}" y="{bottom + 17:.1f}" '
                f'text-anchor="middle">{escape(label)}</text>'
            )
        parts.append(f'<path class="axis" d="M{left:.1f} {bottom:.1f}H{right:.1f}"/>')
        middle = (left + right) / 2
        parts.append(
            f'<text class="label" x="{middle:.1f}" y="{bottom + 36:.1f}" '
            f'text-anchor="middle">{escape(self.x_label)}'
            "</text>"
        )
        parts.append(
            f'<text class="label" x="{left:.1f}" y="{top - 10:.1f}">{escape(self.y_label)}</text>'
        )
        return parts


def drawing(width: float, height: float, title: str, description: str, inside: str) -> Markup:
    """Makes an SVG that names and describes itself. `inside` is markup already."""
    return Markup(
        f'<svg role="img" viewBox="0 0 {width:g} {height:g}" '
        f'aria-label="{escape(title)}: {escape(description)}">{inside}</svg>'
    )


def thin_line(axes: Sequence[tuple[Scale, Sequence[float]]]) -> tuple[list[float], list[float]]:
    """Thins a line's points: of each stretch too dense to show, its lowest and highest; NaN where
    none is shown."""
    (x, xs), (y, ys) = axes
    places = [
        (x(a), y(b)) if x.shows(a) and y.shows(b) else (math.nan, math.nan)
        for a, b in zip(xs, ys, strict=True)
    ]
    stretch = max(1, math.ceil(2 * len(places) / _MOST_POINTS))
    if stretch <= 2:
        points = places
    else:
        points = []
        for begin in range(0, len(places), stretch):
            part = places[begin : begin + stretch]
            ends = {
                min(range(len(part)), key=lambda i: part[i][1]),
                max(range(len(part)), key=lambda i: part[i][1]),
            }
            points += (
                [(math.nan, math.nan)]
                if any(math.isnan(p[1]) for p in part)
                else [part[i] for i in sorted(ends)]
            )
    return [p[0] for p in points], [p[1] for p in points]


def path_through(xs: Sequence[float], ys: Sequence[float]) -> str:
    """Writes SVG path data through the points, lifted at NaN."""
    parts, pen = [], "M"
    for x, y in zip(xs, ys, strict=True):
        if math.isnan(x) or math.isnan(y):
            pen = "M"
            continue
        parts.append(f"{pen}{x:.1f} {y:.1f}")
        pen = "L"
    return "".join(parts)


def room_beside(label: str) -> float:
    """Returns the room that a label needs among others on the same line."""
    return _CHARACTER * (len(label) + 2)


def room_below(label: str) -> float:
    """Returns the room that a label needs among others above each other."""
    return _LINE if label else 0.0


def _round_step(least: float) -> float:
    """Finds the smallest of 1, 2, 5 × 10ⁿ that is not below `least`."""
    power = 10.0 ** math.floor(math.log10(least))
    return next(factor * power for factor in (1, 2, 5, 10) if factor * power >= least * (1 - 1e-9))


def _within_decade(low: float, high: float) -> list[float]:
    """Lists those of 1, 2, 3, 5, 7 × 10ⁿ that lie between."""
    exponents = range(math.floor(math.log10(low)), math.floor(math.log10(high)) + 1)
    return [f * 10.0**n for n in exponents for f in (1, 2, 3, 5, 7) if low <= f * 10.0**n <= high]


def _plain(value: float, places: int) -> str:
    if value and not 1e-4 <= abs(value) < 1e6:
        return number(value, digits=2)
    return f"{value:.{places}f}".replace("-", "\N{MINUS SIGN}")


def _decade(exponent: int) -> str:
    if -2 <= exponent <= 3:
        return f"{10.0**exponent:g}"
    return "10" + str(exponent).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
