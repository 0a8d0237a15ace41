"""The lake: immutable objects under their content hash, a Delta catalog whose one commit publishes
them, and refs.

A lake is a folder of a local disk or of a network file system that carries hard links and flock, or
a prefix of a bucket, `s3://bucket/prefix` (see docs/decisions/040-object-storage.md). Its layout:

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

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.lake.artifact import Artifact
from flagdata.lake.lake import Lake
from flagdata.lake.transaction import CommitResult, Transaction
from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from flagdata.lake.artifact import Artifact
    from flagdata.lake.catalog import Catalog
    from flagdata.lake.collection import collect, garbage, usage
    from flagdata.lake.copying import clone, pull, transfer
    from flagdata.lake.delta_log import Log
    from flagdata.lake.deposit import Deposit
    from flagdata.lake.health import (
        doctor,
        is_healthy,
        object_names,
        read_refs,
        sample_names,
        verify,
        verify_catalog,
    )
    from flagdata.lake.label_columns import columns
    from flagdata.lake.labels import given
    from flagdata.lake.lake import Lake
    from flagdata.lake.leases import Lease, collecting
    from flagdata.lake.lineage import labels_of
    from flagdata.lake.marker_sequences import MarkerSequence, read_markers, write_markers
    from flagdata.lake.merging import difference
    from flagdata.lake.mesh_sequences import (
        Mesh,
        MeshSequence,
        RaggedMeshSequence,
        open_meshes,
        read_meshes,
        write_meshes,
    )
    from flagdata.lake.naming import meant
    from flagdata.lake.objects import Objects
    from flagdata.lake.refs import Refs, Slice, View
    from flagdata.lake.removal import expire, last_version, lost
    from flagdata.lake.restoring import heal
    from flagdata.lake.results import Placed, keep, place_result, versions
    from flagdata.lake.rowfiles import Scan, with_data_sets
    from flagdata.lake.selection import Request, Selection, select
    from flagdata.lake.transaction import Transaction


__all__ = ["Artifact", "CommitResult", "Lake", "Transaction"]

__getattr__ = lazy_exports(__name__, __file__)
