"""Columns of a wind whose numbers are no speeds: counts and volts before a calibration, and Beaufort's classes."""

from __future__ import annotations

import re
from collections.abc import Sequence

from flagdata.ingest.anemometer.text.kinds import cell_kind
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.words.headings import understand, words_of
from flagdata.ingest.anemometer.words.wind_words import ALONG_BEAM

_CLASSES = frozenset({"bft", "beaufort", "bf"})
_MILLIS = re.compile(r"(?<![^\W_])m[VA](?![^\W_])")
"""Millivolts and milliamperes, whose capital cuts them in two words."""
_COUNTED = frozenset(
    {
        "hz", "count", "counts", "cnt", "cnts", "pulse", "pulses", "tick", "ticks", "clicks", "rotations", "rpm",
        "revolutions", "freq", "frequency", "adc", "v", "mv", "volt", "volts", "voltage", "ma",
    }
)  # fmt: skip
"""Words of what an anemometer gives before its calibration."""
_SHOWN = 5
"""Columns of one kind that are told by name."""
_ELECTRIC = frozenset({"v", "mv", "volt", "volts", "voltage", "ma"})
"""Those that a battery has as well."""


def beaufort(layout: Layout) -> tuple[str, ...]:
    """Headings of columns that hold the wind by Beaufort's scale: numbers of classes, not speeds."""
    return tuple(name for name in layout.names if set(words_of(name)) & _CLASSES)


def counts(layout: Layout) -> tuple[int, ...]:
    """Columns of what an anemometer counts or gives, its frequency, pulses or volts, which are no speeds yet."""
    found: list[int] = []
    beside_vane = any(understand(name).channel == "wind_direction" for name in layout.names)
    for index, name in enumerate(layout.names):
        words = set(words_of(name))
        alone = beside_vane and words <= (_COUNTED | {"s", "per", "num", "number"}) - _ELECTRIC
        of_wind = alone or words & {"wind", "anemometer", "anem", "cup", "ws", "windspeed"}
        if of_wind and is_count(layout, index):
            found.append(index)
    return tuple(found)


def is_count(layout: Layout, index: int) -> bool:
    """Whether a column's heading says that it holds counts, a frequency or volts."""
    name = layout.names[index]
    if set(words_of(name)) & (_COUNTED - {"v"}) or _MILLIS.search(name):
        return True
    return understand(name, layout.units[index]).strange.lower() in _COUNTED


def of_no_mean(layout: Layout) -> str:
    """Why columns with the heading of a wind's speed are not it: words, or gusts and statistics; "" for no such."""
    words: list[str] = []
    others: list[str] = []
    beams: list[str] = []
    for index, name in enumerate(layout.names):
        heading = understand(name, layout.units[index])
        kinds = {cell_kind(cell) for cell in layout.column(index)} - {"missing"}
        if set(words_of(name)) & ALONG_BEAM and "number" in kinds:
            beams.append(name)
        elif heading.quantity == "wind_speed" and heading.spread and "number" in kinds:
            others.append(name)
        elif heading.quantity == "wind_speed" and kinds == {"text"}:
            words.append(name)
    return "; ".join([
        *([f"{_listed(words)} no numbers in the first rows"] if words else []),
        *([f"{_listed(beams[:_SHOWN])} the wind along a beam, of which winds are retrieved"] if beams else []),
        *([f"{_listed(others)} gusts, extremes or another statistic by the heading"] if others else []),
    ])  # fmt: skip


def _listed(names: Sequence[str]) -> str:
    shown = ", ".join(map(repr, names))
    return f"columns {shown} hold" if len(names) > 1 else f"column {shown} holds"
