"""Whether a film shows the flag of a calibration, from the same place.

Three figures, each with a level above which a film is refused:

*shift*      What windows show beside the wind: each feature less its mean at the wind that is read
             (a quadratic, fitted on the calibration). The mean of these over a film, by
             Mahalanobis's distance with the scatter of the calibration's windows (Ledoit and Wolf
             2004), over the root of the number of features: how far a usual window of the film lies
             from those of the calibration, in standard deviations of a feature, less what means of
             as few windows scatter by in blocks of the calibration that were left out. Only windows
             that read a wind of the calibration count: beyond it, the quadratic is wrong of the
             same flag as well. Another angle of view, another direction of the wind or a quite
             different cloth shifts it. *background* Correlation of the pictures' details beside the
             flag, where there are any. *framing*    How far the hoist's ends are in the picture
             from where they were, in heights of the hoist. It counts only where no background shows
             the place, since a hoist is found less surely.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from flagdata.core.arrays import BoolArray, FloatArray
from flagdata.core.findings import Finding, Severity
from measure.measuring_model.window_features import Place
from models.trained.outliers import conformal_p, shrunk_covariance, whitening

SHIFT, FRAMING, BACKGROUND = 0.45, 0.2, 0.4
"""Levels, fixed on simulated flags of other seeds than those that judge (decision 047)."""
ENOUGH = 3
"""Windows of a calibration a feature below which their scatter is not known well enough to
recognise the flag. Higher asks for longer calibrations; lower compares with a scatter that is
noise."""
LEAST_WINDOWS, LEAST_SHARE = 3, 0.1
"""Windows, and share of the windows, that must read a wind of the calibration."""
_BLUR = 3.0
"""Width of what counts as light, not as detail, in a place's picture [px]. Wider keeps more of the
light in the picture, so that the same place in another light looks different."""
_DETAIL = 1.0
"""Deviation of the details [gray levels] below which a background shows no place. Higher finds no
place in plainer backgrounds; lower compares noise."""
_LEAST_PIXELS = 200
"""Pixels beside the flag that two pictures must share."""
_DEGREE = 2


@dataclass(frozen=True, kw_only=True, eq=False)
class Familiar:
    """What the windows of a calibration show beside the wind.

    Attributes:
        centre, spread: (column,) of the features.
        coefficients: (3, column) of their means at a wind, in standardised features: 1, wind, its
            square.
        whitening: (column, column) W with WᵀW the inverse of the residuals' covariance.
        distances: (n,) of windows that were left out with their block, ascending.
        low, high: winds between which films are compared: the middle 96 % of those that were read
            [m/s].
        noise: mean square of a component of the mean over a block's windows, times their number, of
            blocks left out: what the mean over one window would be off by if it were as slow as
            theirs.
    """

    centre: FloatArray
    spread: FloatArray
    coefficients: FloatArray
    whitening: FloatArray
    distances: FloatArray
    low: float
    high: float
    noise: float

    @classmethod
    def of(cls, values: FloatArray, winds: FloatArray, blocks: NDArray[np.int_]) -> Familiar:
        """Fits to windows (n, column), the winds read from them and their blocks of time (n,)."""
        fit = cls._fit_windows(values, winds)
        distances, noises = np.empty(len(winds)), []
        for block in np.unique(blocks):
            inside = blocks == block
            white = cls._fit_windows(values[~inside], winds[~inside])._white(
                values[inside], winds[inside]
            )
            distances[inside] = np.sqrt(np.square(white).mean(axis=1))
            noises.append(len(white) * float(np.square(white.mean(axis=0)).mean()))
        return cls(
            centre=fit.centre,
            spread=fit.spread,
            coefficients=fit.coefficients,
            whitening=fit.whitening,
            distances=np.sort(distances),
            low=fit.low,
            high=fit.high,
            noise=float(np.mean(noises)),
        )

    @classmethod
    def _fit_windows(cls, values: FloatArray, winds: FloatArray) -> Familiar:
        centre, spread = values.mean(axis=0), values.std(axis=0)
        spread = np.where(spread > 0, spread, 1.0)
        standard = (values - centre) / spread
        powers = np.vander(winds, _DEGREE + 1, increasing=True)
        coefficients = np.linalg.lstsq(powers, standard, rcond=None)[0]
        covariance, _ = shrunk_covariance(standard - powers @ coefficients)
        low, high = np.quantile(winds, [0.02, 0.98])
        return cls(
            centre=centre,
            spread=spread,
            coefficients=coefficients,
            distances=np.zeros(0),
            low=float(low),
            high=float(high),
            noise=0.0,
            whitening=np.asfortranarray(
                whitening(covariance, least=1e-12)
            ),  # the order of products' sums
        )

    def _white(self, values: FloatArray, winds: FloatArray) -> FloatArray:
        powers = np.vander(winds, _DEGREE + 1, increasing=True)
        return (
            (values - self.centre) / self.spread - powers @ self.coefficients
        ) @ self.whitening.T

    def distance(self, values: FloatArray, winds: FloatArray) -> FloatArray:
        """Computes the distance of windows (n, column) at the winds read from them, (n,)."""
        return np.sqrt(np.square(self._white(values, winds)).mean(axis=1))

    def p_value(self, values: FloatArray, winds: FloatArray) -> FloatArray:
        """Returns the conformal p (n,): the share of the calibration's windows that are as far."""
        return conformal_p(self.distances, self.distance(values, winds))

    def within(self, winds: FloatArray) -> BoolArray:
        """Returns which of these winds are within the range where films are compared, (n,)."""
        return (winds >= self.low) & (winds <= self.high)

    def shift(self, values: FloatArray, winds: FloatArray) -> float | None:
        """Returns how far the mean of windows (n, column) is, less the scatter of such means; NaN
        where too few windows are `within`, None where the calibration had too few windows to know
        their scatter."""
        if len(self.distances) < ENOUGH * len(self.centre):
            return None
        shared = self.within(winds)
        if shared.sum() < max(LEAST_WINDOWS, LEAST_SHARE * len(winds)):
            return math.nan
        square = float(np.square(self._white(values[shared], winds[shared]).mean(axis=0)).mean())
        return math.sqrt(max(square - self.noise / int(shared.sum()), 0.0))


