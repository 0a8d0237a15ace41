"""The clock of a table's rows: stamps as their blocks come in, the order of the rows, and their instants in UTC."""

# pyarrow.compute makes its functions at import, where a type checker cannot see them.
# pyright: reportAttributeAccessIssue=false
from __future__ import annotations

import datetime as dt
import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from flagdata.errors import UsageError, ZoneMissingError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.instants import counted, disorder, twelve, yearless
from flagdata.ingest.anemometer.instants.clock import ClockChoice
from flagdata.ingest.anemometer.instants.midnight import parse_as
from flagdata.ingest.anemometer.instants.stamps import EPOCH, Stamps
from flagdata.ingest.anemometer.instants.stamps import parse as parse_stamps
from flagdata.ingest.anemometer.instants.wall import offset_at, to_utc, zone_advice
from flagdata.ingest.anemometer.text.columns import Columns
from flagdata.ingest.anemometer.text.growing import Growing
from flagdata.signals import Instants
from flagdata.timebase import zone

NEWEST_FIRST = 0.9
"""Share of rows older than the row before them from which a log is a list with the newest row on top."""

Block: TypeAlias = Columns | Sequence[Sequence[str]]
"""Rows of cells, or their columns."""
Order: TypeAlias = slice | NDArray[np.int64]
"""Rows of a table, by a slice or by their indices."""


@dataclass(frozen=True, kw_only=True)
class Given:
    """What the user says about time beside the zone.

    Attributes:
        start: the first row's instant [UTC ns].
        date: its day.
        clock: whose stamps are right where they run back.
    """

    start: int | None = None
    date: dt.date | None = None
    clock: ClockChoice | None = None


