"""METER Group ZENTRA exports (ZENTRA Cloud and Utility), e.g. of the ATMOS 22 and ATMOS 41.

Source: METER Group, ZENTRA Cloud manual, "Download data": three heading rows (logger and ports; number of records and
sensor of each port; unit and name of each column), the logger's local time; ATMOS 22 integrator guide: -9999 means no
answer, -9990, -9991 and -9992 are errors of the sensor or its line. Compared with a file of an ATMOS 22.
"""

from __future__ import annotations

import re

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
    (r"air temperature", "air_temperature"),
    (r"reference pressure|atmospheric pressure", "air_pressure"),
    (r"relative humidity|rh", "relative_humidity"),
)
_RECORDS = re.compile(r"#?\s*Records:\s*\d+", re.IGNORECASE)
_MISSING = ("#n/a", "-9999", "-9990", "-9991", "-9992")


class Zentra:
    """Format "zentra"."""

    name = "zentra"
    about = "METER Group ZENTRA export (ATMOS 22, ATMOS 41)"
    uses = frozenset({"zone", "date_order"})

    def recognise(self, head: Head) -> Guess | None:
        """A line of records and sensors, then one that begins with "Timestamps"."""
        if len(head.lines) < 3 or not _heading(head.lines[:3]):
            return None
        reasons = ("line 2 counts records and names a sensor for each port", "line 3 begins with Timestamps")
        return Guess(format="zentra", score=0.97, reasons=reasons)

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """Read the table of one logger; wind of its first port that has any."""
        where = str(source.path)
        lines = source.head(5000)
        if not _heading(lines[:3]):
            raise InputError("no heading of ZENTRA", where=where, fix="export the logger's data again as CSV")
        sensors = cut(lines[1], ",")
        cells = cut(lines[2], ",")
        columns = [_column(number, text) for number, text in enumerate(cells, start=1) if number > 1]
        assigned = assign(columns, _NAMES, where=f"{where}, line 3", fix="export in m/s, km/h, mph or kn")
        padded = len(lines) > 3 and not lines[3].replace(",", "").strip()
        first = 4 if padded else 3
        form, found = stamp_format(
            [line.split(",")[0] for line in lines[first:]], options, f"{where}, line {first + 1}"
        )
        port = int(next(layout.column for name, layout in assigned.channels.items() if name == "wind_speed"))
        named = [name for name in sensors[:port] if name]
        export = Export(
            name=self.name,
            file=FileLayout(preamble=2, header=first - 2, missing=_MISSING),
            time=TimeLayout(columns=(1,), format=form),
            sensor=Sensor(name=f"{named[-1] if len(named) > 1 else 'METER anemometer'} on {cut(lines[0], ',')[0]}"),
            assigned=assigned,
            averaged=True,
        )
        return read_export(source, export, options).with_findings(found)


def _heading(lines: tuple[str, ...] | list[str]) -> bool:
    return (
        len(lines) == 3 and bool(_RECORDS.match(lines[1].strip(' "'))) and lines[2].strip(' "').startswith("Timestamp")
    )


def _column(number: int, text: str) -> Column:
    """A column called "m/s Wind Speed": the unit comes first."""
    spelled, _, name = text.partition(" ")
    return Column(number=number, name=name.strip(), unit=spelled)
