"""Rows that repeat a stamp and all their values are copies of one row: left out and told, never spread."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable, Sequence

import numpy as np
import pytest

from flagdata.findings import Severity
from flagdata.rng import stream
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
START = dt.datetime(2026, 5, 1, 12)  # noqa: DTZ001
SPEEDS = np.round(stream(21, "copies").uniform(2, 9, 60), 1)


def log(copies: Sequence[int], *, step: float = 60, speeds: Sequence[float] | None = None) -> str:
    """A row at each `step` [s], as often as `copies` says."""
    known = SPEEDS if speeds is None else speeds
    lines = [
        f"{START + dt.timedelta(seconds=step * at)},{known[at]},{200 + at}\n" * many for at, many in enumerate(copies)
    ]
    return "time,wind speed (m/s),wind dir (deg)\n" + "".join(lines)


@pytest.mark.parametrize(
    ("copies", "step", "alike"),
    [
        ([5] * 30, 60, 5), ([5] * 30, 1, 5), ([2] * 3, 60, 2), ([5] * 4, 600, 5),
        ([1, 1, 1, 1, 5, *[1] * 7], 60, 5), ([1, 2, 1], 60, 2), ([5], 60, 5), ([3, 1, 2, 4, 1, 1, 5, 2], 60, 5),
    ],
)  # fmt: skip
def test_copies_of_a_row_are_left_out_whatever_their_number(
    copies: list[int], step: float, alike: int, read: Read
) -> None:
    found = read(log(copies, step=step), zone="UTC")
    seconds = (found.series.time - found.series.time[0]) / 1e9
    assert seconds.tolist() == [step * at for at in range(len(copies))]
    assert found.series.channels["wind_speed"].tolist() == SPEEDS[: len(copies)].tolist()
    assert not found.series.flags.any()
    (finding,) = found.findings
    assert (finding.kind, finding.severity, finding.count) == (
        "duplicate-rows", Severity.WARNING, sum(copies) - len(copies),
    )  # fmt: skip
    assert "left out as copies" in finding.what
    assert (f"up to {alike} rows alike" in finding.what) == (alike > 2)


def test_alike_readings_below_a_coarse_stamp_are_no_copies(read: Read) -> None:
    # 5 Hz, stamps to the second, a light wind that reads the same twice in three rows
    levels = np.cumsum(stream(22, "copies").random(200) < 0.35) % 7 / 10 + 1.0
    lines = [f"{START + dt.timedelta(seconds=at // 5)},{level:.1f},200\n" for at, level in enumerate(levels)]
    found = read("time,wind speed (m/s),wind dir (deg)\n" + "".join(lines), zone="UTC")
    assert len(found.series) == 200
    assert "coarse-stamps" in {finding.kind for finding in found.findings}


def test_a_wind_that_never_changes_does_not_show_whether_its_rows_are_copies(read: Read) -> None:
    lines = [f"{START + dt.timedelta(seconds=at // 5)},3.0,200\n" for at in range(200)]
    found = read("time,wind speed (m/s),wind dir (deg)\n" + "".join(lines), zone="UTC")
    assert len(found.series) == 200
    assert "duplicate-rows" not in {finding.kind for finding in found.findings}


def test_rows_of_one_stamp_with_other_values_are_still_spread(read: Read) -> None:
    lines = [f"{START + dt.timedelta(minutes=at // 5)},{2 + at % 7}.5,200\n" for at in range(100)]
    found = read("time,wind speed (m/s),wind dir (deg)\n" + "".join(lines), zone="UTC")
    assert len(found.series) == 100
    assert "held-stamps" in {finding.kind for finding in found.findings}


def test_rows_that_differ_in_a_cell_that_is_not_read_are_no_copies(read: Read) -> None:
    seconds = [0, 1, 2, 3, 5, 5, 6, 7]
    lines = [
        f"2026-05-01T12:00:0{second}Z,{310 + at},{[3, 4, 5, 6, 7, 7, 8, 9][at]}.5\n"
        for at, second in enumerate(seconds)
    ]
    found = read("time,count,wind speed (m/s)\n" + "".join(lines))
    assert len(found.series) == 8
    assert "duplicate-rows" not in {finding.kind for finding in found.findings}


def test_rows_alike_in_all_cells_are_copies_whatever_is_read(read: Read) -> None:
    lines = [f"2026-05-01T12:00:0{at}Z,{310 + at},{3 + at}.5\n" * (2 if at == 4 else 1) for at in range(7)]
    found = read("time,count,wind speed (m/s)\n" + "".join(lines))
    assert len(found.series) == 7
    assert "duplicate-rows" in {finding.kind for finding in found.findings}
