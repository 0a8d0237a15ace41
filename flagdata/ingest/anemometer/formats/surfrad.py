"""SURFRAD daily files of NOAA: a station line, a line of its position, then 48 numbers a row, in UTC.

Source: NOAA Global Monitoring Laboratory, SURFRAD README, and the list of its columns in pvlib's documentation
(pvlib.iotools.read_surfrad): year, day of year, month, day, hour, minute, decimal hour, zenith angle, then twenty
values, each before its quality flag (0 good), among them temperature [°C], humidity [%], wind speed [m/s] and direction
[deg] at 10 m, and pressure [hPa]; -9999.9 is no value. One row is the average of a minute (three minutes before 2009).
Written by these descriptions; no such file was at hand.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from flagdata.errors import InputError
from flagdata.ingest.anemometer.formats.exports import Column, Export, assign, read_export
from flagdata.ingest.anemometer.options import WindOptions
from flagdata.ingest.anemometer.reading import Reading
from flagdata.ingest.anemometer.recipe import CheckLayout, FileLayout, TimeLayout
from flagdata.ingest.anemometer.sniffing import Guess, Head
from flagdata.ingest.anemometer.text.source import TextFile
from flagdata.signals import Sensor

_COLUMNS = (
    Column(number=39, name="temp", unit="degC"),
    Column(number=41, name="rh", unit="%"),
    Column(number=43, name="windspd", unit="m/s"),
    Column(number=45, name="winddir", unit="deg"),
    Column(number=47, name="pressure", unit="hPa"),
)
_NAMES = (
    ("windspd", "wind_speed"),
    ("winddir", "wind_direction"),
    ("temp", "air_temperature"),
    ("rh", "relative_humidity"),
    ("pressure", "air_pressure"),
)
_WIDTH = 48
_POSITION = re.compile(r"\s*-?\d+\.\d+\s+-?\d+\.\d+\s+-?\d+\s+m\s+version\s+\d+\s*")


class Surfrad:
    """Format "surfrad"."""

    name = "surfrad"
    about = "NOAA SURFRAD daily file"
    uses = frozenset({"zone"})

    def recognise(self, head: Head) -> Guess | None:
        """A position with a version in line 2 and 48 numbers in line 3."""
        if not _is_surfrad(head.lines):
            return None
        reasons = ("line 2 is a position and a version", f"line 3 holds {_WIDTH} numbers, as SURFRAD rows do")
        return Guess(format=self.name, score=0.97, reasons=reasons)

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """Read wind at 10 m; rows whose wind speed is not flagged 0 are faults."""
        where = str(source.path)
        lines = source.head(3)
        if not _is_surfrad(lines):
            raise InputError("no position and rows of SURFRAD", where=where, fix="name another format by --as")
        export = Export(
            name=self.name,
            file=FileLayout(delimiter=" ", preamble=2, header=0, missing=("-9999.9",)),
            time=TimeLayout(columns=(1, 3, 4, 5, 6), format="%Y %m %d %H %M", zone="UTC"),
            sensor=Sensor(name=f"SURFRAD {lines[0].strip()}"[:80], height=10.0),
            assigned=assign(_COLUMNS, _NAMES, where=where, fix="name another format by --as"),
            checks=(CheckLayout(column=44, values=("0",), about="quality flag of wind speed"),),
            described_by="the SURFRAD README",
            averaged=True,
        )
        return read_export(source, export, options)


def _is_surfrad(lines: Sequence[str]) -> bool:
    return len(lines) > 2 and bool(_POSITION.fullmatch(lines[1])) and len(lines[2].split()) == _WIDTH
