"""What effects hand to their C++, which stands in NAME.hpp beside NAME.py (see effect.hpp)."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from torch import Tensor

if TYPE_CHECKING:
    from sim.cloth.cloth_batch import Cloth


@dataclass(frozen=True, kw_only=True)
class Given:
    """An effect as its C++ reads it.

    Attributes:
        of: the class whose C++ it is.
        numbers: one for all members, or (batch,) each.
        own: (hinge, number, batch) of each hinge; None where it has none.
    """

    of: type
    numbers: tuple[float | Tensor, ...]
    own: Tensor | None = None


@runtime_checkable
class Compilable(Protocol):
    """What may have C++ beside it."""

    def given(self, cloth: Cloth) -> Given:
        """Returns what it hands over for a batch."""
        ...


def header(of: type) -> Path | None:
    """Finds the C++ beside the module that a class is from; None where there is none."""
    file = getattr(sys.modules.get(of.__module__), "__file__", None)
    source = None if file is None else Path(file).with_suffix(".hpp")
    return source if source is not None and source.is_file() else None
