"""Series of several places in JSON: GeoJSON, and objects of stations that hold lists of one length."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.ingest.anemometer import WindOptions, anemometers, read_log
from flagdata.signals import WindLog

Write = Callable[..., Path]
_TIMES = [f"2026-05-01T12:{at}0+00:00" for at in range(4)]
_SPEEDS, _AWAY = [3.5, 4.5, None, 2.5], [210, 220, 230, 240]


def _feature(station: str, away: float, properties: dict[str, Any]) -> dict[str, Any]:
    geometry = {"type": "Point", "coordinates": [away, 48.0]}
    return {"type": "Feature", "geometry": geometry, "properties": {**properties, "station": station}}


def _check(log: WindLog) -> None:
    np.testing.assert_allclose(log.series.channels["wind_speed"], [3.5, 4.5, np.nan, 2.5])
    np.testing.assert_allclose(np.rad2deg(log.series.channels["wind_direction"]), _AWAY)
    assert log.series.time[0] == 1_777_636_800 * 10**9
    assert np.diff(log.series.time).tolist() == [600 * 10**9] * 3


def _geosphere(*stations: tuple[str, list[float | None]]) -> dict[str, Any]:
    features = [
        _feature(name, 10.0 + at, {"parameters": {
            "FF": {"name": "Windgeschwindigkeit", "unit": "m/s", "data": speeds},
            "DD": {"name": "Windrichtung", "unit": "°", "data": _AWAY}}})
        for at, (name, speeds) in enumerate(stations)
    ]  # fmt: skip
    return {"type": "FeatureCollection", "version": "v1", "timestamps": _TIMES, "features": features}


@pytest.mark.parametrize("indent", [None, 2])
def test_features_with_shared_instants_are_sites(log_file: Write, indent: int | None) -> None:
    path = log_file(json.dumps(_geosphere(("11999", [1.0, 2.0, 3.0, 4.0]), ("11998", list(_SPEEDS))), indent=indent))
    assert anemometers(path) == ("11998", "11999")
    _check(read_log(path, WindOptions(wind="11998")))


def test_one_feature_is_one_anemometer(log_file: Write) -> None:
    _check(read_log(log_file(json.dumps(_geosphere(("11999", list(_SPEEDS)))))))


def test_features_with_instants_of_their_own_are_sites_and_the_unit_is_asked_for(log_file: Write) -> None:
    features = [
        _feature(name, 10.0 + at, {"time": _TIMES, "wind_speed": _SPEEDS, "wind_direction": _AWAY})
        for at, name in enumerate(("Hill", "Dale"))
    ]
    path = log_file(json.dumps({"type": "FeatureCollection", "features": features}))
    with pytest.raises(InputError, match="--unit"):
        read_log(path)
    assert anemometers(path, WindOptions(unit="m/s")) == ("Dale", "Hill")
    _check(read_log(path, WindOptions(unit="m/s", wind="Dale")))


def test_stations_with_units_at_the_end_of_the_file_are_sites(log_file: Write) -> None:
    stations = [
        {"STID": name, "LATITUDE": f"{40 + at}", "OBSERVATIONS": {
            "date_time": _TIMES, "wind_speed_set_1": _SPEEDS, "wind_direction_set_1": _AWAY}}
        for at, name in enumerate(("KAAA", "KBBB"))
    ]  # fmt: skip
    units = {"wind_speed": "km/h", "wind_direction": "Degrees"}
    path = log_file(json.dumps({"STATION": stations, "SUMMARY": {"N": 2}, "UNITS": units}))
    assert anemometers(path) == ("KAAA", "KBBB")
    speeds = read_log(path, WindOptions(wind="KBBB")).series.channels["wind_speed"]
    np.testing.assert_allclose(speeds, [3.5 / 3.6, 4.5 / 3.6, np.nan, 2.5 / 3.6])


def test_locations_of_a_list_are_told_by_their_coordinates(log_file: Write) -> None:
    locations = [
        {"latitude": 52.0 + at, "longitude": 5.0, "timezone": "GMT", "hourly_units": {"wind_speed_10m": "m/s"},
         "hourly": {"time": [text[:16] for text in _TIMES], "wind_speed_10m": _SPEEDS, "wind_direction_10m": _AWAY}}
        for at in range(2)
    ]  # fmt: skip
    path = log_file(json.dumps(locations))
    assert anemometers(path) == ("latitude 52.0", "latitude 53.0")
    _check(read_log(path, WindOptions(wind="latitude 53.0", zone="UTC")))


def test_observations_of_one_quantity_each_are_of_their_station_not_of_their_number(log_file: Write) -> None:
    features = [
        {"type": "Feature", "id": f"f{at}-{station}-{name[5:]}", "geometry": {"type": "Point", "coordinates": [at, 56]},
         "properties": {"observed": when, "parameterId": name, "stationId": station, "value": value + 10 * place}}
        for place, station in enumerate(("06999", "06998")) for at, when in enumerate(_TIMES)
        for name, value in (("wind_speed", at + 1), ("wind_dir", 200 + at))
    ]  # fmt: skip
    path = log_file(json.dumps({"type": "FeatureCollection", "features": features, "numberReturned": 16}))
    assert anemometers(path, WindOptions(unit="m/s")) == ("06998", "06999")
    series = read_log(path, WindOptions(unit="m/s", wind="06998")).series
    assert series.channels["wind_speed"].tolist() == [11, 12, 13, 14]
    np.testing.assert_allclose(np.rad2deg(series.channels["wind_direction"]), [210, 211, 212, 213])


def test_values_told_last_are_of_the_same_site(log_file: Write) -> None:
    rows = ["time,station,name,value,unit"]
    for at in range(6):
        rows += [f"2026-05-01T12:{at:02d}:00Z,Hill,wind_dir,{100 + at},deg"]
        rows += [f"2026-05-01T12:{at:02d}:05Z,Dale,wind_dir,{300 + at},deg"]
        rows += [f"2026-05-01T12:{at:02d}:10Z,Hill,wind_speed,{1 + at},m/s"]
        rows += [f"2026-05-01T12:{at:02d}:15Z,Dale,wind_speed,{11 + at},m/s"]
    path = log_file("\n".join(rows) + "\n")
    assert anemometers(path) == ("Dale", "Hill")
    series = read_log(path, WindOptions(wind="Hill")).series
    np.testing.assert_allclose(np.rad2deg(series.channels["wind_direction"]), [100, 101, 102, 103, 104, 105])


def test_values_that_are_called_by_their_unix_times_are_rows(read: Callable[..., WindLog]) -> None:
    def series(unit: str, first: float, *, late: int = 0) -> dict[str, object]:
        times = reversed(range(30))  # the order of the keys of an object says nothing
        return {"unit": unit, "list": {str(1777636800 + late + 300 * at): f"{first + at:.1f}" for at in times}}

    wind = {"wind_speed": series("mph", 2), "wind_gust": series("mph", 5), "wind_direction": series("º", 200)}
    whole = {"code": 0, "msg": "success", "data": {"wind": wind, "outdoor": {"temperature": series("ºF", 60)}}}
    log = read(json.dumps(whole))
    assert log.series.time[[0, -1]].tolist() == [1777636800 * 10**9, (1777636800 + 300 * 29) * 10**9]
    assert log.series.channels["wind_speed"][:2].tolist() == pytest.approx([2 * 0.44704, 3 * 0.44704])
    assert np.degrees(log.series.channels["wind_direction"][:2]).tolist() == pytest.approx([200, 201])
