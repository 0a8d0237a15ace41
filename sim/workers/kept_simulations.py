"""Simulations that are kept, each batch in a file named by the hash of all that shapes it: what is
there is not simulated anew, and a run that was stopped goes on where it was."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from flagdata.core.arrays import AnyArray
from flagdata.core.console import say_beside_bars
from flagdata.core.files.outputs import rewrite
from flagdata.core.provenance import canonical, digest
from sim.workers.connect import connect_workers


class Simulatable(Protocol):
    """Cloths that are simulated together and kept as one file."""

    @property
    def effort(self) -> int:
        """About how much work it is, in a unit that all batches of a kind share."""
        ...

    def content(self) -> Mapping[str, Any]:
        """Returns all that its arrays depend on, as JSON values."""
        ...

    def arrays(self) -> Mapping[str, AnyArray]:
        """Simulates it; what is kept of it."""
        ...


def kept_file(batch: Simulatable, folder: Path) -> Path:
    """Returns the file in which a batch is kept."""
    return folder / f"{digest(canonical(dict(batch.content())))[:32]}.npz"


def simulate_missing(
    batches: Sequence[Simulatable],
    *,
    folder: Path,
    workers: int = 1,
    scheduler: str | None = None,
    advance: Callable[[int], object] | None = None,
) -> list[Path]:
    """Simulates the batches that a folder lacks; returns the file of each.

    Those that take longest come first, so that no worker is left alone with one.

    Args:
        workers: processes on this machine.
        scheduler: address of a Dask scheduler, whose workers are taken instead.
        advance: called with the effort of what is there, then of each batch as it is made.

    Raises:
        NotFoundError: no scheduler answers there, or it has no workers.
        WorkerError: workers kept dying, or are gone.
    """
    paths = [kept_file(batch, folder) for batch in batches]
    efforts = [batch.effort for batch in batches]
    missing = [number for number, path in enumerate(paths) if not path.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    if advance is not None and len(missing) < len(batches):
        advance(sum(efforts) - sum(efforts[number] for number in missing))
    if missing:
        missing.sort(key=lambda number: -efforts[number])
        with connect_workers(
            scheduler, workers=min(workers, len(missing)), say=say_beside_bars
        ) as pool:
            for number, made in pool.results(
                (_simulate, (batches[number], number)) for number in missing
            ):
                rewrite(paths[number], made)
                if advance is not None:
                    advance(efforts[number])
    return paths


def _simulate(batch: Simulatable, number: int) -> tuple[int, bytes]:
    """Simulates a batch; returns its number and the bytes of its file."""
    buffer, kept = BytesIO(), dict[str, Any](batch.arrays())
    np.savez_compressed(buffer, **kept)
    return number, buffer.getvalue()
