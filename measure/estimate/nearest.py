"""The simulated clips of a lake that a model finds most like a film, to look at beside it.

The film's summary is that of conditioned pictures (`models.conditioning`), so these clips are conditioned likewise.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import pyarrow.compute as pc
import torch

from flagdata.arrays import Float32Array, UInt8Array
from flagdata.lake import Lake
from flagdata.record import Record
from flagdata.rng import stream
from flagdata.schema import Kind
from flagdata.timebase import NANOSECONDS
from models.estimator import Estimator
from models.training.conditioned import FitFilm

COMPARED = 48
"""Clips of the lake that are looked at, drawn at random: each costs a third of a second, most of it conditioning."""
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
    """Finds the `SHOWN` nearest of `COMPARED` simulated clips; also counts those compared, 0 where the lake has none.

    Args:
        summary: (dimension,) of the film, conditioned.
        without: the recording whose clips are left out, that of the film itself; None for none.
        advance: called after each clip with how many there are and 1.
    """
    count = model.front_end.frames
    long_enough = pc.field("seed").is_valid() & (pc.field("frame_count") >= count)
    clips = lake.rows({"kind": Kind.CLIP}, at=at).filter(long_enough)
    columns = ["artifact", "name", "object", "frame_first", "recording"]
    rows = [row for row in clips.select(columns).to_pylist() if row["recording"] != without]
    chosen = stream(seed, "nearest").permutation(len(rows))[:COMPARED].tolist()
    whitening = np.eye(len(summary)) if model.cloud is None else model.cloud.whitening
    neighbours: list[Neighbour] = []
    for index in chosen:
        row = rows[index]
        record = Record.open(lake.record_place(row["object"]))
        first = row["frame_first"]
        times = record.times(first, count)
        times = (times - times[0]) / NANOSECONDS
        frames = FitFilm.of(record.frames(first, count), times).frames
        embedding = model.summaries(model.inputs(frames[None]))[0].cpu().numpy()
        distance = float(np.linalg.norm(whitening @ (embedding.astype(np.float64) - summary)))
        neighbours.append(
            Neighbour(
                artifact=row["artifact"], name=row["name"], frames=frames, distance=distance, known=record.truth or {}
            )
        )
        neighbours = sorted(neighbours, key=lambda neighbour: neighbour.distance)[:SHOWN]
        if advance is not None:
            advance(len(chosen), 1)
    return tuple(neighbours), len(chosen)
