"""Narrow lines in the spectra of errors, at frequencies that go with the wind: what sheds vortices
upwind leaves them.

Forces that come and go within a segment average to nothing along every steady column. A body of
width D sheds at f = St U/D, St about 0.2 (Roshko, NACA TN 3169, 1954), so f/U is the same in all
winds. Each segment's errors, projected on cos(π i u/W) along each axis of the world, have a
periodogram; its prominence at a reduced frequency is the power there over the median of the
neighbourhood, and that of some segments is the geometric mean: a line that one of them shows alone
is none that goes with the wind.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from flagdata.core.arrays import FloatArray, IntArray
from measure.forecasting.regressors import cosine

REDUCED: FloatArray = np.geomspace(1.0, 4.0, 70)
"""f/U [1/m]: bodies 5 to 20 cm wide. Below are the harmonics of the flutter of a flag of 1.5 m, at
about 0.3, by which nulls of some numerics stand out. 2 % apart: less than the lines' own width."""
SHAPES = tuple((i, 0) for i in range(5))
STROUHAL = 0.2
"""f D/U of a circular cylinder from Re 300 to 2e5 (Roshko 1954)."""
_POINTS = 128
"""Points of a transform: finer than what segments of 50 frames resolve."""
_NEAR = 2.0
"""Hz to either side that a line is compared with; a segment of 2 s resolves 1 Hz (Hann's
window)."""
_EDGE = 0.5
"""Hz below the highest frequency that lines are sought."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Spectrum:
    """What periodograms of segments are taken along.

    Attributes:
        shapes: (shape, marker) weights.
        speeds: (segment,) of the wind [m/s].
        period: between the frames [s].
    """

    shapes: FloatArray
    speeds: FloatArray
    period: float

    @classmethod
    def of(
        cls, markers: FloatArray, rest: FloatArray, speeds: FloatArray, period: float
    ) -> Spectrum:
        """Makes the shapes of markers (marker, 2) on a cloth (vertex, 2) [m]."""
        shapes = np.stack([cosine(mode, markers, rest) for mode in SHAPES]) / len(markers)
        return cls(shapes=shapes, speeds=speeds, period=period)

    def prominence(self, errors: Tensor) -> FloatArray:
        """Computes the prominence (segment, reduced frequency, shape · axis) of errors (frame,
        marker, 3, segment) [m]; NaN where the frames are too few a second."""
        power, frequency = self._power(errors), self._frequency
        around = np.stack(
            [np.median(power[np.abs(frequency - f) <= _NEAR], axis=0) for f in frequency]
        )
        return self._with_the_wind(power / np.maximum(around, np.finfo(np.float64).tiny))

    def _power(self, errors: Tensor) -> FloatArray:
        """Computes the power (frequency, segment, shape · axis) [m²]."""
        frames, segments = errors.shape[0], errors.shape[3]
        shapes = torch.as_tensor(self.shapes, dtype=errors.dtype, device=errors.device)
        course = (
            torch.einsum("km,fmcs->fskc", shapes, errors)
            .reshape(frames, segments, -1)
            .double()
            .cpu()
            .numpy()
        )
        window = np.hanning(frames + 2)[1:-1, None, None]
        spectrum = np.fft.rfft((course - course.mean(axis=0)) * window, _POINTS, axis=0)
        return spectrum.real**2 + spectrum.imag**2

    @property
    def _frequency(self) -> FloatArray:
        """Frequencies of the transforms [Hz]."""
        return np.asarray(np.fft.rfftfreq(_POINTS, self.period), dtype=np.float64)

    def _with_the_wind(self, values: FloatArray) -> FloatArray:
        """Selects (segment, reduced frequency, shape · axis) of (frequency, segment, shape · axis);
        NaN where the frames are too few a second, or where there is no wind that anything could be
        shed in."""
        frequency = self._frequency
        at_reduced = np.full((values.shape[1], len(REDUCED), values.shape[2]), np.nan)
        for segment, speed in enumerate(self.speeds):
            sought = REDUCED * speed
            resolved = (sought > 0) & (sought < frequency[-1] - _EDGE)
            at_reduced[segment, resolved] = values[
                np.rint(sought[resolved] / frequency[1]).astype(int), segment
            ]
        return at_reduced


@dataclass(frozen=True, kw_only=True)
class SpectralLine:
    """The most prominent one.

    Attributes:
        far: how prominent, in nulls' standard deviations.
        reduced: its frequency over the wind's speed [1/m].
        direction: place among shapes · axes in which the errors swing most.
    """

    far: float
    reduced: float
    direction: int

    @property
    def axis(self) -> int:
        """Along which: 0, 1 or 2."""
        return self.direction % 3


@dataclass(frozen=True, kw_only=True, eq=False)
class Lines:
    """How prominent lines are in nulls.

    Attributes:
        mean, deviation: (shape · axis,) of the logarithm of the most prominent line's power.
    """

    mean: FloatArray
    deviation: FloatArray

    @classmethod
    def of(cls, groups: FloatArray) -> Lines:
        """Describes the lines of null groups (group, shape · axis): see `strongest`."""
        return cls(mean=groups.mean(axis=0), deviation=np.maximum(groups.std(axis=0), 1e-6))

    def standing_out(self, groups: FloatArray) -> FloatArray:
        """Computes how far each group is from nulls' mean, in their standard deviations, at the
        shape and axis where it is farthest, (group,)."""
        return ((groups - self.mean) / self.deviation).max(axis=1)

    def line(self, prominence: FloatArray, *, centre: float, width: float) -> SpectralLine:
        """Finds the line in some segments (segment, reduced frequency, shape · axis).

        Args:
            centre, width: mean and standard deviation of nulls' `standing_out`.
        """
        values, places = _strongest(prominence)
        across = (values - self.mean) / self.deviation
        best = int(np.argmax(across))
        return SpectralLine(
            far=float((across[best] - centre) / width),
            reduced=float(REDUCED[places[best]]),
            direction=best,
        )


def strongest(prominence: FloatArray) -> FloatArray:
    """Computes the logarithm of the most prominent line's power, (shape · axis,), its mean over
    segments (segment, reduced frequency, shape · axis); only frequencies that at least half of them
    can show."""
    return _strongest(prominence)[0]


def _strongest(prominence: FloatArray) -> tuple[FloatArray, IntArray]:
    resolved = np.flatnonzero(np.isfinite(prominence[:, :, 0]).mean(axis=0) >= 0.5)
    if not len(resolved):  # too few frames a second for any: as prominent as its neighbourhood
        return np.zeros(prominence.shape[2]), np.zeros(prominence.shape[2], dtype=np.int64)
    mean = np.nanmean(
        np.log(np.maximum(prominence[:, resolved], np.finfo(np.float64).tiny)), axis=0
    )
    places = mean.argmax(axis=0)
    return mean.max(axis=0), resolved[places]
