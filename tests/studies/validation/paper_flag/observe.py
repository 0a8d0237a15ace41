"""From the files of a case to what was measured: the clips' motions and the tables' thresholds."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flagdata.core.arrays import AnyArray, FloatArray
from flagdata.core.provenance import file_hash
from flagdata.core.rng import stream
from flagdata.errors import NotFoundError
from tests.studies.validation.paper_flag import edge
from tests.studies.validation.paper_flag.cached import cached
from tests.studies.validation.paper_flag.edge import EdgeTrack, Seen, scatter, track_edge
from tests.studies.validation.paper_flag.evidence import Condition, Kind
from tests.studies.validation.paper_flag.recipe import Case, ClipSpec, Group
from tests.studies.validation.paper_flag.stretch import Stretch, stretch
from tests.studies.validation.paper_flag.thresholds import (
    Threshold,
    authors_thresholds,
    digitised_curves,
    speeds_by_length,
)
from tests.studies.validation.paper_flag.waves import Estimate, Waves, waves

_DRAWN = 16
_EVERY = 8
"""`waves` is given each so many-th column: 1.1 mm, far below a wave's length."""


@dataclass(frozen=True, kw_only=True)
class Clip:
    """What one clip shows.

    Attributes:
        frames: their number.
        shares: of all frames and columns that show each thing.
        scatter: median standard error of single heights [px].
        clamp: column of the clamp, None where it is not in view.
        tip: (5 %, 50 %, 95 %) of the last column seen.
        waves: in metres where the scale is known (whole sheets), in columns elsewhere.
        stretch: of whole sheets.
        lines: (line, column) heights over one cycle, at the columns of `waves`, above the clamp
            where it is in view: to be drawn; NaN where not seen.
        still: scatter of the height beside the clamp, over time [px]: an upper bound of the error
            that neighbouring columns share; None where it is not in view.
    """

    spec: ClipSpec
    frames: int
    shares: Mapping[Seen, float]
    scatter: float
    clamp: int | None
    tip: tuple[float, float, float]
    waves: Waves
    stretch: Stretch | None
    lines: FloatArray
    still: float | None


@dataclass(frozen=True, kw_only=True)
class Thresholds:
    """All tables of the case."""

    stop: tuple[Threshold, ...]
    onset: tuple[Threshold, ...]
    bistable: tuple[Threshold, ...]
    flutter: tuple[Threshold, ...]
    curves: Mapping[str, tuple[tuple[float, float], ...]]


@dataclass(frozen=True, kw_only=True)
class Observations:
    """Everything that was measured."""

    clips: tuple[Clip, ...]
    thresholds: Thresholds

    def conditions(self, case: Case, group: Group, kinds: Sequence[Kind]) -> tuple[Condition, ...]:
        """The conditions of a group, of these kinds; wave speeds and amplitudes only of clips with
        the whole sheet."""
        found = []
        for clip in self.clips:
            if clip.spec.group is group:
                parts = {Kind.FREQUENCY: clip.waves.frequency}
                if clip.spec.whole:
                    parts[Kind.WAVE] = clip.waves.speed
                    parts[Kind.AMPLITUDE] = clip.waves.amplitude.scaled(1 / case.sheet.length)
                found += [
                    _condition(kind, clip.spec.speed, parts[kind])
                    for kind in kinds
                    if kind in parts
                ]
        lengths = {
            Group.FIT: case.fit_lengths,
            Group.HELD_OUT: case.held_out_lengths,
            Group.OTHER: (),
        }[group]
        if Kind.STOP in kinds:
            found += [self.stop(length) for length in lengths]
        return tuple(found)

    def stop(self, length: float) -> Condition:
        """The median of the runs at this length, their range as interval.

        Raises:
            NotFoundError: the table has none.
        """
        speeds = [t.speed for t in self.thresholds.stop if abs(t.length - length) < 1e-6]
        if not speeds:
            raise NotFoundError(
                f"no stop speed at {length:g} m",
                where="stop speeds",
                fix="name a length of the table",
            )
        return Condition(
            kind=Kind.STOP,
            at=length,
            value=float(np.median(speeds)),
            low=min(speeds),
            high=max(speeds),
        )


def _condition(kind: Kind, at: float, estimate: Estimate) -> Condition:
    return Condition(kind=kind, at=at, value=estimate.value, low=estimate.low, high=estimate.high)


