"""Banks of null recordings: the statistics of null experiments, kept by the hash of all that shapes
each.

A bank is of one design: one nominal cloth, its markers, their noise and the rate. It serves all
recordings of that design, and none of another: of 33 sets of one effect a test by 48 kinds of their
own design rejected 20, by 45 kinds of seven cloths, three noises and two rates 5.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from flagdata.core.arrays import AnyArray, FloatArray, read_arrays
from flagdata.core.rng import child_seed, stream
from flagdata.errors import CorruptError, NotFoundError, UsageError
from measure.forecasting.calibrated_parameters import Calibration
from measure.forecasting.observer import Forecaster
from measure.forecasting.regressors import Column, EffectColumn, columns, names
from measure.forecasting.segments import Segments
from measure.inference.random_effect import Nulls
from measure.nulls import stiffness
from measure.nulls.free_run import mistaken, settled_off
from measure.nulls.null_simulation import NullBatch
from measure.nulls.reference import NullBank
from measure.probes.statistics import Statistics, statistics
from measure.probes.wind_course import Course
from measure.trajectories.attachment_anchors import as_seen
from measure.trajectories.trajectory import Specimen, Trajectory
from sim.integrate.split import SplitEuler
from sim.workers import kept_file, simulate_missing

WINDS = 4
"""Recordings of a batch: one cloth in so many winds, one experiment of one kind of numerics. What
experiments leave differs by their numerics more than by the cloth, and only kinds count in the
test, so that each has one cloth."""
_VERSION = 7
"""Raised whenever the arrays of a batch mean something else; 2: one cloth a batch, the damping by
its logarithm;
3: sensitivities of how cloth bends in double precision; 4: what recordings settle at; 5: whether
cloths are carried;
6: the inertia of air at the ends of a cloth; 7: each batch named by the hash of all that shapes it,
in place of its number."""
_SEGMENTS = (
    "recording",
    "r",
    "response",
    "error",
    "marker_error",
    "lines",
    "speeds",
    "calibration",
    "noise",
    "period",
    "cloth",
    "turned",
    "turning",
    "moment",
    "course",
    "course_curvature",
    "settled",
)
"""Arrays with a row for each segment."""
_SINGLE = ("duration", "anchors_told", "carried")
"""Arrays of one value for the batch."""
_AREA_WEIGHT, _BENDING, _DAMPING = (0.8, 1.25), (0.2, 5.0), (0.25e-3, 40e-3)
Progress = Callable[[int], object]


def segments_of_each(segments: int) -> int:
    """Counts the segments of each recording of a null experiment, for data of so many in all."""
    return max(2, math.ceil(segments / WINDS))


def around(slowest: float, fastest: float) -> tuple[float, float]:
    """Computes the winds of nulls for data of such winds [m/s]: somewhat beyond them."""
    return 0.9 * slowest, 1.1 * fastest


def prior_batch(
    specimen: Specimen,
    *,
    markers: FloatArray,
    rate: float,
    duration: float,
    noise: float,
    speeds: tuple[float, float],
    seed: int,
) -> NullBatch:
    """Draws a null experiment over the priors: one cloth in four winds, one from each quarter of
    `speeds`.

    Density and bending are log-uniform about the nominal ones, damping log-uniform, the other
    stiffness as `stiffness.drawn` has it.
    """
    rng = stream(seed, "null", "prior")
    cloth = Calibration(
        area_weight=_log(rng, _AREA_WEIGHT),
        bending=_log(rng, _BENDING),
        damping=_log(rng, _DAMPING),
    )
    shares = (np.arange(WINDS) + rng.random(WINDS)) / WINDS
    return NullBatch(
        specimen=specimen,
        markers=markers,
        rate=rate,
        duration=duration,
        noise=noise,
        calibrations=(cloth,) * WINDS,
        stiffness=stiffness.drawn(rng),
        speeds=tuple(float(u) for u in speeds[0] + (speeds[1] - speeds[0]) * shares),
        seed=child_seed(seed, "null", "batch"),
    )


def _log(rng: np.random.Generator, span: tuple[float, float]) -> float:
    return float(np.exp(rng.uniform(math.log(span[0]), math.log(span[1]))))


def evaluate(batch: NullBatch, numerics: int, along: Sequence[Column]) -> tuple[Nulls, float]:
    """Simulates a batch and takes its statistics along columns, each recording's at the calibration
    that it was simulated with, as those of data are taken at the fitted one; with the duration of a
    segment [s]."""
    recordings = batch.simulate()
    segments = Segments.of(recordings).tied(_anchors(batch, recordings))
    forecaster = Forecaster(specimen=batch.specimen, markers=batch.markers, integrator=SplitEuler())
    calibrations = [batch.calibrations[recording] for recording in segments.recording]
    measured = statistics(forecaster, segments, calibrations, along)
    measured = replace(
        measured, settled=settled_off(recordings, mistaken(batch))[measured.recording]
    )
    cloths = np.array([c.steps_from(Calibration()) for c in batch.calibrations])
    nulls = Nulls(
        statistics=measured,
        speeds=np.array(batch.speeds)[measured.recording],
        calibration=cloths[measured.recording],
        numerics=np.full(len(measured.recording), numerics),
        noise=np.full(len(measured.recording), batch.noise),
        period=np.full(len(measured.recording), segments.period),
        cloth=np.full(len(measured.recording), batch.specimen.material.fingerprint),
    )
    return nulls, segments.duration


def _anchors(batch: NullBatch, recordings: Sequence[Trajectory]) -> list[FloatArray]:
    """Computes anchors (held, 3) for each recording [m]; where they are not given, taken from all
    recordings of its cloth."""
    cloths: dict[Calibration, list[Trajectory]] = {}
    for cloth, recording in zip(batch.calibrations, recordings, strict=True):
        cloths.setdefault(cloth, []).append(recording)
    anchors = {
        cloth: as_seen(batch.specimen, of_cloth).anchors for cloth, of_cloth in cloths.items()
    }
    return [anchors[cloth] for cloth in batch.calibrations]


@dataclass(frozen=True, kw_only=True, eq=False)
class BankedNulls:
    """A null experiment as it is kept: its statistics along all columns.

    Attributes:
        batch: that is simulated.
    """

    batch: NullBatch

    @property
    def effort(self) -> int:
        """See `NullBatch.effort`."""
        return self.batch.effort

    def content(self) -> Mapping[str, Any]:
        """Returns all that its statistics depend on."""
        along = [
            [column.name, column.step, dict(column.shapes), column.revision]
            if isinstance(column, EffectColumn)
            else [column.name]
            for column in columns()
        ]
        return {"nulls": _VERSION, "columns": along, "batch": self.batch.identity()}

    def arrays(self) -> Mapping[str, AnyArray]:
        """Simulates it and takes its statistics, each with a row for each segment."""
        nulls, duration = evaluate(self.batch, 0, columns())
        measured = nulls.statistics
        if (
            measured.lines is None
            or measured.turning is None
            or measured.course is None
            or measured.settled is None
        ):
            raise UsageError(
                "the batch has no spectra, moments, courses or settled quantities",
                where="null bank",
                fix="take statistics by `evaluate`",
            )
        return {
            "version": np.array(_VERSION),
            "columns": np.array(names()),
            "recording": measured.recording,
            "r": measured.r,
            "response": measured.response,
            "error": measured.error,
            "marker_error": measured.marker_error,
            "lines": measured.lines,
            "speeds": nulls.speeds,
            "calibration": nulls.calibration,
            "noise": nulls.noise,
            "period": nulls.period,
            "cloth": nulls.cloth,
            "duration": np.array(duration),
            "anchors_told": np.array(self.batch.specimen.anchors_given),
            "carried": np.array(bool(self.batch.tracks)),
            "turned": measured.turning.r,
            "turning": measured.turning.response,
            "moment": measured.turning.error,
            "course": measured.course.score,
            "course_curvature": measured.course.curvature,
            "settled": measured.settled,
        }


def build(
    folder: Path,
    batches: Sequence[NullBatch],
    *,
    workers: int = 1,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> None:
    """Evaluates the batches that the folder lacks; as `sim.workers.simulate_missing`.

    Args:
        progress: called with the effort of the batches that are done.
    """
    simulate_missing(
        [BankedNulls(batch=batch) for batch in batches],
        folder=folder,
        workers=workers,
        scheduler=scheduler,
        advance=progress,
    )


def _content(path: Path) -> Mapping[str, np.ndarray]:
    """Reads the contents of a file of a bank, each of the batch's segments in all its arrays."""
    rebuild = "delete it and build the bank again"
    content = read_arrays(path, what="a batch of nulls", fix=rebuild)
    if not set(content) >= {*_SEGMENTS, *_SINGLE, "version", "columns"}:
        raise CorruptError(
            "it lacks arrays of this version", where=str(path), fix="build the bank again"
        )
    if content["version"].ravel().tolist() != [_VERSION]:
        raise CorruptError(
            "its arrays are those of another version",
            where=str(path),
            fix="build the bank again, into a folder that is not there yet",
        )
    if tuple(content["columns"].ravel().tolist()) != names():
        raise CorruptError(
            "its columns are not those of this version", where=str(path), fix="build the bank again"
        )
    segments = content["recording"].size
    kinds = {name: "U" if name == "cloth" else "biuf" for name in _SEGMENTS}
    wrong = [
        name
        for name, kind in kinds.items()
        if content[name].dtype.kind not in kind or content[name].shape[:1] != (segments,)
    ]
    single = all(content[name].size == 1 and content[name].dtype.kind in "biuf" for name in _SINGLE)
    if wrong or not segments or not single:
        raise CorruptError(
            f"its arrays do not fit one another: {', '.join(wrong or ('recording', *_SINGLE))}",
            where=str(path),
            fix=rebuild,
        )
    return content


