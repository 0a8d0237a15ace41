"""The time of a satellite receiver in a log whose lines have the stamps of a computer: whether the two agree."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.formats.sentences import ChecksumError, split, time_mark
from flagdata.timebase import NANOSECONDS

_OFF = 60.0
"""Median difference that no delay of a serial line explains [s]."""
_SEEN = 2.0
"""Median difference that is worth a word [s]: clips are paired with winds by the second."""
_KINDS = ("ZDA,", "RMC,")
"""Sentences that state a date."""


def mark(text: str) -> int | None:
    """The instant [UTC ns] that a sentence states; `None` for one without a date, and for a damaged one."""
    if not text[3:7].startswith(_KINDS):
        return None
    try:
        sentence = split(text)
    except ChecksumError:
        return None
    said = None if sentence is None else time_mark(sentence)
    if said is None or said.date is None:
        return None
    day = np.datetime64("-".join(f"{part:02d}" for part in said.date), "D").astype(np.int64)
    return int(day) * 86_400 * NANOSECONDS + said.clock


def report(stamps: Mapping[int, int], marks: Sequence[tuple[int, int]]) -> tuple[Finding, ...]:
    """The finding about a receiver whose time is another than that of the stamps; none where they agree.

    Args:
        stamps: instants of the lines [UTC ns].
        marks: (line, instant that the receiver states there [UTC ns]).
    """
    off = [(at, (said - stamps[at]) / NANOSECONDS) for at, said in marks if at in stamps]
    median = float(np.median([seconds for _, seconds in off])) if off else 0.0
    if abs(median) < _SEEN:
        return ()
    size = f"{abs(median) / 3600:.3g} h" if abs(median) >= 3600 else f"{abs(median):.1f} s"
    side = "behind" if median < 0 else "before"
    return (
        Finding(
            kind="receiver-clock-off", severity=Severity.WARNING if abs(median) >= _OFF else Severity.NOTE,
            count=len(off), value=median, where=f"line {off[0][0]}",
            what=f"the satellite receiver's time (RMC, ZDA) is {size} {side} the stamps of the lines, which are taken",
            fix="check the zone of the stamps and the computer's clock; for the receiver's time, take the stamps out",
        ),
    )  # fmt: skip
