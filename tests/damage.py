"""Damage for property-based tests: bytes that changed, parts that are missing or doubled, values no one meant."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

QUICK = settings(
    max_examples=40, deadline=None, derandomize=True,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)  # fmt: skip

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
"""What is done to a file's bytes, one after another: kind, place as a share of its length, and how much."""


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
        0, -1, 1, 3, 10**9, 10**29, 10**400, -(10**18), 0.0, -0.5, 1e-300, 1e308, float("nan"), float("inf"), True, "",
        "x", "1e9", "\u0000", "a" * 5000, [], [1.0], [[1, 2], [3]], {}, {"low": 1.0, "high": 1e30}, {"x": 1}, _nested,
    ]
)  # fmt: skip
"""Values that no recipe should hold, or not at most of its places."""


def paths(content: Any, before: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Where the values of nested tables and lists are; lists of numbers as a whole."""
    found: list[tuple[Any, ...]] = []
    items = content.items() if isinstance(content, Mapping) else enumerate(content)
    for key, value in items:
        found.append((*before, key))
        if isinstance(value, Mapping) or (isinstance(value, list) and any(isinstance(v, Mapping) for v in value)):
            found += paths(value, (*before, key))
    return found


def changed(content: Any, path: tuple[Any, ...], value: Any) -> Any:
    """The content with another value at a path."""
    key, rest = path[0], path[1:]
    new = value if not rest else changed(content[key], rest, value)
    if isinstance(content, Mapping):
        return {**content, key: new}
    return [new if index == key else item for index, item in enumerate(content)]
