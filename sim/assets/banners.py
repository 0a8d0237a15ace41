"""Prints as on national flags: bands, crosses, discs, cantons, in colours and with a contrast that
are drawn.

They are no flag's likeness. They vary how much of a flag's motion its look shows: where its edges
run and how far its parts differ, from one plain colour, white among them, to black on white.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from flagdata.core.arrays import FloatArray
from sim.assets.colour import hue
from sim.assets.flags import ROWS, FlagSheet
from sim.assets.seeded import Seeded

_WIDTH = 1.5
"""Of the sheet, its height 1; a cloth of another shape stretches it."""
_COLOURS = 4
_CONTRAST = (-0.15, 1.15)
"""Drawn within, then cut to 0 and 1: one banner in nine has no contrast at all, and one in nine the
full one."""
_WHITE, _DARK = 0.4, 0.15
"""Shares of the dyes that are white or nearly so, and black or nearly so; the others have a hue."""
_GRAY = np.array([0.299, 0.587, 0.114])
"""Of encoded red, green and blue (ITU-R BT.601): cameras' films are read in gray."""
_APART = 0.3
"""Least difference of a part's dye and the field's, of 1 between black and white; a contrast below
1 lessens it."""
_PLAIN = 0.15
"""Share of the banners that have no parts; all other layouts are equally likely."""


@dataclass(frozen=True, kw_only=True)
class Banner:
    """One print.

    Attributes:
        layout: a key of `LAYOUTS`.
        colours: (4, 3) sRGB in [0, 1], encoded: the field's, then those of the parts.
        contrast: of the parts with the field: 0 where they have its colour, 1 where they have a dye
            of their own.
    """

    layout: str
    colours: FloatArray
    contrast: float


def drawn(rng: np.random.Generator) -> Banner:
    """Draws a layout, a contrast, and colours of that contrast."""
    layouts = sorted(LAYOUTS.keys() - {"plain"})
    index = int(rng.integers(len(layouts)))
    layout = "plain" if rng.random() < _PLAIN else layouts[index]
    contrast = float(np.clip(rng.uniform(*_CONTRAST), 0.0, 1.0))
    field = _dye(rng)
    dyes = np.array([field, *(_dye_beside(field, rng) for _ in range(_COLOURS - 1))])
    return Banner(layout=layout, colours=dyes[0] + contrast * (dyes - dyes[0]), contrast=contrast)


def _dye(rng: np.random.Generator) -> FloatArray:
    """Draws (3,) white, black or bright: encoded values."""
    share = rng.random()
    if share < _WHITE:
        return hue(rng, (0.0, 1.0), (0.0, 0.06), (0.88, 1.0))
    if share < _WHITE + _DARK:
        return hue(rng, (0.0, 1.0), (0.0, 0.5), (0.03, 0.25))
    return hue(rng, (0.0, 1.0), (0.6, 1.0), (0.35, 1.0))


