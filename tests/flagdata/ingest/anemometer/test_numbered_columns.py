"""A header that describes columns by number, with a time that counts since an instant."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from flagdata.signals import WindLog

Read = Callable[..., WindLog]
_HEAD = """## COLUMNS 5
##
## COLUMN1.name time
## COLUMN1.units {time}
## COLUMN2.name u
## COLUMN2.long_name East_Wind
## COLUMN2.units ms-1
## COLUMN3.name v
## COLUMN3.long_name North_Wind
## COLUMN3.units ms-1
## COLUMN4.name Direction
## COLUMN4.long_name Wind_Direction
## COLUMN4.units Degrees N ({way})
## COLUMN5.name Speed
## COLUMN5.long_name Wind_Speed
## COLUMN5.units ms-1
## COLUMN5.missing_value -999
##
"""
SPEED = np.array([4.0, 4.5, 5.0, 4.2])
FROM = np.array([200.0, 210.0, 220.0, 205.0])


def text(*, time: str, step: float, way: str = "FROM") -> str:
    shown = FROM if way == "FROM" else (FROM + 180) % 360
    rows = "".join(
        f"{at * step:g} {-s * np.sin(np.radians(d)):.3f} {-s * np.cos(np.radians(d)):.3f} {written:.1f} {s:.2f}\n"
        for at, (s, d, written) in enumerate(zip(SPEED, FROM, shown, strict=True))
    )
    return _HEAD.format(time=time, way=way) + rows


@pytest.mark.parametrize(
    ("time", "step", "first"),
    [
        ("days since 2024-05-01 00:00:00 +10", 1 / 1440, "2024-04-30T14:00:00"),
        ("seconds since 2024-05-01 06:00:00Z", 60, "2024-05-01T06:00:00"),
        ("hours since 2024-05-01T00:30:00 -0930", 1 / 60, "2024-05-01T10:00:00"),
    ],
)
@pytest.mark.parametrize("way", ["FROM", "TO"])
def test_a_count_since_an_instant_is_read_in_its_zone(read: Read, time: str, step: float, first: str, way: str) -> None:
    series = read(text(time=time, step=step, way=way)).series
    start = np.datetime64(first, "ns").astype(np.int64)
    np.testing.assert_allclose(series.time, start + 60_000_000_000 * np.arange(4), atol=2_000_000)
    np.testing.assert_allclose(series.channels["wind_speed"], SPEED)
    np.testing.assert_allclose(np.degrees(series.channels["wind_direction"]), FROM, atol=1e-6)


def test_the_value_that_stands_for_none_is_none(read: Read) -> None:
    body = text(time="seconds since 2024-05-01 06:00:00Z", step=60).replace(" 4.50\n", " -999\n")
    assert np.isnan(read(body).series.channels["wind_speed"]).tolist() == [False, True, False, False]


def test_a_count_without_a_zone_needs_one(read: Read) -> None:
    body = text(time="days since 2024-05-01 00:00:00", step=1 / 1440)
    assert read(body, zone="+02:00").series.time[0] == np.datetime64("2024-04-30T22:00:00", "ns").astype(np.int64)
