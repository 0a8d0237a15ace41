"""Tables that lie on their side, a quantity a row and a place a column."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.ingest.anemometer.log import read_log
from flagdata.ingest.anemometer.options import WindOptions
from flagdata.ingest.anemometer.restating import lying

Write = Callable[..., Path]
_TEXT = """Buoy,N1,N2,N3
Time (UTC),2026-05-07 19:00,2026-05-07 19:00,2026-05-07 20:00
Meteorological,,,
Air Pressure (hPa),1026.3,1026.6,1025.4
Wind Speed (kn),10.0,20.0,30.0
Wind Direction (°),143.0,215.0,113.0
Air Temp. (°C),11.5,12.8,11.2
"""


@pytest.mark.parametrize(("place", "knots", "towards"), [("N1", 10, 143), ("N3", 30, 113)])
def test_each_place_is_a_row(log_file: Write, place: str, knots: float, towards: float) -> None:
    log = read_log(log_file(_TEXT), WindOptions(wind=place))
    assert log.series.channels["wind_speed"] == pytest.approx([knots * 1852 / 3600])
    assert np.degrees(log.series.channels["wind_direction"]) == pytest.approx([towards])


@pytest.mark.parametrize(
    "lines",
    [
        [
            "time,wind speed (kn),temperature (°C),pressure (hPa)",
            "2026-05-01 12:00,3,11,1013",
            "2026-05-01 13:00,4,1,9",
        ],
        ["wind_speed,4.2,2026-05-01T12:00Z", "wind_direction,231,2026-05-01T12:00Z", "temp,11,2026-05-01T12:00Z"],
        ["Wind Speed (kn),a,b", "Wind Direction (°),c,d", "Pressure (hPa),e,f"],
    ],
)
def test_tables_that_stand_are_left_alone(lines: list[str]) -> None:
    assert not lying.matches(lines)
