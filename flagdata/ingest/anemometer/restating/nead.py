"""Tables of the NEAD format and of iCSV, which followed it: a header in comments says what the columns are.

    # NEAD 1.0 UTF-8
    # [METADATA]
    # field_delimiter = ,
    # timezone = 0
    # nodata = -999
    # [FIELDS]
    # fields = timestamp,TA1,VW1,DW1
    # units = ,degC,m s-1,degrees
    # [DATA]
    1996-05-12 11:00:00,-12.3,4.5,210

Source: Iosifescu Enescu, Bavay and Mankoff, "New Environmental Data Archive (NEAD) format", EnviDat 2020, and WSL,
"iCSV file format": names of fields are those of SMET, with a number where there are several sensors; timezone is the
offset from UTC in hours; values times their multiplier plus their offset are in other units, and are left to their
user.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from flagdata.ingest.anemometer.restating.restate import rows_of, table
from flagdata.ingest.anemometer.restating.smet import each, value, zone
from flagdata.ingest.anemometer.text.layout import cut
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_SIGNATURE = re.compile(r"\ufeff?#\s*(?:NEAD|iCSV)\s+\d+(?:\.\d+)?\b", re.IGNORECASE)
_PAIR = re.compile(r"#\s*(?P<key>[A-Za-z_]\w*)\s*=\s*(?P<value>.*?)\s*")
_NAMES = {
    "VW": "wind speed", "VW_MAX": "gust", "DW": "wind direction", "TA": "air temperature", "RH": "relative humidity",
    "P": "air pressure",
}  # fmt: skip
"""Of fields, as the dictionary of SMET has them."""
_NUMBERED = re.compile(r"(?P<base>[A-Z]+(?:_MAX)?)_?(?P<number>\d*)")
_STAMP = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(?::\d\d(?:\.\d+)?)?\s*(?P<zone>Z|[+-]\d\d(?::?\d\d)?)?")
_SIGNS = {"\\t": "\t", "tab": "\t", "\\s": " ", "\\s+": " ", "space": " ", "whitespace": " "}
"""How a delimiter that cannot be seen is spelled."""
_HEAD = 1000
"""Lines of the longest header that is read."""


def matches(lines: Sequence[str]) -> bool:
    """The first line is the signature of one of the two."""
    return bool(lines) and _SIGNATURE.match(lines[0]) is not None


def as_table(source: TextFile) -> TableText | None:
    """Stamps with their zone and the columns under their names with their units; `None` without a field of the time."""
    head = source.head(_HEAD)
    header = _header(head)
    sign = _SIGNS.get(header.get("field_delimiter", ",").lower(), header.get("field_delimiter", ","))
    fields = cut(header.get("fields", ""), sign)
    if "timestamp" not in fields:
        return None
    at, offset = fields.index("timestamp"), zone(header.get("timezone", ""))
    units = _listed(header, ("units",), sign, len(fields)) or [""] * len(fields)
    plain = _unscaled(header, sign, len(fields))
    nodata = header.get("nodata", "-999")

    def row(line: str) -> list[str] | None:
        cells = cut(line, sign)
        if line.lstrip().startswith("#") or len(cells) != len(fields):
            return None
        stamp = _STAMP.fullmatch(cells[at])
        if stamp is None:
            return None
        others = (value(cell, nodata, 1.0, 0.0) for place, cell in enumerate(cells) if place != at)
        return [cells[at] if stamp["zone"] else cells[at] + offset, *others]

    rows, other = rows_of(source, row)
    left_out = max(0, other - sum(line.lstrip().startswith("#") for line in head))
    names = [_heading(fields[place], units[place], plain[place]) for place in range(len(fields)) if place != at]
    what = "the NEAD format" if "NEAD" in head[0].upper() else "the iCSV format"
    return table(source, ["time", *names], rows, kind="nead", what=what, left_out=left_out)


def _header(lines: Sequence[str]) -> Mapping[str, str]:
    found = (_PAIR.fullmatch(line.strip()) for line in lines)
    return {match["key"].lower(): match["value"] for match in found if match is not None}


def _listed(header: Mapping[str, str], keys: Sequence[str], sign: str, count: int) -> list[str] | None:
    """What the header lists for each field under the first of these keys; `None` where it has not as many."""
    text = next((header[key] for key in keys if key in header), None)
    found = None if text is None else cut(text, sign)
    return found if found is not None and len(found) == count else None


def _unscaled(header: Mapping[str, str], sign: str, count: int) -> list[bool]:
    """Of each field whether its values are in its unit as they stand."""
    kept = [True] * count
    for keys, usual in ((("units_multiplier", "scale_factor"), 1.0), (("units_offset", "add_value"), 0.0)):
        listed = _listed(header, keys, sign, count)
        numbers = None if listed is None else each(" ".join(cell or f"{usual}" for cell in listed), count, usual=usual)
        if numbers is not None:
            kept = [was and number == usual for was, number in zip(kept, numbers, strict=True)]
    return kept


def _heading(field: str, unit: str, plain: bool) -> str:
    match = _NUMBERED.fullmatch(field)
    name = None if match is None else _NAMES.get(match["base"])
    name = field if name is None or match is None else f"{name} {match['number']}".strip()
    return f"{name} [{unit}]" if unit and plain else name
