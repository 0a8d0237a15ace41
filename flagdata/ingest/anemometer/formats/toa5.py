"""Campbell Scientific TOA5: four header lines, quoted stamps, a record number a row.

Source: Campbell Scientific, LoggerNet Instruction Manual, appendix "Campbell Scientific File Formats"; diagnostics:
CSAT3 Instruction Manual, diagnostic word (bits 12 to 15 are warnings, bits 0 to 5 count measurements). A table that a
spreadsheet has saved again is read too: no quotes, commas that pad the first line, dates in the computer's own order.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import InputError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.formats.described import names
from flagdata.ingest.anemometer.formats.exports import Assigned, column_findings, known_unit, stamp_format
from flagdata.ingest.anemometer.options import WindOptions
from flagdata.ingest.anemometer.reading import Reading
from flagdata.ingest.anemometer.recipe import ChannelLayout, FileLayout, Recipe, TimeLayout
from flagdata.ingest.anemometer.sniffing import Guess, Head
from flagdata.ingest.anemometer.table.rowclock import Given
from flagdata.ingest.anemometer.table.sonic import with_horizontal
from flagdata.ingest.anemometer.table.table import read_table
from flagdata.ingest.anemometer.text.rows import RowReader
from flagdata.ingest.anemometer.text.source import TextFile
from flagdata.schema import CHANNELS, SampleFlag
from flagdata.signals import Instants, Sensor
from flagdata.timebase import NANOSECONDS
from flagdata.units import unit

# Field names of Campbell programs, which users choose, → channel; the first that fits a channel is taken.
_NAMES: tuple[tuple[str, str], ...] = (
    (r"u_?x(_.*)?|u_?\d?m?|csat_?u", "wind_x"),
    (r"u_?y(_.*)?|v_?\d?m?|csat_?v", "wind_y"),
    (r"u_?z(_.*)?|w_?\d?m?|csat_?w", "wind_z"),
    (r"ws(_ms)?(_\d+m?)?(_avg|_s_wvt)?|wind_?sp(ee)?d(_ms)?(_avg|_s_wvt)?|w(i)?ndspd.*", "wind_speed"),
    (r"(wd|wind_?dir(ection)?)(_deg)?(_\d+m?)?(_d1_wvt|_smp)?", "wind_direction"),
    (r"t_?sonic(_\d+)?|t_?s(_\d+)?|fw_?ts", "sonic_temperature"),
    (r"air_?t(c|f)?(_avg)?|air_?temp.*|t_?air.*|t_hmp(_avg)?", "air_temperature"),
    (r"rh(_avg)?|rh_hmp(_avg)?", "relative_humidity"),
    (r"press(ure)?(_avg)?|bp(_mbar|_kpa)?(_avg)?|amb_press(_avg)?", "air_pressure"),
)
_DIAGNOSTIC = re.compile(r"diag(_csat|_sonic|nostic)?(_\d+)?|csat_?diag|diag_word", re.IGNORECASE)
_MISSING = ("nan", '"nan"', "-7999", "7999", "-99999", "-2147483648")
_SPREAD = re.compile(r"_(max|min|std|sd|tmx|tmn|tot)(_|$)", re.IGNORECASE)
_WARNINGS = 0xF000
_FORM = "%Y-%m-%d %H:%M:%S%f"
_OWN = re.compile(r"\s*\d{4}-")


class Toa5:
    """Format "toa5"."""

    name = "toa5"
    about = "Campbell Scientific TOA5 table"
    uses = frozenset({"zone", "azimuth", "date_order"})

    def recognise(self, head: Head) -> Guess | None:
        """A first line that begins with "TOA5"."""
        first = head.lines[0].lstrip("\ufeff") if head.lines else ""
        if not first.startswith(('"TOA5"', "TOA5,")):
            return None
        return Guess(format="toa5", score=0.98, reasons=('line 1 begins with "TOA5", Campbell Scientific\'s table',))

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """Read a table whose header names wind speed or wind components."""
        header = self._header(source)
        names, units = header[1], header[2]
        recipe, assigned, found = self._recipe(source, header, options)
        extra = [name for name in names if name == "RECORD" or _DIAGNOSTIC.fullmatch(name)]
        rows = RowReader(source, recipe.file)
        table = read_table(
            rows, recipe, where=str(source.path), zone_name=options.zone, given=Given(clock=options.clock), extra=extra
        )
        flags = table.reading.flags.copy()
        listed = tuple(f"{name} [{units[names.index(name)]}]" for name in assigned.unread)
        found.extend(column_findings(replace(assigned, unread=listed)))
        for name, values in table.extra.items():
            if name == "RECORD":
                found.extend(_continuity(values, table.reading.line))
            else:
                fault = _faults(values)
                if fault.any():
                    flags[fault] |= SampleFlag.SENSOR_FAULT
                    found.append(
                        Finding(
                            kind="sensor-fault", severity=Severity.WARNING, count=int(fault.sum()),
                            where=f"line {table.reading.line[fault][0]}",
                            what=f"{int(fault.sum())} rows in which {name} reports a fault; left out of averages",
                        )
                    )  # fmt: skip
        reading = table.reading.with_findings(tuple(found), flags=flags)
        wind = next(layout.column for name, layout in recipe.channels.items() if name.startswith("wind_"))
        processed = dict(zip(names, header[3], strict=False))
        averaging = _averaging(processed.get(str(wind), ""), reading.time)
        reading = replace(reading, sensor=replace(reading.sensor, averaging=averaging))
        reading = reading.with_findings(_mean_of_angles(recipe, processed))
        return with_horizontal(reading, options.azimuth, where=str(source.path))

    def _header(self, source: TextFile) -> list[list[str]]:
        lines = source.head(4)
        where = str(source.path)
        if len(lines) < 4:
            raise InputError(
                f"the file ends in line {len(lines)}, before the four header lines do", where=where,
                fix="collect the table from the logger again",
            )  # fmt: skip
        rows = [[cell.strip() for cell in row] for row in csv.reader(lines)]
        if len(rows) < 4 or not rows[0] or rows[0][0].lstrip("\ufeff") != "TOA5":
            raise InputError(
                "line 1 does not begin with TOA5", where=f"{where}, line 1", fix="name another format by --as"
            )
        if _stamp_name(rows[1]) is None or len(rows[2]) != len(rows[1]):
            raise InputError(
                "lines 2 and 3 do not name TIMESTAMP and a unit for each column", where=f"{where}, line 2",
                fix="collect the table as TOA5 with header",
            )  # fmt: skip
        return rows

    def _recipe(
        self, source: TextFile, header: list[list[str]], options: WindOptions
    ) -> tuple[Recipe, Assigned, list[Finding]]:
        about, names, units = header[0], header[1], header[2]
        stamp = _stamp_name(names) or "TIMESTAMP"
        channels: dict[str, ChannelLayout] = {}
        taken: dict[str, str] = {}
        unread: list[str] = []
        rivals: list[str] = []
        for name, spelling in zip(names, units, strict=True):
            channel = _channel(name)
            if channel is not None and not channel.startswith("wind_") and _SPREAD.search(name):
                channel = None  # the maximum of a day is not its mean
            if channel is None or channel in channels:
                if channel is not None and channel.startswith("wind_") and CHANNELS[channel].unit == "m/s":
                    rivals.append(name)
                elif name not in (stamp, "RECORD") and not _DIAGNOSTIC.fullmatch(name):
                    unread.append(name)
                continue
            spelled = known_unit(spelling or ("%" if channel == "relative_humidity" else ""))
            if spelled is None or unit(spelled).si != CHANNELS[channel].unit:
                if channel.startswith("wind_"):
                    raise InputError(
                        f"{name} looks like {channel}, but its unit is {spelling!r}", where=f"{source.path}, line 3",
                        fix="correct the unit in the header, or describe the file by a recipe",
                    )  # fmt: skip
                unread.append(name)
                continue
            channels[channel] = ChannelLayout(column=name, unit=spelled)
            taken[channel] = name
        if not {"wind_speed", "wind_x"} & set(channels):
            raise InputError(
                "no column looks like wind speed or a wind component", where=f"{source.path}, line 2",
                fix="let its columns be drafted, and confirm them: --as delimited; or describe the file by a recipe; "
                f"its columns are {', '.join(names)}",
            )  # fmt: skip
        rows = [row[names.index(stamp)] for row in csv.reader(source.head(5000)[4:]) if len(row) == len(names)]
        form, found = _FORM, ()
        own = sum(_OWN.match(text) is not None for text in rows)
        if options.date_order is not None or 2 * own < len(rows):  # a few may be damaged
            form, found = stamp_format(rows, options, f"{source.path}, line 5")
        model = " ".join(cell for cell in about[2:4] if cell)
        recipe = Recipe(
            name="toa5", about="from the file's own header", source="the file",
            file=FileLayout(header=3, preamble=1, missing=_MISSING),
            time=TimeLayout(columns=(stamp,), format=form),
            channels=channels,
            sensor=Sensor(name=f"{about[1] if len(about) > 1 else ''} on {model or 'Campbell logger'}".strip()),
        )  # fmt: skip
        assigned = Assigned(channels=channels, names=taken, unread=tuple(unread), rivals=tuple(rivals))
        return recipe, assigned, [*found]


def _stamp_name(names: list[str]) -> str | None:
    return next((name for name in names if name.upper() == "TIMESTAMP"), None)


def _channel(name: str) -> str | None:
    for pattern, channel in (*_NAMES, *names("windographer")):
        if re.fullmatch(pattern, name, re.IGNORECASE):
            return channel
    return None


def _averaging(processing: str, time: Instants) -> float | None:
    """Length of the logger's own averaging [s] by the header's fourth line: "Smp" a sample, "Avg" or "WVc" a mean."""
    kind = processing.strip().lower()
    if kind == "smp":
        return 0.0
    if kind in ("avg", "wvc") and len(time) > 1:
        return float(np.median(np.diff(time))) / NANOSECONDS
    return None


def _mean_of_angles(recipe: Recipe, processed: Mapping[str, str]) -> tuple[Finding, ...]:
    """What is said of a direction that the logger averaged as a number: 350° and 10° make 180° then.

    Args:
        processed: how the logger made each column, as the header's fourth line says.
    """
    layout = recipe.channels.get("wind_direction")
    if layout is None or processed.get(str(layout.column), "").strip().lower() != "avg":
        return ()
    vectors = [name for name in processed if name.endswith("WVc(2)")]  # the second of its numbers is the direction
    beside = f"; {', '.join(repr(name) for name in vectors)} may be the mean of vectors" if vectors else ""
    what = (
        f"{layout.column!r} is the mean of a vane's readings as numbers, which is wrong where they pass north{beside}"
    )
    fix = "have the program average the wind as a vector (WindVector), or read that column: --as delimited --columns"
    return (Finding(kind="direction-mean-of-numbers", severity=Severity.WARNING, what=what, fix=fix),)


def _continuity(record: NDArray[np.float64], line: NDArray[np.int64]) -> tuple[Finding, ...]:
    """Rows lost, repeated or renumbered, by the logger's own count."""
    steps = np.diff(record)
    lost = steps > 1
    back = steps < 0
    found: list[Finding] = []
    if lost.any():
        count = int((steps[lost] - 1).sum())
        found.append(
            Finding(
                kind="records-lost", severity=Severity.WARNING, count=count, where=f"line {line[1:][lost][0]}",
                what=f"{count} record numbers are skipped in {int(lost.sum())} places: rows that the logger made are "
                "not in the file",
            )
        )  # fmt: skip
    if back.any():
        found.append(
            Finding(
                kind="records-restarted", severity=Severity.WARNING, count=int(back.sum()),
                where=f"line {line[1:][back][0]}",
                what=f"the record number goes back {int(back.sum())} times: the logger's program was restarted, or "
                "files were joined",
            )
        )  # fmt: skip
    return tuple(found)


def _faults(values: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Rows whose diagnostic word reports a fault: a warning bit, or, where it does not count measurements, not 0."""
    known = np.isfinite(values) & (np.abs(values) < 2**31)
    word = np.where(known, values, 0).astype(np.int64)
    counting = len(word) > 2 and float((np.diff(word) % 64 == 1).mean()) > 0.5
    return ((word & _WARNINGS) != 0) if counting else (word != 0)
