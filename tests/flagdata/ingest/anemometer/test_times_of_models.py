"""Tables of forcing for crop, snow and glacier models: dates that no line names, fractions, groups, early years."""

from __future__ import annotations

from collections.abc import Callable
from datetime import date, timedelta
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.ingest.anemometer.formats.sentences import checksum
from flagdata.ingest.anemometer.log import read_log
from flagdata.ingest.anemometer.options import WindOptions
from flagdata.ingest.anemometer.restating import count_lines
from flagdata.ingest.anemometer.sniff import sniff
from flagdata.signals import WindLog
from flagdata.timebase import NANOSECONDS, iso

Read = Callable[..., WindLog]
Write = Callable[..., Path]


def kinds(log: WindLog) -> set[str]:
    return {found.kind for found in log.findings}


def test_year_month_day_and_day_of_the_year_are_days_and_no_clock(read: Read) -> None:
    days = [date(2005, 1, 1) + timedelta(days=number) for number in range(44)]
    rows = [f"Site {d.year} {d.month} {d.day} {d.timetuple().tm_yday} 7.{d.day} {1 + d.day % 5}.2 350.0" for d in days]
    log = read("\n".join(rows) + "\n", zone="UTC", wind="7", unit="m/s")
    assert iso(int(log.series.time[-1])) == "2005-02-13T00:00:00Z"
    assert set(np.diff(log.series.time).tolist()) == {86_400 * NANOSECONDS}


