"""Prediction errors and sensitivities, brought down to a few numbers a segment: all that inference
needs.

With e the errors, s_i the sensitivity of the predictions to column i and w weights of the markers,
a segment gives

    r_i = Σ w e·s_i / √(Σ w s_i²),   R_ij = Σ w s_i·s_j / √(Σ w s_i²),

sums over frames and markers, w the inverse mean square of a marker's errors in the recording beyond
what its noise
explains: the errors' size along the direction of each column, and how coefficients δ move it, E r =
μ + R δ, with μ what the model's own numerics leave. The mean square is taken over all frames, so
that the errors and sensitivities of a marker that was tracked in a share q of them are divided by
√q, and r is that of a complete recording.

The moment of errors about the pole: what inner forces, and so most of what numerics do, cancel in.

Inner forces and those of the attachments, which lie on an axis, have no moment about it: M = Σ m (r
× a)_z is that of the air and of weight alone, whatever mesh, bending and stretch the cloth is
computed with. The errors e of predictions one horizon T ahead have, a unit of mass per area,

    M = Σ w (r × e)_z / T²,

w a marker's share of the cloth, r where it is observed, from the axis: the moment per density of
what the model lacks.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from flagdata.core.arrays import BoolArray, FloatArray, IntArray
from measure.forecasting.calibrated_parameters import Calibration
from measure.forecasting.observer import Forecaster
from measure.forecasting.regressors import Column, winds
from measure.forecasting.segments import Segments
from measure.probes.lines import Spectrum
from measure.probes.segment_rows import StatisticRows
from measure.probes.wind_course import Course, Gauge
from measure.probes.wind_log import sensitivities
from measure.trajectories.interpolation import onto
from measure.trajectories.trajectory import Specimen


@dataclass(frozen=True, kw_only=True, eq=False)
class PoleMoment:
    """Moments about the pole of some segments.

    Attributes:
        arms: (frame, marker, 2, segment) w (−y, x)/T² [m³/s²] of the observed markers.
        scale: (segment,) root mean square moment of the base model's errors in the recording
            [m⁴/s²].
    """

    arms: Tensor
    scale: Tensor

    @classmethod
    def of(cls, errors: Tensor, segments: Segments, specimen: Specimen) -> PoleMoment:
        """Computes moments about the vertical through the middle of the attachments, of errors
        (frame, marker, 3, segment) [m]."""
        anchors = [
            specimen.anchors if item.anchors is None else item.anchors for item in segments.items
        ]
        axis = np.stack([points.mean(axis=0) for points in anchors], axis=-1)[None, None, :2]
        positions = segments.positions[segments.first :, :, :2] - axis
        share = shares(specimen, segments.markers)[None, :, None, None] / segments.period**2
        arms = torch.as_tensor(
            share * np.stack([-positions[:, :, 1], positions[:, :, 0]], axis=2)
        ).to(errors)
        moment = (arms * errors[:, :, :2]).sum((1, 2))
        scale = torch.empty(len(segments)).to(errors)
        for index in np.unique(segments.recording):
            in_recording = torch.as_tensor(
                np.flatnonzero(segments.recording == index), device=errors.device
            )
            scale[in_recording] = (moment[:, in_recording] ** 2).mean().sqrt()
        return cls(arms=arms, scale=scale)

    def moment(self, changes: Tensor) -> Tensor:
        """Computes the moment (change, frame, segment) over its scale, of (change, frame, marker,
        3, segment) [m]."""
        return torch.einsum("fmxs,cfmxs->cfs", self.arms, changes[:, :, :, :2]) / self.scale

    @classmethod
    def joined(cls, parts: list[PoleMoment]) -> PoleMoment:
        """Joins the segments of several, one after another."""
        return cls(
            arms=torch.cat([p.arms for p in parts], dim=-1),
            scale=torch.cat([p.scale for p in parts]),
        )


def shares(specimen: Specimen, markers: FloatArray) -> FloatArray:
    """Shares the cloth's area [m²] among markers (marker, 2) [m], that of the vertices brought onto
    them, (marker,)."""
    return specimen.mesh.vertex_areas @ onto(markers, specimen.mesh.rest)


_CHUNK = 64
"""Segments at a time: bounds memory, 64 segments of 50 frames and 200 markers take 8 MB a
column."""
_CLIP = 4.0
"""Errors beyond so many times a marker's root mean square count as that much (Huber): folds snap in
ways no effect explains."""

_NEVER = 1e-4
"""Least mean square of a marker's errors over the largest: one that was hardly ever tracked says
nothing."""

_NOISE = 6.0
"""Variance of e by markers of variance 1: each frame's weighs 1, the one before 2, the one before
that 1, in amplitude, as for a point that moves evenly."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Statistics(StatisticRows):
    """Sums over the frames and markers of segments.

    Attributes:
        recording: (segment,) index of each one's recording.
        r: (segment, column).
        response: (segment, column, column) R.
        error: (segment,) mean squared prediction error [m²].
        marker_error: (segment, marker) the same of each marker.
        lines: (segment, reduced frequency, direction) of the errors' spectra: see `lines`; None
            where not looked at.
        turning: the same of the errors' moment about the pole, see `pole_moment`, its `error` in
            m⁸/s⁴; None where not looked at.
        course: of the wind, estimated from the errors; None where not asked for.
        log: (segment, column, nuisance) how r moves with a prior standard deviation of what the
            wind's log may be off by, see `wind_log`; None where the wind is known, as in nulls.
        settled: (segment, quantity) what its recording settles at less what the model does, see
            `settled`; None where not looked at.
    """

    recording: IntArray
    r: FloatArray
    response: FloatArray
    error: FloatArray
    marker_error: FloatArray
    lines: FloatArray | None = None
    turning: Statistics | None = None
    course: Course | None = None
    log: FloatArray | None = None
    settled: FloatArray | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Projection:
    """The directions that statistics are taken along, kept: other models' errors have r along the
    same ones.

    Attributes:
        directions: (segment, column, frame · marker · 3) weighted sensitivities of length 1.
        scale: (marker, segment) root mean square errors of the base model [m], by which errors are
            weighed.
        spectrum: what their periodograms are taken along; None where lines are not looked at.
        pole_moment: what their moments are taken by; None where they are not looked at.
        turning: (segment, column, frame) the sensitivities' moments, of length 1.
        gauge: sensitivities from which the wind's course is estimated; None where not asked for.
    """

    directions: Tensor
    scale: Tensor
    spectrum: Spectrum | None = None
    pole_moment: PoleMoment | None = None
    turning: Tensor | None = None
    gauge: Gauge | None = None

    @classmethod
    def along(cls, changes: Sequence[Tensor], scale: Tensor) -> Projection:
        """Projects along sensitivities (frame, marker, 3, segment) [m per unit], of errors of some
        scale (marker, segment)."""
        moved = torch.stack([_plain(change, scale).flatten(1) for change in changes], dim=1)
        moved /= moved.norm(dim=2, keepdim=True).clamp(min=torch.finfo(moved.dtype).tiny)
        return cls(directions=moved, scale=scale)

    def of(self, errors: Tensor) -> FloatArray:
        """Computes r of errors (frame, marker, 3, segment) [m], (segment, column)."""
        clipped = _clip_errors(errors, self.scale).flatten(1).to(self.directions)
        return torch.einsum("sck,sk->sc", self.directions, clipped).double().cpu().numpy()

    def turned(self, errors: Tensor) -> FloatArray | None:
        """Computes r of the moment of errors (frame, marker, 3, segment) [m], (segment, column);
        None where not looked at."""
        if self.pole_moment is None or self.turning is None:
            return None
        moment = self.pole_moment.moment(errors[None])[0].to(self.turning)
        return torch.einsum("scf,fs->sc", self.turning, moment).double().cpu().numpy()

    def course(self, errors: Tensor) -> Course | None:
        """Computes the wind's course by the errors (frame, marker, 3, segment) [m]; None where not
        asked for."""
        return None if self.gauge is None else self.gauge.course(_clip_errors(errors, self.scale))

    def lines(self, errors: Tensor) -> FloatArray | None:
        """Computes the prominence of the errors' spectra, (segment, reduced frequency, direction):
        see `lines`; None where not looked at."""
        return None if self.spectrum is None else self.spectrum.prominence(errors)

    def response(self, changes: Sequence[Tensor]) -> FloatArray:
        """Computes how r moves with k sensitivities (frame, marker, 3, segment) [m per unit],
        (segment, column, k)."""
        moved = torch.stack([_plain(change, self.scale).flatten(1) for change in changes], dim=2)
        return (self.directions @ moved).double().cpu().numpy()


