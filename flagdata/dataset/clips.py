"""Clips: a recording cut into runs of consecutive frames, each a catalog row with its ground
truth."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np

from flagdata.core import provenance
from flagdata.core.arguments import check_arguments
from flagdata.core.clock_model import ClockModel
from flagdata.core.schema import CLIP_FRAMES, TRUTH_WINDOW, Kind
from flagdata.dataset.truth import TruthSeries, WindTruth, over_ground
from flagdata.errors import InputError, UsageError
from flagdata.lake import Artifact
from flagdata.record import Record
from flagdata.record.signals import Instants
from flagdata.timebase import NANOSECONDS

FRAME_GAP = 1.5  # frame periods; a clip never spans a longer step
TRUTH_SPEED = (
    "wind_speed"  # the truth parameter of a simulated record that is its ground truth [m/s]
)


def runs(times: Instants, frames: int) -> Iterator[int]:
    """Yields the first indices of the non-overlapping clips of `frames` consecutive frames.

    Args:
        times: (n,) instants of the frames [UTC ns], increasing.
        frames: length of a clip. A step above 1.5 frame periods (median steps) ends a run, and its
            last frames, those that do not fill a clip, are left out.

    Raises:
        UsageError: fewer than one frame a clip.
        InputError: instants that do not increase.
    """
    if frames < 1:
        raise UsageError(f"clips of {frames} frames", fix="give at least 1")
    steps = np.diff(times)
    if np.any(steps <= 0):
        where = f"frame {int(np.argmax(steps <= 0)) + 1}"
        raise InputError(
            "frame times do not increase", where=where, fix="ingest the camera file anew"
        )
    breaks = np.nonzero(steps > FRAME_GAP * np.median(steps))[0] + 1 if len(steps) else steps
    bounds = [0, *breaks.tolist(), len(times)]
    for first, last in itertools.pairwise(bounds):
        yield from range(first, last - frames + 1, frames)


@check_arguments
def clip_rows(
    record: Record, recording: Artifact, *, frames: int = CLIP_FRAMES, window: float = TRUTH_WINDOW
) -> list[Artifact]:
    """Cuts a recording into clips, in order, with the mean wind over the window before each one's
    end.

    A clip whose window is thin, stale or empty is kept as a row: its numbers say so, and `pairs`
    refuses it by its tolerance. A simulated record states its wind as the truth parameter
    "wind_speed" [m/s]; that is then exact.

    Args:
        record: frames, wind and truth on the common clock.
        recording: the artifact of the record; its identity, session, seed, clock model and object
            are passed on.
        window: of the ground truth [s]; it stands in each clip's recipe.

    Raises:
        UsageError, InputError: see `runs`; a window that is no length of time.
    """
    times = record.frame_times
    series = truth_series(record)
    clock = ClockModel.from_json(recording.clock_model) if recording.clock_model else None
    truth_values = record.truth or {}
    parameters = recording.parameters or (
        provenance.canonical(truth_values) if truth_values else None
    )
    rows: list[Artifact] = []
    for first in runs(times, frames):
        last = first + frames - 1
        end = int(times[last])
        sigma = (
            float(clock.sigma(record.device_frame_times[last])) if clock else recording.clock_sigma
        )
        if sigma is None and recording.seed is not None:
            sigma = 0.0  # a simulation has one clock
        truth = clip_truth(
            series,
            end,
            stated_speed=truth_values.get(TRUTH_SPEED),
            clock_sigma=sigma,
            window=window,
        )
        start = int(times[first])
        rows.append(
            _row(
                recording,
                truth,
                first=first,
                frames=frames,
                window=window,
                start=start,
                end=end,
                clock_sigma=sigma,
                parameters=parameters,
            )
        )
    return rows


def truth_series(record: Record) -> TruthSeries | None:
    """Reads the record's wind over ground; `None` where it has none, such as the log of a moving
    platform."""
    series = record.wind()
    return (
        TruthSeries.of(series) if series is not None and over_ground(series) is not None else None
    )


def clip_truth(
    series: TruthSeries | None,
    end: int,
    *,
    stated_speed: float | None,
    clock_sigma: float | None,
    window: float,
) -> WindTruth:
    """Computes the ground truth at a clip's end: `stated_speed` exactly where a simulation states
    it, else the mean of the series.

    Args:
        clock_sigma: [s]; `None` where nobody knows, and the ground truth's σ is then unknown too.
    """
    if stated_speed is not None:
        return WindTruth.exact(stated_speed)
    if series is None:
        return WindTruth.missing(staleness=math.inf)
    if clock_sigma is None:
        truth = series.before(end, window=window)
        return replace(
            truth, sigma=math.nan, sigma_clock=math.nan, flags=(*truth.flags, "clock-sigma-unknown")
        )
    return series.before(end, window=window, clock_sigma=clock_sigma)


def _row(
    recording: Artifact,
    truth: WindTruth,
    *,
    first: int,
    frames: int,
    window: float,
    start: int,
    end: int,
    clock_sigma: float | None,
    parameters: str | None,
) -> Artifact:
    day = datetime.fromtimestamp(start / NANOSECONDS, tz=UTC).date().isoformat()
    return Artifact(
        kind=Kind.CLIP,
        name=recording.name,
        branch=recording.branch,
        object=recording.object,
        object_bytes=recording.object_bytes,
        parents=(recording.id,),
        recipe={"frames": frames, "window": window},
        seed=recording.seed,
        recording=recording.id,
        session=recording.session,
        dataset=recording.dataset,
        side=recording.side,
        day=None if recording.seed is not None else day,
        start=start,
        end=end,
        frame_first=first,
        frame_count=frames,
        rate=recording.rate,
        wind=_finite_or_none(truth.wind),
        wind_sigma=_finite_or_none(truth.sigma),
        wind_coverage=truth.coverage,
        wind_staleness=_finite_or_none(truth.staleness),
        clock_method=recording.clock_method,
        clock_offset=recording.clock_offset,
        clock_drift=recording.clock_drift,
        clock_sigma=clock_sigma,
        clock_model=recording.clock_model,
        parameters=parameters,
        quality=sorted({*recording.quality, *truth.flags}),
    )


def _finite_or_none(value: float) -> float | None:
    """Returns a value as the catalog writes it: null for what nobody knows, not NaN or infinity."""
    return value if math.isfinite(value) else None
