"""Series of one or of several places out of JSON, as rows: one a place and instant, with a column that tells places."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from flagdata.ingest.anemometer.words.headings import understand

STATION = "station"
"""Heading of the column that tells several places apart."""
_TIME = "time"


@dataclass(frozen=True, kw_only=True)
class Place:
    """Series of one place, or some of them: those of one position are put together.

    Attributes:
        at: its position, coordinates by their names; or its number in the file.
        times: instants, as the file has them.
        columns: heading → a value for each instant.
        names: what the place is called, by the key that says so.
    """

    at: Mapping[str, Any]
    times: Sequence[Any]
    columns: Mapping[str, Sequence[Any]]
    names: Mapping[str, str] = field(default_factory=dict)


def rows(places: Sequence[Place]) -> list[dict[str, Any]]:
    """A row for each place and instant, with the place's label where there are several."""
    keys = [tuple(place.at.items()) for place in places]
    labels = _labels(places, keys)
    several = len(set(labels)) > 1
    found: dict[tuple[str, Any], dict[str, Any]] = {}
    for place, label in zip(places, labels, strict=True):
        other, number = label, 1
        while any(name in found.get((other, time), {}) for time in place.times for name in place.columns):
            number += 1
            other = f"{label} ({number})"  # the same columns once more, of something that no coordinate tells
        for at, time in enumerate(place.times):
            row = found.setdefault((other, time), {_TIME: time, **({STATION: other} if several else {})})
            row |= {name: values[at] for name, values in place.columns.items()}
            if other != label:
                row[STATION] = other
    if any(STATION in row for row in found.values()):
        for (label, _), row in found.items():
            row[STATION] = label
    return list(found.values())


def heading(key: str, label: str, unit: str) -> str:
    """The name of a series, or its label where that alone tells the quantity, with the unit in brackets."""
    name = label if _of_wind(label, unit) and not _of_wind(key, unit) else key
    return f"{name} [{unit}]" if unit else name


def _of_wind(name: str, unit: str) -> bool:
    found = understand(name, unit)
    return "wind" in found.quantity and found.sure


def _labels(places: Sequence[Place], keys: Sequence[tuple[tuple[str, Any], ...]]) -> list[str]:
    """A label for each place: the first name that tells all positions apart, else what differs of their coordinates."""
    for name in dict.fromkeys(name for place in places for name in place.names):
        called = [place.names.get(name, "") for place in places]
        if all(called) and len(set(called)) == len(set(keys)) == len(set(zip(called, keys, strict=True))):
            return [text.replace(":", "-") for text in called]
    axes = dict.fromkeys(axis for place in places for axis in place.at)
    telling = [axis for axis in axes if len({str(place.at.get(axis)) for place in places}) > 1]
    return [" ".join(f"{axis} {place.at.get(axis, '')}" for axis in telling).replace(":", "-") for place in places]