_DAYS = [(128 + (20 + hour) // 24, (20 + hour) % 24) for hour in range(40)]


def fractions(digits: int) -> str:
    rows = [f"1999\t{day + hour / 24:.{digits}f}\t{hour}\t{1 + hour % 5}.9\t2{hour % 9}5" for day, hour in _DAYS]
    return "year\tday\ttime\twindspeed\twinddir\n" + "\n".join(rows) + "\n"


def test_hours_beside_a_fraction_of_the_day_are_read_where_they_agree(read: Read) -> None:
    log = read(fractions(2), zone="UTC", unit="m/s")
    assert set(np.diff(log.series.time).tolist()) == {3600 * NANOSECONDS}
    assert "times-rounded" not in kinds(log)


@pytest.mark.parametrize("rows", [12, 40])
def test_numbers_below_a_zones_name_may_be_the_first_minutes_of_a_day(read: Read, rows: int) -> None:
    values = [(291 + hour // 24, hour % 24) for hour in range(rows)]
    text = "Year,DOY,MST,Avg Wind Speed @ 3m [m/s]\n" + "".join(
        f"2018,{day},{at},{1 + at % 5}.4\n" for day, at in values
    )
    if rows > 24:
        assert set(np.diff(read(text, zone="-07:00").series.time).tolist()) == {3600 * NANOSECONDS}
        return
    with pytest.raises(InputError, match="hours and minutes in one number"):
        read(text, zone="-07:00")


def test_fractions_of_a_day_in_two_digits_are_said_to_be_unsure(read: Read) -> None:
    log = read(fractions(2).replace("time", "flux"), zone="UTC", unit="m/s")
    (found,) = [found for found in log.findings if found.kind == "times-rounded"]
    assert found.value == pytest.approx(0.005 * 86_400)
    assert "times-rounded" not in kinds(read(fractions(5).replace("time", "flux"), zone="UTC", unit="m/s"))


def test_an_hour_beside_a_fraction_of_the_day_is_not_added_to_it(read: Read) -> None:
    columns = "1=year,2=day_of_year,3=hour,4=wind_speed[m/s],5=wind_direction[deg]"
    log = read(fractions(2), zone="UTC", columns=columns)
    assert iso(int(log.series.time[0])) == "1999-05-08T20:00:00Z"
    assert set(np.diff(log.series.time).tolist()) == {3600 * NANOSECONDS}


def test_lines_that_say_how_many_rows_follow_are_left_out(read: Read) -> None:
    text = "".join(
        "3\t\t\t\t\t\t\n"
        + "".join(f"2026\t5\t{day}\t12\t{site}\t{site}.{day % 9}\t{90 * site}\n" for site in (1, 2, 3))
        for day in range(1, 16)
    )
    columns = "1=year,2=month,3=day,4=hour,5=site,6=wind_speed[m/s],7=wind_direction[deg]"
    log = read(text, zone="UTC", columns=columns, wind="2")
    assert log.series.channels["wind_speed"] == pytest.approx([2 + (day % 9) / 10 for day in range(1, 16)])
    assert "count-lines" in kinds(log)


def test_numbers_of_stations_are_no_minutes_of_a_printed_line(read: Read) -> None:
    keys = [(day, site) for day in range(1, 16) for site in (1, 2, 3)]
    rows = [f"2026 5 {day} 12 {site} {450 + site} {site}.{day % 9} {60 * site}" for day, site in keys]
    with pytest.raises(InputError) as caught:
        read("\n".join(rows) + "\n", zone="UTC")
    assert "minute" not in (caught.value.fix or "")


@pytest.mark.parametrize(
    "lines",
    [
        ["3", "1 2 3", "1 2 3", "3", "1 2 3", "1 2 3", "1 2 3", "3", "1 2 3"],
        ["5.2", "5.4", "5.6", "5.1"],
        ["1", "2", "3", "4"],
        ["a b", "2", "1 2", "1 2", "2", "1 2", "1 2"],
    ],
)
def test_other_lone_numbers_are_no_counts(lines: list[str]) -> None:
    assert not count_lines.matches(lines)


@pytest.mark.parametrize("columns", [None, "year,day_of_year,,wind_speed[m/s]"])
def test_days_of_years_before_1970_are_refused_as_such(log_file: Write, columns: str | None) -> None:
    path = log_file(
        "year day rain wind\n() () (mm) (m/s)\n" + "".join(f"1960 {day} 0.0 {1 + day % 5}.4\n" for day in range(1, 30))
    )
    with pytest.raises(InputError, match="before 1970"):
        read_log(path, WindOptions(zone="UTC", columns=columns))


def test_a_direction_that_was_averaged_as_a_number_is_doubted(read: Read) -> None:
    head = '"TOA5","mast","CR1000X","1","OS","prog","2","Table"\n"TIMESTAMP","RECORD","WS_ms_Avg","WindDir_Avg"\n'
    head += '"TS","RN","meters/second","degrees"\n'
    rows = "".join(
        f'"2026-05-01 12:{minute:02d}:00",{minute},3.{minute % 7},{(350 + minute) % 360}\n' for minute in range(30)
    )
    assert "direction-mean-of-numbers" in kinds(read(f'{head}"","","Avg","Avg"\n{rows}', zone="UTC"))
    assert "direction-mean-of-numbers" not in kinds(read(f'{head}"","","WVc","WVc"\n{rows}', zone="UTC"))


def test_a_long_name_before_a_stamp_and_lines_of_comment_hide_no_sentence(read: Read) -> None:
    comments = "".join(f"# line {number} of what the ship's system says\n" for number in range(25))
    comments += "# Log Name\tLog Time\t$WIMWD,d.d,T,,M,n.n,N,m.m,M*cc\n"
    body = "WIMWD,72.6,T,,M,8.6,N,4.4,M"
    rows = "".join(
        f"wind_gill_fwdmast\t2026-05-01T12:00:{s:02d}.1429Z\t${body}*{checksum(body):02X}\n" for s in range(20)
    )
    log = read(comments + rows)
    assert len(log.series.time) == 20
    assert not {"checksum-errors", "malformed-lines"} & kinds(log)


def test_frames_of_a_can_adapter_are_named_with_what_can_be_done(log_file: Write) -> None:
    path = log_file("".join(f"<- {5 + 16 * number} T09FD02028FAB30090DFFAFF{number:02X}\n" for number in range(30)))
    guess = sniff(path)[0]
    assert "SLCAN" in guess.reasons[0]
    assert "candump" in (guess.fix or "")


@pytest.mark.parametrize("damaged", ["NA", "--", ""])
def test_a_damaged_cell_of_a_fraction_or_an_hour_is_no_crash(read: Read, damaged: str) -> None:
    lines = fractions(2).splitlines()
    for at, column in ((5, 1), (9, 2)):
        cells = lines[at].split("\t")
        lines[at] = "\t".join([*cells[:column], damaged, *cells[column + 1 :]])
    assert len(read("\n".join(lines) + "\n", zone="UTC", unit="m/s").series.time) >= 38


def test_a_damaged_number_of_a_station_is_no_crash(read: Read) -> None:
    keys = [(day, site) for day in range(1, 16) for site in (1, 2, 3)]
    rows = [f"2026 5 {day} 12 {site} {450 + site} {site}.{day % 9} {60 * site}" for day, site in keys]
    rows[7] = rows[7].replace(" 12 2 ", " 12 NA ")
    with pytest.raises(InputError):
        read("\n".join(rows) + "\n", zone="UTC")
