"""Has a fitter judge the sets of a challenge, and files what it says."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from dataclasses import replace
from importlib.abc import MetaPathFinder
from multiprocessing import get_context
from types import ModuleType
from typing import TYPE_CHECKING, Any, Protocol

from flagdata.core.json_values import json_values
from flagdata.core.rng import child_seed
from flagdata.errors import FlagdataError
from measure.verdict import Verdict
from sim.workers import single_threaded
from tests.studies.challenge.filing import Filing, file, filed, verdict_json
from tests.studies.challenge.folder import ChallengeFolder

if TYPE_CHECKING:
    from importlib.machinery import ModuleSpec

    from tests.studies.challenge.fitter import ClosingTheLoopOnFilms

IN_THIS_PROCESS = 0
_APART = (
    "tests.studies.challenge.outside",
    "tests.studies.challenge.design",
    "tests.studies.challenge.filming",
    "tests.studies.challenge.simulation",
    "tests.studies.challenge.answer_key",
)


class Fitter(Protocol):
    """Judges a set of a challenge. With workers it is sent to other processes, so it must be
    picklable."""

    def __call__(self, given: Any, seed: int, /) -> Verdict:
        """The verdict; the same for the same seed.

        Args:
            given: an `Experiment`, or of a challenge of films a `Filmed`.

        Raises:
            FlagdataError: the data do not do: this is filed as a refusal.
        """
        ...


def run(
    folder: ChallengeFolder,
    fitter: Fitter,
    *,
    seed: int,
    only: Sequence[str] = (),
    workers: int = 1,
    progress: Callable[[Filing], object] | None = None,
) -> list[Filing]:
    """File a verdict on every set that has none yet, and return those.

    Args:
        seed: each set gets its own from it.
        only: names of sets; none for all.
        workers: processes of one thread each, in which what makes challenges cannot be imported; or
            IN_THIS_PROCESS.
        progress: called with each verdict once it is filed.

    Raises:
        UnknownNameError: a set that is not there.
        CorruptError: data that are not those that were published.
    """
    waiting = [name for name in folder.chosen(tuple(only)) if not filed(folder, name)]
    done: list[Filing] = []

    def keep(filing: Filing) -> None:
        file(folder, filing)
        done.append(filing)
        if progress is not None:
            progress(filing)

    if workers == IN_THIS_PROCESS:
        for name in waiting:
            keep(_judge(folder, fitter, name, child_seed(seed, name)))
        return done
    failures: list[Future[Filing]] = []
    with ProcessPoolExecutor(
        workers, mp_context=get_context("spawn"), initializer=_prepare
    ) as pool:
        for future in as_completed(
            [pool.submit(_judge, folder, fitter, name, child_seed(seed, name)) for name in waiting]
        ):
            if future.exception() is None:
                keep(future.result())
            else:
                failures.append(future)
    for future in failures:
        future.result()  # raises the first; all that could be filed is
    return done


def run_films(
    folder: ChallengeFolder,
    fitter: ClosingTheLoopOnFilms,
    *,
    seed: int,
    only: Sequence[str] = (),
    progress: Callable[[Filing], object] | None = None,
) -> list[Filing]:
    """As `run`, of films: by all of the fitter's workers the first set that is answered, whose
    simulations all others take, then as many sets at a time, each read and judged by one
    process."""
    waiting = [name for name in folder.chosen(tuple(only)) if not filed(folder, name)]
    done: list[Filing] = []
    while waiting and not any(one.verdict for one in done):
        done += run(folder, fitter, seed=seed, only=(waiting.pop(0),), progress=progress)
    if waiting:
        single = replace(fitter, workers=1)
        done += run(
            folder, single, seed=seed, only=waiting, workers=fitter.workers, progress=progress
        )
    return done


def _judge(folder: ChallengeFolder, fitter: Fitter, name: str, seed: int) -> Filing:
    given = folder.films(name) if folder.filmed else folder.experiment(name)
    data = folder.manifest()["sets"][name]["data"]
    began = time.monotonic()
    try:
        verdict = fitter(given, seed)
    except FlagdataError as error:
        seconds = time.monotonic() - began
        return Filing(
            name=name,
            data=data,
            seed=seed,
            verdict=None,
            refusal=json_values(error),
            seconds=seconds,
        )
    seconds = time.monotonic() - began
    return Filing(
        name=name,
        data=data,
        seed=seed,
        verdict=verdict_json(verdict),
        refusal=None,
        seconds=seconds,
    )


class Barrier(MetaPathFinder):
    """Refuses to import what makes challenges."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if any(fullname == name or fullname.startswith(name + ".") for name in _APART):
            raise ImportError(f"{fullname} is not for fitters")
        return None


def _prepare() -> None:
    """Prepare a worker: nothing of the generator is within its reach."""
    single_threaded()
    sys.meta_path.insert(0, Barrier())
