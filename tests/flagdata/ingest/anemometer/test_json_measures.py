"""Values in JSON beside their unit, their name, their station or below their time, as weather services send them."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.ingest.anemometer import WindOptions, anemometers, read_log

Write = Callable[..., Path]
Read = Callable[..., Any]


def _quantity(unit: str, value: float | None) -> dict[str, Any]:
    return {"unitCode": f"wmoUnit:{unit}", "value": value, "qualityControl": "V"}


def test_a_value_beside_its_unit_is_a_column_in_that_unit(read: Read) -> None:
    features = [
        {"type": "Feature", "properties": {
            "timestamp": f"2026-05-01T12:{at}0:00+00:00",
            "windSpeed": _quantity("km_h-1", None if at == 2 else 18 + 3.6 * at),
            "windDirection": _quantity("degree_(angle)", 200 + at), "temperature": _quantity("degC", 20.0)}}
        for at in range(4)
    ]  # fmt: skip
    series = read(json.dumps({"type": "FeatureCollection", "features": features}, indent=1)).series
    np.testing.assert_allclose(series.channels["wind_speed"], [5, 6, np.nan, 8])
    np.testing.assert_allclose(np.rad2deg(series.channels["wind_direction"]), [200, 201, 202, 203])
    np.testing.assert_allclose(series.channels["air_temperature"], 293.15)


def test_values_of_a_list_are_columns_by_their_names(log_file: Write) -> None:
    data = [
        {"sourceId": f"SN{station}:0", "referenceTime": f"2026-05-01T{12 + at}:00:00.000Z", "observations": [
            {"elementId": "wind_speed", "value": station + at, "unit": "m/s", "timeOffset": "PT0H"},
            {"elementId": "wind_from_direction", "value": 200 + at, "unit": "degrees", "timeOffset": "PT0H"}]}
        for station in (1, 11) for at in range(4)
    ]  # fmt: skip
    path = log_file(json.dumps({"@type": "ObservationResponse", "data": data}))
    assert anemometers(path) == ("SN11:0", "SN1:0")
    series = read_log(path, WindOptions(wind="SN11:0")).series
    assert series.channels["wind_speed"].tolist() == [11, 12, 13, 14]
    np.testing.assert_allclose(np.rad2deg(series.channels["wind_direction"]), [200, 201, 202, 203])


def test_a_list_of_stations_in_each_reading_is_a_row_for_each(log_file: Write) -> None:
    readings = [
        {"timestamp": f"2026-05-01T20:0{at}:00+08:00", "data": [{"stationId": name, "value": first + at}
                                                                for name, first in (("S91", 3), ("S92", 13))]}
        for at in range(4)
    ]  # fmt: skip
    stations = [{"id": name, "name": name, "location": {"latitude": 1.0}} for name in ("S91", "S92")]
    path = log_file(
        json.dumps({"code": 0, "data": {"stations": stations, "readings": readings, "readingUnit": "knots"}})
    )
    options = WindOptions(wind="value", unit="kn")
    assert anemometers(path, options) == ("S91:value", "S92:value")
    series = read_log(path, WindOptions(wind="S92:value", unit="kn")).series
    np.testing.assert_allclose(series.channels["wind_speed"], np.array([13, 14, 15, 16]) * 1852 / 3600)
    assert series.time[0] == 1_777_636_800 * 10**9


@pytest.mark.parametrize("stations_first", [True, False])
def test_members_called_by_times_are_rows(log_file: Write, stations_first: bool) -> None:
    times = [f"2026-05-01T{12 + at}:00" for at in range(4)]
    values = {name: {time: {"intensidadeVento": first + at, "temperatura": 12.5} for at, time in enumerate(times)}
              for name, first in (("1200999", 3), ("1200998", 13))}  # fmt: skip
    whole = values if stations_first else {time: {name: values[name][time] for name in values} for time in times}
    path = log_file(json.dumps(whole))
    with pytest.raises(InputError, match="intensidadeVento") as caught:
        read_log(path)
    assert "--wind COLUMN" in caught.value.fix
    options = WindOptions(wind="intensidadeVento", unit="m/s", zone="UTC")
    assert anemometers(path, options) == ("1200998:intensidadeVento", "1200999:intensidadeVento")
    series = read_log(path, WindOptions(wind="1200998:intensidadeVento", unit="m/s", zone="UTC")).series
    assert series.channels["wind_speed"].tolist() == [13, 14, 15, 16]


def test_polish_headings_without_their_accents_and_an_hour_alone(log_file: Write) -> None:
    rows = [
        {"id_stacji": f"{12990 + at}", "stacja": name, "data_pomiaru": "2026-05-01", "godzina_pomiaru": "12",
         "predkosc_wiatru": str(3 + at), "kierunek_wiatru": str(200 + at)}
        for at, name in enumerate(("Las", "Pole", "Rzeka"))
    ]  # fmt: skip
    path = log_file(json.dumps(rows))
    options = WindOptions(unit="m/s", zone="UTC")
    labels = anemometers(path, options)
    assert len(labels) == 3
    series = read_log(path, WindOptions(unit="m/s", zone="UTC", wind=labels[2])).series
    assert series.channels["wind_speed"].tolist() == [5]
    assert series.time.tolist() == [1_777_636_800 * 10**9]


def test_kilometres_an_hour_spelled_with_the_word_hour(read: Read) -> None:
    rows = [f"2026-05-01T12:0{at}:00Z,{18 + 18 * at}" for at in range(3)]
    series = read("\n".join(["time,10-Minute Mean Speed(km/hour)", *rows, ""])).series
    np.testing.assert_allclose(series.channels["wind_speed"], [5, 10, 15])
