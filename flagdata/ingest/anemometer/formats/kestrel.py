"""Kestrel exports (Kestrel 5000 series by Kestrel LiNK): device lines, a header, units, then rows.

Four traps of real files: a header that promises YYYY-MM-DD over rows in day/month/year, degree signs that went through
two encodings, separators that follow the computer's region, and, from the phone's app, columns whose names (record,
place, notes) stand in the line of units behind the units of the others.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from flagdata.errors import InputError, TimeError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.instants.dates import decide
from flagdata.ingest.anemometer.options import WindOptions
from flagdata.ingest.anemometer.reading import Reading
from flagdata.ingest.anemometer.recipe import ChannelLayout, FileLayout, Recipe, TimeLayout
from flagdata.ingest.anemometer.sniffing import Guess, Head
from flagdata.ingest.anemometer.table.rowclock import Given
from flagdata.ingest.anemometer.table.table import read_table
from flagdata.ingest.anemometer.text.rows import RowReader
from flagdata.ingest.anemometer.text.source import TextFile
from flagdata.signals import Sensor
from flagdata.units import spelled as spelled_unit

# Header of a Kestrel → channel. The sign between words is a degree sign or what became of it.
_COLUMNS: tuple[tuple[str, str], ...] = (
    (r"direction\W+.*true|compass true direction", "wind_direction"),
    (r"direction\W+.*mag.*|compass magnetic direction", "wind_direction_magnetic"),
    (r"wind speed", "wind_speed"),
    (r"temperature", "air_temperature"),
    (r"relative humidity|rel\.? hum\.?", "relative_humidity"),
    (r"station pressure|station p\.?", "air_pressure"),
)
_DEFAULT_UNIT = {"wind_direction": "deg", "wind_direction_magnetic": "deg", "relative_humidity": "%"}
_TIME_HEADER = re.compile(r"formatted date-?_?time|date[ _-]?time|time", re.IGNORECASE)
_TIME_OF_DAY = re.compile(r"\s\d{1,2}:\d{2}(:\d{2})?(\s*[AaPp]\.?[Mm])?\s*$")
# Kestrel 5000 series specification: impeller from 0.6 m/s on, ±3 % of the reading or ±0.1 m/s if that is more,
# resolution 0.1 m/s. The limits are taken as rectangular (JCGM 100:2008, 4.3.7): divided by √3.
_SENSOR = {"threshold": 0.6, "resolution": 0.1, "accuracy": 0.058, "accuracy_relative": 0.0173}


@dataclass(frozen=True, kw_only=True)
class _Preamble:
    """Line index of the header, the separator, device facts, names and units of the columns."""

    header: int
    delimiter: str
    device: dict[str, str]
    names: list[str]
    units: list[str]


def _preamble(lines: tuple[str, ...] | list[str]) -> _Preamble | None:
    device: dict[str, str] = {}
    for index, line in enumerate(lines[:20]):
        text = line.lstrip("\ufeff")
        delimiter = max((";", "\t", ","), key=text.count)
        cells = [cell.strip().strip('"') for cell in text.split(delimiter)]
        if len(cells) > 3 and _TIME_HEADER.fullmatch(cells[0]) and any(c.lower() == "wind speed" for c in cells):
            units = (
                [cell.strip().strip('"') for cell in lines[index + 1].split(delimiter)]
                if index + 1 < len(lines)
                else []
            )
            return _Preamble(header=index, delimiter=delimiter, device=device, names=cells, units=units)
        if len(cells) > 1 and cells[0]:
            device[cells[0].lower()] = cells[1]
    return None


class Kestrel:
    """Format "kestrel"."""

    name = "kestrel"
    about = "Kestrel weather meter export (CSV)"
    uses = frozenset({"zone", "date_order"})

    def recognise(self, head: Head) -> Guess | None:
        """The device lines and a header with a date-time and a wind speed."""
        found = _preamble(head.lines)
        if found is None or not {"device name", "device model"} & set(found.device):
            return None
        model = found.device.get("device model", "of unknown model")
        reasons = (
            f"lines before {found.header + 1} name a device, model {model}, as Kestrel exports do",
            f"line {found.header + 1} begins with {found.names[0]!r} and has a column Wind Speed",
        )
        return Guess(format="kestrel", score=0.96, reasons=reasons)

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """Read the rows, their units from the header, their date order by evidence."""
        where = str(source.path)
        lines = source.head(2000)
        found = _preamble(lines)
        if found is None:
            raise InputError(
                "no header with a date-time and a Wind Speed", where=where, fix="export the session again as CSV"
            )
        channels, unread, note = _channels(found, where)
        rows = [line.split(found.delimiter)[0].strip('" ') for line in lines[found.header + 2 :] if line.strip()]
        if not rows:
            raise InputError("no rows below the header", where=f"{where}, line {found.header + 1}", fix="export again")
        decision = decide(rows, told=options.date_order, where=f"{where}, line {found.header + 3}")
        form = f"{decision.directives()} {_time_directives(rows, where)}"
        # The header of the phone's app names fewer columns than its line of units: the lines are cut by number alone.
        named = 2 if len(found.units) <= len(found.names) or not any(found.units[len(found.names) :]) else 0
        decimal = "," if found.delimiter == ";" and any("," in line for line in lines[found.header + 2 :]) else "."
        recipe = Recipe(
            name="kestrel", about="from the file's own header", source="the file",
            file=FileLayout(
                delimiter=found.delimiter, decimal=decimal, preamble=found.header + 2 - named, header=named,
                missing=("***.*",),
            ),
            time=TimeLayout(columns=(1,), format=form),
            channels=channels,
            sensor=Sensor(name=f"Kestrel {found.device.get('device model', '')}".strip(), **_SENSOR),
        )  # fmt: skip
        claimed = found.units[0] if found.units else ""
        contradicted = decision.order != "ymd" and claimed.upper().startswith("YYYY")
        findings = [
            Finding(
                kind="date-order", severity=Severity.WARNING if contradicted else Severity.NOTE,
                what=f"dates are read as {decision.order}: {decision.reason}; the header says {claimed!r}",
            )
        ]  # fmt: skip
        if note:
            findings.append(
                Finding(kind="units-repaired", severity=Severity.NOTE, count=len(note), what="; ".join(note))
            )
        if unread:
            text = ", ".join(unread)
            findings.append(Finding(kind="columns-not-read", severity=Severity.NOTE, count=len(unread), what=text))
        table = read_table(
            RowReader(source, recipe.file),
            recipe,
            where=where,
            zone_name=options.zone,
            given=Given(clock=options.clock),
        )
        return table.reading.with_findings(tuple(findings))


def _channels(found: _Preamble, where: str) -> tuple[dict[str, ChannelLayout], list[str], list[str]]:
    """Channels by header, columns not read, and units that had to be repaired."""
    channels: dict[str, ChannelLayout] = {}
    unread: list[str] = []
    repaired: list[str] = []
    units = [*found.units, *[""] * len(found.names)]
    for number, name in enumerate(found.names[1:], start=2):
        short = name[:80]  # a header cell of any length must not cost more
        channel = next((c for pattern, c in _COLUMNS if re.fullmatch(pattern, short, re.IGNORECASE)), None)
        if channel is None or channel in channels:
            if name:
                unread.append(name)
            continue
        spelled = units[number - 1]
        known = _unit(spelled, channel)
        if known is None:
            raise InputError(
                f"{name} is in {spelled!r}", where=f"{where}, line {found.header + 2}",
                fix="set the device to m/s, km/h, kt, mph or ft/min (Beaufort is a scale of classes) and export again",
            )  # fmt: skip
        if known != spelled and not spelled.isascii():
            repaired.append(f"{name}: {spelled!r} is read as {known}")
        channels[channel] = ChannelLayout(
            column=number, unit=known, range=_RANGES.get(channel) if known == "m/s" else None
        )
    if "wind_speed" not in channels:
        raise InputError("no column Wind Speed", where=f"{where}, line {found.header + 1}", fix="export it too")
    return channels, unread, repaired


_RANGES = {"wind_speed": (0.0, 60.0)}


def _unit(spelled: str, channel: str) -> str | None:
    """The unit a cell means, degree signs repaired; `None` where it cannot be told."""
    for text in (spelled, spelled.encode("ascii", "ignore").decode().strip()):
        known = spelled_unit(text)
        if known is not None:
            return known
    bare = spelled.encode("ascii", "ignore").decode().strip()
    return _DEFAULT_UNIT.get(channel) if not bare else None


def _time_directives(rows: list[str], where: str) -> str:
    for text in rows:
        match = _TIME_OF_DAY.search(text)
        if match:
            seconds = ":%S" if match[1] else ""
            return f"%I:%M{seconds} %p" if match[2] else f"%H:%M{seconds}"
    raise TimeError(f"no time of day in {rows[0]!r}", where=where, fix="export date and time")
