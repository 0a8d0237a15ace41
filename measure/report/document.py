"""The report as a JSON document, and back: the same content as the page, checked against the
verdict's own types.

JSON has no NaN and no infinities. A number that is missing is null; an interval's open end is
"Infinity" or "-Infinity", as in the JSON mapping of Protocol Buffers.

The cloth in motion, most of a verdict by far, is packed: {"shape": [frame, marker, 3], "float32":
base64 of the values [m], little-endian}, where a missing one is NaN. Documents that hold it as
nested lists are read too.
"""

from __future__ import annotations

import base64
import binascii
import dataclasses
import math
import types
from collections.abc import Mapping, Set
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np

from flagdata.answer.quantity import Bound, Quantity
from flagdata.core.json_values import json_values
from flagdata.errors import InputError
from measure.verdict.verdict_record import QUANTITY_ENTRIES, Verdict

SCHEMA = "flagdata.verdict/1"
_SCALARS = {bool: "true or false", int: "a whole number", str: "a text"}
_MOVING = ("observed", "before", "after")
_Moving = list[list[list[float]]]
_QUANTITY = {"value": float, "low": float, "high": float, "unit": str, "level": float}
_QUANTITY |= {"bound": Bound | None}
"""Types of what documents state of a quantity."""
_INFINITE = {"Infinity": math.inf, "-Infinity": -math.inf}


def as_document(verdict: Verdict) -> dict[str, Any]:
    """Returns the verdict as JSON values, with its schema tag."""
    still = dataclasses.replace(verdict, residuals=())
    content = {"schema": SCHEMA, **plain(still)}
    content["residuals"] = [
        plain(dataclasses.replace(residual, **dict.fromkeys(_MOVING, ())))
        | {name: _pack_frames(getattr(residual, name)) for name in _MOVING}
        for residual in verdict.residuals
    ]
    return content


def from_document(document: Mapping[str, Any]) -> Verdict:
    """Reads the verdict that a document holds.

    Raises:
        InputError: another schema, a field that is missing, unknown or of another type; it says
            which.
    """
    content = dict(document)
    if "ranking" in content:
        content["ranking"] = [_current(candidate) for candidate in content["ranking"]]
    tag = content.pop("schema", None)
    if tag != SCHEMA:
        raise InputError(
            f"this verdict cannot be read: its schema is {tag!r}, not {SCHEMA!r}",
            where="verdict",
            fix="close the loop again with this version, or update flagdata",
        )
    return _read(content, Verdict, "verdict")


def _current(candidate: Any) -> Any:
    """Renames a candidate's entries to the names of today: documents of version 0.1 called the p of
    heterogeneity `steady`."""
    if not isinstance(candidate, Mapping) or "steady" not in candidate:
        return candidate
    return {
        "heterogeneity" if name == "steady" else name: value for name, value in candidate.items()
    }


def plain(value: Any) -> Any:
    """Returns a value as JSON has it, see `flagdata.core.json_values`, with open ends in words."""
    return json_values(value, number=_written, names=QUANTITY_ENTRIES)


def _written(number: float) -> float | str | None:
    if math.isinf(number):
        return "Infinity" if number > 0 else "-Infinity"
    return None if math.isnan(number) else number


def _pack_frames(frames: _Moving) -> dict[str, Any]:
    values = np.asarray(frames, dtype="<f4").reshape(
        len(frames), len(frames[0]) if frames else 0, 3
    )
    return {
        "shape": list(values.shape),
        "float32": base64.b64encode(values.tobytes()).decode("ascii"),
    }


def _unpack_frames(value: Mapping[str, Any], where: str) -> _Moving:
    try:
        data = np.frombuffer(base64.b64decode(value["float32"], validate=True), dtype="<f4")
        return data.astype(np.float64).reshape(value["shape"]).tolist()
    except (KeyError, TypeError, ValueError, binascii.Error) as error:
        raise InputError(
            f"the packed values cannot be read: {error}",
            where=where,
            fix="give shape, and float32 in base64",
        ) from error


def _read(value: Any, kind: Any, where: str) -> Any:
    """Reads `value` as `kind`: one of the verdict's types, built from dataclasses, tuples, lists,
    numbers and texts."""
    if get_origin(kind) in (Union, types.UnionType):
        (present,) = (k for k in get_args(kind) if k is not types.NoneType)
        return None if value is None else _read(value, present, where)
    if kind == _Moving and isinstance(value, Mapping):
        return _unpack_frames(value, where)
    if kind is Quantity:
        return Quantity.of(**_entries(value, _QUANTITY, {"value", "low", "high", "unit"}, where))
    if dataclasses.is_dataclass(kind):
        return _record(value, kind, where)
    if get_origin(kind) in (tuple, list):
        return _sequence(value, kind, where)
    if get_origin(kind) is dict:
        return dict(_expected_value(value, Mapping, "an object", where))
    if kind is float:
        return _number(value, where)
    if kind in _SCALARS:
        return _expected_value(value, kind, _SCALARS[kind], where)
    text = _expected_value(value, str, "a text", where)
    try:
        return kind(text)
    except ValueError as error:
        choices = ", ".join(repr(str(k)) for k in kind)
        raise InputError(
            f"the value {text!r} is unknown", where=where, fix=f"give one of {choices}"
        ) from error


def _record(value: Any, kind: Any, where: str) -> Any:
    needed = {
        f.name
        for f in dataclasses.fields(kind)
        if f.default is dataclasses.MISSING and f.default_factory is dataclasses.MISSING
    }
    return kind(**_entries(value, get_type_hints(kind), needed, where))


def _entries(value: Any, hints: Mapping[str, Any], needed: Set[str], where: str) -> dict[str, Any]:
    """Reads an object of entries of these types, some of which it needs."""
    content = _expected_value(value, Mapping, "an object", where)
    fix = f"the fields are {', '.join(hints)}"
    if unknown := content.keys() - hints.keys():
        raise InputError(
            f"it has the unknown field {', '.join(sorted(unknown))}", where=where, fix=fix
        )
    if lacking := needed - content.keys():
        raise InputError(f"it lacks the field {', '.join(sorted(lacking))}", where=where, fix=fix)
    return {name: _read(item, hints[name], f"{where}.{name}") for name, item in content.items()}


def _sequence(value: Any, kind: Any, where: str) -> Any:
    items = _expected_value(value, list, "a list", where)
    inner = get_args(kind)
    if kind == list[float]:
        return [_number(item, where) for item in items]
    if get_origin(kind) is list:
        return [_read(item, inner[0], f"{where}[{n}]") for n, item in enumerate(items)]
    if inner[-1] is Ellipsis:
        return tuple(_read(item, inner[0], f"{where}[{n}]") for n, item in enumerate(items))
    if len(items) != len(inner):
        raise InputError(f"there are {len(items)} entries", where=where, fix=f"give {len(inner)}")
    return tuple(
        _read(item, k, f"{where}[{n}]")
        for n, (item, k) in enumerate(zip(items, inner, strict=True))
    )


def _number(value: Any, where: str) -> float:
    if value is None:
        return math.nan
    if isinstance(value, str) and value in _INFINITE:
        return _INFINITE[value]
    return float(_expected_value(value, int | float, "a number", where))


def _expected_value(value: Any, kind: Any, wanted: str, where: str) -> Any:
    if not isinstance(value, kind) or (isinstance(value, bool) and kind is not bool):
        raise InputError(
            f"the value is of type {type(value).__name__}, not {wanted}",
            where=where,
            fix=f"give {wanted}",
        )
    return value
