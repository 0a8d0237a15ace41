"""Arguments of public calls: numbers and paths of other libraries become Python's own, or are
refused in a sentence.

NumPy's `int64(3)`, torch's `tensor(3)` and pandas' values compare equal to 3, and yet hash, print
and serialise as
something else: a seed of that kind gave another order. `check_arguments` reads the annotations of a
call, so that every parameter that says `int` takes every whole number, and means the same by it.
"""

from __future__ import annotations

import functools
import inspect
import operator
import os
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numpy as np

from flagdata.errors import UsageError

P = ParamSpec("P")
R = TypeVar("R")
Convert = Callable[[Any, str], Any]
_SHORT = {"float32": np.float32, "float16": np.float16}
_NO_NUMBER = re.compile("bool|datetime|timedelta")
"""In the name of an array's type."""
_TUPLE = re.compile(r"tuple\[(?P<kind>int|float)(?P<more>(?:, (?P=kind))*)\]")


def whole(value: object, name: str) -> int:
    """Converts a whole number of Python, Numpy, torch or pandas to Python's own.

    Args:
        name: of the argument, for the error message.

    Raises:
        UsageError: a truth value, a text, a number with a point, a length of time, or several
            numbers.
    """
    with _refusing(value, name, "whole number", "give one such as 3, without a point or quotes"):
        return operator.index(value)  # type: ignore[arg-type]


def real(value: object, name: str) -> float:
    """Converts a number of Python, Numpy, torch or pandas to Python's own; whole numbers stay
    whole.

    Raises:
        UsageError: a truth value, a text, a time, or several numbers.
    """
    with _refusing(value, name, "number", "give one such as 2.5, without quotes"):
        number = plain(value)
        if isinstance(number, str | bytes):
            raise TypeError
        return number if isinstance(number, int | float) else float(number)


@contextmanager
def _refusing(value: object, name: str, noun: str, fix: str) -> Iterator[None]:
    """Refuse a truth value, a time, and what raises in it."""
    try:
        if isinstance(value, bool) or _NO_NUMBER.search(str(getattr(value, "dtype", ""))):
            raise TypeError
        yield
    except (TypeError, RuntimeError, ValueError):
        message = f"{name} is {_excerpt(value)}, which is no {noun}"
        raise UsageError(message, fix=fix) from None


def plain(value: Any) -> Any:
    """Converts a value whose numbers, alone or within tables and lists, become Python's own; arrays
    stay what they are.

    A number of 32 bits or fewer is the one that it prints: `float32(0.2)` is 0.2, not
    0.20000000298.
    """
    if isinstance(value, Mapping):
        return {key: plain(item) for key, item in value.items()}
    if type(value) in (list, tuple):
        return type(value)(map(plain, value))
    if getattr(value, "ndim", None) != 0 or not hasattr(value, "item"):
        return value
    short = _SHORT.get(str(value.dtype).rpartition(".")[2])
    return value.item() if short is None else float(str(short(value.item())))


def check_arguments(call: Callable[P, R]) -> Callable[P, R]:
    """Wraps a public call so that its arguments are made plain, each by its annotation.

    `int` and `float` take the numbers of other libraries, `tuple[int, int]` as many of them, `Path`
    whatever names a path, `str` texts alone, and tables keep no number of another library.

    Raises:
        UsageError: when the call is made with a value that is none of its kind.
    """
    signature = inspect.signature(call)
    kinds = {name: str(parameter.annotation) for name, parameter in signature.parameters.items()}
    converts = {
        name: convert for name, kind in kinds.items() if (convert := converter(kind)) is not None
    }

    @functools.wraps(call)
    def door(*args: P.args, **kwargs: P.kwargs) -> R:
        bound = signature.bind(*args, **kwargs)
        for name in converts.keys() & bound.arguments.keys():
            bound.arguments[name] = converts[name](bound.arguments[name], name)
        return call(*bound.args, **bound.kwargs)

    vars(door).update(converts=frozenset(converts), __signature__=unquoted(signature))
    return door


