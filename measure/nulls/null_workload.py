"""How long simulating null recordings and judging tracked recordings will take."""

from __future__ import annotations

from collections.abc import Sequence

from flagdata.core.workload import announce_work
from measure.forecasting.segments import Cut
from measure.nulls import bank as banks
from measure.nulls.null_plan import NullOptions
from measure.nulls.null_simulation import SETTLE, NullBatch
from measure.trajectories.trajectory import Trajectory

_PACE = 400.0
"""Vertices of the fitted mesh times seconds of one null recording that one core simulates, and
takes the statistics of,
in a second: four recordings of 9.4 s beside a mesh of 176 took 16 and 20 s."""
_JUDGED = 2.0
"""s of one core for a second of a recording: 96 sets of three recordings of 12 s took 74 s in the
median."""


def of_batches(batches: Sequence[NullBatch], *, workers: int) -> str:
    """Announces what is simulated for a bank, and for about how long."""
    seconds = [len(batch.speeds) * (SETTLE + batch.duration) for batch in batches]
    work = sum(
        lasting * batch.specimen.mesh.vertex_count
        for lasting, batch in zip(seconds, batches, strict=True)
    )
    return _simulated_words(sum(seconds), work, workers=workers)


def of_recordings(
    recordings: Sequence[Trajectory],
    vertices: int,
    options: NullOptions,
    *,
    sets: int = 1,
    workers: int,
) -> str:
    """Announces what is simulated for verdicts where no bank is given, and for about how long; with
    one, what is judged.

    Args:
        vertices: of the mesh that is fitted.
        sets: of such recordings, each with a verdict.
        workers: processes that share the work.
    """
    if options.bank is not None:
        judging = (
            sets
            * _JUDGED
            * sum(len(recording.positions) / recording.rate for recording in recordings)
        )
        return announce_work(
            "judging the recordings" if sets == 1 else f"judging {sets} sets of recordings",
            judging,
            workers=workers,
        )
    cuts = [
        (Cut.of(recording.rate, len(recording.positions)), len(recording.positions))
        for recording in recordings
    ]
    lasting = cuts[0][0].lasting(
        banks.segments_of_each(sum(cut.segments(frames) for cut, frames in cuts))
    )
    seconds = sets * options.nulls * (SETTLE + lasting)
    return _simulated_words(seconds, seconds * vertices, workers=workers)


def _simulated_words(seconds: float, work: float, *, workers: int) -> str:
    return announce_work(
        f"simulating null recordings of {seconds / 60:.0f} minutes in all",
        work / _PACE,
        workers=workers,
        kept="what was simulated before is kept and taken up",
    )
