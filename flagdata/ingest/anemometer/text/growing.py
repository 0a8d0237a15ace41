"""A column of unknown length that grows as the blocks of a file come in.

A list of blocks that is joined at the end holds the column twice, and leaves holes in the heap that no later array
fits; room that nothing was written to costs no memory.
"""

from __future__ import annotations

from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

T = TypeVar("T", bound=np.generic)
_FIRST = 1 << 17
"""Values there is room for at first."""


class Growing(Generic[T]):
    """Values of one type, added block by block and taken once."""

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
        """(n,) all values so far, without a copy."""
        return self._room[: self._count]
