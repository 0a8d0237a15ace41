"""The processes that do the work: Dask's, on this machine or behind a scheduler's address."""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.metadata import version
from itertools import islice
from typing import Any, cast

import dask.config
from distributed import CancelledError, Client, Future, LocalCluster, as_completed
from distributed.scheduler import KilledWorker
from distributed.utils import silence_logging_cmgr

from flagdata.errors import ErrorKind, FlagdataError, NotFoundError, UsageError

_CONNECT_TIMEOUT = 30.0  # s
_AHEAD = 2  # jobs a thread, so that none waits for the next
_POLL = 0.05  # s
_LOOK = 1.0  # s, from one look at who works to the next
PATIENCE = 120.0
"""How long jobs wait where nobody works, before that is an error [s]."""
_LARGEST = {"distributed.admin.large-graph-warning-threshold": "1 TiB"}
"""A job carries the mesh sequence that it films, 70 MiB for ten minutes: it is sent once, to the one worker that films
it, so that Dask's advice to share it among jobs is of no use to anybody."""
_AGAIN = "then give the command again: it goes on from the last commit"

_OF_WORKERS = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "MALLOC_MMAP_THRESHOLD_": str(32 << 20),
    "MALLOC_TRIM_THRESHOLD_": str(1 << 30),
}
"""Numerical libraries take one thread, and memory stays with the process. Dask has freed arrays of 64 kB handed back to
the system at once (its setting nanny.pre-spawn-environ); filming takes and frees 1 to 30 MB a frame, and to have those
mapped anew costs a fifth of the time."""

Job = tuple[Callable[..., Any], Sequence[Any]]
"""A function of this package and its arguments."""


class WorkerError(FlagdataError):
    """Workers died over a job, or all of them are gone."""

    kind = ErrorKind.WORKERS_LOST


@contextmanager
def connected(scheduler: str | None, *, workers: int) -> Iterator[Client]:
    """Connects to the scheduler at an address ("tcp://host:8786"), or to processes of this machine if it is None.

    Args:
        workers: processes on this machine, of one thread each; of no meaning with a scheduler, which has its own.

    Raises:
        NotFoundError: no scheduler answers there, or it has no workers.
        UsageError: its workers have another version of flagdata.
    """
    if scheduler is not None:
        try:
            client = Client(scheduler, timeout=_CONNECT_TIMEOUT, set_as_default=False)
        except (OSError, ValueError) as error:
            raise NotFoundError(
                f"no scheduler answers: {error}",
                where=scheduler,
                fix="start one with dask scheduler, and workers with dask worker ADDRESS",
            ) from None
        with silence_logging_cmgr(logging.CRITICAL, "distributed.client"), client:  # errors here say what is wrong
            _check(client, where=scheduler)
            yield client
        return
    with (
        _environment(_OF_WORKERS),
        LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            memory_limit=0,
            dashboard_address=None,  # pyright: ignore[reportArgumentType]  None is no dashboard, as documented
            scheduler_kwargs={"dashboard_address": "127.0.0.1:0"},  # any port: two builds must not want the same
            silence_logs=logging.CRITICAL,
        ) as cluster,
        Client(cluster, set_as_default=False) as client,
    ):
        yield client


def _check(client: Client, *, where: str) -> None:
    """Checks that there are workers, and that they run this version of the code.

    Raises:
        NotFoundError: no worker came within `_CONNECT_TIMEOUT`.
        UsageError: a worker has another version of flagdata, which may make something else of the same job.
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


@contextmanager
def _environment(wanted: Mapping[str, str]) -> Iterator[None]:
    """Sets environment variables for processes that are started within the context."""
    before = {name: os.environ.get(name) for name in wanted}
    os.environ.update(wanted)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def threads(client: Client) -> int:
    """Counts the threads of all workers together, 0 where there are none.

    Raises:
        WorkerError: the connection to the scheduler was lost, and with it all jobs.
    """
    if client.status != "running":
        raise _lost()
    try:
        return sum(cast("dict[str, int]", client.nthreads()).values())
    except OSError:
        raise _lost() from None


def _lost() -> WorkerError:
    return WorkerError("the scheduler is gone", where="dask", fix=f"start it again, {_AGAIN}")


def _next(client: Client, running: as_completed, say: Callable[[str], None]) -> tuple[Future, Any]:
    """Waits for the next job that is done, and returns it with its result.

    A result counts when it is here: that of a worker which died over sending it is made again by another.

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
        if threads(client):
            if lost_at is not None:
                say("there are workers again")
            lost_at = None
        elif lost_at is None:
            lost_at = now
            say(f"all workers are gone; waiting {PATIENCE:g} s for new ones")
        elif now - lost_at > PATIENCE:
            raise WorkerError(
                f"there were no workers for {PATIENCE:g} s", where="dask", fix=f"see that workers run, {_AGAIN}"
            )
    return cast("tuple[Future, Any]", next(running))


def results(client: Client, jobs: Iterable[Job], *, say: Callable[[str], None]) -> Iterator[Any]:
    """Yields the jobs' results as they come; few jobs wait beside those that run, so that memory stays bounded.

    A job whose worker dies is done again by another one, as often as Dask allows failures (three times). While there
    are no workers, the jobs wait for new ones, for `PATIENCE`. Leaving the iteration early cancels what still runs.

    Args:
        say: called with a line for the user when no worker is left, and when one is back.

    Raises:
        WorkerError: workers kept dying over one job; no workers for `PATIENCE`; the scheduler is gone.
        FlagdataError: a job failed; its own error.
    """
    waiting = iter(jobs)
    running = as_completed(loop=client.loop, with_results=True)

    def fill() -> None:
        """Submits jobs for the workers there are now: they may come and go."""
        for function, arguments in islice(waiting, max(0, max(1, threads(client)) * _AHEAD - running.count())):
            with dask.config.set(_LARGEST):
                running.add(client.submit(function, *arguments, pure=False))

    try:
        fill()
        while not running.is_empty():
            try:
                future, result = _next(client, running, say)
            except CancelledError:
                raise _lost() from None
            except KilledWorker as error:
                raise WorkerError(
                    f"workers kept dying over the same job: {error}",
                    where="dask",
                    fix="look at the workers' logs; they may lack memory",
                ) from None
            if isinstance(result, CancelledError):  # what Dask gives for the result of a job that was lost with it
                raise _lost()
            future.release()
            yield result
            fill()
    finally:
        running.clear()
