"""Measured values in JSON that stand beside their unit, their name, their station or their time, put in plain members.

    {"windSpeed": {"unitCode": "wmoUnit:km_h-1", "value": 18.0}}                    → "windSpeed [km/h]"
    {"observations": [{"elementId": "wind_speed", "value": 3.1, "unit": "m/s"}]}    → "observations.wind_speed [m/s]"
    {"timestamp": "…", "data": [{"stationId": "S1", "value": 3.1}, …]}              → an object for each station
    {"2026-05-01T12:00": {"1200500": {"intensidadeVentoKM": 18.0}, …}}              → one for each time and station

So write the United States' weather service (QuantitativeValue), the Norwegian one (Frost), Singapore's data.gov.sg and
the Portuguese IPMA, by the descriptions of their services.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from flagdata.ingest.anemometer.text.kinds import cell_kind
from flagdata.ingest.anemometer.words.headings import words_of
from flagdata.units import spelled

_VALUE = "value"
_UNITS = ("unit", "units", "unitCode")
_NAMES = ("elementId", "parameterId", "element", "parameter", "quantity", "name", "variable")
"""Members that say what is measured, in an object that has a value beside them."""
_STATIONS = frozenset({"station", "stationid", "site", "sensor", "location", "node", "device"})


def plain(value: dict[str, Any], name: str) -> dict[str, Any] | None:
    """An object of a value and its unit as a member that states the unit, and the others; `None` for another object.

    Args:
        name: of the object.
    """
    unit = next((text for key in _UNITS if isinstance(text := value.get(key), str)), None)
    known = None if unit is None or _VALUE not in value else _unit(unit)
    if known is None or isinstance(value[_VALUE], dict | list):
        return None
    rest = {f"{name}.{key}": inner for key, inner in value.items() if key != _VALUE and key not in _UNITS}
    return {f"{name} [{known}]": value[_VALUE], **rest}


def by_name(values: Sequence[Any]) -> dict[str, Any] | None:
    """Objects of a list by the name of what each measures; `None` where they have none, or one stands twice."""
    for key in _NAMES:
        named = {
            name: {k: v for k, v in value.items() if k != key}
            for value in values
            if isinstance(value, dict) and _VALUE in value and isinstance(name := value.get(key), str)
        }
        if named and len(named) == len(values):
            return named
    return None


def by_station(items: Sequence[Any]) -> list[Any]:
    """Objects of a list, of which those that hold a list of stations become one for each station."""
    return [row for item in items for row in (_stations(item) if isinstance(item, dict) else [item])]


def by_time(whole: Any) -> list[dict[str, Any]] | None:
    """An object whose members are called by times, as a list of objects; `None` for another object.

    Each time may hold stations, and each station times.
    """
    if not isinstance(whole, dict) or not whole or not all(isinstance(value, dict) for value in whole.values()):
        return None
    if _stamped(whole):
        return list(_at_times(whole, None))
    if all(_stamped(value) for value in whole.values()):
        return [row for station, times in whole.items() for row in _at_times(times, station)]
    return None


def _stamped(item: Mapping[str, Any]) -> bool:
    return bool(item) and all(cell_kind(str(key)) == "stamp" for key in item)


def _at_times(times: Mapping[str, Any], station: str | None) -> Iterator[dict[str, Any]]:
    for time, value in times.items():
        inner = value if isinstance(value, dict) else {_VALUE: value}
        if station is None and inner and all(isinstance(one, dict) or one is None for one in inner.values()):
            yield from ({"time": time, "station": name, **one} for name, one in inner.items() if one is not None)
        else:
            yield {"time": time, **({} if station is None else {"station": station}), **inner}


def _stations(item: dict[str, Any]) -> list[dict[str, Any]]:
    lists = [key for key, value in item.items() if isinstance(value, list) and value]
    if len(lists) != 1 or not all(_of_station(one) for one in item[lists[0]]):
        return [item]
    above = {key: value for key, value in item.items() if key != lists[0]}
    return [above | one for one in item[lists[0]]]


def _of_station(item: Any) -> bool:
    """Whether an object holds plain values, among them the name of a station."""
    return (
        isinstance(item, dict) and not any(isinstance(value, dict | list) for value in item.values())
        and any(set(words_of(str(key))) & _STATIONS for key in item)
    )  # fmt: skip


def _unit(text: str) -> str | None:
    """The unit of a text such as "wmoUnit:km_h-1"; `None` where it is none that is known."""
    bare = re.sub(r"[_\s]*\(angle\)", "", text.rpartition(":")[2]).replace("_", " ")
    return spelled(bare)
