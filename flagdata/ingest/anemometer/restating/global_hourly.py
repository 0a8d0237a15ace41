"""The Global Hourly archive of NOAA (Integrated Surface Database) as CSV, whose columns hold several values in a cell.

    "STATION","DATE",…,"WND","CIG",…
    "72503014732","2023-07-01T00:51:00",…,"230,5,N,0046,5","22000,5,9,N",…

Source: NOAA, Federal Climate Complex Data Documentation for Integrated Surface Data: DATE is UTC; WND is the direction
(deg from true north, 999 missing), its quality, the type of observation (V: variable, C: calm), the speed (0.1 m/s,
9999 missing) and its quality; of a quality, 2 and 6 are suspect, 3 and 7 erroneous. TMP is 0.1 °C, +9999 missing.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Sequence

from flagdata.ingest.anemometer.restating.restate import table
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_CELL = re.compile(r"(\d{3}),(\w),(\w),(\d{4}),(\w)")
_DATE = re.compile(r"\d{4}-\d{2}-\d{2}T\d{2}:\d{2}:\d{2}")
_WRONG = frozenset("2367")
NAMES = ("time [UTC]", "station", "wind speed [m/s]", "wind direction [deg]", "air temperature [degC]")


def matches(lines: Sequence[str]) -> bool:
    """A heading with STATION, DATE and WND, and cells of five values."""
    heads = next(csv.reader(lines[:1]), [])
    return {"STATION", "DATE", "WND"} <= set(heads) and any(_CELL.search(line) for line in lines[1:])


def as_table(source: TextFile) -> TableText | None:
    """Time, station, wind and temperature of each row."""
    heads = next(csv.reader(source.head(1)))
    other = 0

    def rows() -> Iterator[list[str]]:
        nonlocal other
        for first, lines in source.blocks():
            for cells in csv.reader(lines[1:] if first == 1 else lines):
                row = dict(zip(heads, cells, strict=False))
                found = _CELL.fullmatch(row.get("WND", ""))
                if found is None or not _DATE.fullmatch(row["DATE"]):
                    other += bool(cells)
                    continue
                away, speed = wind(*found.groups())
                yield [f"{row['DATE']}Z", row["STATION"], speed, away, tenths(row.get("TMP", ""))]

    return table(source, NAMES, list(rows()), kind="global-hourly", what="NOAA's Global Hourly data", left_out=other)


def wind(away: str, good: str, kind: str, speed: str, sure: str) -> tuple[str, str]:
    """Direction [deg] and speed [m/s] of the five values of a report's wind; "" for what is missing or not to be used.

    Args:
        away, good: direction and its quality.
        kind: of observation.
        speed, sure: speed and its quality.
    """
    return (
        "" if away == "999" or good in _WRONG or kind in "VC" else away,
        "" if speed == "9999" or sure in _WRONG else f"{int(speed) / 10:g}",
    )


def tenths(cell: str) -> str:
    """Degrees Celsius of a temperature in tenths with its quality; "" for one that is missing or not to be used."""
    found = re.fullmatch(r"([+-]\d{4}),(\w)", cell)
    return "" if found is None or found[1] == "+9999" or found[2] in _WRONG else f"{int(found[1]) / 10:g}"
