"""Prediction errors and sensitivities, brought down to a few numbers a segment: all that inference needs.

With e the errors and s_i the sensitivity of the predictions to column i, a segment gives

    r_i = ⟨e, s_i⟩ / √⟨s_i, s_i⟩,   R_ij = ⟨s_i, s_j⟩ / √⟨s_i, s_i⟩,

inner products summed over frames, weighed by what errors are usual (see `weights`): the errors' size
along the direction of each column, and how coefficients δ move it, E r = μ + R δ, with μ what the model's own numerics
leave.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from flagdata.errors import UsageError
from measure.loop.columns import Calibration, Column
from measure.loop.forecast import Forecaster, Segments
from measure.loop.lines import Spectrum
from measure.loop.weights import Usual, Weights

Floats = NDArray[np.float64]

_CHUNK = 64
"""Segments at a time: bounds memory, 64 segments of 50 frames and 200 markers take 8 MB a column."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Statistics:
    """Of segments.

    Attributes:
        recording: (segment,) index of each one's recording.
        r: (segment, column).
        response: (segment, column, column) R.
        error: (segment,) mean squared prediction error [m²].
        marker_error: (segment, marker) the same of each marker.
        lines: (segment, reduced frequency, direction) of the errors' spectra: see `lines`; None where not looked at.
    """

    recording: NDArray[np.int64]
    r: Floats
    response: Floats
    error: Floats
    marker_error: Floats
    lines: Floats | None = None

    @property
    def spectra(self) -> Floats:
        """`lines`, which must have been looked at.

        Raises:
            UsageError: they were not.
        """
        if self.lines is None:
            raise UsageError("no spectra", where="statistics", fix="take them by `statistics`, not by `reduced` alone")
        return self.lines

    def select(self, chosen: NDArray[np.bool_] | NDArray[np.int64]) -> Statistics:
        """Of some segments."""
        return Statistics(
            recording=self.recording[chosen], r=self.r[chosen], response=self.response[chosen],
            error=self.error[chosen], marker_error=self.marker_error[chosen],
            lines=None if self.lines is None else self.lines[chosen],
        )  # fmt: skip

    @classmethod
    def joined(cls, parts: Sequence[Statistics]) -> Statistics:
        """One after another.

        Raises:
            UsageError: none, or lines of some alone.
        """
        if not parts:
            raise UsageError("no statistics to join", where="statistics", fix="give at least one part")
        return cls(
            recording=np.concatenate([p.recording for p in parts]), r=np.concatenate([p.r for p in parts]),
            response=np.concatenate([p.response for p in parts]), error=np.concatenate([p.error for p in parts]),
            marker_error=np.concatenate([p.marker_error for p in parts]), lines=_joined([p.lines for p in parts]),
        )  # fmt: skip


def _joined(parts: Sequence[Floats | None]) -> Floats | None:
    known = [part for part in parts if part is not None]
    if known and len(known) < len(parts):
        raise UsageError("spectra of some parts alone", where="statistics", fix="look at lines in all or in none")
    return np.concatenate(known) if known else None


@dataclass(frozen=True, kw_only=True, eq=False)
class Projection:
    """The directions that statistics are taken along, kept: other models' errors have r along the same ones.

    Attributes:
        directions: (segment, column, frame · marker · 3) weighed sensitivities of length 1.
        weights: by the base model's errors.
        spectrum: what their periodograms are taken along; None where lines are not looked at.
    """

    directions: Tensor
    weights: Weights
    spectrum: Spectrum | None = None

    @classmethod
    def along(cls, changes: Sequence[Tensor], weights: Weights) -> Projection:
        """Along sensitivities (frame, marker, 3, segment) [m per unit]."""
        stacked = torch.stack(list(changes))
        directions: list[Tensor] = []
        for place in range(stacked.shape[-1]):
            moved = weights.scaled(stacked[..., place], place).double()
            weighed = weights.weighed(moved)
            directions.append((weighed / (weighed * moved).sum(dim=1, keepdim=True).sqrt()).to(stacked.dtype))
        return cls(directions=torch.stack(directions), weights=weights)

    def of(self, errors: Tensor) -> Floats:
        """(segment, column) r of errors (frame, marker, 3, segment) [m]."""
        parts = [
            direction @ self.weights.errors(errors[..., place], place).to(direction.dtype)
            for place, direction in enumerate(self.directions)
        ]
        return torch.stack(parts).double().cpu().numpy()

    def lines(self, errors: Tensor) -> Floats | None:
        """(segment, reduced frequency, direction) of their spectra: see `lines`; None where not looked at."""
        return None if self.spectrum is None else self.spectrum.prominence(errors)

    def response(self, changes: Sequence[Tensor]) -> Floats:
        """(segment, column, k) how r moves with k sensitivities (frame, marker, 3, segment) [m per unit]."""
        stacked = torch.stack(list(changes))
        parts = [
            direction @ self.weights.scaled(stacked[..., place], place).to(direction.dtype).T
            for place, direction in enumerate(self.directions)
        ]
        return torch.stack(parts).double().cpu().numpy()


