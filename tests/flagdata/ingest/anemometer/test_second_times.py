"""Two times in a row: seconds and a part of them, or the clocks of a device and of a server."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
T0 = 1_777_593_600
S = 1_000_000_000
N = 200


def table(heading: str, row: Callable[[int], str]) -> str:
    return (f"{heading}\n" if heading else "") + "".join(f"{row(at)},{3 + at % 2}.5\n" for at in range(N))


def doubts(found: WindLog) -> list[str]:
    return [finding.what for finding in found.findings if finding.kind == "heading-doubtful"]


@pytest.mark.parametrize(
    ("heading", "row"),
    [
        ("sec,msec", lambda at: f"{T0 + at // 4},{at % 4 * 250}"),
        ("secs,usecs", lambda at: f"{T0 + at // 4},{at % 4 * 250_000}"),
        ("secs,nsecs", lambda at: f"{T0 + at // 4},{at % 4 * 250_000_000}"),
        ("date,time,ms", lambda at: f"2026-05-01,00:00:{at // 4:02d},{at % 4 * 250}"),
        ("time,ms", lambda at: f"2026-05-01T00:00:{at // 4:02d},{at % 4 * 250}"),
        ("year,month,day,hour,minute,second,millisecond", lambda at: f"2026,5,1,0,0,{at // 4},{at % 4 * 250}"),
    ],
)
def test_a_part_of_a_second_in_its_own_column_is_added(read: Read, heading: str, row: Callable[[int], str]) -> None:
    zone = {} if heading.startswith("sec") else {"zone": "UTC"}
    found = read(table(f"{heading},wind speed (m/s)", row), **zone)
    assert found.series.time.tolist() == (T0 * S + np.arange(N) * S // 4).tolist()
    assert not found.series.flags.any()


def test_without_a_heading_a_part_of_a_second_is_told_by_stamps_that_rise_with_it(read: Read) -> None:
    text = table("", lambda at: f"{T0 + at // 4},{at % 4 * 250},{at % 360}")
    with pytest.raises(InputError, match=r"time\[%s\],time\[%L\]"):
        read(text)
    found = read(text, wind="4", unit="m/s")
    assert found.series.time.tolist() == (T0 * S + np.arange(N) * S // 4).tolist()
    assert any("milliseconds of column 1" in what for what in doubts(found))
    stated = read(text, columns="time[%s],time[%L],,wind_speed[m/s]")
    assert stated.series.time.tolist() == found.series.time.tolist()


def test_whole_numbers_beside_seconds_that_do_not_repeat_are_no_part_of_them(read: Read) -> None:
    found = read(table("", lambda at: f"{T0 + at},{at * 37 % 360}"), wind="3", unit="m/s")
    assert found.series.time.tolist() == (T0 * S + np.arange(N) * S).tolist()


@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize("heading", ["", "device_time,server_time,wind speed (m/s)"])
def test_of_two_clocks_the_steadier_is_taken_with_the_reason(read: Read, heading: str, swapped: bool) -> None:
    def row(at: int) -> str:
        own, late = str(T0 + at), str(T0 + at + 2 + (at % 3 == 0))
        return f"{late},{own}" if swapped else f"{own},{late}"

    known = {} if heading else {"wind": "3", "unit": "m/s"}
    found = read(table(heading, row), **known)
    assert found.series.time.tolist() == (T0 * S + np.arange(N) * S).tolist()
    (what,) = doubts(found)
    assert "2 to 3 s apart" in what
    assert "steadier" in what
    assert "--columns" in what
    columns = "time,,wind_speed[m/s]" if swapped else ",time,wind_speed[m/s]"
    assert read(table(heading, row), columns=columns).series.time[0] == (T0 + 3) * S


def test_two_stamps_of_one_clock_are_the_finer_one_without_a_doubt(read: Read) -> None:
    found = read(table("", lambda at: f"{T0 + at // 4},{T0 * 1000 + at * 250}"), wind="3", unit="m/s")
    assert found.series.time.tolist() == (T0 * S + np.arange(N) * S // 4).tolist()
    assert doubts(found) == []


def _two_clocks(drift: float, zone: int = 0) -> str:
    start = np.datetime64("2026-05-01T12:00:00", "s")
    rows = [
        f"{start + 60 * at},{start + 60 * at + 3600 * zone + int(drift * at)},{3 + at % 4}.5,{200 + at}"
        for at in range(40)
    ]
    return "\n".join(["Logger time,GPS time,wind speed [m/s],wind dir [deg]", *rows]) + "\n"


@pytest.mark.parametrize(
    ("drift", "zone", "told"), [(0.0, 0, False), (0.2, 2, False), (0.0, -7, False), (5.0, 0, True)]
)
def test_clocks_of_the_same_rows_that_run_apart_are_told(read: Read, drift: float, zone: int, told: bool) -> None:
    log = read(_two_clocks(drift, zone), zone="UTC")
    assert any("clocks do not agree" in finding.what for finding in log.findings) == told


def test_a_local_date_and_clock_beside_utc_are_not_two_clocks(read: Read) -> None:
    start = np.datetime64("2013-08-28T22:00", "m")
    stamps = [start + 60 * at for at in range(45)]
    local = [f"{29 + at // 24}/08/2013,{at % 24:02}:00" for at in range(45)]
    rows = [f"{stamp}:00,{here},8.{at % 10}" for at, (stamp, here) in enumerate(zip(stamps, local, strict=True))]
    found = read("\n".join(["utc,date,time,wind speed [m/s]", *rows]) + "\n")
    assert found.series.time[0] == start.astype("datetime64[ns]").astype(np.int64)
    assert doubts(found) == []
