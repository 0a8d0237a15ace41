"""Readings in JSON that are members of an object: by rows, by keys of a store, by places, in columns."""

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
NOON = np.datetime64("2026-05-01T12:00:00", "ns").astype(np.int64)
HOUR = 3_600_000_000_000


def _reading(at: int) -> dict[str, Any]:
    return {"time": f"2026-05-01T{12 + at}:00:00Z", "wind_speed_ms": 3.0 + at, "wind_dir": 200 + at}


def _expect(series: Any, rows: int) -> None:
    assert (series.time - NOON).tolist() == [HOUR * at for at in range(rows)]
    assert series.channels["wind_speed"].tolist() == [3.0 + at for at in range(rows)]
    np.testing.assert_allclose(np.rad2deg(series.channels["wind_direction"]), 200 + np.arange(rows))


@pytest.mark.parametrize(
    "keys",
    [
        [str(at) for at in range(4)], [f"-Nabc01234567890{at:03d}x" for at in range(4)],
        [f"5f0c{at:020x}" for at in range(4)], [f"entry{at}" for at in range(4)],
    ],
    ids=["numbers", "push IDs", "object IDs", "counted words"],
)  # fmt: skip
def test_rows_that_are_called_by_numbers_or_keys_of_a_store_are_one_log(read: Read, keys: list[str]) -> None:
    _expect(read(json.dumps({key: _reading(at) for at, key in enumerate(keys)})).series, 4)


def test_columns_whose_cells_are_called_by_their_row(read: Read) -> None:
    rows = [_reading(at) for at in range(4)]
    _expect(read(json.dumps({name: {str(at): row[name] for at, row in enumerate(rows)} for name in rows[0]})).series, 4)


def test_columns_whose_cells_are_called_by_their_instant(read: Read) -> None:
    """As pandas writes a frame that has its times as the index: milliseconds since 1970."""
    rows = [_reading(at) for at in range(4)]
    stamps = [str((NOON + HOUR * at) // 1_000_000) for at in range(4)]
    columns = {name: dict(zip(stamps, (row[name] for row in rows), strict=True)) for name in list(rows[0])[1:]}
    _expect(read(json.dumps(columns)).series, 4)


def test_each_place_has_its_own_time_and_direction(log_file: Write) -> None:
    places = {
        f"{100 + 13 * at:04d}": {"value_WS": f"{3.0 + at}", "wind_dir": 200 + at, "lat": 47.0 + at,
                                 "timestamp": f"2026-05-01 {18 - at}:00:00", "name": f"Place {at}"}
        for at in range(4)
    }  # fmt: skip
    for content in (places, {"status": "ok", "stations": places}):
        path = log_file(json.dumps(content))
        assert anemometers(path) == ("station 0100", "station 0113", "station 0126", "station 0139")
        series = read_log(path, WindOptions(wind="station 0126", unit="m/s", zone="UTC")).series
        assert (series.time - NOON).tolist() == [4 * HOUR]
        assert series.channels["wind_speed"].tolist() == [5.0]
        np.testing.assert_allclose(np.rad2deg(series.channels["wind_direction"]), [202.0])


def test_numbered_rows_at_other_positions_are_places(log_file: Write) -> None:
    rows = {str(at): {**_reading(at), "latitude": 47.0 + at} for at in range(4)}
    assert len(anemometers(log_file(json.dumps(rows)))) == 4


def test_places_with_a_list_of_readings_each(log_file: Write) -> None:
    path = log_file(json.dumps({name: [_reading(at) for at in range(4)] for name in ("S100", "S107")}))
    assert anemometers(path) == ("S100", "S107")
    _expect(read_log(path, WindOptions(wind="S107")).series, 4)


def test_a_unit_of_the_whole_is_that_of_speeds_without_one(read: Read) -> None:
    rows = [{"time": _reading(at)["time"], "wind": 36.0 + at, "wind_dir": 200} for at in range(4)]
    series = read(json.dumps({"unit": "km/h", "station": "Lake", "data": rows})).series
    np.testing.assert_allclose(series.channels["wind_speed"], (36.0 + np.arange(4)) / 3.6)


def test_a_reading_with_lists_beside_it_is_the_reading(read: Read) -> None:
    """An object with its own time and wind, and a list of attempts that hold a wind but no time."""
    whole = {**_reading(0), "debug": [{"tried": "a", "wind": 11.0}, {"tried": "b", "wind": 12.0}]}
    _expect(read(json.dumps(whole)).series, 1)


def test_places_with_a_list_of_readings_beside_what_is_said_of_them(log_file: Write) -> None:
    """The instant at which a place was asked is none of its readings'."""
    places = {
        name: {"altitude": 800, "updated": "2026-05-02T08:00:00Z", "rows": [_reading(at) for at in range(4)]}
        for name in ("37100MS", "20500MS")
    }
    path = log_file(json.dumps({"stations": places}))
    assert anemometers(path) == ("20500MS", "37100MS")
    _expect(read_log(path, WindOptions(wind="37100MS")).series, 4)


def test_readings_of_several_instants_that_no_rule_takes_apart_are_refused(log_file: Write) -> None:
    readings = [_reading(at) for at in range(3)]
    whole = {"here": {"x": 1, "readings": readings}, "there": {"list": readings[:2]}, "others": {"a": {"b": 1}}}
    with pytest.raises(InputError, match=r"readings of 3 instants in one object, in its list 'here\.readings'"):
        read_log(log_file(json.dumps(whole)), WindOptions())
