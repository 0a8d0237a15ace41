"""Headings as web services and networks write them: encoded for a URL, with a zone of several meanings."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError
from flagdata.ingest.anemometer import WindOptions, read_log
from flagdata.ingest.anemometer.instants import abbreviations

Write = Callable[..., Path]


def rows(stamp: str) -> str:
    return "".join(f"{stamp.format(at)},{3 + at % 4}.5,{200 + at},2{at % 10}.0\n" for at in range(12))


def test_a_heading_encoded_for_a_url_is_decoded(log_file: Write) -> None:
    heading = "Time,Wind Speed%2C avg (m%2Fs),Wind Direction (%26%23176%3B),Air Temp (%C2%B0C)\n"
    log = read_log(log_file(heading + rows("2026-05-01 12:{:02d}:00")), WindOptions(zone="UTC"))
    np.testing.assert_allclose(log.series.channels["wind_speed"], [3.5 + at % 4 for at in range(12)])
    assert log.series.sensor.name == "Wind Speed, avg (m/s)"
    assert log.series.channels["air_temperature"][0] == pytest.approx(20.0 + 273.15)


@pytest.mark.parametrize("heading", ["RH%,Wind m/s,Dir deg,20%", "Time,Wind m/s 100%,Dir deg,x"])
def test_a_mere_percent_sign_is_no_code(heading: str) -> None:
    from flagdata.ingest.anemometer.restating import percent_encoded

    assert not percent_encoded.matches([heading, "1,2,3,4"])


@pytest.mark.parametrize(
    ("heading", "zone"),
    [("DATE (MM/DD/YYYY)_MST,Wind Speed [m/s]", "-07:00"), ("Time (IST),Wind Speed [m/s]", "+05:30")],
)
def test_a_zone_of_several_meanings_is_asked_for_with_them(log_file: Write, heading: str, zone: str) -> None:
    text = f"{heading},Wind Dir [deg],Pressure [hPa]\n" + rows("05/14/2026 12:{:02d}")
    with pytest.raises(FlagdataError, match="no time zone") as caught:
        read_log(log_file(text))
    assert f"--zone {zone}" in str(caught.value.fix)


def test_json_on_one_long_line_is_read(log_file: Write) -> None:
    items = [
        {"time": f"2026-05-01T{at // 60:02d}:{at % 60:02d}:00Z", "wind_speed_ms": 3.0 + at % 5, "note": "x" * 60}
        for at in range(1000)
    ]
    text = json.dumps({"station": "roof", "observations": items})
    assert len(text) > 65_536
    assert read_log(log_file(text)).series.channels["wind_speed"].tolist() == [3.0 + at % 5 for at in range(1000)]


@pytest.mark.parametrize(
    ("line", "zone"),
    [
        ("#YY MM DD hhmm LAT LON WDIR WSPD GST PRES", ""),
        ("day,clock,WDIR,WSPD,GST,PRES", ""),
        ("Date Time GST Speed Direction Pressure", "+04:00"),
        ("day,Time,GST,WDIR,WSPD", "+04:00"),
        ("All clocks of the station are in IST", "+05:30"),
        ("Stamp (GST),Speed,Direction,Pressure,Rain", "+04:00"),
    ],
)
def test_the_heading_of_another_column_is_no_zone(line: str, zone: str) -> None:
    assert f"--zone {zone}" in abbreviations.advice([line]) if zone else abbreviations.advice([line]) == ""
