"""Wind tracks from anemometers: velocities in the recording's axes, on its clock.

A velocity says where the air goes to. A log's direction says where it comes from, clockwise from
north; which way north lies in the recording's axes, or the axis along which the air goes, must be
given: a camera does not know.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.core.findings import Finding
from flagdata.core.provenance import file_hash
from flagdata.core.schema import UNUSABLE, Kind
from flagdata.errors import InputError, UsageError
from flagdata.ingest.anemometer import WindOptions, read_log
from flagdata.ingest.anemometer.log_confirmation import UNASKED, Answers, Confirm, confirm_readings
from flagdata.lake import Artifact, Lake
from flagdata.record.parent import open_parent
from flagdata.record.signals import WindSeries
from flagdata.timebase import NANOSECONDS, iso
from measure.trajectories.trajectory import WindTrack

_LONG_GAP = 5.0  # s without a usable sample are reported
_COMPONENTS = ("wind_x", "wind_y", "wind_z")


@dataclass(frozen=True, kw_only=True)
class LogPlacement:
    """How a log lies beside a recording, z up.

    Attributes:
        axis: (x, y, z) along which the air goes; speeds are taken along it, directions are not
            looked at. Of three components, None takes the sensor's axes to be the recording's.
        north: where true north lies, from +x towards +y [rad]; used with a direction.
        offset: added to the recording's clock to reach the log's [s]; each starts at its first
            sample.
        start: instant of the first frame on the log's clock [UTC ns]; instead of `offset`.

    Raises:
        UsageError: an axis without length, both axis and north, or both offset and start.
    """

    axis: tuple[float, float, float] | None = None
    north: float | None = None
    offset: float | None = None
    start: int | None = None

    def __post_init__(self) -> None:
        if self.axis is not None and not (np.isfinite(self.axis).all() and any(self.axis)):
            raise UsageError(
                f"the axis {self.axis!r} has no direction", where="wind", fix="give (x, y, z)"
            )
        if self.axis is not None and self.north is not None:
            raise UsageError(
                "both an axis and north are given", where="wind", fix="keep one of them"
            )
        if self.offset is not None and self.start is not None:
            raise UsageError(
                "both an offset and a start are given", where="wind", fix="keep one of them"
            )

    def first_frame(self, series: WindSeries) -> int:
        """Returns the instant of the first frame on the log's clock [UTC ns]; by default the log's
        first sample."""
        return (
            self.start
            if self.start is not None
            else int(series.time[0]) + round((self.offset or 0.0) * NANOSECONDS)
        )


def track(
    series: WindSeries, placement: LogPlacement, *, where: str
) -> tuple[WindTrack, tuple[Finding, ...]]:
    """Reads the wind that a log holds, without its unusable samples, and its metadata.

    Raises:
        InputError: no usable samples, or nothing that gives a direction.
        UsageError: a direction in the log, and neither axis nor north.
    """
    velocity = _velocity(series, placement, where=where)
    good = np.isfinite(velocity).all(axis=1) & ((series.flags & UNUSABLE) == 0)
    if not good.any():
        raise InputError(
            "the wind has no usable sample",
            where=where,
            fix="see what flagdata ingest says of the log",
        )
    begin = placement.first_frame(series)
    times = (series.time[good] - begin) / NANOSECONDS
    findings: list[Finding] = []
    if placement.offset is None and placement.start is None:
        findings.append(
            Finding.of(
                "clock-of-wind-assumed",
                f"the first frame is taken to be at the log's first sample, {iso(begin)}",
                where=where,
                fix="give the first frame's instant on the log's clock",
            )
        )
    unusable = int((~good).sum())
    if unusable:
        findings.append(
            Finding.of(
                "wind-samples-left-out",
                f"{unusable} of {len(good)} samples of the wind are unusable and left out",
                where=where,
                count=unusable,
            )
        )
    gap = float(np.diff(times).max(initial=0.0))
    if gap > _LONG_GAP:
        findings.append(
            Finding.of(
                "wind-gap",
                f"the wind has no usable sample for {gap:.3g} s; it is taken to change evenly",
                value=gap,
                where=f"{where}, {times[int(np.diff(times).argmax())]:.4g} s after the first frame",
            )
        )
    wind = WindTrack(times=times, velocity=velocity[good], start=begin, sensor=series.sensor.words)
    return wind, tuple(findings)


def from_log(
    path: Path,
    placement: LogPlacement,
    options: WindOptions | None = None,
    *,
    confirm: Confirm = UNASKED,
) -> tuple[WindTrack, tuple[Finding, ...]]:
    """Reads the wind of an anemometer's file, of any format that can be ingested.

    Args:
        confirm: asks what the file leaves open, and whether a drafted reading is right; without it
            a draft is refused.

    Raises:
        OpenFactsError, ZoneMissingError: nobody answered what the file leaves open.
        UnconfirmedError: nobody confirmed what the program drafted.
        FlagdataError: as `read_log` and `track`.
    """

    def read(answers: Answers) -> tuple[WindTrack, tuple[Finding, ...]]:
        completed = replace(options or WindOptions(), **dict(answers))  # type: ignore[arg-type]
        log = read_log(path, completed)
        confirm_readings(path, file_hash(path), [(log, completed)], confirm)
        wind, findings = track(log.series, placement, where=f"wind log {path.name}")
        return wind, (*_typed_findings(answers), *log.findings, *findings)

    return confirm.answered(read)


def _typed_findings(answers: Answers) -> tuple[Finding, ...]:
    """Reports what was answered at a terminal about a file, so that the result states it."""
    if not answers:
        return ()
    texts = (
        f"{name} {', '.join(answer) if isinstance(answer, tuple) else answer}"
        for name, answer in answers.items()
    )
    return (Finding.of("answers-given", f"given at the terminal: {'; '.join(texts)}"),)


def from_artifact(
    lake: Lake, artifact: Artifact, placement: LogPlacement
) -> tuple[WindTrack, tuple[Finding, ...]]:
    """Reads the wind of a wind or recording artifact, on its common clock.

    Raises:
        InputError: an artifact of another kind, or one without wind.
        FlagdataError: as `track`.
    """
    where = f"artifact {artifact.id}"
    if artifact.kind not in (Kind.WIND, Kind.RECORDING) or artifact.object is None:
        raise InputError(
            f"a {artifact.kind.value} holds no wind",
            where=where,
            fix="name a wind or recording artifact",
        )
    series = open_parent(lake, artifact.object).wind()
    if series is None:
        raise InputError("the record has no wind", where=where, fix="name a wind artifact")
    return track(series, placement, where=where)


def _velocity(series: WindSeries, placement: LogPlacement, *, where: str) -> FloatArray:
    """Computes where the air goes to, (n, 3) [m/s]; NaN where a channel has no value."""
    channels = series.channels
    if placement.axis is not None:
        along = np.array(placement.axis) / float(np.linalg.norm(placement.axis))
        return _speed(series, where)[:, None] * along
    if "wind_direction" in channels and "wind_speed" in channels:
        if placement.north is None:
            raise UsageError(
                "the log has directions, but where north lies in the recording is not said",
                where=where,
                fix="give north, the angle from +x towards +y, or the axis along which the air "
                "goes",
            )
        # The direction it comes from is clockwise from north, angles from +x are counter-clockwise.
        heading = placement.north - channels["wind_direction"] + math.pi
        upward = channels.get("wind_z", np.zeros(len(series)))
        return np.stack(
            [
                channels["wind_speed"] * np.cos(heading),
                channels["wind_speed"] * np.sin(heading),
                upward,
            ],
            axis=1,
        )
    if "wind_x" in channels and "wind_y" in channels:
        if placement.north is not None:
            raise UsageError(
                "the log has components in the sensor's axes, to which north says nothing",
                where=where,
                fix="leave north out and turn the recording into the sensor's axes, or give an "
                "axis",
            )
        return np.stack([channels.get(name, np.zeros(len(series))) for name in _COMPONENTS], axis=1)
    raise InputError(
        f"the log gives no direction: {', '.join(sorted(channels))}",
        where=where,
        fix="give the axis along which the air goes",
    )


def _speed(series: WindSeries, where: str) -> FloatArray:
    """Computes the horizontal speed, (n,) [m/s]."""
    channels = series.channels
    if "wind_speed" in channels:
        return channels["wind_speed"]
    if "wind_x" in channels and "wind_y" in channels:
        return np.hypot(channels["wind_x"], channels["wind_y"])
    raise InputError(
        f"the log has no wind speed: {', '.join(sorted(channels))}",
        where=where,
        fix="name the log of an anemometer",
    )