def statistics(
    forecaster: Forecaster,
    segments: Segments,
    calibrations: Sequence[Calibration],
    columns: Sequence[Column],
    *,
    usual: Usual | None = None,
) -> Statistics:
    """Run the base model, its parameters and every column along segments, each with its calibration.

    The columns of the result are `THETA`'s, then those given.

    Args:
        usual: what errors of nulls are like; None to count all shapes alike.
    """
    return Statistics.joined([found for found, _, _ in _pieces(forecaster, segments, calibrations, columns, usual)])


def projected(
    forecaster: Forecaster,
    segments: Segments,
    calibrations: Sequence[Calibration],
    columns: Sequence[Column],
    *,
    usual: Usual | None = None,
) -> tuple[Statistics, Projection]:
    """The same, with the directions: 4 MB a segment of 50 frames, 190 markers and 36 columns."""
    parts: list[Statistics] = []
    pieces: list[Projection] = []
    for found, changes, weights in _pieces(forecaster, segments, calibrations, columns, usual):
        parts.append(found)
        pieces.append(Projection.along(changes, weights))
    whole = Projection(
        directions=torch.cat([piece.directions for piece in pieces]),
        weights=Weights.joined([piece.weights for piece in pieces]), spectrum=_spectrum(forecaster, segments),
    )  # fmt: skip
    return Statistics.joined(parts), whole


def _pieces(
    forecaster: Forecaster,
    segments: Segments,
    calibrations: Sequence[Calibration],
    columns: Sequence[Column],
    usual: Usual | None,
) -> Iterator[tuple[Statistics, list[Tensor], Weights]]:
    """Statistics of some segments at a time, with the sensitivities and the weights of their errors."""
    recording = segments.recording
    # Segments of one recording share weights, and so stay in one chunk.
    for chosen in _chunks(recording):
        own = segments.select(chosen)
        starts = [calibrations[i] for i in chosen]
        base = forecaster.errors(*forecaster.system(own, starts), own)
        changes = forecaster.sensitivities(columns, own, starts, base)
        weights = Weights.of(base, own, forecaster.specimen.mesh.rest, usual)
        lines = _spectrum(forecaster, own).prominence(base)
        yield replace(reduced(weights, base, changes, recording[chosen]), lines=lines), changes, weights


def _spectrum(forecaster: Forecaster, segments: Segments) -> Spectrum:
    speeds = np.array([item.wind.speed for item in segments.items])
    return Spectrum.of(forecaster.markers, forecaster.specimen.mesh.rest, speeds, segments.period)


def _chunks(recording: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    chunks: list[list[int]] = [[]]
    for index in np.unique(recording):
        own = np.flatnonzero(recording == index).tolist()
        if chunks[-1] and len(chunks[-1]) + len(own) > _CHUNK:
            chunks.append([])
        chunks[-1] += own
    return [np.array(chunk) for chunk in chunks if chunk]


def reduced(weights: Weights, base: Tensor, changes: Sequence[Tensor], recording: NDArray[np.int64]) -> Statistics:
    """Of errors and sensitivities (frame, marker, 3, segment)."""
    mean = (base**2).mean((0, 2))  # (marker, segment)
    r = np.empty((len(recording), len(changes)))
    response = np.empty((len(recording), len(changes), len(changes)))
    stacked = torch.stack(list(changes))
    for place in range(len(recording)):
        error = weights.errors(base[..., place], place).double()
        moved = weights.scaled(stacked[..., place], place).double()
        weighed = weights.weighed(moved)
        inner = (weighed @ moved.T).cpu().numpy()
        length = np.sqrt(np.diag(inner))
        r[place] = (weighed @ error).cpu().numpy() / length
        response[place] = inner / length[:, None]
    return Statistics(
        recording=recording, r=r, response=response, error=mean.mean(0).double().cpu().numpy() * 3,
        marker_error=mean.T.double().cpu().numpy() * 3,
    )  # fmt: skip
