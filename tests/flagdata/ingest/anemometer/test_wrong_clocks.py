"""Stamps that cannot be right: after today, or hours from those of the satellite receiver in the same lines."""

from __future__ import annotations

import datetime as dt
import re
from collections.abc import Callable

import pytest

from flagdata.errors import FlagdataError
from flagdata.signals import WindLog

Read = Callable[..., WindLog]


def told(log: WindLog, kind: str) -> list[str]:
    return [finding.what for finding in log.findings if finding.kind == kind]


def test_rows_after_today_are_told_and_kept(read: Read) -> None:
    today = dt.datetime.now(dt.UTC)
    stamps = [today - dt.timedelta(days=2), today - dt.timedelta(days=1), today + dt.timedelta(days=3)]
    rows = "".join(f"{stamp:%Y-%m-%dT%H:%M:%SZ},3.{at}\n" for at, stamp in enumerate(stamps))
    log = read(f"time,wind speed (m/s)\n{rows}")
    assert len(log.series.time) == 3
    assert told(log, "stamps-in-future")[0].startswith("1 row is stamped after today")


def test_rows_of_today_are_not(read: Read) -> None:
    today = dt.datetime.now(dt.UTC)
    rows = "".join(f"{today + dt.timedelta(minutes=at):%Y-%m-%dT%H:%M:%SZ},3.{at}\n" for at in range(3))
    assert not told(read(f"time,wind speed (m/s)\n{rows}"), "stamps-in-future")


@pytest.mark.parametrize(("receiver", "said"), [("171300", "19.5 h behind"), ("124130", "")])
def test_a_receiver_whose_time_is_another_is_told(read: Read, receiver: str, said: str) -> None:
    day = "010924" if said else "020924"
    lines = "".join(
        f"2024-09-02T12:41:3{at}.168+00:00 $IIMWV,032,R,03.{at},N,A\n"
        f"2024-09-02T12:41:3{at}.200+00:00 $IIRMC,{int(receiver) + at},A,5928.094,N,02449.269,E,00.1,036,{day},00,E,A\n"
        for at in range(6)
    )
    found = told(read(lines), "receiver-clock-off")
    assert [said in what for what in found] == ([True] if said else [])


def test_years_of_two_digits_that_only_the_last_century_had_are_refused(read: Read) -> None:
    rows = "".join(f"61 1 {day} {10 + day % 5}.04\n" for day in range(1, 29))
    with pytest.raises(FlagdataError, match="would be 2061"):
        read(f"Yr Mo Dy RPT\n{rows}", wind="RPT", unit="kn", zone="UTC")


def test_the_line_of_a_year_of_two_digits_can_be_pasted(read: Read) -> None:
    rows = "".join(f"21 1 {day} {10 + day % 5}.04 200\n" for day in range(1, 29))
    text = f"Yr Mo Dy RPT dirx\n{rows}"
    (line, *_) = re.findall(r'--columns "([^"]*)"', str(read(text, wind="RPT", unit="kn", zone="UTC").findings))
    columns = line.replace("?=", "5=").replace("[?]", "[kn]")
    assert read(text, columns=columns, zone="UTC").series.time[0] == 1_609_459_200 * 10**9
