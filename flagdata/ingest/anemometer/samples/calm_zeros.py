"""Directions of 0 that stand for calm air: those of the lowest speeds of a log, and of no other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.reading import Reading

_FEW, _OTHERS = 4, 20
"""Rows with a direction of 0, and others with a direction, from which the rule is taken."""


def without(reading: Reading) -> Reading:
    """The reading without a direction where all of its zeros stand at speeds below every other.

    A wind from the north blows at any speed; a station that writes 0 for calm air (WMO-No. 306, code table 0877) has it
    at the lowest speeds alone.
    """
    speed, towards = reading.channels.get("wind_speed"), reading.channels.get("wind_direction")
    if speed is None or towards is None:
        return reading
    known = np.isfinite(speed) & np.isfinite(towards)
    zero, others = known & (towards == 0), known & (towards != 0)
    if int(zero.sum()) < _FEW or int(others.sum()) < _OTHERS or float(speed[zero].max()) >= float(speed[others].min()):
        return reading
    text = (
        f"wind_direction is 0 in {int(zero.sum())} rows, those of speeds up to {float(speed[zero].max()):.2g} m/s and "
        "no others: taken as calm air, without a direction"
    )
    finding = Finding(
        kind="calm-without-direction", severity=Severity.WARNING, count=int(zero.sum()),
        where=f"line {reading.line[zero][0]}", what=text,
    )  # fmt: skip
    channels = {**reading.channels, "wind_direction": np.where(zero, np.nan, towards)}
    kept = tuple(own for own in reading.findings if own.kind != "north-or-calm")  # they are not taken as north
    return replace(reading, channels=channels, findings=kept).with_findings((finding,))
