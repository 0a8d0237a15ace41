"""Damage for property-based tests: bytes that changed, parts that are missing or doubled, values no
one meant."""

from __future__ import annotations

import copy
import json
from collections.abc import Mapping
from typing import Any

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

QUICK = settings(
    max_examples=40,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)

places = st.floats(0, 1, exclude_max=True)
damages = st.lists(
    st.one_of(
        st.tuples(st.just("flip"), places, st.integers(1, 255)),
        st.tuples(st.just("cut"), places, st.integers(0, 0)),
        st.tuples(st.just("drop"), places, st.integers(1, 64)),
        st.tuples(st.just("double"), places, st.integers(1, 64)),
        st.tuples(st.just("ones"), places, st.integers(1, 16)),
    ),
    min_size=1,
    max_size=4,
)
"""What is done to a file's bytes, one after another: kind, place as a share of its length, and how
much."""


def damaged(data: bytes, damage: list[tuple[str, float, int]]) -> bytes:
    """The bytes with that damage."""
    out = bytearray(data)
    for kind, place, amount in damage:
        if not out:
            break
        at = int(place * len(out))
        if kind == "flip":
            out[at] ^= amount
        elif kind == "cut":
            del out[at:]
        elif kind == "drop":
            del out[at : at + amount]
        elif kind == "double":
            out[at:at] = out[at : at + amount]
        else:
            out[at : at + amount] = b"\xff" * len(out[at : at + amount])
    return bytes(out)


_nested: Any = 1
for _ in range(150):
    _nested = [_nested]
wild = st.sampled_from(
    [
        0,
        -1,
        1,
        3,
        10**9,
        10**12,
        2**63,
        10**29,
        10**400,
        -(10**18),
        0.0,
        -0.0,
        -0.5,
        1e-300,
        1e308,
        float("nan"),
        float("inf"),
        -float("inf"),
        True,
        None,
        "",
        "x",
        "1e9",
        "\u0000",
        "\u202e\u2028\ud800",
        '\'; drop """\n[x]',
        "../..",
        "/dev/zero",
        "a" * 5000,
        [],
        [1.0],
        [None],
        ["x", "x"],
        [[1, 2], [3]],
        [{}],
        {},
        {"x": 1},
        {"low": 1.0, "high": 1e30},
        {"low": 1e-300, "high": 1e300, "scale": "log"},
        _nested,
    ]
)
"""Values that no recipe should hold, or not at most of its places."""


def paths(content: Any, before: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Where the values of nested tables and lists are; lists of numbers as a whole."""
    found: list[tuple[Any, ...]] = []
    items = content.items() if isinstance(content, Mapping) else enumerate(content)
    for key, value in items:
        found.append((*before, key))
        if isinstance(value, Mapping) or (
            isinstance(value, list) and any(isinstance(v, Mapping) for v in value)
        ):
            found += paths(value, (*before, key))
    return found


def changed(content: Any, path: tuple[Any, ...], value: Any) -> Any:
    """The content with another value at a path."""
    key, rest = path[0], path[1:]
    new = value if not rest else changed(content[key], rest, value)
    if isinstance(content, Mapping):
        return {**content, key: new}
    return [new if index == key else item for index, item in enumerate(content)]


edits = st.lists(
    st.tuples(
        st.sampled_from(("put", "item", "drop", "add", "rename", "wrap", "double")), places, wild
    ),
    min_size=1,
    max_size=3,
)
"""What is done to nested tables and lists, one after another: kind, which of their values, and
another value."""


def edited(content: Any, edit: list[tuple[str, float, Any]]) -> Any:
    """A copy of the content with those edits."""
    content = copy.deepcopy(content)
    for kind, place, drawn in edit:
        value = copy.deepcopy(drawn)  # a later edit may change what an earlier one put
        known = paths(content)
        if not known:
            break
        path = known[int(place * len(known))]
        holder = content
        for key in path[:-1]:
            holder = holder[key]
        key, old = path[-1], holder[path[-1]]
        if kind == "drop":
            del holder[key]
        elif kind == "item" and isinstance(old, list) and old:
            old[int(place * 997) % len(old)] = value
        elif kind == "wrap":
            holder[key] = [old]
        elif kind == "double":
            holder[key] = [old, copy.deepcopy(old)]
        elif kind in ("add", "rename") and isinstance(holder, dict):
            holder['e\u0301 "x" = 1' if place < 0.5 else "name"] = (
                value if kind == "add" else holder.pop(key)
            )
        else:
            holder[key] = value
    return content


def as_toml(content: Mapping[str, Any]) -> str:
    """TOML with all tables in line, so that they may lie in lists; null stays what TOML refuses."""
    return "".join(f"{json.dumps(key)} = {_in_line(value)}\n" for key, value in content.items())


def _in_line(value: Any) -> str:
    if isinstance(value, Mapping):
        return (
            "{"
            + ", ".join(f"{json.dumps(key)} = {_in_line(inner)}" for key, inner in value.items())
            + "}"
        )
    if isinstance(value, list):
        return "[" + ", ".join(_in_line(inner) for inner in value) + "]"
    if isinstance(value, float):
        return repr(value)  # nan and inf are TOML
    return json.dumps(value)
