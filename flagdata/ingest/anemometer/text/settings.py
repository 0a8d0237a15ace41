"""Settings above a table, which name no columns: namelists of Fortran, and names with their values."""

from __future__ import annotations

import re
from collections.abc import Sequence

_NAMELIST = re.compile(r"&[A-Za-z]\w*(?:\s|,|$)")
"""How a namelist of Fortran begins."""
_ASSIGNED = re.compile(
    r"[^\W\d][\w%()]*\s*=\s*(?:[-+]?[\d.][\d.eEdD+-]*|'[^']*'|\"[^\"]*\"|\.?(?:true|false)\.?|[TF]),?", re.IGNORECASE
)
"""A name and its value, which name no column."""

_LISTS = re.compile(r"^(?:fields|columns|column[ _]names|names|units|column[ _]units)\s*[:=]\s*", re.IGNORECASE)
"""What stands before the names or units in a line of comment that lists them."""


def listed(text: str) -> str:
    """A comment without the word before its list: "fields = timestamp,VW" is "timestamp,VW"."""
    return _LISTS.sub("", text)


def sets_values(text: str, cells: Sequence[str]) -> bool:
    """Whether a line, a comment or not, sets values: it begins a namelist, or is mostly of names with their values.

    Args:
        text: the line without the mark of a comment.
        cells: of it, as the rows are cut.
    """
    parts = [part for part in re.split(r"[\s,;]+", re.sub(r"\s*=\s*", "=", text)) if part.strip(" /&")]
    assigned = sum(bool(_ASSIGNED.fullmatch(part)) for part in parts)
    alone = "=" in (text.split() if len(cells) == 1 else [cell.strip() for cell in cells])
    return bool(_NAMELIST.match(text)) or alone or assigned > 0.5 * len(parts)
