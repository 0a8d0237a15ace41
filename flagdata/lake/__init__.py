"""The lake: immutable objects under their content hash, a Delta catalog whose one commit publishes them, and refs.

A lake is a folder of a local disk or of a network file system that carries hard links and flock, or a prefix of a
bucket, `s3://bucket/prefix` (see docs/decisions/040-object-storage.md). Its layout:

    lake.json            format version and identity of the lake
    catalog/             the Delta table; one row an artifact (schema.CATALOG)
    mcap/<sha256>.mcap   records
    zarr/<treehash>.zarr mesh sequences
    model/<treehash>.model trained networks
    refs/tags/           tags, put once, never changed
    refs/branches/       branches: where each forked from its parent
    refs/newest/         the number of the newest acknowledged commit, as a file name
    staging/             one folder a running transaction, with its lease; nothing in it is visible
"""

from flagdata.lake.artifact import Artifact
from flagdata.lake.lake import Lake
from flagdata.lake.transaction import CommitResult, Transaction

__all__ = ["Artifact", "CommitResult", "Lake", "Transaction"]
