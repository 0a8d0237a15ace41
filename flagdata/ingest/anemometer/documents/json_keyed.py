"""Readings in JSON that are members of an object, called by a row, a place or a time, put as a list of objects.

    {"time": {"0": "2026-05-01T12:00", …}, "wind_speed": {"0": 3.1, …}}     columns, cells by the rows' numbers or times
    {"0": {"time": "2026-05-01T12:00", "wind_speed": 3.1}, "1": {…}}        rows by their numbers, or by keys of a store
    {"0115": {"timestamp": "…", "value_WS": 3.1}, "0122": {…}}              places, one reading each
    {"S1": [{"time": "…", "ws": 3.1}, …], "S2": {"rows": […]}}              places, a list of readings each

So write pandas (`DataFrame.to_json`, orient "columns" and "index"), Firebase and stations' services.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from flagdata.ingest.anemometer.documents.json_instants import holds_instant, is_instant
from flagdata.ingest.anemometer.documents.places import STATION
from flagdata.ingest.anemometer.words.headings import names_time, understand, words_of

_SEVERAL = 2
"""Members from which an object is one of rows or places."""
_OF_A_STORE = re.compile(r"-[\w-]{19}|[0-9a-f]{24}|[0-9a-f]{8}(?:-[0-9a-f]{4}){3}-[0-9a-f]{12}", re.IGNORECASE)
"""Keys that a store of documents makes: Firebase's push IDs, MongoDB's object IDs, UUIDs."""
_NUMBERED = re.compile(r"(?P<word>[^\W\d]*)[ _-]?(?P<number>\d+)")
_PLACE = frozenset(
    {"lat", "latitude", "lon", "lng", "longitude", "location", "coordinates", "elevation", "altitude", "station"}
)
_PLACES = frozenset({"station", "site", "sensor", "mast", "tower", "turbine", "node", "device", "buoy", "location"})


def as_list(whole: Any) -> Any:
    """The readings of an object of objects as a list of objects; anything else as it is.

    The object may be the whole or the one member of it that holds objects, whose plain members beside go with each.
    """
    if not isinstance(whole, dict):
        return whole
    within = [key for key, value in whole.items() if isinstance(value, dict | list)]
    above: dict[str, Any] = {}
    item: Any = whole
    if len(within) == 1 and isinstance(whole[within[0]], dict):
        above = {key: value for key, value in whole.items() if key != within[0]}
        item = whole[within[0]]
    found = _of_columns(item) or _of_lists(item) or _of_members(item)
    return whole if found is None else [{**above, **row} for row in found]


def _of_columns(item: Mapping[str, Any]) -> list[dict[str, Any]] | None:
    """Rows of columns whose cells are called by the number or the time of their row."""
    columns = list(item.values())
    if not columns or not all(isinstance(cells, dict) and len(cells) > 1 and _plain(cells) for cells in columns):
        return None
    keys = list(columns[0])
    if any(list(cells) != keys for cells in columns) or any("wind" in understand(key).quantity for key in keys):
        return None
    timed = all(is_instant("time", _number(key)) for key in keys)
    if not timed and not (_consecutive(keys) and any(names_time(name) for name in item)):
        return None
    if not any("wind" in understand(name).quantity for name in item):
        return None
    rows = [{name: cells[key] for name, cells in item.items()} for key in keys]
    if not timed or holds_instant(rows[0]):
        return rows
    return [{"time": _number(key), **row} for key, row in zip(keys, rows, strict=True)]


def _of_members(item: Mapping[str, Any]) -> list[dict[str, Any]] | None:
    """Rows of objects that each hold an instant: of one log, or of places that their keys name."""
    members = list(item.values())
    if len(members) < _SEVERAL or not all(isinstance(one, dict) and _timed(one) for one in members):
        return None
    keys = list(item)
    if all(is_instant("time", _number(key)) for key in keys):
        return None  # called by their times
    if all(_OF_A_STORE.fullmatch(key) for key in keys) or (_consecutive(keys) and not _elsewhere(keys, members)):
        return members
    return [{STATION: _called(key), **one} for key, one in item.items()]


def _of_lists(item: Mapping[str, Any]) -> list[dict[str, Any]] | None:
    """Rows of places that hold a list of readings each, itself or as a member beside what is said of the place."""
    if len(item) < _SEVERAL:
        return None
    found: list[dict[str, Any]] = []
    for key, one in item.items():
        readings = _readings(one)
        if not readings:
            return None
        found += [{STATION: _called(key), **row} for row in readings]
    return found


def _readings(place: Any) -> list[dict[str, Any]]:
    """The readings of a place; none where it is no list of them, nor an object with one such list."""
    if isinstance(place, list):
        return place if place and all(isinstance(row, dict) and _timed(row) for row in place) else []
    lists = [rows for value in place.values() if (rows := _readings(value))] if isinstance(place, dict) else []
    if len(lists) != 1:
        return []
    said = {k: v for k, v in place.items() if not isinstance(v, dict | list) and not is_instant(k, v)}
    return [{**said, **row} for row in lists[0]]


def _called(key: str) -> str:
    """The name of a place by its key: a bare number would be taken for a count."""
    return f"{STATION} {key}" if key.isdigit() else key


def _timed(item: Mapping[str, Any]) -> bool:
    """Whether an object holds an instant, itself or in an object within."""
    return holds_instant(item) or any(isinstance(value, dict) and holds_instant(value) for value in item.values())


def _number(key: str) -> Any:
    return int(key) if key.isdigit() else key


def _plain(cells: Mapping[str, Any]) -> bool:
    return not any(isinstance(value, dict | list) for value in cells.values())


def _consecutive(keys: Sequence[str]) -> bool:
    """Whether keys are numbers one after another, all behind the same word or none."""
    found = [_NUMBERED.fullmatch(key) for key in keys]
    matches = [match for match in found if match is not None]
    if len(matches) < len(keys) or len({match["word"] for match in matches}) > 1:
        return False
    numbers = [int(match["number"]) for match in matches]
    return numbers == list(range(numbers[0], numbers[0] + len(numbers)))


def _elsewhere(keys: Sequence[str], members: Sequence[Mapping[str, Any]]) -> bool:
    """Whether objects with numbered keys are of several places: by the word before the number, or by where they are."""
    if set(words_of(keys[0])) & _PLACES:
        return True
    told = [
        tuple(
            str(value) for key, value in one.items() if set(words_of(str(key))) & _PLACE and not isinstance(value, list)
        )
        for one in members
    ]
    return len(set(told)) > 1 and len(set(told)) == len(told)
