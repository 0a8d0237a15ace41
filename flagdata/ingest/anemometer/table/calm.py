"""Words for calm air among the numbers of a speed: a wind of 0 that blows from nowhere.

WMO-No. 8 (part I, chapter 5) and WMO-No. 306 (FM 15, 00000KT) report air below 0.5 m/s, or 1 kn, as calm, speed 0 and
direction 0. A logger that writes "Calm" in place of the number says the same; it says nothing of a missing value.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.text.cells import Cell


def rows(states: Mapping[str, NDArray[np.uint8]]) -> dict[str, NDArray[np.bool_]]:
    """Where a word for calm air stands in a speed: the speed's name and those of its directions → (n,) rows.

    Args:
        states: of each channel, (n,) of `Cell`.
    """
    found: dict[str, NDArray[np.bool_]] = {}
    for name, state in states.items():
        here = state == Cell.CALM
        if here.any():
            directions = (other for other in states if other.startswith(name.replace("speed", "direction")))
            for one in (name, *directions):
                found[one] = here
    return found


def report(name: str, here: NDArray[np.bool_], line: NDArray[np.int64]) -> Finding:
    """What is said of the words for calm air in a speed; `here` and `line` (n,) of all rows."""
    count = int(here.sum())
    what = f"{count} cells of {name} are words for calm air: read as 0 m/s, without a direction"
    return Finding(kind="calm-in-words", severity=Severity.NOTE, count=count, where=f"line {line[here][0]}", what=what)
