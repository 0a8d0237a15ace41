"""The contents of a recipe as TOML text: numbers, texts, truth values, lists and tables of them."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

from flagdata.errors import InputError


def dumps(content: Mapping[str, Any]) -> str:
    """TOML 1.0 of a mapping; plain values come before tables, as the format wants it.

    Raises:
        InputError: a value that TOML has no form for.
    """
    return "\n".join(_lines(content, ())) + "\n"


def _lines(content: Mapping[str, Any], path: tuple[str, ...]) -> list[str]:
    lines = [f"{_key(key)} = {_value(v)}" for key, v in content.items() if not isinstance(v, Mapping)]
    for key, value in content.items():
        if isinstance(value, Mapping):
            inner = (*path, key)
            lines += ["", f"[{'.'.join(_key(part) for part in inner)}]", *_lines(value, inner)]
    return lines


def _key(key: str) -> str:
    bare = key.isascii() and key.replace("-", "").replace("_", "").isalnum()
    return key if bare else _value(key)


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        if math.isnan(value) or math.isinf(value):
            return "nan" if math.isnan(value) else ("inf" if value > 0 else "-inf")
        return repr(value)
    if isinstance(value, str):
        # JSON escapes what TOML does, but for DEL.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")
    if isinstance(value, Sequence):
        return f"[{', '.join(_value(item) for item in value)}]"
    raise InputError(f"{value!r} has no form in TOML", where="recipe", fix="give numbers, texts, lists or tables")
