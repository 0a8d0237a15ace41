"""Object storage: buckets of S3 as paths, with conditional puts, ranged reads, and a local cache of
objects."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports
from flagdata.storage.path import RemotePath
from flagdata.storage.refusals import StoreError

if TYPE_CHECKING:
    from flagdata.storage.connection import plain
    from flagdata.storage.path import RemotePath
    from flagdata.storage.refusals import DeniedError, StoreError, refusal
    from flagdata.storage.uploads import Upload


Place = Path | RemotePath
"""Where a lake, or a part of it, is: on a disk or in a bucket. What both offer is the subset of
`Path` that a lake uses."""

__all__ = ["Place", "RemotePath", "StoreError"]

__getattr__ = lazy_exports(__name__, __file__)
