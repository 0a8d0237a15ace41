"""Jobs, and what computes them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, Protocol, TypeAlias

from flagdata.errors import ErrorKind, FlagdataError

Job: TypeAlias = tuple[Callable[..., Any], Sequence[Any]]
"""A function of a module and its arguments."""
RESUMED = "then give the command again: it goes on from what is kept"


class WorkerError(FlagdataError):
    """Workers died over a job, or all of them are gone."""

    kind = ErrorKind.WORKERS_LOST


class Workers(Protocol):
    """What computes jobs, each on one thread."""

    @property
    def count(self) -> int:
        """How many jobs are computed at a time."""
        ...

    def results(self, jobs: Iterable[Job]) -> Iterator[Any]:
        """Yields the jobs' results as they come; few jobs wait beside those that run, so that
        memory stays bounded.

        A job whose worker dies is done again. Leaving the iteration early cancels what still runs.

        Raises:
            WorkerError: workers kept dying over jobs, or are gone.
            Exception: what a job raised.
        """
        ...
