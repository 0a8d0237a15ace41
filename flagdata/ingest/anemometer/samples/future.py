"""Stamps that lie after the time at which a log is read: its clock or its dates are wrong."""

from __future__ import annotations

from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.reading import Reading
from flagdata.timebase import NANOSECONDS, iso

_DAY = 86_400 * NANOSECONDS
"""Of a wrong zone or a clock that is a little fast nothing is said here."""


def report(reading: Reading, *, now: int) -> tuple[Finding, ...]:
    """The finding about rows that are stamped more than a day after `now` [UTC ns]; none where there are none."""
    late = reading.time > now + _DAY
    count = int(late.sum())
    if count == 0:
        return ()
    rows = "row is" if count == 1 else "rows are"
    return (
        Finding(
            kind="stamps-in-future", severity=Severity.WARNING, count=count, where=f"line {reading.line[late][0]}",
            what=f"{count} {rows} stamped after today, the last {iso(int(reading.time.max()))}: a wrong clock or date",
            fix="check the logger's clock and the order of day, month and year; years of two digits are taken as 1970 "
            "to 2069, and a recording holds none before",
        ),
    )  # fmt: skip