def _dye_beside(field: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Draws (3,) a dye that differs from the field's in gray, as flags' tinctures do."""
    dye = _dye(rng)
    while abs((dye - field) @ _GRAY) < _APART:
        dye = _dye(rng)
    return dye


def paint_layout(layout: str, colours: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Paints a layout of drawn proportions: (384, 576, 3) encoded values in [0, 1].

    Args:
        colours: (4, 3) encoded values.
    """
    field, *parts = [_hex(colour) for colour in colours]
    sheet = FlagSheet.blank(rows=ROWS, columns=round(ROWS * _WIDTH), colour=field)
    LAYOUTS[layout](sheet, parts, rng)
    return sheet.bytes() / 255


def _hex(colour: FloatArray) -> str:
    return "#" + "".join(f"{round(255 * value):02x}" for value in colour)


_Layout = Callable[[FlagSheet, Sequence[str], np.random.Generator], None]
"""Paints parts of these colours on a sheet that has the field's."""


def _plain(sheet: FlagSheet, parts: Sequence[str], rng: np.random.Generator) -> None:
    """Leaves the field as it is."""


def _vertical(sheet: FlagSheet, parts: Sequence[str], rng: np.random.Generator) -> None:
    for index, (start, end) in enumerate(_bands(rng)):
        if index:
            sheet.box(start * _WIDTH, 0.0, (end - start) * _WIDTH, 1.0, parts[index - 1])


def _horizontal(sheet: FlagSheet, parts: Sequence[str], rng: np.random.Generator) -> None:
    for index, (start, end) in enumerate(_bands(rng)):
        if index:
            sheet.box(0.0, start, _WIDTH, end - start, parts[index - 1])


def _bands(rng: np.random.Generator) -> list[tuple[float, float]]:
    """Draws where two or three bands begin and end, as shares of their sum; half of them are
    equally wide."""
    count = int(rng.integers(2, 4))
    widths = np.ones(count) if rng.random() < 0.5 else rng.uniform(0.5, 2.0, count)
    edges = np.concatenate([[0.0], np.cumsum(widths) / widths.sum()]).tolist()
    return list(itertools.pairwise(edges))


def _cross(sheet: FlagSheet, parts: Sequence[str], rng: np.random.Generator) -> None:
    _paint_cross(sheet, parts, rng, x=_WIDTH / 2)


def _nordic(sheet: FlagSheet, parts: Sequence[str], rng: np.random.Generator) -> None:
    _paint_cross(sheet, parts, rng, x=rng.uniform(0.45, 0.6))


def _paint_cross(
    sheet: FlagSheet, parts: Sequence[str], rng: np.random.Generator, *, x: float
) -> None:
    """Paints an upright cross about (x, 1/2), with a border or without."""
    arm, border = rng.uniform(0.1, 0.3), rng.uniform(0.0, 0.08) * (rng.random() < 0.5)
    for width, colour in ((arm + 2 * border, parts[1]), (arm, parts[0])):
        sheet.box(x - width / 2, 0.0, width, 1.0, colour)
        sheet.box(0.0, 0.5 - width / 2, _WIDTH, width, colour)


def _saltire(sheet: FlagSheet, parts: Sequence[str], rng: np.random.Generator) -> None:
    arm, border = rng.uniform(0.1, 0.25), rng.uniform(0.0, 0.06) * (rng.random() < 0.5)
    diagonal = math.atan2(1.0, _WIDTH)
    aside = [sheet.turned(_WIDTH / 2, 0.5, sign * diagonal)[1] for sign in (-1, 1)]
    for width, colour in ((arm + 2 * border, parts[1]), (arm, parts[0])):
        for across in aside:
            sheet.where(np.abs(across) <= width / 2, colour)


def _disc(sheet: FlagSheet, parts: Sequence[str], rng: np.random.Generator) -> None:
    if rng.random() < 0.3:
        sheet.box(0.0, rng.uniform(0.4, 0.6), _WIDTH, 1.0, parts[1])
    sheet.disc(rng.uniform(0.55, 0.8), 0.5, rng.uniform(0.15, 0.38), parts[0])


def _canton(sheet: FlagSheet, parts: Sequence[str], rng: np.random.Generator) -> None:
    width, height = rng.uniform(0.4, 0.8), rng.uniform(0.4, 0.6)
    if rng.random() < 0.5:
        sheet.box(0.0, 0.5, _WIDTH, 0.5, parts[1])
    sheet.box(0.0, 0.0, width, height, parts[0])
    if rng.random() < 0.6:
        sheet.star(width / 2, height / 2, rng.uniform(0.25, 0.45) * min(width, height), parts[2])


def _paint_stripes(sheet: FlagSheet, parts: Sequence[str], rng: np.random.Generator) -> None:
    """Paints stripes of two colours, and a canton that ends where a stripe does, some of them with
    rows of stars."""
    stripes = int(rng.integers(3, 8)) * 2 - 1
    for index in range(0, stripes, 2):
        sheet.box(0.0, index / stripes, _WIDTH, 1 / stripes, parts[0])
    height, width = (stripes // 2 + 1) / stripes, rng.uniform(0.45, 0.75)
    sheet.box(0.0, 0.0, width, height, parts[1])
    if rng.random() < 0.6:
        rows, columns = (int(count) for count in rng.integers(2, 8, 2))
        radius = 0.4 * min(height / rows, width / columns)
        for row in range(rows):
            for column in range(columns):
                sheet.star(
                    (column + 0.5) * width / columns, (row + 0.5) * height / rows, radius, parts[2]
                )


def _triangle(sheet: FlagSheet, parts: Sequence[str], rng: np.random.Generator) -> None:
    for index, (start, end) in enumerate(_bands(rng)):
        if index:
            sheet.box(0.0, start, _WIDTH, end - start, parts[index - 1])
    sheet.polygon([(0.0, 0.0), (rng.uniform(0.35, 0.9), 0.5), (0.0, 1.0)], parts[2])


def _emblem(sheet: FlagSheet, parts: Sequence[str], rng: np.random.Generator) -> None:
    """Paints a star in a ring above a row of small marks, as arms and lettering look from afar."""
    x, y, radius = rng.uniform(0.6, 0.9), rng.uniform(0.42, 0.55), rng.uniform(0.2, 0.34)
    sheet.disc(x, y, radius, parts[0])
    sheet.disc(x, y, rng.uniform(0.7, 0.92) * radius, parts[1])
    sheet.star(
        x, y, rng.uniform(0.4, 0.65) * radius, parts[2], points_to=rng.uniform(0.0, math.tau)
    )
    marks, length = int(rng.integers(3, 10)), rng.uniform(0.7, 1.1)
    top, tall = y + radius + 0.02, rng.uniform(0.04, 0.09)
    for index in range(marks):
        start = x - length / 2 + index * length / marks
        sheet.box(start, top, rng.uniform(0.3, 0.8) * length / marks, tall, parts[0])


def _quarters(sheet: FlagSheet, parts: Sequence[str], rng: np.random.Generator) -> None:
    """Paints the upper quarter at the fly and the lower one at the hoist, half of them in one
    colour."""
    x, y = rng.uniform(0.4, 0.6) * _WIDTH, rng.uniform(0.45, 0.55)
    sheet.box(x, 0.0, _WIDTH - x, y, parts[0])
    sheet.box(0.0, y, x, 1.0 - y, parts[1 if rng.random() < 0.5 else 0])


LAYOUTS: Mapping[str, _Layout] = {
    "canton": _canton,
    "cross": _cross,
    "disc": _disc,
    "emblem": _emblem,
    "horizontal-bands": _horizontal,
    "nordic-cross": _nordic,
    "plain": _plain,
    "quarters": _quarters,
    "saltire": _saltire,
    "stripes-with-canton": _paint_stripes,
    "triangle": _triangle,
    "vertical-bands": _vertical,
}
"""By name; each draws its own proportions."""


def _banner(rng: np.random.Generator) -> FloatArray:
    banner = drawn(rng)
    return paint_layout(banner.layout, banner.colours, rng)


BANNER = Seeded(kind="banner", paint=_banner)
