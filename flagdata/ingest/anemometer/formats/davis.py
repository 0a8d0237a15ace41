"""Davis Instruments: text exports of the program WeatherLink and CSV exports of weatherlink.com.

Source: Davis Instruments, WeatherLink Getting Started Guide, "Exporting records" (two heading lines, tab or blanks,
"---" for no value, no units: they are those set in the program); Vantage Pro serial communication reference manual,
"DMP archive record" (average wind speed in whole mph, direction one of 16 points, stamp at the end of the interval);
weatherlink.com, "Export data" (names such as "Avg Wind Speed - km/h", "--" for no value). Since the console keeps whole
miles per hour, the unit of a text export shows in its values. "Bar" and "Barometer" are reduced to sea level and not
read. Written by these descriptions; no file of the instrument was at hand.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence

from flagdata.errors import InputError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.formats.exports import Column, Export, assign, cut, read_export, stamp_format
from flagdata.ingest.anemometer.options import WindOptions
from flagdata.ingest.anemometer.reading import Reading
from flagdata.ingest.anemometer.recipe import ChannelLayout, FileLayout, TimeLayout
from flagdata.ingest.anemometer.sniffing import Guess, Head
from flagdata.ingest.anemometer.text.source import TextFile
from flagdata.signals import Sensor
from flagdata.units import UNITS
from flagdata.units import spelled as unit_of

_NAMES = (
    (r"avg wind speed|wind speed", "wind_speed"),
    (r"prevailing wind direction|wind direction|wind dir", "wind_direction"),
    (r"temp|temp out", "air_temperature"),
    (r"hum|out hum", "relative_humidity"),
    (r"absolute pressure", "air_pressure"),
)
_WITHOUT = {"wind dir": "deg", "prevailing wind direction": "deg", "wind direction": "deg", "out hum": "%"}
_PROGRAM_UNITS = ("mph", "km/h", "m/s", "kn")
_SPEEDS = ("wind speed", "hi speed", "wind hi speed", "low speed")
_ENOUGH = 5
"""Different speeds above 0 that tell the unit of whole miles per hour."""
_FIX = "export with units from weatherlink.com, or describe the file by a recipe that names the unit"


class Davis:
    """Format "davis"."""

    name = "davis"
    about = "Davis WeatherLink export (text of the program, CSV of weatherlink.com)"
    uses = frozenset({"zone", "date_order", "unit"})

    def recognise(self, head: Head) -> Guess | None:
        """Two heading lines with Date, Time and Wind Speed, or a heading with "Date & Time" and "… - unit"."""
        if _program(head.lines) is not None:
            reasons = ("lines 1 and 2 head the columns of the program WeatherLink: Date, Time, Wind Speed",)
            return Guess(format=self.name, score=0.96, reasons=reasons)
        at = _site(head.lines)
        if at is None:
            return None
        reasons = (f"line {at + 1} names columns as weatherlink.com does: Date & Time, Avg Wind Speed - …",)
        return Guess(format=self.name, score=0.96, reasons=reasons)

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """Read averages of the archive intervals."""
        lines = source.head(20_000)
        columns = _program(lines)
        if columns is not None:
            return self._read_program(source, lines, columns, options)
        at = _site(lines)
        if at is None:
            raise InputError("no heading of WeatherLink", where=str(source.path), fix="export the archive again")
        return self._read_site(source, lines, at, options)

    def _read_program(
        self, source: TextFile, lines: Sequence[str], columns: Sequence[Column], options: WindOptions
    ) -> Reading:
        where = str(source.path)
        delimiter = "\t" if "\t" in lines[1] else " "
        first = 3 if len(lines) > 2 and set(lines[2].strip()) <= {"-", "\t", " "} and lines[2].strip() else 2
        rows = [cut(line, delimiter) for line in lines[first:] if line.strip()]
        speed = next(column.number for column in columns if column.name.lower() == "wind speed")
        speeds = [column.number for column in columns if column.name.lower() in _SPEEDS]
        shown = _unit_of(_cells(rows, [speed])) or _unit_of(_cells(rows, speeds))
        spelled = options.unit or shown
        if spelled is None:
            raise InputError(
                "the export carries no units, and its speeds do not show them", where=f"{where}, line {first + 1}",
                fix=f"give the unit set in the program: --unit m/s (or km/h, mph, kn); or {_FIX}",
            )  # fmt: skip
        known = [
            Column(
                number=column.number,
                name=column.name,
                unit=spelled if column.number == speed else _WITHOUT.get(column.name.lower(), ""),
            )
            for column in columns
        ]
        assigned = assign(known[2:], _NAMES, where=f"{where}, line 2", fix=_FIX)
        stamps = [" ".join(row[:2]) for row in rows if len(row) > 1]
        form, found = stamp_format(stamps, options, f"{where}, line {first + 1}")
        decimal = "," if any(re.fullmatch(r"\d+,\d", row[speed - 1]) for row in rows if len(row) >= speed) else "."
        told = _about_unit(spelled, shown, said=options.unit is not None)
        export = Export(
            name=self.name,
            file=FileLayout(delimiter=delimiter, decimal=decimal, preamble=first, header=0),
            time=TimeLayout(columns=(1, 2), format=form),
            sensor=_SENSOR,
            assigned=assigned,
            described_by="Davis' guides of WeatherLink",
            averaged=True,
            compass=_directions(assigned.channels),
        )
        reading = read_export(source, export, options)
        if any(finding.kind == "unit-doubtful" for finding in reading.findings):
            told = ()
        return reading.with_findings((*found, *told, *_gusts(columns, spelled, form)))

    def _read_site(self, source: TextFile, lines: Sequence[str], at: int, options: WindOptions) -> Reading:
        where = str(source.path)
        delimiter = max((",", ";", "\t"), key=lines[at].count)
        columns: list[Column] = []
        for number, cell in enumerate(cut(lines[at], delimiter), start=1):
            name, _, spelled = cell.rpartition(" - ")
            name, spelled = (name, spelled) if name else (cell, "")
            columns.append(Column(number=number, name=name, unit=spelled or _WITHOUT.get(name.lower(), "")))
        assigned = assign(columns[1:], _NAMES, where=f"{where}, line {at + 1}", fix=_FIX)
        stamps = [cells[0] for line in lines[at + 1 :] if (cells := cut(line, delimiter))]
        form, found = stamp_format(stamps, options, f"{where}, line {at + 2}")
        export = Export(
            name=self.name,
            file=FileLayout(delimiter=delimiter, decimal="," if delimiter == ";" else ".", preamble=at),
            time=TimeLayout(columns=(1,), format=form),
            sensor=_SENSOR,
            assigned=assigned,
            described_by="Davis' help of weatherlink.com",
            averaged=True,
            compass=_directions(assigned.channels),
        )
        return read_export(source, export, options).with_findings(found)


# Specification of the Vantage Pro2 anemometer: ±5 % or ±0.9 m/s (2 mph), resolution 1 mph; the limits are taken as
# rectangular (JCGM 100:2008, 4.3.7): divided by √3.
_SENSOR = Sensor(name="Davis anemometer", resolution=0.44704, accuracy=0.52, accuracy_relative=0.0289)


def _about_unit(spelled: str, shown: str | None, *, said: bool) -> tuple[Finding, ...]:
    """How the unit is known, and that the speeds show another one than the user says."""
    if said and shown in (None, spelled):
        return ()
    text = f"wind is in {spelled}, as you said, but its values are whole miles per hour converted to {shown}"
    fix = f"check the unit set in the program; if it is {shown}: --unit {shown}"
    if said:
        return (Finding(kind="unit-doubtful", severity=Severity.WARNING, what=text, fix=fix),)
    text = f"the export carries no units: wind is in {spelled}, since its values are whole miles per hour converted"
    return (Finding(kind="unit-from-resolution", severity=Severity.WARNING, what=text, fix=_FIX),)


def _directions(channels: Mapping[str, ChannelLayout]) -> tuple[int, ...]:
    return tuple(int(layout.column) for name, layout in channels.items() if name == "wind_direction")


def _program(lines: Sequence[str]) -> list[Column] | None:
    """The columns of the program's export: each name is in two lines.

    A column Dir right beside Wind Speed is the wind's, wherever "Wind" stands in the line above.
    """
    if len(lines) < 3:
        return None
    upper, lower = lines[0].lstrip("\ufeff"), lines[1]
    if "\t" in lower:
        first, second = cut(upper, "\t"), cut(lower, "\t")
        first += [""] * (len(second) - len(first))
        names = [f"{a} {b}".strip() for a, b in zip(first, second, strict=False)]
    else:
        names = _above(upper, lower)
    names = [
        "Wind Dir" if name.lower() == "dir" and before.lower() == "wind speed" else name
        for before, name in zip(["", *names], names, strict=False)
    ]
    if [name.lower() for name in names[:2]] != ["date", "time"] or "wind speed" not in map(str.lower, names):
        return None
    if sum(unit_of(word) is not None for word in lines[2][:2000].split()) > 1:
        return None  # the program writes no line of units: it is another's table
    return [Column(number=number, name=name) for number, name in enumerate(names, start=1)]


def _gusts(columns: Sequence[Column], spelled: str, form: str) -> tuple[Finding, ...]:
    """The finding that offers the gusts of the program's export as a wind of their own; none where it has none."""
    by_name = {column.name.lower(): column.number for column in reversed(columns)}
    speed, direction = by_name.get("hi speed"), by_name.get("hi dir")
    if speed is None:
        return ()
    date, _, time = form.partition(" ")
    line = f"1=date[{date}],2=time[{time}],{speed}=wind_speed[{spelled}]"
    line += f",{direction}=wind_direction[points]" if direction is not None else ""
    what = "column 'Hi Speed' is the highest speed of each interval and is not read; to read it as a wind of its own, "
    what += f'ingest the file once more with --columns "{line}"'
    return (Finding(kind="columns-not-read", severity=Severity.NOTE, count=1, what=what),)


