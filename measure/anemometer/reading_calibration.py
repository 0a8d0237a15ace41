"""Films of a flag and the logs beside them become a reading model."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from flagdata.answer.circumstances import Circumstances
from flagdata.core.arrays import BoolArray, FloatArray
from flagdata.core.findings import Finding
from flagdata.errors import InputError, RefusedError
from flagdata.lake import Lake
from flagdata.record.signals import Sensor
from measure.cloth.blown_wind import STEADY, Log
from measure.film.film_source import Subject
from measure.film.similarity import FlagSize
from measure.gate.reasons import REASONS
from measure.measuring_model.intervals import half_width
from measure.measuring_model.networks import Network
from measure.measuring_model.novelty import Familiar
from measure.measuring_model.reading_model import ReadingModel
from measure.measuring_model.regression import (
    BLOCK,
    Ridge,
    blocks_of,
    validate_penalties,
    with_neighbours,
)
from measure.measuring_model.window_features import SUMMARY, Features, features_of

ANSWER = 1
"""Raised when the same recordings give another reading model."""
LEAST = 60.0
"""s of film beside a log: three blocks of time. Lower, and too few blocks are left to choose a
penalty by."""
ENOUGH = 240.0
"""s of film from which on intervals rest on enough blocks of time."""
_OFFSETS = np.linspace(-2.0, 2.0, 9)
"""Errors of the clock that are tried, in its standard uncertainties."""
CLOCK = 0.05
"""s below which a clock's uncertainty matters for no window. Lower, and offsets are fitted where
they change nothing."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Recording:
    """A film and the log beside it, looked at.

    Attributes:
        name, artifact: of the recording in the lake, and its id.
        features: of the film's windows.
        log: its times since the film's first frame.
        sensor: that logged.
        findings: on the film.
        circumstances: when, where and with what it was recorded.
    """

    JSON_NAMES: ClassVar[tuple[str, ...]] = (
        "name",
        "artifact",
        "windows",
        "anemometer=sensor.name",
        "accuracy=sensor.accuracy",
        "distance_constant=sensor.distance_constant",
    )

    name: str
    artifact: str
    features: Features
    log: Log
    sensor: Sensor
    findings: tuple[Finding, ...] = ()
    circumstances: Circumstances = field(default_factory=Circumstances)

    @property
    def usable(self) -> BoolArray:
        """(w,) windows with all their frames beside which the log is not silent."""
        starts = self.features.starts
        return self.features.whole & self.log.covers(starts, starts + self.features.layout.step)

    @property
    def windows(self) -> int:
        """How many are usable."""
        return int(self.usable.sum())

    def winds(self, offset: float) -> FloatArray:
        """Computes the log's mean over each window, (w,) [m/s], with the log `offset` seconds later
        than its stamps."""
        starts = self.features.starts - offset
        return self.log.mean_speed(starts, starts + self.features.layout.step)


@dataclass(frozen=True, kw_only=True, eq=False)
class ReadingCalibration:
    """A reading model and what it rests on.

    Attributes:
        model: the reading model.
        recordings: that it was fitted to.
        clock_offset: by which the logs are later than their stamps, as fitted [s].
        clock_sigma: prior standard uncertainty of that [s].
        uncalibrated_rmse: of the network's own wind against the log over the same windows [m/s].
        level: of the intervals that are stated.
        findings: on films, log and fit.
    """

    JSON_NAMES: ClassVar[tuple[str, ...]] = (
        "sentence",
        "network=model.network",
        "flag_size=model.size.sides",
        "window=model.step",
        "windows",
        "range=model.range",
        "rmse=model.rmse",
        "uncalibrated_rmse",
        "level",
        "half_width",
        "clock_offset",
        "clock_sigma",
        "penalty=model.ridge.penalty",
        "features=model.names",
        "recordings",
        "findings",
    )

    model: ReadingModel
    recordings: tuple[Recording, ...]
    clock_offset: float
    clock_sigma: float
    uncalibrated_rmse: float
    level: float
    findings: tuple[Finding, ...]

    @property
    def half_width(self) -> float:
        """Of a window's interval [m/s]."""
        return half_width(self.model.errors, self.level)

    @property
    def sentence(self) -> str:
        """In one line."""
        low, high = self.model.range
        return (
            f"reads the wind of {self.model.step:.2g} s to {self.model.rmse:.2f} m/s (RMSE in "
            "blocks of time that were "
            f"left out, n = {self.windows} windows; {self.level:.0%} within "
            f"±{self.half_width:.2f} m/s) "
            f"between {low:.1f} and {high:.1f} m/s; the network alone {self.uncalibrated_rmse:.2f} "
            "m/s"
        )

    @property
    def windows(self) -> int:
        """How many it was fitted to."""
        return len(self.model.winds)


