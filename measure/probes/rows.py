"""Records of segments or groups: dataclasses whose arrays have a row for each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import UsageError


@dataclass(frozen=True, kw_only=True, eq=False)
class Rows:
    """Every field is an array with a row for each segment or group, another such record, or None where it is not looked
    at; but for those named in `_WHOLE`, which are of the record as a whole."""

    _WHOLE: ClassVar[frozenset[str]] = frozenset()

    def select(self, chosen: NDArray[np.bool_] | NDArray[np.int64]) -> Self:
        """Some of the rows; indices may repeat."""
        return replace(self, **{name: _some(getattr(self, name), chosen) for name in self._by_row()})

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """One after another; what is of the record as a whole is the first's.

        Raises:
            UsageError: none, or what is looked at in some of them alone.
        """
        if not parts:
            raise UsageError("nothing to join", where=cls.__name__, fix="give at least one part")
        return replace(
            parts[0], **{name: _together(name, [getattr(part, name) for part in parts]) for name in cls._by_row()}
        )

    @classmethod
    def _by_row(cls) -> list[str]:
        return [field.name for field in fields(cls) if field.name not in cls._WHOLE]


def _some(value: Any, chosen: NDArray[np.bool_] | NDArray[np.int64]) -> Any:
    if value is None:
        return None
    return value.select(chosen) if isinstance(value, Rows) else value[chosen]


def _together(name: str, values: Sequence[Any]) -> Any:
    known = [value for value in values if value is not None]
    if known and len(known) < len(values):
        raise UsageError(f"{name} of some parts alone", where="joined", fix="look at it in all parts or in none")
    if not known:
        return None
    return known[0].joined(known) if isinstance(known[0], Rows) else np.concatenate(known)
