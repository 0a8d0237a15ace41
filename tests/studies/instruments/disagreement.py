"""A table's observable against an anemometer's log: the flag's law and the anemometer's effects
fitted together.

A flag's observable y follows the wind by a power law above its value at rest, u = c (y² −
y₀²)^(p/2): y is a root mean square, to which what moves at rest adds in squares. The anemometer
reads a chain of the library's sensor effects of u, and its clock may be off:

    m(t + b) = chain(u)(t) + error,

both as means over the spans of the table's rows. The error's variance is a² + (s u)²: a flag is
read to a share of the wind, and in still air an anemometer shows its zero as often as it is asked.
c, p, the strengths, a and s are those of the greatest likelihood; a strength that is known
beforehand counts by its standard uncertainty. A gain of
the anemometer and c are one number here: only a flag whose law is known separates them.

Rows overlap and errors last: standard errors are of the fit without each block of time in turn
(delete-a-block jackknife, Künsch 1989). An effect's share is what errors change by where it alone
is taken away.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.optimize import minimize
from scipy.stats import qmc

from flagdata.core.arrays import BoolArray, FloatArray, IntArray
from flagdata.core.rng import stream
from flagdata.core.stated import Stated
from flagdata.errors import InputError
from tests.studies.instruments.chain import Chain, about

_FEWEST = 12
_EXPONENTS = (0.2, 3.0)
# A log has steps of 0.01 m/s; a flag is not read better than to half a per cent.
_NOISE = ((math.log(0.005), math.log(2.0)), (math.log(0.005), math.log(1.0)))
_STARTS = 4
_STEPS = 1500
_ROUNDS = 5
_GAIN = 1e-3
"""Of a log-likelihood, twice: below it a search has ended."""
_STILL = 1e-3  # m/s: what a flag at rest is taken to show, so that no logarithm fails


@dataclass(frozen=True, kw_only=True, eq=False)
class Rows:
    """An observable against time.

    Attributes:
        times: (n,) middles of the rows' spans on the table's clock, ascending [s].
        span: of a row [s].
        values: (n,) root mean squares or other values that rise with the wind from `rest` on.
        rest: value of a flag in still air.

    Raises:
        InputError: shapes that disagree, times that do not ascend, or values that are not finite.
    """

    times: FloatArray
    span: float
    values: FloatArray
    rest: float = 0.0

    def __post_init__(self) -> None:
        if (
            self.times.shape != self.values.shape
            or self.times.ndim != 1
            or len(self.times) < _FEWEST
        ):
            raise InputError(
                f"{self.times.shape} times and {self.values.shape} values",
                where="rows",
                fix=f"give (n,) each, {_FEWEST} or more",
            )
        if (
            not (np.diff(self.times) > 0).all()
            or not np.isfinite(self.values).all()
            or not self.span > 0
        ):
            raise InputError(
                "times that do not ascend, or values that are not finite",
                where="rows",
                fix="leave such rows out",
            )

    @property
    def excess(self) -> FloatArray:
        """(n,) above what is there at rest."""
        return np.sqrt(np.maximum(np.square(self.values) - self.rest**2, 0.0))


@dataclass(frozen=True, kw_only=True, eq=False)
class Readings:
    """A log of the wind.

    Attributes:
        times: (m,) on its own clock, ascending [s].
        speed: (m,) as it was logged [m/s].
    """

    times: FloatArray
    speed: FloatArray

    @cached_property
    def _run(self) -> FloatArray:
        steps = np.diff(self.times)
        return np.concatenate([[0.0], np.cumsum(steps * (self.speed[1:] + self.speed[:-1]) / 2)])

    def means(self, middles: FloatArray, span: float) -> FloatArray:
        """(n,) means over spans of its own clock, linear between samples; NaN where the log does
        not cover one."""
        low, high = middles - span / 2, middles + span / 2
        mean = (
            np.interp(high, self.times, self._run) - np.interp(low, self.times, self._run)
        ) / span
        return np.where((low >= self.times[0]) & (high <= self.times[-1]), mean, np.nan)


@dataclass(frozen=True, kw_only=True)
class Law:
    """What wind an observable stands for.

    Attributes:
        scale: the wind at an excess of `reference` [m/s], so that it hardly depends on the
            exponent.
        exponent: p.
        reference: in the observable's unit.
    """

    scale: float
    exponent: float
    reference: float = 1.0

    def wind(self, excess: FloatArray) -> FloatArray:
        """(n,) [m/s]."""
        return self.scale * (excess / self.reference) ** self.exponent


@dataclass(frozen=True, kw_only=True)
class Disagreement:
    """A law and a chain.

    Attributes:
        law: of the flag.
        chain: of the anemometer.
        floor, share: standard deviation of an error in still air [m/s], and in wind as a share of
            it.
    """

    law: Law
    chain: Chain
    floor: float = 0.0
    share: float = 0.0

    def deviation(self, rows: Rows) -> FloatArray:
        """(n,) standard deviation of each row's error [m/s]."""
        return np.hypot(self.floor, self.share * self.law.wind(rows.excess))

    def errors(self, rows: Rows, log: Readings) -> FloatArray:
        """(n,) reading that the flag stands for less the log's, over each row [m/s]; NaN where the
        log is silent."""
        predicted = self.chain.read(rows.times, self.law.wind(rows.excess))
        return predicted - log.means(rows.times + self.chain.clock, rows.span)


