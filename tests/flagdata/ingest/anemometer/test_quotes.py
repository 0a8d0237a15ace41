"""Quotes in tables: those that enclose cells, those that are signs behind numbers, and those that are never closed."""

from __future__ import annotations

from collections.abc import Callable

from flagdata.signals import WindLog

Read = Callable[..., WindLog]


def test_a_quote_behind_a_number_is_a_sign_and_opens_nothing(read: Read) -> None:
    rows = "".join(f'2026-05-01T12:{at:02d}:00Z,{3 + at % 4}.5,"a, b",0.0{at % 10}"\n' for at in range(12))
    log = read(f"time,wind speed (m/s),note,rain\n{rows}")
    assert len(log.series) == 12
    assert "malformed-lines" not in {finding.kind for finding in log.findings}


def test_a_quote_that_begins_a_cell_and_is_not_closed_makes_a_line_that_is_left_out(read: Read) -> None:
    rows = [f'2026-05-01T12:{at:02d}:00Z,{3 + at % 4}.5,"a"' for at in range(12)]
    rows[5] = '2026-05-01T12:05:00Z,3.5,"a'
    log = read("time,wind speed (m/s),note\n" + "\n".join(rows) + "\n")
    assert len(log.series) == 11
    assert "malformed-lines" in {finding.kind for finding in log.findings}
