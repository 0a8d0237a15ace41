"""Typed values out of parsed TOML tables, where every key must be known, and ranges that values are drawn from."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import MISSING, dataclass, fields
from enum import StrEnum
from types import NoneType
from typing import Any, Literal, TypeAlias, TypeVar, get_args, get_origin, get_type_hints

from flagdata.errors import InputError, LimitError, UnknownNameError

E = TypeVar("E", bound=StrEnum)
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
        InputError: bounds that are not finite or not in order, or a logarithm of what is not positive.
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
                f"a logarithmic range cannot begin at {self.low!r}", fix="let it begin above 0, or take it linear"
            )

    def at(self, share: float) -> float:
        """The value that a share (0 to 1) of the range lies below."""
        if self.scale is Scale.LOG:
            return math.exp(math.log(self.low) + share * (math.log(self.high) - math.log(self.low)))
        return self.low + share * (self.high - self.low)

    def as_dict(self) -> dict[str, Any]:
        return {"low": self.low, "high": self.high, "scale": self.scale.value}


@dataclass(frozen=True, kw_only=True)
class Bounds:
    """Where a number may lie: at least `least`, above `above`, at most `most`."""

    least: float = -math.inf
    above: float = -math.inf
    most: float = math.inf


POSITIVE, NOT_NEGATIVE, COUNT = Bounds(above=0.0), Bounds(least=0.0), Bounds(least=1)
Quantity: TypeAlias = float | Range
"""One value for all members, or a range that each draws its own from."""


def ends(quantity: Quantity) -> tuple[float, float]:
    """The smallest and the largest value."""
    return (quantity.low, quantity.high) if isinstance(quantity, Range) else (quantity, quantity)


def in_radians(quantity: Quantity) -> Quantity:
    """A quantity that is given in degrees."""
    if isinstance(quantity, Range):
        return Range(low=math.radians(quantity.low), high=math.radians(quantity.high), scale=quantity.scale)
    return math.radians(quantity)


def plain(quantity: Quantity | None) -> Any:
    """As JSON."""
    return quantity.as_dict() if isinstance(quantity, Range) else quantity


class Table:
    """A TOML table that is read key by key; `done` refuses what nobody asked for."""

    def __init__(self, content: Any, *, where: str) -> None:
        if not isinstance(content, Mapping):
            raise InputError(f"{_shown(content)} is not a table", where=where, fix="write it as [table] with keys")
        self._content = content
        self._asked: set[str] = set()
        self.where = where

    def __contains__(self, key: str) -> bool:
        self._asked.add(key)
        return key in self._content

    def names(self) -> list[str]:
        """Its keys."""
        return list(self._content)

    def done(self) -> None:
        """Make sure that every key was asked for.

        Raises:
            UnknownNameError: one was not; the nearest that was is suggested.
        """
        for key in self._content:
            if key not in self._asked:
                raise UnknownNameError.of("key", key, self._asked, where=self.where)

    def only(self, *keys: str) -> None:
        """Refuse other keys before any value is looked at; raises as `done`."""
        self._asked |= set(keys)
        self.done()

    def table(self, key: str) -> Table:
        """A table inside; an empty one if it is not there."""
        self._asked.add(key)
        return Table(self._content.get(key, {}), where=f"{self.where} [{key}]")

    def record(self, kind: type[R], read: Mapping[str, Callable[[], Any]] | None = None, /, **bounds: Bounds) -> R:
        """A dataclass whose fields are the keys of this table in kebab-case; other keys are refused before all else.

        A field is read by its type: float, int, bool, str, a Literal, a StrEnum, `Quantity`, `Range`,
        tuple[float, ...] or tuple[str, ...], each also with None. The class states what a key that is not there
        stands for; a text without that may not be blank.

        Args:
            read: field → what gives its value by rules of its own, whether its key is there or not.
            bounds: of numbers, by the field's name; whole numbers are from 0 to `WHOLE_LIMIT` in any case.

        Raises:
            UnknownNameError: a key or a choice that is not known; the nearest is suggested.
            InputError: a value that does not fit, or none for a field without a default.
            LimitError: a whole number above its bound.
        """
        hints, values = get_type_hints(kind), {}
        entries = {entry.name.replace("_", "-"): entry for entry in fields(kind)}  # pyright: ignore[reportArgumentType]
        self.only(*entries)
        for key, entry in entries.items():
            needed = entry.default is MISSING and entry.default_factory is MISSING
            if entry.name in (read or {}):
                values[entry.name] = (read or {})[entry.name]()
            elif key in self._content:
                values[entry.name] = self._of_type(key, hints[entry.name], bounds.get(entry.name))
            if needed and str(values.get(entry.name, "")).strip() == "":
                raise InputError(f"the key {key} is missing", where=self.where, fix=f"add {key} = …")
        return kind(**values)

    def _of_type(self, key: str, hint: Any, bounds: Bounds | None) -> Any:
        """The value of a key as a field of that type."""
        kinds = {hint} if get_origin(hint) in (None, tuple, Literal) else set(get_args(hint)) - {NoneType}
        within = vars(bounds or Bounds())
        if kinds == {float, Range}:
            return self.quantity(key, math.nan, **within)
        (kind,) = kinds
        readers: dict[Any, Callable[[], Any]] = {
            Range: lambda: self.range(key, math.nan, **within),
            float: lambda: self.number(key, math.nan, **within),
            int: lambda: self.whole(
                key, 0, least=int(max(within["least"], 0)), most=int(min(within["most"], WHOLE_LIMIT))
            ),
            bool: lambda: self.flag(key),
            str: lambda: self.text(key, None),
            tuple[str, ...]: lambda: self.texts(key),
            tuple[float, ...]: lambda: self.numbers(key),
        }
        if kind in readers:
            return readers[kind]()
        return self.text(key, None) if get_origin(kind) is Literal else self.choice(key, next(iter(kind)))

    def named(self, key: str, default: str, known: Collection[str], *, noun: str) -> str:
        """One of the known names.

        Raises:
            UnknownNameError: another; the nearest is suggested.
        """
        name = self.text(key, default)
        if name not in known:
            raise UnknownNameError.of(noun, str(name), known, where=self.where)
        return str(name)

    def says(self, key: str, word: str) -> bool:
        """Whether the value is this text."""
        return self._take(key, None) == word

    def number(
        self, key: str, default: float, *, least: float = -math.inf, above: float = -math.inf, most: float = math.inf
    ) -> float:
        value = self._take(key, default)
        if not _finite(value):
            raise self._wrong(key, value, "a finite number")
        self._bound(key, float(value), least=least, above=above, most=most)
        return float(value)

    def whole(self, key: str, default: int, *, least: int, most: int = WHOLE_LIMIT) -> int:
        """A whole number.

        Raises:
            InputError: another value, or one below `least`.
            LimitError: one above `most`.
        """
        value = self._take(key, default)
        if isinstance(value, bool) or not isinstance(value, int) or value < least:
            raise self._wrong(key, value, f"a whole number of at least {least}")
        if value > most:
            raise LimitError(f"{key} is {_shown(value)}", where=self.where, fix=f"give at most {most}")
        return value

    def value(self, key: str) -> Any:
        """Whatever stands there, for who checks it by rules of its own; None if it is not there."""
        return self._take(key, None)

    def text(self, key: str, default: str | None) -> str | None:
        value = self._take(key, default)
        if value is not None and not isinstance(value, str):
            raise self._wrong(key, value, "text in quotes")
        return value

    def texts(self, key: str) -> tuple[str, ...]:
        value = self._take(key, [])
        if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
            raise self._wrong(key, value, 'a list of texts, ["…", "…"]')
        return tuple(value)

    def flag(self, key: str) -> bool:
        """A truth value; false if it is not there."""
        value = self._take(key, False)
        if not isinstance(value, bool):
            raise self._wrong(key, value, "true or false")
        return value

    def numbers(self, key: str) -> tuple[float, ...]:
        value = self._take(key, [])
        if not isinstance(value, list) or not all(_finite(item) for item in value):
            raise self._wrong(key, value, "a list of finite numbers")
        return tuple(float(item) for item in value)

    def points(self, key: str, size: int = 2) -> tuple[tuple[float, ...], ...]:
        """A list of points with `size` finite coordinates; empty if it is not there."""
        value = self._take(key, [])
        points = isinstance(value, list) and all(isinstance(item, list) and len(item) == size for item in value)
        if not points or not all(_finite(number) for item in value for number in item):
            zeros = ", ".join(["0.0"] * size)
            raise self._wrong(key, value, f"a list of points, [[{zeros}], …]")
        return tuple(tuple(float(number) for number in item) for item in value)

    def indices(self, key: str, size: int) -> tuple[tuple[int, ...], ...]:
        """A list of groups of `size` whole numbers from 0 (of plain numbers, if it is 1); empty if it is not there."""
        value = self._take(key, [])
        groups = [item if isinstance(item, list) else [item] for item in value] if isinstance(value, list) else [[]]
        if not all(len(group) == size and all(_index(number) for number in group) for group in groups):
            raise self._wrong(key, value, f"a list of whole numbers from 0, {size} each")
        return tuple(tuple(group) for group in groups)

    def mapping(self, key: str) -> Mapping[str, Any]:
        """The content of a table inside, for who reads it by rules of its own; empty if it is not there."""
        value = self._take(key, {})
        if not isinstance(value, Mapping):
            raise self._wrong(key, value, "a table")
        return value

    def tables(self, key: str) -> tuple[Table, ...]:
        """A list of tables inside; empty if it is not there."""
        value = self._take(key, [])
        if not isinstance(value, list):
            raise self._wrong(key, value, f"tables, [[{key}]]")
        return tuple(Table(item, where=f"{self.where} [[{key}]] {place}") for place, item in enumerate(value, start=1))

    def choice(self, key: str, default: E) -> E:
        value = self._take(key, default.value)
        options = [option.value for option in type(default)]
        if value not in options:
            raise UnknownNameError.of(key, str(value), options, where=self.where)
        return type(default)(value)

    def quantity(
        self, key: str, default: float, *, least: float = -math.inf, above: float = -math.inf, most: float = math.inf
    ) -> Quantity:
        """A number, or a table {low, high, scale}."""
        value = self._take(key, default)
        if isinstance(value, Mapping):
            inner = Table(value, where=f"{self.where} {key}")
            bounds = {end: inner.number(end, math.nan) for end in ("low", "high") if end in inner}
            if len(bounds) != 2:
                raise self._wrong(key, dict(value), "a number or { low = …, high = … }")
            scale = inner.choice("scale", Scale.LINEAR)
            inner.done()
            try:
                value = Range(low=bounds["low"], high=bounds["high"], scale=scale)
            except InputError as error:
                raise InputError(error.what, where=f"{self.where} {key}", fix=error.fix) from None
            for end in ends(value):
                self._bound(key, end, least=least, above=above, most=most)
            return value
        return self.number(key, default, least=least, above=above, most=most)

    def range(
        self, key: str, default: float, *, least: float = -math.inf, above: float = -math.inf, most: float = math.inf
    ) -> Range:
        """As `quantity`; one number is a range of no width."""
        value = self.quantity(key, default, least=least, above=above, most=most)
        return value if isinstance(value, Range) else Range(low=value, high=value)

    def angle(self, key: str, default: float) -> Quantity:
        """An angle [rad]: a quantity in radians under `key`, or in degrees under `key-deg`.

        Raises:
            InputError: both, or more than a whole turn, as an angle in degrees is.
        """
        degrees = key + DEGREES
        if degrees not in self:
            given = self.quantity(key, default)
        elif key in self:
            raise InputError(f"{key} is given twice", where=self.where, fix=f"keep {key} or {degrees}")
        else:
            given = in_radians(self.quantity(degrees, 0.0))
        for end in ends(given):
            if abs(end) > _TURN:
                raise InputError(
                    f"{key} is {end:.4g} rad, more than a whole turn",
                    where=self.where,
                    fix=f"give radians, or degrees as {degrees} = {end:.4g}",
                )
        return given

    def one_angle(self, key: str, default: float) -> float:
        """An `angle` that is no range.

        Raises:
            InputError: as `angle`, or a range.
        """
        given = self.angle(key, default)
        if isinstance(given, Range):
            raise self._wrong(key, given.as_dict(), "one number")
        return given

    def _take(self, key: str, default: Any) -> Any:
        self._asked.add(key)
        return self._content.get(key, default)

    def _bound(self, key: str, value: float, *, least: float, above: float, most: float = math.inf) -> None:
        if value < least or value <= above or value > most:
            lower = f"at least {least:g}" if value < least else f"above {above:g}"
            raise self._wrong(key, value, f"a number of at most {most:g}" if value > most else f"a number {lower}")

    def _wrong(self, key: str, value: Any, wanted: str) -> InputError:
        return InputError(f"{key} is {_shown(value)}", where=self.where, fix=f"give {wanted}")


def _index(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


def _finite(value: Any) -> bool:
    try:
        return not isinstance(value, bool) and isinstance(value, int | float) and math.isfinite(value)
    except OverflowError:  # a whole number beyond any float
        return False


def _shown(value: Any) -> str:
    """The value as the recipe has it; of a long one, its beginning."""
    text = repr(value)
    return text if len(text) <= _SHOWN else f"{text[:_SHOWN]}…"


_SHOWN = 60
