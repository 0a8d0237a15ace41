"""Two logs of one wind that are whole half-hours apart: the mark of a zone that is wrong for one of
them.

Both are averaged over bins, and each bin is taken relative to the one before it: weather that
changes over hours, which any two logs share at any lag, is gone. At every half-hour of lag the
correlation r over the n bins that both cover has the score z = atanh(r) √(n - 3) (Fisher 1921),
standard normal where the logs have nothing to do with each other. A lag is reported where its score
is beyond what chance explains and well beyond that of the stamps as they are.
"""

from __future__ import annotations

import math

import numpy as np

from flagdata.core.arrays import FloatArray, IntArray
from flagdata.core.findings import Finding
from flagdata.ingest.anemometer.instants.log_clock import span
from flagdata.record.averaging import average
from flagdata.record.signals import WindSeries
from flagdata.timebase import NANOSECONDS

STEP = 1800
"""Zones differ by whole multiples of it, but for a few of 15 min [s]."""
FARTHEST = 14 * 3600
"""Greatest lag that two zones explain [s]."""
BINS = (60, 300, 600, 1800)
"""Lengths of a bin [s]; the shortest that holds two rows of both logs is taken."""
FEWEST = 30
"""Bins that both logs must cover."""
SCORE = 6.0
"""Score of a lag that is reported: chance reaches it in one of 10⁹ lags."""
LEAD = 4.0
"""By which it must exceed the score at no lag."""


def hours_off(series: WindSeries, neighbour: WindSeries, *, name: str) -> Finding | None:
    """Reports that `series` fits `neighbour`, called `name`, at another half-hour than its stamps
    say; `None` if not.

    Logs without wind over ground, or that share less than `FEWEST` bins, are not compared.
    """
    if "wind_speed" not in series.channels or "wind_speed" not in neighbour.channels:
        return None
    if min(len(series), len(neighbour)) < FEWEST:
        return None
    spacing = max(float(np.median(np.diff(log.time))) for log in (series, neighbour)) / NANOSECONDS
    length = next(
        (bins for bins in BINS if bins >= 2 * spacing), BINS[-1] if spacing <= BINS[-1] else None
    )
    if length is None:
        return None
    mine, theirs = _changes(series, length), _changes(neighbour, length)
    scores = {
        lag: _score(*mine, *theirs, lag // length) for lag in range(-FARTHEST, FARTHEST + 1, STEP)
    }
    best = max(scores, key=lambda lag: scores[lag][0])
    score, correlation, n = scores[best]
    if best == 0 or score < SCORE or score < scores[0][0] + LEAD:
        return None
    when = f"{span(abs(best) * NANOSECONDS)} {'later' if best > 0 else 'earlier'}"
    return Finding.of(
        "hours-off",
        f"its wind is that of {name} if its stamps were {when} (correlation {correlation:.2f} over "
        f"{n} means of "
        f"{length} s; as stamped {scores[0][1]:.2f}): off by hours, as by a wrong zone",
        value=float(best),
        count=n,
        fix="check --zone of both logs: a logger may stay on winter time, or keep UTC; then ingest "
        "the wrong one again",
    )


def _changes(series: WindSeries, length: int) -> tuple[IntArray, FloatArray]:
    """Numbers of bins since 1970 and the change of the logarithm of their mean speed from the bin
    before."""
    means = average(series, float(length))
    number = (means.time // (length * NANOSECONDS)).astype(np.int64)
    change = np.diff(np.log(np.maximum(means.speed, 0.1)))
    follows = np.diff(number) == 1
    return number[1:][follows], change[follows]


def _score(
    mine: IntArray, first: FloatArray, theirs: IntArray, second: FloatArray, lag: int
) -> tuple[float, float, int]:
    """Computes score and correlation with `mine` moved later by `lag` bins, and the number of bins;
    0 where they are few."""
    common, rows, rows_there = np.intersect1d(
        mine + lag, theirs, assume_unique=True, return_indices=True
    )
    if len(common) < FEWEST:
        return 0.0, 0.0, len(common)
    first, second = first[rows] - first[rows].mean(), second[rows_there] - second[rows_there].mean()
    power = float(np.sqrt((first @ first) * (second @ second)))
    r = min(max(float(first @ second) / power, -0.999999), 0.999999) if power else 0.0
    return math.atanh(r) * math.sqrt(len(common) - 3), r, len(common)
