"""The project's own refinement: from the amortised posterior to an interval, in rounds of
replicated evaluations.

1. The first θ are draws of the amortised posterior, widened, completed to 17 parameters by the
   prior.
2. Each is simulated in replicates and filmed by the target's view; the covariance of the replicates
   makes the distance, and their distance to each other the noise floor.
3. A linear model of the network's estimates of wind and area weight over the parameters is the
   likelihood (`measure.refine.metamodel`); it weighs draws of the prior
   (`measure.refine.refined_posterior`).
4. Further θ are draws of that posterior, widened, until the budget is spent, or the nearest θ has
   reached the floor and the wind's interval has settled.

The network's own posterior holds for any ζ; the refined one for the target's, which is what it
gains. It uses no draw of the network's posterior as a probability: that would count the clip twice.

How far a simulated clip is from the target, in the embedding: squared, plain or in the replicates'
covariance.

Two clips of one θ differ. A fit that is nearer to the target than they are to each other fits
noise: their distance is the *noise floor*, where a refinement has nothing left to do.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.core.findings import Finding, Severity
from flagdata.core.rng import child_seed, stream
from flagdata.errors import InputError
from measure.posterior_ends import PILED, WITHIN, limits_of
from measure.refine import refinement_start
from measure.refine.evaluator import STAGES, Evaluated, Evaluator, fingerprint
from measure.refine.metamodel import Metamodel, least
from measure.refine.refined_posterior import (
    REGRESSORS,
    Posterior,
    bending_table,
    posterior,
    regressors,
)
from measure.refine.refinement import Refined, Refinement, Round, intervals_of
from measure.refine.simulator import Simulator
from measure.refine.space import DIMENSION, WIND_COLUMN, Space
from measure.refine.target import Target, knows_view
from measure.refine.trace import Trace
from models.trained.estimator import Estimator
from models.trained.outliers import shrunk_covariance
from sim.run.simulation_recipe import Recipe


def squared_embedding_distance(embedding: FloatArray, target: FloatArray) -> FloatArray:
    """Computes the squared Euclidean distance of embeddings (…, d) to one (d,): (…), infinite where
    a simulation failed.

    Runia et al. 2020, section 3.1.
    """
    distances = np.square(embedding - target).sum(axis=-1)
    return np.where(np.isfinite(distances), distances, np.inf)


@dataclass(frozen=True, kw_only=True, eq=False)
class ReplicateMetric:
    """Mahalanobis's distance in the covariance of replicates.

    Attributes:
        whitening: (d, d), W with WᵀW = Σ*⁻¹.
        shrinkage: by how much Σ* was drawn towards a multiple of the unit matrix, 0 to 1 (Ledoit
            and Wolf, Journal of Multivariate Analysis 88, 2004).
        floor: median squared distance of two replicates of one θ.
        pairs: of replicates that it was found from.
    """

    whitening: FloatArray
    shrinkage: float
    floor: float
    pairs: int

    @classmethod
    def of(cls, groups: list[FloatArray]) -> ReplicateMetric:
        """Measures it on the embeddings (replicate, d) of some θ; failed ones are left out.

        Deviations from their θ's mean are enlarged by √(R/(R − 1)), so that their covariance is
        that of replicates.

        Raises:
            InputError: fewer than two θ with two replicates, or replicates that do not differ.
        """
        finite = [group[np.isfinite(group).all(axis=1)] for group in groups]
        several = [group for group in finite if len(group) > 1]
        if len(several) < 2:
            raise InputError(
                f"{len(several)} points have two replicates",
                fix="evaluate at least two points, each twice or more",
            )
        deviations = [(g - g.mean(axis=0)) * np.sqrt(len(g) / (len(g) - 1)) for g in several]
        rows = np.concatenate(deviations)
        covariance, shrinkage = shrunk_covariance(
            np.concatenate([rows, -rows])
        )  # so that their mean is nought
        values, vectors = np.linalg.eigh(covariance)
        if values[0] <= 0:
            raise InputError("replicates do not differ", fix="let their starts or cameras differ")
        whitening = np.diag(values**-0.5) @ vectors.T
        between = [
            float(np.square(whitening @ (group[i] - group[j])).sum())
            for group in several
            for i in range(len(group))
            for j in range(i)
        ]
        return cls(
            whitening=whitening,
            shrinkage=shrinkage,
            floor=float(np.median(between)),
            pairs=len(between),
        )

    def squared(self, embedding: FloatArray, target: FloatArray) -> FloatArray:
        """Computes the squared distance of embeddings (…, d) to one (d,): (…), infinite where a
        simulation failed."""
        return squared_embedding_distance(embedding @ self.whitening.T, self.whitening @ target)


OWN = "refine"


@dataclass(frozen=True, kw_only=True)
class Settings:
    """How a refinement goes.

    Attributes:
        budget: clips to simulate for each target, at most.
        replicates: of each θ.
        widening: of the posteriors that θ are drawn from, on the logits: the linear model is better
            supported from outside of what it is asked about.
        settled: relative change of the wind's interval below which it counts as settled.
        level: of all intervals.
        seed: of all random streams.
        batch: flags that are simulated together; a round has as many clips.
        renderer: a name of `sim.render.RENDERERS`.
        to_floor: whether to stop at the noise floor, before the budget is spent.

    Raises:
        InputError: a budget that is too small for an interval, or one replicate.
    """

    budget: int = 50
    replicates: int = 2
    widening: float = 1.5
    settled: float = 0.1
    level: float = 0.9
    seed: int = 0
    batch: int = 8
    renderer: str = "raster"
    to_floor: bool = True

    def __post_init__(self) -> None:
        if self.replicates < 2:
            raise InputError(
                "one replicate cannot show a noise floor", where="replicates", fix="give at least 2"
            )
        if not 0 < self.level < 1:
            raise InputError(
                f"the level is {self.level:g}", where="level", fix="give a share between 0 and 1"
            )
        if self.batch < self.replicates:
            raise InputError(
                f"batches of {self.batch} clips cannot hold {self.replicates} replicates",
                where="batch",
                fix=f"give at least {self.replicates}",
            )
        if self.budget < self.fewest:
            raise InputError(
                f"{self.budget} evaluations are too few for an interval of {REGRESSORS + 1} "
                "regressors",
                where="budget",
                fix=f"give at least {self.fewest}",
            )

    @property
    def fewest(self) -> int:
        """Evaluations of the first round: enough for an interval even if replicates were all
        alike."""
        return (least(REGRESSORS + 1, len(refinement_start.SUMMARISED)) + 2) * self.replicates


def refine(
    targets: Target | Sequence[Target],
    estimator: Estimator,
    recipes: Recipe | Sequence[Recipe],
    *,
    space: Space | None = None,
    settings: Settings | None = None,
    cache: Path | None = None,
    advance: Callable[[int], object] | None = None,
) -> Refinement:
    """Measures the cloth and the wind of a clip, or of several clips of one cloth, each in a wind
    of its own.

    Args:
        targets: one clip, or several of one flag.
        estimator: a model of the posterior loss.
        recipes: of the scene, such as `sim.run.load("flag-wide")`; its ranges are searched.
            Replicates take turns at several, see `measure.refine.simulator`.
        space: that box with a prior, which should be that of the model's training data; None takes
            the first recipe's.
        cache: folder in which evaluations are kept: an interrupted refinement goes on from them.
        advance: called with the number of clips that were simulated.

    Raises:
        InputError: a model without a posterior of wind, area weight, scale and anisotropy, a clip
            that does not fit it, a recipe without ranges, a space of another box, or too many
            simulations that failed.
    """
    chosen, several = (
        settings or Settings(),
        tuple([targets] if isinstance(targets, Target) else targets),
    )
    refinement_start.require(estimator)
    if not several:
        raise InputError("there is no clip to measure", fix="give at least one target")
    model = fingerprint(estimator)
    front = estimator.front_end
    evaluators = tuple(
        Evaluator(
            Simulator.of(
                recipes,
                target.view,
                frames=front.frames,
                rate=front.rate,
                renderer=chosen.renderer,
                batch=chosen.batch,
            ),
            estimator,
            chosen.seed,
            cache,
            model,
        )
        for target in several
    )
    space_of_recipes = evaluators[0].simulator.space
    if space is not None and space.identity != space_of_recipes.identity:
        raise InputError(
            "the space has other ranges than the recipes", fix="take the space of the first recipe"
        )
    return _Run(
        several,
        estimator,
        chosen,
        evaluators,
        space or space_of_recipes,
        advance or (lambda _: None),
    ).whole()


@dataclass(frozen=True)
class _Run:
    targets: tuple[Target, ...]
    estimator: Estimator
    settings: Settings
    evaluators: tuple[Evaluator, ...]
    space: Space
    advance: Callable[[int], object]

    def whole(self) -> Refinement:
        begun = time.perf_counter()
        embedded = [
            e.embed(t.clip[None])[0] for e, t in zip(self.evaluators, self.targets, strict=True)
        ]
        observed = [refinement_start.summaries(self.estimator, row[None])[0] for row in embedded]
        seed, aspect = (
            child_seed(self.settings.seed, "amortised"),
            self.evaluators[0].simulator.aspect,
        )
        estimates = [
            refinement_start.amortised_draws(
                self.estimator, target.clip, self.space, aspect=aspect, seed=seed, draws=400
            )
            for target in self.targets
        ]
        points: list[FloatArray] = []  # (clip, θ, 17) of each round
        groups: list[list[Evaluated]] = [[] for _ in self.targets]
        ends: list[float] = []
        rounds: list[Round] = []
        current, reached, inferring = None, False, 0.0
        while True:
            started = time.perf_counter()
            asked = (
                self._first(estimates)
                if current is None
                else self._next(current, len(ends), len(rounds))
            )
            inferring += time.perf_counter() - started
            for clip, evaluator in enumerate(self.evaluators):
                groups[clip] += evaluator.evaluate(
                    asked[clip], self.settings.replicates, advance=self.advance
                )
            points.append(asked)
            started = time.perf_counter()
            metrics = [ReplicateMetric.of([g.embedding for g in group]) for group in groups]
            everywhere = np.concatenate(points, axis=1)
            current = self._posterior(everywhere, groups, observed, len(rounds))
            nearest, floor = (
                _nearest(metrics, groups, embedded),
                float(np.mean([m.floor for m in metrics])),
            )
            inferring += time.perf_counter() - started
            ends += [time.perf_counter() - begun] * (asked.shape[1] * self.settings.replicates)
            rounds.append(
                Round(
                    evaluations=len(ends),
                    distance=nearest,
                    floor=floor,
                    seconds=ends[-1],
                    intervals=self._intervals(current)[:2],
                )
            )
            reached = nearest <= floor
            if reached and self.settings.to_floor and _is_settled(rounds, self.settings.settled):
                stopped = (
                    "the nearest parameters fit as well as they fit themselves, and the wind's "
                    "interval settled"
                )
                break
            if len(ends) + self.settings.replicates > self.settings.budget:
                stopped = "the budget is spent"
                break
        seconds = {
            stage: sum(g.seconds[stage] for group in groups for g in group) for stage in STAGES
        }
        return Refinement(
            targets=self.targets,
            level=self.settings.level,
            intervals=self._intervals(current),
            amortised=self._spans(estimates[0], self._prior()[:, :4]),
            bending=bending_table(self.space, current, self.settings.level),
            rounds=tuple(rounds),
            traces=self._traces(np.concatenate(points, axis=1), groups, metrics, embedded, ends),
            floor=floor,
            reached=reached,
            stopped=stopped,
            posterior=current,
            evaluators=self.evaluators,
            seconds={**seconds, "infer": inferring},
            findings=self._findings(current, metrics, groups, embedded, reached),
            seed=self.settings.seed,
        )

    def _first(self, estimates: Sequence[FloatArray]) -> FloatArray:
        """Draws points (clip, θ, 17): draws of the amortised posteriors, widened; the cloth of each
        clip's in turn."""
        count = self.settings.fewest // self.settings.replicates
        rng = stream(self.settings.seed, OWN, "first")
        wide = [
            refinement_start.widen_draws(draws, self.settings.widening, self.space)
            for draws in estimates
        ]
        chosen = np.stack([draws[rng.choice(len(draws), count, replace=False)] for draws in wide])
        turn = np.arange(count) % len(estimates)
        shared = chosen[turn, np.arange(count)]
        base = refinement_start.complete_points(self.space, shared, seed=self.settings.seed)
        return self._with_winds(base, chosen[:, :, 0])

    def _next(self, current: Posterior, done: int, number: int) -> FloatArray:
        """Draws points of the refined posterior, (clip, θ, 17), their winds widened."""
        remaining = self.settings.budget - done
        count = max(1, min(self.settings.batch, remaining) // self.settings.replicates)
        rng = stream(self.settings.seed, OWN, "next", number)
        chosen = rng.choice(len(current.points), count, replace=False)
        middle = current.winds.mean(axis=0)
        winds = middle + self.settings.widening * (current.winds[chosen] - middle)
        return self._with_winds(current.points[chosen], winds.T)

    def _with_winds(self, base: FloatArray, winds: FloatArray) -> FloatArray:
        """Cloths (θ, 17) with the winds (clip, θ) [m/s] of each clip."""
        out = np.broadcast_to(base, (len(winds), len(base), DIMENSION)).copy()
        entry = self.space.wind
        out[:, :, WIND_COLUMN] = np.clip(
            2 * (winds - entry.low) / (entry.high - entry.low) - 1, -1.0, 1.0
        )
        return out

    def _posterior(
        self,
        points: FloatArray,
        groups: Sequence[Sequence[Evaluated]],
        observed: Sequence[FloatArray],
        number: int,
    ) -> Posterior:
        models = []
        for clip, group in enumerate(groups):
            rows = np.concatenate([g.embedding for g in group])
            number_of_point = np.repeat(np.arange(len(group)), [len(g.embedding) for g in group])
            finite = np.isfinite(rows).all(axis=1)
            summaries = refinement_start.summaries(self.estimator, rows[finite])
            predictors = regressors(self.space.reported_quantities(points[clip]), self.space)[
                number_of_point[finite]
            ]
            models.append(Metamodel.fit(predictors, summaries, number_of_point[finite]))
        return posterior(
            self.space,
            models,
            observed,
            seed=child_seed(self.settings.seed, OWN, "posterior", number),
        )

    def _prior(self) -> FloatArray:
        return self.space.reported_quantities(
            self.space.prior(stream(self.settings.seed, OWN, "prior"), 4000)
        )

    def _intervals(self, current: Posterior) -> tuple[Refined, ...]:
        prior = self._prior()
        spans = self._spans(self.space.reported_quantities(current.points), prior)
        for clip in range(1, len(self.targets)):
            wind = self._spans(current.winds[:, [clip]], prior[:, :1])[0]
            spans = (*spans, replace(wind, name=f"{wind.name}.{clip}"))
        return spans

    def _spans(self, draws: FloatArray, prior: FloatArray) -> tuple[Refined, ...]:
        area_weight, limits = self.space.area_weight, limits_of("area_weight")
        learned = next(target for target in self.estimator.targets if target.name == "area_weight")
        if (
            area_weight.low > learned.low or area_weight.high < learned.high
        ):  # narrower: the user states it
            limits = area_weight.low, area_weight.high
        return intervals_of(
            draws,
            prior,
            self.settings.level,
            ranges=(self.space.wind, area_weight),
            limits=(limits_of("wind_speed"), limits),
        )

    def _traces(
        self,
        points: FloatArray,
        groups: Sequence[Sequence[Evaluated]],
        metrics: Sequence[ReplicateMetric],
        embedded: Sequence[FloatArray],
        ends: list[float],
    ) -> tuple[Trace, ...]:
        return tuple(
            Trace(
                method=OWN,
                points=np.repeat(points[clip], self.settings.replicates, axis=0),
                seconds=np.array(ends),
                distances=np.concatenate([metric.squared(g.embedding, target) for g in group]),
            )
            for clip, (group, metric, target) in enumerate(
                zip(groups, metrics, embedded, strict=True)
            )
        )

    def _findings(
        self,
        current: Posterior,
        metrics: Sequence[ReplicateMetric],
        groups: Sequence[Sequence[Evaluated]],
        embedded: Sequence[FloatArray],
        reached: bool,
    ) -> tuple[Finding, ...]:
        out: list[Finding] = []
        failed = sum(
            int((~np.isfinite(g.embedding).all(axis=1)).sum()) for group in groups for g in group
        )
        if failed:
            out.append(
                Finding.of(
                    "failed-simulations",
                    f"{failed} simulations failed and were left out",
                    count=failed,
                )
            )
        if not reached:
            nearest = _nearest(metrics, groups, embedded)
            floor = float(np.mean([m.floor for m in metrics]))
            out.append(
                Finding.of(
                    "above-noise-floor",
                    f"the nearest parameters are {nearest / floor:.1f} times as far from the "
                    "target as replicates "
                    "are from each other: something of the target is in no simulation",
                    value=nearest / floor,
                    fix="give the camera and light it was filmed with, or more evaluations",
                )
            )
        if current.effective < 100:
            out.append(
                Finding.of(
                    "few-effective-draws",
                    f"the cloth's posterior rests on {current.effective:.0f} effective draws of "
                    "the prior",
                    value=current.effective,
                )
            )
        out += [
            Finding(
                kind=f"{entry.name.replace('_', '-')}-at-end",
                severity=Severity.WARNING,
                what=f"{PILED:.0%} of the draws of {entry.name} or more lie within {WITHIN:.0%} of "
                "an end of the range "
                "that is searched, so that only a bound is given",
            )
            for entry in self._intervals(current)
            if entry.value is None
        ]
        if not self.evaluators[0].simulator.draws_damping:
            out.append(
                Finding.of(
                    "damping-assumed",
                    "clips were simulated with the material's own damping: the intervals are too "
                    "narrow for a "
                    "cloth that is damped more",
                    fix="rely on the model's own interval, which allows for any damping, where "
                    "that is not known",
                )
            )
        if not all(knows_view(target) for target in self.targets):
            out.append(
                Finding.of(
                    "view-drawn",
                    "camera and light of a target are not known: they were drawn anew for each "
                    "simulated clip",
                )
            )
        return tuple(out)


def _nearest(
    metrics: Sequence[ReplicateMetric],
    groups: Sequence[Sequence[Evaluated]],
    embedded: Sequence[FloatArray],
) -> float:
    """Finds the smallest mean squared distance of a θ's replicates, the mean over targets at the
    same cloth."""
    distances = np.array(
        [
            [float(np.mean(metric.squared(g.embedding, target))) for g in group]
            for metric, group, target in zip(metrics, groups, embedded, strict=True)
        ]
    )
    return float(distances.mean(axis=0).min())


def _is_settled(rounds: Sequence[Round], share: float) -> bool:
    if len(rounds) < 2:
        return False
    before, now = (r.intervals[0].span.high - r.intervals[0].span.low for r in rounds[-2:])
    return (
        math.isfinite(before) and abs(now - before) <= share * before
    )  # a bound never settles: its end is not known
