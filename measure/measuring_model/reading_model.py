"""A reading model: from what the windows of a film show to the wind at the flag, for one flag from
one place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flagdata.core.arrays import FloatArray
from measure.film.similarity import FlagSize
from measure.measuring_model.novelty import Familiar
from measure.measuring_model.regression import Ridge, with_neighbours
from measure.measuring_model.window_features import Features, Place


@dataclass(frozen=True, kw_only=True, eq=False)
class ReadingModel:
    """A flag that was calibrated beside an anemometer.

    Attributes:
        network, identity: name of the network whose summary is used, and SHA-256 of its card and
            weights.
        size: of the flag.
        step: length of a window [s].
        names: of the features that are used.
        ridge: from these features and the neighbours' to the wind.
        winds: (n,) of the log over the windows that it was fitted to, in the order of time [m/s].
        errors: (n,) of these less what is read without their block of time [m/s].
        block: windows of a block of time.
        familiar: what windows show beside the wind.
        places: of the cameras of the recordings.
    """

    network: str
    identity: str
    size: FlagSize
    step: float
    names: tuple[str, ...]
    ridge: Ridge
    winds: FloatArray
    errors: FloatArray
    block: int
    familiar: Familiar
    places: tuple[Place, ...]

    @property
    def rmse(self) -> float:
        """Of what is read of windows without their block of time, against the log [m/s]."""
        return float(np.sqrt(np.mean(self.errors**2)))

    @property
    def range(self) -> tuple[float, float]:
        """Least and greatest wind of the windows that it was fitted to [m/s]."""
        return float(self.winds.min()), float(self.winds.max())

    def used(self, features: Features) -> FloatArray:
        """Selects the features that are used, (w, column); rows of NaN where frames are missing."""
        return features.values[:, [features.names.index(name) for name in self.names]]

    def read(self, used: FloatArray) -> FloatArray:
        """Reads winds (w,) [m/s] from `used`; NaN where frames are missing."""
        return self.ridge(with_neighbours(used))
