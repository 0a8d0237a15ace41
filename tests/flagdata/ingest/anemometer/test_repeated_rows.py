"""Rows that are no readings of their own (empty, copied, of a bare date), counters that run over, sums for speeds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import TimeError
from flagdata.findings import Severity
from flagdata.ingest.anemometer.table import cumulated
from flagdata.rng import stream
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
HEADING = "time,wind speed (m/s),wind dir (deg)\n"
NOON = 1_777_636_800 * 10**9
"""2026-05-01T12:00:00Z."""
SPEEDS = np.round(stream(21, "copies").uniform(2, 9, 60), 1)
DATES = (
    'name = "dates"\nabout = "a"\nsource = "b"\n[time]\ncolumns = ["time"]\nformat = "%Y-%m-%d"\n'
    '[channels.wind_speed]\ncolumn = "wind speed (m/s)"\nunit = "m/s"\n[sensor]\nname = "x"\n'
)


def kinds(log: WindLog) -> set[str]:
    return {found.kind for found in log.findings}


def test_an_empty_row_out_of_order_takes_no_reading_with_it(read: Read) -> None:
    rows = [f"2026-05-01 12:00:{at:02d},{3 + at % 4}.5,{200 + at}\n" for at in range(30)]
    rows.insert(21, "2026-05-01 12:00:18,None,None\n")
    log = read(HEADING + "".join(rows), zone="UTC")
    assert len(log.series) == 30
    assert "empty-rows" in kinds(log)
    assert "time-backwards" not in kinds(log)


def test_empty_rows_in_order_stay_as_missing_values(read: Read) -> None:
    rows = (f"2026-05-01 12:00:{at:02d},{'' if at == 7 else 3 + at % 4},{200 + at}\n" for at in range(30))
    log = read(HEADING + "".join(rows), zone="UTC")
    assert len(log.series) == 30
    assert "empty-rows" not in kinds(log)


@pytest.mark.parametrize("copies", [[5] * 30, [2] * 3, [1, 1, 1, 1, 5, *[1] * 7], [1, 2, 1], [5], [3, 1, 2, 4]])
def test_copies_of_a_row_are_left_out_and_never_spread(copies: Sequence[int], read: Read) -> None:
    rows = (f"2026-05-01 12:{at:02d}:00,{SPEEDS[at]},{200 + at}\n" * many for at, many in enumerate(copies))
    log = read(HEADING + "".join(rows), zone="UTC")
    assert ((log.series.time - NOON) // (60 * 10**9)).tolist() == list(range(len(copies)))
    assert log.series.channels["wind_speed"].tolist() == SPEEDS[: len(copies)].tolist()
    (finding,) = (found for found in log.findings if found.kind == "duplicate-rows")
    assert (finding.severity, finding.count) == (Severity.WARNING, sum(copies) - len(copies))


def test_rows_of_one_fine_stamp_that_differ_in_another_column_are_one_reading(read: Read) -> None:
    surfaces = [(at, word) for at in range(12) for word in (("Dry", "Wet") if at == 4 else ("Dry",))]
    rows = (f"{1_777_636_800_000 + 6_000 * at},{3 + at % 4}.5,{200 + at},{word}\n" for at, word in surfaces)
    log = read("time_ms,wind speed [m/s],wind dir [deg],pavement\n" + "".join(rows))
    assert ((log.series.time - NOON) // (6 * 10**9)).tolist() == list(range(12))


def test_dates_that_rows_share_are_refused_and_those_of_a_row_a_day_are_not(read: Read, tmp_path: Path) -> None:
    recipe = tmp_path / "dates.toml"
    recipe.write_text(DATES)
    shared = "".join(f"2026-05-{1 + at // 10:02d},{3 + at / 10:.1f},200\n" for at in range(40))
    with pytest.raises(TimeError, match="dates without a time of day, and 40 of 40 rows share theirs"):
        read(HEADING + shared, zone="UTC", recipe=str(recipe))
    daily = "".join(f"2026-05-{at:02d},{3 + at / 10:.1f},200\n" for at in range(1, 31))
    log = read(HEADING + daily, zone="UTC", recipe=str(recipe))
    assert set(np.diff(log.series.time)) == {86_400 * 10**9}


def test_a_counter_of_32_bits_that_runs_over_goes_on(read: Read) -> None:
    rows = "".join(f"{(2**32 - 3000 + at * 1000) % 2**32},{SPEEDS[at]}\n" for at in range(12))
    log = read("millis,wind (m/s)\n" + rows, start=NOON, columns="time[ms],wind_speed[m/s]")
    assert ((log.series.time - NOON) // 10**9).tolist() == list(range(12))
    assert "counter-overflow" in kinds(log)


def test_winds_that_wander_and_steps_of_a_tunnel_are_no_sums() -> None:
    draws = stream(1, "wandering winds")
    wandering = (np.round(np.abs(3 + np.cumsum(draws.normal(0, 0.3, 400))), 1) for _ in range(50))
    assert not [at for at, speeds in enumerate(wandering) if cumulated.grows(np.asarray(speeds, dtype=np.float64))]
    assert not cumulated.grows(np.repeat(np.arange(0, 21, 1.0), 30))


def test_a_sum_that_begins_anew_is_a_doubt(read: Read) -> None:
    sums = [2.5, 4, 8.5, 11, 15.5, 17, 21.5, 24, 1.5, 3, 1.5, 4, 2.5, 5, 9.5, 11, 13.5, 1.5, 4, 5.5] * 2
    rows = "".join(f"2026-05-01T12:00:{at:02d}Z,{value}\n" for at, value in enumerate(sums))
    assert "speed-may-be-sum" in kinds(read("time,wind speed (m/s)\n" + rows))
