"""FLUXNET, AmeriFlux and ICOS ecosystem tables: TIMESTAMP_START, TIMESTAMP_END and variables with fixed units.

ICOS stations' raw files have one TIMESTAMP (YYYYMMDDHHMMSS) and the same variables and units (Sabbatini et al., ICOS
Ecosystem Instructions for Raw Data Format for Meteorological Measurements, doi 10.18160/tpp4-4smp); their rows are as
sampled, no averages.

Source: AmeriFlux, "Half-hourly and hourly data upload format" and "Data variables": stamps YYYYMMDDHHMM of local
standard time without daylight saving, WS [m/s], WD [deg], TA [°C], PA [kPa], RH [%], -9999 for no value, position as
"_H_V_R" behind a name, "_F" for values with gaps filled. Filled values are not read: they are no measurement. Rows are
stamped by their end. Written by this description; no such table was at hand.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from flagdata.errors import InputError
from flagdata.ingest.anemometer.formats.exports import Column, Export, assign, cut, read_export
from flagdata.ingest.anemometer.options import WindOptions
from flagdata.ingest.anemometer.reading import Reading
from flagdata.ingest.anemometer.recipe import FileLayout, TimeLayout
from flagdata.ingest.anemometer.sniffing import Guess, Head
from flagdata.ingest.anemometer.text.source import TextFile
from flagdata.signals import Sensor

_RAW = re.compile(r"TIMESTAMP,(?:[^,]*,)*WS_\d+_\d+_\d+(?:,|$)")
_PLACE = r"(_\d+_\d+_\d+|_\d+)?"
_NAMES = (
    (rf"WS{_PLACE}", "wind_speed"),
    (rf"WD{_PLACE}", "wind_direction"),
    (rf"TA{_PLACE}", "air_temperature"),
    (rf"PA{_PLACE}", "air_pressure"),
    (rf"RH{_PLACE}", "relative_humidity"),
)
_UNITS = {"WS": "m/s", "WD": "deg", "TA": "degC", "PA": "kPa", "RH": "%"}


def _seconds(lines: Sequence[str]) -> bool:
    """Whether the stamps of rows have seconds."""
    stamps = (match[0] for line in lines if (match := re.match(r"\d{12}(?:\d\d)?(?=,|$)", line)) is not None)
    return len(next(stamps, "")) != 12


class Fluxnet:
    """Format "fluxnet"."""

    name = "fluxnet"
    about = "FLUXNET, AmeriFlux or ICOS half-hourly table"
    uses = frozenset({"zone"})

    def recognise(self, head: Head) -> Guess | None:
        """A heading that begins with TIMESTAMP_START,TIMESTAMP_END, or with TIMESTAMP and holds WS_1_1_1."""
        at = _heading(head.lines)
        if at is None:
            return None
        reasons = (f"line {at + 1} names stamps and variables with fixed units, as flux networks write",)
        return Guess(format=self.name, score=0.97, reasons=reasons)

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """Read wind speed and direction of each half-hour or hour."""
        where = str(source.path)
        lines = source.head(10)
        at = _heading(lines)
        if at is None:
            raise InputError("no heading with TIMESTAMP_START", where=where, fix="name another format by --as")
        columns = [
            Column(number=number, name=name, unit=_UNITS.get(re.split("_", name, maxsplit=1)[0], ""))
            for number, name in enumerate(cut(lines[at], ","), start=1)
        ]
        raw = columns[0].name == "TIMESTAMP"
        assigned = assign(
            columns[1 if raw else 2 :],
            _NAMES,
            where=f"{where}, line {at + 1}",
            fix="give a table that holds WS, not WS_F alone",
        )
        export = Export(
            name=self.name,
            file=FileLayout(preamble=at, missing=("-9999", "-6999")),
            time=TimeLayout(columns=(1,), format="%Y%m%d%H%M%S" if _seconds(lines[at + 1 :]) else "%Y%m%d%H%M")
            if raw
            else TimeLayout(columns=(2,), format="%Y%m%d%H%M"),
            sensor=Sensor(name="flux tower"),
            assigned=assigned,
            described_by="ICOS' instructions" if raw else "AmeriFlux' data format",
            averaged=not raw,
        )
        return read_export(source, export, options)


def _heading(lines: Sequence[str]) -> int | None:
    for index, line in enumerate(lines[:5]):
        text = line.lstrip("\ufeff").replace('"', "")
        if text.startswith("TIMESTAMP_START,TIMESTAMP_END,") or _RAW.match(text):
            return index
    return None
