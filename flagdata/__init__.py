"""flagdata: the lake of recordings and simulations of cloth in the wind, and the command line."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flagdata.dataset.source import Source

__all__ = ["open"]


def open(path: Path | str) -> Source:  # noqa: A001 — read as flagdata.open
    """The lake in the folder `path` as a source of typed pairs; `.lake` is the lake itself.

    Raises:
        NotFoundError: no lake there.
    """
    from flagdata.dataset.source import Source

    return Source.open(path)
