"""Which texts a drafted recipe takes for no value: codes that no wind has, and words among its numbers."""

from __future__ import annotations

import numpy as np

from flagdata import compass
from flagdata.ingest.anemometer.text.cells import numbers
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.winds.codes import NO_ANGLE, words
from flagdata.ingest.anemometer.winds.found import COMPONENTS, Wind
from flagdata.ingest.anemometer.winds.unitcheck import FASTEST
from flagdata.units import unit as unit_of

CODES = (-999.0, -9999.0, -99999.0, -6999.0, -7999.0, -99.0, -99.9, -999.9)
"""Codes for "no value" that are no wind, temperature, humidity, pressure or angle."""


def of(layout: Layout, wind: Wind | None) -> list[str]:
    """The texts, as a recipe's [file] missing lists them."""
    return [*(f"{code:g}" for code in _numbers(layout, wind)), *_words(layout, wind)]


def _near_a_thousand(layout: Layout, wind: Wind | None) -> bool:
    """Whether a pressure of the table may be as large as a code for "no direction"."""
    column = wind.columns.get("air_pressure") if wind is not None else None
    if column is None:
        return False
    value = numbers(layout.column(column.index), decimal=layout.decimal).value
    return bool(np.nanmedian(np.abs(value)) > 700)


def _words(layout: Layout, wind: Wind | None) -> list[str]:
    """The few words for no value in the columns of a wind; those for calm air are none (see `calm`)."""
    found: dict[str, None] = {}
    columns = wind.columns.values() if wind is not None else ()
    calm = compass.CALM if any(column.unit in compass.BY_UNIT for column in columns) else frozenset[str]()
    for column in columns:
        if column.unit not in compass.BY_UNIT:
            # What stands among points of the compass for calm air may stand in the speed of that row as well.
            found.update(dict.fromkeys(sorted({cell.lower() for cell in layout.column(column.index)} & calm)))
        if column.unit in compass.BY_UNIT or layout.suffixes[column.index]:
            continue
        cells = layout.column(column.index)
        found.update(dict.fromkeys(word.lower() for word in words(cells, numbers(cells, decimal=layout.decimal))))
    return [word for word in found if word not in compass.STILL]


def _numbers(layout: Layout, wind: Wind | None) -> list[float]:
    """Codes for "no value": those that no quantity here can have, and those above every other value of the wind."""
    codes = list(CODES)
    for channel, column in (wind.columns if wind is not None else {}).items():
        value = numbers(layout.column(column.index), decimal=layout.decimal).value
        known = value[np.isfinite(value)]
        if channel in COMPONENTS and column.unit is not None:
            # What no component can be in m/s, -99, it can be in cm/s.
            codes = [code for code in codes if abs(code) * unit_of(column.unit).scale > FASTEST]
        if channel.endswith("direction") and bool(np.any((known < 0) & ~np.isin(known, CODES))):
            codes = [code for code in codes if code < -180]
        if channel.endswith("direction") and not _near_a_thousand(layout, wind):
            codes.extend(code for code in NO_ANGLE if code in known)
        for code in (99.0, 99.9, 99.99, 999.0, 999.9, 999.99, 9999.0, 9999.9, 99999.0, 999999.0):
            others = known[known != code]
            if channel == "wind_speed" and code in known and len(others) and 2 * others.max() < code:
                codes.append(code)
    return list(dict.fromkeys(codes))
