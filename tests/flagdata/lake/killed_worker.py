"""Processes that change a lake and are killed by a signal before a step, see `crashes`.

    python -m tests.flagdata.lake.killed_worker

It imports what is needed once, then forks a process for each line "OPERATION STEP LAKE", and
answers "killed" or "ended" once that is gone; nothing of the lake has been used before the fork.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping
from datetime import timedelta
from pathlib import Path

from flagdata.core.provenance import code_version
from flagdata.lake import Lake, collect, expire
from tests.flagdata.lake.crashes import dying
from tests.flagdata.lake.lake_machine import Items


def prepare(path: Path) -> None:
    """Make a lake with a branch, labels, and what was withdrawn and put for nothing."""
    lake = Lake.create(path)
    items = Items(lake)
    items.ingest(lake, "main", ["film", "clip", "other", "sheet"])
    lake.branch("one")
    items.ingest(lake, "one", ["twin"])
    lake.label(items.ids(["film"]), {"note": 1}, "label", branch="one")
    lake.withdraw(items.ids(["sheet"]), "withdraw")
    lake.withdraw(items.ids(["sheet"]), "withdraw", branch="one")


OPERATIONS: Mapping[str, Callable[[Lake, Items], object]] = {
    "ingest": lambda lake, items: items.ingest(lake, "main", ["result"]),
    "erase": lambda lake, items: lake.erase(items.ids(["other"]), "erase"),
    "merge": lambda lake, items: lake.merge("one", "merge"),
    "tag": lambda lake, items: lake.tag("v1", at="one"),
    "delete": lambda lake, items: lake.delete_branch("one", discard=True),
    "expire": lambda lake, items: expire(lake, lake.catalog.head() - 1),
    "gc": lambda lake, items: collect(lake, grace=timedelta(0)),
}


def serve() -> None:
    code_version()  # asks git, once for all
    for line in sys.stdin:
        name, step, path = line.split()
        pid = os.fork()
        if pid == 0:
            lake = Lake.open(path)
            items = Items(lake)
            with dying(int(step), for_good=True):
                OPERATIONS[name](lake, items)
            os._exit(0)
        _, status = os.waitpid(pid, 0)
        sys.stdout.write("killed\n" if os.WIFSIGNALED(status) else "ended\n")
        sys.stdout.flush()


if __name__ == "__main__":
    serve()
