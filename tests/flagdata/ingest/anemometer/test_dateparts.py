"""Times in several columns: what their headings and numbers say is what is read."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import InputError, TimeError
from flagdata.ingest.anemometer import WindOptions, read_log

Write = Callable[[str], Path]
_HOUR = np.timedelta64(1, "h")


def _times(path: object, **options: object) -> np.ndarray:
    return read_log(path, WindOptions(**options)).series.time.astype("datetime64[ns]")  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["hour", "Hour", "HH", "Hora", "Stunde", "hour (UTC)"])
def test_an_hour_beside_a_date_is_an_hour_and_no_minute(log_file: Write, name: str) -> None:
    rows = "".join(f"2026-05-01,{at},{3 + at % 2}.5\n" for at in range(12))
    time = _times(log_file(f"date,{name},wind speed (m/s)\n{rows}"), **({} if "UTC" in name else {"zone": "UTC"}))
    assert time[0] == np.datetime64("2026-05-01T00:00")
    assert np.all(np.diff(time) == _HOUR)


def test_the_hour_24_is_the_midnight_that_ends_the_day(log_file: Write) -> None:
    rows = "".join(f"202605{1 + at // 24:02d},{at % 24 + 1},{3 + at % 2}.5\n" for at in range(48))
    time = _times(log_file(f"YYYYMMDD,HH,wind speed (m/s)\n{rows}"), zone="UTC")
    assert len(time) == 48
    assert time[23] == np.datetime64("2026-05-02T00:00")
    assert np.all(np.diff(time) == _HOUR)


@pytest.mark.parametrize(
    "heading", ["day month year hour minute", "Vuosi Kuukausi Päivä Tunti min", "minute hour day month year"]
)
def test_parts_of_a_date_are_read_in_whatever_order_their_headings_say(log_file: Write, heading: str) -> None:
    own = {"day": 1, "Päivä": 1, "month": 5, "Kuukausi": 5, "year": 2026, "Vuosi": 2026, "hour": 7, "Tunti": 7}
    words = heading.split()
    rows = "".join(" ".join(str(own.get(word, at)) for word in words) + f" {3 + at % 2}.5\n" for at in range(30))
    time = _times(log_file(f"{heading} windspeed\n{rows}"), zone="UTC", unit="m/s")
    assert time[0] == np.datetime64("2026-05-01T07:00")
    assert time[-1] == np.datetime64("2026-05-01T07:29")


def test_an_hour_with_its_fraction_is_that_hour_to_the_digits_written(log_file: Write) -> None:
    rows = "".join(f"2026-05-01,{at / 6:.4f},{3 + at % 2}.5\n" for at in range(30))
    time = _times(log_file(f"Date,Hour,wind speed (m/s)\n{rows}"), zone="UTC")
    assert np.all(np.diff(time) == np.timedelta64(10, "m"))


def test_a_day_of_the_year_with_its_fraction_begins_with_one_at_new_year(log_file: Write) -> None:
    rows = "".join(f"2026 {1 + at / 144:.5f} {3 + at % 2}.5\n" for at in range(30))
    time = _times(log_file(f"Year DOY wspd\n{rows}"), zone="UTC", unit="m/s")
    assert time[0] == np.datetime64("2026-01-01T00:00")
    assert np.all(np.diff(time) == np.timedelta64(10, "m"))


@pytest.mark.parametrize(("heading", "first", "doubtful"), [("Day", 3, True), ("Day", 40, False), ("DOY", 3, False)])
def test_a_day_beside_a_year_that_may_be_one_of_a_month_is_told(
    log_file: Write, heading: str, first: int, doubtful: bool
) -> None:
    rows = "".join(f"2026 {first + at // 24} {at % 24} {3 + at % 2}.5\n" for at in range(48))
    found = read_log(log_file(f"Year {heading} Hour wspd\n{rows}"), WindOptions(zone="UTC", unit="m/s"))
    start = np.datetime64("2026-01-01") + np.timedelta64(first - 1, "D")
    assert found.series.time[0].astype("datetime64[ns]") == start
    assert doubtful == any("no column holds a month" in finding.what for finding in found.findings)


def test_parts_of_a_time_of_day_alone_ask_for_the_day(log_file: Write) -> None:
    rows = "".join(f"7,{at},0,{3 + at % 2}.5\n" for at in range(30))
    path = log_file(f"hh,mm,ss,wind speed (m/s)\n{rows}")
    with pytest.raises(TimeError, match="without a date"):
        _times(path, zone="UTC")
    assert _times(path, zone="UTC", date=dt.date(2026, 5, 1))[1] == np.datetime64("2026-05-01T07:01")


@pytest.mark.parametrize("clock", ["{:d}h{:02d}", "{:d} h {:02d}", "{:d}:{:02d}"])
def test_a_clock_with_an_h_between_is_a_clock(log_file: Write, clock: str) -> None:
    rows = "".join(f"14/05/2026;{clock.format(9, at)};3,{at}\n" for at in range(9))
    time = _times(log_file(f"Date;Heure;Vitesse du vent (km/h)\n{rows}"), zone="UTC")
    assert time[0] == np.datetime64("2026-05-14T09:00")


def test_a_minimum_behind_the_hour_is_no_minute(log_file: Write) -> None:
    rows = "".join(f"2026-05-01,{at},{2 + at % 3},{9 + at % 3},{5 + at % 3}.5\n" for at in range(12))
    time = _times(log_file(f"date,hour,Min,Max,wind speed (m/s)\n{rows}"), zone="UTC")
    assert np.all(np.diff(time) == _HOUR)


@pytest.mark.parametrize(
    ("clocks", "minutes"), [(["9.00", "9.30", "10.00", "10.30"], 30), (["9.00", "9.50", "10.00", "10.50"], 30),
                            (["9.00", "9.25", "9.50", "9.75"], 15)],
)  # fmt: skip
def test_hours_with_a_point_are_minutes_or_fractions_as_makes_them_even(
    log_file: Write, clocks: list[str], minutes: int
) -> None:
    rows = "".join(f"2026-05-01;{clock};3.5\n" for clock in clocks)
    time = _times(log_file(f"date;hour;wind speed (m/s)\n{rows}"), zone="UTC")
    assert np.all(np.diff(time) == np.timedelta64(minutes, "m"))


def test_hours_with_a_point_that_may_be_either_are_asked_about(log_file: Write) -> None:
    rows = "".join(f"2026-05-01;9.{at}0;3.5\n" for at in range(1, 5))
    path = log_file(f"date;hour;wind speed (m/s)\n{rows}")
    with pytest.raises(InputError, match="fraction"):
        _times(path, zone="UTC")
    for form, minutes in (("%H.%M", 10), ("%Q", 6)):
        time = _times(path, zone="UTC", columns=f"date,hour[{form}],wind_speed[m/s]")
        assert np.all(np.diff(time) == np.timedelta64(minutes, "m"))


@pytest.mark.parametrize(
    ("heading", "row"),
    [
        ("YEAR MO DY HR MN wspd", "2026 05 14 7 {at:02d} 3.5"),
        ("Day Mon Year Time wspd", "14 May 2026 07:{at:02d} 3.5"),
        ("# dow mon day clock year wspd", "Thu May 14 07:{at:02d}:00 2026 3.5"),
    ],
)  # fmt: skip
def test_months_by_number_or_name_are_parts_of_the_date(log_file: Write, heading: str, row: str) -> None:
    rows = "".join(row.format(at=at) + "\n" for at in range(12))
    time = _times(log_file(f"{heading}\n{rows}"), zone="UTC", unit="m/s")
    assert time[1] == np.datetime64("2026-05-14T07:01")


def test_the_abbreviation_in_a_heading_is_the_zone_of_its_stamps(log_file: Write) -> None:
    rows = "".join(f"20260514:07{at:02d},3.5\n" for at in range(12))
    time = _times(log_file(f"Date(NZST),Speed(m/s)\n{rows}"))
    assert time[0] == np.datetime64("2026-05-13T19:00")


def test_a_year_a_day_of_it_and_a_clock_that_nothing_names_are_offered_as_such(log_file: Write) -> None:
    rows = "".join(f"110,2026,121,{7 * 100 + at},3.{at % 10},240.1\n" for at in range(12))
    path = log_file(rows)
    with pytest.raises(InputError) as caught:
        _times(path)
    assert ",year,day_of_year,time[%H%M]," in (caught.value.fix or "")
    time = _times(path, zone="UTC", columns=",year,day_of_year,time[%H%M],wind_speed[m/s],wind_direction[deg]")
    assert time[0] == np.datetime64("2026-05-01T07:00")


@pytest.mark.parametrize(
    ("heading", "row", "first", "step"),
    [
        ("Year,Hour of year", lambda at: f"2026,{at}", "2026-01-01T00:00", 60),
        ("Year,HOY", lambda at: f"2026,{at + 1}", "2026-01-01T01:00", 60),
        (
            "Year,Day,Hour",
            lambda at: f"2026,{100 + at // 48},{at % 48 // 2 * 100 + at % 2 * 30}",
            "2026-04-10T00:00",
            30,
        ),
        ("Year,Julian Day,Hour", lambda at: f"2026,{100 + at // 24},{at % 24 * 100}", "2026-04-10T00:00", 60),
        ("Year,Month,Day,Hour", lambda at: f"2026,5,{1 + at // 24},{at % 24 * 100}", "2026-05-01T00:00", 60),
        ("Year,Month,Day,Hour", lambda at: f"2026.0,5.0,{1 + at // 24}.0,{at % 24}.0", "2026-05-01T00:00", 60),
        ("Year,Decimal day", lambda at: f"2026,{1 + at / 48:.4f}", "2026-01-01T00:00", 30),
        ("Date,Hour ending", lambda at: f"2026-05-{1 + at // 24:02d},{at % 24 + 1}", "2026-05-01T01:00", 60),
        ("Date,Minute of day", lambda at: f"2026-05-{1 + at // 288:02d},{at % 288 * 5}", "2026-05-01T00:00", 5),
        ("Date,Seconds of day", lambda at: f"2026-05-01,{at * 60}", "2026-05-01T00:00", 1),
        ("Year,DOY,Minute of day", lambda at: f"2026,{100 + at // 288},{at % 288 * 5}", "2026-04-10T00:00", 5),
        ("Day,Hour", lambda at: f"2026{100 + at // 24},{at % 24}", "2026-04-10T00:00", 60),
        ("yyyy,mm,dd,hh,mm,ss", lambda at: f"2026,5,1,{at // 60},{at % 60},0", "2026-05-01T00:00", 1),
    ],
)
def test_counts_of_hours_days_and_minutes_are_times(
    log_file: Write, heading: str, row: Callable[[int], str], first: str, step: int
) -> None:
    rows = "".join(f"{row(at)},{3 + at % 2}.5\n" for at in range(200))
    time = _times(log_file(f"{heading},wind speed (m/s)\n{rows}"), zone="UTC")
    assert len(time) == 200
    assert time[0] == np.datetime64(first)
    assert np.all(np.diff(time) == np.timedelta64(step, "m"))


@pytest.mark.parametrize(("first", "said"), [(1, True), (0, False)])
def test_hours_from_1_to_24_are_said_to_be_ends(log_file: Write, first: int, said: bool) -> None:
    rows = "".join(f"2026,5,{1 + at // 24},{at % 24 + first},{3 + at % 2}.5\n" for at in range(72))
    found = read_log(log_file(f"Year,Month,Day,Hour,wind speed (m/s)\n{rows}"), WindOptions(zone="UTC"))
    assert np.all(np.diff(found.series.time.astype("datetime64[ns]")) == _HOUR)
    assert said == any("hours run from 1 to 24" in finding.what for finding in found.findings)


def test_a_year_a_month_a_day_and_an_hour_that_nothing_names_are_offered_as_such(log_file: Write) -> None:
    rows = "".join(f"2026 5 {1 + at // 24} {at % 24} {3 + at % 2}.5 230\n" for at in range(72))
    with pytest.raises(InputError, match='"year,month,day,hour,') as caught:
        _times(log_file(rows), zone="UTC")
    assert caught.value.fix
    columns = "year,month,day,hour,wind_speed[m/s],wind_direction[deg]"
    assert np.all(np.diff(_times(log_file(rows), zone="UTC", columns=columns)) == _HOUR)


@pytest.mark.parametrize(("date", "hour"), [("Data Medicao", "Hora Medicao"), ("Fecha", "Hora de la medición")])
def test_the_hour_of_the_measurement_is_one(log_file: Write, date: str, hour: str) -> None:
    rows = "".join(f"2026-05-01;{at:02d}00;{3 + at % 2},5\n" for at in range(12))
    time = _times(log_file(f"{date};{hour};VENTO, VELOCIDADE HORARIA(m/s)\n{rows}"), zone="UTC")
    assert time[0] == np.datetime64("2026-05-01T00:00")
    assert np.all(np.diff(time) == _HOUR)


@pytest.mark.parametrize(
    "form", ["%d.%m.2026 %H", "%d/%m/2026 %H", "2026-%m-%d %H", "2026 %m %d %H", "%d/%m/2026 {}"], ids=str
)
@pytest.mark.parametrize("first", [0, 1])
def test_an_hour_behind_a_date_is_no_minute(log_file: Write, form: str, first: int) -> None:
    days = [dt.date(2026, 5, day) for day in (13, 14)]
    stamps = [
        day.strftime(form.replace("%H", f"{hour:02d}").replace("{}", str(hour)))
        for day in days for hour in range(first, first + 24)
    ]  # fmt: skip
    path = log_file("date;wind speed (m/s)\n" + "".join(f"{stamp};{3 + at % 5}.5\n" for at, stamp in enumerate(stamps)))
    time = _times(path, zone="UTC")
    assert time[0] == np.datetime64("2026-05-13T00:00") + first * _HOUR
    assert np.all(np.diff(time) == _HOUR)


def test_a_heading_of_hours_and_minutes_keeps_minutes_after_midnight(log_file: Write) -> None:
    rows = "".join(f"2026-05-13 {minute};{3 + minute % 5}.5\n" for minute in range(20))
    time = _times(log_file(f"date hhmm;wind speed (m/s)\n{rows}"), zone="UTC")
    assert time[-1] == np.datetime64("2026-05-13T00:19")


def test_a_clock_headed_by_its_zone_is_read_beside_a_year_and_its_day(log_file: Write) -> None:
    """As the minutes of solar stations: 59 is 00:59, 100 is 01:00."""
    rows = "".join(f"2026,121,{clock},{3 + clock % 2}.5\n" for clock in (55, 56, 57, 58, 59, 100, 101, 102))
    time = _times(log_file(f"Year,DOY,MST,Avg Wind Speed @ 3m [m/s]\n{rows}"), zone="-07:00")
    assert time[0] == np.datetime64("2026-05-01T07:55")
    assert np.all(np.diff(time) == np.timedelta64(1, "m"))