def windows_of_recording(
    subject: Subject,
    network: Network,
    size: FlagSize,
    *,
    first: float,
    last: float | None,
    lake: Lake | None = None,
    advance: Callable[[int, int], None] | None = None,
) -> Recording:
    """Computes what a recording of a lake shows, window by window, beside its log.

    Args:
        first, last: part of the film [s].
        lake: that it is of.
        advance: called after each window with how many there are and 1.

    Raises:
        InputError: no log beside the film, or one that does not cover it.
        RefusedError: a film with a fault that nothing can be measured with.
    """
    film, wind = subject.film, None if subject.record is None else subject.record.wind()
    if wind is None or film.start is None or subject.artifact is None:
        raise InputError(
            "no log of the wind is beside the film",
            where=film.name,
            fix="align a film and a log (flagdata align), and name the recording that comes out",
        )
    log = Log.of(wind, start=film.start, clock=subject.artifact.clock_sigma or 0.0)
    if (
        log.times[0] > min(film.duration, math.inf if last is None else last)
        or log.times[-1] < first
    ):
        raise InputError(
            f"the log runs from {log.times[0]:.1f} to {log.times[-1]:.1f} s of the film's time and "
            "covers none of it",
            where=film.name,
            fix="align the film with the log of its own time (flagdata align)",
        )
    features = features_of(film, network.estimator, size, first=first, last=last, advance=advance)
    findings = film.findings()
    if faults := [finding for finding in findings if finding.kind in REASONS]:
        raise RefusedError(
            faults[0].what, where=film.name, fix=faults[0].fix or "give another film"
        )
    return Recording(
        name=film.name,
        artifact=subject.artifact.id,
        features=features,
        log=log.undo_lag(),
        sensor=wind.sensor,
        findings=findings,
        circumstances=subject.circumstances(lake),
    )


