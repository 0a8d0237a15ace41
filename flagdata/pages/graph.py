"""A graph of boxes in columns, drawn as SVG: the lineage of an artifact, what it was made from on
its left.

Boxes of a column are ordered by where their neighbours are (the barycentre method of Sugiyama,
Tagawa and Toda, 1981); a line that passes a column gets a place in it, so that it crosses no box.
Colours are attributes, which a page's style overrides by the classes. It is no chart of
`flagdata.answer.charts`: its boxes are links, their places are counted in pixels of text, and a
lake is browsed where matplotlib is not installed.
"""

from __future__ import annotations

import html
import unicodedata
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from flagdata.core.printable import printable

WIDTH = 184  # px of a box
_GAP_X, _GAP_Y = 56, 14
_PASS = 8  # px that a passing line takes
_MARGIN = 12
_FIRST, NEXT = 32, 14  # px of a box's height that its title takes, and each line
_SWEEPS = 4
TITLE_CELLS, LINE_CELLS = 19, 27  # of a monospaced guess at a proportional font: what fits a box
INK, QUIET, RULE, PAPER, MARKED = "#1c2326", "#56646b", "#9aa7ad", "#ffffff", "#1f6286"
COLOURS = {
    "camera": "#b5541c",
    "wind": "#1f6fa8",
    "recording": "#3b7d6b",
    "clip": "#7aa69a",
    "meshes": "#7b5ea7",
    "markers": "#a0568c",
    "model": "#8a7a2d",
    "network": "#555fb0",
    "measurement": "#a8402c",
}
"""Colour of a box's edge, by kind."""


@dataclass(frozen=True, kw_only=True)
class Box:
    """One node.

    Attributes:
        key: names it in the edges.
        column: place from the left, any integers.
        kind: chooses its colour; `None` for an unknown one.
        title, lines: texts in it, plain, cut where they do not fit.
        about: shown when pointed at.
        link: where a click leads.
        marked: drawn as the one that the graph is about.
    """

    key: str
    column: int
    kind: str | None
    title: str
    lines: Sequence[str]
    about: str
    link: str | None = None
    marked: bool = False


@dataclass(kw_only=True)
class Place:
    """A box, or the passage of a line, in a column."""

    key: str
    height: int
    y: float = 0.0


@dataclass(frozen=True, kw_only=True)
class GraphLayout:
    """Where everything is.

    Attributes:
        size: width and height [px].
        at: key → column, and place in it, of each box.
        ways: the columns and places that each line leads through.
    """

    size: tuple[float, float]
    at: Mapping[str, tuple[int, Place]]
    ways: Sequence[Sequence[tuple[int, Place]]]


def layout(boxes: Sequence[Box], edges: Collection[tuple[str, str]]) -> GraphLayout:
    """Places for boxes and lines; arguments as of `svg`."""
    tall = _FIRST + NEXT * max(len(box.lines) for box in boxes)
    columns, ways = _place_boxes(boxes, edges, tall)
    height = max(_height_of_column(column) for column in columns)
    _order(columns, ways)
    for column in columns:
        y = _MARGIN + (height - _height_of_column(column)) / 2
        for box_place in column:
            box_place.y = y + box_place.height / 2
            y += box_place.height + _GAP_Y
    at = {
        box_place.key: (number, box_place)
        for number, column in enumerate(columns)
        for box_place in column
    }
    return GraphLayout(
        size=(
            2 * _MARGIN + len(columns) * WIDTH + (len(columns) - 1) * _GAP_X,
            2 * _MARGIN + height,
        ),
        at=at,
        ways=[[at[key] for key in way] for way in ways],
    )


def svg(boxes: Sequence[Box], edges: Collection[tuple[str, str]], *, title: str) -> str:
    """Draws boxes and lines as an SVG document, which can also be a part of a page.

    Args:
        edges: (from, to) by key, each from a column to one further right; others are left out.
        title: what it shows, for those who do not see it.
    """
    drawn = layout(boxes, edges)
    width, height = drawn.size
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" class="graph" role="img" width="{width:.0f}" '
        f'height="{height:.0f}" viewBox="0 0 {width:.0f} {height:.0f}" '
        f'font-family="system-ui, sans-serif" font-size="13">'
    )
    parts = [
        head,
        f"<title>{_text(title)}</title>",
        f'<rect class="paper" width="100%" height="100%" fill="{PAPER}"/>',
        *map(_line, drawn.ways),
        *(_box(box, *drawn.at[box.key]) for box in boxes),
        "</svg>",
    ]
    return "\n".join(parts) + "\n"


def _place_boxes(
    boxes: Sequence[Box], edges: Collection[tuple[str, str]], tall: int
) -> tuple[list[list[Place]], list[tuple[str, ...]]]:
    """Places the boxes of each column, and lists the keys that each line leads through."""
    numbers = {
        column: number for number, column in enumerate(sorted({box.column for box in boxes}))
    }
    columns: list[list[Place]] = [[] for _ in numbers]
    where = {box.key: numbers[box.column] for box in boxes}
    for box in boxes:
        columns[where[box.key]].append(Place(key=box.key, height=tall))
    ways: list[tuple[str, ...]] = []
    for begin, end in edges:
        first, last = where[begin], where[end]
        if first >= last:
            continue
        between = [f"{begin} {end} {number}" for number in range(first + 1, last)]
        for number, key in enumerate(between, first + 1):
            columns[number].append(Place(key=key, height=_PASS))
        ways.append((begin, *between, end))
    return columns, ways


