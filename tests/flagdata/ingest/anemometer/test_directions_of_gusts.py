"""The line that reads a gust as a wind of its own takes the gust's own direction, and none of another instrument."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest

from flagdata.signals import WindLog

Read = Callable[..., WindLog]


def _line(log: WindLog, heading: str) -> str:
    told = " ".join(finding.what for finding in log.findings if finding.kind == "columns-not-read")
    found = re.search(rf"to read {re.escape(repr(heading))} as a wind of its own[^\"]*--columns \"([^\"]*)\"", told)
    assert found is not None, told
    return found[1]


def _rows(*columns: Callable[[int], object]) -> str:
    return "".join(f"2026-05-01T12:{at:02d}:00Z,{','.join(str(one(at)) for one in columns)}\n" for at in range(12))


@pytest.mark.parametrize(
    ("gust", "own"),
    [("WindGust [m/s]", "Gust Dir [deg]"), ("gust [m/s]", "gust direction [deg]"),
     ("peak_wind_speed [m/s]", "peak_wind_drct [deg]")],
)  # fmt: skip
def test_a_gust_takes_its_own_direction(read: Read, gust: str, own: str) -> None:
    rows = _rows(lambda at: f"{4 + at % 3}.5", lambda at: 200 + at, lambda at: f"{8 + at % 3}.25", lambda at: 90 + at)
    text = f"time,wind speed [m/s],wind direction [deg],{gust},{own}\n{rows}"
    assert _line(read(text), gust) == "1=time,4=wind_speed[m/s],5=wind_direction[deg]"


def test_a_gust_without_one_keeps_the_mean_s_in_a_table_of_one_wind(read: Read) -> None:
    rows = _rows(lambda at: f"{4 + at % 3}.5", lambda at: 200 + at, lambda at: f"{8 + at % 3}.25")
    text = f"time,wind speed [m/s],wind direction [deg],gust [m/s]\n{rows}"
    assert _line(read(text), "gust [m/s]") == "1=time,3=wind_direction[deg],4=wind_speed[m/s]"


def test_a_maximum_takes_no_direction_of_another_instrument(read: Read) -> None:
    heading = "time,Cup80m_Mean [m/s],Cup80m_Max [m/s],Vane76m_Mean [deg],Spd [m/s],Dir [deg]"
    rows = _rows(lambda at: f"{4 + at % 3}.5", lambda at: f"{8 + at % 3}.25", lambda at: 200 + at,
                 lambda at: f"{5 + at % 3}.5", lambda at: 90 + at)  # fmt: skip
    for wind in ("Cup80m_Mean [m/s]", "Spd [m/s]"):
        assert _line(read(f"{heading}\n{rows}", wind=wind), "Cup80m_Max [m/s]") == "1=time,3=wind_speed[m/s]"


def test_a_buoy_s_gust_takes_the_direction_of_the_gust(read: Read) -> None:
    rows = "".join(
        f"2026 05 01 12 {at:02d} {200 + at} {4 + at % 3}.0 {90 + at} {8 + at % 3}.0 1202\n" for at in range(12)
    )
    text = f"#YY  MM DD hh mm WDIR WSPD GDR GST GTIME\n#yr  mo dy hr mn degT m/s degT m/s hhmm\n{rows}"
    log = read(text, columns=_line(read(text), "gust [m/s]"))
    assert log.series.channels["wind_direction"][0] == pytest.approx(90 * 3.14159265 / 180)
    assert log.series.channels["wind_speed"][0] == 8
