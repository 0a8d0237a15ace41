"""Kestrel exports in the forms that regions and settings give them."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.core.schema import SampleFlag
from flagdata.errors import InputError
from flagdata.timebase import iso
from tests.flagdata.ingest.anemometer.conftest import read

AMERICAN = (
    "Device Name,WEATHER - 1\r\nDevice Model,5500L\r\nSerial Number,1\r\n"
    "FORMATTED DATE-TIME,Direction ° True,Wind Speed,Temperature,Relative Humidity,Station "
    "Pressure\r\n"
    "MM/DD/YYYY HH:MM:SS,Deg,mph,°F,%,inHg\r\n"
    "06/13/2026 11:59:58 AM,350,10.0,68.0,50.0,29.92\r\n"
    "06/13/2026 12:00:00 PM,10,20.0,68.0,50.0,29.92\r\n"
)


def test_an_american_export_is_month_first_with_half_days() -> None:
    log = read(AMERICAN, zone="America/New_York")
    assert [iso(t) for t in log.series.time] == ["2026-06-13T15:59:58Z", "2026-06-13T16:00:00Z"]
    channels = log.series.channels
    assert channels["wind_speed"] == pytest.approx([4.4704, 8.9408])
    assert channels["air_temperature"] == pytest.approx([293.15, 293.15])
    assert channels["relative_humidity"] == pytest.approx([0.5, 0.5])
    assert channels["air_pressure"] == pytest.approx([29.92 * 3386.389] * 2)
    assert np.degrees(channels["wind_direction"]) == pytest.approx([350, 10])


def test_a_continental_export_has_decimal_commas() -> None:
    text = (
        "Device Name;K;;\nDevice Model;5500;;\nFORMATTED DATE-TIME;Direction ° True;Wind "
        "Speed;Temperature\n"
        "YYYY-MM-DD HH:MM:SS;Deg;km/h;°C\n2026-06-13 12:00:00;180;36,5;21,4\n2026-06-13 "
        "12:00:02;180;7,2;21,4\n"
    )
    log = read(text, zone="Europe/Amsterdam")
    assert log.series.channels["wind_speed"] == pytest.approx([36.5 / 3.6, 2.0])
    assert "date-order" not in {f.kind for f in log.findings}


def test_a_header_that_promises_another_date_order_is_a_warning() -> None:
    text = AMERICAN.replace("MM/DD/YYYY", "YYYY-MM-DD")
    assert [
        f.severity.value for f in read(text, zone="UTC").findings if f.kind == "date-order"
    ] == ["warning"]


def test_the_impellers_data_sheet_is_the_sensors() -> None:
    sensor = read(AMERICAN, zone="UTC").series.sensor
    assert sensor.name == "Kestrel 5500L"
    # ±3 % or ±0.1 m/s, taken as rectangular: divided by √3
    assert sensor.accuracy_relative == pytest.approx(0.03 / np.sqrt(3), rel=0.01)
    assert sensor.accuracy == pytest.approx(0.1 / np.sqrt(3), rel=0.01)


def test_speeds_below_the_impellers_start_are_in_its_dead_zone() -> None:
    log = read(AMERICAN.replace(",10.0,", ",1.0,"), zone="UTC")  # 1 mph = 0.447 m/s < 0.6 m/s
    assert log.series.flags.tolist() == [SampleFlag.DEAD_ZONE, 0]


QUOTED = (
    "Device Name,K\nDevice Model,5400\nSerial Number,1\nFORMATTED DATE-TIME,Direction – True,Wind "
    "Speed,Temperature\n"
    "YYYY-MM-DD HH:MM:SS,°,m/s,°C\n"
    '2026-06-13 12:00:00,180,"3,5","21,4"\n2026-06-13 12:00:02,200,"4,0","21,4"\n'
)


@pytest.mark.parametrize(
    "text",
    [
        QUOTED.replace('"21,4"', "21.4"),
        QUOTED.replace('"3,5"', '"3,500"').replace('"4,0"', '"4,000"'),
    ],
)
def test_a_comma_in_quotes_is_no_decimal_comma_where_that_is_in_doubt(text: str) -> None:
    with pytest.raises(InputError, match="unreadable values of wind_speed"):
        read(text.replace('"21,4"', "21"), zone="UTC")


PHONE = (
    "Device Name,K\nDevice Model,5400\nSerial Number,1\n"
    "FORMATTED DATE_TIME,Temperature,Station Pressure,Wind Speed,Compass Magnetic "
    "Direction,Compass True Direction\n"
    "yyyy-MM-dd hh:mm:ss a,°C,mb,km/h,Deg,Deg,Data Type,Record name,Location address,Notes\n"
    '2026-06-13 11:59:58 AM,21.4,1012.0,36.0,178,180,point,,"1 Main Street, Town",\n'
    '2026-06-13 12:00:00 PM,21.4,1012.0,7.2,--,--,point,,"1 Main Street, Town",windy\n'
)


def test_the_phones_export_names_its_last_columns_in_the_line_of_units() -> None:
    log = read(PHONE, zone="UTC")
    assert log.format == "kestrel"
    assert [iso(t) for t in log.series.time] == ["2026-06-13T11:59:58Z", "2026-06-13T12:00:00Z"]
    channels = log.series.channels
    assert channels["wind_speed"] == pytest.approx([10.0, 2.0])
    assert np.degrees(channels["wind_direction"]) == pytest.approx([180, np.nan], nan_ok=True)
    assert np.degrees(channels["wind_direction_magnetic"]) == pytest.approx(
        [178, np.nan], nan_ok=True
    )
