"""A reading model: from what the windows of a film show to the wind at the flag, for one flag from one place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import InputError
from measure.anemometer.features import Features, Place
from measure.anemometer.novelty import Familiar
from measure.anemometer.regression import Ridge, with_neighbours
from measure.estimate.similarity import FlagSize

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class ReadingModel:
    """A flag that was calibrated beside an anemometer.

    Attributes:
        network, identity: name of the network whose summary is used, and SHA-256 of its card and weights.
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
    winds: Floats
    errors: Floats
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

    def used(self, features: Features) -> Floats:
        """(w, column) the features that are used, gaps filled; rows of NaN where frames are missing.

        Raises:
            InputError: a film that does not show one of them.
        """
        columns = [features.names.index(name) for name in self.names]
        return filled(features.values[:, columns], features.whole, self.names, where=features.film)

    def read(self, used: Floats) -> Floats:
        """(w,) winds [m/s] of `used`; NaN where frames are missing."""
        return self.ridge(with_neighbours(used))


def filled(values: Floats, whole: NDArray[np.bool_], names: tuple[str, ...], *, where: str) -> Floats:
    """Values (w, column) with those that a whole window does not show interpolated in time.

    Raises:
        InputError: a column that no window shows.
    """
    out = np.where(whole[:, None], values, np.nan)
    places = np.arange(len(values))
    for column, name in enumerate(names):
        known = np.isfinite(out[:, column])
        if not known.any():
            raise InputError(
                f"no window shows {name}, which the reading model uses", where=where,
                fix="give --crop around the whole flag and its pole",
            )  # fmt: skip
        missing = whole & ~known
        out[missing, column] = np.interp(places[missing], places[known], out[known, column])
    return out
