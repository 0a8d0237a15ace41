"""Processes that ingest tiny objects, for tests that run several at once and kill some.

    python ingest_worker.py LAKE

It imports what is needed once, then forks a worker for each line "PREFIX COUNT SHARED FILE" it is
given; nothing of the lake has been used before the fork. A worker writes to FILE its process id and
"ready", then "begun" before each with-block and an artifact's id after it was left: what is there
was acknowledged. The first SHARED sources are the same for all workers, the next COUNT are its own,
fewer where a file FILE-stop is made meanwhile. Records and folders take turns.
"""

import os
import signal
import sys
import traceback
from hashlib import sha256
from pathlib import Path

from flagdata.core.provenance import code_version
from flagdata.core.schema import Kind
from flagdata.lake import Artifact, Lake, Transaction


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


def ingest(lake: Lake, prefix: str, count: int, shared: int, said: int, stop: Path) -> None:
    with lake.transaction("warm up: libraries load on first use"):
        pass
    os.write(said, f"{os.getpid()}\nready\n".encode())
    sources = [f"shared-{i}" for i in range(shared)] + [f"{prefix}-{i}" for i in range(count)]
    for i, source in enumerate(sources):
        if stop.exists():
            break
        os.write(said, b"begun\n")
        with lake.transaction(f"ingest {source}") as tx:
            name = put(tx, source, folder=i % 2 == 1)
            artifact = Artifact(
                kind=Kind.WIND,
                name=source,
                object=name,
                source_hash=sha256(source.encode()).hexdigest(),
            )
            tx.add(artifact)
        os.write(said, f"{artifact.id}\n".encode())


def serve(address: str) -> None:
    code_version()  # asks git, once for all
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # the kernel buries the dead
    for line in sys.stdin:
        prefix, count, shared, file = line.split()
        if os.fork() == 0:
            said = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
            status = 1
            try:
                signal.signal(signal.SIGCHLD, signal.SIG_DFL)
                ingest(
                    Lake.open(address), prefix, int(count), int(shared), said, Path(f"{file}-stop")
                )
                status = 0
            except BaseException:  # noqa: BLE001 — the worker ends here whatever happened
                traceback.print_exc()  # os._exit says nothing of what ended the worker
            finally:
                os.write(said, b"done\n" if status == 0 else b"failed\n")
                os._exit(status)


if __name__ == "__main__":
    serve(sys.argv[1])
