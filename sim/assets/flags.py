"""Twelve national flags of proportion 2:3, drawn from their construction sheets.

Where an act names colours only in words or as dyes, the usual sRGB values are taken.

Flat shapes with smooth edges: a pixel takes a colour in proportion to the share of it that a shape
covers.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from flagdata.core.arrays import BoolArray, Float32Array, UInt8Array
from flagdata.errors import UnknownNameError
from sim.assets.colour import decode_values, encode_values, of_hex

_FINE = 4  # sub-samples of a pixel in each direction


@dataclass(frozen=True, kw_only=True, eq=False)
class FlagSheet:
    """A drawing of height 1: x to the right and y downwards from the upper left corner.

    Attributes:
        fine: (rows · 4, columns · 4) index of each sub-sample's colour, painted on in place.
        colours: "#rrggbb" of the indices so far.
    """

    fine: UInt8Array = field(repr=False)
    colours: list[str]

    @classmethod
    def blank(cls, *, rows: int, columns: int, colour: str) -> FlagSheet:
        """Makes a sheet of one colour."""
        return cls(fine=np.zeros((rows * _FINE, columns * _FINE), dtype=np.uint8), colours=[colour])

    @cached_property
    def _grid(self) -> tuple[Float32Array, Float32Array]:
        rows, columns = self.fine.shape
        x, y = (np.arange(columns) + 0.5) / rows, (np.arange(rows) + 0.5) / rows
        return x.astype(np.float32)[None, :], y.astype(np.float32)[:, None]

    def fill(self, colour: str) -> None:
        self.fine[:] = self._index(colour)

    def box(self, x: float, y: float, width: float, height: float, colour: str) -> None:
        px, py = self._grid
        columns, rows = (
            (px[0] >= x) & (px[0] < x + width),
            (py[:, 0] >= y) & (py[:, 0] < y + height),
        )
        self.fine[np.ix_(rows, columns)] = self._index(colour)

    def disc(self, x: float, y: float, radius: float, colour: str) -> None:
        self.where(self.in_disc(x, y, radius), colour)

    def in_disc(self, x: float, y: float, radius: float) -> BoolArray:
        """Masks samples (sub-rows, sub-columns) that a disc covers."""
        px, py = self._grid
        return (px - np.float32(x)) ** 2 + (py - np.float32(y)) ** 2 <= np.float32(radius**2)

    def polygon(self, corners: Sequence[tuple[float, float]], colour: str) -> None:
        """Fills a polygon, by the non-zero winding rule: a pentagram is filled."""
        self.where(self.inside(corners), colour)

    def star(
        self, x: float, y: float, radius: float, colour: str, *, points_to: float = -math.pi / 2
    ) -> None:
        """Fills a five-pointed star on a circle.

        Args:
            points_to: direction of one point from the middle, from +x towards +y, so clockwise as
                seen [rad].
        """
        turns = [points_to + 4 * math.pi / 5 * k for k in range(5)]
        self.polygon([(x + radius * math.cos(t), y + radius * math.sin(t)) for t in turns], colour)

    def turned(self, x: float, y: float, direction: float) -> tuple[Float32Array, Float32Array]:
        """Coordinates of all samples about (x, y): the first in a direction from +x towards +y
        [rad], the second a quarter turn on, clockwise as seen."""
        px, py = self._grid
        dx, dy = px - np.float32(x), py - np.float32(y)
        c, s = np.float32(math.cos(direction)), np.float32(math.sin(direction))
        return np.asarray(dx * c + dy * s, dtype=np.float32), np.asarray(
            dy * c - dx * s, dtype=np.float32
        )

    def inside(self, corners: Sequence[tuple[float, float]]) -> BoolArray:
        """Masks samples (sub-rows, sub-columns) that a polygon covers, by the non-zero winding
        rule."""
        px, py = self._grid
        winding = np.zeros(self.fine.shape, dtype=np.int8)
        for (ax, ay), (bx, by) in zip(corners, [*corners[1:], corners[0]], strict=True):
            if ay == by:
                continue
            rows = (py[:, 0] >= min(ay, by)) & (py[:, 0] < max(ay, by))
            edge = np.float32(ax) + (py[rows] - np.float32(ay)) * np.float32((bx - ax) / (by - ay))
            winding[rows] += np.where(px < edge, np.int8(1 if by > ay else -1), np.int8(0))
        return winding != 0

    def where(self, mask: BoolArray, colour: str) -> None:
        self.fine[mask] = self._index(colour)

    def bytes(self) -> UInt8Array:
        """Averages sub-samples in linear light: (rows, columns, 3) sRGB."""
        rows, columns = (n // _FINE for n in self.fine.shape)
        blocks = self.fine.reshape(rows, _FINE, columns, _FINE)
        mean = np.zeros((rows, columns, 3))
        for index, colour in enumerate(self.colours):
            share = (blocks == index).sum(axis=(1, 3)) / _FINE**2
            mean += share[:, :, None] * decode_values(of_hex(colour))
        return np.rint(encode_values(mean) * 255).astype(np.uint8)

    def _index(self, colour: str) -> int:
        if colour not in self.colours:
            self.colours.append(colour)
        return self.colours.index(colour)


ROWS = 384  # px; every flag here is 2:3
_WHITE = "#ffffff"


@dataclass(frozen=True, kw_only=True)
class NationalFlag:
    """One flag.

    Attributes:
        country: English short name.
        source: the act or standard its sheet is from.
        draw: paints it on a white sheet of height 1, width 3/2.
    """

    country: str
    source: str
    draw: Callable[[FlagSheet], None]


def _chile(sheet: FlagSheet) -> None:
    sheet.box(0, 0.5, 1.5, 0.5, "#d52b1e")
    sheet.box(0, 0, 0.5, 0.5, "#0039a6")
    sheet.star(0.25, 0.25, 0.125, _WHITE)


def _china(sheet: FlagSheet) -> None:
    unit = 1 / 20  # the upper hoist quarter is 15 by 10 units
    red, yellow = "#ee1c25", "#ffff00"
    sheet.fill(red)
    sheet.star(5 * unit, 5 * unit, 3 * unit, yellow)
    for column, row in ((10, 2), (12, 4), (12, 7), (10, 9)):
        towards = math.atan2(5 - row, 5 - column)
        sheet.star(column * unit, row * unit, unit, yellow, points_to=towards)


def _czechia(sheet: FlagSheet) -> None:
    sheet.box(0, 0.5, 1.5, 0.5, "#d7141a")
    sheet.polygon([(0, 0), (0.75, 0.5), (0, 1)], "#11457e")


def _france(sheet: FlagSheet) -> None:
    _upright_thirds(sheet, "#000091", _WHITE, "#e1000f")


def _greece(sheet: FlagSheet) -> None:
    blue, stripe = "#0d5eaf", 1 / 9
    for index in range(0, 9, 2):
        sheet.box(0, index * stripe, 1.5, stripe, blue)
    sheet.box(0, 0, 5 * stripe, 5 * stripe, blue)
    sheet.box(0, 2 * stripe, 5 * stripe, stripe, _WHITE)
    sheet.box(2 * stripe, 0, stripe, 5 * stripe, _WHITE)


def _italy(sheet: FlagSheet) -> None:
    _upright_thirds(sheet, "#008c45", "#f4f5f0", "#cd212a")


def _japan(sheet: FlagSheet) -> None:
    sheet.disc(0.75, 0.5, 0.3, "#bc002d")


def _netherlands(sheet: FlagSheet) -> None:
    sheet.box(0, 0, 1.5, 1 / 3, "#ae1c28")
    sheet.box(0, 2 / 3, 1.5, 1 / 3, "#21468b")


def _south_africa(sheet: FlagSheet) -> None:
    triangle = [(0.0, 0.0), (0.75, 0.5), (0.0, 1.0)]
    sheet.box(0, 0, 1.5, 0.5, "#e03c31")
    sheet.box(0, 0.5, 1.5, 0.5, "#001489")
    for mirrored in (False, True):
        sheet.polygon(_arm(1 / 6, mirrored), _WHITE)
    inner = sheet.inside(triangle)
    sheet.where(inner, "#000000")
    for mirrored in (False, True):
        sheet.where(inner & sheet.inside(_arm(1 / 6, mirrored)), "#ffb81c")
    for mirrored in (False, True):
        sheet.polygon(_arm(1 / 10, mirrored), "#007749")


def _arm(half: float, mirrored: bool) -> list[tuple[float, float]]:
    """Outlines one arm of the pall and its level part: half its width on either side of (0, 0),
    (0.75, 0.5), (1.5, 0.5)."""
    length = math.hypot(0.75, 0.5)
    along, aside = (0.75 / length, 0.5 / length), (0.5 / length * half, -0.75 / length * half)
    corners = [(1.5, 0.5 - half), (1.5, 0.5 + half)]
    for sign in (
        -1,
        1,
    ):  # the arm's lower edge to its start beyond the corner, then its upper edge back
        x, y = sign * aside[0], sign * aside[1]
        reach = (0.5 - sign * half - y) / along[1]
        meets, starts = (x + reach * along[0], y + reach * along[1]), (x - along[0], y - along[1])
        corners += [meets, starts] if sign < 0 else [starts, meets]
    return [(x, 1 - y) for x, y in corners] if mirrored else corners


def _south_korea(sheet: FlagSheet) -> None:
    red, blue, black = "#cd2e3a", "#0047a0", "#000000"
    diagonal = math.atan2(2, 3)
    to_upper_hoist = sheet.turned(
        0.75, 0.5, math.pi + diagonal
    )  # its x axis runs to that corner, y to the right of it
    x, y = to_upper_hoist
    disc = sheet.in_disc(0.75, 0.5, 0.25)
    lower = (y < 0) & ((x - 0.125) ** 2 + y**2 > 0.125**2)
    lower |= (x + 0.125) ** 2 + y**2 <= 0.125**2
    sheet.where(disc, red)
    sheet.where(disc & lower, blue)
    broken = {  # bars from the middle of the flag outwards, corner by corner
        math.pi + diagonal: (False, False, False),
        diagonal: (True, True, True),
        math.pi - diagonal: (False, True, False),
        -diagonal: (True, False, True),
    }
    for direction, bars in broken.items():
        out, across = sheet.turned(0.75, 0.5, direction)
        for index, gap in enumerate(bars):
            middle = (9.5 + 1.5 * index) / 24
            bar = (np.abs(out - middle) <= 0.5 / 24) & (np.abs(across) <= 3 / 24)
            sheet.where(bar & (np.abs(across) >= (0.25 / 24 if gap else 0.0)), black)


def _turkey(sheet: FlagSheet) -> None:
    red = "#e30a17"
    sheet.fill(red)
    sheet.disc(0.5, 0.5, 0.25, _WHITE)
    sheet.disc(0.5 + 1 / 16, 0.5, 0.2, red)
    inner_edge = 0.5 + 1 / 16 - 0.2
    sheet.star(inner_edge + 1 / 3 + 0.125, 0.5, 0.125, _WHITE, points_to=math.pi)


def _ukraine(sheet: FlagSheet) -> None:
    sheet.fill("#0057b7")
    sheet.box(0, 0.5, 1.5, 0.5, "#ffd700")


def _upright_thirds(sheet: FlagSheet, hoist: str, middle: str, fly: str) -> None:
    sheet.fill(middle)
    sheet.box(0, 0, 0.5, 1, hoist)
    sheet.box(1, 0, 0.5, 1, fly)


FLAGS: Mapping[str, NationalFlag] = {
    "chile": NationalFlag(
        country="Chile",
        draw=_chile,
        source="Decreto Supremo 1534 of 1967: canton a square of half the height, star of half its "
        "side",
    ),
    "china": NationalFlag(
        country="China", source="GB 12982-2004, annex: stars on a grid of 15 × 10", draw=_china
    ),
    "czechia": NationalFlag(country="Czechia", source="Act 3/1993 Coll., annex 3", draw=_czechia),
    "france": NationalFlag(
        country="France",
        source="Constitution, article 2; colours of the State's graphic charter of 2020",
        draw=_france,
    ),
    "greece": NationalFlag(
        country="Greece",
        source="Law 851/1978, article 1: nine stripes, canton of five",
        draw=_greece,
    ),
    "italy": NationalFlag(
        country="Italy",
        source="Constitution, article 12; colours of the D.P.C.M. of 14 April 2006",
        draw=_italy,
    ),
    "japan": NationalFlag(
        country="Japan",
        source="Act on National Flag and Anthem, No. 127 of 1999: disc of three fifths of the "
        "height",
        draw=_japan,
    ),
    "netherlands": NationalFlag(
        country="Netherlands", source="Royal Decree of 19 February 1937", draw=_netherlands
    ),
    "south-africa": NationalFlag(
        country="South Africa",
        source="Proclamation R. 59 of 20 April 1994: pall of a fifth of the height, borders of a "
        "fifteenth",
        draw=_south_africa,
    ),
    "south-korea": NationalFlag(
        country="South Korea",
        source="National Flag Act, enforcement decree, annex: disc of half the height, trigrams on "
        "the diagonals",
        draw=_south_korea,
    ),
    "turkey": NationalFlag(
        country="Türkiye",
        draw=_turkey,
        source="Law 2893 of 22 September 1983, annexed drawing, without the hoist's band",
    ),
    "ukraine": NationalFlag(country="Ukraine", source="DSTU 4512:2006", draw=_ukraine),
}


class _National:
    """Flags as a kind of texture."""

    def draw(self, rng: np.random.Generator) -> str:
        names = sorted(FLAGS)
        return names[int(rng.integers(len(names)))]

    def image(self, member: str) -> UInt8Array:
        if member not in FLAGS:
            raise UnknownNameError.of("flag", member, FLAGS)
        return _paint_flag(member)


@functools.cache
def _paint_flag(name: str) -> UInt8Array:
    sheet = FlagSheet.blank(rows=ROWS, columns=ROWS * 3 // 2, colour=_WHITE)
    FLAGS[name].draw(sheet)
    image = sheet.bytes()
    image.setflags(write=False)
    return image


NATIONAL = _National()
