"""Columns called WV: wind vanes beside anemometers of their numbers, or velocities of the wind."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from flagdata.ingest.anemometer.words.headings import Heading, words_of

_VANE = "wv"


def vanes(headings: Sequence[Heading], values: Mapping[int, NDArray[np.float64]]) -> frozenset[int]:
    """The columns called WV, without a unit, that are vanes and no velocities.

    One whose numbers go beyond every wind, and not beyond a turn, is a vane; then so are those that are called alike,
    though theirs do not. So is one beside another speed of its number (WV3 beside WS3) that has no direction yet.

    Args:
        headings: of all columns.
        values: (n,) numbers by the index of their column, NaN where there is none.
    """
    called = [at for at in values if _is_called(headings[at])]
    if any(_turns(values[at]) for at in called):
        return frozenset(called)
    others = [at for at in values if at not in called and headings[at].channel]
    speeds = {number(headings[at]) for at in others if headings[at].channel == "wind_speed"}
    directions = {number(headings[at]) for at in others if headings[at].channel.startswith("wind_direction")}
    return frozenset(at for at in called if number(headings[at]) in speeds - directions)


def number(heading: Heading) -> str:
    """The number that tells instruments of one table apart, as a heading has it; "" for none or several."""
    found = [word for word in heading.label if word.isdigit()]
    return found[0] if len(found) == 1 else ""


def _is_called(heading: Heading) -> bool:
    return heading.channel == "wind_speed" and heading.unit is None and _VANE in words_of(heading.name)


def _turns(value: NDArray[np.float64]) -> bool:
    """Whether numbers go beyond every wind, and not beyond a turn."""
    known = value[np.isfinite(value)]
    return len(known) > 0 and float(known.min()) >= 0 and 100 < float(known.max()) <= 360
