"""Stations of a table whose rows of one stamp lie at different places: a column of names tells them apart."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flagdata.ingest.anemometer.text.cells import numbers
from flagdata.ingest.anemometer.text.kinds import cell_kind
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.winds.own_motion import LATITUDE, LONGITUDE
from flagdata.ingest.anemometer.words.headings import understand, words_of

_LATITUDE = LATITUDE | {"latitud", "breite", "breitengrad", "latitudine", "breddegrad"}
_LONGITUDE = LONGITUDE | {"longitud", "länge", "längengrad", "longitudine", "lengdegrad"}
_APART = 0.02
"""Degrees, about 2 km, that no platform moves within a stamp."""
_SHARE = 0.9
"""Of the stamps with several rows those at whose rows the places must lie apart."""


def column(layout: Layout, *, time: Sequence[int], stamps: Sequence[str]) -> tuple[int, tuple[str, ...]] | None:
    """The first column of words that has one for each place, and the words; `None` where rows are of one platform.

    Args:
        time: columns that are the time.
        stamps: of the rows.
    """
    latitude, longitude = _coordinate(layout, _LATITUDE), _coordinate(layout, _LONGITUDE)
    if latitude is None or longitude is None or not _apart_at_once(latitude, longitude, stamps):
        return None
    places = [*zip(latitude.tolist(), longitude.tolist(), strict=True)]
    for index, name in enumerate(layout.names):
        cells = layout.column(index)
        kinds = sorted(set(cells))
        if index in time or understand(name).quantity or any(cell_kind(kind) != "text" for kind in kinds):
            continue
        if len(kinds) == len(set(places)) == len(set(zip(cells, places, strict=True))):
            return index, tuple(kinds)
    return None


def _coordinate(layout: Layout, words: frozenset[str]) -> NDArray[np.float64] | None:
    """The numbers of the one column that is headed as a coordinate; `None` where there is none or one lacks."""
    found = [at for at, name in enumerate(layout.names) if set(words_of(name)) & words]
    if len(found) != 1:
        return None
    value = numbers(layout.column(found[0]), decimal=layout.decimal).value
    return value if bool(np.isfinite(value).all()) else None


def _apart_at_once(latitude: NDArray[np.float64], longitude: NDArray[np.float64], stamps: Sequence[str]) -> bool:
    """Whether the rows of nearly every stamp that has several lie apart."""
    rows: dict[str, list[int]] = defaultdict(list)
    for at, stamp in enumerate(stamps):
        rows[stamp].append(at)
    several = [own for own in rows.values() if len(own) > 1]
    apart = [max(float(np.ptp(latitude[own])), float(np.ptp(longitude[own]))) > _APART for own in several]
    return bool(several) and sum(apart) >= _SHARE * len(several)
