"""A letter or sign in a heading is a unit only where it stands as one; a quantity's numbers must bear its unit out."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError
from flagdata.ingest.anemometer import WindOptions, anemometers
from flagdata.ingest.anemometer.words.headings import understand
from flagdata.signals import WindLog
from flagdata.units import canonical

Read = Callable[..., WindLog]
Write = Callable[[str], Path]
ROWS = 20
START = int(np.datetime64("2026-05-01T12:00", "ns").astype(np.int64))


def rows(row: Callable[[int], str]) -> str:
    return "".join(f"2026-05-01T12:{at:02d}:00Z,{row(at)}\n" for at in range(ROWS))


@pytest.mark.parametrize(
    ("heading", "channel", "unit"),
    [
        ("WS_c", "wind_speed", None), ("wind_dir_f", "wind_direction", None), ("WS_k", "wind_speed", None),
        ("temp_c", "air_temperature", "degC"), ("air_temperature_k", "air_temperature", "K"),
        ("Wind, °", "wind_direction", "deg"), ("specific_humidity_kgkg", "", None),
        ("Ten_Meter_Elevation_Wind_Speed_meterPerSecond", "wind_speed", "m/s"),
        ("Precipitation_meterPerSecond", "", "m/s"), ("d_viento", "wind_direction", None),
    ],
)  # fmt: skip
def test_a_heading_is_understood(heading: str, channel: str, unit: str | None) -> None:
    found = understand(heading)
    assert (found.channel, found.unit) == (channel, unit)


def test_the_third_of_several_anemometers_is_not_in_degrees_celsius(log_file: Write) -> None:
    path = log_file(f"time,WS_a,WS_b,WS_c\n{rows(lambda at: f'{3 + at % 3}.5,{4 + at % 2}.5,{2 + at % 5}.5')}")
    assert anemometers(path, WindOptions(unit="m/s")) == ("WS_a", "WS_b", "WS_c")


@pytest.mark.parametrize("spelling", ["m*s-1", "m*s^-1", "m * s-1"])
def test_a_star_between_units_is_a_product(spelling: str) -> None:
    assert canonical(spelling) == "m/s"


def test_a_unit_in_a_line_with_products_of_many_is_read(read: Read) -> None:
    units = "-,W*m-2,umol*m-2*s-1,m*s-1,deg_from_north"
    text = f"time,LE,NEE,wind_speed,wind_dir\n{units}\n{rows(lambda at: f'{at}.5,-{at}.1,3.5,{200 + at}')}"
    np.testing.assert_allclose(read(text).series.channels["wind_speed"], 3.5)


@pytest.mark.parametrize("days", [2, 12])
def test_the_time_of_a_gust_in_one_number_is_no_count_of_seconds(read: Read, days: int) -> None:
    table = "".join(f"76116001;202406{day:02d};{day}.5;{1200 + day}\n" for day in range(1, days + 1))
    log = read(f"STATION;DATE;FFM;HXI3S\n{table}", wind="FFM", unit="m/s", zone="UTC")
    np.testing.assert_array_equal(np.diff(log.series.time), 86_400 * 10**9)


def test_seconds_that_stand_apart_count_from_a_start(read: Read) -> None:
    log = read("t_s,wind speed (m/s)\n" + "".join(f"{at / 2},3.{at}\n" for at in range(9)), start=START)
    np.testing.assert_array_equal(np.diff(log.series.time), 5 * 10**8)


@pytest.mark.parametrize("word", ["receiptTime", "received_at_time", "scraped time"])
def test_when_a_reading_was_received_is_not_when_it_was_made(read: Read, word: str) -> None:
    stations = ("LFMI", "LFML", "LFTH")
    table = "".join(
        f"{station},2026-05-01T12:{31 + at}:05.795Z,2026-05-01T12:30:00Z,{3 + at}.5\n"
        for at, station in enumerate(stations)
    )
    log = read(f"icaoId,{word},obsTime,wind speed (m/s)\n{table}", wind="LFML")
    assert log.series.time.tolist() == [np.datetime64("2026-05-01T12:30", "ns").astype(np.int64)]


@pytest.mark.parametrize(
    "options", [{}, {"columns": "time,wind_direction[deg],wind_speed[m/s]"}], ids=["drafted", "stated"]
)
def test_one_variable_direction_among_numbers_is_missing(read: Read, options: dict[str, str]) -> None:
    text = f"time,wind dir (deg),wind speed (m/s)\n{rows(lambda at: 'VRB,3.5' if at == 4 else f'{200 + at},3.5')}"
    direction = read(text, **options).series.channels["wind_direction"]
    assert np.flatnonzero(np.isnan(direction)).tolist() == [4]


def test_a_pressure_whose_numbers_fit_no_unit_is_left_out(read: Read) -> None:
    humidity = [23.78, 27.83, 35.04, 34.05, 35.27, 34.57, 33.9, 34.83, 35.18, 31.0]
    log = read(f"time,pressure,wind speed (m/s)\n{rows(lambda at: f'{humidity[at % 10]},3.5')}")
    assert set(log.series.channels) == {"wind_speed"}
    assert any("'pressure'" in finding.what for finding in log.findings)


def test_a_pressure_whose_numbers_fit_one_unit_is_read(read: Read) -> None:
    log = read(f"time,pressure,wind speed (m/s)\n{rows(lambda at: f'{29.5 + at / 100:.2f},3.5')}")
    np.testing.assert_allclose(log.series.channels["air_pressure"][0], 29.5 * 3386.389, rtol=1e-6)


@pytest.mark.parametrize("cell", ["17°", "100"])
def test_a_temperature_and_a_column_that_never_changes_are_offered_as_no_direction(read: Read, cell: str) -> None:
    name = "punkt" if "°" in cell else "DIR(hub)AVL"
    with pytest.raises(FlagdataError) as caught:
        read(f"time,{name},s\n{rows(lambda at: f'{cell},{3 + at % 4}.5')}")
    assert "2=wind_direction" not in (caught.value.fix or "")
    assert ",wind_direction" not in (caught.value.fix or "").split("(the first row")[0]
