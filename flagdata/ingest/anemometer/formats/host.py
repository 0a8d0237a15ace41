"""Raw lines of a serial port with the stamp of the computer that logged them:
`laptop_time,raw_line`."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from flagdata.core.arrays import IntArray
from flagdata.core.findings import Finding
from flagdata.errors import InputError, UsageError
from flagdata.ingest.anemometer import sensor_recipe as recipes
from flagdata.ingest.anemometer.log_reading import Reading, with_horizontal
from flagdata.ingest.anemometer.sensor_recipe import Recipe
from flagdata.ingest.anemometer.sniffing import Guess, Head
from flagdata.ingest.anemometer.table.log_table import read_table
from flagdata.ingest.anemometer.table.rowclock import StatedTime
from flagdata.ingest.anemometer.text.text_file import TextFile
from flagdata.ingest.anemometer.wind_options import WindOptions

# Possessive quantifiers: a line of 60,000 blanks or digits must not take quadratic time.
_FIELD = (
    r"[ \t]*+(?:[+-]?(?:\d++(?:{mark}\d*+)?|{mark}\d++)(?:[eE][+-]?\d++)?"
    r"|[+-]?[nN][aA][nN]|[+-]?[iI][nN][fF]|-{{2,}}+|)[ \t]*+"
)
_STAMP = re.compile(r"^\d{4}-\d{2}-\d{2}[T ]\d{2}:\d{2}:\d{2}|^\d{10}(?:\.\d+)?(?=[,;\t])")
_RAW = re.compile(r"raw|line|message|payload|sentence|serial", re.IGNORECASE)
LEAST = 0.05
"""Share of lines that must be data: devices print menus and counters, but a log of nothing else is
no log."""


class HostStamped:
    """Format "host-stamped": a recipe whose [file] names the host's stamp."""

    name = "host-stamped"
    about = "raw serial lines, each after the stamp of the computer that logged it"
    uses = frozenset({"zone", "azimuth"})

    def recognise(self, head: Head) -> Guess | None:
        """Recognises raw lines below a header that speaks of them: by the recipe whose fields most
        lines have, within its ranges."""
        lines = [line for line in head.lines if _STAMP.match(line)]
        first = head.lines[0] if head.lines else ""
        if (
            len(lines) < max(1, len(head.lines) // 2)
            or lines[0] == first
            or not _RAW.search(first.partition(",")[2])
        ):
            return None
        shares = {
            name: sum(_in_range(recipe, line) for line in lines) / len(lines)
            for name in recipes.SENSORS.names()
            if isinstance(recipe := recipes.load(name), Recipe) and recipe.file.host
        }
        name, share = max(shares.items(), key=lambda item: item[1])
        if share <= LEAST:
            return None
        reasons = (
            f"line 1 names a raw line: {first!r}",
            f"{len(lines)} of the first {len(head.lines)} lines begin with a computer's stamp",
            f"{share:.0%} of them go on with the fields of the recipe {name}",
        )
        return Guess(
            format=self.name, recipe=name, score=max(0.55, min(0.9, share)), reasons=reasons
        )

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """Read a file by the recipe in `options`."""
        if options.recipe is None:
            raise UsageError(
                "the format host-stamped needs a recipe",
                where=str(source.path),
                fix="name one by --recipe",
            )
        recipe = recipes.load(options.recipe)
        if not isinstance(recipe, Recipe) or not recipe.file.host:
            raise UsageError(
                f"the recipe {recipe.name} says nothing of a host's stamp",
                where=str(source.path),
                fix='add host = "iso" to its [file], or use --as delimited',
            )
        rows = HostRows(source, recipe)
        where = str(source.path)
        reading = read_table(
            rows,
            recipe,
            where=where,
            zone_name=options.zone,
            stamp_options=StatedTime(clock=options.clock),
        ).reading
        return with_horizontal(reading, options.azimuth, where=where)


def _shape(recipe: Recipe) -> re.Pattern[str]:
    """Builds the pattern of a raw line of data: numbers in the columns of channels and time,
    anything in others.

    A recipe that uses every column up to its last takes lines of that many fields alone; one that
    leaves columns out takes longer lines too.
    """
    numeric = {int(c.column) for c in recipe.channels.values()} | {
        int(c) for c in recipe.time.columns
    }
    last = max(numeric | {int(c.column) for c in recipe.checks})
    between, number = (
        re.escape(recipe.file.delimiter),
        _FIELD.format(mark=re.escape(recipe.file.decimal)),
    )
    fields = [number if column in numeric else f"[^{between}]*+" for column in range(1, last + 1)]
    rest = "" if len(numeric) == last else f"(?:{between}.*)?"
    return re.compile(f"^{between.join(fields)}{rest}$")


def _payload(line: str, delimiter: str) -> tuple[str, str]:
    stamp, _, raw = line.partition(delimiter)
    raw = raw.strip()
    if len(raw) > 1 and raw[0] == raw[-1] == '"':
        raw = raw[1:-1].replace('""', '"')
    return stamp.strip(), raw


def _in_range(recipe: Recipe, line: str) -> bool:
    raw = _payload(line, recipe.file.delimiter)[1]
    if not _shape(recipe).match(raw):
        return False
    cells = raw.split(recipe.file.delimiter)
    if not all(cells[int(check.column) - 1].strip() in check.values for check in recipe.checks):
        return False
    for layout in recipe.channels.values():
        try:
            value = float(cells[int(layout.column) - 1].replace(",", "."))
        except ValueError:
            continue
        if layout.range is not None and not layout.range[0] <= value <= layout.range[1]:
            return False
    return True


class HostRows:
    """Rows of [host stamp, field, field, …] out of stamped raw lines; other lines are counted, not
    read."""

    header: list[str] | None = None
    shift = 1

    def __init__(self, source: TextFile, recipe: Recipe) -> None:
        self._source = source
        self._layout = recipe.file
        self._shape = _shape(recipe)
        self._other: list[int] = []
        self._read = 0
        self.first_line = recipe.file.header + 1

    def blocks(self, width: int) -> Iterator[tuple[IntArray, list[list[str]]]]:
        """Yields line numbers and rows of `width` cells."""
        delimiter = self._layout.delimiter
        for first, lines in self._source.blocks():
            numbers: list[int] = []
            rows: list[list[str]] = []
            for number, line in enumerate(lines, start=first):
                if not line.strip(" \t\x00") or (
                    number < self.first_line and not _STAMP.match(line)
                ):
                    continue
                stamp, raw = _payload(line, delimiter)
                if raw and self._shape.match(raw):
                    row = [stamp, *raw.split(delimiter)]
                    if len(row) >= width:
                        numbers.append(number)
                        rows.append(row)
                        continue
                self._other.append(number)
            self._read += len(rows)
            if rows:
                yield np.array(numbers, dtype=np.int64), rows

    def findings(self) -> tuple[Finding, ...]:
        """Lines that are no data; complete when `blocks` has been read.

        Raises:
            InputError: hardly any line is data.
        """
        left_out = len(self._other)
        if not left_out:
            return ()
        if self._read < LEAST * (self._read + left_out):
            raise InputError(
                f"{left_out} of {left_out + self._read} lines do not have the fields of the recipe",
                where=f"{self._source.path}, line {self._other[0]}",
                fix="check the recipe, or the device's settings",
            )
        return (
            Finding.of(
                "non-data-lines",
                f"{left_out} lines without the fields of a reading (counters, menus, fragments); "
                "left out",
                count=left_out,
                where=f"line {self._other[0]}",
            ),
        )
