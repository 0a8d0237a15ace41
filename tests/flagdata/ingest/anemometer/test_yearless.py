"""Dates without a year and numbered days: completed by the first row's date, which must be the right one."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable

import numpy as np
import pytest

from flagdata.errors import TimeError
from flagdata.ingest.anemometer import WindOptions
from flagdata.ingest.anemometer.draft.drafting import draft
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
EVE = dt.datetime(2023, 12, 31, 22)  # noqa: DTZ001
FORMS = {
    "time[%b %d %H:%M:%S%f]": "%b %d %H:%M:%S", "time[%d-%b %H:%M]": "%d-%b %H:%M", "time[%d/%m %H:%M]": "%d/%m %H:%M",
    "time[%d %B %H:%M]": "%d %B %H:%M", "date[%b %d],time[%I:%M %p]": "%b %d,%I:%M %p",
    "month,day,hour,minute": "%m,%d,%H,%M",
}  # fmt: skip
"""What the user gives of the columns → how their cells are written."""


def rows(form: str) -> str:
    """Ten-minute rows over a new year's eve."""
    stamps = (EVE + dt.timedelta(minutes=10 * at) for at in range(60))
    cells = "".join(f"{stamp.strftime(form)},{3 + at % 2}.5\n" for at, stamp in enumerate(stamps))
    return ",".join(["x"] * (form.count(",") + 1)) + ",wind\n" + cells


def test_the_first_rows_date_completes_all_over_a_new_year(read: Read) -> None:
    wrong = []
    for columns, form in FORMS.items():
        log = read(rows(form), zone="UTC", date=EVE.date(), columns=f"{columns},wind_speed[m/s]")
        begins = log.series.time[0] == np.datetime64(EVE, "ns").astype(np.int64)
        if not begins or set(np.diff(log.series.time)) != {600 * 10**9}:
            wrong.append(columns)
        assert any("1 new years follow" in finding.what for finding in log.findings)
    assert not wrong


@pytest.mark.parametrize("given", [dt.date(2023, 12, 30), dt.date(2024, 1, 1)])
def test_another_day_than_the_first_rows_is_refused_with_the_right_one(read: Read, given: dt.date) -> None:
    with pytest.raises(TimeError, match=f"--date {given.year}-12-31"):
        read(rows("%b %d %H:%M"), zone="UTC", date=given, columns="time[%b %d %H:%M],wind_speed[m/s]")


def test_a_leap_day_is_of_a_leap_year_alone(read: Read) -> None:
    days = ["Feb 28", "Feb 29", "Mar 1"]
    text = "time,wind\n" + "".join(f"{day} {hour:02d}:00,3.{hour}\n" for day in days for hour in range(24))
    columns = "time[%b %d %H:%M],wind_speed[m/s]"
    found = read(text, zone="UTC", date=dt.date(2024, 2, 28), columns=columns)
    assert set(np.diff(found.series.time)) == {3600 * 10**9}
    with pytest.raises(TimeError, match="2023 has no such day"):
        read(text, zone="UTC", date=dt.date(2023, 2, 28), columns=columns)


def test_a_day_of_the_year_goes_on_after_its_last(read: Read) -> None:
    days = ((364 + at // 24) % 365 + 1 for at in range(72))
    text = "doy,hour,wind\n" + "".join(f"{day},{at % 24},{3 + at % 2}.5\n" for at, day in enumerate(days))
    log = read(text, zone="UTC", date=EVE.date(), columns="day_of_year,hour,wind_speed[m/s]")
    assert log.series.time[0] == np.datetime64("2023-12-31", "ns").astype(np.int64)
    assert set(np.diff(log.series.time)) == {3600 * 10**9}


def test_lines_of_an_instrument_after_dates_without_a_year(read: Read) -> None:
    stamps = [EVE + dt.timedelta(minutes=10 * at) for at in range(20)]
    text = "".join(f"{at:%b %d %H:%M:%S} $WIMWV,{k}.0,R,{3 + k % 2}.5,M,A\n" for k, at in enumerate(stamps))
    with pytest.raises(TimeError, match="--date YYYY-12-31"):
        read(text, zone="UTC")
    found = read(text, zone="UTC", date=EVE.date())
    assert found.series.time[0] == np.datetime64(EVE, "ns").astype(np.int64)
    assert set(np.diff(found.series.time)) == {600 * 10**9}
    with pytest.raises(TimeError, match="--date 2023-12-31"):
        read(text, zone="UTC", date=dt.date(2023, 12, 30))


def test_a_time_of_day_beside_a_date_that_does_not_read_is_not_the_time() -> None:
    found = draft(["date,time,wind speed (m/s)", *rows("%b %d,%I:%M %p").splitlines()[1:]], WindOptions(zone="UTC"))
    assert found is not None
    assert [question.key for question in found.open] == ["columns"]
