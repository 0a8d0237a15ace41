"""The wind, its mean, direction and gusts are known by their words in six languages, also where words are joined."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError
from flagdata.ingest.anemometer import WindOptions, anemometers, read_log
from flagdata.ingest.anemometer.words.headings import understand
from flagdata.ingest.anemometer.words.wind_words import parted
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
Write = Callable[[str], Path]

SPEEDS = (
    "VENTOMEDIA", "Vento medio", "VELVENTO", "vvento", "velocità del vento", "Vento (km/h)", "intensità vento (m/s)",
    "velocidad del viento", "VELVIENTO", "vientomedio", "velmedia", "velocidade do vento", "vento médio",
    "vitesse du vent", "VITESSEVENT", "ventmoyen", "vent moyen", "force du vent (km/h)",
    "Windgeschwindigkeit", "Wind Geschw.", "Windmittel", "mittlerer Wind", "Windstärke (km/h)",
    "windsnelheid", "gemiddelde wind", "windgem", "windavg", "meanwind",
    "Station1_WND", "StationN_WND", "Mast B wind", "sensor 2 wind",
)  # fmt: skip
DIRECTIONS = (
    "DIRVENTO", "direzione vento", "provenienza vento", "dirviento", "dirección del viento", "direção do vento",
    "dirvent", "direction du vent", "Windrichtung", "windrichting", "Station1_DIR",
)  # fmt: skip
GUSTS = (
    "raffica", "RAFFICAVENTO", "VENTOMAX", "racha", "rachaviento", "ráfaga", "rajada", "rafale", "ventmax",
    "rafalevent", "Böe", "Windböe", "Windstoß", "windstoot", "vlaag", "velocità raffica",
)  # fmt: skip
NOTHING = ("Wind_D", "Wind2", "Station_D_WND", "vento filato", "eventmax", "Ventilation", "inventory", "Windstärke")
"""Headings that may be something else: a direction, the run of the wind, Beaufort's classes, no wind at all."""


@pytest.mark.parametrize("name", SPEEDS)
def test_a_heading_of_a_speed_is_one(name: str) -> None:
    heading = understand(name)
    assert (heading.channel, heading.sure, heading.spread) == ("wind_speed", True, False)


@pytest.mark.parametrize("name", DIRECTIONS)
def test_a_heading_of_a_direction_is_one(name: str) -> None:
    assert understand(name).channel == "wind_direction"


@pytest.mark.parametrize("name", GUSTS)
def test_a_gust_is_no_mean_wind(name: str) -> None:
    assert (understand(name).channel, understand(name).spread) == ("", True)


@pytest.mark.parametrize("name", NOTHING)
def test_a_heading_that_leaves_it_open_is_no_wind(name: str) -> None:
    assert understand(name).channel == ""


def test_joined_words_are_parted_where_both_are_known() -> None:
    assert parted("ventomedia") == ("vento", "media")
    assert parted("velviento") == ("vel", "viento")
    assert parted("windspeed") == ("windspeed",)
    assert parted("ventilation") == ("ventilation",)


def test_winds_of_numbered_stations_are_anemometers_with_their_directions(log_file: Write) -> None:
    rows = "".join(f"2026-05-01T12:{at:02d}:00Z,{3 + at % 7},{200 + at},{13 + at % 7},{100 + at}\n" for at in range(20))
    path = log_file(f"time,Station1_WND,Station1_DIR,Station2_WND,Station2_DIR\n{rows}")
    labels = anemometers(path, WindOptions(unit="m/s"))
    assert labels == ("Station1_WND", "Station2_WND")
    second = read_log(path, WindOptions(unit="m/s", wind="Station2_WND")).series
    assert second.channels["wind_speed"][:2].tolist() == [13, 14]
    assert np.degrees(second.channels["wind_direction"]) == pytest.approx(np.arange(100, 120))


def test_a_mean_wind_in_one_word_is_asked_for_its_unit_and_its_maximum_is_named(read: Read) -> None:
    rows = "".join(f"01/05/2026 12:{at:02d};{3 + at % 7},5;{200 + at};{8 + at % 7},5\n" for at in range(20))
    text = f"DATA;VENTOMEDIA;DIRVENTO;VENTOMAX\n{rows}"
    with pytest.raises(FlagdataError, match="unit of column 'VENTOMEDIA' is not stated"):
        read(text, zone="UTC", date_order="dmy")
    found = read(text, zone="UTC", date_order="dmy", unit="m/s")
    assert found.series.channels["wind_speed"][:2].tolist() == [3.5, 4.5]
    (told,) = [one.what for one in found.findings if one.kind == "columns-not-read"]
    assert "'VENTOMAX' speaks of the wind" in told
    (line,) = re.findall(r'--columns "([^"]*)"', told)
    gust = read(text, zone="UTC", columns=line, date_order="dmy")
    assert gust.series.channels["wind_speed"][:2].tolist() == [8.5, 9.5]


@pytest.mark.parametrize("name", ["Bottom Temp (degC)", "Water Temp", "SST (degC)", "Ice temperature (°C)"])
def test_a_temperature_of_water_or_ice_is_not_that_of_the_air(name: str) -> None:
    assert understand(name).channel == ""


@pytest.mark.parametrize(
    ("heading", "channel", "spread"),
    [
        ("Ø Wind [km/h]", "wind_speed", False), ("WSavg", "wind_speed", False), ("WSms", "wind_speed", False),
        ("WSmax", "", True), ("WDavg", "wind_direction", False), ("MxSpd", "", True),
        ("wind from", "wind_direction", False),
        ("WSpd", "wind_speed", False), ("WDir", "wind_direction", False),
    ],
)  # fmt: skip
def test_short_names_with_a_statistic_behind_them(heading: str, channel: str, spread: bool) -> None:
    found = understand(heading)
    assert (found.channel, found.spread) == (channel, spread)


def test_short_names_of_one_instrument_go_together() -> None:
    assert understand("WSpd").label == understand("WDir").label == ()


@pytest.mark.parametrize(
    ("heading", "unit"),
    [
        ("wind.speed.metersPerSecond", "m/s"), ("wind_speed_m_per_s", "m/s"), ("vitesse_km_per_h", "km/h"),
        ("Wind Speed (meters per second)", "m/s"), ("Wind Speed m/s (avg)", "m/s"), ("ws km/h mean", "km/h"),
        ("風速（ｍ／ｓ）", "m/s"), ("Vitesse du vent (nds)", "kn"),
    ],
)  # fmt: skip
def test_units_in_words_and_before_their_statistic(heading: str, unit: str) -> None:
    found = understand(heading)
    assert (found.channel, found.unit) == ("wind_speed", unit)
