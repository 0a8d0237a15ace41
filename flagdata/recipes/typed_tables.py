"""Parsed TOML as typed values, read by msgspec, and ranges that values are drawn from.

A recipe is a dataclass whose fields are the keys of a table. The type of a field says what its key
may hold: a number within bounds, one of some names, a list, a table inside. Unknown keys are
refused before any value is looked at, and the nearest is named.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import MISSING, dataclass, field, fields, is_dataclass
from enum import EnumMeta, StrEnum
from functools import cache
from types import NoneType, UnionType
from typing import (
    Annotated,
    Any,
    Literal,
    TypeAlias,
    TypeVar,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

import msgspec
from msgspec import Meta

from flagdata.errors import InputError, LimitError, UnknownNameError
from flagdata.recipes.retired_names import warn_of_old_name, with_present_keys

R = TypeVar("R")
WHOLE_LIMIT = 1_000_000
"""Most of anything that a recipe counts, where no other limit is named."""
SEED_LIMIT = 2**63 - 1
"""Largest seed."""
DEGREES = "-deg"
"""Suffix of a key whose values are in degrees."""
_TURN = 2 * math.pi + 1e-3  # rad; a whole turn, as rounded in files


class Scale(StrEnum):
    """In what a drawn value is uniform."""

    LINEAR = "linear"
    LOG = "log"


@dataclass(frozen=True, kw_only=True)
class Range:
    """Values from `low` to `high`, uniform in the value or in its logarithm.

    Raises:
        InputError: bounds that are not finite or not in order, or a logarithm of what is not
            positive.
    """

    low: float
    high: float
    scale: Scale = Scale.LINEAR

    def __post_init__(self) -> None:
        if not (math.isfinite(self.low) and math.isfinite(self.high) and self.low <= self.high):
            raise InputError(
                f"the range from {self.low!r} to {self.high!r} is empty or infinite",
                fix="give finite bounds, low ≤ high",
            )
        if self.scale is Scale.LOG and self.low <= 0:
            raise InputError(
                f"a logarithmic range cannot begin at {self.low!r}",
                fix="let it begin above 0, or take it linear",
            )

    def at(self, share: float) -> float:
        """Computes the value that a share (0 to 1) of the range lies below."""
        if self.scale is Scale.LOG:
            return math.exp(math.log(self.low) + share * (math.log(self.high) - math.log(self.low)))
        return self.low + share * (self.high - self.low)


Quantity: TypeAlias = float | Range
"""One value for all members, or a range that each draws its own from."""


@dataclass(frozen=True)
class Named:
    """Marks a text, in `Annotated`, that is one of the known names.

    Attributes:
        noun: what one is called in error messages.
        was: former name → name.
    """

    noun: str
    known: Collection[str]
    was: Mapping[str, str] = field(default_factory=dict, hash=False)


class _Mark(StrEnum):
    ANGLE = "angle"
    SPELLED = "spelled"


POSITIVE, NOT_NEGATIVE = Meta(gt=0.0), Meta(ge=0.0)
Positive: TypeAlias = Annotated[float, POSITIVE]
NotNegative: TypeAlias = Annotated[float, NOT_NEGATIVE]
PositiveQuantity: TypeAlias = Annotated[Quantity, POSITIVE]
NotNegativeQuantity: TypeAlias = Annotated[Quantity, NOT_NEGATIVE]
Whole: TypeAlias = Annotated[int, Meta(ge=0, le=WHOLE_LIMIT)]
Count: TypeAlias = Annotated[int, Meta(ge=1, le=WHOLE_LIMIT)]
Seed: TypeAlias = Annotated[int, Meta(ge=0, le=SEED_LIMIT)]
Index: TypeAlias = Annotated[int, Meta(ge=0)]
Angle: TypeAlias = Annotated[float, _Mark.ANGLE]
"""[rad], under its key; or in degrees, under the key with `DEGREES` behind it. A whole turn at
most."""
AngleQuantity: TypeAlias = Annotated[Quantity, _Mark.ANGLE]
Spelled: TypeAlias = Annotated[tuple[str, ...], _Mark.SPELLED]
"""Texts, or values that are taken as they are spelled."""


def ends(quantity: Quantity) -> tuple[float, float]:
    """Returns the smallest and the largest value."""
    return (quantity.low, quantity.high) if isinstance(quantity, Range) else (quantity, quantity)


def in_radians(quantity: Quantity) -> Quantity:
    """Converts a quantity that is given in degrees."""
    if isinstance(quantity, Range):
        return Range(
            low=math.radians(quantity.low), high=math.radians(quantity.high), scale=quantity.scale
        )
    return math.radians(quantity)


def within(kind: Any, least: float = -math.inf, most: float = math.inf) -> Any:
    """Returns the type of numbers, or of quantities, that lie from `least` to `most`."""
    low, high = (bound if math.isfinite(bound) else None for bound in (least, most))
    return Annotated[kind, Meta(ge=low, le=high)]


def read(kind: type[R], content: Any, *, where: str, **computed: Any) -> R:
    """Reads a dataclass whose fields are the keys of a table in kebab-case.

    The class says what a missing key stands for, and in `WAS` which keys it had in the last
    version. A missing table is an empty one; a text without a default is not blank. An error of the
    class itself that names no place gets that of the table.

    Args:
        computed: values of fields that are not read by their type; their keys may be there.

    Raises:
        UnknownNameError: a key or a name that is not known; the nearest is suggested.
        InputError: a value that does not fit its type, or none for a field without a default.
        LimitError: a whole number above its bound.
    """
    content = with_present_keys(content, where=where, keys=getattr(kind, "WAS", {}))
    hints = _hints(kind)
    described = fields(kind)  # pyright: ignore[reportArgumentType]
    keys = {entry.name.replace("_", "-"): entry for entry in described}
    types = {
        key: Any if entry.name in computed else hints[entry.name] for key, entry in keys.items()
    }
    values = {
        keys[key].name: entry for key, entry in entries(types, content, where=where).items()
    } | computed
    for key, entry in keys.items():
        if entry.default is not MISSING or entry.default_factory is not MISSING:
            continue
        if entry.name not in values and _is_table(types[key]):
            values[entry.name] = value(types[key], {}, key=key, where=where)
        if str(values.get(entry.name, "")).strip() == "":
            raise InputError(f"the key {key} is missing", where=where, fix=f"add {key} = …")
    try:
        return kind(**values)
    except InputError as error:
        raise type(error)(error.what, where=error.where or where, fix=error.fix) from None


@cache
def _hints(kind: type) -> Mapping[str, Any]:
    return get_type_hints(kind, include_extras=True)


def entries(types: Mapping[str, Any], content: Any, *, where: str) -> dict[str, Any]:
    """Reads those keys of a table that are there, each as its type; raises as `read`.

    Args:
        types: key → type, of all keys that may be there.
    """
    angles = {key for key, kind in types.items() if _Mark.ANGLE in _strip_annotations(kind)[1]}
    check_keys(content, [*types, *(key + DEGREES for key in angles)], where=where)
    values = {}
    for key, kind in types.items():
        if key in angles and key + DEGREES in content:
            values[key] = _in_degrees(kind, content, key=key, where=where)
        elif key in content:
            values[key] = value(kind, content[key], key=key, where=where)
    return values


def check_keys(content: Any, allowed: Collection[str], *, where: str) -> None:
    """Makes sure that a value is a table of known keys.

    Raises:
        InputError: it is no table.
        UnknownNameError: a key that is not known; the nearest is suggested.
    """
    if not isinstance(content, Mapping):
        raise InputError(
            f"{_excerpt(content)} is not a table", where=where, fix="write it as [table] with keys"
        )
    for key in content:
        if key not in allowed:
            raise UnknownNameError.of("key", key, allowed, where=where)


def value(kind: Any, content: Any, *, key: str, where: str) -> Any:
    """Reads the value of a key as a type: one of msgspec's, a dataclass, a quantity or a range, or
    tables or a list of them. Numbers are finite.

    Raises:
        UnknownNameError, InputError, LimitError: as `read`.
    """
    bare, notes = _strip_annotations(kind)
    origin, inner = get_origin(bare), get_args(bare)
    if bare is Any:
        return content
    if Range in (bare, *inner):
        return _quantity(bare, notes, content, key=key, where=where)
    if _is_table(bare):
        return _table(bare, content, where=f"{where} [{key}]")
    if _Mark.SPELLED in notes and isinstance(content, list | tuple):
        return tuple(str(item).strip() for item in content)
    if origin is tuple and inner[-1] is ... and isinstance(content, list | tuple):
        item, marks = _strip_annotations(inner[0])
        if _is_table(item):
            return tuple(
                _table(item, entry, where=f"{where} [[{key}]] {n}")
                for n, entry in enumerate(content, start=1)
            )
        if isinstance(item, EnumMeta) or any(isinstance(mark, Named) for mark in marks):
            return tuple(value(inner[0], item, key=key, where=where) for item in content)
    return _convert_value(bare, notes, content, key=key, where=where)


def _is_table(bare: Any) -> bool:
    return is_dataclass(bare) or get_origin(bare) is Mapping


def _table(bare: Any, content: Any, *, where: str) -> Any:
    """Reads a dataclass, or a table whose keys are names of one type and whose values are of
    another."""
    if is_dataclass(bare):
        return read(bare, content, where=where)  # pyright: ignore[reportArgumentType]
    check_keys(content, content if isinstance(content, Mapping) else (), where=where)
    name, kind = get_args(bare)
    names = {entry: value(name, entry, key="name", where=where) for entry in content}
    return {
        names[entry]: value(kind, item, key=entry, where=where) for entry, item in content.items()
    }


def _quantity(bare: Any, notes: list[Any], content: Any, *, key: str, where: str) -> Quantity:
    if isinstance(content, Mapping):
        quantity = read(Range, content, where=f"{where} {key}")
    else:
        number = _convert_value(float, notes, content, key=key, where=where)
        quantity = Range(low=number, high=number) if bare is Range else number
    for end in ends(quantity):
        _convert_value(float, notes, end, key=key, where=where)
    return quantity


def _in_degrees(kind: Any, content: Mapping[str, Any], *, key: str, where: str) -> Quantity:
    """Reads an angle that is given in degrees [rad]."""
    bare, notes = _strip_annotations(kind)
    spelled = key + DEGREES
    if key in content:
        raise InputError(f"{key} is given twice", where=where, fix=f"keep {key} or {spelled}")
    angle = in_radians(value(bare, content[spelled], key=spelled, where=where))
    for end in ends(angle):
        _convert_value(float, notes, end, key=key, where=where)
    return angle


def _convert_value(bare: Any, notes: list[Any], content: Any, *, key: str, where: str) -> Any:
    """Converts a value to a type with bounds; raises as `read`."""
    bounds = [note for note in notes if isinstance(note, Meta)]
    if bare is int and not bounds:
        bounds = [Meta(ge=0, le=WHOLE_LIMIT)]
    kind = bare
    for bound in bounds:
        kind = Annotated[kind, bound]
    try:
        converted = msgspec.convert(_exact(content), kind)
    except msgspec.ValidationError:
        raise _refusal(bare, bounds, content, key=key, where=where) from None
    if _Mark.ANGLE in notes and abs(converted) > _TURN:
        raise InputError(
            f"{key} is {converted:.4g} rad, more than a whole turn",
            where=where,
            fix=f"give radians, or degrees as {key}{DEGREES} = {converted:.4g}",
        )
    for note in notes:
        if isinstance(note, Named) and converted in note.was:
            warn_of_old_name(converted, note.was[converted], (), where=where)
            converted = note.was[converted]
        if isinstance(note, Named) and converted not in note.known:
            raise UnknownNameError.of(note.noun, converted, note.known, where=where)
    return converted


def _refusal(bare: Any, bounds: list[Meta], content: Any, *, key: str, where: str) -> Exception:
    if isinstance(bare, EnumMeta):
        values = [option.value for option in bare]  # pyright: ignore[reportAttributeAccessIssue]
        return UnknownNameError.of(key, str(content), values, where=where)
    most = min((bound.le for bound in bounds if bound.le is not None), default=math.inf)
    if bare is int and isinstance(content, int) and content > most:
        return LimitError(f"{key} is {_excerpt(content)}", where=where, fix=f"give at most {most}")
    return InputError(
        f"{key} is {_excerpt(content)}", where=where, fix=f"give {_wanted_words(bare, bounds)}"
    )


def _wanted_words(bare: Any, bounds: list[Meta]) -> str:
    """Returns what a value of a type looks like, in words."""
    if get_origin(bare) in (Union, UnionType):
        return " or ".join(_wanted_words(*_strip_annotations(kind)) for kind in get_args(bare))
    if get_origin(bare) is Literal:
        return " or ".join(f'"{name}"' for name in get_args(bare))
    if get_origin(bare) is tuple:
        return f"a list, {_example(bare)}"
    limits = [
        f"{word} {bound:g}" if isinstance(bound, float) else f"{word} {bound}"
        for meta in bounds
        for word, bound in (("above", meta.gt), ("of at least", meta.ge), ("of at most", meta.le))
        if bound is not None
    ]
    return " ".join([_WORDS[bare], " and ".join(limits)]).strip()


def _example(kind: Any) -> str:
    bare = _strip_annotations(kind)[0]
    if get_origin(bare) is tuple:
        return f"[{', '.join('…' if item is ... else _example(item) for item in get_args(bare))}]"
    return _EXAMPLES.get(bare, "{…}")


def _strip_annotations(kind: Any) -> tuple[Any, list[Any]]:
    """Splits a type into itself without None, and what `Annotated` says of it."""
    notes: list[Any] = []
    while True:
        if get_origin(kind) is Annotated:
            kind, *annotations = get_args(kind)
            notes += annotations
        elif NoneType in get_args(kind):
            options = tuple(option for option in get_args(kind) if option is not NoneType)
            kind = Union[options]  # noqa: UP007
        else:
            return kind, notes


def _exact(content: Any) -> Any:
    """Returns a value with floats for their subclasses, such as NumPy's, which msgspec refuses.

    Raises:
        msgspec.ValidationError: a number that is not finite.
    """
    if isinstance(content, float) and not math.isfinite(content):
        raise msgspec.ValidationError(content)
    if isinstance(content, list | tuple):
        return [_exact(item) for item in content]
    return float(content) if isinstance(content, float) else content


def _excerpt(content: Any) -> str:
    """Quotes the value as the recipe has it; of a long one, its beginning."""
    text = repr(content)
    return text if len(text) <= _EXCERPT else f"{text[:_EXCERPT]}…"


_EXCERPT = 60
_WORDS = {
    float: "a finite number",
    int: "a whole number",
    str: "text in quotes",
    bool: "true or false",
}
_EXAMPLES = {float: "0.0", int: "0", str: '"…"'}
