"""The simulated clips of a lake that a model finds most like a film, to look at beside it.

The film's summary is that of conditioned pictures (`models.conditioning`), so these clips are
conditioned likewise.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import pyarrow.compute as pc
import torch

from flagdata.core.arrays import Float32Array, UInt8Array
from flagdata.core.rng import stream
from flagdata.core.schema import Kind
from flagdata.lake import Lake
from flagdata.record import Record
from flagdata.timebase import NANOSECONDS
from models.maps.frontend import FrontEnd
from models.trained.estimator import Estimator
from models.training.conditioned_clips import FitFilm
from models.training.timed_film import LEAST_RATE

COMPARED = 48
"""Clips of the lake that are looked at, drawn at random: each costs a third of a second, most of it
conditioning."""
SHOWN = 3


@dataclass(frozen=True, kw_only=True, eq=False)
class Neighbour:
    """A simulated clip.

    Attributes:
        artifact, name: of the clip.
        frames: (frames, height, width) gray, conditioned.
        distance: of the summaries, in standard deviations of the training clips.
        known: what its simulation was made with.
    """

    artifact: str
    name: str
    frames: UInt8Array
    distance: float
    known: Mapping[str, float]


@torch.no_grad()
def nearest(
    lake: Lake,
    model: Estimator,
    summary: Float32Array,
    *,
    without: str | None,
    at: str | None,
    seed: int,
    advance: Callable[[int, int], None] | None = None,
) -> tuple[tuple[Neighbour, ...], int]:
    """Finds the `SHOWN` nearest of `COMPARED` simulated clips; also counts those compared, 0 where
    the lake has none.

    Args:
        summary: (dimension,) of the film, conditioned.
        without: the recording whose clips are left out, that of the film itself; None for none.
        advance: called after each clip with how many there are and 1.
    """
    clips = lake.rows({"kind": Kind.CLIP}, at=at).filter(pc.field("seed").is_valid())
    columns = ["artifact", "name", "object", "frame_first", "recording"]
    rows = [row for row in clips.select(columns).to_pylist() if row["recording"] != without]
    chosen = stream(seed, "nearest").permutation(len(rows))[:COMPARED].tolist()
    whitening = np.eye(len(summary)) if model.cloud is None else model.cloud.whitening
    neighbours: list[Neighbour] = []
    compared = 0
    for index in chosen:
        row = rows[index]
        record = Record.open(lake.record_place(row["object"]))
        frames = _clip(record, row["frame_first"], model.front_end)
        if frames is not None:
            compared += 1
            embedding = model.summaries(model.inputs(frames[None]))[0].cpu().numpy()
            distance = float(np.linalg.norm(whitening @ (embedding.astype(np.float64) - summary)))
            found = Neighbour(
                artifact=row["artifact"],
                name=row["name"],
                frames=frames,
                distance=distance,
                known=record.truth or {},
            )
            neighbours = sorted([*neighbours, found], key=lambda neighbour: neighbour.distance)[
                :SHOWN
            ]
        if advance is not None:
            advance(len(chosen), 1)
    return tuple(neighbours), compared


def _clip(record: Record, first: int, front_end: FrontEnd) -> UInt8Array | None:
    """Conditions the clip that a front end takes from a frame of a record on, or from as early as
    the film has to be entered; None where the film is shorter or slower than that."""
    times = (record.frame_times - record.frame_times[0]) / NANOSECONDS
    lasting = (front_end.frames - 1) / front_end.rate
    latest = int(np.searchsorted(times, times[-1] - lasting + 1e-6, side="right")) - 1
    if latest < 0 or len(times) - 1 < LEAST_RATE * front_end.rate * times[-1]:
        return None
    begin = min(first, latest)
    end = min(int(np.searchsorted(times, times[begin] + lasting)) + 1, len(times))
    film = FitFilm.of(record.frames(begin, end - begin), times[begin:end])
    return film.clip(0, front_end.frames, front_end.rate)[0]
