"""NOAA's Integrated Surface Database in its full form: lines of fixed columns, as in the archive's files by station.

    0123725030147322023070106004+40783-073883FM-15+0003KLGA V0202301N00461220001CN0160931N9+02441+01281101521ADD…

Source: NOAA, Federal Climate Complex Data Documentation for Integrated Surface Data, control and mandatory section, by
positions counted from 1: 5 to 15 station (USAF and WBAN), 16 to 27 date and time in UTC, 61 to 63 direction (deg from
true north, 999 missing), 64 its quality, 65 type (C: calm, V: variable), 66 to 69 speed (0.1 m/s, 9999 missing), 70 its
quality, 88 to 92 air temperature (0.1 °C, +9999 missing), 93 its quality. Suspect and erroneous values are left out.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from flagdata.ingest.anemometer.restating import global_hourly
from flagdata.ingest.anemometer.restating.restate import rows_of, table
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_LINE = re.compile(
    r"\d{4}(?P<usaf>[0-9A-Z]\d{5})(?P<wban>\d{5})(?P<date>(?:19|20)\d{6})(?P<clock>[0-2]\d[0-5]\d).[+-]\d{5}[+-]\d{6}.{19}"
    r"(?P<wind>\d{3}\w\w\d{4}\w).{17}(?P<warm>[+-]\d{4}\w)"
)
_LEAST = 0.8


def matches(lines: Sequence[str]) -> bool:
    """Most lines have the fixed columns of a report."""
    filled = [line for line in lines if line.strip()]
    return len(filled) > 0 and sum(_LINE.match(line) is not None for line in filled) >= _LEAST * len(filled)


def as_table(source: TextFile) -> TableText | None:
    """Time, station, wind and temperature of each report."""
    found, other = rows_of(source, _cells)
    what = "NOAA's Integrated Surface Database"
    return table(source, global_hourly.NAMES, found, kind="isd", what=what, left_out=other)


def _cells(line: str) -> list[str] | None:
    match = _LINE.match(line)
    if match is None:
        return None
    wind, warm, date, clock = match["wind"], match["warm"], match["date"], match["clock"]
    time = f"{date[:4]}-{date[4:6]}-{date[6:]}T{clock[:2]}:{clock[2:]}:00Z"
    away, speed = global_hourly.wind(wind[:3], wind[3], wind[4], wind[5:9], wind[9])
    return [time, match["usaf"] + match["wban"], speed, away, global_hourly.tenths(f"{warm[:5]},{warm[5]}")]
