"""Rows whose quotes hold line breaks are read whole; a quote that is damage takes nothing in."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from flagdata.signals import WindLog

Read = Callable[..., WindLog]
HEAD = '"time","wind speed [m/s]","wind dir [deg]","remark"\n'


def row(at: int, remark: str) -> str:
    return f'2026-05-01T12:{at:02d}:00Z,{3 + at % 5}.5,{200 + at},"{remark}"\n'


def speeds(log: WindLog) -> list[float]:
    return log.series.channels["wind_speed"].tolist()


def test_rows_over_several_lines_are_all_read(read: Read) -> None:
    text = HEAD + "".join(row(at, "across \nthe flow" if at % 3 else "plain, with a comma") for at in range(40))
    assert speeds(read(text)) == [3.5 + at % 5 for at in range(40)]


def test_a_quote_that_is_never_closed_takes_no_rows_in(read: Read) -> None:
    rows = [row(at, "two\nlines" if at in (2, 5, 8) else "one") for at in range(40)]
    rows[20] = rows[20].replace('"one"', '"one')
    log = read(HEAD + "".join(rows))
    assert speeds(log) == [3.5 + at % 5 for at in range(40) if at != 20]
    assert any(finding.kind == "malformed-lines" for finding in log.findings)
    assert np.isfinite(log.series.channels["wind_direction"]).all()
