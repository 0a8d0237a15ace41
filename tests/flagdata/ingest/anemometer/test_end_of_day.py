"""24:00 is the midnight that ends the day it is written with, with seconds or without, whatever the other rows have."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable

import numpy as np
import pytest

from flagdata.signals import WindLog

Read = Callable[..., WindLog]
START = np.datetime64("2026-05-01T13:00", "ns").astype(np.int64)
HOUR = 3600 * 10**9


def rows(written: Callable[[int, int], str], count: int = 30) -> str:
    """A row an hour from 13:00 on, its stamp written by the day and the hour, 1 to 24."""
    at = ((13 + hour - 1) // 24 * 1000 + (13 + hour - 1) % 24 + 1 for hour in range(count))
    return "".join(f"{written(1 + day // 1000, day % 1000)},{3 + day % 7}.5\n" for day in at)


@pytest.mark.parametrize(
    ("heading", "written"),
    [
        ("date,time", lambda day, hour: f"5/{day}/2026,{hour}:00{':00' if hour == 24 else ''}"),
        ("date,time", lambda day, hour: f"2026-05-{day:02d},{hour:02d}:00{'' if hour == 24 else ':00'}"),
        ("time", lambda day, hour: f"2026-05-{day:02d} {hour:02d}:00{':00' if hour == 24 else ''}"),
        ("time", lambda day, hour: f"0{day}.05.2026 {hour:02d}:00{':00' if hour == 24 else ''}"),
        ("time", lambda day, hour: f"0{day}.05.2026 {hour:02d}:00{'' if hour == 24 else ':00'}"),
        ("time", lambda day, hour: f"2026-05-{day:02d} {hour:02d}:00"),
        ("date,time", lambda day, hour: f"5/{day}/2026,{hour:02d}:00:00"),
        ("year,month,day,hour", lambda day, hour: f"2026,5,{day},{hour}"),
        ("date,hour", lambda day, hour: f"2026-05-{day:02d},{hour}"),
        ("time", lambda day, hour: f"{hour}:00{':00' if hour == 24 else ''}"),
    ],
)
def test_the_end_of_a_day_is_read_beside_hours_in_another_writing(
    read: Read, heading: str, written: Callable[[int, int], str]
) -> None:
    known = {"date": dt.date(2026, 5, 1)} if "2026" not in written(1, 1) else {}
    order = {"date_order": "mdy"} if "/" in written(1, 1) else {}
    found = read(f"{heading},wind speed (m/s)\n{rows(written)}", zone="UTC", **known, **order)
    assert found.series.time.tolist() == [START + HOUR * at for at in range(30)]
    assert "unreadable-stamps" not in {finding.kind for finding in found.findings}


def test_stamps_with_seconds_among_others_without_are_read(read: Read) -> None:
    text = "".join(f"01.05.2026 12:{at:02d}{':30' if at == 4 else ''},{3 + at}.5\n" for at in range(9))
    found = read(f"time,wind speed (m/s)\n{text}", zone="UTC")
    assert int(found.series.time[4] - found.series.time[3]) == 90 * 10**9
