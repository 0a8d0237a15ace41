"""A logger's clock that is set anew: every row is kept, on one clock, and the step is reported."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flagdata.core.findings import Finding, Severity
from flagdata.core.rng import stream
from flagdata.core.schema import SampleFlag
from flagdata.errors import TimeError, UsageError
from flagdata.ingest import ClockChoice, Reading, WindOptions, gaps, read_log
from flagdata.ingest.anemometer.samples.order import in_order
from flagdata.record.signals import WindLog
from tests.flagdata.ingest.anemometer.cases import sentence
from tests.flagdata.ingest.anemometer.conftest import made, read

S = 1_000_000_000
NOON = 1_777_636_800 * S
CHOICES: tuple[tuple[ClockChoice, int], ...] = (("first", 0), ("last", 1))
"""Whose stamps are right → how many times the jump all rows are shifted by."""


def said(found: Reading, kind: str) -> Finding:
    (one,) = [finding for finding in found.findings if finding.kind == kind]
    return one


def after(found: Reading | WindLog) -> list[float]:
    """Seconds since noon of 1 May 2026 UTC."""
    return (((found.time if isinstance(found, Reading) else found.series.time) - NOON) / S).tolist()


def jumped(n: int, row: int, size: float, period: float = 1.0) -> np.ndarray:
    return period * np.arange(n) + size * (np.arange(n) >= row)


BACK = [
    # rows, row of the jump, seconds, period [s], in words
    (9000, 4000, -3600, 1, "set back 1 h"), (9000, 4000, -3600, 60, "set back 1 h"),
    (9000, 4000, -37, 1, "set back 37 s"), (9000, 4000, -2220, 60, "set back 37 min"),
    (9000, 4000, -5400, 60, "set back 1 h 30 min"), (200, 80, -2, 1, "set back 2 s"), (30, 15, -2, 1, ("set "
        "back 2 s")),
    (14, 7, -2, 1, "set back 2 s"), (24, 18, -1, 0.5, "set back 1 s"),
]  # fmt: skip


@pytest.mark.parametrize(("n", "row", "size", "period", "words"), BACK)
def test_a_clock_set_back_loses_no_row_and_is_named_with_its_line(
    n: int, row: int, size: float, period: float, words: str
) -> None:
    log, plain = made(jumped(n, row, size, period)), (period * np.arange(n))
    found = in_order(log, where="x")
    assert found.channels["wind_speed"].tolist() == log.channels["wind_speed"].tolist()
    assert after(found) == pytest.approx(plain.tolist(), abs=1e-9)
    finding = said(found, "clock-set-back")
    assert (finding.severity, finding.where, finding.value) == (
        Severity.WARNING,
        f"line {row + 2}",
        size,
    )
    assert words in finding.what
    assert all(
        way in (finding.fix or "") for way in ("--clock first", "--clock last", "--clock sort")
    )
    assert np.flatnonzero(found.flags & SampleFlag.TIME_UNSURE).tolist() == list(range(row, n))
    assert [one.kind for one in gaps(found).findings] == ["clock-set-back"]
    for choice, shift in CHOICES:
        given = in_order(log, where="x", choice=choice)
        assert after(given) == pytest.approx((plain + shift * size).tolist(), abs=1e-9)
        assert (said(given, "clock-set-back").severity, said(given, "clock-set-back").fix) == (
            Severity.NOTE,
            None,
        )


def test_a_clock_set_back_by_a_second_shows_through_unsteady_stamps() -> None:
    # the time of each row is off by up to a fifth of the step, so the rows show the size of the
    # jump together
    noise = stream(7, "clock").uniform(-0.1, 0.1, 400)
    found = in_order(made(jumped(400, 200, -1, 0.5) + noise), where="x")
    assert len(found.time) == 400
    assert float(said(found, "clock-set-back").value or 0) == pytest.approx(-1, abs=0.1)
    assert after(found) == pytest.approx((0.5 * np.arange(400)).tolist(), abs=0.2)


@pytest.mark.parametrize(("choice", "shift"), CHOICES)
def test_an_interval_of_whole_hours_is_reported_and_changes_nothing_unless_the_user_says_so(
    choice: ClockChoice, shift: int
) -> None:
    log = made(jumped(9000, 4000, 3600))
    found = in_order(log, where="x")
    assert after(found) == jumped(9000, 4000, 3600).tolist()
    assert said(found, "clock-set-on").severity is Severity.WARNING
    assert "or so many rows are missing" in said(found, "clock-set-on").what
    assert not found.flags.any()
    given = in_order(log, where="x", choice=choice)
    assert after(given) == (np.arange(9000) + 3600 * shift).tolist()


@pytest.mark.parametrize(("choice", "shift"), CHOICES)
@pytest.mark.parametrize("period", [1, 60])
def test_one_stamp_twice_in_a_steady_log_is_a_clock_set_back_by_one_step_where_the_user_says_that_it_was_set(
    period: int, choice: ClockChoice, shift: int
) -> None:
    log = made(jumped(200, 80, -period, period))
    found = in_order(log, where="x")
    assert [(one.kind, one.count) for one in found.findings] == [("duplicate-stamps", 1)]
    assert (
        after(in_order(log, where="x", choice=choice))
        == (period * np.arange(200) - shift * period).tolist()
    )


QUIET = {
    "rows that come late together": np.where((np.arange(200) >= 80) & (np.arange(200) < 88), -1, 0)
    + np.arange(200) / 2,
    "a row that comes late by a second": np.r_[0:80, 81, 80, 82:200],
    "an outage of no whole hour": jumped(9000, 4000, 3000),
    "outages of hourly rows": np.delete(3600.0 * np.arange(300), [50, 51, 100, 150, 151, 152]),
}


@pytest.mark.parametrize("name", QUIET)
def test_what_buffers_and_outages_leave_is_no_clock(name: str) -> None:
    found = in_order(made(QUIET[name]), where="x")
    assert {"clock-set-back", "clock-set-on"}.isdisjoint(one.kind for one in found.findings)
    assert len(found.time) == len(QUIET[name])


def test_a_clock_set_back_and_on_again_is_continued_through_both() -> None:
    at = np.arange(12_000.0)
    at[4000:9000] -= 3600
    assert after(in_order(made(at), where="x")) == list(range(12_000))


def test_a_clock_that_was_set_only_after_the_first_rows_is_named() -> None:
    at = np.arange(2000.0)
    at[:50] -= 9000 * 86_400
    assert "was not set yet" in said(in_order(made(at), where="x"), "clock-set-on").what
    assert after(in_order(made(at), where="x", choice="last")) == list(range(2000))


def test_a_clock_that_starts_anew_years_back_is_refused_with_all_ways_out() -> None:
    at = np.arange(9000.0)
    at[5000:] -= 9000 * 86_400
    with pytest.raises(TimeError) as caught:
        in_order(made(at), where="x")
    assert all(
        way in (caught.value.fix or "")
        for way in ("--clock first", "--clock sort", "split the file")
    )
    assert after(in_order(made(at), where="x", choice="first")) == list(range(9000))
    with pytest.raises(TimeError) as caught:
        in_order(made(at, stamped=False), where="x")
    assert "sort" not in (caught.value.fix or "")
    with pytest.raises(UsageError, match="first or last"):
        WindOptions(clock="both")  # type: ignore[arg-type]


def test_a_streams_clock_set_back_for_good_leaves_its_rate() -> None:
    lines = []
    for second in range(300):
        clock = 43_200 + second - (3600 if second >= 100 else 0)
        hhmmss = f"{clock // 3600:02d}{clock // 60 % 60:02d}{clock % 60:02d}"
        lines += [
            sentence(f"GPZDA,{hhmmss},01,05,2026,00,00"),
            sentence(f"WIMWV,{second % 360},R,{5 + second % 3},M,A"),
        ]
    found = read("\n".join(lines) + "\n")
    (back,) = [finding for finding in found.findings if finding.kind == "clock-set-back"]
    assert back.value == -3600
    assert "sort" not in (back.fix or "")  # the lines of a stream have no stamps to be sorted by
    # a row lies half-way between two marks of a second
    assert after(found) == pytest.approx((np.arange(300) + 0.5).tolist(), abs=1e-6)


@pytest.mark.reference
def test_a_real_log_set_back_an_hour_keeps_its_rows_five_minutes_apart(
    reference_data: Path, tmp_path: Path
) -> None:
    recipe = tmp_path / "station.toml"
    recipe.write_text(
        'name = "station"\nabout = "a"\nsource = "b"\n[file]\npreamble = 2\nheader = '
        "2\n[time]\ncolumns = [1]\n"
        'format = "%m/%d/%Y %H:%M"\n[channels.wind_speed]\ncolumn = 3\nunit = '
        '"m/s"\n[sensor]\nname = "station"\n'
    )
    path = reference_data / "wind" / "more" / "atmos22_clock_set_back.csv"
    found = read_log(path, WindOptions(recipe=str(recipe), zone="+03:00"))
    assert len(found.series) == 26_568
    assert set(np.diff(found.series.time)) == {300 * S}
    (back,) = [finding for finding in found.findings if finding.kind == "clock-set-back"]
    assert back.where == "line 7074"
    with pytest.raises(TimeError, match="Asia/Jerusalem") as caught:
        read_log(path, WindOptions(recipe=str(recipe), zone="Asia/Jerusalem"))
    assert "the offset of its first rows and --clock first" in (caught.value.fix or "")
