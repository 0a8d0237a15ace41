"""Jobs on this machine: in this process where there is one worker, else in processes beside it."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from itertools import islice
from multiprocessing import get_context, parent_process
from typing import Any

from sim.workers.jobs import RESUMED, Job, WorkerError

_AHEAD = 2  # jobs a process, so that none waits for the next
TRIES = 3
"""How often a job is computed whose process dies."""
_OF_PROCESSES = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "MALLOC_MMAP_THRESHOLD_": str(32 << 20),
    "MALLOC_TRIM_THRESHOLD_": str(1 << 30),
}
"""Numerical libraries take one thread, and memory stays with the process: filming takes and frees 1
to 30 MB a frame, and to have those mapped anew costs a fifth of the time."""


def single_threaded() -> None:
    """Limits a worker to one thread, since there are as many workers as cores, and to its parent's
    life, however that ends; an interruption ends it without a word."""
    import torch

    torch.set_num_threads(1)
    _end_with_parent()


def _end_with_parent() -> None:
    """Ends this process with its parent, and at once when it is interrupted."""
    if parent_process() is not None:
        signal.signal(signal.SIGINT, lambda *_: os._exit(1))
        threading.Thread(target=_leave_with_parent, daemon=True).start()


def _leave_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


class LocalWorkers:
    """Workers of this machine. Processes start with the first jobs, and end with the context of
    `processes`.

    Args:
        workers: how many.
        say: called with a line for the user when a process has died.
    """

    def __init__(self, workers: int, *, say: Callable[[str], object] = lambda line: None) -> None:
        self._workers, self._say = workers, say
        self._pool: ProcessPoolExecutor | None = None

    @property
    def count(self) -> int:
        """How many jobs are computed at a time."""
        return self._workers

    def results(self, jobs: Iterable[Job]) -> Iterator[Any]:
        """Yields the jobs' results as they come, as `sim.workers.Workers` has it."""
        return self._in_this_process(jobs) if self._workers == 1 else self._in_processes(jobs)

    def close(self) -> None:
        """Ends the processes once the jobs that they compute are done."""
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)
            self._pool = None

    def _in_this_process(self, jobs: Iterable[Job]) -> Iterator[Any]:
        import torch

        before = torch.get_num_threads()
        try:
            for function, arguments in jobs:
                torch.set_num_threads(1)
                yield function(*arguments)
        finally:
            torch.set_num_threads(before)

    def _in_processes(self, jobs: Iterable[Job]) -> Iterator[Any]:
        waiting = iter(jobs)
        running: dict[Future[Any], tuple[Job, int]] = {}
        try:
            self._submit(running, ((job, 1) for job in islice(waiting, self._workers * _AHEAD)))
            while running:
                done, _ = wait(running, return_when=FIRST_COMPLETED)
                lost: list[tuple[Job, int]] = []
                for future in done:
                    entry = running.pop(future)
                    if isinstance(future.exception(), BrokenProcessPool):
                        lost.append(entry)
                    else:
                        yield future.result()
                if lost:
                    lost += running.values()  # of a pool that is broken nothing more comes
                    running.clear()
                    self._renew(lost)
                    self._submit(running, [(job, tries + 1) for job, tries in lost])
                self._submit(
                    running,
                    ((job, 1) for job in islice(waiting, self._workers * _AHEAD - len(running))),
                )
        finally:
            for future in running:
                future.cancel()

    def _submit(
        self, running: dict[Future[Any], tuple[Job, int]], entries: Iterable[tuple[Job, int]]
    ) -> None:
        for (function, arguments), tries in entries:
            if self._pool is None:
                context = get_context("spawn")
                self._pool = ProcessPoolExecutor(
                    self._workers, mp_context=context, initializer=_end_with_parent
                )
            try:
                future = self._pool.submit(function, *arguments)
            except (
                BrokenProcessPool
            ) as error:  # broken since the last look: as if it had been submitted before that
                future = Future()
                future.set_exception(error)
            running[future] = (function, arguments), tries

    def _renew(self, lost: list[tuple[Job, int]]) -> None:
        """Gives up a pool whose process has died.

        Raises:
            WorkerError: it was the last try of one of the jobs.
        """
        self.close()
        if max(tries for _, tries in lost) >= TRIES:
            raise WorkerError(
                f"processes died {TRIES} times over the same jobs",
                where="this machine",
                fix="see whether it lacks memory, or give fewer --workers; a script calls it below "
                f'if __name__ == "__main__"; {RESUMED}',
            )
        self._say("a process has died; its jobs are done again")


@contextmanager
def processes(workers: int, *, say: Callable[[str], object]) -> Iterator[LocalWorkers]:
    """Makes workers of this machine, and ends their processes after the context."""
    local = LocalWorkers(workers, say=say)
    with _environment(_OF_PROCESSES):
        try:
            yield local
        finally:
            local.close()


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
