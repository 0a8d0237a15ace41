"""The picture of how a film was made fit: the flag found, and the square that is judged."""

from __future__ import annotations

import cv2
import numpy as np
from PIL import Image, ImageDraw

from flagdata.pages.page_pictures import still
from measure.film.conditioned_film import ConditionedFilm

_BLUE, _RUST = "#2b6f8f", "#c4622d"
_CROP, _BEYOND = "#e3b505", "#d8d8d8"
_SHOWN = 640
"""Longer side [px] of the picture of a film's steps."""


def steps(film: ConditionedFilm) -> str | None:
    """Draws the reference frame with all moving cloths, numbered, the outline of what is not
    frozen, and the square that is judged; None before the film was read."""
    detection, reference = film.found, film.reference
    if detection is None or reference is None:
        return None
    height, width = reference.shape
    square = detection.square
    left, top = min(0, square.x), min(0, square.y)
    right, bottom = max(width, square.x + square.side), max(height, square.y + square.side)
    scale = _SHOWN / max(right - left, bottom - top)
    picture = Image.new(
        "RGB", (round((right - left) * scale), round((bottom - top) * scale)), _BEYOND
    )
    frame = Image.fromarray(reference).resize(
        (round(width * scale), round(height * scale)), Image.Resampling.HAMMING
    )
    picture.paste(frame.convert("RGB"), (round(-left * scale), round(-top * scale)))
    pen = ImageDraw.Draw(picture)

    def at(x: float, y: float) -> tuple[float, float]:
        return (x - left) * scale, (y - top) * scale

    for number, region in enumerate(detection.regions, start=1):
        colour = _RUST if number == detection.chosen + 1 else _BLUE
        lines, _ = cv2.findContours(
            region.mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE
        )
        for line in lines:
            points = [at(*vertex) for vertex in (line.reshape(-1, 2) / detection.scale).tolist()]
            pen.line([*points, points[0]], fill=colour, width=2)
        corner = at(region.box[0] / detection.scale, region.box[1] / detection.scale)
        pen.text((corner[0] + 3, corner[1] + 3), str(number), fill=colour, font_size=22)
    pen.rectangle(
        (*at(square.x, square.y), *at(square.x + square.side - 1, square.y + square.side - 1)),
        outline=_CROP,
        width=2,
    )
    return still(picture)
