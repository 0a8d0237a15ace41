"""Sentences of FT Technologies' acoustic wind sensors: `$WI,WVP=007.4,212,0*72` behind a logger's stamp.

Source: FT Technologies, FT702LT manual, "WV Polar": speed in m/s, direction in degrees from the sensor's datum, and a
status that is 0 where the reading is good; the checksum is that of NMEA 0183, or "//" for none.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from flagdata.ingest.anemometer.formats.sentences import checksum
from flagdata.ingest.anemometer.formats.telegrams import rows_of, table
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_SENTENCE = re.compile(
    r"\$(?P<body>[A-Z0-9/]{2},WVP=(?P<speed>\d{1,3}(?:\.\d+)?),(?P<away>\d{1,3}),(?P<status>[0-9A-Z])[^*]*)"
    r"(?:\*(?P<sum>[0-9A-Fa-f]{2}|//))?\s*$"
)
_SHARE = 0.5


def matches(lines: Sequence[str]) -> bool:
    """Half of the lines end with such a sentence."""
    filled = [line for line in lines if line.strip()]
    return bool(filled) and sum(_SENTENCE.search(line) is not None for line in filled) > _SHARE * len(filled)


def as_table(source: TextFile) -> TableText | None:
    """Stamp, speed and direction of each sentence; those with a fault or a wrong checksum without values."""
    found, other = rows_of(source, _row)
    if not any(row[0] for row in found):
        found = [row[1:] for row in found]
    names = ["time", "wind speed [m/s]", "wind direction [deg]", "status"][4 - len(found[0]) if found else 0 :]
    return table(source, names, found, kind="ft-sentences", what="sentences of an FT wind sensor", left_out=other)


def _row(line: str) -> list[str] | None:
    match = _SENTENCE.search(line)
    if match is None:
        return None
    stamp = line[: match.start()].strip(" \t,;>|-[]()\"'")
    good = match["status"] == "0"
    if match["sum"] not in (None, "//"):
        good = good and checksum(match["body"]) == int(match["sum"], 16)
    return [stamp, match["speed"] if good else "", match["away"] if good else "", match["status"]]