def calibrate_reading(
    recordings: Sequence[Recording], *, network: Network, size: FlagSize, level: float
) -> ReadingCalibration:
    """Fits a reading model.

    Raises:
        InputError: too little film.
        RefusedError: a wind that hardly changes; films of several places; a film that does not show
            the wind.
    """
    # Usable windows have all their frames and a log that is not silent.
    step = recordings[0].features.layout.step
    usable = [recording.usable for recording in recordings]
    count = sum(int(mask.sum()) for mask in usable)
    if count * step < LEAST / 2:
        raise InputError(
            f"only {count * step:.0f} s of film have all their frames and a log beside them",
            where=recordings[0].name,
            fix=f"give {LEAST:.0f} s or more that the log covers; {ENOUGH / 60:.0f} minutes are "
            "better",
        )
    _check_wind(recordings, usable)
    # Their features, with the neighbours' and without, in blocks of time.
    names = recordings[0].features.names
    rows, plain = _rows(recordings, usable)
    numbers = np.repeat(np.arange(len(recordings)), [int(mask.sum()) for mask in usable])
    times = np.concatenate(
        [
            recording.features.starts[mask]
            for recording, mask in zip(recordings, usable, strict=True)
        ]
    )
    blocks = blocks_of(times, numbers)

    def winds(offset: float) -> FloatArray:
        return np.concatenate(
            [
                recording.winds(offset)[mask]
                for recording, mask in zip(recordings, usable, strict=True)
            ]
        )

    # The clock's error first: it moves the winds that the features are fitted to.
    clock = max(recording.log.clock for recording in recordings)
    is_named = np.array([not name.startswith(SUMMARY) for name in names])
    offset = _best_offset(plain, winds, blocks, clock, is_named)
    logged = winds(offset)
    # Penalty and weights by cross-validation over blocks; its errors become the intervals.
    checked = validate_penalties(
        rows, logged, blocks, np.tile(is_named, rows.shape[1] // len(names))
    )
    spread = float(logged.std())
    if checked.rmse >= spread:
        raise RefusedError(
            f"the wind that is read of windows left out errs by {checked.rmse:.2f} m/s, as much as "
            "their mean would "
            f"({spread:.2f} m/s): what moves may not be the flag, or film and log may not be of "
            "one time",
            where=recordings[0].name,
            fix="check the flag with --crop or --flag, and the clocks with flagdata align",
        )
    # The model itself is fitted to all windows.
    model = ReadingModel(
        network=network.estimator.name,
        identity=network.identity,
        size=size,
        step=step,
        names=names,
        ridge=Ridge.fitted(rows, logged, checked.penalty, checked.weights),
        winds=logged,
        errors=logged - checked.predicted,
        block=round(BLOCK / step),
        familiar=Familiar.of(plain, checked.predicted, blocks),
        places=tuple(recording.features.place for recording in recordings),
    )
    return ReadingCalibration(
        model=model,
        recordings=tuple(recordings),
        clock_offset=offset,
        clock_sigma=clock,
        level=level,
        uncalibrated_rmse=_uncalibrated_error_of(recordings, usable, logged),
        findings=(
            *(f for recording in recordings for f in recording.findings),
            *_notices(recordings, count * step, offset, clock),
        ),
    )


def _check_wind(recordings: Sequence[Recording], usable: Sequence[BoolArray]) -> None:
    winds = np.concatenate(
        [recording.winds(0.0)[mask] for recording, mask in zip(recordings, usable, strict=True)]
    )
    if winds.std() < STEADY * winds.mean():
        raise RefusedError(
            f"the wind hardly changes ({winds.mean():.1f} m/s, its windows within "
            f"{winds.std():.2f} m/s), so that "
            "nothing shows how the flag follows it",
            where=recordings[0].name,
            fix="film for longer, or in gusts; several recordings are taken together",
        )


def _rows(
    recordings: Sequence[Recording], usable: Sequence[BoolArray]
) -> tuple[FloatArray, FloatArray]:
    """Returns features of all usable windows: (n, 3 · column) with the neighbours', and (n, column)
    without."""
    pairs = list(zip(recordings, usable, strict=True))
    rows = np.concatenate(
        [with_neighbours(recording.features.values)[mask] for recording, mask in pairs]
    )
    return rows, np.concatenate([recording.features.values[mask] for recording, mask in pairs])


def _best_offset(
    plain: FloatArray,
    winds: Callable[[float], FloatArray],
    blocks: NDArray[np.int_],
    clock: float,
    is_named: BoolArray,
) -> float:
    """Fits the error of the clock [s], by windows without their neighbours, which could make up for
    it."""
    if clock <= CLOCK:
        return 0.0
    errors = [
        validate_penalties(plain, winds(share * clock), blocks, is_named).rmse
        for share in _OFFSETS.tolist()
    ]
    misfit = len(plain) * np.log(errors) + np.square(_OFFSETS) / 2
    return float(_OFFSETS[misfit.argmin()]) * clock


def _uncalibrated_error_of(
    recordings: Sequence[Recording], usable: Sequence[BoolArray], logged: FloatArray
) -> float:
    network_winds = np.concatenate(
        [recording.features.winds[mask] for recording, mask in zip(recordings, usable, strict=True)]
    )
    return float(np.sqrt(np.mean((network_winds - logged) ** 2)))


def _notices(
    recordings: Sequence[Recording], seconds: float, offset: float, clock: float
) -> list[Finding]:
    findings = []
    if seconds < ENOUGH:
        findings.append(
            Finding.of(
                "short-calibration",
                f"{seconds:.0f} s of film beside a log are few: the intervals rest on "
                f"{seconds / BLOCK:.0f} "
                "blocks of time",
                value=seconds,
                fix=f"give {ENOUGH / 60:.0f} minutes or more",
            )
        )
    if abs(offset) > 1.5 * clock > 0:
        findings.append(
            Finding.of(
                "clock-at-limit",
                f"the log fits best {offset:+.2f} s later than its stamps, whose uncertainty is "
                f"{clock:.2f} s",
                value=offset,
                fix="check the clocks with flagdata align",
            )
        )
    accuracy = max((recording.sensor.accuracy or 0.0 for recording in recordings), default=0.0)
    if accuracy:
        findings.append(
            Finding.of(
                "anemometer-accuracy",
                f"the anemometer states ±{accuracy:g} m/s, which the reading model takes over and "
                "no interval contains",
                value=accuracy,
            )
        )
    return findings
