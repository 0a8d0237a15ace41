"""Columns that a mast's log names by their instruments: cups and sonics are speeds, vanes are directions."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.ingest.anemometer import WindOptions, anemometers, read_log
from flagdata.ingest.anemometer.words.headings import understand

Write = Callable[[str], Path]
HEADING = (
    "Timestamp,Cup116m_Mean,Cup116m_StdDev,Cup116m_Min,Cup116m_Max,Cup114m_Mean,Cup114m_StdDev,Sonic100m_Scalar_Mean,"
    "Vane113m_Mean,Vane113m_StdDev,Temp100m_Mean,Press115m_Mean\n"
)
ROW = "2021-05-01 {hour:02d}:{minute:02d}:00,8.{at},0.61,5.2,11.9,7.{at},0.52,6.{at},2{at}1.5,4.1,9.7,998.2\n"


def _mast() -> str:
    return HEADING + "".join(ROW.format(hour=at // 6, minute=10 * (at % 6), at=at % 6) for at in range(48))


def test_a_mast_without_units_asks_for_the_unit_and_then_for_the_anemometer(log_file: Write) -> None:
    path = log_file(_mast())
    with pytest.raises(InputError, match="the unit of column 'Cup116m_Mean' is not stated") as caught:
        read_log(path, WindOptions(zone="UTC"))
    assert "--unit m/s" in caught.value.fix
    with pytest.raises(InputError, match="3 anemometers") as caught:
        read_log(path, WindOptions(zone="UTC", unit="m/s"))
    assert "--wind 'Cup116m_Mean'" in caught.value.fix


@pytest.mark.parametrize(
    ("label", "height", "first"),
    [("Cup116m_Mean", 116.0, 8.0), ("Cup114m_Mean", 114.0, 7.0), ("Sonic100m_Scalar_Mean", 100.0, 6.0)],
)
def test_each_anemometer_is_read_with_its_height_and_the_vane(
    log_file: Write, label: str, height: float, first: float
) -> None:
    path = log_file(_mast())
    assert label in anemometers(path, WindOptions(unit="m/s"))
    series = read_log(path, WindOptions(zone="UTC", unit="m/s", wind=label)).series
    assert series.sensor.height == height
    assert series.channels["wind_speed"][0] == pytest.approx(first)
    assert np.rad2deg(series.channels["wind_direction"][0]) == pytest.approx(201.5)
    assert series.channels["air_pressure"][0] == pytest.approx(99_820)


@pytest.mark.parametrize("heading", ["Cup116m_Min", "Sonic100m_Scalar_StdDev", "Sonic100m_Scalar_Max"])
def test_deviations_and_extremes_are_no_wind_of_their_own(heading: str) -> None:
    assert (understand(heading).quantity, understand(heading).channel) == ("wind_speed", "")


@pytest.mark.parametrize("heading", ["Cup_Frequency", "Cup [Hz]", "Sonic_Temp", "Sonic_Scalar_Temp", "Sonic100m_Mean"])
def test_what_else_such_instruments_give_is_no_speed(heading: str) -> None:
    assert understand(heading).quantity != "wind_speed"


def _with_vanes(vane: str) -> str:
    heading = f"Date/Time,80m_N Avg [m/s],80m_N Std [m/s],50m Avg [m/s],50m Std [m/s],78m {vane},48m {vane}"
    rows = [f"2026-05-01 {at // 6:02d}:{at % 6}0,{7 + at % 5}.25,0.{at % 7},{5 + at % 3}.5,0.2,{20 + at % 30},"
            f"{(340 + at) % 360}" for at in range(60)]  # fmt: skip
    return "\n".join([heading, *rows]) + "\n"


@pytest.mark.parametrize("vane", ["WV [?]", "WV [\ufffd]", "WV"])
def test_vanes_called_wv_behind_their_height_are_no_speeds(log_file: Callable[[str], Path], vane: str) -> None:
    path = log_file(_with_vanes(vane))
    assert anemometers(path, WindOptions(zone="UTC")) == ("80m_N Avg [m/s]", "50m Avg [m/s]")
    high = read_log(path, WindOptions(zone="UTC", wind="80m_N Avg [m/s]")).series
    assert high.channels["wind_speed"][:3].tolist() == pytest.approx([7.25, 8.25, 9.25])
    low = read_log(path, WindOptions(zone="UTC", wind="50m Avg [m/s]")).series
    assert low.channels["wind_speed"][:3].tolist() == pytest.approx([5.5, 6.5, 7.5])
    towards = [np.degrees(series.channels["wind_direction"][:2]).tolist() for series in (high, low)]
    assert towards == [pytest.approx([20, 21]), pytest.approx([340, 341])]


def test_numbers_between_0_and_360_without_a_unit_are_asked_about_as_directions(
    log_file: Callable[[str], Path],
) -> None:
    rows = [f"2026-05-01T12:{at:02d}:00Z,{(97 * at) % 360}" for at in range(58)]
    with pytest.raises(InputError, match="as directions do") as caught:
        read_log(log_file("\n".join(["time,wind velocity", *rows]) + "\n"), WindOptions())
    assert "km/" not in (caught.value.fix or "")


def test_no_unit_is_offered_for_numbers_that_are_beyond_every_wind(log_file: Callable[[str], Path]) -> None:
    rows = [f"2026-05-01T12:{at:02d}:00Z,{1500 + (97 * at) % 300}" for at in range(58)]
    path = log_file("\n".join(["time,wind velocity", *rows]) + "\n")
    with pytest.raises(InputError, match="beyond every wind") as caught:
        read_log(path, WindOptions())
    assert "km/" not in (caught.value.fix or "")
