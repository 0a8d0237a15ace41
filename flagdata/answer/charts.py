"""What a chart shows, as data: marks on panels, without a program that draws them.

Colours are roles, not values, so that a page's charts follow its light or dark style. Drawn by
`flagdata.pages.chart_drawing`, in one technique for all answers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TypeAlias

from flagdata.core.arrays import FloatArray

Numbers: TypeAlias = Sequence[float] | FloatArray


class Colour(StrEnum):
    """What a mark stands for."""

    INK = "ink"
    QUIET = "quiet"
    RULE = "rule"
    FILM = "film"
    """What is inferred from a film or markers, and a model with what was added."""
    LOG = "log"
    """What an anemometer logged, and a base model."""
    FIRST = "series-0"
    SECOND = "series-1"
    THIRD = "series-2"
    FOURTH = "series-3"
    FIFTH = "series-4"
    SIXTH = "series-5"
    SEVENTH = "series-6"
    EIGHTH = "series-7"
    NINTH = "series-8"
    TENTH = "series-9"


SERIES = tuple(colour for colour in Colour if colour.value.startswith("series-"))
"""Colours of things that have an order and no role."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Line:
    """A line through points; gaps where y is not finite.

    Attributes:
        x, y: (n,).
        label: in the legend; none where it is empty.
        marker: of each point: "o" a disc, "s" a square, "D" a diamond, "^" a triangle; none where
            it is empty.
    """

    x: Numbers
    y: Numbers
    colour: Colour = Colour.FILM
    label: str = ""
    width: float = 1.3
    dashed: bool = False
    marker: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class Band:
    """An interval along x, filled.

    Attributes:
        x, low, high: (n,).
    """

    x: Numbers
    low: Numbers
    high: Numbers
    colour: Colour = Colour.FILM
    label: str = ""
    opacity: float = 0.15


@dataclass(frozen=True, kw_only=True, eq=False)
class Dots:
    """Points, with intervals where ends are given.

    Attributes:
        x, y: (n,).
        low, high: (n,) ends of vertical intervals; where one is not finite, a
            triangle at the other points to it.
        hollow: (n,) whether only the outline is drawn; of none where it is empty.
    """

    x: Numbers
    y: Numbers
    low: Numbers = ()
    high: Numbers = ()
    hollow: Sequence[bool] = ()
    colour: Colour = Colour.FILM
    label: str = ""
    marker: str = "o"
    size: float = 4.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Bins:
    """A histogram.

    Attributes:
        edges: (n + 1,).
        heights: (n,).
        filled: or its outline alone.
    """

    edges: Numbers
    heights: Numbers
    colour: Colour = Colour.FILM
    label: str = ""
    filled: bool = True


@dataclass(frozen=True, kw_only=True, eq=False)
class Bars:
    """Horizontal bars from 0, from the top down.

    Attributes:
        names: (n,) beside the bars; several marks of one panel share them.
        lengths: (n,).
        low, high: (n,) ends of intervals; none where they are empty.
        texts: (n,) behind the bars.
        offset: of the bar within its row, −0.5 to 0.5 from its top to its bottom.
        thickness: share of the row.
    """

    names: Sequence[str]
    lengths: Numbers
    low: Numbers = ()
    high: Numbers = ()
    texts: Sequence[str] = ()
    colour: Colour = Colour.FILM
    label: str = ""
    offset: float = 0.0
    thickness: float = 0.6
    opacity: float = 1.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Cells:
    """A shaded grid, or shaded triangles.

    Attributes:
        values: (row, column) from the bottom, or (triangle,).
        x, y: ends of the grid, or the coordinates (point,) of the triangles' corners.
        triangles: (triangle, 3) indices into x and y; of a grid empty.
        low, high: values at the ends of the palette.
        diverging: whether 0 is in the middle of the palette.
        label: of the palette's bar; no bar where it is empty.
    """

    values: FloatArray
    x: Numbers
    y: Numbers
    triangles: Sequence[Sequence[int]] = ()
    low: float | None = None
    high: float | None = None
    diverging: bool = False
    label: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class Cloud:
    """Points that are coloured by a value.

    Attributes:
        x, y, values: (n,).
        label: of the palette's bar.
    """

    x: Numbers
    y: Numbers
    values: Numbers
    label: str


@dataclass(frozen=True, kw_only=True)
class Across:
    """A line at one value, over the whole panel.

    Attributes:
        x, y: one of the two.
    """

    x: float | None = None
    y: float | None = None
    colour: Colour = Colour.QUIET
    dashed: bool = False
    width: float = 0.9
    label: str = ""


@dataclass(frozen=True, kw_only=True)
class Shade:
    """A stretch between two values, over the whole panel.

    Attributes:
        x, y: one of the two, (low, high).
    """

    x: tuple[float, float] | None = None
    y: tuple[float, float] | None = None
    colour: Colour = Colour.QUIET
    opacity: float = 0.15
    label: str = ""


@dataclass(frozen=True, kw_only=True)
class Note:
    """A text in the panel, at x and y."""

    x: float
    y: float
    text: str
    colour: Colour = Colour.QUIET
    end: bool = False
    """Whether the text ends there, and does not begin."""


Mark: TypeAlias = Line | Band | Dots | Bins | Bars | Cells | Cloud | Across | Shade | Note


@dataclass(frozen=True, kw_only=True)
class Axis:
    """One of a panel's two.

    Attributes:
        label: with the unit, "wind [m/s]".
        limits: (low, high), each None where the data choose.
        logarithmic: or linear.
        ticks: where; chosen by the data if None, and none if empty.
        texts: of these ticks; their numbers where it is empty.
    """

    label: str = ""
    limits: tuple[float | None, float | None] = (None, None)
    logarithmic: bool = False
    ticks: Sequence[float] | None = None
    texts: Sequence[str] = ()


@dataclass(frozen=True, kw_only=True, eq=False)
class Panel:
    """Marks on two axes.

    Attributes:
        marks: from the lowest up.
        equal: whether a unit has the same length on both axes.
        framed: whether axes are drawn.
    """

    marks: Sequence[Mark]
    title: str = ""
    x: Axis = field(default_factory=Axis)
    y: Axis = field(default_factory=Axis)
    equal: bool = False
    framed: bool = True


@dataclass(frozen=True, kw_only=True, eq=False)
class Chart:
    """Panels in rows.

    Attributes:
        rows: of panels; a row may be shorter than another, and its panels are wider then. Panels of
            rows of one length that follow each other are below each other.
        height: of a row [inch].
        widths: shares of the panels of each row; equal where it is empty.
        width: of the whole [inch].
        title: above all.
        legend: whether what has a label is listed below.
    """

    rows: Sequence[Sequence[Panel]]
    height: float = 3.0
    heights: Sequence[float] = ()
    widths: Sequence[float] = ()
    width: float = 9.2
    title: str = ""
    legend: bool = True
