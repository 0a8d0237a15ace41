"""Tables that list several stations below one another: sites without a recipe, and by every line that is offered."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.ingest.anemometer import WindOptions, anemometers, read_log

Write = Callable[..., Path]
_KMH = 1 / 3.6


def _stacked(station: str, time: str, value: str) -> str:
    """Two stations with three readings each of a quantity whose heading says nothing."""
    rows = [f"{name};01.05.2026 12:{at}0;{first + at}" for name, first in (("ABC", 3), ("XYZ", 13)) for at in range(3)]
    return "\n".join([f"{station};{time};{value}", *rows, ""])


def test_a_column_named_by_the_user_is_a_wind_of_each_station(log_file: Write) -> None:
    path = log_file(_stacked("station", "time", "z9"))
    options = WindOptions(wind="z9", unit="m/s", zone="UTC")
    labels = anemometers(path, options)
    assert labels == ("ABC:z9", "XYZ:z9")
    found = [read_log(path, WindOptions(wind=label, unit="m/s", zone="UTC")).series for label in labels]
    assert [series.channels["wind_speed"].tolist() for series in found] == [[3, 4, 5], [13, 14, 15]]


def test_without_a_station_the_column_alone_is_refused_with_the_stations(log_file: Write) -> None:
    path = log_file(_stacked("station", "time", "z9"))
    with pytest.raises(InputError, match="2 anemometers: ABC:z9, XYZ:z9") as caught:
        read_log(path, WindOptions(wind="z9", unit="m/s", zone="UTC"))
    assert "--wind 'ABC:z9'" in caught.value.fix


def test_the_line_offered_names_the_column_of_the_stations(log_file: Write) -> None:
    path = log_file(_stacked("station", "time", "z9"))
    with pytest.raises(InputError) as caught:
        read_log(path, WindOptions(zone="UTC"))
    offered = re.search(r'--columns "([^"]*)"', caught.value.fix)
    assert offered is not None
    assert offered[1] == "site,time,?"
    line = offered[1].replace("?", "wind_speed[m/s]")
    assert anemometers(path, WindOptions(columns=line, zone="UTC")) == ("ABC", "XYZ")


def test_a_station_that_is_not_there_is_refused_by_its_name(log_file: Write) -> None:
    path = log_file(_stacked("station", "time", "wind speed [m/s]"))
    with pytest.raises(InputError, match="no row with 'NOPE'"):
        read_log(path, WindOptions(wind="NOPE", zone="UTC"))


def test_addresses_with_colons_are_sites_beyond_the_first_rows(log_file: Write) -> None:
    seconds = (f"2026-05-01T{at // 3600:02d}:{at // 60 % 60:02d}:{at % 60:02d}Z" for at in range(1200))
    rows = [f"{when},aa:bb:0{1 + at % 2 if at < 1100 else 3},{at % 7}" for at, when in enumerate(seconds)]
    path = log_file("\n".join(["time,device,wind speed [m/s]", *rows, ""]))
    assert anemometers(path) == ("aa:bb:01", "aa:bb:02", "aa:bb:03")
    third = read_log(path, WindOptions(wind="aa:bb:03")).series
    assert len(third) == 100
    assert third.channels["wind_speed"][:3].tolist() == [1100 % 7, 1101 % 7, 1102 % 7]


@pytest.mark.parametrize(
    ("heads", "stamp", "scale"),
    [
        ("station_abbr;reference_timestamp;tre200s0;fkl010z0;dkl010z0;fu3010z0", "01.05.2026 12:{}0", 1.0),
        ("stn;time;tre200s0;fkl010z0;dkl010z0;fkl010z1", "2026050112{}0", 1.0),
        ("abbr;time;tre200h0;fkl010h0;dkl010h0;fkl010h1", "2026050112{}0", 1.0),
        ("Station/Location;Date;tre200s0;fu3010z0;dkl010z0;fu3010z1", "2026050112{}0", _KMH),
        ("station_abbr;reference_timestamp;ta1tows0;fk1towz0;dv1towz0;fu3towz1", "01.05.2026 12:{}0", 1.0),
    ],
)
def test_tables_of_meteoswiss_state_their_units_by_their_headings(
    log_file: Write, heads: str, stamp: str, scale: float
) -> None:
    rows = [f"{name};{stamp.format(at)};9.5;{first + at};{200 + at};-" for name, first in (("ABC", 3), ("XYZ", 13))
            for at in range(3)]  # fmt: skip
    path = log_file("MeteoSwiss\n\n" * heads.startswith("stn") + "\n".join([heads, *rows, ""]))
    assert anemometers(path) == ("ABC", "XYZ")
    series = read_log(path, WindOptions(wind="XYZ")).series
    np.testing.assert_allclose(series.channels["wind_speed"], np.array([13, 14, 15]) * scale)
    np.testing.assert_allclose(np.rad2deg(series.channels["wind_direction"]), [200, 201, 202])
    assert series.time[0] == 1_777_636_800 * 10**9


@pytest.mark.parametrize("heading", ["height", "height (m)", "level_m", "verticalPosition", "Range Gate (m)"])
@pytest.mark.parametrize("by_height", [True, False])
def test_heights_of_a_profile_are_anemometers(log_file: Write, heading: str, by_height: bool) -> None:
    rows = [(at, height) for at in range(4) for height in ("40", "100", "60")]
    rows.sort(key=(lambda row: row[1]) if by_height else (lambda row: row[0]))
    text = "".join(f"2026-05-01T12:{at}0:00Z,{height},{float(height) / 10 + at}\n" for at, height in rows)
    path = log_file(f"time,{heading},wind speed (m/s)\n{text}")
    assert set(anemometers(path, WindOptions())) == {"40", "60", "100"}
    series = read_log(path, WindOptions(wind="60")).series
    assert series.channels["wind_speed"].tolist() == [6, 7, 8, 9]


def test_heights_that_do_not_return_with_each_stamp_are_no_anemometers(log_file: Write) -> None:
    rows = "".join(f"2026-05-01T12:0{at}:00Z,{100 + at},{3 + at}.1\n" for at in range(9))
    assert len(read_log(log_file(f"time,altitude,wind speed (m/s)\n{rows}"), WindOptions()).series) == 9


@pytest.mark.parametrize("heading", ["stationname", "station", "StationID", "wmo"])
def test_stations_one_after_another_are_told_and_named_in_the_line_of_a_direction(
    log_file: Write, heading: str
) -> None:
    rows = [f"{name},2026-05-01T12:{at:02d}:00Z,{3 + at % 7}.5,{200 + at}" for name, first in (("A", 0), ("B", 20))
            for at in range(first, first + 20)]  # fmt: skip
    path = log_file("\n".join([f"{heading},time,wind speed (m/s),bearing", *rows, ""]))
    assert anemometers(path, WindOptions()) == ("A", "B")
    told = " ".join(one.what for one in read_log(path, WindOptions(wind="B")).findings)
    (line,) = re.findall(r'--columns "([^"]*)"', told)
    assert line == "1=site,2=time,3=wind_speed[m/s],4=wind_direction[deg]"
    found = read_log(path, WindOptions(wind="B", columns=line)).series
    np.testing.assert_allclose(np.rad2deg(found.channels["wind_direction"]), np.arange(220, 240))
