"""CoverageJSON of one place is a table of its ranges over the axis of time."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from flagdata.ingest.anemometer.coverage_json import columns
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
SPEEDS, AWAY = [14.4, 18.0, None, 10.8], [210.0, 220.0, 230.0, 240.0]


def _range(values: list[Any], *, along: str = "t") -> dict[str, Any]:
    shape = [len(values), 1, 1]
    return {"type": "NdArray", "dataType": "float", "axisNames": [along, "y", "x"], "shape": shape, "values": values}


def _coverage(unit: dict[str, Any], name: str = "wind_speed") -> dict[str, Any]:
    times = [f"2026-05-01T12:{at}0:00Z" for at in range(4)]
    axes = {"x": {"values": [5.0]}, "y": {"values": [52.0]}, "t": {"values": times}}
    degrees = {"type": "Parameter", "observedProperty": {"label": {"en": "wd"}}, "unit": {"symbol": "deg"}}
    speed = {"type": "Parameter", "observedProperty": {"label": {"en": "Wind speed"}}, "unit": unit}
    return {
        "type": "Coverage", "domain": {"type": "Domain", "domainType": "PointSeries", "axes": axes},
        "parameters": {"wd": degrees, name: speed}, "ranges": {"wd": _range(AWAY), name: _range(SPEEDS)},
    }  # fmt: skip


@pytest.mark.parametrize("unit", [{"symbol": "km/h"}, {"symbol": {"value": "km/h"}}, {"label": {"en": "km/h"}}])
@pytest.mark.parametrize("indent", [None, 2])
def test_ranges_are_columns_over_the_time(read: Read, unit: dict[str, Any], indent: int | None) -> None:
    series = read(json.dumps(_coverage(unit), indent=indent)).series
    np.testing.assert_allclose(series.channels["wind_speed"], [4.0, 5.0, np.nan, 3.0])
    np.testing.assert_allclose(np.rad2deg(series.channels["wind_direction"]), AWAY)
    assert np.diff(series.time).tolist() == [600 * 10**9] * 3
    assert series.time[0] == 1_777_636_800 * 10**9


def test_a_parameter_whose_key_says_nothing_goes_by_its_label(read: Read) -> None:
    series = read(json.dumps(_coverage({"symbol": "m/s"}, name="p17"), indent=1)).series
    assert series.channels["wind_speed"][0] == 14.4


def test_a_collection_of_one_coverage_is_that_coverage() -> None:
    one = _coverage({"symbol": "m/s"})
    shared = {"type": "CoverageCollection", "parameters": one.pop("parameters"), "coverages": [one]}
    found = columns(shared)
    assert found is not None
    assert found[0] == ["time", "wd [deg]", "wind_speed [m/s]"]
    assert columns(shared | {"coverages": [one, one]}) is None


def test_a_range_over_another_axis_is_no_column() -> None:
    item = _coverage({"symbol": "m/s"})
    item["ranges"]["wd"] = _range(AWAY, along="z")
    found = columns(item)
    assert found is not None
    assert found[0] == ["time", "wind_speed [m/s]"]
