"""The drawing of `flagdata.pages.graph` as a PNG picture, for programs that show no SVG."""

from __future__ import annotations

import io
import unicodedata
from collections.abc import Collection, Sequence

from PIL import Image, ImageDraw, ImageFont

from flagdata.core.printable import printable
from flagdata.pages import graph
from flagdata.pages.graph import Box, Point

_SCALE = 2  # pixels of the picture a pixel of the drawing
_LIKE = str.maketrans({"×": "x", "–": "-", "—": "-", "ß": "ss", "ø": "o", "æ": "ae"})
_STEPS = 24  # straight pieces of a curve


def png(boxes: Sequence[Box], edges: Collection[tuple[str, str]]) -> bytes:
    """Draws boxes and lines as a PNG; arguments as of `graph.svg`. Pillow's own font has ASCII
    alone: see `_ascii`."""
    drawn = graph.layout(boxes, edges)
    picture = Image.new(
        "RGB", (round(_SCALE * drawn.size[0]), round(_SCALE * drawn.size[1])), graph.PAPER
    )
    pen = ImageDraw.Draw(picture)
    for way in drawn.ways:
        for curve in graph.curves(way):
            pen.line([_scale_point(point) for point in _points(*curve)], fill=graph.RULE, width=3)
        for column, passed in way[1:-1]:
            begin = graph.left(column)
            pen.line(
                [_scale_point((begin, passed.y)), _scale_point((begin + graph.WIDTH, passed.y))],
                fill=graph.RULE,
                width=3,
            )
    for box in boxes:
        _box(pen, box, *drawn.at[box.key])
    content = io.BytesIO()
    picture.save(content, "PNG", optimize=True)
    return content.getvalue()


def _box(pen: ImageDraw.ImageDraw, box: Box, column: int, box_place: graph.Place) -> None:
    x, y = graph.left(column), box_place.y - box_place.height / 2
    edge, width = (graph.MARKED, 5) if box.marked else (graph.RULE, 2)
    corners = [_scale_point((x, y)), _scale_point((x + graph.WIDTH, y + box_place.height))]
    pen.rounded_rectangle(corners, radius=6 * _SCALE, fill=graph.PAPER, outline=edge, width=width)
    colour = graph.COLOURS.get(box.kind or "", graph.QUIET)
    pen.rectangle(
        [_scale_point((x + 5, y + 8)), _scale_point((x + 8, y + box_place.height - 8))], fill=colour
    )
    _write(
        pen, (x + 14, y + 20), graph.cut(box.title, graph.TITLE_CELLS), size=13, colour=graph.INK
    )
    for number, text in enumerate(box.lines):
        below = (x + 14, y + 36 + graph.NEXT * number)
        _write(pen, below, graph.cut(text, graph.LINE_CELLS), size=11, colour=graph.QUIET)


def _write(pen: ImageDraw.ImageDraw, at: Point, text: str, *, size: int, colour: str) -> None:
    font = ImageFont.load_default(size * _SCALE)
    pen.text(_scale_point(at), _ascii(printable(text)), fill=colour, font=font, anchor="ls")


def _ascii(text: str) -> str:
    """Converts a text to ASCII: letters without their accents, and "?" for what has nothing like
    it."""
    plain = unicodedata.normalize("NFKD", text.translate(_LIKE))
    return (
        "".join(letter for letter in plain if not unicodedata.combining(letter))
        .encode("ascii", "replace")
        .decode()
    )


def _points(begin: Point, control_1: Point, control_2: Point, end: Point) -> list[Point]:
    """Points on a cubic Bézier curve."""
    points = []
    for step in range(_STEPS + 1):
        t = step / _STEPS
        weights = (1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3
        x, y = (
            sum(
                w * p[axis]
                for w, p in zip(weights, (begin, control_1, control_2, end), strict=True)
            )
            for axis in (0, 1)
        )
        points.append((x, y))
    return points


def _scale_point(point: Point) -> Point:
    return _SCALE * point[0], _SCALE * point[1]
