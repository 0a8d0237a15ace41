"""Extremes in other languages, names of months and of zones that are written out, marks of the end of a file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from flagdata.errors import InputError
from flagdata.ingest.anemometer.formats.sentences import checksum
from flagdata.ingest.anemometer.log import read_log
from flagdata.ingest.anemometer.options import WindOptions
from flagdata.ingest.anemometer.words.headings import understand, zone_of
from flagdata.signals import WindLog
from flagdata.timebase import iso

Read = Callable[..., WindLog]
Write = Callable[..., Path]


@pytest.mark.parametrize(
    "heading",
    [
        "Høyeste middelvind (døgn)", "Højeste middelvind", "Högsta vindhastighet", "Hoogste windsnelheid",
        "Höchste Windgeschwindigkeit", "Největší rychlost větru", "Highest wind speed", "Strongest wind speed",
        "Laveste middelvind", "Lowest wind speed",
    ],
)  # fmt: skip
def test_an_extreme_is_no_mean_wind(heading: str) -> None:
    assert understand(heading).spread
    assert not understand(heading).channel


@pytest.mark.parametrize("heading", ["Middelvind (døgn)", "Vindhastighet", "Windsnelheid"])
def test_the_same_words_without_it_are_a_wind(heading: str) -> None:
    assert understand(heading).channel == "wind_speed"


def test_an_extreme_alone_is_asked_about(read: Read) -> None:
    rows = "".join(f"0{day}.08.1980;1{day},8;{day},6\n" for day in range(1, 8))
    with pytest.raises(InputError, match="holds gusts, extremes"):
        read("Tid(norsk normaltid);Middeltemperatur;Høyeste middelvind (døgn)\n" + rows)


@pytest.mark.parametrize(
    ("heading", "zone"),
    [("Tid(norsk normaltid)", "+01:00"), ("Time (Central European Summer Time)", "+02:00"),
     ("Time_Eastern_Standard_Time", "-05:00"), ("Tid", None)],
)  # fmt: skip
def test_a_zone_that_is_written_out_is_read(heading: str, zone: str | None) -> None:
    assert zone_of(heading) == zone


@pytest.mark.parametrize("month", ["January", "Jan", "May"])
def test_dates_with_whole_names_of_months(read: Read, month: str) -> None:
    rows = "".join(f"{day:02d} {month} 2013,{day}.5\n" for day in range(1, 12))
    log = read("date,wind_speed [m/s]\n" + rows, zone="UTC")
    number = "05" if month == "May" else "01"
    assert iso(int(log.series.time[0])) == f"2013-{number}-01T00:00:00Z"
    assert len(log.series.time) == 11


@pytest.mark.parametrize("form", ["%d %B %Y", "%d %b %Y"])
def test_both_directives_of_a_months_name_are_read(read: Read, form: str) -> None:
    rows = "".join(f"{day:02d} August 2013,{day}.5\n" for day in range(1, 12))
    log = read("day,ws\n" + rows, zone="UTC", columns=f"time[{form}],wind_speed[m/s]")
    assert iso(int(log.series.time[0])) == "2013-08-01T00:00:00Z"


@pytest.mark.parametrize(("step", "said"), [(1, "a whole day"), (7, "the 7 days to the next")])
def test_rows_of_weeks_are_no_rows_of_days(read: Read, step: int, said: str) -> None:
    rows = "".join(f"2020-{month:02d}-{day:02d},2.5\n" for month in (1, 2, 3) for day in range(1, 28, step))
    log = read("date,wind_speed [m/s]\n" + rows, zone="UTC")
    (found,) = [found for found in log.findings if found.kind == "dates-alone"]
    assert said in found.what


def test_a_mark_at_the_end_is_no_line_that_was_cut_off(read: Read) -> None:
    rows = "".join(f"2020-01-01 00:{minute:02d}:00 {minute % 7}.5 180\n" for minute in range(30))
    log = read("date time ws[m/s] wd[deg]\n" + rows + "***\n", zone="UTC")
    assert len(log.series.time) == 30
    assert not {"cut-off", "malformed-lines"} & {found.kind for found in log.findings}


def test_a_stamp_without_signs_before_a_sentence_is_its_time(log_file: Write) -> None:
    body = "WIMWV,10.0,R,4.0,N,A"
    text = "".join(f"20260501 1200{s:02d}+00:00 ${body}*{checksum(body):02X}\n" for s in range(1, 40, 2))
    log = read_log(log_file(text), WindOptions())
    assert [iso(int(at)) for at in log.series.time[:2]] == ["2026-05-01T12:00:01Z", "2026-05-01T12:00:03Z"]
