"""The result of a refinement, in numbers that can be stored."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from flagdata.answer import Span
from flagdata.core.arrays import FloatArray
from flagdata.core.findings import Finding
from flagdata.core.json_values import json_values
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
class Interval:
    """A central interval.

    Attributes:
        name: of `QUANTITIES`; of clips after the first, the wind's has the clip's number behind it.
        unit: SI.
        median: of the posterior; None where its draws pile up at an end of the range beyond which
            there may be more.
        span: the central interval, or a bound on one side (`measure.posterior_ends`).
        prior_share: width of the central interval over that of the prior's of the same level: near
            1 where the clip does not constrain it.
    """

    name: str
    unit: str
    median: float | None
    span: Span
    prior_share: float

    def phrase(self, digits: int, unit: str = "") -> str:
        """Words median and interval, or the bound, without the level.

        Args:
            unit: with the space before it.
        """
        interval_text = self.span.phrase(digits, unit)
        return (
            f"{self.median:.{digits}f}{unit} {interval_text}"
            if self.median is not None and not self.span.bound
            else interval_text
        )

    def as_dict(self) -> dict[str, Any]:
        """Returns JSON values; an end that nothing bounds is null."""
        low, high = self.span.ends()
        return {
            "name": self.name,
            "unit": self.unit,
            "median": self.median,
            "low": low,
            "high": high,
            "level": self.span.level,
            "bound": None if self.span.bound is None else self.span.bound.value,
            "prior_share": self.prior_share,
        }


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
    intervals: tuple[Interval, ...]
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

    targets: tuple[Target, ...]
    level: float
    intervals: tuple[Interval, ...]
    amortised: tuple[Interval, ...]
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
                f"{title} {entry.phrase(digits[entry.name], f' {entry.unit}')} {entry.span.percent}"
            )
        return f"{', '.join(parts)}, n = {self.evaluations} simulated clips"

    def as_dict(self) -> dict[str, Any]:
        """As JSON: no arrays of draws, no pictures."""
        return {
            "method": METHOD,
            "targets": [target.name for target in self.targets],
            "level": self.level,
            "intervals": [entry.as_dict() for entry in self.intervals],
            "amortised": [entry.as_dict() for entry in self.amortised],
            "bending": self.bending.tolist(),
            "rounds": [
                {**vars(r), "intervals": [entry.as_dict() for entry in r.intervals]}
                for r in self.rounds
            ],
            "distances": [_finite(trace.distances) for trace in self.traces],
            "floor": self.floor,
            "reached": self.reached,
            "stopped": self.stopped,
            "evaluations": self.evaluations,
            "effective_draws": self.posterior.effective,
            "seconds": self.seconds,
            "seed": self.seed,
            "findings": json_values(self.findings),
        }


def intervals_of(
    draws: FloatArray,
    prior: FloatArray,
    level: float,
    *,
    ranges: Sequence[Range],
    limits: Sequence[tuple[float, float]],
) -> tuple[Interval, ...]:
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
            Interval(
                name=quantity.name,
                unit=quantity.unit,
                median=float(middle[i]) if span_of_draws.estimated else None,
                span=span_of_draws,
                prior_share=float((high[i] - low[i]) / (most[i] - least[i])),
            )
        )
    return tuple(intervals)


def _finite(values: FloatArray) -> list[float | None]:
    return [float(value) if np.isfinite(value) else None for value in values]
