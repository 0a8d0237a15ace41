"""A reading model: from what the windows of a film show to the wind at the flag, for one flag from one place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from measure.anemometer.features import OBSERVED, Features, Place
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
        filling: observable → its regression on the features that every window shows, for windows that do not show it.
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
    filling: Mapping[str, Ridge]
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
        """(w, column) the features that are used, gaps filled; rows of NaN where frames are missing."""
        columns = [features.names.index(name) for name in self.names]
        return filled(features.values[:, columns], features.whole, self.names, self.filling)

    def unseen(self, features: Features) -> dict[str, float]:
        """Observable that is used → share of the whole windows that do not show it, of those that lack any."""
        columns = {name: features.names.index(name) for name in self.names if name in OBSERVED}
        shares = {
            name: float(np.isnan(features.values[features.whole, column]).mean()) for name, column in columns.items()
        }
        return {name: share for name, share in shares.items() if share > 0}

    def read(self, used: Floats) -> Floats:
        """(w,) winds [m/s] of `used`; NaN where frames are missing."""
        return self.ridge(with_neighbours(used))


def filling_of(values: Floats, names: tuple[str, ...]) -> dict[str, Ridge]:
    """How what some windows do not show follows from what all of them show: name → regression on the columns of
    `complete`, of windows (n, column) of a calibration."""
    known = values[:, complete(names)]
    found = {}
    for column, name in enumerate(names):
        if name in OBSERVED:
            shown = np.isfinite(values[:, column])
            found[name] = Ridge.fitted(known[shown], values[shown, column], float(shown.sum()))
    return found


def complete(names: tuple[str, ...]) -> NDArray[np.bool_]:
    """(column,) of features that every whole window shows: all but observables."""
    return np.array([name not in OBSERVED for name in names])


def filled(values: Floats, whole: NDArray[np.bool_], names: tuple[str, ...], filling: Mapping[str, Ridge]) -> Floats:
    """Values (w, column) with what a whole window does not show as it follows from the rest; rows of NaN where frames
    are missing."""
    out = np.where(whole[:, None], values, np.nan)
    known = out[:, complete(names)]
    for column, name in enumerate(names):
        missing = whole & ~np.isfinite(out[:, column])
        if missing.any():
            out[missing, column] = filling[name](known[missing])
    return out