def _order(columns: Sequence[list[Place]], ways: Sequence[Sequence[str]]) -> None:
    """Sort each column by the mean place of its neighbours, from left to right and back, a few
    times."""
    before: dict[str, list[str]] = {}
    behind: dict[str, list[str]] = {}
    for way in ways:
        for nearer, farther in pairwise(way):
            before.setdefault(farther, []).append(nearer)
            behind.setdefault(nearer, []).append(farther)
    for sweep in range(_SWEEPS):
        forth = sweep % 2 == 0
        neighbours = before if forth else behind
        for column in columns if forth else reversed(columns):
            rank = {
                box_place.key: number / max(1, len(c) - 1)
                for c in columns
                for number, box_place in enumerate(c)
            }
            column.sort(
                key=lambda box_place: _mean(
                    [rank[key] for key in neighbours.get(box_place.key, [box_place.key])]
                )
            )


def _mean(values: Sequence[float]) -> float:
    return sum(values) / len(values)


def _height_of_column(column: Sequence[Place]) -> float:
    return sum(box_place.height for box_place in column) + _GAP_Y * (len(column) - 1)


def left(column: int) -> float:
    """Computes where the boxes of a column begin [px]."""
    return _MARGIN + column * (WIDTH + _GAP_X)


Point = tuple[float, float]


def curves(way: Sequence[tuple[int, Place]]) -> list[tuple[Point, Point, Point, Point]]:
    """Computes a line as cubic curves, each from one column to the next; where it passes a column
    it goes on straight."""
    (number, box_place), *following = way
    x, y = left(number) + WIDTH, box_place.y
    pieces = []
    for number, box_place in following:
        end = left(number)
        middle = (x + end) / 2
        pieces.append(((x, y), (middle, y), (middle, box_place.y), (end, box_place.y)))
        x, y = end + WIDTH, box_place.y
    return pieces


def _line(way: Sequence[tuple[int, Place]]) -> str:
    path: list[str] = []
    for (x, y), control_1, control_2, (end, below) in curves(way):
        path.append(f"{'H' if path else 'M'}{x:.0f}" + ("" if path else f" {y:.1f}"))
        path.append(
            f"C{control_1[0]:.1f} {control_1[1]:.1f} {control_2[0]:.1f} {control_2[1]:.1f} "
            f"{end:.0f} {below:.1f}"
        )
    return (
        f'<path class="edge" d="{" ".join(path)}" fill="none" stroke="{RULE}" stroke-width="1.5"/>'
    )


def _box(box: Box, column: int, box_place: Place) -> str:
    x, y = left(column), box_place.y - box_place.height / 2
    colour = COLOURS.get(box.kind or "", QUIET)
    frame = (MARKED, 2.5) if box.marked else (RULE, 1)
    title = f'<text class="title" x="{x + 14:.0f}" y="{y + 20:.1f}" font-weight="600" fill="{INK}">'
    line = f'<text class="line" x="{x + 14:.0f}" y="{{:.1f}}" font-size="11" fill="{QUIET}">'
    texts = [f"{title}{_text(cut(box.title, TITLE_CELLS))}</text>"]
    texts += [
        f"{line.format(y + 36 + NEXT * number)}{_text(cut(text, LINE_CELLS))}</text>"
        for number, text in enumerate(box.lines)
    ]
    drawn = (
        f"<title>{_text(box.about)}</title>"
        f'<rect class="box{" marked" if box.marked else ""}" x="{x:.0f}" y="{y:.1f}" '
        f'width="{WIDTH}" '
        f'height="{box_place.height}" rx="6" fill="{PAPER}" stroke="{frame[0]}" '
        f'stroke-width="{frame[1]}"/>'
        f'<rect x="{x + 5:.0f}" y="{y + 8:.1f}" width="3" height="{box_place.height - 16}" '
        f'rx="1.5" fill="{colour}"/>' + "".join(texts)
    )
    return (
        f"<g>{drawn}</g>" if box.link is None else f'<a href="{html.escape(box.link)}">{drawn}</a>'
    )


def _text(text: str) -> str:
    """Escapes text of XML, with characters that a page cannot hold."""
    return html.escape(printable(text))


def cut(text: str, cells: int) -> str:
    """Cuts a text to as much of it as fits a width [cells of a digit], with an ellipsis."""
    widths = [2 if unicodedata.east_asian_width(letter) in "WF" else 1 for letter in text]
    if sum(widths) <= cells:
        return text
    taken, used = 0, 1
    for width in widths:
        if used + width > cells:
            break
        taken, used = taken + 1, used + width
    return text[:taken] + "…"
