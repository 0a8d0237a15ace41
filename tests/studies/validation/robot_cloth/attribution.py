"""What a calibrated model of a held cloth lacks: effects of the tracker and of the cloth, added one
after another.

Each candidate is fitted beside the cloth's parameters on all programmes but one of those that are
known, and judged on that one, each in turn. It leads where the mean square error of the lower
halves falls by more than `LEAD` standard errors over recordings, and, for an effect of the cloth,
by more than a finer mesh of the same model changes it. The one that gains most of those that lead
is added, and all others are tried again beside it, until none leads. Programmes that are held out
take no part in this.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import rankdata

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import stream
from tests.studies.validation.robot_cloth.calibrate import Fit, calibrated
from tests.studies.validation.robot_cloth.model import Cloth, predicted
from tests.studies.validation.robot_cloth.reading import Swing
from tests.studies.validation.robot_cloth.tracker import TRACKER, latencies, left, shifts, upper

OF_CLOTH = (
    "tangential-linear-drag",
    "tangential-quadratic-drag",
    "power-law-drag",
    "lift",
    "added-mass",
    "reactive-loading",
    "porosity",
    "hem-mass",
    "hem-stiffness",
    "rest-curvature",
)
"""Effects of the library with one strength that act in still air. `air-density` is left out: the
calibrated density stands for the ratio of mass to drag."""
LEAD = 2.0
"""Standard errors over recordings by which a candidate must gain."""
_TRIED = 2  # iterations of a candidate's fit, which begins at the fit without it
_SHUFFLES = 1000


@dataclass(frozen=True, kw_only=True)
class Gain:
    """Mean square error that a candidate takes off the lower halves of programmes it was not fitted
    to [m²].

    Attributes:
        name: of the candidate.
        value: mean over recordings, before − after.
        error: its standard error.
        floor: what it must gain at least: for an effect of the cloth, what a finer mesh changes.
    """

    name: str
    value: float
    error: float
    floor: float = 0.0

    @property
    def leads(self) -> bool:
        """Whether it is beyond `LEAD` standard errors and the floor."""
        return self.value > max(LEAD * self.error, self.floor)


@dataclass(frozen=True, kw_only=True)
class Round:
    """One choice: the gains of all candidates, largest first, and which was added; "" for none."""

    gains: tuple[Gain, ...]
    added: str


def sought(
    cloth: Cloth,
    swings: Mapping[str, Sequence[Swing]],
    start: Fit,
    *,
    candidates: Sequence[str] = (*TRACKER, *OF_CLOTH),
    advance: Callable[[int], None] | None = None,
) -> list[Round]:
    """The rounds of choice, the last of which adds nothing.

    Args:
        swings: programme → its repeats; at least two programmes.
        start: the calibrated model without any effect.
        advance: called after each candidate.
    """
    folds = [
        (
            [swing for name, own in swings.items() if name != left_out for swing in own],
            list(swings[left_out]),
        )
        for left_out in swings
    ]
    fits = [calibrated(cloth, known, start) for known, _ in folds]
    before = _judged(cloth, folds, fits)
    rounds: list[Round] = []
    open_ = list(candidates)
    while True:
        tried: dict[str, list[Fit]] = {}
        for name in open_:
            tried[name] = [
                calibrated(cloth, known, fit.with_effect(name), iterations=_TRIED)
                for (known, _), fit in zip(folds, fits, strict=True)
            ]
            if advance is not None:
                advance(1)
        squares = {name: _judged(cloth, folds, own) for name, own in tried.items()}
        floor = _numerics(cloth, folds, fits, before)
        found = (
            _gain(name, before - own, 0.0 if name in TRACKER else floor)
            for name, own in squares.items()
        )
        gains = sorted(found, key=lambda own: -own.value)
        chosen = next((gain.name for gain in gains if gain.leads), "")
        rounds.append(Round(gains=tuple(gains), added=chosen))
        if not chosen:
            return rounds
        open_.remove(chosen)
        fits, before = tried[chosen], squares[chosen]


def _judged(
    cloth: Cloth, folds: Sequence[tuple[list[Swing], list[Swing]]], fits: Sequence[Fit]
) -> FloatArray:
    return np.concatenate(
        [
            lower(left_errors(cloth, unseen, fit))
            for (_, unseen), fit in zip(folds, fits, strict=True)
        ]
    )


def _numerics(
    cloth: Cloth,
    folds: Sequence[tuple[list[Swing], list[Swing]]],
    fits: Sequence[Fit],
    before: FloatArray,
) -> float:
    """By how much twice as fine a mesh changes the mean square error of the lower halves [m²], up
    or down."""
    finer = _judged(replace(cloth, cells=2 * cloth.cells), folds, fits)
    return abs(float((finer - before).mean()))


def _gain(name: str, gained: FloatArray, floor: float) -> Gain:
    error = float(gained.std(ddof=1) / np.sqrt(len(gained)))
    return Gain(name=name, value=float(gained.mean()), error=error, floor=floor)


def left_errors(cloth: Cloth, swings: Sequence[Swing], fit: Fit) -> list[FloatArray]:
    """(frame, node, 3) errors on each recording [m], with its own latencies where the model has
    any."""
    return left(
        swings,
        predicted(cloth, swings, [fit.parameters] * len(swings)),
        fit.tracker,
        fit.parameters.lag,
    )


def lower(of: Sequence[FloatArray]) -> FloatArray:
    """(recording,) mean square distance of the nodes of the lower half [m²]."""
    below = ~upper(round(of[0].shape[1] ** 0.5))
    return np.array([np.nanmean((error[:, below] ** 2).sum(axis=2)) for error in of])


@dataclass(frozen=True, kw_only=True)
class Late:
    """Whether latencies are what the name says, on recordings that no parameter was fitted to.

    Attributes:
        deviation: standard deviation of the latencies [s].
        rank_correlation: Spearman's, of a frame's latency with the interval of stamps before it,
            mean over recordings. Stamps that are late one by one follow long intervals; the fit
            knows nothing of intervals.
        p: chance of as large a one if latencies are shuffled within their recordings.
        control: mean square error of the lower halves with as free a vertical shift of each frame
            instead [m²].
        without, with_: mean square error without latencies, and with them [m²].
    """

    deviation: float
    rank_correlation: float
    p: float
    control: float
    without: float
    with_: float


def late(cloth: Cloth, swings: Sequence[Swing], fit: Fit, *, without: Fit, seed: int) -> Late:
    """What latencies look like, and what another freedom of each frame does in their place.

    Args:
        without: the same model fitted without latencies.
        seed: of the shuffles.
    """
    runs = predicted(cloth, swings, [fit.parameters] * len(swings))
    found = [
        latencies(s, run, fit.tracker, fit.parameters.lag)[1:]
        for s, run in zip(swings, runs, strict=True)
    ]
    intervals = [np.diff(swing.times) for swing in swings]
    rng = stream(seed, "held", "latencies")

    def correlation(of: Sequence[FloatArray]) -> float:
        ranks = (tuple(map(rankdata, pair)) for pair in zip(of, intervals, strict=True))
        return float(np.mean([np.corrcoef(*pair)[0, 1] for pair in ranks]))

    own = correlation(found)
    as_large = sum(
        correlation([rng.permutation(values) for values in found]) >= own for _ in range(_SHUFFLES)
    )
    plain = predicted(cloth, swings, [without.parameters] * len(swings))
    lag = without.parameters.lag
    shifted: list[FloatArray] = []
    unshifted = left(swings, plain, without.tracker, lag)
    for swing, run, error in zip(swings, plain, unshifted, strict=True):
        moved = error.copy()
        moved[..., 2] -= shifts(swing, run, without.tracker, lag)[:, None]
        shifted.append(moved)
    return Late(
        deviation=float(np.concatenate(found).std()),
        rank_correlation=own,
        p=(1 + as_large) / (1 + _SHUFFLES),
        control=float(lower(shifted).mean()),
        without=float(lower(unshifted).mean()),
        with_=float(lower(left(swings, runs, fit.tracker, fit.parameters.lag)).mean()),
    )
