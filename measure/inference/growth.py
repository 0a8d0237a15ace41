"""How what numerics leave grows with the damping of the cloth.

Prediction errors of a cloth that is hardly damped are mostly folds that no mesh shows alike; a
damped one moves smoothly, and what the fit's mesh does wrongly is then most of its errors. So what
lies along the columns, over the errors' own size, is larger the more the cloth is damped: by a
power of the damping, which is found among the nulls.
"""

from __future__ import annotations

import numpy as np

from flagdata.core.arrays import FloatArray


def power(sizes: FloatArray, damping: FloatArray) -> float:
    """Estimates by which power of the damping sizes grow: least squares of their logarithms, taken
    back toward 0 by what chance makes of it. It is 0 within two standard errors, so that few
    experiments of extreme damping lead nowhere, and where the damping does not vary.

    Args:
        sizes: (experiment,) positive.
        damping: (experiment,) its logarithm.
    """
    about = damping - damping.mean()
    spread = float(about @ about)
    if len(sizes) <= 2 or spread < np.finfo(np.float64).eps:
        return 0.0
    size = np.log(np.maximum(sizes, np.finfo(np.float64).tiny))
    slope = float(about @ size) / spread
    residuals = size - size.mean() - slope * about
    error = float(residuals @ residuals) / (len(sizes) - 2) / spread
    return slope * max(0.0, 1 - 2**2 * error / slope**2) if slope else 0.0
