"""Processes that ingest real files, for tests that run several at once and kill some.

    python store_worker.py LAKE

It imports what is needed once, then forks a child for each line "FILE SOURCE SOURCE …" (tab-separated) it is given;
the lake has not been used before the fork. A child writes to FILE its process id, then "ID new|known" after each ingest
that has returned: what is there was acknowledged; then "done", or "failed".
"""

import os
import signal
import sys
import traceback
from pathlib import Path

from flagdata.ingest.classify import classify
from flagdata.ingest.store import ingest_camera, ingest_wind
from flagdata.lake import Lake
from flagdata.provenance import code_version


def ingest(lake: Lake, sources: list[Path], said: int) -> None:
    with lake.transaction("warm up: libraries load on first use"):
        pass
    os.write(said, f"{os.getpid()}\n".encode())
    for source in sources:
        camera = classify(source).kind == "camera"
        result = ingest_camera(lake, source) if camera else ingest_wind(lake, source)
        os.write(said, f"{result.artifact.id} {'new' if result.created else 'known'}\n".encode())


def serve(lake: Lake) -> None:
    code_version()  # asks git, once for all
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # the kernel buries the dead
    for line in sys.stdin:
        file, *sources = line.rstrip("\n").split("\t")
        if os.fork() == 0:
            said = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
            status = 1
            try:
                signal.signal(signal.SIGCHLD, signal.SIG_DFL)
                ingest(lake, [Path(source) for source in sources], said)
                status = 0
            finally:
                if status:
                    traceback.print_exc()
                os.write(said, b"done\n" if status == 0 else b"failed\n")
                os._exit(status)


if __name__ == "__main__":
    serve(Lake.open(Path(sys.argv[1])))