@dataclass(frozen=True, kw_only=True)
class Compared:
    """A film beside the calibration.

    Attributes:
        shift: see `Familiar.shift`.
        framing: how far the hoist's ends are from where the nearest recording has them, in heights
            of its hoist; NaN where a hoist was not found, infinite where the flag flies to the
            other side.
        likeness: largest correlation of the backgrounds' details with those of a recording; NaN
            where there are none.
        same_shape: whether the picture is as wide for its height as that of a recording.
    """

    shift: float | None
    framing: float
    likeness: float
    same_shape: bool

    @classmethod
    def of(cls, shift: float | None, film_place: Place, places: Sequence[Place]) -> Compared:
        """Compares a film's place with the recordings' places."""
        same_shape = [
            place for place in places if place.background.shape == film_place.background.shape
        ]
        likenesses = [
            value
            for place in same_shape
            if not math.isnan(value := _correlation(film_place, place))
        ]
        return cls(
            shift=shift,
            framing=min(_away(film_place, place) for place in places),
            likeness=max(likenesses) if likenesses else math.nan,
            same_shape=bool(same_shape),
        )

    @property
    def figures(self) -> str:
        """Returns the figures in words."""
        phrases = ["the calibration is too short to recognise the flag"]
        if self.shift is not None:
            phrases = [f"its windows are shifted by {self.shift:.2f} standard deviations"]
        phrases.append(
            "the hoist was not found"
            if math.isnan(self.framing)
            else f"the hoist by {self.framing:.2f} of its height"
        )
        phrases.append(
            "no background shows the place"
            if math.isnan(self.likeness)
            else f"the backgrounds correlate by {self.likeness:.2f}"
        )
        return ", ".join(phrases)

    def reasons(self) -> list[Finding]:
        """Returns why the film is refused, the plainest reason first; empty where it is not."""
        findings = []
        if not self.same_shape:
            findings.append(
                _reason(
                    "another-picture",
                    "the picture is of another shape than that of the calibration",
                )
            )
        if self.likeness < BACKGROUND:
            sentence = (
                f"the pictures' backgrounds correlate by {self.likeness:.2f}, at least "
                f"{BACKGROUND:g} is required: the "
                "film may be from another place than the calibration"
            )
            findings.append(_reason("another-place", sentence, self.likeness))
        if math.isnan(self.likeness) and self.framing > FRAMING:
            beyond = math.isinf(self.framing)
            away = (
                "on the other side of the flag"
                if beyond
                else f"{self.framing:.2f} of its height away"
            )
            sentence = (
                f"the flag's hoist is not where it was in the picture: {away}, at most {FRAMING:g} "
                "is accepted"
            )
            findings.append(_reason("another-framing", sentence, None if beyond else self.framing))
        if self.shift is None:
            return findings
        if math.isnan(self.shift):
            findings.append(
                _reason(
                    "another-wind",
                    "hardly any window reads a wind in which the flag was calibrated",
                )
            )
        if self.shift > SHIFT:
            sentence = (
                f"what its windows show beside the wind is off by {self.shift:.2f} standard "
                "deviations, at most "
                f"{SHIFT:g} is accepted: it may be another flag than that of the calibration, or "
                "seen from another "
                "side of the wind"
            )
            findings.append(_reason("another-flag", sentence, self.shift))
        return findings


def _reason(kind: str, sentence: str, value: float | None = None) -> Finding:
    fix = (
        "calibrate this flag from this place and in such winds (flagdata calibrate), or leave "
        "--model out"
    )
    return Finding(kind=kind, severity=Severity.WARNING, what=sentence, value=value, fix=fix)


def _away(film_place: Place, recorded_place: Place) -> float:
    height = float(np.hypot(*(recorded_place.hoist[1] - recorded_place.hoist[0])))
    away = float(np.hypot(*(film_place.hoist - recorded_place.hoist).T).max()) / height
    return math.inf if film_place.side * recorded_place.side < 0 else away


def _correlation(first: Place, second: Place) -> float:
    """Correlates the details of two pictures of one shape; NaN where they share too few pixels."""
    shared = first.bare & second.bare
    if shared.sum() < _LEAST_PIXELS:
        return math.nan
    first_details, second_details = (
        _details(picture, shared)[shared] for picture in (first, second)
    )
    if min(float(first_details.std()), float(second_details.std())) < _DETAIL:
        return math.nan
    return float(np.corrcoef(first_details, second_details)[0, 1])


def _details(picture: Place, shared: BoolArray) -> FloatArray:
    """Subtracts a picture's lighting: its mean over the neighbourhood, of pixels without cloth
    alone."""
    weight = shared.astype(np.float32)
    light = cv2.GaussianBlur(picture.background * weight, (0, 0), _BLUR)
    total = cv2.GaussianBlur(weight, (0, 0), _BLUR)
    return np.asarray(picture.background - light / np.maximum(total, 1e-3), np.float64)
