"""Main data files of Scintec's sodars, on made files of the format's layout."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError
from flagdata.ingest.anemometer import WindOptions, anemometers, read_log

Write = Callable[[str], Path]
HEAD = """FORMAT-1
2026-05-01 00:15:00 0
MFAS
3 26 58

#
# variable definitions
#
height # z # m # Z1 # 0 # 99999
wind speed # speed # m/s # G1 # 0 # 99.99
wind direction # dir # deg # R1 # 0 # 999.9
wind W # W # m/s # S # 0 # 99.99
error code # - - # error #  # E # IIII
#
# beginning of data block
#
"""


def block(hour: int, speeds: list[str]) -> str:
    rows = "".join(f"   {30 + 10 * at}   {speed}  {200 + at}.5  -0.21    0\n" for at, speed in enumerate(speeds))
    return f"\n2026-05-01 {hour:02d}:15:00 00:15:00\n#    z  speed    dir      W  error\n{rows}"


def test_each_height_is_an_anemometer_in_the_units_of_its_definition(log_file: Write) -> None:
    text = HEAD + "".join(block(hour, [f"{hour + 3}.5", "99.99" if hour == 1 else "8.25"]) for hour in range(4))
    path = log_file(text)
    assert set(anemometers(path, WindOptions(zone="UTC"))) == {"30", "40"}
    low, high = (read_log(path, WindOptions(zone="UTC", wind=height)).series for height in ("30", "40"))
    assert low.channels["wind_speed"].tolist() == [3.5, 4.5, 5.5, 6.5]
    np.testing.assert_array_equal(np.isnan(high.channels["wind_speed"]), [False, True, False, False])
    np.testing.assert_allclose(np.rad2deg(high.channels["wind_direction"]), 201.5)
    assert np.all(np.diff(low.time) == 3600 * 10**9)


def test_a_file_without_a_row_is_refused(log_file: Write) -> None:
    with pytest.raises(FlagdataError):
        read_log(log_file(HEAD), WindOptions(zone="UTC"))
