"""Dates without a year and numbered days: asked for with the option that completes them, which then works."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import InputError, TimeError
from flagdata.ingest.anemometer import WindOptions, read_log, sniff
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
EVE = dt.datetime(2027, 12, 31, 22)  # noqa: DTZ001
N = 60


def rows(form: str) -> str:
    """Ten-minute rows over a new year's eve, before a leap year's."""
    stamps = (EVE + dt.timedelta(minutes=10 * at) for at in range(N))
    return "".join(f"{stamp.strftime(form)},{3 + at % 2}.5\n" for at, stamp in enumerate(stamps))


@pytest.mark.parametrize(
    ("heading", "form"),
    [
        ("time", "%b %d %H:%M:%S"),
        ("time", "%a %b %d %H:%M:%S"),
        ("time", "%d-%b %H:%M"),
        ("time", "%d %B %H:%M"),
        ("date", "%d/%m %H:%M"),
        ("time", "%m/%d %H:%M:%S"),
        ("time", "%d.%m. %H:%M"),
        ("time", "%m-%d %H:%M:%S"),
        ("date,time", "%d/%m,%H:%M"),
        ("date,time", "%b %d,%I:%M %p"),
        ("month,day,hour,minute", "%m,%d,%H,%M"),
    ],
)
def test_a_date_without_a_year_is_completed_by_the_first_rows_date(read: Read, heading: str, form: str) -> None:
    text = f"{heading},wind speed (m/s)\n{rows(form)}"
    with pytest.raises(TimeError, match="no year") as caught:
        read(text, zone="UTC")
    assert "--date YYYY-12-31" in (caught.value.fix or "")
    found = read(text, zone="UTC", date=EVE.date())
    assert found.series.time[0] == np.datetime64(EVE, "ns").astype(np.int64)
    assert set(np.diff(found.series.time)) == {600_000_000_000}
    assert len(found.series) == N
    assert any("1 new years follow" in finding.what for finding in found.findings)


@pytest.mark.parametrize("given", [dt.date(2027, 12, 30), dt.date(2028, 1, 1)])
def test_another_day_than_the_first_rows_is_refused_with_the_right_one(read: Read, given: dt.date) -> None:
    with pytest.raises(TimeError, match=f"--date {given.year}-12-31"):
        read(f"time,wind speed (m/s)\n{rows('%b %d %H:%M')}", zone="UTC", date=given)


def test_a_leap_day_is_of_a_leap_year_alone(read: Read) -> None:
    days = ["Feb 28", "Feb 29", "Mar 1"]
    text = "time,wind speed (m/s)\n" + "".join(f"{day} {hour:02d}:00,3.{hour}\n" for day in days for hour in range(24))
    found = read(text, zone="UTC", date=dt.date(2028, 2, 28))
    assert set(np.diff(found.series.time)) == {3_600_000_000_000}
    with pytest.raises(TimeError, match="2027 has no such day"):
        read(text, zone="UTC", date=dt.date(2027, 2, 28))


def test_a_number_that_may_be_the_day_or_the_month_is_asked_about(read: Read) -> None:
    text = "time,wind speed (m/s)\n" + "".join(f"05/06 {hour:02d}:00,3.{hour}\n" for hour in range(24))
    with pytest.raises(InputError, match="--date-order"):
        read(text, zone="UTC")
    for order, month in (("dmy", 6), ("mdy", 5)):
        date = dt.date(2026, month, 11 - month)
        found = read(text, zone="UTC", date=date, date_order=order)
        assert found.series.time[0] == np.datetime64(date, "ns").astype(np.int64)


@pytest.mark.parametrize("form", ["{day},{hour}", "{day},{clock}", "{fraction}"])
def test_a_day_of_the_year_without_a_year_goes_on_after_its_last(read: Read, form: str) -> None:
    heading = "doy" if form == "{fraction}" else "doy,hour"
    lines = ""
    for at in range(72):
        day = (364 + at // 24) % 365 + 1
        lines += form.format(day=day, hour=at % 24, clock=f"{at % 24:02d}:00", fraction=f"{day + at % 24 / 24:.6f}")
        lines += f",{3 + at % 2}.5\n"
    text = f"{heading},wind speed (m/s)\n{lines}"
    with pytest.raises(TimeError, match="number 365 of its year"):
        read(text, zone="UTC")
    found = read(text, zone="UTC", date=EVE.date())
    assert found.series.time[0] == np.datetime64("2027-12-31", "ns").astype(np.int64)
    assert set(np.diff(found.series.time)) == {3_600_000_000_000}


def test_numbered_days_of_several_turbines_keep_the_days_that_are_missing(read: Read) -> None:
    days = (1, 2, 5, 6)
    text = "TurbID,Day,Tmstamp,Wspd (m/s)\n" + "".join(
        f"{turbine},{day},{at // 6:02d}:{at % 6 * 10:02d},{3 + turbine + at % 2}.5\n"
        for turbine in (1, 2) for day in days for at in range(144)
    )  # fmt: skip
    with pytest.raises(TimeError, match="--date"):
        read(text, zone="UTC", wind="2")
    found = read(text, zone="UTC", wind="2", date=dt.date(2026, 5, 1))
    dated = np.unique(found.series.time.astype("datetime64[ns]").astype("datetime64[D]"))
    assert dated.astype(str).tolist() == [f"2026-05-0{day}" for day in days]
    assert found.series.channels["wind_speed"][:2].tolist() == [5.5, 6.5]


@pytest.mark.parametrize("before", ["", "boat logger[312]: "])
def test_lines_of_an_instrument_after_dates_without_a_year(
    read: Read, log_file: Callable[[str], Path], before: str
) -> None:
    stamps = [EVE + dt.timedelta(minutes=10 * at) for at in range(N)]
    text = "".join(f"{at:%b %d %H:%M:%S} {before}$WIMWV,{k}.0,R,{3 + k % 2}.5,M,A\n" for k, at in enumerate(stamps))
    with pytest.raises(TimeError, match="--date YYYY-12-31"):
        read(text, zone="UTC")
    found = read(text, zone="UTC", date=EVE.date())
    assert found.series.time[0] == np.datetime64(EVE, "ns").astype(np.int64)
    assert set(np.diff(found.series.time)) == {600_000_000_000}
    assert sniff(log_file(text))[0].kind == "anemometer"
    with pytest.raises(TimeError, match="--date 2027-12-31"):
        read_log(log_file(text), WindOptions(zone="UTC", date=dt.date(2027, 12, 30)))


def test_days_by_month_and_day_alone_are_completed_by_the_first_rows_date(read: Read) -> None:
    days = [dt.date(2026, 5, 1) + dt.timedelta(days=at) for at in range(45)]
    text = "Ozone,Wind,Month,Day\n" + "".join(
        f"41,{3 + at % 7}.4,{day.month},{day.day}\n" for at, day in enumerate(days)
    )
    with pytest.raises(TimeError, match="no year"):
        read(text, unit="mph", zone="UTC")
    log = read(text, unit="mph", zone="UTC", date=days[0])
    assert log.series.time.astype("datetime64[ns]").astype("datetime64[D]").tolist() == days
    assert "dates-alone" in {finding.kind for finding in log.findings}


@pytest.mark.parametrize(("given", "told"), [("2024-05-13", 0), ("2020-05-13", 1)])
@pytest.mark.parametrize("cells", ["2024,12:{at:02d}:00", "2024,13-May 12:{at:02d}:00"], ids=["clock", "day"])
def test_a_year_in_the_table_speaks_against_the_date_that_was_given(
    read: Callable[..., WindLog], cells: str, given: str, told: int
) -> None:
    rows = "".join(f"{cells.format(at=at)},{3 + at % 4}.5\n" for at in range(20))
    log = read(f"Year,Time,wind speed (m/s)\n{rows}", zone="UTC", date=dt.date.fromisoformat(given))
    assert [f.kind for f in log.findings].count("date-contradicts") == told
    assert str(np.datetime64(int(log.series.time[0]), "ns"))[:16] == f"{given}T12:00"
