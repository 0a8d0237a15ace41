"""Results as JSON values, by one rule for all types.

A dataclass becomes an object of its fields. One of which JSON states other things says so as data,
in `JSON_NAMES`: the names of fields and properties, in order. JSON has no NaN and no infinities: a
number that is missing is null.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from enum import Enum
from pathlib import PurePath
from typing import Any

import numpy as np


def json_values(value: Any) -> Any:
    """Returns a value as JSON has it: objects, lists, texts, numbers, true, false and null.

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
            return value if math.isfinite(value) else None
        case np.generic() | np.ndarray():
            return json_values(value.tolist())
        case PurePath():
            return str(value)
        case Mapping():
            return {str(json_values(key)): json_values(one) for key, one in value.items()}
        case list() | tuple():
            return [json_values(one) for one in value]
        case _ if dataclasses.is_dataclass(value) and not isinstance(value, type):
            return {name: json_values(getattr(value, name)) for name in _names(value)}
        case _:
            raise TypeError(f"JSON has no form of {type(value).__name__}")


def _names(value: Any) -> tuple[str, ...]:
    """Lists what JSON states of a dataclass."""
    names = getattr(type(value), "JSON_NAMES", None)
    return names or tuple(one.name for one in dataclasses.fields(value))