class _Kind(str):
    """The text of an annotation, which `help` shows without quotes."""

    __slots__ = ()

    def __repr__(self) -> str:
        return str(self)


def unquoted(signature: inspect.Signature) -> inspect.Signature:
    """Returns a signature that shows its annotations, which are texts, without quotes."""
    return signature.replace(
        parameters=[
            one.replace(annotation=_Kind(one.annotation)) for one in signature.parameters.values()
        ],
        return_annotation=_Kind(signature.return_annotation),
    )


def converter(annotation: str) -> Convert | None:
    """Returns what makes values of an annotation plain; `None` where they stay as they are."""
    kinds = [kind for kind in annotation.split(" | ") if kind != "None"]
    convert: Convert | None = None
    if kinds == ["int"]:
        convert = whole
    elif kinds and set(kinds) <= {"int", "float"}:
        convert = real
    elif kinds and set(kinds[1:]) <= {"str"} and (numbers := _TUPLE.fullmatch(kinds[0])):
        convert_number = whole if numbers["kind"] == "int" else real
        convert = functools.partial(
            _several,
            convert_number=convert_number,
            count=1 + numbers["more"].count(","),
            text="str" in kinds,
        )
    elif kinds == ["str"]:
        convert = _text
    elif kinds == ["Sequence[str]"]:
        convert = _texts
    elif {"Path", "Place", "AnyLake"} & set(kinds):
        convert = _path
    elif kinds and all(kind == "str" or kind.startswith("Mapping[") for kind in kinds):
        convert = _table
    elif kinds and ("Mapping" in annotation or "float" in kinds):
        convert = _plain
    if convert is None or "None" not in annotation.split(" | "):
        return convert
    return functools.partial(_or_none, convert=convert)


def _or_none(value: object, name: str, *, convert: Convert) -> Any:
    return None if value is None else convert(value, name)


def _plain(value: object, name: str) -> Any:
    return plain(value)


def _several(
    values: object,
    name: str,
    *,
    convert_number: Callable[[object, str], Any],
    count: int,
    text: bool = False,
) -> Any:
    if text and isinstance(values, str):
        return str(values)
    try:
        if isinstance(values, str | bytes):
            raise TypeError
        items = tuple(values)  # type: ignore[call-overload]
    except TypeError:
        items = ()
    if len(items) != count:
        message = f"{name} is {_excerpt(values)}, not {count} numbers"
        raise UsageError(message, fix=f"give {count} in parentheses, separated by commas")
    return tuple(convert_number(value, name) for value in items)


def _text(value: object, name: str) -> str:
    if isinstance(value, str):
        return str(value)
    if isinstance(value, os.PathLike):
        return os.fsdecode(value)
    raise UsageError(f"{name} is {_excerpt(value)}, which is no text", fix="give it in quotes")


def _table(value: object, name: str) -> Any:
    """Reads a table, or a text that stands for one."""
    if isinstance(value, str | Mapping):
        return plain(value)
    message = f"{name} is {_excerpt(value)}, which is no table of names and values"
    raise UsageError(message, fix='give one such as {"name": value}')


def _texts(values: Any, name: str) -> list[str]:
    if isinstance(values, str | bytes) or not hasattr(values, "__iter__"):
        message = f"{name} is {_excerpt(values)}, not a list of texts"
        raise UsageError(message, fix=f"give a list, such as [{str(values)!r}]")
    return [_text(value, name) for value in values]


def _path(value: Any, name: str) -> Any:
    """Reads a path as a text or as it is; what else a call takes stays."""
    if isinstance(value, bytes) or (isinstance(value, os.PathLike) and not isinstance(value, Path)):
        return os.fsdecode(value)
    if isinstance(value, int | float):
        raise UsageError(f"{name} is {value!r}, which names no file", fix="give a path")
    return value


def _excerpt(value: object) -> str:
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else f"{text[:57]}..."
