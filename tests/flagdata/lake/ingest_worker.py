"""A process that ingests tiny objects, for tests that run several at once and kill some.

    python ingest_worker.py LAKE PREFIX COUNT SHARED

It prints "ready", then an artifact's id after each with-block it has left: what is printed was acknowledged. The first
SHARED sources are the same for all workers, the next COUNT are its own. Records and folders take turns.
"""

import os
import sys
from hashlib import sha256
from pathlib import Path

from flagdata.lake import Artifact, Lake
from flagdata.lake.transaction import Transaction
from flagdata.provenance import code_version
from flagdata.schema import Kind


def put(tx: Transaction, source: str, *, folder: bool) -> str:
    payload = source.encode() * 2000
    if not folder:
        path = tx.staging(".mcap")
        path.write_bytes(payload)
        return tx.put(path)
    path = tx.staging(".zarr")
    for part in ("positions/c/0", "time/c/0"):
        (path / part).parent.mkdir(parents=True)
        (path / part).write_bytes(payload + part.encode())
    return tx.put(path)


def main(lake_path: str, prefix: str, count: int, shared: int) -> None:
    lake = Lake.open(Path(lake_path))
    with lake.transaction("warm up: libraries load on first use"):
        code_version()
    os.write(1, b"ready\n")
    sources = [f"shared-{i}" for i in range(shared)] + [f"{prefix}-{i}" for i in range(count)]
    for i, source in enumerate(sources):
        with lake.transaction(f"ingest {source}") as tx:
            name = put(tx, source, folder=i % 2 == 1)
            artifact = Artifact(
                kind=Kind.WIND, name=source, object=name, source_hash=sha256(source.encode()).hexdigest()
            )
            tx.add(artifact)
        os.write(1, f"{artifact.id}\n".encode())


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4]))
