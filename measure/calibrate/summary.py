"""What all windows of a recording say together: each observable at the log's mean wind, and how it changes with wind.

    y_w = a + b ln(U_w/⟨U⟩) + n_w

by least squares over the windows that show it. a and b of a simulation scatter about those of another one of the same
cloth as n_w lets them, correlated between neighbouring windows or not: so no correlation has to be modelled.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flagdata.arrays import BoolArray, FloatArray

SHOWN = 0.6
"""Share of the windows that are to show an observable."""
LEAST_WINDOWS = 4
"""Fewest windows of a recording: 10 s."""
LEAST_IN_ALL = 8
"""Fewest windows of all recordings of a cloth together: 20 s."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Projection:
    """From windows to summaries.

    Attributes:
        speed: (window,) mean of the logged wind [m/s].
        changes: whether slopes are taken: not where the wind is constant.
    """

    speed: FloatArray
    changes: bool

    @property
    def regressors(self) -> FloatArray:
        """(window, 1 or 2)."""
        relative = np.log(self.speed / np.exp(np.log(self.speed).mean()))
        constant = np.ones_like(relative)
        return np.stack([constant, relative], axis=1) if self.changes else constant[:, None]

    def of(self, readings: FloatArray) -> FloatArray:
        """(…, 1 or 2, observable) of readings (…, window, observable); NaN where too few windows show one."""
        x = self.regressors
        there = np.isfinite(readings)
        y = np.where(there, readings, 0.0)
        products = np.einsum("wi,wj,...wk->...kij", x, x, there.astype(np.float64))
        enough = there.mean(axis=-2) >= SHOWN
        products = np.where(enough[..., None, None], products, np.eye(x.shape[1]))
        right = np.einsum("wi,...wk->...ki", x, y)
        found = np.linalg.solve(products, right[..., None])[..., 0]
        return np.swapaxes(np.where(enough[..., None], found, np.nan), -1, -2)

    def at(self, summaries: FloatArray) -> FloatArray:
        """(…, window, observable) that summaries stand for."""
        return np.einsum("wi,...ik->...wk", self.regressors, summaries)


def shown(readings: FloatArray) -> BoolArray:
    """(observable,) whether enough windows (window, observable) show it."""
    return np.asarray(np.isfinite(readings).mean(axis=0) >= SHOWN)
