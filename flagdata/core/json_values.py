"""Results as JSON values, by one rule for all types.

A dataclass becomes an object of its fields. A type of which JSON states other things says so as
data, in two class variables:

- `JSON_NAMES`: the names of fields and properties, in order; "key=path.of.names" for one that
  stands under another key or lies within a part. Where a part is null, all within it is.
- `JSON_OPTIONAL`: keys that are left out where they say nothing: null, false, no entries. What came
  after a document was first written is one of these, so that older ones keep their hash.

JSON has no NaN and no infinities: a number that is missing is null. A date is its ISO 8601 text.
"""

from __future__ import annotations

import dataclasses
import datetime as dt
import math
from collections.abc import Callable, Mapping
from enum import Enum
from pathlib import PurePath
from typing import Any


def finite(number: float) -> float | None:
    """Returns a number as JSON has it; None of one that is not finite."""
    return number if math.isfinite(number) else None


def json_values(
    value: Any,
    *,
    number: Callable[[float], Any] = finite,
    names: Mapping[type, tuple[str, ...]] | None = None,
) -> Any:
    """Returns a value as JSON has it: objects, lists, texts, numbers, true, false and null.

    Args:
        number: how a floating-point number is written.
        names: of types that a document states otherwise than its `JSON_NAMES`.

    Raises:
        TypeError: a type that JSON has no form of.
    """
    match value:
        case None | bool() | str() if not isinstance(value, Enum):
            return value
        case Enum():
            return value.value
        case int():
            return value
        case float():
            return number(value)
        case PurePath():
            return str(value)
        case dt.date():
            return value.isoformat()
        case Mapping():
            return {
                str(json_values(key)): json_values(one, number=number, names=names)
                for key, one in value.items()
            }
        case list() | tuple():
            return [json_values(one, number=number, names=names) for one in value]
        case _ if callable(listed := getattr(value, "tolist", None)):  # of numpy, not loaded for it
            return json_values(listed(), number=number)
        case _ if paths := _paths(value, names or {}):
            optional = getattr(type(value), "JSON_OPTIONAL", ())
            entries = (
                (key, json_values(_part(value, path), number=number, names=names))
                for key, path in paths.items()
            )
            return {
                key: one
                for key, one in entries
                if key not in optional or not (one is None or one is False or one == [])
            }
        case _:
            raise TypeError(f"JSON has no form of {type(value).__name__}")


def _paths(value: Any, names: Mapping[type, tuple[str, ...]]) -> dict[str, str]:
    """Lists what JSON states of a value of a type with `JSON_NAMES` or of a dataclass: key →
    path."""
    kind = type(value)
    if stated := names.get(kind) or getattr(kind, "JSON_NAMES", None):
        return {key: path or key for key, _, path in (name.partition("=") for name in stated)}
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {one.name: one.name for one in dataclasses.fields(value)}
    return {}


def _part(value: Any, path: str) -> Any:
    for name in path.split("."):
        value = None if value is None else getattr(value, name)
    return value
