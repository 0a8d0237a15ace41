"""What is simulated for a recording: draws of cloth, place and anemometer, in batches, each kept under its hash.

An interrupted calibration goes on where it was, and another one of the same film, log and seed simulates nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from io import BytesIO
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from flagdata.arrays import FloatArray, IntArray, read_arrays
from flagdata.durable import put_if_absent
from flagdata.errors import CorruptError
from flagdata.provenance import canonical, digest
from flagdata.rng import child_seed, stream
from measure.calibrate.prior import (
    AZIMUTH,
    CLOTH,
    DISTANCE,
    ELEVATION,
    FABRIC,
    NUISANCES,
    STRETCHING,
    Uncertain,
    clock_error,
    draws,
)
from measure.calibrate.simulation import BATCH, Batch, Flag
from measure.calibrate.wind import Log
from measure.workers import single_threaded

FAR = 15.0
"""m from which a flag is filmed where the user gives no distance: beyond some flag lengths it hardly matters."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Design:
    """All simulations for one recording.

    Attributes:
        flag: that was filmed.
        log: of the wind, from the film's first frame on.
        duration: of the film, a whole number of windows [s].
        azimuth, elevation: of the camera's axis, as far as they are known.
        count: of simulations.
        seed: of all draws.
        distance: of the camera [m].
        recording: what recordings of one cloth differ by: their simulations are of the same cloths, each recording's in
            turbulence of its own.
        place: the same of places and anemometers, which recordings may share.
        fabric: which measured tables the cloths have.
    """

    flag: Flag
    log: Log
    duration: float
    azimuth: Uncertain = AZIMUTH
    elevation: Uncertain = ELEVATION
    count: int = 128
    seed: int = 0
    distance: float = FAR
    recording: str = ""
    place: str = ""
    fabric: Uncertain = FABRIC

    @property
    def cloth(self) -> tuple[Uncertain, ...]:
        """What differs among the cloths."""
        return (*CLOTH, STRETCHING, self.fabric)

    def quantities(self) -> tuple[Uncertain, ...]:
        """What differs among the simulations."""
        known = self.log.distance is not None
        return (
            *self.cloth,
            *NUISANCES,
            self.azimuth,
            self.elevation,
            *(() if known else (DISTANCE,)),
            *((clock_error(self.log.clock),) if self.log.clock else ()),
        )

    def values(self) -> Mapping[str, FloatArray]:
        """Name → (count,), by ascending damping, so that batches can be simulated in long steps."""
        # In another order in each place: two scramblings of a Sobol sequence are correlated, row by row.
        own = child_seed(self.seed, "calibrate", "place", self.place)
        order = stream(own, "calibrate", "order").permutation(self.count)
        there = draws(self.quantities(), self.count, seed=own, name="design")
        drawn = {name: values[order] for name, values in there.items()}
        drawn |= draws(self.cloth, self.count, seed=self.seed, name="cloths")
        if self.log.distance is not None:
            drawn[DISTANCE.name] = np.full(self.count, self.log.distance)
        order = np.argsort(drawn["damping"], kind="stable")
        return {name: own[order] for name, own in drawn.items()}

    def batches(self) -> list[Batch]:
        """In the order of `values`."""
        return [
            self.batch(np.arange(first, min(first + BATCH, self.count), dtype=np.int64))
            for first in range(0, self.count, BATCH)
        ]

    def batch(self, which: IntArray) -> Batch:
        """Some of the simulations, by their places in `values`."""
        values = {name: own[which] for name, own in self.values().items()}
        view = [values.pop("azimuth"), values.pop("elevation"), np.full(len(which), self.distance)]
        return Batch(
            flag=self.flag,
            log=self.log,
            duration=self.duration,
            values=values,
            places=np.stack(view, axis=1)[:, None],
            seeds=tuple(child_seed(self.seed, "calibrate", "flag", self.recording, int(place)) for place in which),
        )

    def damped(self) -> IntArray:
        """Places of the simulations in the longest steps that the design has."""
        own = self.batches()
        steps = [batch.step or 0.0 for batch in own]
        sizes = [len(batch.seeds) for batch in own]
        return np.flatnonzero(np.repeat(np.array(steps) == max(steps), sizes))


def simulated(
    design: Design, *, folder: Path, workers: int = 1, advance: Callable[[int], object] | None = None
) -> FloatArray:
    """(simulation, window, observable) in the order of the design's values; NaN where a flag diverged.

    Args:
        folder: where batches are kept.
        advance: called with the number of flags that were simulated or found.

    Raises:
        CorruptError: a kept batch that cannot be read.
    """
    return read(design.batches(), folder=folder, workers=workers, advance=advance)[:, 0]


def read(
    batches: Sequence[Batch], *, folder: Path, workers: int = 1, advance: Callable[[int], object] | None = None
) -> FloatArray:
    """(flag, place, window, observable) of batches, in order; those that the folder lacks are simulated. As
    `simulated`."""
    paths = [folder / f"{digest(canonical(dict(batch.content())))[:32]}.npz" for batch in batches]
    missing = [place for place, path in enumerate(paths) if not path.exists()]
    if advance is not None and len(missing) < len(batches):
        advance(sum(len(batch.seeds) for place, batch in enumerate(batches) if place not in set(missing)))
    folder.mkdir(parents=True, exist_ok=True)
    if missing:
        with ProcessPoolExecutor(
            min(workers, len(missing)), mp_context=get_context("spawn"), initializer=single_threaded
        ) as pool:
            running = {pool.submit(_make, batches[place], paths[place]): place for place in missing}
            for done in as_completed(running):
                done.result()
                if advance is not None:
                    advance(len(batches[running[done]].seeds))
    return np.concatenate([_read(path) for path in paths])


def _make(batch: Batch, path: Path) -> None:
    buffer = BytesIO()
    np.savez_compressed(buffer, readings=batch.read())
    put_if_absent(path, buffer.getvalue())


def _read(path: Path) -> FloatArray:
    again = "delete the file: it is made anew"
    content = read_arrays(path, what="a file of kept simulations", fix=again)
    try:
        return np.asarray(content["readings"], dtype=np.float64)
    except (ValueError, KeyError, TypeError) as error:
        raise CorruptError(f"kept simulations cannot be read: {error}", where=str(path), fix=again) from None
