"""CoverageJSON is a table of its ranges over the axis of time, and refused by name where it has none."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.ingest.anemometer import WindOptions, anemometers, read_log, sniff
from flagdata.ingest.anemometer.documents.coverage_json import places
from flagdata.ingest.anemometer.documents.places import rows
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


def _columns(item: dict[str, Any]) -> list[str]:
    return list(rows(places(item))[0])


def test_a_collection_of_one_coverage_is_that_coverage() -> None:
    one = _coverage({"symbol": "m/s"})
    shared = {"type": "CoverageCollection", "parameters": one.pop("parameters"), "coverages": [one]}
    assert _columns(shared) == ["time", "wd [deg]", "wind_speed [m/s]"]


def test_a_range_over_another_axis_is_no_column() -> None:
    item = _coverage({"symbol": "m/s"})
    item["ranges"]["wd"] = _range(AWAY, along="z")
    assert _columns(item) == ["time", "wind_speed [m/s]"]


def test_places_of_a_collection_are_sites(log_file: Callable[..., Path]) -> None:
    one, other = _coverage({"symbol": "m/s"}), _coverage({"symbol": "m/s"})
    other["domain"]["axes"]["x"] = {"values": [6.5]}
    other["ranges"]["wind_speed"] = _range([1.0, 2.0, 3.0, 4.0])
    path = log_file(json.dumps({"type": "CoverageCollection", "coverages": [one, other]}))
    assert anemometers(path) == ("x 5.0", "x 6.5")
    series = read_log(path, WindOptions(wind="x 6.5")).series
    assert series.channels["wind_speed"].tolist() == [1, 2, 3, 4]
    named = path.with_name("named.json")
    one["eumetnet:locationId"], other["eumetnet:locationId"] = "0-20000-0-06999", "0-20000-0-06998"
    named.write_text(json.dumps({"type": "CoverageCollection", "coverages": [one, other]}))
    assert anemometers(named) == ("0-20000-0-06998", "0-20000-0-06999")


def test_coverages_of_one_place_are_put_together() -> None:
    one, other = _coverage({"symbol": "m/s"}), _coverage({"symbol": "m/s"})
    del one["ranges"]["wd"], other["ranges"]["wind_speed"]
    one["id"], other["id"] = "speed", "direction"
    found = rows(places({"type": "CoverageCollection", "coverages": [one, other]}))
    assert list(found[0]) == ["time", "wind_speed [m/s]", "wd [deg]"]
    assert [row["wd [deg]"] for row in found] == AWAY


def test_the_same_columns_once_more_are_a_place_of_their_own() -> None:
    found = rows(places({"type": "CoverageCollection", "coverages": [_coverage({"symbol": "m/s"})] * 2}))
    assert len(found) == 8
    assert len({row["station"] for row in found}) == 2


def test_tuples_of_a_composite_axis_are_places() -> None:
    item = _coverage({"symbol": "m/s"})
    composite = {"dataType": "tuple", "coordinates": ["x", "y"], "values": [[5, 52], [6, 52]]}
    item["domain"]["axes"] = {"t": {"values": ["2026-05-01T12:00:00Z", "2026-05-01T12:10:00Z"]}, "composite": composite}
    both = {"type": "NdArray", "axisNames": ["composite", "t"], "shape": [2, 2], "values": [1.0, 2.0, 3.0, 4.0]}
    item["ranges"] = {"wind_speed": both}
    found = [(row["station"], row["wind_speed [m/s]"]) for row in rows(places(item))]
    assert found == [("x 5", 1.0), ("x 5", 2.0), ("x 6", 3.0), ("x 6", 4.0)]


def _refused(path: Path) -> InputError:
    with pytest.raises(InputError, match="CoverageJSON") as caught:
        read_log(path)
    assert sniff(path)[0].fix == caught.value.fix
    return caught.value


def test_a_missing_axis_of_time_is_refused_and_read_once_it_is_written(log_file: Callable[..., Path]) -> None:
    item = _coverage({"symbol": "m/s"})
    axis = item["domain"]["axes"].pop("t")
    error = _refused(log_file(json.dumps(item)))
    assert 'the axis of time "t" of the coverage is missing; its axes are x, y' in error.what
    assert '"t": {"values": [...]} in domain.axes' in error.fix
    item["domain"]["axes"]["t"] = axis
    assert len(read_log(log_file(json.dumps(item))).series.time) == 4


def test_a_range_over_a_missing_axis_is_refused_and_read_once_it_is_written(log_file: Callable[..., Path]) -> None:
    item = _coverage({"symbol": "m/s"})
    item["ranges"] = {"wind_speed": {**_range(SPEEDS), "axisNames": ["t", "z", "x"]}}
    error = _refused(log_file(json.dumps(item)))
    assert "'wind_speed' of the coverage is over the axis 'z', which its domain does not have" in error.what
    assert '"z": {"values": [...]} in domain.axes, with 1 value;' in error.fix
    item["domain"]["axes"]["z"] = {"values": [10.0]}
    assert read_log(log_file(json.dumps(item))).series.channels["wind_speed"][0] == 14.4


def test_a_missing_axis_in_a_collection_is_told_with_the_number_of_its_coverage(log_file: Callable[..., Path]) -> None:
    one = _coverage({"symbol": "m/s"})
    del one["domain"]["axes"]["t"]
    error = _refused(log_file(json.dumps({"type": "CoverageCollection", "coverages": [one, one]})))
    assert "of coverage 1 is missing" in error.what


def test_a_direction_that_cannot_be_read_is_told_beside_the_speed(log_file: Callable[..., Path]) -> None:
    item = _coverage({"symbol": "m/s"})
    item["ranges"]["wd"] = _range(AWAY, along="z")
    log = read_log(log_file(json.dumps(item)))
    assert log.series.channels["wind_speed"][0] == 14.4
    told = [finding.what for finding in log.findings if finding.kind == "columns-not-read"]
    assert any("'wd'" in what and "'z'" in what for what in told)


@pytest.mark.parametrize(
    ("where", "put", "says"),
    [
        ("domain", "https://example.org/domain", "not in the file, but at https://example.org/domain"),
        ("domain", {"type": "Domain"}, "has no axes"),
        ("ranges", {}, "has no ranges"),
        ("ranges", {"wind_speed": "https://example.org/speed"}, "not in the file, but at https://example.org/speed"),
        ("ranges", {"wind_speed": {"type": "TiledNdArray", "axisNames": ["t"], "shape": [4]}}, "holds no values"),
        ("ranges", {"wind_speed": _range([1.0, 2.0, 3.0])}, "has 3 values along the axis 't', which has 4"),
        ("ranges", {"wind_speed": {**_range(SPEEDS), "shape": [4, 1, 2]}}, "holds 4 values, but its shape is 4x1x2"),
    ],
)
def test_what_the_file_does_not_hold_is_refused_by_its_name(
    log_file: Callable[..., Path], where: str, put: Any, says: str
) -> None:
    item = _coverage({"symbol": "m/s"}) | {where: put}
    assert says in _refused(log_file(json.dumps(item))).what


def test_a_place_that_moves_is_refused(log_file: Callable[..., Path]) -> None:
    item = _coverage({"symbol": "m/s"})
    tuples = [[f"2026-05-01T12:{at}0:00Z", 5 + at, 52] for at in range(4)]
    item["domain"]["axes"] = {"composite": {"dataType": "tuple", "coordinates": ["t", "x", "y"], "values": tuples}}
    assert "a trajectory" in _refused(log_file(json.dumps(item))).what


def test_several_places_are_refused_with_the_name_that_reads_one(log_file: Callable[..., Path]) -> None:
    item = _coverage({"symbol": "m/s"})
    item["domain"]["axes"]["x"] = {"values": [5.0, 6.0]}
    both = {"type": "NdArray", "axisNames": ["t", "y", "x"], "shape": [4, 1, 2], "values": [*map(float, range(8))]}
    item["ranges"] = {"wind_speed": both}
    path = log_file(json.dumps(item))
    with pytest.raises(InputError, match=r"2 anemometers: x 5\.0, x 6\.0") as caught:
        read_log(path)
    assert "--wind 'x 5.0'" in caught.value.fix
    assert read_log(path, WindOptions(wind="x 5.0")).series.channels["wind_speed"].tolist() == [0, 2, 4, 6]


def test_a_coverage_in_one_long_line_is_read(log_file: Callable[..., Path]) -> None:
    item, count = _coverage({"symbol": "m/s"}), 6000
    minutes = range(0, 10 * count, 10)
    times = [f"{np.datetime64('2026-01-01T00:00:00') + np.timedelta64(at, 'm')}Z" for at in minutes]
    item["domain"]["axes"]["t"]["values"] = times
    item["ranges"] = {"wind_speed": _range([float(at % 9) for at in range(count)])}
    text = json.dumps(item)
    assert len(text) > 65_536
    assert len(read_log(log_file(text)).series.time) == count
