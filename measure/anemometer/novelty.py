"""Whether a film shows the flag of a calibration, from the same place.

Three figures, each with a level above which a film is refused:

*shift*      What windows show beside the wind: each feature less its mean at the wind that is read (a quadratic, fitted
             on the calibration). The mean of these over a film, by Mahalanobis's distance with the scatter of the
             calibration's windows (Ledoit and Wolf 2004), over the root of the number of features: how far a usual
             window of the film lies from those of the calibration, in standard deviations of a feature. Another cloth,
             another angle of view or another direction of the wind shifts it.
*framing*    How far the hoist's ends are in the picture from where they were, in heights of the hoist.
*background* Correlation of the pictures' details beside the flag, where there are any.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from flagdata.findings import Finding, Severity
from measure.anemometer.features import Place
from models.outliers import shrunk_covariance

Floats = NDArray[np.float64]

_BLUR = 3.0
"""Width of what counts as light, not as detail, in a place's picture [px]."""
_DETAIL = 1.0
"""Deviation of the details [gray levels] below which a background shows no place."""
_LEAST_PIXELS = 200
"""Pixels beside the flag that two pictures must share."""
_DEGREE = 2


@dataclass(frozen=True, kw_only=True, eq=False)
class Familiar:
    """What the windows of a calibration show beside the wind.

    Attributes:
        centre, spread: (column,) of the features.
        coefficients: (3, column) of their means at a wind, in standardised features: 1, wind, its square.
        whitening: (column, column) W with WᵀW the inverse of the residuals' covariance.
        distances: (n,) of windows that were left out with their block, ascending.
    """

    centre: Floats
    spread: Floats
    coefficients: Floats
    whitening: Floats
    distances: Floats

    @classmethod
    def of(cls, values: Floats, winds: Floats, blocks: NDArray[np.int_]) -> Familiar:
        """Of windows (n, column), the winds that were read of them and their blocks of time (n,)."""
        whole = cls._fitted(values, winds)
        distances = np.empty(len(winds))
        for block in np.unique(blocks):
            inside = blocks == block
            distances[inside] = cls._fitted(values[~inside], winds[~inside]).distance(values[inside], winds[inside])
        return cls(
            centre=whole.centre, spread=whole.spread, coefficients=whole.coefficients, whitening=whole.whitening,
            distances=np.sort(distances),
        )  # fmt: skip

    @classmethod
    def _fitted(cls, values: Floats, winds: Floats) -> Familiar:
        centre, spread = values.mean(axis=0), values.std(axis=0)
        spread = np.where(spread > 0, spread, 1.0)
        standard = (values - centre) / spread
        powers = np.vander(winds, _DEGREE + 1, increasing=True)
        coefficients = np.linalg.lstsq(powers, standard, rcond=None)[0]
        covariance, _ = shrunk_covariance(standard - powers @ coefficients)
        own, vectors = np.linalg.eigh(covariance)
        return cls(
            centre=centre, spread=spread, coefficients=coefficients, distances=np.zeros(0),
            whitening=(vectors / np.sqrt(np.maximum(own, 1e-12))).T,
        )  # fmt: skip

    def _white(self, values: Floats, winds: Floats) -> Floats:
        powers = np.vander(winds, _DEGREE + 1, increasing=True)
        return ((values - self.centre) / self.spread - powers @ self.coefficients) @ self.whitening.T

    def distance(self, values: Floats, winds: Floats) -> Floats:
        """(n,) of windows (n, column) at the winds that are read of them."""
        return np.sqrt(np.square(self._white(values, winds)).mean(axis=1))

    def p_value(self, values: Floats, winds: Floats) -> Floats:
        """(n,) conformal p of a window of the calibration being as far."""
        nearer = np.searchsorted(self.distances, self.distance(values, winds), side="left")
        return (1 + len(self.distances) - nearer) / (len(self.distances) + 1)

    def shift(self, values: Floats, winds: Floats) -> float:
        """Distance of the mean of windows (n, column); see the module."""
        return float(np.sqrt(np.square(self._white(values, winds).mean(axis=0)).mean()))


def framing(here: Place, places: Sequence[Place]) -> float:
    """How far the hoist's ends are from where the nearest calibration has them, in heights of its hoist; NaN where a
    hoist was not found, infinite where the flag flies to the other side."""
    found = []
    for one in places:
        height = float(np.hypot(*(one.hoist[1] - one.hoist[0])))
        away = float(np.hypot(*(here.hoist - one.hoist).T).max()) / height
        found.append(math.inf if here.side * one.side < 0 else away)
    return min(found)


def likeness(here: Place, places: Sequence[Place]) -> float:
    """Largest correlation of the backgrounds' details with those of a calibration; NaN where there are none."""
    found = [_correlation(here, one) for one in places]
    known = [value for value in found if not math.isnan(value)]
    return max(known) if known else math.nan


def _correlation(one: Place, other: Place) -> float:
    if one.background.shape != other.background.shape:
        return -1.0
    shared = one.bare & other.bare
    if shared.sum() < _LEAST_PIXELS:
        return math.nan
    own, others = (_details(place, shared)[shared] for place in (one, other))
    if min(float(own.std()), float(others.std())) < _DETAIL:
        return math.nan
    return float(np.corrcoef(own, others)[0, 1])


def _details(place: Place, shared: NDArray[np.bool_]) -> Floats:
    """The picture less its light: its mean over the neighbourhood, of bare places alone."""
    weight = shared.astype(np.float32)
    light = cv2.GaussianBlur(place.background * weight, (0, 0), _BLUR)
    total = cv2.GaussianBlur(weight, (0, 0), _BLUR)
    return np.asarray(place.background - light / np.maximum(total, 1e-3), np.float64)


SHIFT, FRAMING, BACKGROUND = 1.0, 0.2, 0.4
"""Levels, fixed on simulated flags of other seeds than those that judge (decision 047)."""


def reasons(*, shift: float, framing: float, likeness: float) -> list[Finding]:
    """Why a film is refused, the plainest reason first; empty where it is not.

    Args:
        shift, framing, likeness: as `Familiar.shift`, `framing` and `likeness`; NaN where one is not known.
    """
    found = []
    if likeness < BACKGROUND:
        found.append(
            Finding(
                kind="another-place", severity=Severity.WARNING, value=likeness,
                what="the film is from another place than the calibration: the pictures' backgrounds correlate by "
                f"{likeness:.2f}, at least {BACKGROUND:g} is required",
                fix=_AGAIN,
            )
        )  # fmt: skip
    if framing > FRAMING:
        away = "on the other side" if math.isinf(framing) else f"{framing:.2f} of its height away"
        found.append(
            Finding(
                kind="another-framing", severity=Severity.WARNING, value=None if math.isinf(framing) else framing,
                what=f"the flag's hoist is not where it was in the picture: {away}, at most {FRAMING:g} is accepted",
                fix=_AGAIN,
            )
        )  # fmt: skip
    if shift > SHIFT:
        found.append(
            Finding(
                kind="another-flag", severity=Severity.WARNING, value=shift,
                what="the film does not show the flag of the calibration, or not from the same side of the wind: what "
                f"its windows show beside the wind is off by {shift:.2f} standard deviations, at most {SHIFT:g} is "
                "accepted",
                fix=_AGAIN,
            )
        )  # fmt: skip
    return found


_AGAIN = "calibrate this flag from this place (flagdata calibrate), or leave --model out"
