"""Ecowitt and other Fine Offset weather stations: CSV of the consoles' cards, of ecowitt.net and of EasyWeather.

Source: Ecowitt, GW3000 and WS View Plus manuals, "History data": columns called "Time", "Wind(m/s)", "Gust(m/s)", "Wind
Direction(deg)", "Outdoor Temperature(℃)", "ABS Pressure(hPa)"; exports of ecowitt.net have the groups ("Outdoor",
"Wind", "Pressure") in a line above; EasyWeather writes directions as points of the compass. Local time of the console;
"--", "--.-" and "-" are no value. Relative pressure is not read. Written by these descriptions and headings as programs
that import such files list them; no file of a station was at hand.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from flagdata.errors import InputError
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

_NAMES = (
    (r"(wind )?wind( speed)?", "wind_speed"),
    (r"(wind )?(wind )?direction", "wind_direction"),
    (r"outdoor temperature", "air_temperature"),
    (r"outdoor humidity", "relative_humidity"),
    (r"(pressure )?abs(olute)?( pressure)?", "air_pressure"),
)
_WIND = re.compile(r"(?:wind )?wind(?: speed)?\s*\([^)]*\)", re.IGNORECASE)
_GUST = re.compile(r"(?:wind )?(?:wind )?gust\s*\([^)]*\)", re.IGNORECASE)


class Ecowitt:
    """Format "ecowitt"."""

    name = "ecowitt"
    about = "Ecowitt or Fine Offset weather station (CSV)"
    uses = frozenset({"zone", "date_order"})

    def recognise(self, head: Head) -> Guess | None:
        """A heading with "Time", wind and gust, both with a unit in brackets, and something outdoors."""
        found = _heading(head.lines)
        if found is None:
            return None
        reasons = (f"line {found[0]} has the columns Time, {', '.join(found[2])}, as Ecowitt stations do",)
        return Guess(format=self.name, score=0.95, reasons=reasons)

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """Read the averages of the recording interval."""
        where = str(source.path)
        lines = source.head(5000)
        heading = _heading(lines)
        if heading is None:
            raise InputError("no heading with Time, Wind and Gust", where=where, fix="export the history again as CSV")
        count, names, _ = heading
        delimiter = _delimiter(lines[count - 1])
        stamp = next(number for number, name in enumerate(names, start=1) if name.lower() == "time")
        columns: list[Column] = []
        for number, text in enumerate(names, start=1):
            name, spelled = split_unit(text)
            if not spelled and "direction" in name.lower():
                spelled = "deg"
            columns.append(Column(number=number, name=name, unit=spelled.replace("º", "°")))
        assigned = assign(columns, _NAMES, where=f"{where}, line {count}", fix="export in m/s, km/h, mph or knots")
        rows = [cut(line, delimiter) for line in lines[count:] if line.strip()]
        form, found = stamp_format([row[stamp - 1] for row in rows if len(row) >= stamp], options, where)
        speed = int(assigned.channels["wind_speed"].column)
        commas = delimiter != "," and any(len(row) >= speed and "," in row[speed - 1] for row in rows)
        direction = assigned.channels.get("wind_direction")
        export = Export(
            name=self.name,
            file=FileLayout(delimiter=delimiter, decimal="," if commas else ".", preamble=count - 1),
            time=TimeLayout(columns=(stamp,), format=form),
            sensor=Sensor(name="Ecowitt weather station", resolution=0.1),
            assigned=assigned,
            described_by="Ecowitt's manuals",
            averaged=True,
            compass=(int(direction.column),) if direction is not None else (),
        )
        return read_export(source, export, options).with_findings(found)


def _delimiter(line: str) -> str:
    return max((",", "\t", ";"), key=line.count)


def _heading(lines: Sequence[str]) -> tuple[int, list[str], list[str]] | None:
    """Number of heading lines, names of the columns with their groups, and the names of wind and gust."""
    for index, line in enumerate(lines[:2]):
        names = cut(line[:8000], _delimiter(line))
        if index == 1:
            group = ""
            above = cut(lines[0][:8000], _delimiter(lines[0]))
            joined: list[str] = []
            for number, name in enumerate(names):
                group = above[number] if number < len(above) and above[number] else group
                joined.append(f"{group} {name}".strip() if name else group)
            names = joined
        wind = [name for name in names if _WIND.fullmatch(name)]
        gust = [name for name in names if _GUST.fullmatch(name)]
        outside = any(name.lower().startswith("outdoor") for name in names)
        if wind and gust and outside and any(name.lower() == "time" for name in names):
            return index + 1, names, [wind[0], gust[0]]
    return None
