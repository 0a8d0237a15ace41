"""Meteorological files of ICOS' atmosphere stations (.MTO): comments, a heading that begins with #Site, semicolons.

Source: ICOS Atmosphere Thematic Centre, release files "ATC MTO", as their comment lines and the Carbon Portal's list of
variables describe them: UTC in columns of year to minute, WS [m/s], WD [deg], AT [°C], RH [%], AP [hPa], each with
Stdev, NbPoints and Flag; -999.99 for no value; flags U, O and R are data found correct (automatically, by hand, and
carried over), N, K and H are not. Written by this description; no such file was at hand.
"""

from __future__ import annotations

from collections.abc import Sequence

from flagdata.errors import InputError
from flagdata.ingest.anemometer.formats.exports import Column, Export, assign, cut, read_export
from flagdata.ingest.anemometer.options import WindOptions
from flagdata.ingest.anemometer.reading import Reading
from flagdata.ingest.anemometer.recipe import CheckLayout, FileLayout, TimeLayout
from flagdata.ingest.anemometer.sniffing import Guess, Head
from flagdata.ingest.anemometer.text.source import TextFile
from flagdata.signals import Sensor

_NAMES = (
    ("WS", "wind_speed"),
    ("WD", "wind_direction"),
    ("AT", "air_temperature"),
    ("AP", "air_pressure"),
    ("RH", "relative_humidity"),
)
_UNITS = {"WS": "m/s", "WD": "deg", "AT": "degC", "AP": "hPa", "RH": "%"}
_STAMP = ("Year", "Month", "Day", "Hour", "Minute")
_RIGHT = ("U", "O", "R")


class Icos:
    """Format "icos"."""

    name = "icos"
    about = "ICOS atmosphere station, meteorology (.MTO)"
    uses = frozenset({"zone"})

    def recognise(self, head: Head) -> Guess | None:
        """A heading that begins with #Site;SamplingHeight and holds WS."""
        at = _heading(head.lines)
        if at is None:
            return None
        reasons = (f"line {at + 1} names the columns as ICOS' atmosphere stations do",)
        return Guess(format=self.name, score=0.97, reasons=reasons)

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """Read wind speed and direction; rows whose wind speed was found incorrect are faults."""
        where = str(source.path)
        lines = source.head(200)
        at = _heading(lines)
        if at is None:
            raise InputError("no heading with #Site and WS", where=where, fix="name another format by --as")
        names = _names(lines[at])
        columns = [Column(number=n, name=name, unit=_UNITS.get(name, "")) for n, name in enumerate(names, start=1)]
        rest = [column for column in columns if column.name not in (*_STAMP, "Site", "SamplingHeight", "DecimalDate")]
        first = next((cut(line, ";") for line in lines[at + 1 :] if line.strip()), [])
        height = first[names.index("SamplingHeight")] if len(first) == len(names) else ""
        checks = ()
        if "WS-Flag" in names:
            flag = CheckLayout(column=names.index("WS-Flag") + 1, values=_RIGHT, about="quality flag of wind speed")
            checks = (flag,)
        export = Export(
            name=self.name,
            file=FileLayout(delimiter=";", preamble=at + 1, header=0, missing=("-999.99", "-9.99")),
            time=TimeLayout(
                columns=tuple(names.index(name) + 1 for name in _STAMP), format="%Y %m %d %H %M", zone="UTC"
            ),
            sensor=Sensor(
                name=f"ICOS station {first[0]}" if first else "ICOS station", height=_metres(height),
            ),
            assigned=assign(rest, _NAMES, where=f"{where}, line {at + 1}", fix="name another format by --as"),
            checks=checks,
            described_by="the comment lines of ICOS' release files",
            averaged=True,
        )  # fmt: skip
        return read_export(source, export, options)


def _names(line: str) -> list[str]:
    return cut(line.lstrip("\ufeff# "), ";")


def _heading(lines: Sequence[str]) -> int | None:
    wanted = {"Site", "SamplingHeight", "WS", *_STAMP}
    return next((i for i, line in enumerate(lines[:200]) if line.startswith("#") and wanted <= set(_names(line))), None)


def _metres(text: str) -> float | None:
    try:
        height = float(text)
    except ValueError:
        return None
    return height if 0 < height < 1000 else None
