"""TOML and JSON to values, within limits: the one boundary where the text of a recipe or a card is
parsed."""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from flagdata.errors import CorruptError, InputError
from flagdata.recipes.retired_names import present_names

SIZE_LIMIT = 64 << 20
"""Longest text that is parsed [characters]; a cloth model's mesh is in its recipe. Lists within a
list take most memory
for their length, 30 bytes a character: 2 GB at most."""
NESTING_LIMIT = 100
"""Most tables and lists within one another."""
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_PART = r"(?:[A-Za-z0-9_-]++|\"[^\"\n]*+\"|'[^'\n]*+')"
_DEEP_KEY = re.compile(
    rf"(?:^|[\[{{,])[ \t]*+{_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{NESTING_LIMIT}}}", re.MULTILINE
)


class LimitsError(ValueError):
    """Text that is longer or nested deeper than the limits."""


def from_toml(text: str) -> dict[str, Any]:
    """Parses the tables of a TOML text.

    Raises:
        LimitsError: longer than `SIZE_LIMIT`, or nested deeper than `NESTING_LIMIT`.
        ValueError: not TOML, or a number that is not finite or of thousands of digits.
    """
    _check_size(text)
    if _DEEP_KEY.search(text):  # tomllib takes time and memory with the square of a key's parts
        raise _deep()
    try:
        content = tomllib.loads(text)
    except RecursionError:
        raise _deep() from None
    except ValueError as error:  # Python itself refuses numbers of very many digits
        raise ValueError(f"the file is not TOML: {error}") from None
    _check(content)
    return content


def to_toml(content: Mapping[str, Any], *, inside: str = "") -> str:
    """Writes a TOML text of these tables: texts, numbers, truth values, lists of them, tables, and
    lists of tables.

    Args:
        inside: the table's own name, with a dot behind it.

    Raises:
        InputError: a value that TOML has no form for.
    """
    tables = {key: value for key, value in content.items() if isinstance(value, Mapping)}
    lists = {key: value for key, value in content.items() if _are_tables(value)}
    plain = {key: value for key, value in content.items() if key not in {*tables, *lists}}
    parts = ["".join(f"{_toml_key(key)} = {_toml_value(value)}\n" for key, value in plain.items())]
    for key, value in tables.items():
        path = f"{inside}{_toml_key(key)}"
        parts.append(f"\n[{path}]\n{to_toml(value, inside=f'{path}.')}")
    for key, value in lists.items():
        path = f"{inside}{_toml_key(key)}"
        parts += [
            f"\n[[{path}]]\n{to_toml(inner_table, inside=f'{path}.')}" for inner_table in value
        ]
    return "".join(parts)


def _toml_key(key: str) -> str:
    return key if _BARE_KEY.fullmatch(key) else _toml_value(key)


def _toml_value(value: Any) -> str:
    """Writes a value as JSON does where TOML has the same form, and a number that is not finite as
    TOML does."""
    if isinstance(value, float) and not math.isfinite(value):
        return "nan" if math.isnan(value) else "inf" if value > 0 else "-inf"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace(
            "\x7f", "\\u007F"
        )  # which JSON does not escape
    if isinstance(value, bool | int | float):
        return json.dumps(value)
    if isinstance(value, Sequence):
        return f"[{', '.join(map(_toml_value, value))}]"
    raise InputError(
        f"{value!r} has no form in TOML", where="recipe", fix="give numbers, texts, lists or tables"
    )


def _are_tables(value: Any) -> bool:
    return (
        isinstance(value, list) and bool(value) and all(isinstance(item, Mapping) for item in value)
    )


def from_json(text: str | bytes) -> Any:
    """Parses the value of a JSON text.

    Raises:
        LimitsError: longer than `SIZE_LIMIT`, or nested deeper than `NESTING_LIMIT`.
        ValueError: not JSON, or a number that is not finite or of thousands of digits.
    """
    content = _parse_text(text)
    _check(content)
    return content


def from_stored_json(text: str) -> Any:
    """Parses the value of a JSON text that a lake holds; older versions stored numbers that are not
    finite.

    Raises:
        LimitsError: longer than `SIZE_LIMIT`, or nested deeper than `NESTING_LIMIT`.
        ValueError: not JSON, or a number of thousands of digits.
    """
    content = _parse_text(text)
    for _ in _levels(content):
        pass
    return content


def column_json(text: str, column: str, *, artifact: str) -> Any:
    """Parses the value of a JSON column of a catalog's row; parameters have their present names.

    Raises:
        CorruptError: as the errors of `from_stored_json`; it names the artifact.
    """
    try:
        content = from_stored_json(text)
        return (
            present_names(content)
            if column == "parameters" and isinstance(content, dict)
            else content
        )
    except ValueError as error:
        where = f"artifact {artifact}"
        raise CorruptError(
            f"its {column} cannot be read: {error}", where=where, fix="run flagdata doctor"
        ) from None


def read_json(path: Path, *, noun: str, fix: str = "restore it from a copy") -> dict[str, Any]:
    """Reads the object in a JSON file that flagdata wrote.

    Args:
        noun: what the file is called in the error message.

    Raises:
        CorruptError: it is no JSON object within the limits.
    """
    try:
        if path.stat().st_size > SIZE_LIMIT:
            raise LimitsError(
                f"a file of {path.stat().st_size} bytes, at most {SIZE_LIMIT} are read"
            )
        content = from_json(path.read_bytes())
    except (OSError, ValueError) as error:
        raise CorruptError(
            f"the {noun} cannot be read: {error}", where=str(path), fix=fix
        ) from None
    if not isinstance(content, dict):
        raise CorruptError(f"the {noun} is no JSON object", where=str(path), fix=fix)
    return content


def _parse_text(text: str | bytes) -> Any:
    _check_size(text)
    try:
        return json.loads(text)
    except RecursionError:
        raise _deep() from None


def _check_size(text: str | bytes) -> None:
    if len(text) > SIZE_LIMIT:
        raise LimitsError(f"a text of {len(text)} characters, at most {SIZE_LIMIT} are read")


def _check(content: Any) -> None:
    """Make sure that all numbers are finite, and that tables and lists are not nested too deep."""
    for level in _levels(content):
        for value in level:
            if isinstance(value, float) and not math.isfinite(value):
                raise ValueError(f"a number that is not finite, {value}")


def _levels(content: Any) -> Iterator[list[Any]]:
    """Yields the values of each level of nesting below the whole.

    Raises:
        LimitsError: there are more than `NESTING_LIMIT` levels.
    """
    level: list[Any] = [content]
    for _ in range(NESTING_LIMIT):
        level = [item for value in level for item in _inside(value)]
        if not level:
            return
        yield level
    raise _deep()


def _inside(value: Any) -> Iterable[Any]:
    if isinstance(value, dict):
        return value.values()
    return value if isinstance(value, list) else ()


def _deep() -> LimitsError:
    return LimitsError(f"tables or lists are nested more than {NESTING_LIMIT} deep")
