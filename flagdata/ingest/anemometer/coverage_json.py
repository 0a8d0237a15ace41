"""CoverageJSON of one place: the values of its ranges over the instants of the axis "t", as columns.

Source: OGC 21-069r2, "OGC CoverageJSON Community Standard": a domain with axes, a range for each parameter, and the
parameter's unit as a symbol or a label.
"""

from __future__ import annotations

import math
from typing import Any

from flagdata.ingest.anemometer.headings import understand

_TIME = "t"


def columns(item: dict[str, Any]) -> tuple[list[str], list[list[Any]]] | None:
    """The headings and the columns of a coverage, the time first; `None` for what is none, or is of several places."""
    if item.get("type") == "CoverageCollection" and isinstance(item.get("coverages"), list):
        alone = item["coverages"][0] if len(item["coverages"]) == 1 else None
        shared = {"parameters": item.get("parameters")}
        return columns(shared | alone) if isinstance(alone, dict) and alone.get("type") == "Coverage" else None
    ranges, times = item.get("ranges"), _member(item, "domain", "axes", _TIME, "values")
    if item.get("type") != "Coverage" or not isinstance(ranges, dict) or not isinstance(times, list) or not times:
        return None
    names, found = ["time"], [times]
    for key, values in ranges.items():
        cells = _member(values, "values")
        if not isinstance(cells, list) or len(cells) != len(times) or not _over_time(values, len(times)):
            continue
        names.append(_heading(str(key), _member(item, "parameters", key)))
        found.append(cells)
    return (names, found) if len(found) > 1 else None


def _member(item: Any, *path: str) -> Any:
    for key in path:
        item = item.get(key) if isinstance(item, dict) else None
    return item


def _over_time(values: Any, count: int) -> bool:
    """Whether a range has the time as its one axis of more than one value."""
    axes, shape = _member(values, "axisNames"), _member(values, "shape")
    if not isinstance(axes, list) or not isinstance(shape, list) or len(axes) != len(shape):
        return count == 1
    whole = all(isinstance(size, int) and size > 0 for size in shape)
    return whole and math.prod(shape) == count and (count == 1 or (_TIME in axes and shape[axes.index(_TIME)] == count))


def _heading(key: str, parameter: Any) -> str:
    """The name of a parameter, or its label where that alone tells the quantity, with the unit in brackets."""
    symbol = _member(parameter, "unit", "symbol")
    symbol = _member(symbol, "value") if isinstance(symbol, dict) else symbol
    unit = symbol if isinstance(symbol, str) else _text(_member(parameter, "unit", "label"))
    label = _text(_member(parameter, "observedProperty", "label"))
    name = label if _of_wind(label, unit) and not _of_wind(key, unit) else key
    return f"{name} [{unit}]" if unit else name


def _of_wind(name: str, unit: str) -> bool:
    heading = understand(name, unit)
    return "wind" in heading.quantity and heading.sure


def _text(label: Any) -> str:
    """A text in English, or in the language that it has."""
    if isinstance(label, dict):
        label = label.get("en", next(iter(label.values()), ""))
    return label if isinstance(label, str) else ""
