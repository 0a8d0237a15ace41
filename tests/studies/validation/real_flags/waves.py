"""The wave along a sheet's middle line: its leading complex orthogonal mode.

The deflection y(t, s) at points s fixed in the cloth is made complex by its Hilbert transform in
time; the leading eigenvector of its covariance over s is the travelling shape (Feeny, J. Sound Vib.
310:169, 2008). Its phase falls along s by 2π in a wavelength; the mode's own phase in time turns by
2π in a period.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import hilbert

from flagdata.core.arrays import FloatArray

FROM = 0.3
"""Share of the length from which on the phase is read: nearer to the hoist the wave hardly
moves."""


@dataclass(frozen=True, kw_only=True)
class Waves:
    """A travelling wave.

    Attributes:
        frequency: [Hz].
        length: over the length of the sheet; NaN where the phase does not fall along it.
        share: of the variance that the mode explains.
    """

    frequency: float
    length: float
    share: float


def waves(deflection: FloatArray, along: FloatArray, rate: float) -> Waves:
    """The wave in a deflection.

    Args:
        deflection: (time, point) across the stream, any unit.
        along: (point,) rising, over the sheet's length.
        rate: instants a second [Hz].
    """
    moving = deflection - deflection.mean(0)
    analytic = np.asarray(hilbert(moving, axis=0))
    trim = len(analytic) // 20  # the transform is wrong at the ends
    analytic = analytic[trim:-trim]
    _, sizes, shapes = np.linalg.svd(analytic, full_matrices=False)
    shape = shapes[0]
    course = analytic @ shape.conj()
    turn = np.angle((course[1:] * course[:-1].conj()).sum())
    read = along >= FROM
    steps = np.angle(shape[read][1:] * shape[read][:-1].conj())
    weights = np.abs(shape[read][1:] * shape[read][:-1])
    slope = float((weights * steps / np.diff(along[read])).sum() / weights.sum())
    return Waves(
        frequency=float(turn) * rate / (2 * np.pi),
        length=-2 * np.pi / slope if slope < 0 else float("nan"),
        share=float(sizes[0] ** 2 / (sizes**2).sum()),
    )
