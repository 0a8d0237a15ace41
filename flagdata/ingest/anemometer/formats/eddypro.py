"""EddyPro "full output" tables: a line of groups, a line of names, a line of units, then rows of averages.

Source: LI-COR, EddyPro help, "The full output file" (headings, variables, -9999 as the error label) and "Beginning of
dataset" (the stamp is the end of the averaging period). The stamps are of the clock of the raw files. Written by this
description; no such table was at hand.
"""

from __future__ import annotations

from collections.abc import Sequence

from flagdata.errors import InputError
from flagdata.ingest.anemometer.formats.exports import Column, Export, assign, cut, known_unit, read_export
from flagdata.ingest.anemometer.options import WindOptions
from flagdata.ingest.anemometer.reading import Reading
from flagdata.ingest.anemometer.recipe import FileLayout, TimeLayout
from flagdata.ingest.anemometer.sniffing import Guess, Head
from flagdata.ingest.anemometer.text.source import TextFile
from flagdata.signals import Sensor
from flagdata.units import unit

_NAMES = (
    (r"wind_speed", "wind_speed"),
    (r"wind_dir", "wind_direction"),
    (r"air_temperature", "air_temperature"),
    (r"sonic_temperature", "sonic_temperature"),
    (r"air_pressure", "air_pressure"),
    (r"RH", "relative_humidity"),
)
_UNITS = {
    "date": "yyyy-mm-dd", "time": "HH:MM", "wind_speed": "m/s", "wind_dir": "deg", "air_temperature": "K",
    "sonic_temperature": "K", "air_pressure": "Pa", "RH": "%",
}  # fmt: skip
"""Units of the columns that are read, as EddyPro's help has them for every table."""
_STAMP = ("date", "time")


class EddyPro:
    """Format "eddypro"."""

    name = "eddypro"
    about = "EddyPro full output table"
    uses = frozenset({"zone"})

    def recognise(self, head: Head) -> Guess | None:
        """Names that include filename, date, time and wind_speed above units in square brackets."""
        at = _names(head.lines)
        if at is None:
            return None
        reasons = (f"lines {at + 1} and {at + 2} are names and units of EddyPro's full output",)
        return Guess(format=self.name, score=0.97, reasons=reasons)

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """Read mean wind speed and direction of each averaging period."""
        where = str(source.path)
        lines = source.head(3)
        at = _names(lines)
        if at is None:
            raise InputError("no names and units of EddyPro", where=where, fix="give the full output file")
        names, units = cut(lines[at], ","), cut(lines[at + 1], ",")
        _check_units(names, units, where=f"{where}, line {at + 2}")
        units += [""] * (len(names) - len(units))
        columns = [
            Column(number=number, name=name, unit=spelled)
            for number, (name, spelled) in enumerate(zip(names, units, strict=False), start=1)
        ]
        assigned = assign(columns, _NAMES, where=f"{where}, line {at + 2}", fix="describe the file by a recipe")
        export = Export(
            name=self.name,
            file=FileLayout(preamble=at, header=2, missing=("-9999", "-9999.0")),
            time=TimeLayout(columns=(names.index("date") + 1, names.index("time") + 1), format="%Y-%m-%d %H:%M"),
            sensor=Sensor(name="sonic anemometer by EddyPro"),
            assigned=assigned,
            described_by="EddyPro's help",
            averaged=True,
        )
        return read_export(source, export, options)


def _check_units(names: Sequence[str], units: Sequence[str], *, where: str) -> None:
    """Refuse a line of units that do not stand below their names, as where one cell of it is missing.

    Raises:
        InputError: with the line that reads the columns in the units that EddyPro always gives them in.
    """
    missing = len(names) - len(units)
    below = zip(names, [*units, *[""] * max(0, missing)], strict=False)
    strange = [f"{name} in {cell or 'no unit'}" for name, cell in below if name in _UNITS and not _fits(name, cell)]
    if not strange or (missing <= 0 and not any("wind" in one for one in strange)):
        return
    short = f", {missing} fewer of them," if missing > 0 else ""
    channels = {**dict(_NAMES), "date": "date", "time": "time"}
    line = ",".join(
        f"{at}={channels[name]}" + (f"[{_UNITS[name]}]" if name not in _STAMP else "")
        for at, name in enumerate(names, start=1) if name in _UNITS
    )  # fmt: skip
    raise InputError(
        f"the units{short} do not stand below their names: {', '.join(strange[:3])}", where=where,
        fix=f'mend the line of units; or, since those of EddyPro are always the same: --columns "{line}"',
    )  # fmt: skip


def _fits(name: str, written: str) -> bool:
    """Whether a unit, as written, is of the quantity of its column; of a date or time, whether it is their format."""
    if name in _STAMP:
        return written.strip("[]") in ("", _UNITS[name])
    known = known_unit(written)
    return known is not None and unit(known).si == unit(_UNITS[name]).si


def _names(lines: Sequence[str]) -> int | None:
    for index in range(min(2, len(lines) - 1)):
        names = cut(lines[index][:20_000], ",")
        if {"date", "time", "wind_speed"} <= set(names) and "[" in lines[index + 1]:
            return index
    return None
