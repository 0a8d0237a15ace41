"""Sentences that come in bursts, one time sentence in each, with long silence between: whose burst a line is of.

A burst of n sentences takes n × 82 characters at 4800 baud at most. Where marks are much farther apart than that, and
each kind of wind comes once between two of them, a sentence is of its burst's mark, and not of an instant between.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from flagdata.signals import Instants
from flagdata.timebase import NANOSECONDS

SENTENCE = 82 * 10 * NANOSECONDS // 4800
"""Time that the longest sentence takes at 4800 baud [ns]."""
_SILENT = 10
"""Marks are this many times as far apart as a burst may last."""
_LEAST = 10 * NANOSECONDS
"""Distance of marks [ns] below which lines come as a stream."""
_MARKS, _SHARE = 3, 0.9
"""Marks from which bursts are recognised, and the share of times between them with each wind once at most."""
_ORDER = 1_000_000
"""What gives the order of the winds of one burst [ns]: they have one mark."""


@dataclass
class Bursts:
    """What shows where bursts begin: the kind of a stream's first sentence, and the lines with that kind."""

    first: str = ""
    starts: list[int] = field(default_factory=list)
    begins: int = 0
    ends: int = 0

    def sentence(self, kind: str, line: int) -> None:
        """A sentence, in the order of the lines."""
        if not self.first:
            self.first, self.begins = kind, line
        self.ends = line
        if kind == self.first:
            self.starts.append(line)

    def placed(
        self, lines: NDArray[np.int64], winds: Sequence[Hashable], at: NDArray[np.int64], marks: Instants
    ) -> Instants | None:
        """Instants of lines by the marks of their bursts; `None` where the stream shows no bursts.

        Args:
            lines: (n,) of the winds.
            winds: (n,) which wind each line holds.
            at: (m,) lines of the marks.
            marks: (m,) their instants, rising.
        """
        if len(marks) < _MARKS or not _apart(lines, winds, at, marks):
            return None
        edges = self._edges(at)
        # Of the burst before the first mark only the end may be there.
        known = np.concatenate(([marks[0] - int(np.median(np.diff(marks)))], marks)).astype(np.int64)
        burst = np.searchsorted(edges, lines, side="right")
        each = np.unique(np.stack([burst, _numbered(winds)]), axis=1).shape[1] == len(lines)
        if not each or at[0] - self.begins > 2 * np.median(np.diff(at)):
            return None
        time = known[burst]
        first = np.searchsorted(burst, burst)
        return time + (np.arange(len(lines)) - first) * _ORDER

    def _edges(self, at: NDArray[np.int64]) -> NDArray[np.int64]:
        """(m,) the first line of each burst: that of its mark, or the first after the last mark that begins a burst.

        The stream is taken to begin with a whole burst, unless it ends with as many lines behind its last mark as
        there are between marks: then a burst begins with its mark.
        """
        between = int(np.median(np.diff(at)))
        if self.begins == at[0] or self.ends - int(at[-1]) >= between - 1:
            return at
        starts = np.array(self.starts, dtype=np.int64)
        after = np.concatenate(([self.begins], at[:-1] + 1))
        place = np.searchsorted(starts, after)
        found = np.where(place < len(starts), starts[np.minimum(place, len(starts) - 1)], at)
        return np.where(found <= at, found, at)


def _numbered(winds: Sequence[Hashable]) -> NDArray[np.int64]:
    kinds = {kind: number for number, kind in enumerate(dict.fromkeys(winds))}
    return np.array([kinds[kind] for kind in winds], dtype=np.int64)


def _apart(lines: NDArray[np.int64], winds: Sequence[Hashable], at: NDArray[np.int64], marks: Instants) -> bool:
    """Whether marks are far apart for the lines between them, and each kind of wind comes once between them."""
    spacing, between = float(np.median(np.diff(marks))), float(np.median(np.diff(at)))
    if spacing < max(_LEAST, _SILENT * between * SENTENCE):
        return False
    interval = np.searchsorted(at, lines)
    pairs = np.stack([interval, _numbered(winds)])
    _, counts = np.unique(pairs, axis=1, return_counts=True)
    return float((counts == 1).mean()) >= _SHARE
