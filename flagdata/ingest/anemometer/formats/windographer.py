"""Text exports of Windographer: facts about the site, then a table whose columns the user named.

Source: UL Solutions, Windographer help, "Exporting data". Columns carry a unit only where the user asked for it;
without, speeds are in the unit of the line "Calm threshold = 0 m/s". Compared with one file of version 4.1.
"""

from __future__ import annotations

import re

from flagdata.errors import InputError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.formats.exports import (
    Column,
    Export,
    assign,
    cut,
    read_export,
    split_unit,
    stamp_format,
)
from flagdata.ingest.anemometer.options import WindOptions
from flagdata.ingest.anemometer.reading import Reading
from flagdata.ingest.anemometer.recipe import FileLayout, TimeLayout
from flagdata.ingest.anemometer.sniffing import Guess, Head
from flagdata.ingest.anemometer.text.source import TextFile
from flagdata.signals import Sensor

_AT = r"[ _]*(?:[\d.]+ ?m)?[ _]*[nesw]{0,3}(?:[ _]*\d)?(?:[ _]*(?:avg|mean))?"
NAMES = (
    (rf"(?:wind ?)?(?:spd|speed){_AT}|ws{_AT}", "wind_speed"),
    (rf"(?:wind ?)?(?:dir|direction){_AT}|wd{_AT}", "wind_direction"),
    (rf"(?:t|temp|temperature){_AT}", "air_temperature"),
    (rf"(?:p|press|pressure){_AT}", "air_pressure"),
    (rf"(?:rh|relative humidity){_AT}", "relative_humidity"),
)
"""Names that columns of masts have: quantity, height and side of the boom."""
_CREATED = re.compile(r"Created .* by Windographer")
_CALM = re.compile(r"Calm threshold\s*=\s*[\d.,]+\s*(\S+)")
_HEADING = re.compile(r"\"?(?:Date/Time|Date)\b")
_WITHOUT = {"wind_direction": "deg", "relative_humidity": "%"}


class Windographer:
    """Format "windographer"."""

    name = "windographer"
    about = "Windographer text export"
    uses = frozenset({"zone", "date_order"})

    def recognise(self, head: Head) -> Guess | None:
        """A line that names Windographer as its maker, and a heading that begins with a date."""
        made = next((i for i, line in enumerate(head.lines[:5]) if _CREATED.search(line)), None)
        at = _heading(head.lines)
        if made is None or at is None:
            return None
        reasons = (f"line {made + 1} says that Windographer made the file", f"line {at + 1} is a heading with a date")
        return Guess(format="windographer", score=0.97, reasons=reasons)

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """Read the first column of speed and of direction."""
        where = str(source.path)
        lines = source.head(5000)
        at = _heading(lines)
        if at is None:
            raise InputError("no heading that begins with Date/Time", where=where, fix="export the data again as text")
        delimiter = "\t" if "\t" in lines[at] else "," if "," in lines[at] else ";"
        calm = next((match[1] for line in lines[:at] if (match := _CALM.search(line))), "")
        columns: list[Column] = []
        borrowed = False
        for number, text in enumerate(cut(lines[at], delimiter), start=1):
            name, spelled = split_unit(text)
            channel = next((c for pattern, c in NAMES if re.fullmatch(pattern, name[:120], re.IGNORECASE)), "")
            if not spelled and channel == "wind_speed":
                spelled, borrowed = calm, True
            columns.append(Column(number=number, name=name, unit=spelled or _WITHOUT.get(channel, "")))
        stamps = 2 if len(columns) > 1 and columns[1].name.lower() == "time" else 1
        assigned = assign(
            columns[stamps:], NAMES, where=f"{where}, line {at + 1}",
            fix="export with units in the column names, or describe the file by a recipe",
        )  # fmt: skip
        rows = [" ".join(line.split(delimiter)[:stamps]) for line in lines[at + 1 :]]
        form, found = stamp_format(rows, options, f"{where}, line {at + 2}")
        decimal = "," if delimiter != "," and any(re.search(r"\d,\d", line) for line in lines[at + 1 :]) else "."
        if borrowed:
            text = f"speeds carry no unit: taken to be in {calm}, the unit of the calm threshold"
            found = (*found, Finding(kind="unit-from-preamble", severity=Severity.WARNING, what=text))
        export = Export(
            name=self.name,
            file=FileLayout(delimiter=delimiter, decimal=decimal, preamble=at, missing=("-999", "-9999", "9999")),
            time=TimeLayout(columns=tuple(range(1, stamps + 1)), format=form),
            sensor=Sensor(name=f"mast anemometer {assigned.names['wind_speed']}"),
            assigned=assigned,
            averaged=True,
            starts=any("beginning of the time step" in line for line in lines[:at]),
        )
        return read_export(source, export, options).with_findings(found)


def _heading(lines: tuple[str, ...] | list[str]) -> int | None:
    return next((i for i, line in enumerate(lines[:200]) if _HEADING.match(line.lstrip("\ufeff"))), None)
