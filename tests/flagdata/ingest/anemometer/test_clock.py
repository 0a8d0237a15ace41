"""A logger's clock that is set anew: every row is kept, on one clock, and the doubt is named."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import TimeError, UsageError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer import WindOptions, read_log
from flagdata.rng import stream
from flagdata.schema import SampleFlag
from flagdata.signals import WindLog

S = 1_000_000_000
NOON = dt.datetime(2026, 5, 1, 12)  # noqa: DTZ001
Read = Callable[..., WindLog]


def readings(n: int) -> np.ndarray:
    return np.round(stream(3, "clock", n).uniform(2, 9, n), 3)


def log(seconds: np.ndarray, values: np.ndarray | None = None, *, start: dt.datetime = NOON, zone: str = "Z") -> str:
    """Stamps `seconds` after `start`, to the second, with a reading each."""
    values = readings(len(seconds)) if values is None else values
    stamps = [(start + dt.timedelta(seconds=float(at))).strftime("%Y-%m-%d %H:%M:%S") for at in seconds]
    return "time,wind_speed\n" + "".join(f"{at}{zone},{v}\n" for at, v in zip(stamps, values, strict=True))


def told(found: WindLog, kind: str) -> Finding:
    (one,) = [finding for finding in found.findings if finding.kind == kind]
    return one


def after(found: WindLog) -> list[float]:
    """Seconds since noon of 1 May 2026 UTC."""
    noon = round(NOON.replace(tzinfo=dt.UTC).timestamp()) * S
    return ((found.series.time - noon) / S).tolist()


def jumped(n: int, row: int, size: float, period: float = 1.0) -> np.ndarray:
    return period * np.arange(n) + size * (np.arange(n) >= row)


@pytest.mark.parametrize(("size", "words"), [(-3600, "set back 1 h"), (-37, "set back 37 s"), (-5400, "1 h 30 min")])
@pytest.mark.parametrize("period", [1, 60])
def test_a_clock_set_back_loses_no_row_and_is_named_with_its_line(
    size: int, words: str, period: int, read: Read
) -> None:
    if abs(size) < period:
        size *= 60
        words = words.replace(" s", " min")
    values = readings(9000)
    found = read(log(jumped(9000, 4000, size, period), values))
    assert found.series.channels["wind_speed"].tolist() == values.tolist()
    assert after(found) == (period * np.arange(9000)).tolist()
    finding = told(found, "clock-set-back")
    assert finding.severity is Severity.WARNING
    assert finding.where == "line 4002"
    assert words in finding.what
    assert finding.value == size
    assert "--clock first" in (finding.fix or "")
    assert "--clock last" in (finding.fix or "")
    assert np.flatnonzero(found.series.flags & SampleFlag.TIME_UNSURE).tolist() == list(range(4000, 9000))
    assert not [f for f in found.findings if f.kind in ("gaps", "time-backwards", "duplicate-stamps")]


@pytest.mark.parametrize(("choice", "shift"), [("first", 0), ("last", -3600)])
@pytest.mark.parametrize("size", [-3600, 3600])
def test_the_user_says_whose_stamps_are_right(choice: str, shift: int, size: int, read: Read) -> None:
    found = read(log(jumped(9000, 4000, size)), clock=choice)
    sign = 1 if size < 0 else -1
    assert after(found) == (np.arange(9000) + sign * shift).tolist()
    finding = told(found, f"clock-set-{'back' if size < 0 else 'on'}")
    assert (finding.severity, finding.fix) == (Severity.NOTE, None)


@pytest.mark.parametrize(("choice", "shift"), [(None, [0, 2]), ("first", [0, 2]), ("last", [-2, 0])])
def test_a_clock_set_back_by_two_seconds_in_a_steady_log_loses_no_row(
    choice: str | None, shift: list[int], read: Read
) -> None:
    """So little is within what buffers of a computer disorder, but there the rows behind make up for it."""
    found = read(log(jumped(200, 80, -2)), **({} if choice is None else {"clock": choice}))
    raw = jumped(200, 80, -2)
    assert after(found) == [*(raw[:80] + shift[0]).tolist(), *(raw[80:] + shift[1]).tolist()]
    said = told(found, "clock-set-back")
    assert (said.value, said.where, said.severity) == (
        -2.0, "line 82", Severity.WARNING if choice is None else Severity.NOTE,
    )  # fmt: skip


def fast(seconds: np.ndarray) -> str:
    """As `log`, with stamps to the millisecond."""
    stamps = [(NOON + dt.timedelta(seconds=float(at))).isoformat(" ", "milliseconds") for at in seconds]
    values = readings(len(seconds))
    return "time,wind_speed\n" + "".join(f"{at}Z,{v}\n" for at, v in zip(stamps, values, strict=True))


@pytest.mark.parametrize(("n", "row", "size", "period"), [(30, 15, -2, 1), (14, 7, -2, 1), (24, 18, -1, 0.5)])
def test_a_clock_set_back_by_a_second_in_a_short_log_loses_no_row(
    n: int, row: int, size: float, period: float, read: Read
) -> None:
    found = read(fast(jumped(n, row, size, period)))
    assert after(found) == pytest.approx((period * np.arange(n)).tolist())
    assert found.series.channels["wind_speed"].tolist() == readings(n).tolist()
    said = told(found, "clock-set-back")
    assert (said.value, said.where) == (size, f"line {row + 2}")
    assert f"clock set back {-size:g} s at line {row + 2}" in said.what
    assert not [f for f in found.findings if f.kind in ("duplicate-stamps", "equal-stamps", "time-backwards")]
    last = read(fast(jumped(n, row, size, period)), clock="last")
    assert after(last) == pytest.approx((period * np.arange(n) + size).tolist())


def test_a_clock_set_back_by_a_second_shows_through_unsteady_stamps(read: Read) -> None:
    # the time of each row is off by up to a fifth of the step, so the rows tell the size of the jump together
    noise = stream(7, "clock").uniform(-0.1, 0.1, 400)
    found = read(fast(jumped(400, 200, -1, 0.5) + noise))
    assert len(found.series) == 400
    assert float(told(found, "clock-set-back").value or 0) == pytest.approx(-1, abs=0.1)
    assert after(found) == pytest.approx((0.5 * np.arange(400)).tolist(), abs=0.2)


def test_rows_that_come_late_together_are_no_clock(read: Read) -> None:
    seconds = 0.5 * np.arange(200)
    seconds[80:88] -= 1  # a block of rows whose stamps are a second early, and those after it are not
    found = read(fast(seconds))
    assert "clock-set-back" not in {finding.kind for finding in found.findings}


@pytest.mark.parametrize("period", [1, 60])
def test_one_stamp_twice_in_a_steady_log_may_be_a_clock_set_back_by_one_step(period: int, read: Read) -> None:
    text = log(jumped(200, 80, -period, period))
    found = read(text)
    assert len(found.series) == 199  # without a word of the user a second record of an instant is left out
    said = told(found, "clock-set-back")
    assert (said.value, said.where, said.severity) == (-period, "line 82", Severity.WARNING)
    assert "set back 1 " in said.what
    for choice, shift in (("first", 0), ("last", -period)):
        assert choice in (said.fix or "")
        assert after(read(text, clock=choice)) == (period * np.arange(200) + shift).tolist()


def test_a_row_written_twice_in_a_steady_log_is_no_clock(read: Read) -> None:
    lines = log(np.arange(200.0)).splitlines(keepends=True)
    found = read("".join([*lines[:81], *lines[80:]]))
    assert {finding.kind for finding in found.findings} == {"duplicate-rows"}
    told_first = read("".join([*lines[:81], *lines[80:]]), clock="first")
    assert after(told_first) == list(range(200))


def test_a_row_that_comes_late_by_a_second_is_no_clock(read: Read) -> None:
    seconds = np.arange(200.0)
    seconds[[80, 81]] = seconds[[81, 80]]
    found = read(log(seconds))
    assert after(found) == list(range(200))
    assert {finding.kind for finding in found.findings} & {"clock-set-back", "time-backwards"} == {"time-backwards"}


def test_a_clock_that_may_have_been_set_on_is_a_doubt_and_changes_nothing(read: Read) -> None:
    found = read(log(jumped(9000, 4000, 3600)))
    assert after(found) == jumped(9000, 4000, 3600).tolist()
    finding = told(found, "clock-set-on")
    assert finding.severity is Severity.WARNING
    assert "or so many rows are missing" in finding.what
    assert not found.series.flags.any()


def test_an_outage_of_no_whole_hour_is_a_gap_and_no_clock(read: Read) -> None:
    found = read(log(jumped(9000, 4000, 3000)))
    assert [f.kind for f in found.findings] == ["gaps"]


def test_outages_of_a_log_with_many_are_no_clocks(read: Read) -> None:
    # hourly rows: every outage lasts whole hours
    at = np.delete(3600.0 * np.arange(300), [50, 51, 100, 150, 151, 152])
    assert [f.kind for f in read(log(at)).findings] == ["gaps"]


def test_a_clock_set_back_and_on_again_is_continued_through_both(read: Read) -> None:
    at = np.arange(12_000.0)
    at[4000:9000] -= 3600
    assert after(read(log(at))) == list(range(12_000))


def test_a_choice_that_nothing_calls_for_is_said_to_be_unused(read: Read) -> None:
    assert "--clock last is not used" in told(read(log(np.arange(100.0)), clock="last"), "clock-not-set").what
    with pytest.raises(UsageError, match="first or last"):
        WindOptions(clock="both")  # type: ignore[arg-type]


def test_a_clock_that_was_set_only_after_the_first_rows_is_named(read: Read) -> None:
    at = np.arange(2000.0)
    at[:50] -= 9000 * 86_400
    finding = told(read(log(at)), "clock-set-on")
    assert "was not set yet" in finding.what
    assert after(read(log(at), clock="last")) == list(range(2000))


def test_a_clock_that_starts_anew_years_back_is_refused_with_both_ways_out(read: Read) -> None:
    at = np.arange(9000.0)
    at[5000:] -= 9000 * 86_400
    with pytest.raises(TimeError, match="--clock first") as caught:
        read(log(at))
    assert "split the file" in (caught.value.fix or "")
    assert after(read(log(at), clock="first")) == list(range(9000))


def test_a_download_that_overlaps_the_one_before_is_left_out(read: Read) -> None:
    values = readings(12_000)
    rows = np.concatenate([np.arange(8000), np.arange(7000, 12_000)])
    found = read(log(rows.astype(float), values[rows]))
    assert after(found) == list(range(12_000))
    assert found.series.channels["wind_speed"].tolist() == values.tolist()
    assert told(found, "repeated-stretch").count == 1000


AUTUMN = dt.datetime(2026, 10, 24, 12)  # noqa: DTZ001
SPRING = dt.datetime(2026, 3, 28, 12)  # noqa: DTZ001
# Amsterdam: 2026-10-25 03:00 CEST → 02:00 CET and 2026-03-29 02:00 CET → 03:00 CEST; noon is 10:00 and 11:00 UTC.


@pytest.mark.parametrize(
    ("start", "size", "first", "kind"),
    [(AUTUMN, -3600, "2026-10-24T10:00", "clock-set-back"), (SPRING, 3600, "2026-03-28T11:00", "clock-set-on")],
)
@pytest.mark.parametrize("row", [60, 120, 400])
def test_the_zones_daylight_saving_explains_a_clock_that_followed_it_late(
    start: dt.datetime, size: int, first: str, kind: str, row: int, read: Read
) -> None:
    # rows of 10 min from noon: the zone's clocks change after 15 or 14 hours, the logger's after 10, 20 or 67
    found = read(log(jumped(600, row, size, 600), start=start, zone=""), zone="Europe/Amsterdam")
    begin = round(dt.datetime.fromisoformat(f"{first}:00+00:00").timestamp()) * S
    assert ((found.series.time - begin) // S).tolist() == list(range(0, 360_000, 600))
    assert told(found, kind).where == f"line {row + 2}"
    assert "Europe/Amsterdam" in told(found, kind).what


def test_hourly_rows_repeat_one_stamp_where_the_clocks_go_back(read: Read) -> None:
    at = jumped(60, 15, -3600, 3600)
    found = read(log(at, start=AUTUMN, zone=""), zone="Europe/Amsterdam")
    assert set(np.diff(found.series.time)) == {3600 * S}


def test_no_fixed_offset_is_advised_where_it_would_leave_rows_wrong(read: Read) -> None:
    text = log(jumped(600, 120, -3600, 600), start=AUTUMN, zone="")
    with pytest.raises(TimeError) as caught:
        read(text)
    assert "set back 1 h at line 122" in (caught.value.fix or "")
    assert "+01:00" not in (caught.value.fix or "")
    # New York's clocks go back a week later, in an hour that the log runs through once
    late = dt.datetime(2026, 10, 28, 12)  # noqa: DTZ001
    with pytest.raises(TimeError) as caught:
        read(log(jumped(700, 30, -7200, 600), start=late, zone=""), zone="America/New_York")
    assert "no one offset is right" in (caught.value.fix or "")


def sentence(body: str) -> str:
    code = 0
    for letter in body.encode():
        code ^= letter
    return f"${body}*{code:02X}"


def test_a_streams_clock_set_back_for_good_leaves_its_rate(read: Read) -> None:
    lines = []
    for second in range(3000):
        clock = 43_200 + second - (3600 if second >= 1000 else 0)
        hhmmss = f"{clock // 3600:02d}{clock // 60 % 60:02d}{clock % 60:02d}"
        lines += [
            sentence(f"GPZDA,{hhmmss},01,05,2026,00,00"),
            sentence(f"WIMWV,{second % 360},R,{5 + second % 3},M,A"),
        ]
    found = read("\n".join(lines) + "\n")
    assert told(found, "clock-set-back").value == -3600
    # a row lies half-way between two marks of a second
    assert after(found) == pytest.approx((np.arange(3000) + 0.5).tolist(), abs=1e-6)


@pytest.mark.reference
def test_a_real_log_set_back_an_hour_keeps_its_rows_five_minutes_apart(reference_data: Path, tmp_path: Path) -> None:
    recipe = tmp_path / "station.toml"
    recipe.write_text(
        'name = "station"\nabout = "a"\nsource = "b"\n[file]\npreamble = 2\nheader = 2\n[time]\ncolumns = [1]\n'
        'format = "%m/%d/%Y %H:%M"\n[channels.wind_speed]\ncolumn = 3\nunit = "m/s"\n[sensor]\nname = "station"\n'
    )
    path = reference_data / "wind" / "more" / "atmos22_clock_set_back.csv"
    for zone in ("Asia/Jerusalem", "+03:00"):
        found = read_log(path, WindOptions(recipe=str(recipe), zone=zone))
        assert len(found.series) == 26_568
        assert set(np.diff(found.series.time)) == {300 * S}
        assert told(found, "clock-set-back").where == "line 7074"
