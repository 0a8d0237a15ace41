"""Raw data of pywws, the program for stations of Fine Offset, whose rows no line names.

2010-04-01 00:05:00,5,47,20.8,47,9.9,1012.9,0.31,0.68,12,114.3,0

The time in UTC, minutes since the row before, humidity and temperature indoors, humidity and temperature outdoors,
absolute pressure in hPa, mean wind and gust in m/s, direction in sixteenths of a turn from north, rain in mm since the
station was started, status (pywws, documentation of `pywws.storage`, class `RawStore`); of stations with a solar sensor
illuminance and UV index behind them. Humidity, temperature and wind are empty where the outdoor sensor was not heard.
Calibrated data (`CalibStore`) have the relative pressure behind the absolute one, and directions with decimals.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from flagdata.ingest.anemometer.restating.restate import rows_of, table
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_STAMP = re.compile(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d")
_CALIBRATED = {12: False, 13: True, 14: False, 15: True}
"""By the number of columns, whether the relative pressure is among them."""
_NAMES = ("time [UTC]", "relative humidity [%]", "air temperature [degC]", "air pressure [hPa]",
          "wind speed [m/s]", "gust [m/s]", "wind direction [deg]")  # fmt: skip
_LEAST, _SHARE = 5, 0.95
_POINT = 360 / 16


def matches(lines: Sequence[str]) -> bool:
    """Whether nearly all lines are such rows."""
    filled = [line for line in lines if line.strip()]
    rows = [row for line in filled if (row := _row(line)) is not None]
    return len(rows) >= max(_LEAST, _SHARE * len(filled)) and any(row[4] and float(row[4]) > 0 for row in rows)


def as_table(source: TextFile) -> TableText | None:
    """The outdoor quantities of all rows; `None` where there is none."""
    rows, other = rows_of(source, _row)
    what = "raw data of pywws, told by its columns' numbers: times in UTC, speeds in m/s"
    return table(source, _NAMES, rows, kind="pywws", what=what, left_out=other)


def _row(line: str) -> list[str] | None:
    """The cells of a row as `_NAMES` lists them; `None` where a line is none."""
    cells = [cell.strip() for cell in line.split(",")]
    if len(cells) not in _CALIBRATED or not _STAMP.fullmatch(cells[0]):
        return None
    calibrated = _CALIBRATED[len(cells)]
    relative = cells.pop(7) if calibrated else ""
    cells = cells[:12]
    if relative and ((value := _number(relative)) is None or not _pressed(value)):
        return None
    numbers = [_number(cell) for cell in cells[1:]]
    if any(number is None and cell for number, cell in zip(numbers, cells[1:], strict=True)):
        return None
    delay, _, _, humidity, _, pressure, mean, gust, point, _, _ = numbers
    right = (
        delay is not None and delay >= 0 and delay % 1 == 0,
        humidity is None or 0 <= humidity <= 100,
        pressure is None or _pressed(pressure),
        mean is None or gust is None or 0 <= mean <= gust + 0.5,
        point is None or (0 <= point < 16 and (calibrated or point % 1 == 0)),
    )
    if not all(right):
        return None
    direction = "" if point is None else f"{point * _POINT:g}"
    return [cells[0], cells[4], cells[5], cells[6], cells[7], cells[8], direction]


def _pressed(value: float) -> bool:
    """Whether a number may be a pressure of the air [hPa]."""
    return 500 < value < 1100


def _number(cell: str) -> float | None:
    try:
        return float(cell)
    except ValueError:
        return None
