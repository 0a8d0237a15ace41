"""Temperature, humidity and pressure beside an anemometer, each where one column is surely it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flagdata.ingest.anemometer.winds.found import Column, Found, Wind
from flagdata.ingest.anemometer.words.headings import Heading, fits, words_of

WEATHER = ("air_temperature", "sonic_temperature", "relative_humidity", "air_pressure")
_PRESSURES = (("hPa", 800.0, 1100.0), ("kPa", 50.0, 110.0), ("inHg", 20.0, 33.0), ("Pa", 50_000.0, 110_000.0))
"""Ranges of the air pressure by unit [in it]; they do not overlap.

From 500 to 800 it may be in hPa on a mountain or in mmHg."""
_PRESSED = 0.9
"""Of the numbers of a column, the share within a range that makes them air pressures in its unit."""
_RELATIVE, _MOIST = frozenset({"rh", "relative", "rel", "relhum"}), 30.0
"""Words of a humidity in %, and the largest specific or absolute humidity [g/kg, g/m³], which may be meant else."""
_RAW = frozenset({"v", "mv", "a", "ma", "ohm", "kohm", "counts", "count", "hz", "adc", "raw"})
"""Units of what a sensor gives before its calibration."""


def with_weather(found: Found, wind: Wind, *, many: bool) -> Wind:
    """The anemometer with temperature, humidity and pressure, each where one column is surely it."""
    columns = dict(wind.columns)
    first = next(iter(columns.values())).index
    for channel in WEATHER:
        candidates = found.of(channel)
        if channel == "sonic_temperature" and "wind_x" not in columns:
            candidates = [i for i in candidates if found.headings[i].sure]
        if channel == "sonic_temperature" and "wind_x" in columns:
            candidates += [i for i in found.of("air_temperature") if words_of(found.layout.names[i])[:1] == ["t"]]
        if channel == "air_temperature" and "wind_x" in columns:
            candidates = [i for i in candidates if words_of(found.layout.names[i])[:1] != ["t"]]
        known = [(i, column) for i in candidates if (column := _weather(found, i, channel)) is not None]
        exact = [item for item in known if found.key(item[0]) == found.key(first)]
        plain = [item for item in known if not found.headings[item[0]].label and found.headings[item[0]].height is None]
        chosen = exact if len(exact) == 1 else plain if len(plain) == 1 else known if len(known) == 1 else []
        if chosen:
            columns[channel] = chosen[0][1]
        elif len(known) > 1 and not many:
            names = ", ".join(repr(found.layout.names[i]) for i, _ in known)
            found.remarks.append(f"which of {names} is {channel} is not told: left out")
    return Wind(
        label=wind.label, height=wind.height, columns=columns, sure=wind.sure, site=wind.site, of_earth=wind.of_earth
    )


def _weather(found: Found, index: int, channel: str) -> Column | None:
    heading, value = found.headings[index], found.values[index]
    if fits(channel, heading.unit):
        return Column(index=index, unit=heading.unit, told=f"in {heading.unit} by its heading")
    raw = heading.strange.lower() in _RAW
    guess = None if heading.unit is not None or raw else _guessed(heading, value, channel)
    if guess is None:
        of_unit = f"but is in {heading.strange!r}" if raw else "but its unit is not stated"
        remark = f"column {heading.name!r} looks like {channel}, {of_unit}: left out"
        if remark not in found.remarks:
            found.remarks.append(remark)
        return None
    return Column(index=index, unit=guess, told=f"in {guess} by its values, about {_median(value):.4g}")


def _guessed(heading: Heading, value: NDArray[np.float64], channel: str) -> str | None:
    """The unit of a quantity whose heading states none, by its numbers; `None` where they do not tell."""
    median = _median(value)
    if channel == "relative_humidity":
        least = 1.5 if _RELATIVE & set(words_of(heading.name)) else _MOIST
        return "%" if least < float(np.nanmax(value)) <= 115 else None
    if channel == "air_pressure":
        known = value[value > 0]  # neither a failed sensor's 0 nor -9999
        within = ((name, float(((known >= low) & (known <= high)).mean())) for name, low, high in _PRESSURES)
        return next((name for name, share in within if len(known) and share >= _PRESSED), None)
    return "K" if channel == "sonic_temperature" and 230 <= median <= 330 else None


def _median(value: NDArray[np.float64]) -> float:
    """That of numbers from zero on: none is below, in K too, and -9999 stands for no value."""
    known = value[value >= 0]
    return float(np.median(known)) if len(known) else np.nan
