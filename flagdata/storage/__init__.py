"""Object storage: buckets of S3 as paths, with conditional puts, ranged reads, and a local cache of objects."""

from __future__ import annotations

from pathlib import Path

from flagdata.storage.path import RemotePath
from flagdata.storage.refusals import StoreError

Place = Path | RemotePath
"""Where a lake, or a part of it, is: on a disk or in a bucket. What both offer is the subset of `Path` that a lake
uses."""

__all__ = ["Place", "RemotePath", "StoreError"]
