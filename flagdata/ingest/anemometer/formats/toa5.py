"""Campbell Scientific TOA5: four header lines, quoted stamps, a record number a row.

The columns are described in catalogs/sensors/formats/toa5.toml; here is what a table of names
cannot say: the logger's count of records, diagnostic words and how each column was made. Source:
Campbell Scientific, CSAT3 Instruction Manual, diagnostic word (bits 12 to 15 are warnings, bits 0
to 5 count measurements). A table that a spreadsheet has saved again
is read too: no quotes, commas that pad the first line, dates in the computer's own order.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flagdata.core.arrays import BoolArray, FloatArray, IntArray
from flagdata.core.findings import Finding, Severity
from flagdata.core.schema import SampleFlag
from flagdata.errors import InputError
from flagdata.ingest.anemometer.formats.described import Described
from flagdata.ingest.anemometer.log_reading import Reading
from flagdata.ingest.anemometer.sniffing import NAMED, Guess, Head
from flagdata.ingest.anemometer.text.text_file import TextFile
from flagdata.ingest.anemometer.wind_options import WindOptions
from flagdata.record.signals import Instants
from flagdata.timebase import NANOSECONDS

_DIAGNOSTIC = re.compile(r"diag(_csat|_sonic|nostic)?(_\d+)?|csat_?diag|diag_word", re.IGNORECASE)
_WARNINGS = 0xF000


class Toa5(Described):
    """Format "toa5"."""

    def __init__(self) -> None:
        super().__init__("toa5")
        self.uses = self.uses | {"azimuth"}

    def recognise(self, head: Head) -> Guess | None:
        """Recognises a first line that begins with the format's name."""
        guess = super().recognise(head)
        return None if guess is None else replace(guess, score=NAMED)

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """Read a table whose header names wind speed or wind components."""
        header, where = _header(source), str(source.path)
        names, processed = header[1], [*header[3], *[""] * len(header[1])]
        done = self.completed(source, options)
        extra = [name for name in names if name == "RECORD" or _DIAGNOSTIC.fullmatch(name)]
        table = self.table(source, done, options, extra)
        reading, flags, findings = table.reading, table.reading.flags.copy(), list[Finding]()
        for name, values in table.extra.items():
            if name == "RECORD":
                findings.extend(_continuity(values, reading.line))
                continue
            fault = _faults(values)
            flags[fault] |= SampleFlag.SENSOR_FAULT
            message = f"rows in which {name} reports a fault; left out of averages"
            findings.extend(_report("sensor-fault", fault, reading.line, message))
        wind = next(
            column for channel, column in done.channels.items() if channel.startswith("wind_")
        )
        averaging = _averaging(processed[wind.number - 1], reading.time)
        logger = " ".join(cell for cell in header[0][2:4] if cell) or reading.sensor.name
        label = f"{header[0][1] if len(header[0]) > 1 else ''} on {logger}".strip()
        reading = reading.with_findings(tuple(findings), flags=flags)
        reading = replace(reading, sensor=replace(reading.sensor, name=label, averaging=averaging))
        direction = done.channels.get("wind_direction")
        if direction is not None and processed[direction.number - 1].strip().lower() == "avg":
            reading = reading.with_findings((_mean_of_angles(direction.name, names),))
        unread = tuple(
            replace(column, name=f"{column.name} [{column.unit}]")
            for column in done.unread
            if column.name not in extra
        )
        return self.finish_reading(reading, replace(done, unread=unread), options, where=where)


def _header(source: TextFile) -> list[list[str]]:
    lines, where = source.head(4), str(source.path)
    if len(lines) < 4:
        message = f"the file ends in line {len(lines)}, before the four header lines do"
        raise InputError(message, where=where, fix="collect the table from the logger again")
    rows = [[cell.strip() for cell in row] for row in csv.reader(lines)]
    if len(rows) < 4 or not rows[0] or rows[0][0].lstrip("\ufeff") != "TOA5":
        fix = "name another format by --as"
        raise InputError("line 1 does not begin with TOA5", where=f"{where}, line 1", fix=fix)
    if "TIMESTAMP" not in map(str.upper, rows[1]) or len(rows[2]) != len(rows[1]):
        message = "lines 2 and 3 do not name TIMESTAMP and a unit for each column"
        raise InputError(
            message, where=f"{where}, line 2", fix="collect the table as TOA5 with header"
        )
    return rows


def _averaging(processing: str, time: Instants) -> float | None:
    """Reads the length of the logger's own averaging [s] from the header's fourth line: "Smp" a
    sample, "Avg" or "WVc" a mean."""
    kind = processing.strip().lower()
    if kind == "smp":
        return 0.0
    if kind in ("avg", "wvc") and len(time) > 1:
        return float(np.median(np.diff(time))) / NANOSECONDS
    return None


def _mean_of_angles(name: str, names: Sequence[str]) -> Finding:
    """Reports a direction that the logger averaged as a number: 350° and 10° make 180° then."""
    vectors = [
        column for column in names if column.endswith("WVc(2)")
    ]  # the second of its numbers is the direction
    alternative = (
        f"; {', '.join(repr(column) for column in vectors)} may be the mean of vectors"
        if vectors
        else ""
    )
    message = (
        f"{name!r} is the mean of a vane's readings as numbers, which is wrong where they pass "
        f"north{alternative}"
    )
    fix = (
        "have the program average the wind as a vector (WindVector), or read that column: --as "
        "delimited --columns"
    )
    return Finding.of("direction-mean-of-numbers", message, fix=fix)


def _continuity(record: FloatArray, line: IntArray) -> tuple[Finding, ...]:
    """Rows lost, repeated or renumbered, by the logger's own count."""
    steps = np.diff(record)
    lost, back = steps > 1, steps < 0
    skipped = int((steps[lost] - 1).sum())
    message = (
        f"record numbers are skipped in {int(lost.sum())} places: rows that the logger made are "
        "not in the file"
    )
    again = (
        "times the record number goes back: the logger's program was restarted, or files were "
        "joined"
    )
    return (
        *_report("records-lost", lost, line[1:], message, count=skipped),
        *_report("records-restarted", back, line[1:], again),
    )


def _report(
    kind: str, rows: BoolArray, line: IntArray, what: str, *, count: int | None = None
) -> tuple[Finding, ...]:
    """Warns of some rows, with their number and the first of them; nothing where there are none."""
    if not rows.any():
        return ()
    count = int(rows.sum()) if count is None else count
    where = f"line {line[rows][0]}"
    return (
        Finding(
            kind=kind, severity=Severity.WARNING, count=count, where=where, what=f"{count} {what}"
        ),
    )


def _faults(values: FloatArray) -> BoolArray:
    """Rows whose diagnostic word reports a fault: a warning bit, or, where it does not count
    measurements, not 0."""
    fits_word = np.isfinite(values) & (np.abs(values) < 2**31)
    word = np.where(fits_word, values, 0).astype(np.int64)
    counting = len(word) > 2 and float((np.diff(word) % 64 == 1).mean()) > 0.5
    return ((word & _WARNINGS) != 0) if counting else (word != 0)
