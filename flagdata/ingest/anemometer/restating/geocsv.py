"""Tables of the GeoCSV format: lines of `# keyword: value` above the heading say the delimiter, units and gaps.

    # dataset: GeoCSV 2.0
    # delimiter: ,
    # field_unit: ISO_8601, meters/second, degrees
    # field_missing: , -999, -999
    Time, WindSpeed, WindDirection
    2016-05-01T00:00:00Z, 3.1, 210

Source: EarthScope (IRIS and UNAVCO), "GeoCSV: tabular text formatting for geoscience data", version 2.0.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from flagdata.ingest.anemometer.restating.restate import rows_of, table
from flagdata.ingest.anemometer.text.layout import cut
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_SIGNATURE = re.compile(r"\ufeff?#\s*dataset\s*:\s*GeoCSV\b.*", re.IGNORECASE)
_PAIR = re.compile(r"\ufeff?#\s*(?P<key>\w+)\s*:\s?(?P<value>.*)")
_HEAD = 1000
"""Lines of the longest header that is read."""
_NO_UNITS = frozenset({"", "iso_8601", "iso8601", "utc", "unitless", "none", "string", "ascii", "n/a"})
_SPELLED = {"meters/second": "m/s", "meter/second": "m/s", "kilometers/hour": "km/h", "miles/hour": "mph",
            "degrees": "deg"}  # fmt: skip
"""Units as GeoCSV writes them out."""


def matches(lines: Sequence[str]) -> bool:
    """One of the first lines is the signature of the format, and comments alone stand above it."""
    for line in lines:
        if _SIGNATURE.match(line) is not None:
            return True
        if not line.startswith("#"):
            return False
    return False


def as_table(source: TextFile) -> TableText | None:
    """The columns under their names with their units; `None` where the units are not as many as the names."""
    head = source.head(_HEAD)
    header = _header(head)
    told = header.get("delimiter", ",").strip()
    sign = {"\\t": "\t", "tab": "\t", "": ","}.get(told.lower(), told)
    first = next((line for line in head if line.strip() and not line.startswith("#")), "")
    names = cut(first, sign)
    units = cut(header.get("field_unit", ""), sign)
    missing = cut(header.get("field_missing", ""), sign)
    if len(names) < 2 or len(units) != len(names):
        return None
    gaps = missing if len(missing) == len(names) else [""] * len(names)

    def row(line: str) -> list[str] | None:
        cells = cut(line, sign)
        if line.startswith("#") or line == first or len(cells) != len(names):
            return None
        return ["" if cell == gap else cell for cell, gap in zip(cells, gaps, strict=True)]

    rows, other = rows_of(source, row)
    above = sum(line.startswith("#") for line in head) + 1
    headings = [_heading(name, unit) for name, unit in zip(names, units, strict=True)]
    return table(source, headings, rows, kind="geocsv", what="the GeoCSV format", left_out=max(0, other - above))


def _header(lines: Sequence[str]) -> Mapping[str, str]:
    found = (_PAIR.match(line) for line in lines)
    return {match["key"].lower(): match["value"].rstrip("\r\n") for match in found if match is not None}


def _heading(name: str, unit: str) -> str:
    known = unit.strip().lower()
    return name if known in _NO_UNITS else f"{name} [{_SPELLED.get(known, unit.strip())}]"
