"""Records of segments or groups: dataclasses whose arrays have a row for each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar, Self

import numpy as np

from flagdata.core.arrays import BoolArray, IntArray
from flagdata.errors import UsageError


@dataclass(frozen=True, kw_only=True, eq=False)
class StatisticRows:
    """Every field is an array with a row for each segment or group, another such record, or None
    where it is not looked at; but for those named in `_WHOLE`, which are of the record as a
    whole."""

    _WHOLE: ClassVar[frozenset[str]] = frozenset()

    def select(self, chosen: BoolArray | IntArray) -> Self:
        """Selects some of the rows; indices may repeat."""
        return replace(
            self, **{name: _select_rows(getattr(self, name), chosen) for name in self._by_row()}
        )

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """Joins rows one after another; what is of the record as a whole is the first's.

        Raises:
            UsageError: none, or what is looked at in some of them alone.
        """
        if not parts:
            raise UsageError(
                "there is nothing to join", where=cls.__name__, fix="give at least one part"
            )
        return replace(
            parts[0],
            **{
                name: _together(name, [getattr(part, name) for part in parts])
                for name in cls._by_row()
            },
        )

    @classmethod
    def _by_row(cls) -> list[str]:
        return [field.name for field in fields(cls) if field.name not in cls._WHOLE]


def _select_rows(value: Any, chosen: BoolArray | IntArray) -> Any:
    if value is None:
        return None
    return value.select(chosen) if isinstance(value, StatisticRows) else value[chosen]


def _together(name: str, values: Sequence[Any]) -> Any:
    present = [value for value in values if value is not None]
    if present and len(present) < len(values):
        raise UsageError(
            f"only some parts have {name}", where="joined", fix="look at it in all parts or in none"
        )
    if not present:
        return None
    return (
        present[0].joined(present)
        if isinstance(present[0], StatisticRows)
        else np.concatenate(present)
    )