def measure_clip(track: EdgeTrack, spec: ClipSpec, case: Case) -> Clip:
    """The motion in one track.

    Raises:
        InputError: the line is seen too rarely, or for too few cycles.
    """
    columns = np.arange(track.height.shape[1], dtype=np.float64)[_EVERY // 2 :: _EVERY]
    ratio = case.row_scale / case.column_scale
    scale = case.column_scale if spec.whole else 1.0
    heights = -track.height[:, _EVERY // 2 :: _EVERY] * ratio  # rows run downwards
    clamp = still = None
    if spec.whole:
        clamp = int(np.flatnonzero((track.seen == Seen.LINE).mean(axis=0) > 0.5)[0])
        still = float(np.nanstd(track.height[:, clamp + 4]))
    seen = track.seen == Seen.LINE
    last = np.where(seen.any(axis=1), seen.shape[1] - 1 - seen[:, ::-1].argmax(axis=1), np.nan)
    tip = np.nanpercentile(last, [5, 50, 95])
    found = waves(track.time, (columns - (clamp or 0)) * scale, heights * scale)
    start = len(track.time) // 2
    one_cycle = start + np.arange(_DRAWN) / _DRAWN * track.rate / found.frequency.value
    drawn = heights[np.minimum(one_cycle.round().astype(int), len(heights) - 1)] * scale
    if clamp is not None:
        drawn = drawn + np.nanmedian(track.height[:, clamp]) * ratio * scale
    shown = np.isin((columns - (clamp or 0)) * scale, found.columns)
    return Clip(
        spec=spec,
        frames=len(track.time),
        shares={what: track.share(what) for what in Seen},
        scatter=float(np.nanmedian(scatter(track))),
        clamp=clamp,
        tip=(float(tip[0]), float(tip[1]), float(tip[2])),
        waves=found,
        lines=drawn[:, shown],
        stretch=stretch(track, stream(case.seed, "stretch", spec.name)) if spec.whole else None,
        still=still,
    )


def observe(case: Case, data: Path, *, keep: Path | None = None) -> Observations:
    """Track and measure all clips of a case and read its tables.

    Args:
        keep: folder of tracks; None keeps none.

    Raises:
        NotFoundError: a file of the case is not there.
        FlagdataError: as `track_edge` and `measure_clip`.
    """
    thresholds = read_thresholds(case, data)
    clips = []
    for spec in case.clips:
        path = data / case.folder / f"{spec.name}{case.suffix}"
        if not path.is_file():
            raise NotFoundError(
                "no such clip",
                where=str(path),
                fix="give the folder that holds video/ and flutter/",
            )
        clips.append(measure_clip(_tracked(path, case, keep), spec, case))
    return Observations(clips=tuple(clips), thresholds=thresholds)


def _tracked(path: Path, case: Case, keep: Path | None) -> EdgeTrack:
    def make() -> dict[str, AnyArray]:
        track = track_edge(path, true_rate=case.true_rate)
        return {
            "time": track.time,
            "height": track.height,
            "width": track.width,
            "seen": track.seen,
        }

    arrays = cached(keep, {"clip": file_hash(path), "true_rate": case.true_rate}, (edge,), make)
    return EdgeTrack(
        time=arrays["time"], height=arrays["height"], width=arrays["width"], seen=arrays["seen"]
    )


def read_thresholds(case: Case, data: Path) -> Thresholds:
    """The tables of a case.

    Raises:
        NotFoundError, InputError: see `tests.studies.validation.paper_flag.thresholds`.
    """
    bistable, flutter = authors_thresholds(data / case.tables["authors"])
    return Thresholds(
        stop=speeds_by_length(data / case.tables["stop"], column="Ustop"),
        onset=speeds_by_length(data / case.tables["onset"], column="Uonset"),
        bistable=bistable,
        flutter=flutter,
        curves=digitised_curves(data / case.tables["curve"]),
    )


def median_by_length(thresholds: Sequence[Threshold]) -> tuple[tuple[float, float], ...]:
    """(length, median speed), by rising length."""
    lengths = sorted({t.length for t in thresholds})
    return tuple(
        (h, float(np.median([t.speed for t in thresholds if math.isclose(t.length, h)])))
        for h in lengths
    )
