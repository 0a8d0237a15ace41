"""National flags, drawn from their construction sheets."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import UnknownNameError
from sim.assets.drawing import Sheet

ROWS = 512  # px; every flag here is 2:3


@dataclass(frozen=True, kw_only=True)
class NationalFlag:
    """One flag.

    Attributes:
        country: English short name.
        source: the act or standard its sheet is from.
        draw: paints it on a sheet of height 1, width 3/2.
    """

    country: str
    source: str
    draw: Callable[[Sheet], None]


def _japan(sheet: Sheet) -> None:
    sheet.fill("#ffffff")
    sheet.disc(0.75, 0.5, 0.3, "#bc002d")


FLAGS: Mapping[str, NationalFlag] = {
    "japan": NationalFlag(country="Japan", source="Act on National Flag and Anthem, No. 127 of 1999", draw=_japan),
}


class _National:
    """Flags as a kind of texture."""

    def draw(self, rng: np.random.Generator) -> str:
        names = sorted(FLAGS)
        return names[int(rng.integers(len(names)))]

    def image(self, member: str) -> NDArray[np.uint8]:
        if member not in FLAGS:
            raise UnknownNameError.of("flag", member, FLAGS)
        return _painted(member)


@functools.cache
def _painted(name: str) -> NDArray[np.uint8]:
    sheet = Sheet.blank(rows=ROWS, columns=ROWS * 3 // 2)
    FLAGS[name].draw(sheet)
    return sheet.bytes()


NATIONAL = _National()
