"""Rows of one stamp at different places are of stations; a list of stations, and one without a stamp among others."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import NothingMeasuredError
from flagdata.ingest.anemometer import WindOptions, anemometers, read_log
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
Write = Callable[..., Path]
PLACES = {"Anglès": (41.96, 2.63), "Barcelona - Zona": (41.38, 2.11), "Lac Redon (2.245 m)": (42.64, 0.78)}
NOON = np.datetime64("2026-05-01T12:00", "ns")


def table(hours: int, places: dict[str, tuple[float, float]]) -> str:
    rows = (
        f"{name},{lat},{lon},{3 + at}.5,2026-05-01T{12 + hour:02d}:00:00Z\n"
        for hour in range(hours) for at, (name, (lat, lon)) in enumerate(places.items())
    )  # fmt: skip
    return "nom,lat,lon,vent,data\n" + "".join(rows)


@pytest.mark.parametrize("hours", [1, 2, 6])
def test_rows_that_lie_apart_at_once_are_of_stations_by_their_names(log_file: Write, hours: int) -> None:
    path = log_file(table(hours, PLACES))
    options = WindOptions(unit="m/s")
    found = anemometers(path, options)
    assert sorted(label.partition(":")[0] for label in found) == sorted(PLACES)
    log = read_log(path, WindOptions(unit="m/s", wind=found[-1]))
    np.testing.assert_array_equal(log.series.time, (NOON + np.arange(hours) * np.timedelta64(1, "h")).astype(np.int64))
    assert "wind_speed" in log.series.channels


def test_a_platform_that_moves_is_one(log_file: Write) -> None:
    rows = "".join(f"leg {at // 4},{41 + at / 20},{2 + at / 20},3.5,2026-05-01T12:{at:02d}:00Z\n" for at in range(20))
    assert anemometers(log_file(f"nom,lat,lon,vent,data\n{rows}"), WindOptions(unit="m/s", wind="vent")) == ()


def test_the_list_that_alone_holds_a_wind_is_read(log_file: Write) -> None:
    stations = [
        {"station_id": name, "observed_at": "2026-05-01T12:00:00Z", "wind_speed_ms": 4.1 + at, "wind_direction_deg": 40}
        for at, name in enumerate(("RCMT", "RCFG"))
    ]
    flights = [{"time": f"0{at}:40", "number": f"B{at}", "direction": "arrival"} for at in range(7, 9)]
    path = log_file(json.dumps({"date": "2026-05-01", "stations": stations, "flights": flights}, indent=1), "a.json")
    labels = anemometers(path)
    assert len(labels) == 2
    log = read_log(path, WindOptions(wind=next(label for label in labels if "RCFG" in label)))
    assert log.series.channels["wind_speed"].tolist() == [5.1]
    assert any("'flights'" in f.what for f in log.findings if f.kind == "several-lists")


def test_a_station_without_a_readable_stamp_is_no_reason_to_refuse_the_others(log_file: Write) -> None:
    rows = [
        f"{name},2{at} Apr 2021 22:00,{10 * at + 10} degrees at {at + 4} knots" for at, name in enumerate("ABCDEFGH")
    ]
    rows[3] = "D,w at EDDT:,320 at 2kts"
    rows[4] = "E,24 Apr 2021 22:00,Variable at 1 knots"
    path = log_file("\n".join(["station,time,winds", *rows]) + "\n")
    labels = anemometers(path)
    assert len(labels) == 8
    by = {label.partition(":")[0]: label for label in labels}
    first = read_log(path, WindOptions(zone="UTC", wind=by["A"])).series.channels
    assert (first["wind_speed"][0], np.rad2deg(first["wind_direction"][0])) == pytest.approx((4 * 1852 / 3600, 10))
    variable = read_log(path, WindOptions(zone="UTC", wind=by["E"])).series.channels
    assert variable["wind_speed"][0] == pytest.approx(1852 / 3600)
    assert np.isnan(variable.get("wind_direction", np.array([np.nan]))).all()
    with pytest.raises(NothingMeasuredError, match="no row with a readable time stamp"):
        read_log(path, WindOptions(zone="UTC", wind=by["D"]))
