"""SWdir, the direct short-wave radiation, which without other radiation beside it reads as the direction of a wind."""

from __future__ import annotations

import re
from collections.abc import Sequence

_DIRECT = re.compile(r"sw[\s_.]*dir(?:ect)?", re.IGNORECASE)
_BESIDE = re.compile(r"(?:sw|lw)[\s_.]*(?:dif\w*|in|out|up|down|dn|net|glob\w*|tot\w*)?", re.IGNORECASE)
"""What stands in a heading of other radiation: SW, SWdif, LW_in."""
_UNIT = re.compile(r"[\[(<{][^\])>}]*[\])>}]")


def is_direct(names: Sequence[str], index: int) -> bool:
    """Whether a column is the direct short-wave radiation: it is called so, and a column of other radiation beside it.

    Args:
        names: of all columns of a table.
    """
    if _DIRECT.fullmatch(_bare(names[index])) is None:
        return False
    return any(_BESIDE.fullmatch(_bare(name)) for at, name in enumerate(names) if at != index)


def _bare(name: str) -> str:
    return _UNIT.sub("", name).strip()