def statistics(
    forecaster: Forecaster,
    segments: Segments,
    calibrations: Sequence[Calibration],
    columns: Sequence[Column],
) -> Statistics:
    """Runs the base model, its parameters and every column along segments, each with its
    calibration.

    The columns of the result are `THETA`'s, then those given.
    """
    return Statistics.joined(
        [piece.statistics for piece in _pieces(forecaster, segments, calibrations, columns)]
    )


def projected_statistics(
    forecaster: Forecaster,
    segments: Segments,
    calibrations: Sequence[Calibration],
    columns: Sequence[Column],
) -> tuple[Statistics, Projection]:
    """Computes the same statistics, with how they move with what the wind's log may be off by, and
    with the directions, 4 MB a segment of 50 frames, 190 markers and 36 columns."""
    parts: list[Statistics] = []
    along: list[Projection] = []
    pieces = list(_pieces(forecaster, segments, calibrations, columns))
    for piece in pieces:
        projection = Projection.along(piece.changes, piece.scale)
        off = sensitivities(forecaster, piece.segments, piece.calibrations, piece.base)
        parts.append(_with_log(piece, projection, off))
        along.append(projection)
    joined = Projection(
        directions=torch.cat([projection.directions for projection in along]),
        scale=torch.cat([piece.scale for piece in pieces], dim=1),
        spectrum=_spectrum(forecaster, segments),
        pole_moment=PoleMoment.joined([piece.pole_moment for piece in pieces]),
        turning=torch.cat([piece.turning for piece in pieces]),
        gauge=Gauge.joined([piece.gauge for piece in pieces]),
    )
    return Statistics.joined(parts), joined


