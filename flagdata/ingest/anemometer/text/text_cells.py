"""From cells of text to numbers, in bulk, with a reason for each cell that is none; columns that
grow by blocks."""

# pyarrow.compute makes its functions at import, where a type checker cannot see them.
# pyright: reportAttributeAccessIssue=false
from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Generic, TypeVar

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from flagdata.core.arrays import BoolArray, FloatArray, UInt8Array
from flagdata.ingest.anemometer.sensor_recipe import MISSING, MISSING_SIGNS

_NUMBER = r"^[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,4})?$"
_INFINITE = r"^[+-]?(inf|infinity|1\.#inf0*)$"
BELOW = r"^<\s*=?\s*(\d+\.?\d*|\.\d+)$"
"""A number that the instrument could only say to be smaller than another: "<0.3"."""


class Cell(IntEnum):
    """What a cell held."""

    NUMBER = 0
    MISSING = 1
    UNREADABLE = 2
    INFINITE = 3
    CALM = 4
    BELOW = 5


@dataclass(frozen=True, kw_only=True)
class Numbers:
    """A column.

    Attributes:
        value: (n,) float64, NaN unless `state` is NUMBER, or CALM or BELOW with 0.
        state: (n,) uint8 of `Cell`.
        limit: the largest upper limit of a censored value; 0 where none was.
    """

    value: FloatArray
    state: UInt8Array
    limit: float = 0.0


def numbers(
    cells: Sequence[str] | pa.StringArray,
    *,
    decimal: str = ".",
    missing: Sequence[str] = (),
    suffix: str = "",
    zeros: Collection[str] = (),
    below: bool = False,
) -> Numbers:
    """Read a column of cells.

    Args:
        decimal: "." or ","; with "," a cell holding a point is unreadable, never a thousand times
            off.
        missing: spellings of "no value" beside `MISSING`, lower-case; numeric ones are compared by
            value.
        suffix: what stands behind each number, such as its unit; a number without it is unreadable.
        zeros: words that mean 0, lower-case; those of `missing` go before them.
        below: whether "<0.3" is a value below the instrument's threshold, 0 within 0.3; else it is
            unreadable.
    """
    text = pc.utf8_trim_whitespace(
        cells if isinstance(cells, pa.StringArray) else pa.array(cells, pa.string())
    )
    if suffix:
        text = _without(text, suffix)
    written = text
    if decimal == ",":
        pointed = pc.match_substring(text, ".")
        text = pc.if_else(pointed, "?", pc.replace_substring(text, ",", "."))
    state, limit = np.zeros(len(text), dtype=np.uint8), 0.0
    try:
        parsed = pc.cast(text, pa.float64())
    except pa.ArrowInvalid:
        lower = pc.utf8_lower(text)
        readable = pc.match_substring_regex(text, _NUMBER)
        absent = pc.is_in(lower, pa.array([*MISSING, *missing], pa.string()))
        endless = pc.match_substring_regex(lower, _INFINITE)
        state[~_mask(readable)] = Cell.UNREADABLE
        if zeros:
            state[_mask(pc.is_in(lower, pa.array(sorted(zeros), pa.string())))] = Cell.CALM
        if below:
            smaller = pc.match_substring_regex(text, BELOW)
            state[_mask(smaller)] = Cell.BELOW
            limits = pc.cast(
                pc.replace_substring_regex(text.filter(smaller), BELOW, r"\1"), pa.float64()
            )
            limit = float(pc.max(limits).as_py() or 0.0)
        state[_mask(pc.or_(absent, pc.match_substring_regex(written, MISSING_SIGNS)))] = (
            Cell.MISSING
        )
        state[_mask(endless)] = Cell.INFINITE
        parsed = pc.cast(pc.if_else(readable, text, None), pa.float64())
    value = parsed.to_numpy(zero_copy_only=False).astype(np.float64)
    state[np.isnan(value) & (state == Cell.NUMBER)] = Cell.MISSING
    state[np.isinf(value)] = Cell.INFINITE
    for code in _numeric(missing):
        state[(value == code) & (state == Cell.NUMBER)] = Cell.MISSING
    value[state != Cell.NUMBER] = np.nan
    value[(state == Cell.CALM) | (state == Cell.BELOW)] = 0.0
    return Numbers(value=value, state=state, limit=limit)


def _without(text: pa.StringArray, suffix: str) -> pa.StringArray:
    """Strips from trimmed cells the suffix that each number must have; numbers without it become
    "?"."""
    has_suffix = pc.ends_with(text, suffix)
    bare = pc.utf8_trim_whitespace(
        pc.if_else(has_suffix, pc.utf8_slice_codeunits(text, 0, -len(suffix)), text)
    )
    return pc.if_else(
        pc.and_(pc.invert(has_suffix), pc.match_substring_regex(bare, r"\d")), "?", bare
    )


def _mask(array: pa.BooleanArray) -> BoolArray:
    return array.to_numpy(zero_copy_only=False).astype(bool)


def _numeric(codes: Sequence[str]) -> list[float]:
    numbers: list[float] = []
    for code in codes:
        try:
            numbers.append(float(code.replace(",", ".")))
        except ValueError:
            continue
    return [code for code in numbers if np.isfinite(code)]


T = TypeVar("T", bound=np.generic)
_FIRST = 1 << 17
"""Values there is room for at first."""


class Growing(Generic[T]):
    """Values of one type, added block by block and taken once.

    A list of blocks that is joined at the end holds the column twice, and leaves holes in the heap
    that no later array fits; room that nothing was written to costs no memory.
    """

    def __init__(self, kind: type[T]) -> None:
        self._room: NDArray[T] = np.empty(0, dtype=kind)
        self._count = 0

    def add(self, block: NDArray[T]) -> None:
        """Add (n,) values at the end."""
        end = self._count + len(block)
        if end > len(self._room):
            wider: NDArray[T] = np.empty(max(_FIRST, 2 * end), dtype=self._room.dtype)
            wider[: self._count] = self._room[: self._count]
            self._room = wider
        self._room[self._count : end] = block
        self._count = end

    def view(self) -> NDArray[T]:
        """Views (n,) all values so far, without a copy."""
        return self._room[: self._count]
