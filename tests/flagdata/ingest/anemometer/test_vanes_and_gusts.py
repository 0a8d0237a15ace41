"""Vanes are no anemometers, gusts of any language are none of their own, directions keep a doubted unit."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.ingest.anemometer import WindOptions, anemometers, read_log
from flagdata.ingest.anemometer.words.headings import understand

Write = Callable[[str], Path]


def _rows(row: str, count: int = 12) -> str:
    return "".join(f"2026-05-01T12:00:{at:02d}Z,{row}\n".format(at=at, turned=200 + at) for at in range(count))


@pytest.mark.parametrize("names", ["WS1,WV1,WS3,WV3", "AN1Speed,WV1,AN3Speed,WV3", "WS1,VANE1,WS3,VANE3"])
def test_a_vane_that_stands_still_is_the_direction_of_the_speed_of_its_number(log_file: Write, names: str) -> None:
    path = log_file(f"time,{names}\n" + _rows("2.5,{turned},0.0,0.0"))
    labels = anemometers(path, WindOptions(unit="m/s"))
    assert labels == (names.split(",")[0], names.split(",")[2])
    for label, degrees in zip(labels, (200, 0), strict=True):
        channels = read_log(path, WindOptions(unit="m/s", wind=label)).series.channels
        assert np.rad2deg(channels["wind_direction"][0]) == pytest.approx(degrees)


def test_all_vanes_that_stand_still_are_no_anemometers(log_file: Write) -> None:
    path = log_file("time,WS1,WV1,WS2,WV2\n" + _rows("2.5,0,1.5,12"))
    assert anemometers(path, WindOptions(unit="m/s")) == ("WS1", "WS2")


def test_velocities_called_wv_beside_their_directions_stay_speeds(log_file: Write) -> None:
    path = log_file("time,WV1,WD1,WV2,WD2\n" + _rows("2.5,{turned},1.5,12"))
    assert anemometers(path, WindOptions(unit="m/s")) == ("WV1", "WV2")


def test_a_direction_of_another_number_is_not_taken(log_file: Write) -> None:
    path = log_file("time,AN1Speed,AN2Speed,WD2,AN3Speed\n" + _rows("2.5,1.5,{turned},0.5"))
    found = {
        label: "wind_direction" in read_log(path, WindOptions(unit="m/s", wind=label)).series.channels
        for label in anemometers(path, WindOptions(unit="m/s"))
    }
    assert found == {"AN1Speed": False, "AN2Speed": True, "AN3Speed": False}


@pytest.mark.parametrize(
    "heading",
    [
        "Raj. Vento (m/s)", "Rajada (m/s)", "Ráfaga (m/s)", "Ráf. viento (m/s)", "Raf. (m/s)", "Rafale (m/s)",
        "Raf. vent (m/s)", "Böe (m/s)", "Windböe [m/s]", "Windspitze (m/s)", "Raffica (m/s)", "Raff. vento (m/s)",
        "Rach. Viento (m/s)", "Vento Máx. (m/s)", "Windstoten (m/s)", "Vlaag (m/s)", "Porywy wiatru (m/s)",
    ],
)  # fmt: skip
def test_gusts_of_other_languages_are_no_anemometers(log_file: Write, heading: str) -> None:
    assert understand(heading).spread
    path = log_file(f"time,Wind (m/s),{heading}\n" + _rows("2.5,4.{at}"))
    assert anemometers(path) == ()
    assert set(read_log(path).series.channels["wind_speed"]) == {2.5}


@pytest.mark.parametrize("heading", ["Dir. Vento (m/s)", "Wind Direction (km/h)", "Windrichtung [m/s]", "WindDir_ms"])
def test_a_direction_in_a_unit_of_speed_is_degrees_with_a_doubt(log_file: Write, heading: str) -> None:
    path = log_file(f"time,Vel. Vento (m/s),{heading}\n" + _rows("2.5,{turned}"))
    assert anemometers(path) == ()
    log = read_log(path)
    assert np.rad2deg(log.series.channels["wind_direction"][0]) == pytest.approx(200)
    doubts = [finding.what for finding in log.findings if finding.kind == "heading-doubtful"]
    assert len(doubts) == 1
    assert heading in doubts[0]
    assert "unit of speed" in doubts[0]


def test_a_direction_in_a_unit_of_speed_with_values_of_either_is_left_out_and_told(log_file: Write) -> None:
    path = log_file("time,Wind speed (m/s),Wind direction (m/s)\n" + _rows("2.5,1.{at}"))
    assert anemometers(path) == ()
    log = read_log(path)
    assert "wind_direction" not in log.series.channels
    (left,) = [finding.what for finding in log.findings if finding.kind == "columns-not-read"]
    assert "Wind direction (m/s)" in left


def test_the_u_of_u_sonic_is_no_component() -> None:
    heading = understand("U-sonic wind speed [m/s]")
    assert (heading.channel, heading.sure, heading.unit) == ("wind_speed", True, "m/s")
    assert understand("U wind [m/s]").channel == "wind_x"
