"""What a coarse mesh does to summaries: how far the fit's flags lie from those of a finer mesh and
shorter steps.

Of each recording some of the fit's own flags are simulated a second time, finer: the same cloth,
place, wind and turbulence, so that the difference is the mesh's and chaos's alone. The mean
difference corrects what the fit's flags show; by how much it differs from flag to flag beyond
chaos, and how well so few flags show it, are drawn and so become a part of every answer's scatter.
Slopes with the wind of so short a part say nothing of it: they have what was measured once (`python
-m tests.studies weighed`, sixteen flags on a mesh of 18 columns).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from flagdata.core.arrays import FloatArray, IntArray
from flagdata.core.rng import stream
from measure.cloth.design import Design, readings_of
from measure.cloth.flag_simulation import Discretisation, FlagBatch
from measure.cloth.observed_recording import Observed

FLAGS = 32
"""Of each recording that are simulated a second time. More estimate the correction better; each
takes `SLOWER` times as long as a flag of the fit."""
TOGETHER = 8
"""Of them in a batch."""
LASTING = 12.5
"""s of each recording in which they are."""
FINE = Discretisation(finer=1.5, diagonals=0, uneven=None, step=2e-3)
"""Twenty columns for the fit's twelve, in half of its longest step: beyond it sixteen flags showed
no more (decision 064)."""
SLOWER = 5.0
"""Times that a second of one of them takes as long as one of the fit's."""
FEWEST = 8
"""Flags below which no mean is taken."""


def effort(duration: float) -> float:
    """Seconds of the fit's flags that take as long as those of a recording [s] that are simulated a
    second time."""
    return SLOWER * FLAGS * min(LASTING, duration)


@dataclass(frozen=True, kw_only=True, eq=False)
class Correction:
    """Of the fit's summaries.

    Attributes:
        mean: (2, observable of `simulation.OBSERVED`) fine less coarse, of the means over windows
            and of the slopes with ln U, in the observables' units.
        sigma: (2, observable) standard deviation from flag to flag, with the error of the mean.
    """

    mean: FloatArray
    sigma: FloatArray

    def of(self, summaries: FloatArray, *, seed: int) -> FloatArray:
        """Summaries (n, 1 or 2, observable) with what a finer mesh would add to each."""
        size = summaries.shape[1]
        drawn = stream(seed, "calibrate", "numerics").standard_normal(summaries.shape)
        return summaries + self.mean[:size] + self.sigma[:size] * drawn


MEASURED = Correction(
    mean=np.array([
        [0.0027, 0.0011, -0.0038, -0.0359, -0.0153, 0.0082, -0.0024, -0.0051],
        [-0.0275, 0.0212, -0.0409, 0.0323, 0.0299, -0.0093, -0.0130, 0.0201],
    ]),
    sigma=np.array([
        [0.0085, 0.0042, 0.0296, 0.0365, 0.0273, 0.0150, 0.0130, 0.0037],
        [0.0494, 0.0257, 0.2287, 0.4161, 0.2548, 0.0958, 0.0648, 0.0400],
    ]),
)  # fmt: skip
"""Of sixteen flags in other winds, which includes that no two runs of a flag show the same
folds."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Finer:
    """Flags of a design that are simulated a second time.

    Attributes:
        indices: (flag,) among the design's simulations.
        batches: of them, in that order.
    """

    indices: IntArray
    batches: tuple[FlagBatch, ...]

    @classmethod
    def of(cls, design: Design) -> Finer:
        """Chooses among the cloths that damp as much as the step does: those that hardly damp would
        cost ten times as much."""
        candidates = np.flatnonzero(design.values()["damping"] >= (FINE.step or 0.0))
        chosen = stream(design.seed, "calibrate", "finer").choice(
            candidates, min(FLAGS, len(candidates)), replace=False
        )
        ordered = np.sort(chosen)
        parts = [ordered[first : first + TOGETHER] for first in range(0, len(ordered), TOGETHER)]
        until = min(LASTING, design.duration)
        return cls(
            indices=ordered,
            batches=tuple(
                replace(design.batch(part), until=until, discretisation=FINE) for part in parts
            ),
        )

    def correction(self, fine: FloatArray, coarse: FloatArray) -> Correction:
        """Estimates the correction from their readings.

        Args:
            fine: (flag, window, observable) of them.
            coarse: (simulation, window, observable) of all of the design's.
        """
        change = fine - coarse[self.indices][:, : fine.shape[1]]
        finite = np.isfinite(change)
        windows = finite.sum(axis=1)
        repeated = windows > 1
        count = repeated.sum(axis=0)
        change = np.where(finite & repeated[:, None], change, 0.0)
        means = change.sum(axis=1) / np.maximum(windows, 1)
        mean = means.sum(axis=0) / np.maximum(count, 1)
        between = np.where(repeated, np.square(means - mean), 0.0).sum(axis=0) / np.maximum(
            count - 1, 1
        )
        passing = np.where(finite & repeated[:, None], np.square(change - means[:, None]), 0.0).sum(
            axis=1
        )
        passing = (passing / np.maximum(windows * (windows - 1), 1)).sum(axis=0) / np.maximum(
            count, 1
        )
        variance = np.maximum(between - passing, 0.0) + between / np.maximum(count, 1)
        estimated = count >= FEWEST
        first = (
            np.where(estimated, mean, MEASURED.mean[0]),
            np.where(estimated, np.sqrt(variance), MEASURED.sigma[0]),
        )
        return Correction(
            mean=np.stack([first[0], MEASURED.mean[1]]),
            sigma=np.stack([first[1], MEASURED.sigma[1]]),
        )


def with_errors(
    observed: Observed, readings: FloatArray, correction: Correction, *, seed: int
) -> FloatArray:
    """Returns (simulation, summary) of readings (simulation, window, observable) with errors of
    numerics and of pixels."""
    summaries = correction.of(observed.projection.of(readings), seed=seed)
    return (summaries + observed.pixels(len(summaries), seed=seed)).reshape(len(summaries), -1)


def measure_correction(
    design: Design,
    readings: FloatArray,
    *,
    folder: Path,
    workers: int = 1,
    advance: Callable[[int], object] | None = None,
) -> Correction:
    """Measures how far a design's simulations lie from those of a finer mesh.

    Args:
        readings: (simulation, window, observable) of the design's.

    Raises:
        CorruptError: a kept batch that cannot be read.
    """
    finer = Finer.of(design)
    fine = readings_of(finer.batches, folder=folder, workers=workers, advance=advance)[:, 0]
    return finer.correction(fine, readings)