def files(folder: Path) -> list[Path]:
    """Lists the batches of a folder."""
    return sorted(folder.glob("*.npz"))


def load(folder: Path, *, words: str, batches: Sequence[NullBatch] | None = None) -> NullBank:
    """Loads the bank of a folder.

    Args:
        batches: of the folder, those that are taken; None for all that it has.

    Raises:
        NotFoundError: no batches there.
        CorruptError: a file that cannot be read, or of other columns.
        InputError: too few batches.
    """
    paths = (
        files(folder)
        if batches is None
        else [kept_file(BankedNulls(batch=batch), folder) for batch in batches]
    )
    if not paths:
        raise NotFoundError(
            "the folder holds no null recordings", where=str(folder), fix="build the bank first"
        )
    parts: list[Nulls] = []
    durations: set[float] = set()
    anchors_given: set[bool] = set()
    carried: set[bool] = set()
    count = 0
    for kind, path in enumerate(paths):
        content = _content(path)
        measured = Statistics(
            recording=content["recording"] + count,
            r=content["r"],
            response=content["response"],
            error=content["error"],
            marker_error=content["marker_error"],
            lines=content["lines"],
            turning=Statistics(
                recording=content["recording"] + count,
                r=content["turned"],
                response=content["turning"],
                error=content["moment"],
                marker_error=content["moment"][:, None],
            ),
            course=Course(score=content["course"], curvature=content["course_curvature"]),
            settled=content["settled"],
        )
        numerics = np.full(len(measured.r), kind)
        parts.append(
            Nulls(
                statistics=measured,
                speeds=content["speeds"],
                calibration=content["calibration"],
                numerics=numerics,
                noise=content["noise"],
                period=content["period"],
                cloth=content["cloth"],
            )
        )
        durations.add(round(float(content["duration"]), 1))
        anchors_given.add(bool(content["anchors_told"]))
        carried.add(bool(content["carried"]))
        count = int(measured.recording.max()) + 1
    if len(durations) > 1 or len(anchors_given) > 1 or len(carried) > 1:
        lengths = ", ".join(f"{d:g} s" for d in sorted(durations))
        raise CorruptError(
            f"the bank has segments of {lengths}, "
            "anchors "
            f"{' and '.join('given' if g else 'taken from recordings' for g in anchors_given)}, "
            f"cloths {' and '.join('carried' if c else 'held still' for c in carried)}",
            where=str(folder),
            fix="build a bank of one design into a folder of its own",
        )
    return NullBank(
        nulls=Nulls.joined(parts),
        columns=names(),
        duration=durations.pop(),
        words=words,
        anchors_given=anchors_given.pop(),
        carried=carried.pop(),
    )