def fit(
    rows: Rows,
    log: Readings,
    effects: Sequence[str],
    *,
    use: BoolArray | None = None,
    known: Mapping[str, Stated] | None = None,
    near: Disagreement | None = None,
    seed: int = 0,
) -> Disagreement:
    """The law and the effects' strengths that agree best.

    Args:
        effects: names that are fitted; the others are absent.
        use: (n,) rows that are fitted; None for all.
        known: effect → its strength as it is known beforehand, a value with its standard deviation;
            others lie in their priors' ranges, or at the null.
        near: where to start; None to search.
        seed: of the search's starts.

    Raises:
        InputError: too few rows that the log covers, or a value that is known without a deviation.
    """
    known = {name: own for name, own in (known or {}).items() if name in effects}
    if exact := [name for name, own in known.items() if not own.sigma > 0]:
        raise InputError(
            f"{', '.join(exact)} without a deviation", where="known", fix="give it as in 0.3±0.1"
        )
    readings = log.means(rows.times + _first_clock(known), rows.span)
    covered = np.isfinite(readings)
    own = covered if use is None else use & covered
    if own.sum() < _FEWEST:
        raise InputError(
            f"{own.sum()} rows with a log beside them", where="fit", fix=f"give {_FEWEST} or more"
        )
    free = float(own.sum()) * min(1.0, float(np.median(np.diff(rows.times))) / rows.span)
    speed = float(np.abs(readings[own]).max())
    reference = max(float(np.sqrt(np.square(rows.excess).mean())), 1e-9)
    middle = math.log(max(speed, _STILL))
    bounds = [
        (middle - 4.0, middle + 2.0),
        _EXPONENTS,
        *_NOISE,
        *(_range(name, known.get(name)) for name in effects),
    ]

    def made(vector: FloatArray) -> Disagreement:
        law = Law(scale=math.exp(vector[0]), exponent=float(vector[1]), reference=reference)
        chain = Chain(strengths=dict(zip(effects, vector[4:].tolist(), strict=True)))
        return Disagreement(
            law=law, chain=chain, floor=math.exp(vector[2]), share=math.exp(vector[3])
        )

    def objective(vector: FloatArray) -> float:
        tried = made(vector)
        errors, deviation = tried.errors(rows, log)[own], tried.deviation(rows)[own]
        there = np.isfinite(errors)
        if there.sum() < _FEWEST:
            return math.inf
        terms = 2 * np.log(deviation[there]) + np.square(errors[there] / deviation[there])
        penalty = sum(
            ((vector[4 + effects.index(name)] - one.low) / one.sigma) ** 2
            for name, one in known.items()
        )
        return free * float(terms.mean()) + penalty

    if near is None:
        shares = qmc.Sobol(
            len(bounds), scramble=True, rng=stream(seed, "instruments", "starts")
        ).random(_STARTS)
        low, high = np.array(bounds).T
        starts = low + shares * (high - low)
        starts[:, 0], starts[:, 1] = middle - np.linspace(0.0, 1.5, _STARTS), 1.0
        starts[:, 2], starts[:, 3] = math.log(0.1), math.log(0.2)
    else:
        starts = np.clip([_vector(near, effects)], *np.array(bounds).T)
    return made(
        min((_descended(objective, start, bounds) for start in starts), key=lambda one: one[1])[0]
    )


