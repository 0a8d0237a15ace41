"""Onset HOBO exports: CSV of HOBOware, HOBOconnect and HOBOlink.

Source: Onset, HOBOware User's Guide, "Exporting data": an optional line "Plot Title: …", then a heading whose cells are
"Date Time, GMT-05:00" (the zone of all stamps) and "name, unit (LGR S/N: …, SEN S/N: …)"; columns of events ("Host
Connected", "End Of File") hold "Logged" or nothing, and rows of events no values; -888.88 is the logger's error code.
HOBOlink writes "Line#,Date,Wind Speed (S-WSB …),m/s,…". Wind speed is the average of the logging interval, its stamp
the interval's end. Written by this description; no file of a wind sensor was at hand.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from flagdata.errors import InputError
from flagdata.ingest.anemometer.formats.exports import Column, Export, assign, cut, read_export, stamp_format
from flagdata.ingest.anemometer.options import WindOptions
from flagdata.ingest.anemometer.reading import Reading
from flagdata.ingest.anemometer.recipe import FileLayout, TimeLayout
from flagdata.ingest.anemometer.sniffing import Guess, Head
from flagdata.ingest.anemometer.text.source import TextFile
from flagdata.signals import Sensor

_NAMES = (
    (r"wind speed", "wind_speed"),
    (r"wind direction", "wind_direction"),
    (r"temp|temperature|air temperature", "air_temperature"),
    (r"rh|relative humidity", "relative_humidity"),
    (r"pressure|station pressure|barometric pressure", "air_pressure"),
)
_TITLE = re.compile(r"\"?Plot Title:")
_STAMP = re.compile(r"Date(?:[ -]Time)?(?:,\s*(?:GMT|UTC)\s?(?P<zone>[+-]\d{2}:?\d{2}))?(?:\s*\(.*\))?", re.IGNORECASE)
_CLOCK = re.compile(r"Time(?:,\s*(?:GMT|UTC)\s?(?P<zone>[+-]\d{2}:?\d{2}))?", re.IGNORECASE)
_SERIES = re.compile(r"(?P<name>[^,(]+?)\s*(?:\([^)]*\))?\s*,\s*(?P<unit>[^,( ]+).*")
_OWN = re.compile(r"LGR S/N|SEN S/N|S-W|\bM-?WS|Host Connected|End Of File")


class Hobo:
    """Format "hobo"."""

    name = "hobo"
    about = "Onset HOBO export (CSV)"
    uses = frozenset({"zone", "date_order"})

    def recognise(self, head: Head) -> Guess | None:
        """A heading with a date and a wind speed called "name, unit", and a mark of the maker."""
        at = _heading(head.lines)
        if at is None:
            return None
        titled = at > 0 and bool(_TITLE.match(head.lines[0].lstrip("\ufeff")))
        if not titled and not _OWN.search(head.lines[at]):
            return None
        mark = "line 1 is a plot title of HOBOware" if titled else "it names HOBO loggers or sensors"
        reasons = (f"line {at + 1} heads a date and a wind speed as HOBO exports do", mark)
        return Guess(format=self.name, score=0.96, reasons=reasons)

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """Read the averages of the logging interval."""
        where = str(source.path)
        lines = source.head(5000)
        at = _heading(lines)
        if at is None:
            raise InputError("no heading with a date and a wind speed", where=where, fix="export it again as CSV")
        delimiter = _delimiter(lines[at])
        cells = cut(lines[at], delimiter)
        dated = next(number for number, cell in enumerate(cells, start=1) if _STAMP.fullmatch(cell))
        clock = _CLOCK.fullmatch(cells[dated]) if dated < len(cells) else None
        stamps = (dated, dated + 1) if clock else (dated,)
        date = _STAMP.fullmatch(cells[dated - 1])
        zone = (clock and clock["zone"]) or (date and date["zone"]) or None
        columns = [_column(number, cell) for number, cell in enumerate(cells, start=1) if number > max(stamps)]
        assigned = assign(columns, _NAMES, where=f"{where}, line {at + 1}", fix="export in m/s, km/h, mph or knots")
        rows = [cut(line, delimiter) for line in lines[at + 1 :] if line.strip()]
        texts = [" ".join(row[number - 1] for number in stamps) for row in rows if len(row) >= max(stamps)]
        form, found = stamp_format(texts, options, f"{where}, line {at + 2}")
        export = Export(
            name=self.name,
            file=FileLayout(
                delimiter=delimiter, decimal="," if delimiter == ";" else ".", preamble=at, missing=("-888.88",)
            ),
            time=TimeLayout(columns=stamps, format=form, zone=zone),
            sensor=Sensor(name="HOBO wind sensor"),
            assigned=assigned,
            described_by="the HOBOware user's guide",
            averaged=True,
        )
        return read_export(source, export, options).with_findings(found)


def _delimiter(line: str) -> str:
    return "\t" if "\t" in line else ";" if line.count(";") > 1 else ","


def _heading(lines: Sequence[str]) -> int | None:
    for index, line in enumerate(lines[:3]):
        cells = cut(line[:8000], _delimiter(line))
        dated = any(_STAMP.fullmatch(cell) for cell in cells[:3])
        if dated and any(_column(0, cell).name.lower() == "wind speed" and _column(0, cell).unit for cell in cells):
            return index
    return None


def _column(number: int, cell: str) -> Column:
    match = _SERIES.fullmatch(cell[:300])
    return Column(number=number, name=match["name"], unit=match["unit"]) if match else Column(number=number, name=cell)