@dataclass(frozen=True, kw_only=True, eq=False)
class _Piece:
    """Some segments, with their calibrations, errors and sensitivities (frame, marker, 3, segment),
    the scale of the errors, the directions of moments (segment, column, frame), and all statistics
    but those of a log."""

    segments: Segments
    calibrations: Sequence[Calibration]
    base: Tensor
    changes: Sequence[Tensor]
    scale: Tensor
    pole_moment: PoleMoment
    turning: Tensor
    gauge: Gauge
    statistics: Statistics


def _pieces(
    forecaster: Forecaster,
    segments: Segments,
    calibrations: Sequence[Calibration],
    columns: Sequence[Column],
) -> Iterator[_Piece]:
    """Yields some segments at a time."""
    # Segments of one recording share weights, and so stay in one chunk.
    for chosen in _chunks(segments.recording):
        chosen_segments, recording = segments.select(chosen), segments.recording[chosen]
        starts = [calibrations[i] for i in chosen]
        base = forecaster.errors(*forecaster.system(chosen_segments, starts), chosen_segments)
        changes = forecaster.sensitivities((*columns, *winds()), chosen_segments, starts, base)
        changes, blown = changes[: -len(winds())], changes[-len(winds()) :]
        pole_moment = PoleMoment.of(base, chosen_segments, forecaster.specimen)
        scale = error_scale(base, recording, chosen_segments.noise, chosen_segments.counted)
        gauge = Gauge.of(blown, scale, period=chosen_segments.period)
        turned, turning = _turned_statistics(pole_moment, base, changes, recording)
        piece_statistics = replace(
            reduce_errors(base, changes, recording, chosen_segments.noise, chosen_segments.counted),
            lines=_spectrum(forecaster, chosen_segments).prominence(base),
            turning=turned,
            course=gauge.course(_clip_errors(base, scale)),
        )
        yield _Piece(
            segments=chosen_segments,
            calibrations=starts,
            base=base,
            changes=changes,
            scale=scale,
            pole_moment=pole_moment,
            turning=turning,
            gauge=gauge,
            statistics=piece_statistics,
        )


def _with_log(piece: _Piece, along: Projection, off: Sequence[Tensor]) -> Statistics:
    """Adds to statistics how they move with what the wind's log may be off by.

    Args:
        along: the sensitivities that the statistics are along.
        off: (frame, marker, 3, segment) [m] of each nuisance.
    """
    turning, course = piece.statistics.turning, piece.statistics.course
    if turning is not None:
        moved = piece.pole_moment.moment(torch.stack(list(off))).double().permute(2, 0, 1)
        turning = replace(turning, log=(piece.turning @ moved.transpose(1, 2)).cpu().numpy())
    if course is not None:
        scores = [piece.gauge.course(_plain(nuisance, piece.scale)).score for nuisance in off]
        course = replace(course, log=np.stack(scores, axis=-1))
    return replace(piece.statistics, log=along.response(off), turning=turning, course=course)