def _descended(
    objective: Callable[[FloatArray], float],
    start: FloatArray,
    bounds: Sequence[tuple[float, float]],
) -> tuple[FloatArray, float]:
    """Where a search from `start` ends, and the objective there: by lines, then by a simplex, which
    follows valleys between the axes, until neither gains anything."""
    place, value = start, math.inf
    for _ in range(_ROUNDS):
        before = value
        for method, tolerance in (
            ("Powell", {"xtol": 1e-4, "ftol": 1e-7}),
            ("Nelder-Mead", {"fatol": 1e-5}),
        ):
            found = minimize(
                objective,
                place,
                method=method,
                bounds=bounds,
                options={"maxfev": _STEPS, **tolerance},
            )
            if found.fun <= value:
                place, value = np.asarray(found.x), float(found.fun)
        if before - value < _GAIN:
            break
    return place, value


def jackknife(
    rows: Rows,
    log: Readings,
    effects: Sequence[str],
    found: Disagreement,
    *,
    blocks: IntArray,
    use: BoolArray | None = None,
    known: Mapping[str, Stated] | None = None,
) -> tuple[Mapping[str, float], FloatArray]:
    """Standard errors of scale, exponent and the strengths, and errors (n,) of each row by the fit
    without its block [m/s]; NaN outside `use`.

    Rows whose spans reach into a block are left out with it.

    Args:
        blocks: (n,) number of each row's block of time.
    """
    use = np.ones(len(rows.times), dtype=np.bool_) if use is None else use
    errors = np.full(len(rows.times), np.nan)
    vectors = []
    for block in np.unique(blocks[use]).tolist():
        out = use & (blocks == block)
        first, last = float(rows.times[out][0]) - rows.span, float(rows.times[out][-1]) + rows.span
        rest = use & ((rows.times <= first) | (rows.times >= last))
        again = fit(rows, log, effects, use=rest, known=known, near=found)
        errors[out] = again.errors(rows, log)[out]
        vectors.append(_vector(again, effects))
    spread = np.std(np.array(vectors), axis=0) * math.sqrt(max(len(vectors) - 1, 0))
    sigmas = dict(
        zip(("scale", "exponent", *effects), np.delete(spread, [2, 3]).tolist(), strict=True)
    )
    sigmas["scale"] *= found.law.scale  # of its logarithm
    return sigmas, errors


def without(found: Disagreement, name: str) -> Disagreement:
    """The same with one effect at its null, nothing fitted anew."""
    kept = {own: value for own, value in found.chain.strengths.items() if own != name}
    return replace(found, chain=Chain(strengths=kept))


def _vector(found: Disagreement, effects: Sequence[str]) -> list[float]:
    strengths = [found.chain.strengths.get(name, about(name).null) for name in effects]
    return [
        math.log(found.law.scale),
        found.law.exponent,
        math.log(found.floor),
        math.log(found.share),
        *strengths,
    ]


def _range(name: str, known: Stated | None) -> tuple[float, float]:
    entry = about(name)
    low, high = entry.prior if known is None else known.within(5.0)
    low, high = (min(low, entry.null), max(high, entry.null)) if known is None else (low, high)
    return max(low, entry.admissible[0]), min(high, entry.admissible[1])


def _first_clock(known: Mapping[str, Stated]) -> float:
    return known["clock-offset"].low if "clock-offset" in known else 0.0
