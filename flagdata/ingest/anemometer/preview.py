"""Rows of a log beside what was read of them, so that its user can judge how the file was understood."""

from __future__ import annotations

import numpy as np

from flagdata.ingest.anemometer.reading import Reading
from flagdata.ingest.anemometer.text.source import TextFile
from flagdata.schema import SampleFlag
from flagdata.signals import LogRow, Series

_SPEEDS = ("wind_speed", "apparent_wind_speed", "theoretical_wind_speed", "wind_speed_estimate")
_COMPONENTS = ("wind_x", "wind_y", "wind_z")
_DIRECTIONS = ("wind_direction", "apparent_wind_direction", "theoretical_wind_direction")
_FIRST = 2


def shown_rows(source: TextFile, reading: Reading) -> tuple[LogRow, ...]:
    """The first two rows with a speed, the slowest, the fastest and the last, in the order of the file.

    Args:
        source: the text that was read.
        reading: its rows, put in order and judged; at least one.
    """
    speed = _speed(reading)
    known = np.flatnonzero(np.isfinite(speed))
    first = known if len(known) else np.arange(len(reading.time))
    chosen = {*map(int, first[:_FIRST]), len(reading.time) - 1}
    if len(known):
        chosen |= {int(np.nanargmin(speed)), int(np.nanargmax(speed))}
    texts = _lines(source, {int(reading.line[row]) for row in chosen})
    return tuple(
        LogRow(
            line=int(reading.line[row]),
            text=texts.get(int(reading.line[row]), ""),
            time=int(reading.time[row]),
            wind=wind_of(reading, row),
        )
        for row in sorted(chosen, key=lambda row: int(reading.line[row]))
    )


def wind_of(reading: Reading, row: int) -> str:
    """The wind of a row for people: speed in m/s and direction in degrees, or components, and its flags."""
    speeds = [reading.channels[name][row] for name in _SPEEDS if name in reading.channels]
    parts = [f"{speed:.2f} m/s" if np.isfinite(speed) else "no speed," for speed in speeds]
    if not parts:
        parts = [
            f"{name.removeprefix('wind_')} {reading.channels[name][row]:+.2f}"
            for name in _COMPONENTS
            if name in reading.channels
        ]
        parts = [f"{', '.join(parts)} m/s"] if parts else []
    directions = [name for name in _DIRECTIONS if name in reading.channels]
    if directions and np.isfinite(reading.channels[directions[0]][row]):
        parts.append(f"from {np.rad2deg(reading.channels[directions[0]][row]):.0f}°")
    flags = [flag.name.lower().replace("_", " ") for flag in SampleFlag if flag.name and flag & int(reading.flags[row])]
    return " ".join(parts) + (f" ({', '.join(flags)})" if flags else "")


def _speed(reading: Reading) -> Series:
    for name in _SPEEDS:
        if name in reading.channels:
            return reading.channels[name]
    parts = [reading.channels[name] for name in _COMPONENTS if name in reading.channels]
    return np.sqrt(sum(part**2 for part in parts)) if parts else np.full(len(reading.time), np.nan)


def _lines(source: TextFile, wanted: set[int]) -> dict[int, str]:
    found: dict[int, str] = {}
    for first, lines in source.blocks():
        found |= {number: lines[number - first] for number in wanted if first <= number < first + len(lines)}
        if len(found) == len(wanted):
            break
    return found
