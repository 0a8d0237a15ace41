"""CoverageJSON of one or several places: the values of its ranges over the instants of the axis "t", as columns.

Source: OGC 21-069r2, "OGC CoverageJSON Community Standard": a domain with axes, of which a composite one holds tuples
of coordinates, a range for each parameter, and the parameter's unit as a symbol or a label.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from flagdata.ingest.anemometer.documents.places import Place, heading

_TIME, _COMPOSITE = "t", "composite"
_NAMES = ("id", "name", "title", "label")
"""How keys end under which a coverage says what place it is of."""


@dataclass(frozen=True, kw_only=True)
class Unread:
    """Something of a coverage that is not read: what and where, and what its user can do."""

    what: str
    fix: str


def places(item: dict[str, Any]) -> list[Place]:
    """The series of a coverage or of a collection of coverages; none for what is neither."""
    if item.get("type") == "CoverageCollection" and isinstance(item.get("coverages"), list):
        shared = {"parameters": item.get("parameters")}
        every = [one for one in item["coverages"] if isinstance(one, dict) and one.get("type") == "Coverage"]
        return [place for one in every for place in _of_coverage(shared | one)]
    return list(_of_coverage(item)) if item.get("type") == "Coverage" else []


def unread(item: Any) -> tuple[Unread, ...]:
    """What of a coverage or of a collection of coverages is not read; none for what is neither."""
    if not isinstance(item, dict) or item.get("type") not in ("Coverage", "CoverageCollection"):
        return ()
    if item["type"] == "Coverage":
        return tuple(_defects(item, "the coverage"))
    every = item.get("coverages")
    if not isinstance(every, list) or not every:
        return (Unread(what="the collection holds no coverages", fix=_ASK),)
    numbered = [(number, one) for number, one in enumerate(every, start=1) if isinstance(one, dict)]
    return tuple(defect for number, one in numbered for defect in _defects(one, f"coverage {number}"))


_ASK = "ask the service for a series over time (PointSeries) with its values in the file, or for CSV"


def _defects(item: dict[str, Any], called: str) -> Iterator[Unread]:
    """What keeps a coverage, or ranges of it, from being read."""
    domain, ranges = item.get("domain"), item.get("ranges")
    if isinstance(domain, str):
        yield _elsewhere(f"the domain of {called}", domain)
        return
    axes, times = _member(domain, "axes"), _member(domain, "axes", _TIME, "values")
    if not isinstance(axes, dict) or not axes:
        yield Unread(what=f"the domain of {called} has no axes", fix=_ASK)
    elif not isinstance(times, list) or not times:
        yield _without_time(axes, called)
    elif not isinstance(ranges, dict) or not ranges:
        yield Unread(what=f"{called} has no ranges, which hold its values", fix=_ASK)
    else:
        for key, values in ranges.items():
            defect = _defect(axes, values, len(times), f"the range {key!r} of {called}")
            if defect is not None:
                yield defect


def _without_time(axes: dict[str, Any], called: str) -> Unread:
    """That a domain has no axis of instants."""
    inside = _member(axes, _COMPOSITE, "coordinates")
    if isinstance(inside, list) and _TIME in inside:
        what = f"the time of {called} is within its composite axis: a trajectory, whose place moves"
        return Unread(what=what, fix="write a table with one row an instant: its time, x, y and the wind, with units")
    own = "has no list of values" if _TIME in axes else f"is missing; its axes are {', '.join(sorted(axes))}"
    fix = f'write its instants into the file, "t": {{"values": [...]}} in domain.axes, one for each value; or {_ASK}'
    return Unread(what=f'the axis of time "t" of {called} {own}', fix=fix)


def _elsewhere(what: str, address: str) -> Unread:
    shown = address[:200]
    return Unread(
        what=f"{what} is not in the file, but at {shown}", fix=f"put what {shown} holds in its place; or {_ASK}"
    )


def _defect(axes: dict[str, Any], values: Any, count: int, called: str) -> Unread | None:
    """What keeps a range from being read over the axes of its domain; `None` where nothing does.

    Args:
        axes: of the domain.
        values: the range.
        count: of instants.
        called: what the range is called in a message.
    """
    if isinstance(values, str):
        return _elsewhere(called, values)
    cells = _member(values, "values")
    if not isinstance(cells, list):
        return Unread(what=f"{called} holds no values, as one in tiles (TiledNdArray)", fix=_ASK)
    names, shape = _extent(values)
    if any(not isinstance(size, int) or size < 1 for size in shape) or math.prod(shape) != len(cells):
        what = f"{called} holds {len(cells)} values, but its shape is {'x'.join(map(str, shape))}"
        return Unread(what=what, fix="the file is damaged or incomplete: save it anew")
    for name, size in zip(names, shape, strict=True):
        length = count if name == _TIME else len(_coordinates(axes, name))
        if name not in axes:
            fix = f'write the axis into the file, "{name}": {{"values": [...]}} in domain.axes, with {size} value'
            fix += "s" if size > 1 else ""
            what = f"{called} is over the axis {name!r}, which its domain does not have"
            return Unread(what=what, fix=f"{fix}; or {_ASK}")
        if length != size:
            what = f"{called} has {size} values along the axis {name!r}, which has {length}"
            return Unread(what=what, fix="the file is damaged or incomplete: save it anew")
    return None if _TIME in names or count == 1 else Unread(
        what=f"{called} is not over the axis of time, which has {count} instants", fix=_ASK
    )  # fmt: skip


def _extent(values: Any) -> tuple[list[str], list[Any]]:
    """The names of the axes of a range and its length along each; over time alone where it does not say."""
    names, shape = _member(values, "axisNames"), _member(values, "shape")
    if not isinstance(names, list) or not isinstance(shape, list) or len(names) != len(shape):
        return [_TIME], [len(values["values"])]
    return [str(name) for name in names], shape


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
    if _defect(axes, values, count, "") is not None:
        return
    cells, (names, shape) = values["values"], _extent(values)
    if _TIME not in names:
        names, shape = [_TIME, *names], [1, *shape]
    others = [_coordinates(axes, name) for name in names if name != _TIME]
    sizes = [size for name, size in zip(names, shape, strict=True) if name != _TIME]
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
