"""Tables whose header describes each column by number, as CSIRO's Environmental Modelling Suite writes time series.

    ## COLUMNS 3
    ## COLUMN1.name time
    ## COLUMN1.units days since 1990-01-01 00:00:00 +10
    ## COLUMN2.name Speed
    ## COLUMN2.long_name Wind_Speed
    ## COLUMN2.units ms-1
    ## COLUMN2.missing_value -999
    0    0.56
    1000 1.67

Source: CSIRO, "EMS user manual", appendix on ASCII time series: a header of lines "## COLUMNn.attribute value", then
rows of numbers; the time is a count of a unit since an instant, as in the CF conventions.
"""

from __future__ import annotations

import datetime as dt
import re
from collections.abc import Mapping, Sequence

from flagdata.ingest.anemometer.restating.restate import rows_of, table
from flagdata.ingest.anemometer.text.source import TableText, TextFile
from flagdata.ingest.anemometer.words.headings import understand
from flagdata.units import spelled

_ATTRIBUTE = re.compile(r"##?\s*COLUMN(?P<number>\d{1,4})\.(?P<key>\w+)\s+(?P<value>.*\S)\s*", re.IGNORECASE)
_SINCE = re.compile(
    r"(?P<unit>day|hour|minute|second)s?\s+since\s+(?P<date>\d{4}-\d{1,2}-\d{1,2})(?:[T ](?P<clock>[\d:.]+))?"
    r"\s*(?P<zone>Z|UTC|[+-]\d{1,2}(?::?\d\d)?)?",
    re.IGNORECASE,
)
_SECONDS = {"day": 86_400, "hour": 3_600, "minute": 60, "second": 1}
_HEAD = 2000
"""Lines of the longest header that is read."""


def matches(lines: Sequence[str]) -> bool:
    """Whether the first lines name at least two columns so."""
    return sum(_named(line) for line in lines) >= 2


def as_table(source: TextFile) -> TableText | None:
    """Stamps with their zone where the count states one, and the other columns; `None` where no column is the time."""
    columns = _described(source.head(_HEAD))
    times = {number: found for number, own in columns.items() if (found := _SINCE.fullmatch(own.get("units", "")))}
    if len(times) != 1:
        return None
    ((at, since),) = times.items()
    origin, zone = _origin(since)
    if origin is None:
        return None
    numbers = sorted(columns)
    missing = {number: {columns[number].get(key, "") for key in ("missing_value", "fill_value")} for number in numbers}

    def row(line: str) -> list[str] | None:
        cells = line.split()
        if line.lstrip().startswith("#") or len(cells) < max(numbers):
            return None
        try:
            seconds = float(cells[at - 1]) * _SECONDS[since["unit"].lower()]
            stamp = (origin + dt.timedelta(seconds=seconds)).isoformat(timespec="milliseconds")
        except (ValueError, OverflowError):
            return None
        others = (number for number in numbers if number != at)
        return [stamp + zone, *("" if cells[n - 1] in missing[n] else cells[n - 1] for n in others)]

    rows, other = rows_of(source, row)
    headed = sum(line.strip().startswith("#") for line in source.head(_HEAD))
    names = ["time", *(_heading(columns[number]) for number in numbers if number != at)]
    what = "a table whose header describes its columns by number"
    return table(source, names, rows, kind="numbered-columns", what=what, left_out=max(0, other - headed))


def _named(line: str) -> bool:
    found = _ATTRIBUTE.fullmatch(line)
    return found is not None and found["key"].lower() == "name"


def _described(lines: Sequence[str]) -> dict[int, dict[str, str]]:
    """What the header says of each column, by attribute."""
    columns: dict[int, dict[str, str]] = {}
    for line in lines:
        found = _ATTRIBUTE.fullmatch(line)
        if found is not None:
            columns.setdefault(int(found["number"]), {})[found["key"].lower()] = found["value"]
    return columns


def _origin(since: re.Match[str]) -> tuple[dt.datetime | None, str]:
    """The instant from which is counted, and its zone as stamps write it; "" where none is stated."""
    year, month, day = (int(part) for part in since["date"].split("-"))
    parts = [float(part) for part in (since["clock"] or "0").split(":")]
    zone = (since["zone"] or "").upper().replace("UTC", "Z")
    if zone[:1] in ("+", "-"):
        digits = zone[1:].replace(":", "")
        hours, minutes = (digits[:-2], digits[-2:]) if len(digits) > 2 else (digits, "00")
        zone = f"{zone[0]}{int(hours):02d}:{minutes}"
    try:
        origin = dt.datetime(year, month, day)  # noqa: DTZ001  its zone is written behind the stamps
    except ValueError:
        return None, zone
    return origin + dt.timedelta(seconds=sum(part * 60 ** (2 - at) for at, part in enumerate(parts))), zone


def _heading(column: Mapping[str, str]) -> str:
    """The name of a column, or its long name where that alone says the quantity, with its unit in brackets."""
    name, long_name = column.get("name", ""), column.get("long_name", "").replace("_", " ")
    name = name if understand(name).sure or not understand(long_name).sure else long_name
    words = column.get("units", "").split("(")[0].strip()
    unit = "deg" if words.lower().startswith("degrees n") else spelled(words) or words
    towards = " to" if re.search(r"\(\s*to\s*\)", column.get("units", ""), re.IGNORECASE) else ""
    return f"{name}{towards} [{unit}]" if unit else f"{name}{towards}"
