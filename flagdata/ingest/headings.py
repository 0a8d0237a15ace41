"""The heading of a small table with columns of our own names: its delimiter, and whether all columns are there."""

from __future__ import annotations

from collections.abc import Sequence

from flagdata.errors import InputError, UnknownNameError

DELIMITERS = (",", ";", "\t")


def delimiter_of(heading: str) -> str:
    """The one of `DELIMITERS` that stands most often in a heading."""
    return max(DELIMITERS, key=heading.count)


def check_columns(
    names: Sequence[str], *, needed: Sequence[str], optional: Sequence[str], where: str, fix: str
) -> None:
    """Make sure that a heading has the columns that are needed, and none that is not known.

    Args:
        fix: said of columns that are missing or doubled.

    Raises:
        UnknownNameError: a column that is none of these.
        InputError: a column that is missing, or there twice.
    """
    for name in names:
        if name not in (*needed, *optional):
            raise UnknownNameError.of("column", name, [*needed, *optional], where=where)
    missing = [name for name in needed if name not in names]
    if missing or len(set(names)) < len(names):
        what = f"columns missing: {', '.join(missing)}" if missing else "a column is there twice"
        raise InputError(what, where=where, fix=fix)
