"""The process of each thread that runs SQL, which stays for the next question; it can start before
the lake is read."""

from __future__ import annotations

import threading

from flagdata.core.files.bounded import Child

MEMORY = 2_000_000_000
"""Memory that SQL may take [B]; on a catalog of a million rows it takes a tenth of it."""
_own = threading.local()


class SqlProcess(Child):
    """A process that answers as `flagdata.lake.catalog_sql.Answers`.

    Attributes:
        closed: numbers of questions that nobody asks any more.
    """

    def __init__(self) -> None:
        super().__init__("flagdata.lake.catalog_sql:Answers", memory=MEMORY)
        self.closed: list[int] = []


def sql_process() -> SqlProcess:
    """Returns the process of this thread: a new one where there is none, or it has ended."""
    process: SqlProcess | None = getattr(_own, "process", None)
    if process is None or not process.usable:
        process = _own.process = SqlProcess()
    return process
