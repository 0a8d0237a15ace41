"""Series in JSON whose values are called by their Unix times, each beside its unit: made into one row a time.

    {"data": {"wind": {"wind_speed": {"unit": "mph", "list": {"1777636800": "3.1", …}}, "wind_direction": {…}}}}

Source: Ecowitt, "API v3", device history (a quantity's unit and a list of its values by the second since 1970).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

from flagdata.ingest.anemometer.words.headings import understand

_DEEPEST = 6
"""Objects within objects that are looked into."""
_LEAST = 2
_EPOCH = re.compile(r"1\d{9}(?:\d{3})?")
"""Seconds or milliseconds since 1970, from 2001 to 2033."""
_CALLED = frozenset({"list", "data", "values", "value", "history"})
"""Keys of objects that are called by what they lie in."""


def table(whole: Any) -> list[dict[str, Any]] | None:
    """The series of a whole file as rows; `None` where none of them is called by the wind."""
    series = list(_series(whole, "", None, _DEEPEST))
    if not any("wind" in understand(name).quantity for name, _ in series):
        return None
    rows: dict[str, dict[str, Any]] = {}
    for name, values in series:
        for time, value in values.items():
            rows.setdefault(time, {"time [epoch]": time})[name] = value
    return [rows[time] for time in sorted(rows, key=int)]


def _series(item: Any, name: str, unit: str | None, depth: int) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Each series below an object: its name, with its unit, and its values by their times."""
    if not isinstance(item, dict) or depth == 0:
        return
    if len(item) >= _LEAST and all(_EPOCH.fullmatch(str(key)) for key in item):
        if not any(isinstance(value, dict | list) for value in item.values()):
            yield (f"{name} [{unit}]" if unit else name), item
        return
    stated = item.get("unit", item.get("units"))
    for key, inner in item.items():
        called = name if str(key).lower() in _CALLED and name else str(key)
        yield from _series(inner, called, stated if isinstance(stated, str) else unit, depth - 1)
