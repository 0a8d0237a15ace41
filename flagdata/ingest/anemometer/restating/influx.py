"""Annotated CSV as InfluxDB 2 exports it (InfluxData, "Annotated CSV"): made into one row a time.

    #datatype,string,long,dateTime:RFC3339,double,string,string
    #group,false,false,false,false,true,true
    #default,_result,,,,,
    ,result,table,_time,_value,_field,station
    ,,0,2026-05-01T12:00:00Z,4.2,wind_speed,north

Each series is a table of its own, one below the other, the next with annotations and a heading again where its columns
differ. Its field names the quantity; where that is "value", as Home Assistant writes it, the entity does, and the
measurement is its unit. As few other tags as do it tell sites apart.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator, Sequence

from flagdata.ingest.anemometer.restating.name_value import Record, wide
from flagdata.ingest.anemometer.restating.telling_tags import telling
from flagdata.ingest.anemometer.text.source import TableText, TextFile
from flagdata.units import spelled

_ANNOTATIONS = ("#datatype", "#group", "#default")
_NEEDED = frozenset({"_time", "_value", "_field"})
PLAIN = frozenset({"value", "state"})
"""Fields that say nothing of the quantity."""
_NAMING = ("entity_id", "friendly_name", "topic", "sensor", "name")
"""Tags that name the quantity where the field does not."""


def matches(lines: Sequence[str]) -> bool:
    """Whether the first lines are annotations, or the heading of a table of series."""
    first = next((line.lstrip("\ufeff") for line in lines if line.strip()), "")
    return first.startswith(_ANNOTATIONS) or set(first.strip().split(",")) >= _NEEDED


def as_table(source: TextFile) -> TableText | None:
    """The values of all series, one row a time; `None` where they are in columns of their own, or none is a speed."""
    return of_series(source, _rows(source.each_line()), what="series of InfluxDB")


def of_series(source: TextFile, values: Iterable[dict[str, str]], *, what: str, left_out: int = 0) -> TableText | None:
    """The values of series, each with its tags, its time, its field and its measurement, as one row a time.

    Args:
        what: what the file holds, for the finding that says so.
        left_out: lines that hold no value.
    """
    rows = list(values)
    if not rows:
        return None
    tags = [tag for tag in dict.fromkeys(tag for row in rows for tag in row) if _is_tag(tag)]
    apart = telling(rows, [tag for tag in tags if tag not in _NAMING])
    records = sorted((_record(row, apart) for row in rows), key=lambda record: record.stamp[0].removesuffix("Z"))
    return wide(source, ["time", *(["site"] if apart else [])], records, what=what, left_out=[left_out])


def _rows(lines: Iterable[str]) -> Iterator[dict[str, str]]:
    """The cells of each row by its heading; rows of tables without a field and a value are none."""
    heading: list[str] = []
    awaited = True
    for line in lines:
        text = line.lstrip("\ufeff").strip()
        if not text or text.startswith(_ANNOTATIONS):
            awaited = True
            continue
        cells = next(csv.reader([text]))
        if awaited or set(cells) >= _NEEDED:
            heading, awaited = cells, False
        elif set(heading) >= _NEEDED and len(cells) == len(heading):
            yield {name: cell.strip() for name, cell in zip(heading, cells, strict=True)}


def _is_tag(name: str) -> bool:
    return bool(name) and not name.startswith("_") and name not in ("result", "table")


def _record(row: dict[str, str], apart: Sequence[str]) -> Record:
    """The value of a row, with the site that the tags `apart` tell."""
    name, measurement = row["_field"], row.get("_measurement", "")
    if name.lower() in PLAIN:
        name = next((row[tag] for tag in _NAMING if row.get(tag)), measurement)
        name = f"{name} [{measurement}]" if spelled(measurement) is not None else name
    site = ("/".join(row.get(tag, "") for tag in apart),) if apart else ()
    return Record(stamp=(row["_time"], *site), name=name, value=row["_value"])
