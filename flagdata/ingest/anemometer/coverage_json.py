"""CoverageJSON of one or several places: the values of its ranges over the instants of the axis "t", as columns.

Source: OGC 21-069r2, "OGC CoverageJSON Community Standard": a domain with axes, of which a composite one holds tuples
of coordinates, a range for each parameter, and the parameter's unit as a symbol or a label.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from flagdata.ingest.anemometer.places import Place, heading

_TIME, _COMPOSITE = "t", "composite"
_NAMES = ("id", "name", "title", "label")
"""How keys end under which a coverage says what place it is of."""


def places(item: dict[str, Any]) -> list[Place]:
    """The series of a coverage or of a collection of coverages; none for what is neither."""
    if item.get("type") == "CoverageCollection" and isinstance(item.get("coverages"), list):
        shared = {"parameters": item.get("parameters")}
        every = [one for one in item["coverages"] if isinstance(one, dict) and one.get("type") == "Coverage"]
        return [place for one in every for place in _of_coverage(shared | one)]
    return list(_of_coverage(item)) if item.get("type") == "Coverage" else []


def _of_coverage(item: dict[str, Any]) -> Iterator[Place]:
    """The places of a coverage, each with the ranges that have a value at each instant."""
    axes, ranges = _member(item, "domain", "axes"), item.get("ranges")
    times = _member(axes, _TIME, "values")
    if not isinstance(ranges, dict) or not isinstance(times, list) or not times:
        return
    found: dict[tuple[tuple[str, Any], ...], dict[str, list[Any]]] = {}
    for key, values in ranges.items():
        named = _heading(str(key), _member(item, "parameters", key))
        for at, series in _series(axes, values, len(times)):
            found.setdefault(tuple(at.items()), {})[named] = series
    names = {key: text for key, text in item.items() if isinstance(text, str) and key.lower().endswith(_NAMES)}
    for at, columns in found.items():
        yield Place(at=dict(at), times=times, columns=columns, names=names)


def _series(axes: dict[str, Any], values: Any, count: int) -> Iterator[tuple[dict[str, Any], list[Any]]]:
    """The series of a range at each place, with the place's coordinates; none where it is not over these axes.

    Args:
        axes: of the domain.
        values: the range.
        count: of instants.
    """
    cells, names, shape = (_member(values, key) for key in ("values", "axisNames", "shape"))
    if not isinstance(cells, list):
        return
    if not isinstance(names, list) or not isinstance(shape, list) or len(names) != len(shape):
        names, shape = [_TIME], [len(cells)]
    if any(not isinstance(size, int) or size < 1 for size in shape) or math.prod(shape) != len(cells):
        return
    names, shape = [*names], [*shape]
    if _TIME not in names:
        names, shape = [_TIME, *names], [1, *shape]
    others = [_coordinates(axes, name) for name in names if name != _TIME]
    sizes = [size for name, size in zip(names, shape, strict=True) if name != _TIME]
    if shape[names.index(_TIME)] != count or any(len(own) != size for own, size in zip(others, sizes, strict=True)):
        return
    held = {at: value for axis in axes if axis not in names and axis != _TIME
            for own in _coordinates(axes, axis)[:1] for at, value in own.items()}  # fmt: skip
    grid = np.empty(len(cells), dtype=object)
    grid[:] = cells
    over_time = np.moveaxis(grid.reshape(shape), names.index(_TIME), 0).reshape(count, -1)
    for place, index in enumerate(np.ndindex(*sizes)):
        at = dict(held)
        for own, number in zip(others, index, strict=True):
            at |= own[number]
        yield dict(sorted(at.items())), over_time[:, place].tolist()


def _coordinates(axes: Mapping[str, Any], name: str) -> list[dict[str, Any]]:
    """The coordinates of each step of an axis, by their names."""
    axis = axes.get(name)
    values = _member(axis, "values")
    if not isinstance(values, list):
        start, stop, count = (_member(axis, key) for key in ("start", "stop", "num"))
        numbers = all(isinstance(number, int | float) for number in (start, stop, count))
        values = np.linspace(start, stop, int(count)).tolist() if numbers else []
    if name != _COMPOSITE:
        return [{name: value} for value in values if isinstance(value, int | float | str)]
    called = _member(axis, "coordinates")
    if not isinstance(called, list):
        return []
    return [dict(zip(map(str, called), own, strict=False)) for own in values if isinstance(own, list)]


def _member(item: Any, *path: str) -> Any:
    for key in path:
        item = item.get(key) if isinstance(item, dict) else None
    return item


def _heading(key: str, parameter: Any) -> str:
    """The heading of a parameter by its key, its label and its unit."""
    symbol = _member(parameter, "unit", "symbol")
    symbol = _member(symbol, "value") if isinstance(symbol, dict) else symbol
    unit = symbol if isinstance(symbol, str) else _text(_member(parameter, "unit", "label"))
    return heading(key, _text(_member(parameter, "observedProperty", "label")), unit)


def _text(label: Any) -> str:
    """A text in English, or in the language that it has."""
    if isinstance(label, dict):
        label = label.get("en", next(iter(label.values()), ""))
    return label if isinstance(label, str) else ""
