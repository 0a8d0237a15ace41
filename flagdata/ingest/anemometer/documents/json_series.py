"""Series in JSON as web services send them: objects that hold lists of one length, each object of a place.

    {"type":"FeatureCollection","timestamps":["2026-05-01T12:00Z",…],"features":[{"type":"Feature","properties":
      {"parameters":{"FF":{"name":"Windgeschwindigkeit","unit":"m/s","data":[3.1,…]}},"station":"11999"}},…]}
    {"STATION":[{"STID":"KAAA","OBSERVATIONS":{"date_time":["2026-05-01T12:00:00Z",…],"wind_speed_set_1":[3.1,…]}},…],
     "UNITS":{"wind_speed":"m/s"}}

Source: GeoSphere Austria, "Dataset API", responses in GeoJSON (shared timestamps; a parameter's unit beside its data);
Synoptic Data, "Mesonet API", time series (units by variable); Open-Meteo, several locations (a list of objects, units
in "…_units"). CoverageJSON is read by `coverage_json`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from flagdata.ingest.anemometer.documents import coverage_json
from flagdata.ingest.anemometer.documents.places import Place, heading, rows
from flagdata.ingest.anemometer.text.kinds import cell_kind
from flagdata.ingest.anemometer.words.headings import understand, words_of

_DEEPEST = 6
"""Objects within objects that are looked into."""
_TIMES = frozenset({"time", "times", "date", "datetime", "timestamp", "timestamps", "epoch", "dt", "ts"})
"""Words of keys of instants."""
_VALUES = frozenset({"data", "value", "values"})
"""Keys of lists that are called by what they lie in."""
_CALLED = ("stid", "station_id", "stationid", "station", "name", "station_name", "stationname", "id", "title", "label")
"""Keys under which an object says what place it is of, the likeliest first."""
_POSITION = frozenset({"latitude", "longitude", "lat", "lon", "coordinates", "elevation", "height"})
_SET = re.compile(r"_set_\d+d?$")
"""What Synoptic's services put behind the name of a variable."""


@dataclass(frozen=True, kw_only=True)
class _List:
    """A list of plain values: the keys on the way to it, the object that it lies in, and itself."""

    path: tuple[str, ...]
    parent: dict[str, Any]
    values: list[Any]

    @property
    def name(self) -> str:
        """Its own key, or that of the object that it is the data of."""
        own = self.path[-1]
        return self.path[-2] if own.lower() in _VALUES and len(self.path) > 1 else own


def table(whole: Any) -> list[dict[str, Any]] | None:
    """The series of a whole file as rows; `None` where it holds none of the wind, or is a plain object of lists."""
    covered = coverage_json.places(whole) if isinstance(whole, dict) else []
    places = covered or list(_places(whole))
    if not any("wind" in understand(name).quantity for place in places for name in place.columns):
        return rows(covered) if covered else None
    return rows(places)


def _places(whole: Any) -> Iterator[Place]:
    """The places of the objects of a list, or of the one list of objects that an object holds."""
    lists = [whole] if isinstance(whole, list) else []
    if isinstance(whole, dict):
        lists = [item for item in whole.values() if isinstance(item, list) and item and isinstance(item[0], dict)]
    if len(lists) != 1 or not all(isinstance(item, dict) for item in lists[0]):
        return
    above = whole if isinstance(whole, dict) else {}
    shared = [_List(path=(k,), parent=above, values=v) for k, v in above.items() if _plain(v)]
    for number, item in enumerate(lists[0], start=1):
        own = list(_lists(item, ()))
        time = next((one for one in (*own, *shared) if _is_time(one)), None)
        if time is None:
            continue
        columns = {
            _heading(one, item, above): one.values for one in own
            if one is not time and len(one.values) == len(time.values) and one.path[-1] != "coordinates"
        }  # fmt: skip
        if columns:
            told = dict(_told(item, ()))
            names = {key: told[key] for key in _CALLED if key in told}
            at = {key: text for key, text in told.items() if key in _POSITION} or {"place": number}
            yield Place(at=at, times=time.values, columns=columns, names=names)


def _lists(item: dict[str, Any], path: tuple[str, ...]) -> Iterator[_List]:
    for key, value in item.items():
        if isinstance(value, dict) and len(path) < _DEEPEST:
            yield from _lists(value, (*path, str(key)))
        elif isinstance(value, list) and _plain(value):
            yield _List(path=(*path, str(key)), parent=item, values=value)


def _plain(value: Any) -> bool:
    """Whether a value is a list of plain values, at least two."""
    return isinstance(value, list) and len(value) > 1 and not any(isinstance(item, dict | list) for item in value)


def _is_time(one: _List) -> bool:
    kinds = {cell_kind(str(item)) for item in one.values if item is not None}
    return kinds == {"stamp"} or (kinds == {"number"} and bool(set(words_of(one.name)) & _TIMES))


def _heading(one: _List, item: dict[str, Any], above: dict[str, Any]) -> str:
    """The heading of a series, with the unit that stands beside its data or in an object of units."""
    label = _first(one.parent, ("name", "long_name", "label")) if one.name != one.path[-1] else ""
    known = (one.name, _SET.sub("", one.name))
    beside = _first(one.parent, ("unit", "units"))
    return heading(one.name, label, next(filter(None, (beside, *(_first(u, known) for u in _units(item, above)))), ""))


def _first(item: dict[str, Any], keys: Sequence[str]) -> str:
    """The text of the first of these keys that has one, or ""."""
    return next((text for key in keys if isinstance(text := item.get(key), str)), "")


def _units(*items: dict[str, Any]) -> list[dict[str, Any]]:
    every = (pair for item in items for pair in item.items())
    return [value for key, value in every if key.lower().endswith("units") and isinstance(value, dict)]


def _told(item: dict[str, Any], path: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    """What an object and those in it say in plain values and coordinates, by the key in small letters."""
    for key, value in item.items():
        if isinstance(value, dict) and len(path) < _DEEPEST and not _holds_lists(value):
            yield from _told(value, (*path, key))
        elif key == "properties" and isinstance(value, dict):
            yield from _told({k: v for k, v in value.items() if not isinstance(v, dict)}, (*path, key))
        elif isinstance(value, str | int | float) and not isinstance(value, bool) and (not path or key != "type"):
            yield str(key).lower(), str(value)
        elif key == "coordinates" and isinstance(value, list):
            yield "coordinates", " ".join(map(str, _flat(value)))


def _holds_lists(item: dict[str, Any]) -> bool:
    return any(_plain(value) or isinstance(value, dict) for key, value in item.items() if key != "coordinates")


def _flat(values: Sequence[Any]) -> list[Any]:
    return [one for value in values for one in (_flat(value) if isinstance(value, list) else [value])]
