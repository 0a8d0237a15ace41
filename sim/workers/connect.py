"""Workers for a command: those of a scheduler where one is given, else this machine's."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager

from flagdata.core.extras import explaining_missing
from sim.workers.jobs import Workers
from sim.workers.local import processes


def connect_workers(
    scheduler: str | None, *, workers: int, say: Callable[[str], object] = lambda line: None
) -> AbstractContextManager[Workers]:
    """Connects to the Dask scheduler at an address ("tcp://host:8786"), or takes this machine if it
    is None.

    Args:
        workers: processes on this machine, of one thread each; of no meaning with a scheduler,
            which has its own.
        say: called with a line for the user when workers are gone or back.

    Raises:
        MissingExtraError: a scheduler without Dask.
        NotFoundError: no scheduler answers there, or it has no workers.
        UsageError: its workers have another version of flagdata.
    """
    if scheduler is None:
        return processes(workers, say=say)
    with explaining_missing():
        from sim.workers.scheduled import scheduler_at
    return scheduler_at(scheduler, say=say)
