"""Temperature, humidity and pressure beside an anemometer, each where one column is surely it."""

from __future__ import annotations

import numpy as np

from flagdata.ingest.anemometer.winds.found import Column, Found, Wind
from flagdata.ingest.anemometer.words.headings import fits, words_of

WEATHER = ("air_temperature", "sonic_temperature", "relative_humidity", "air_pressure")
_PRESSURES = (("hPa", 800.0, 1100.0), ("kPa", 50.0, 110.0), ("inHg", 20.0, 33.0), ("Pa", 50_000.0, 110_000.0))
"""Ranges of the air pressure by unit [in it]; they do not overlap.

From 500 to 800 it may be in hPa on a mountain or in mmHg."""


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
    known = value[value >= 0]  # none is below zero, in K too: -9999 stands for no value
    median = float(np.median(known)) if len(known) else np.nan
    guess: str | None = None
    if heading.unit is None and channel == "relative_humidity" and 1.5 < float(np.nanmax(value)) <= 115:
        guess = "%"
    if heading.unit is None and channel == "air_pressure":
        guess = next((name for name, low, high in _PRESSURES if low <= median <= high), None)
    if heading.unit is None and channel == "sonic_temperature" and 230 <= median <= 330:
        guess = "K"
    if guess is None:
        remark = f"column {heading.name!r} looks like {channel}, but its unit is not stated: left out"
        if remark not in found.remarks:
            found.remarks.append(remark)
        return None
    return Column(index=index, unit=guess, told=f"in {guess} by its values, about {median:.4g}")
