"""Jobs on the workers of a Dask scheduler, on other machines."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from importlib.metadata import version
from itertools import islice
from typing import Any, cast

import torch
from distributed import CancelledError, Client, Future, as_completed
from distributed.scheduler import KilledWorker
from distributed.utils import silence_logging_cmgr

from flagdata.errors import NotFoundError, UsageError
from sim.workers.jobs import RESUMED, Job, WorkerError

_CONNECT_TIMEOUT = 30.0  # s
_AHEAD = 2  # jobs a thread, so that none waits for the next
_POLL = 0.05  # s
_LOOK = 1.0  # s, from one look at who works to the next
PATIENCE = 120.0
"""How long jobs wait where nobody works, before that is an error [s]."""


@contextmanager
def scheduler_at(address: str, *, say: Callable[[str], object]) -> Iterator[Scheduled]:
    """Connects to a scheduler.

    Raises:
        NotFoundError: no scheduler answers there, or it has no workers.
        UsageError: its workers have another version of flagdata.
    """
    try:
        client = Client(address, timeout=_CONNECT_TIMEOUT, set_as_default=False)
    except (OSError, ValueError) as error:
        raise NotFoundError(
            f"no scheduler answers: {error}",
            where=address,
            fix="start one with dask scheduler, and workers with dask worker ADDRESS",
        ) from None
    with (
        silence_logging_cmgr(logging.CRITICAL, "distributed.client"),
        client,
    ):  # errors here say what is wrong
        _check(client, where=address)
        yield Scheduled(client, say=say)


def _check(client: Client, *, where: str) -> None:
    """Checks that there are workers, and that they run this version of the code.

    Raises:
        NotFoundError: no worker came within `_CONNECT_TIMEOUT`.
        UsageError: a worker has another version of flagdata, which may make something else of the
            same job.
    """
    try:
        client.wait_for_workers(1, timeout=_CONNECT_TIMEOUT)
    except TimeoutError:
        raise NotFoundError(
            f"the scheduler has no workers after {_CONNECT_TIMEOUT:g} s",
            where=where,
            fix="start some with dask worker ADDRESS",
        ) from None
    versions = cast("dict[str, str]", client.run(version, "flagdata"))
    for worker, worker_version in versions.items():
        if worker_version != version("flagdata"):
            raise UsageError(
                f"the worker {worker} has flagdata {worker_version}, not {version('flagdata')}",
                where=where,
                fix="install the same version everywhere",
            )


def _alone(function: Callable[..., Any], *arguments: Any) -> Any:
    """Computes a job on one thread, since the last bits of torch's sums depend on how many it
    has."""
    torch.set_num_threads(1)
    return function(*arguments)


def _lost() -> WorkerError:
    return WorkerError("the scheduler is gone", where="dask", fix=f"start it again, {RESUMED}")


class Scheduled:
    """The workers of a scheduler; they may come and go.

    Args:
        say: called with a line for the user when no worker is left, and when one is back.
    """

    def __init__(self, client: Client, *, say: Callable[[str], object]) -> None:
        self._client, self._say = client, say

    @property
    def count(self) -> int:
        """How many threads all workers have together, 0 where there are none.

        Raises:
            WorkerError: the connection to the scheduler was lost, and with it all jobs.
        """
        if self._client.status != "running":
            raise _lost()
        try:
            return sum(cast("dict[str, int]", self._client.nthreads()).values())
        except OSError:
            raise _lost() from None

    def results(self, jobs: Iterable[Job]) -> Iterator[Any]:
        """Yields the jobs' results as they come, as `sim.workers.Workers` has it.

        A job whose worker dies is done again by another one, as often as Dask allows failures
        (three times). While there are no workers, the jobs wait for new ones, for `PATIENCE`.

        Raises:
            WorkerError: workers kept dying over one job; no workers for `PATIENCE`; the scheduler
                is gone.
            FlagdataError: a job failed; its own error.
        """
        waiting = iter(jobs)
        running = as_completed(loop=self._client.loop, with_results=True)

        def fill() -> None:
            """Submits jobs for the workers there are now."""
            for function, arguments in islice(
                waiting, max(0, max(1, self.count) * _AHEAD - running.count())
            ):
                running.add(self._client.submit(_alone, function, *arguments, pure=False))

        try:
            fill()
            while not running.is_empty():
                try:
                    future, result = self._next(running)
                except CancelledError:
                    raise _lost() from None
                except KilledWorker as error:
                    raise WorkerError(
                        f"workers kept dying over the same job: {error}",
                        where="dask",
                        fix="look at the workers' logs; they may lack memory",
                    ) from None
                if isinstance(
                    result, CancelledError
                ):  # what Dask gives for the result of a job that was lost with it
                    raise _lost()
                future.release()
                yield result
                fill()
        finally:
            running.clear()

    def _next(self, running: as_completed) -> tuple[Future, Any]:
        """Waits for the next job that is done, and returns it with its result.

        A result counts when it is here: that of a worker which died over sending it is made again
        by another.

        Raises:
            WorkerError: nobody has worked for `PATIENCE`, or the scheduler is gone.
            Exception: what the job raised.
        """
        checked_at = time.monotonic()
        lost_at: float | None = None
        while not running.has_ready():
            time.sleep(_POLL)
            now = time.monotonic()
            if now - checked_at < _LOOK:
                continue
            checked_at = now
            if self.count:
                if lost_at is not None:
                    self._say("there are workers again")
                lost_at = None
            elif lost_at is None:
                lost_at = now
                self._say(f"all workers are gone; waiting {PATIENCE:g} s for new ones")
            elif now - lost_at > PATIENCE:
                raise WorkerError(
                    f"there were no workers for {PATIENCE:g} s",
                    where="dask",
                    fix=f"see that workers run, {RESUMED}",
                )
        return cast("tuple[Future, Any]", next(running))
