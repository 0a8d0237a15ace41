"""Speeds below what the instrument can measure, written "<0.3": somewhere between 0 and that.

A cup that does not turn reads 0, and so such a cell is read; it is flagged DEAD_ZONE, and the number becomes the
sensor's threshold where its recipe states none, so that averages over the ground truth's window know what a 0 may hide.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flagdata.findings import Finding, Severity
from flagdata.signals import Sensor


def report(name: str, here: NDArray[np.bool_], limit: float, line: NDArray[np.int64]) -> Finding:
    """What is said of a speed's cells below its threshold.

    Args:
        name: of the channel.
        here: (n,) which rows hold such a cell.
        limit: the largest threshold that was written [m/s].
        line: (n,) of all rows.
    """
    count = int(here.sum())
    what = f"{count} of {len(here)} cells of {name} say no more than that it was below {limit:.3g} m/s: read as 0"
    return Finding(
        kind="below-threshold", severity=Severity.WARNING, count=count, value=limit, where=f"line {line[here][0]}",
        what=what, fix="averages with them are too low by the threshold at most; their uncertainty holds it",
    )  # fmt: skip


def known(sensor: Sensor, limit: float) -> Sensor:
    """The sensor with the threshold [m/s] that its log wrote, where its recipe states none."""
    return sensor if sensor.threshold is not None or not limit else replace(sensor, threshold=limit)