def _turned_statistics(
    pole_moment: PoleMoment, base: Tensor, changes: Sequence[Tensor], recording: IntArray
) -> tuple[Statistics, Tensor]:
    """Statistics of moments of errors and sensitivities (frame, marker, 3, segment), with their
    directions, (segment, column, frame) of length 1 where there is any."""
    moment = pole_moment.moment(base[None])[0].double()  # (frame, segment)
    moved = pole_moment.moment(torch.stack(list(changes))).double().permute(2, 0, 1)
    directions = moved / moved.norm(dim=2, keepdim=True).clamp(min=1e-9)
    size = ((moment * pole_moment.scale) ** 2).mean(0).cpu().numpy()
    return Statistics(
        recording=recording,
        r=torch.einsum("scf,fs->sc", directions, moment).cpu().numpy(),
        response=(directions @ moved.transpose(1, 2)).cpu().numpy(),
        error=size,
        marker_error=size[:, None],
    ), directions


def _spectrum(forecaster: Forecaster, segments: Segments) -> Spectrum:
    speeds = np.array([item.wind.speed for item in segments.items])
    return Spectrum.of(forecaster.markers, forecaster.specimen.mesh.rest, speeds, segments.period)


def _chunks(recording: IntArray) -> list[IntArray]:
    chunks: list[list[int]] = [[]]
    for index in np.unique(recording):
        in_recording = np.flatnonzero(recording == index).tolist()
        if chunks[-1] and len(chunks[-1]) + len(in_recording) > _CHUNK:
            chunks.append([])
        chunks[-1] += in_recording
    return [np.array(chunk) for chunk in chunks if chunk]


def error_scale(
    base: Tensor, recording: IntArray, noise: FloatArray, counted: BoolArray | None = None
) -> Tensor:
    """Computes root mean square errors of a marker in the recording, beyond what its noise
    explains, (marker, segment) [m].

    Args:
        counted: (frame, marker, segment) whether each position was tracked; None where all were.
    """
    mean = (base**2).mean((0, 2))
    scale = torch.empty_like(mean)
    for index in np.unique(recording):
        in_recording = torch.as_tensor(np.flatnonzero(recording == index), device=base.device)
        squared = mean[:, in_recording].mean(1)
        noisy = _NOISE * float(noise[recording == index][0]) ** 2
        if counted is not None:
            share = torch.as_tensor(counted[:, :, recording == index].mean(axis=(0, 2))).to(base)
            noisy, squared = noisy * share, torch.maximum(squared, _NEVER * squared.max())
        scale[:, in_recording] = torch.maximum(squared - noisy, squared / 4).sqrt()[:, None]
    return scale


def _plain(changes: Tensor, scale: Tensor) -> Tensor:
    """Divides changes (frame, marker, 3, segment) by (marker, segment): (segment, frame, marker ·
    3)."""
    return (changes / scale[None, :, None]).permute(3, 0, 1, 2).flatten(2)


def _clip_errors(errors: Tensor, scale: Tensor) -> Tensor:
    """Divides errors as `_plain` does changes, long ones clipped."""
    errors = errors / scale[None, :, None]
    size = errors.norm(dim=2, keepdim=True) / 3**0.5
    return (errors * (_CLIP / size.clamp(min=_CLIP))).permute(3, 0, 1, 2).flatten(2)


def reduce_errors(
    base: Tensor,
    changes: Sequence[Tensor],
    recording: IntArray,
    noise: FloatArray,
    counted: BoolArray | None = None,
) -> Statistics:
    """Computes statistics of segments: errors, sensitivities (frame, marker, 3, segment) and the
    noise of their markers [m].

    Args:
        counted: (frame, marker, segment) whether each position was tracked; None where all were.
    """
    mean = (base**2).mean((0, 2))  # (marker, segment)
    r = np.empty((len(recording), len(changes)))
    response = np.empty((len(recording), len(changes), len(changes)))
    stacked = torch.stack(list(changes))
    scale = error_scale(base, recording, noise, counted)
    errors = _clip_errors(base, scale)
    for segment in range(len(recording)):
        error = errors[segment].flatten().double()
        moved = (
            (stacked[..., segment] / scale[None, None, :, segment, None])
            .reshape(len(changes), -1)
            .double()
        )
        inner = (moved @ moved.T).cpu().numpy()
        length = np.sqrt(np.maximum(np.diag(inner), np.finfo(np.float64).tiny))
        r[segment] = (moved @ error).cpu().numpy() / length
        response[segment] = inner / length[:, None]
    return Statistics(
        recording=recording,
        r=r,
        response=response,
        error=mean.mean(0).double().cpu().numpy() * 3,
        marker_error=mean.T.double().cpu().numpy() * 3,
    )
