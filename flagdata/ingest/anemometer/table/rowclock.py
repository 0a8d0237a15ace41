"""The times of a table's rows: collects their stamps block by block, finds the rows' order,
converts them to UTC."""

from __future__ import annotations

import datetime as dt
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
import pyarrow as pa

from flagdata.core.arrays import BoolArray, IntArray
from flagdata.core.findings import Finding
from flagdata.errors import UsageError
from flagdata.ingest.anemometer.instants import dates, log_clock, stamp_text, zones
from flagdata.ingest.anemometer.instants.log_clock import ClockChoice
from flagdata.ingest.anemometer.instants.stamp_text import Stamps
from flagdata.ingest.anemometer.text.columns import Columns
from flagdata.ingest.anemometer.text.text_cells import Growing
from flagdata.record.signals import Instants

NEWEST_FIRST = 0.9
"""Share of rows older than the row before them from which a log is a list with the newest row on
top."""

Block: TypeAlias = Columns | Sequence[Sequence[str]]
"""Rows of cells, or their columns."""
Order: TypeAlias = slice | IntArray
"""Rows of a table, by a slice or by their indices."""


@dataclass(frozen=True, kw_only=True)
class StatedTime:
    """What the user says about time beside the zone.

    Attributes:
        start: the first row's instant [UTC ns].
        date: its day.
        clock: which stamps are right where time runs back, see `ClockChoice`.
    """

    start: int | None = None
    date: dt.date | None = None
    clock: ClockChoice | None = None


@dataclass
class RowClock:
    """Collects the stamps of one clock block by block.

    Attributes:
        form: of the stamps, as a recipe names it.
        columns: that make up a stamp.
        step: finest resolution so far [ns].
        bare_dates: stamps without a time of day.
        ns, utc: see `Stamps`; of the rows kept.
    """

    form: str
    columns: list[int]
    step: int = 2**62
    bare_dates: int = 0
    ns: Growing[np.int64] = field(default_factory=lambda: Growing(np.int64))
    utc: Growing[np.bool_] = field(default_factory=lambda: Growing(np.bool_))

    def parse(self, block: Block) -> Stamps:
        if len(self.columns) == 1:
            texts = cells_of(block, self.columns[0])
        elif isinstance(block, Columns):
            texts = block.joined(self.columns)
        else:
            texts = [" ".join(row[i].strip() for i in self.columns) for row in block]
        stamps, bare = dates.parse(texts, self.form)
        self.bare_dates += bare
        return stamps

    def add(self, stamps: Stamps, keep: BoolArray) -> None:
        self.ns.add(stamps.ns[keep])
        self.utc.add(stamps.utc[keep])
        self.step = min(self.step, stamps.step)

    def needs_no_zone(self) -> bool:
        """Checks whether no zone has to be known: every stamp states its own, as Unix times do, or
        all count from a start."""
        return dates.is_elapsed(self.form) or bool(self.utc.view().all())

    def order(
        self, line: IntArray, choice: ClockChoice | None
    ) -> tuple[Order, tuple[Finding, ...]]:
        """Orders the rows from the oldest on, for logs that list the newest first or out of order;
        also returns its findings.

        Args:
            line: (n,) numbers of the rows' lines, for messages.
            choice: what the user says of stamps that run back.
        """
        wall = self.ns.view()
        steps = np.diff(wall)
        turned = len(steps) > 1 and float((steps < 0).mean()) > NEWEST_FIRST
        order: Order = slice(None, None, -1) if turned else slice(None)
        findings: tuple[Finding, ...] = ()
        if turned:
            text = "the newest row comes first: read from the end"
            findings = (Finding.of("newest-first", text, count=len(wall)),)
        if dates.is_elapsed(self.form) or dates.needs_date(self.form):
            # such stamps have no day of their own: it follows from the rows' order, so they are not
            # sorted
            return order, findings
        sorting = log_clock.sorted_as_given(wall[order], line[order], choice)
        if sorting is None:
            return order, findings
        return np.arange(len(wall))[order][sorting[0]], (*findings, sorting[1])

    def instants(
        self,
        order: Order,
        *,
        line: IntArray,
        zone_name: str | None,
        where: str,
        stamp_options: StatedTime,
    ) -> tuple[Instants, tuple[Finding, ...]]:
        """Converts the stamps to instants and reports what was odd; the blocks are released."""
        wall, utc = self.ns.view()[order], self.utc.view()[order]
        self.ns, self.utc = Growing(np.int64), Growing(np.bool_)
        if dates.is_elapsed(self.form):
            return dates.since_start(
                wall, self.form, start=stamp_options.start, line=line, where=where
            )
        if self.form not in stamp_text.NAMED and "%p" not in self.form and not utc.any():
            dates.refuse_twelve(wall, line=line, where=where)
        findings: tuple[Finding, ...] = ()
        if dates.needs_date(self.form):
            wall, findings = dates.complete_dates(
                wall, self.form, date=stamp_options.date, line=line, where=where
            )
        elif stamp_options.start is not None or stamp_options.date is not None:
            option = "--start" if stamp_options.start is not None else "--date"
            raise UsageError(
                f"the stamps say when they were: {option} is not used",
                where=where,
                fix="leave it out",
            )
        if self.bare_dates:
            message = (
                f"{self.bare_dates} stamps are dates without a time among others with one: read as "
                "midnight"
            )
            bare = Finding.of("bare-dates", message, count=self.bare_dates)
            findings = (*findings, bare)
        time, further = zones.instants(wall, utc, line=line, zone_name=zone_name, where=where)
        return time, (*findings, *further)


def cells_of(block: Block, index: int) -> Sequence[str] | pa.StringArray:
    """Returns the cells of one column."""
    return block.column(index) if isinstance(block, Columns) else [row[index] for row in block]
