"""Whether rows that are read as the same are written as the same, in the cells that are not read as well."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flagdata.ingest.anemometer.text.source import TextFile


def written_otherwise(source: TextFile, earlier: NDArray[np.int64], later: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(n,) whether the lines `later` hold other text than the lines `earlier`, blanks at their ends apart.

    The file is read once more. A line that it does not have shows nothing, so that its pair is no different.
    """
    numbers = np.unique(np.concatenate((earlier, later)))
    found = np.zeros(len(numbers), dtype=np.int64)
    known = np.zeros(len(numbers), dtype=bool)
    at = 0
    for first, lines in source.blocks():
        stop = int(np.searchsorted(numbers, first + len(lines)))
        for place in range(at, stop):
            found[place] = hash(lines[int(numbers[place]) - first].strip())
            known[place] = True
        at = stop
        if at == len(numbers):
            break
    one, two = np.searchsorted(numbers, earlier), np.searchsorted(numbers, later)
    return (found[one] != found[two]) & known[one] & known[two]