def _above(upper: str, lower: str) -> list[str]:
    """Words of the lower line, each after the word of the upper line that stands above it."""
    words = [(match.start(), match.end(), match[0]) for match in re.finditer(r"\S+", upper[:2000])]
    names: list[str] = []
    for match in re.finditer(r"\S+", lower[:2000]):
        over = [word for start, end, word in words if start < match.end() and end > match.start()]
        names.append(" ".join([*over, match[0]]))
    return names


def _site(lines: Sequence[str]) -> int | None:
    for index, line in enumerate(lines[:20]):
        cells = cut(line[:4000], max((",", ";", "\t"), key=line.count))
        if cells and cells[0] == "Date & Time" and any(cell.startswith("Avg Wind Speed - ") for cell in cells):
            return index
    return None


def _cells(rows: Sequence[Sequence[str]], columns: Sequence[int]) -> Iterator[str]:
    """The cells of columns, by their numbers from 1."""
    return (row[number - 1] for row in rows for number in columns if len(row) >= number)


def _unit_of(cells: Iterable[str]) -> str | None:
    """The unit in which all speeds are whole miles per hour, to one decimal; `None` unless there is just one."""
    texts = {cell.replace(",", ".") for cell in cells}
    speeds = {float(text) for text in texts if re.fullmatch(r"\d{1,3}(\.\d)?", text)} - {0.0}
    if len(speeds) < _ENOUGH:
        return None
    fits: list[str] = []
    for name in _PROGRAM_UNITS:
        step = UNITS["mph"].scale / UNITS[name].scale
        if all(abs(round(round(speed / step) * step, 1) - speed) < 0.01 for speed in speeds):
            fits.append(name)
    return fits[0] if len(fits) == 1 else None
