"""Telegrams of Thies' ultrasonic anemometers, framed by STX and ETX, behind a logger's stamp or bare.

    <STX>02.4 213*cc<ETX>                                   1, VD: speed, direction
    <STX>02.4 213 +21.5 00*cc<ETX>                          2, VDT: and temperature, status
    <STX>002.4 213 +21.5 M 00*cc<ETX>                       3, V4DT: and the unit, of K, N, M and S
    <STX>02.4 00.3 213 007 +21.5 +00.1 00*cc<ETX>           5: each with its standard deviation behind it

Source: Thies Clima, Ultrasonic Anemometer 2D, manual 021537/06/10, 7.4.3 and 11, and Technical Manual, 6.2: the
checksum is the exclusive or of what stands between STX and "*"; F stands in place of digits where there is no value.
The unit of speeds is a setting (command OS), which only telegram 3 states. Written by the manuals; no real log was at
hand.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from flagdata.ingest.anemometer.formats.sentences import checksum
from flagdata.ingest.anemometer.formats.telegrams import rows_of, table
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_SPEED, _ANGLE, _TEMPERATURE = r"(?:\d{2,3}\.\d|F{2,3}\.F)", r"(?:\d{3}|FFF)", r"[+-]?(?:\d{2,3}\.\d|F{2,3}\.F)"
_TELEGRAM = re.compile(
    r"(?:\x02|<STX>)?\s?(?P<body>"
    rf"(?P<speed>{_SPEED}) (?:(?P<deviation>{_SPEED}) )?(?P<away>{_ANGLE})(?: {_ANGLE})?"
    rf"(?: (?P<temperature>{_TEMPERATURE})(?: {_TEMPERATURE})?(?: (?P<unit>[KNMS]))? [0-9A-F]{{2}})?"
    r")\*(?P<sum>[0-9A-F]{2})\s*(?:\x03|<ETX>)?\s*$"
)
_UNITS = {"K": "km/h", "N": "kn", "M": "m/s", "S": "mph"}
_SHARE = 0.8
_LEAST = 3


def matches(lines: Sequence[str]) -> bool:
    """Most lines end with a telegram whose checksum is right."""
    filled = [line for line in lines if line.strip("\x02\x03 \t\r\n")]
    return sum(_telegram(line) is not None for line in filled) >= max(_LEAST, _SHARE * len(filled))


def as_table(source: TextFile) -> TableText | None:
    """Stamp, speed, its deviation, direction and temperature of each telegram; a line with a wrong checksum is none."""
    units = {found["unit"] for line in source.head() if (found := _telegram(line)) is not None}
    unit = units.pop() if len(units) == 1 else None

    def row(line: str) -> list[str] | None:
        found = _telegram(line)
        if found is None or found["unit"] != unit:
            return None
        stamp = line[: found.start()].strip(" \t,;>|-[]()\"'")
        return [stamp, *(_number(found[name]) for name in ("speed", "deviation", "away", "temperature"))]

    rows, other = rows_of(source, row)
    bracket = f" [{_UNITS[unit]}]" if unit else ""
    names = (
        "time",
        f"wind speed{bracket}",
        f"wind speed std{bracket}",
        "wind direction [deg]",
        "sonic temperature [degC]",
    )
    filled = [place for place in range(len(names)) if any(cells[place] for cells in rows)]
    return table(
        source, [names[place] for place in filled], ([cells[place] for place in filled] for cells in rows),
        kind="thies-telegrams", what="telegrams of a Thies ultrasonic anemometer", left_out=other,
    )  # fmt: skip


def _telegram(line: str) -> re.Match[str] | None:
    found = _TELEGRAM.search(line.rstrip("\r\n"))
    return found if found is not None and checksum(found["body"]) == int(found["sum"], 16) else None


def _number(text: str | None) -> str:
    return "" if text is None or "F" in text else text