@dataclass
class RowClock:
    """One clock's stamps as their blocks come in."""

    form: str
    columns: list[int]
    step: int = 2**62
    bare_dates: int = 0
    bare_hours: int = 0
    ns: Growing[np.int64] = field(default_factory=lambda: Growing(np.int64))
    utc: Growing[np.bool_] = field(default_factory=lambda: Growing(np.bool_))

    def parse(self, block: Block) -> Stamps:
        if len(self.columns) == 1:
            texts = cells_of(block, self.columns[0])
        elif isinstance(block, Columns):
            texts = block.joined(self.columns)
        else:
            texts = [" ".join(row[i].strip() for i in self.columns) for row in block]
        stamps, bare = parse_as(texts, self.form)
        self.bare_dates += bare
        return self._with_bare_hours(texts, stamps)

    def _with_bare_hours(self, texts: Sequence[str] | pa.StringArray, stamps: Stamps) -> Stamps:
        """The stamps with those read that have no AM or PM among others that do: as of a clock of 24 hours."""
        if "%p" not in self.form:
            return stamps
        text: Any = texts if isinstance(texts, pa.StringArray) else pa.array(texts, pa.string())
        half = pc.match_substring_regex(text, r"(?i)\d\s?[ap]\.?(?:m\.?)?(?:[\s,;]|$)").to_numpy(zero_copy_only=False)
        bare = ~half.astype(bool)
        if bare.any() and "%I" in self.form:
            either = re.sub(r" ?%p", "%p", self.form.replace("%I", "%H"))
            other = counted.parse(text, either) if counted.needs_date(either) else parse_stamps(text, either)
            bare &= other.valid
            stamps = replace(
                stamps, ns=np.where(bare, other.ns, stamps.ns), utc=np.where(bare, other.utc, stamps.utc),
                valid=stamps.valid | bare,
            )  # fmt: skip
        self.bare_hours += int((bare & stamps.valid).sum())
        return stamps

    def add(self, stamps: Stamps, keep: NDArray[np.bool_]) -> None:
        self.ns.add(stamps.ns[keep])
        self.utc.add(stamps.utc[keep])
        self.step = min(self.step, stamps.step)

    def stated(self) -> bool:
        """Whether every stamp states its zone, as Unix times do, or needs none, as counts since a start."""
        return counted.is_elapsed(self.form) or bool(self.utc.view().all())

    def order(self, line: NDArray[np.int64], choice: ClockChoice | None) -> tuple[Order, tuple[Finding, ...]]:
        """The rows from the oldest on, for logs that list the newest first or out of order; and what is said of it.

        Args:
            line: (n,) numbers of the rows' lines, for messages.
            choice: what the user says of stamps that run back.
        """
        wall = self.ns.view()
        steps = np.diff(wall)
        turned = len(steps) > 1 and float((steps < 0).mean()) > NEWEST_FIRST
        order: Order = slice(None, None, -1) if turned else slice(None)
        found: tuple[Finding, ...] = ()
        if turned:
            text = "the newest row comes first: read from the end"
            found = (Finding(kind="newest-first", severity=Severity.NOTE, count=len(wall), what=text),)
        if counted.is_elapsed(self.form) or (counted.needs_date(self.form) and not yearless.numbered(self.form)):
            return order, found  # the order of the rows is what gives their days
        if self._twelve(wall[order]):
            return order, found
        sorting = disorder.sorting(wall[order], choice)
        if sorting is None:
            return order, found
        return np.arange(len(wall))[order][sorting.order], (*found, sorting.finding(line[order]))

    def _twelve(self, wall: NDArray[np.int64]) -> bool:
        """Whether the stamps, in the order of the rows, are of a clock of twelve hours without AM or PM."""
        if self.form in counted.FORMS or self.form in EPOCH or "%p" in self.form or yearless.is_yearless(self.form):
            return False
        return not self.utc.view().any() and twelve.is_twelve(wall, dated=not counted.is_time_of_day(self.form))

    def instants(
        self, order: Order, *, line: NDArray[np.int64], zone_name: str | None, where: str, given: Given
    ) -> tuple[Instants, tuple[Finding, ...]]:
        """The instants and what was found; the blocks are let go."""
        wall, utc = self.ns.view()[order], self.utc.view()[order]
        halved = self._twelve(wall)
        self.ns, self.utc = Growing(np.int64), Growing(np.bool_)
        if counted.is_elapsed(self.form):
            return counted.since_start(wall, self.form, start=given.start, line=line, where=where)
        found: tuple[Finding, ...] = ()
        if halved:
            dated = not counted.is_time_of_day(self.form)
            start = None
            if given.start is not None:
                place = zone(zone_name) if zone_name is not None else None
                start = given.start + (offset_at(place, given.start) if place is not None else 0)
            wall, found = twelve.resolved(wall, dated=dated, start=start, line=line, where=where)
        elif counted.is_time_of_day(self.form):
            wall, found = counted.on_days(wall, date=given.date, line=line, where=where)
        elif yearless.is_yearless(self.form):
            wall, found = yearless.on_years(wall, self.form, date=given.date, line=line, where=where)
        elif given.start is not None or given.date is not None:
            option = "--start" if given.start is not None else "--date"
            raise UsageError(f"the stamps say when they were: {option} is not used", where=where, fix="leave it out")
        if self.bare_dates:
            what = f"{self.bare_dates} stamps are dates without a time among others with one: read as midnight"
            bare = Finding(kind="bare-dates", severity=Severity.NOTE, count=self.bare_dates, what=what)
            found = (*found, bare)
        if self.bare_hours:
            what = f"{self.bare_hours} of {len(wall)} stamps have no AM or PM, as others do: taken as of 24 hours"
            fix = "if they are of 12 hours as well, export the log with AM and PM, or with a clock of 24 hours"
            mixed = Finding(
                kind="mixed-clocks", severity=Severity.WARNING, count=self.bare_hours, what=what, fix=fix
            )  # fmt: skip
            found = (*found, mixed)
        time, further = instants(wall, utc, line=line, zone_name=zone_name, where=where)
        return time, (*found, *further)


def cells_of(block: Block, index: int) -> Sequence[str] | pa.StringArray:
    """The cells of one column."""
    return block.column(index) if isinstance(block, Columns) else [row[index] for row in block]


def instants(
    wall: NDArray[np.int64], utc: NDArray[np.bool_], *, line: NDArray[np.int64], zone_name: str | None, where: str
) -> tuple[Instants, tuple[Finding, ...]]:
    """UTC nanoseconds of stamps, some of which may state their own zone.

    Raises:
        TimeError: stamps without a zone and none named, or impossible in it.
    """
    if utc.all():
        return wall, ()
    if zone_name is None:
        at = int(np.flatnonzero(~utc)[0])
        raise ZoneMissingError(
            "the stamps carry no time zone", where=f"{where}, line {line[at]}", fix=zone_advice(wall, line)
        )  # fmt: skip
    time = wall.copy()
    rows = ~utc
    time[rows], found = to_utc(wall[rows], zone(zone_name), lines=line[rows], where=where)
    return time, found
