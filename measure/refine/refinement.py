"""The result of a refinement, in numbers that can be stored."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from flagdata.answer import Quantity, Span
from flagdata.core.arrays import FloatArray
from flagdata.core.findings import Finding
from flagdata.recipes.typed_tables import Range
from measure.posterior_ends import span
from measure.refine.evaluator import Evaluator
from measure.refine.refined_posterior import Posterior
from measure.refine.space import QUANTITIES
from measure.refine.target import Target
from measure.refine.trace import Trace

METHOD = (
    "Clips are simulated at draws of the network's posterior, then at draws of the refined one, in "
    "replicates, and "
    "filmed as the target was. The network's estimates of wind and area weight are regressed on "
    "the parameters; the "
    "regression's predictive Student-t density is the likelihood of its estimates of the target "
    "(synthetic likelihood, "
    "Wood 2010), and weighs draws of the prior."
)


@dataclass(frozen=True, kw_only=True)
class Refined(Quantity):
    """A quantity of `QUANTITIES`; of clips after the first, the wind's name has the clip's number
    behind it. Its value is the posterior's median.

    Attributes:
        prior_share: width of the central interval over that of the prior's of the same level: near
            1 where the clip does not constrain it.
    """

    JSON_NAMES: ClassVar[tuple[str, ...]] = (
        "name",
        "unit",
        "median=value",
        "low=span.low",
        "high=span.high",
        "level",
        "bound",
        "prior_share",
    )

    prior_share: float


def phrase(quantity: Quantity, digits: int, unit: str = "") -> str:
    """Words value and interval, or the bound, without the level.

    Args:
        digits: behind the point.
        unit: with the space before it.
    """
    interval_text = quantity.span.phrase(digits, unit)
    return (
        f"{quantity.value:.{digits}f}{unit} {interval_text}"
        if quantity.value is not None and not quantity.bound
        else interval_text
    )


@dataclass(frozen=True, kw_only=True)
class Round:
    """State after a round of evaluations.

    Attributes:
        evaluations: clips so far, of each target.
        distance: smallest mean squared distance of a θ's replicates to the target, in the
            replicates' covariance, the mean over targets.
        floor: median squared distance of replicates of one θ to each other, likewise.
        intervals: of wind and area weight; empty while there are too few evaluations.
        seconds: from the start [s].
    """

    evaluations: int
    distance: float
    floor: float
    intervals: tuple[Refined, ...]
    seconds: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Refinement:
    """What a refinement found.

    Attributes:
        targets: what was measured.
        level: of all intervals.
        intervals: of `QUANTITIES`, then of the other clips' winds.
        amortised: the network's own estimate of the same, before any evaluation, of the first
            target.
        bending: (15, 3) median and interval of each bending coefficient under its prior [N·m].
        rounds: in their order.
        traces: of each target, distances in the replicates' covariance.
        floor: at the end; the mean over targets.
        reached: whether the nearest θ is as near to the target as its own replicates are to each
            other.
        stopped: why it ended, in words.
        posterior: its draws.
        evaluators: of each target, for pictures.
        seconds: by stage: "simulate", "render", "embed", "infer".
        findings: what is to be kept in mind.
        seed: of all random streams.
        scale: size of the targets' flag over that of the simulated ones, whose winds are √scale
            times less.
    """

    JSON_NAMES: ClassVar[tuple[str, ...]] = (
        "method",
        "targets=names",
        "level",
        "intervals",
        "amortised",
        "bending",
        "rounds",
        "distances",
        "floor",
        "reached",
        "stopped",
        "evaluations",
        "effective_draws=posterior.effective",
        "seconds",
        "seed",
        "findings",
    )

    targets: tuple[Target, ...]
    level: float
    intervals: tuple[Refined, ...]
    amortised: tuple[Refined, ...]
    bending: FloatArray
    rounds: tuple[Round, ...]
    traces: tuple[Trace, ...]
    floor: float
    reached: bool
    stopped: str
    posterior: Posterior
    evaluators: tuple[Evaluator, ...]
    seconds: dict[str, float]
    findings: tuple[Finding, ...]
    seed: int
    scale: float = 1.0

    @property
    def evaluations(self) -> int:
        """Clips that were simulated and filmed for each target."""
        return len(self.traces[0])

    @property
    def sentence(self) -> str:
        """Wind and area weight with their intervals, on one line."""
        digits = {quantity.name: quantity.digits for quantity in QUANTITIES}
        parts = []
        for entry, title in zip(self.intervals, ("wind", "area weight"), strict=False):
            parts.append(
                f"{title} {phrase(entry, digits[entry.name], entry.suffix)} {entry.span.percent}"
            )
        return f"{', '.join(parts)}, n = {self.evaluations} simulated clips"

    @property
    def method(self) -> str:
        """How the answer was found, in words."""
        return METHOD

    @property
    def names(self) -> tuple[str, ...]:
        """Of the targets."""
        return tuple(target.name for target in self.targets)

    @property
    def distances(self) -> tuple[FloatArray, ...]:
        """Of all clips to each target, NaN where none could be simulated."""
        return tuple(trace.distances for trace in self.traces)


def intervals_of(
    draws: FloatArray,
    prior: FloatArray,
    level: float,
    *,
    ranges: Sequence[Range],
    limits: Sequence[tuple[float, float]],
) -> tuple[Refined, ...]:
    """Estimates intervals of draws (n, quantity) beside the prior's.

    Args:
        draws: of the first `QUANTITIES`.
        prior: (m, quantity) of the same.
        ranges: that are searched, of the first quantities; those without one have no end.
        limits: values that the same can have at all.
    """
    ends = [(1 - level) / 2, 0.5, (1 + level) / 2]
    low, middle, high = np.quantile(draws, ends, axis=0)
    least, _, most = np.quantile(prior, ends, axis=0)
    intervals = []
    for i, quantity in enumerate(QUANTITIES[: draws.shape[1]]):
        span_of_draws = Span(
            low=float(low[i]), high=float(high[i]), level=level, bound=None, estimated=True
        )
        if i < len(ranges):
            first, last = ranges[i].low, ranges[i].high
            places = (draws[:, i] - first) / (last - first)
            span_of_draws = span(
                draws[:, i], places, level=level, limits=limits[i], assumed=(first, last)
            )
        intervals.append(
            Refined(
                name=quantity.name,
                unit=quantity.unit,
                value=float(middle[i]) if span_of_draws.estimated else None,
                sigma=None,
                span=span_of_draws,
                prior_share=float((high[i] - low[i]) / (most[i] - least[i])),
            )
        )
    return tuple(intervals)
