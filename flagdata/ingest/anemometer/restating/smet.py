"""Tables of the SMET format, whose header says what the columns are.

    SMET 1.1 ASCII
    [HEADER]
    nodata = -999
    tz = 1
    fields = timestamp TA RH VW DW
    units_multiplier = 1 1 0.01 1 1
    [DATA]
    2008-12-01T00:00   265.95   98.8   0.4   335

Source: Bavay, "SMET Weather Station Meteorological Data Format Specification", WSL/SLF: after a value's multiplier and
offset units are m, s, K, Pa and relative humidity 0 to 1; VW is the mean of the wind's speed, VW_MAX its maximum, DW
its direction; tz is the offset from UTC in hours; nodata stands for no value.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from flagdata.ingest.anemometer.restating.restate import rows_of, table
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_SIGNATURE = re.compile(r"\ufeff?SMET\s+\d+(?:\.\d+)?\s+ASCII\b")
_NAMES = {
    "VW": "wind speed [m/s]", "VW_MAX": "gust [m/s]", "DW": "wind direction [deg]", "TA": "air temperature [K]",
    "RH": "relative humidity [1]", "P": "air pressure [Pa]",
}  # fmt: skip
_STAMP = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d(?::\d\d(?:\.\d+)?)?(?P<zone>Z|[+-]\d\d:?\d\d)?")


def matches(lines: Sequence[str]) -> bool:
    """The first line is the format's signature."""
    return bool(lines) and _SIGNATURE.match(lines[0]) is not None


def as_table(source: TextFile) -> TableText | None:
    """Stamp with its zone, and the quantities in SI units; `None` where no column is the stamp or none is the wind, or
    the header's multipliers and offsets are not as many as its fields."""
    header = _header(source.head())
    fields = header.get("fields", "").split()
    places = [place for place, name in enumerate(fields) if name in _NAMES]
    if "timestamp" not in fields or not {"VW", "DW"} & set(fields):
        return None
    at, nodata, offset = fields.index("timestamp"), header.get("nodata", "-999"), zone(header.get("tz", ""))
    scales = each(header.get("units_multiplier"), len(fields), usual=1.0)
    offsets = each(header.get("units_offset"), len(fields), usual=0.0)
    if scales is None or offsets is None:
        return None

    def row(line: str) -> list[str] | None:
        cells = line.split()
        if len(cells) != len(fields) or (stamp := _STAMP.fullmatch(cells[at])) is None:
            return None
        values = [value(cells[place], nodata, scales[place], offsets[place]) for place in places]
        return [cells[at] if stamp["zone"] else cells[at] + offset, *values]

    rows, other = rows_of(source, row)
    left_out = max(0, other - len(_above(source.head())))
    names = ["time", *(_NAMES[fields[place]] for place in places)]
    return table(source, names, rows, kind="smet", what="the SMET format", left_out=left_out)


def _above(lines: Sequence[str]) -> list[str]:
    """The lines above the data that hold anything."""
    end = next((at for at, line in enumerate(lines) if line.strip().upper() == "[DATA]"), len(lines) - 1)
    return [line for line in lines[: end + 1] if line.strip()]


def _header(lines: Sequence[str]) -> Mapping[str, str]:
    pairs = (re.split(r"[#;]", line)[0].partition("=") for line in _above(lines))
    return {key.strip().lower(): value.strip() for key, sign, value in pairs if sign}


def each(text: str | None, count: int, *, usual: float) -> list[float] | None:
    """A number for each field, the usual one where the header has none; `None` where it does not have as many."""
    if text is None:
        return [usual] * count
    try:
        found = [float(part) for part in text.split()]
    except ValueError:
        return None
    return found if len(found) == count else None


def zone(hours: str) -> str:
    """The offset from UTC as stamps write it; "" where the header has none that can be read."""
    try:
        minutes = round(60 * float(hours))
    except ValueError:
        return ""
    return f"{'-' if minutes < 0 else '+'}{abs(minutes) // 60:02d}:{abs(minutes) % 60:02d}"


def value(cell: str, nodata: str, scale: float, offset: float) -> str:
    """A cell in the quantity's SI unit; as written where it is no number."""
    try:
        number, missing = float(cell), float(nodata)
    except ValueError:
        return "" if cell == nodata else cell
    if number == missing:
        return ""
    return cell if (scale, offset) == (1.0, 0.0) else f"{number * scale + offset:.10g}"
