"""What the tests' statistics are when nothing is missing: groups of null recordings that the null
model did not see."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from flagdata.core.arrays import FloatArray, IntArray
from flagdata.core.rng import stream
from flagdata.errors import InputError, UsageError
from measure.forecasting.calibrated_parameters import DAMPING, PRIOR, Calibration
from measure.forecasting.regressors import TURNED
from measure.forecasting.setting import Design
from measure.inference.growth import power
from measure.inference.random_effect import NullModel, Nulls
from measure.inference.segment_evidence import Evidence
from measure.nulls.conformal import GroupedConformal, kinds_needed
from measure.nulls.directed_test import DirectedScores, DirectedTest, Sought, Summary, beside
from measure.nulls.marker_summary import (
    APPEARS,
    chance_of_markers,
    sought_on_markers,
    summarise_evidence,
)
from measure.nulls.null_groups import NullGroups, shares_of_drops
from measure.probes.lines import Lines, SpectralLine
from measure.verdict.criteria import CRITERIA

_GROUPS = 400
_UNOBSERVABLE = 1e-6
"""Mean share below which a column is unobservable: that of the columns that are always fitted."""
_NARROWEST = 1e-6
"""Standard deviation below which a statistic does not vary."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LeftOut:
    """A null experiment, and a null model that has not seen its kind of numerics.

    Attributes:
        model: learnt from all other kinds, for its design.
        outside: the nulls of this experiment.
        groups: places among them.
    """

    model: NullModel
    outside: Nulls
    groups: tuple[IntArray, ...]


def left_out_groups(nulls: Nulls, pool: Nulls, segments: int, *, seed: int) -> Iterator[LeftOut]:
    """Draws groups like data, of each experiment in turn: so many segments of its recordings.

    Args:
        nulls: what the null models learn from.
        pool: those of them that groups are made of.

    Raises:
        InputError: an experiment has fewer segments.
    """
    rng = stream(seed, "null", "groups")
    groups_of_each = math.ceil(_GROUPS / len(np.unique(pool.experiment)))
    for index in range(pool.experiment.max() + 1):
        outside = pool.select(pool.experiment == index)
        recording = outside.statistics.recording
        places = [np.flatnonzero(recording == r) for r in np.unique(recording)]
        groups: list[IntArray] = []
        for _ in range(groups_of_each):
            chosen = np.concatenate([places[k] for k in rng.permutation(len(places))])[:segments]
            if len(chosen) < segments:
                raise InputError(
                    f"the data have {segments} segments, the nulls of one cloth {len(chosen)}",
                    where="null bank",
                    fix="simulate longer nulls, or give shorter recordings",
                )
            groups.append(chosen)
        other_kinds = nulls.select(nulls.numerics != outside.numerics[0])
        yield LeftOut(
            model=NullModel.fit(other_kinds, outside.design), outside=outside, groups=tuple(groups)
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class NullBank:
    """Null recordings.

    Attributes:
        nulls: their segments.
        columns: names of the columns.
        duration: of a segment [s].
        words: how they were made.
        anchors_given: whether they were predicted with the anchors they were simulated with.
        carried: whether their attachments move.

    Raises:
        InputError: too few of them, or all of the same numerics.
    """

    nulls: Nulls
    columns: tuple[str, ...]
    duration: float
    words: str
    anchors_given: bool = True
    carried: bool = False

    def __post_init__(self) -> None:
        kinds = len(np.unique(self.nulls.numerics))
        if kinds < CRITERIA.fewest_kinds:
            raise InputError(
                f"the nulls are of {kinds} kinds of numerics",
                where="null bank",
                fix=f"simulate at least {CRITERIA.fewest_kinds}, and "
                f"{kinds_needed(CRITERIA.level)} to test at a level "
                f"of {CRITERIA.level:g}",
            )

    def model(self, design: Design) -> NullModel:
        """Fits the null model to all nulls, for data of a design."""
        return NullModel.fit(self.nulls, design)

    def plain(self) -> NullBank:
        """Removes moments about the pole, the wind's course and settled quantities, for those who
        look at the errors alone."""
        errors_alone = replace(self.nulls.statistics, turning=None, course=None, settled=None)
        return replace(self, nulls=replace(self.nulls, statistics=errors_alone))

    def reference(
        self, segments: int, *, noise: float, seed: int, prior: FloatArray = PRIOR
    ) -> Reference:
        """Computes statistics of groups like the data: so many segments of recordings of one null
        experiment, by a null model that has seen none of its numerics.

        Args:
            noise: of the data's markers [m].
            prior: (theta,) standard deviations of the data's calibrated parameters about the
                nominal ones: nulls are judged under the same.

        Raises:
            InputError: no experiment has that many segments, or too few kinds have such noise.
        """
        similar = self.nulls.select(np.abs(self.nulls.noise - noise) <= CRITERIA.alike_noise)
        count, needed = len(np.unique(similar.numerics)), CRITERIA.fewest_kinds
        if count < needed:
            raise InputError(
                f"the nulls are of {count} kinds of numerics with markers as noisy as "
                f"{1e3 * noise:.2g} mm",
                where="null bank",
                fix=f"build a bank of {needed} or more with such noise, or leave it out",
            )
        sought = sought_on_markers(self.columns)
        places = [self.columns.index(one.name) for one in sought]
        usual_speed = float(similar.speeds.mean())
        groups: list[NullGroups] = []
        kinds: list[Summary] = []
        swings: list[FloatArray] = []
        chance: list[FloatArray] = []
        for left_out in left_out_groups(similar, similar, segments, seed=seed):
            outside, model = left_out.outside, left_out.model.under(prior)
            evidence = Evidence.of(outside.statistics, outside.speeds, model)
            different = {tuple(sorted(group.tolist())): group for group in left_out.groups}
            groups.extend(
                NullGroups.of(evidence.select(chosen), outside.select(chosen[:1]))
                for chosen in different.values()
            )
            first = evidence.select(left_out.groups[0])
            swings.append(np.zeros(0) if first.swing is None else first.swing)
            chance.append(chance_of_markers(outside.statistics))
            kinds.append(
                summarise_evidence(
                    first,
                    places,
                    usual_speed=usual_speed,
                    damping=float(outside.calibration[0, DAMPING]),
                )
            )
        return Reference.of(
            NullGroups.joined(groups),
            swings=np.stack(swings),
            directed=DirectedTest.of(sought, kinds, chance),
            columns=self.columns,
            usual_speed=usual_speed,
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class BaseModelTest:
    """The base model, or what a model leaves, beside nulls.

    Attributes:
        scores: how far it goes the way of each effect.
        course: how far the wind's course swings, on the scale of the largest score; None where it
            is not looked at, or not tested.
        statistic: the larger one, or the score along the effect that was suspected.
        null: the same of each kind by all others.
        courses: (kind,) of `course`; −∞ where it is None.
    """

    scores: DirectedScores
    course: float | None
    statistic: float
    null: GroupedConformal
    courses: FloatArray

    @property
    def p(self) -> float:
        """(1 + number of kinds that are at least as far)/(1 + number of kinds)."""
        return self.null.p(self.statistic)

    def score(self, name: str) -> float:
        """Returns how far it goes the way of an effect; −∞ of one that is not tested for."""
        place = self._place(name)
        return -math.inf if place is None else float(self.scores.largest[place])

    def alone(self, name: str) -> float:
        """Computes p along one effect alone, of either sign that it may have; 1 of one that is not
        tested for."""
        place = self._place(name)
        if place is None:
            return 1.0
        null = self.scores.of_kinds_along(place)
        counted = GroupedConformal(null=null, kinds=np.arange(len(null)))
        return counted.p(float(self.scores.largest[place]))

    def _place(self, name: str) -> int | None:
        names = [one.name for one in self.scores.sought]
        return names.index(name) if name in names else None


@dataclass(frozen=True, kw_only=True, eq=False)
class Reference:
    """Null distributions.

    The base model is tested by one statistic: the largest directed score (see
    `measure.nulls.directed_test`), or how far the wind's course swings, which has a fifth of the
    level, since gusts have no direction. The course of nulls is a covariance on either side of
    nothing, and both sides are far; it grows by a power of the damping, which is taken out (see
    `growth`). A model with an effect is tested by the scores of all others, that effect free.

    Everything else describes and decides nothing: lines of the errors' spectra, what recordings
    settle at. A column's share, drop/(left − drop), over the mean share of nulls, 1 in the mean if
    nothing is missing, gives strengths their errors.

    Attributes:
        scaled: (group, column) of `shares_of_drops` over their mean in other kinds.
        spread: (column,) their mean.
        kinds: (group,) of numerics.
        deviations: (group, theta) of the calibrated parameters from those that the nulls were
            simulated with, in standard errors as Σ has them.
        directed: the test along the effects, by one group of each kind.
        swings: (kind, part) of the wind's course in the same groups; of no part where it is not
            looked at.
        settled: (group, quantity) what recordings settle at.
        lines, standing_out: of the nulls, and how far each group stands out; None where spectra are
            not looked at.
        columns: names of the columns.
        usual_speed: of the nulls' winds [m/s].
        damping: of the data, the logarithm of its ratio to the nominal one.
        suspected: column and sign of the effect that was suspected beforehand, along which alone is
            tested; None to test along all.
    """

    scaled: FloatArray
    spread: FloatArray
    kinds: IntArray
    deviations: FloatArray
    directed: DirectedTest
    swings: FloatArray
    settled: FloatArray
    lines: Lines | None
    standing_out: FloatArray | None
    columns: tuple[str, ...]
    usual_speed: float
    damping: float = 0.0
    suspected: tuple[int, int] | None = None

    @classmethod
    def of(
        cls,
        groups: NullGroups,
        *,
        swings: FloatArray,
        directed: DirectedTest,
        columns: tuple[str, ...],
        usual_speed: float,
    ) -> Reference:
        """Makes the null distributions.

        Args:
            groups: of all kinds.
            swings: of one group of each kind.
        """
        scaled = np.empty_like(groups.shares)
        for kind in np.unique(groups.kinds):
            own = groups.kinds == kind
            scaled[own] = groups.shares[own] / _spread(groups.shares[~own])
        lines = None if groups.lines is None else Lines.of(groups.lines)
        return cls(
            scaled=scaled,
            spread=_spread(groups.shares),
            kinds=groups.kinds,
            deviations=groups.deviations,
            directed=directed,
            swings=swings,
            settled=groups.settled,
            lines=lines,
            standing_out=None
            if lines is None or groups.lines is None
            else lines.standing_out(groups.lines),
            columns=columns,
            usual_speed=usual_speed,
        )

    def at(self, calibration: Calibration) -> Reference:
        """Returns the null distributions for data whose statistics are taken at a calibration."""
        return replace(self, damping=calibration.steps_from(Calibration())[DAMPING])

    def along(self, column: int, sign: int) -> Reference:
        """Returns the null distributions that test along one effect alone, which was suspected
        beforehand."""
        return replace(self, suspected=(column, sign))

    @property
    def count(self) -> int:
        """How many kinds there are."""
        return len(self.directed.kinds)

    def tests(self, level: float) -> bool:
        """Returns whether so many kinds can reject at a level."""
        return self.count >= kinds_needed(level)

    def test(self, evidence: Evidence) -> BaseModelTest:
        """Tests the base model by data: along all effects and by the wind's course, or along the
        effect that is suspected."""
        scores, course = self._scores(evidence), self._course(evidence)
        statistic, null = scores.farthest, scores.of_kinds
        courses, value = np.full(len(null), -math.inf), None
        if self.suspected is not None:
            column, sign = self.suspected
            statistic, null = scores.along(self._place(column), sign)
        elif course is not None:
            courses, value = beside(null, course.null, course.value, share=CRITERIA.course_share)
            statistic, null = max(statistic, value), np.maximum(null, courses)
        return BaseModelTest(
            scores=scores,
            course=value,
            statistic=statistic,
            null=self._counted(null),
            courses=courses,
        )

    def p_beside(self, evidence: Evidence, chosen: Sequence[int]) -> float:
        """Computes p of the test along all other effects, of what a model with some columns
        leaves, their strengths free."""
        scores = self._scores(evidence, chosen)
        return self._counted(scores.of_kinds).p(scores.farthest)

    def pointed_at(self, evidence: Evidence, chosen: Sequence[int], level: float) -> list[int]:
        """Lists columns of other effects that act beside some columns, by that test at a level,
        the farthest first."""
        scores = self._scores(evidence, chosen)
        counted = self._counted(scores.of_kinds)
        return [
            self.columns.index(scores.sought[place].name)
            for place in np.argsort(-scores.largest)
            if counted.p(float(scores.largest[place])) <= self.passing(level)
        ]

    def passing(self, level: float) -> float:
        """Returns p at or below which an effect acts beside a named one: `level`, or the least that
        so many kinds allow."""
        return max(level, 1 / (1 + self.count))

    def power(self, tested: BaseModelTest, level: float) -> tuple[tuple[Sought, float], ...]:
        """Lists effects that are tested for, but for a wind that is turned from its log, each with
        the share of kinds beyond the critical value once it acts on them at its expected strength:
        on average of both signs, where it may have either, but of the suspected one alone."""
        critical = tested.null.critical(level)
        if critical is None:
            return ()
        found: list[tuple[Sought, float]] = []
        for place, one in enumerate(tested.scores.sought):
            if one.name == TURNED:
                continue
            if self.suspected is not None:
                column, sign = self.suspected
                if self._place(column) != place:
                    continue
                one = replace(one, expected=sign * one.expected, signs=(sign,))
            shares = []
            for sign in one.signs:
                if self.suspected is None:
                    strength = sign * APPEARS * one.expected
                    acted = tested.scores.of_kinds_with(place, strength)
                else:
                    moved = APPEARS * one.expected * tested.scores.moved[:, place, place]
                    acted = sign * (tested.scores.null[:, place] + moved)
                shares.append(float((np.maximum(acted, tested.courses) > critical).mean()))
            found.append((one, float(np.mean(shares))))
        return tuple(found)

    @cached_property
    def reach(self) -> FloatArray:
        """Computes standard errors, as Σ has them, to either side of an interval of the calibrated
        parameters: as many as hold the true ones in a share of the kinds of numerics, themselves
        and one more counted, that is the intervals' level, (theta,)."""
        return np.array(
            [
                GroupedConformal(null=np.abs(deviations), kinds=self.kinds).quantile(
                    CRITERIA.interval
                )
                for deviations in self.deviations.T
            ]
        )

    def statistics(self, evidence: Evidence) -> FloatArray:
        """Computes (column,) shares of data, as `scaled` has them."""
        return shares_of_drops(evidence) / self.spread

    def reach_of(self, column: int) -> float:
        """Computes how many standard errors, those that make nulls' mean squared z 1, reach to
        either side of an interval."""
        null = GroupedConformal(null=self.scaled[:, column], kinds=self.kinds)
        return math.sqrt(null.quantile(CRITERIA.interval))

    def p_of_course(self, evidence: Evidence) -> float | None:
        """Computes p of the wind's course alone; None where it is not looked at."""
        course = self._course(evidence)
        return None if course is None else self._counted(course.null).p(course.value)

    def settles(self, evidence: Evidence) -> FloatArray | None:
        """Computes how far each quantity of data lies that recordings settle at, in nulls' standard
        deviations, (quantity,); None where they are not looked at.

        Raises:
            UsageError: they are of the data, and were not of the nulls.
        """
        settled = evidence.settles
        if settled is None:
            return None
        if self.settled.shape[1] != len(settled):
            raise UsageError(
                "only the data have settled quantities",
                where="reference",
                fix="look at them in the nulls as well",
            )
        width = np.maximum(self.settled.std(axis=0), _NARROWEST)
        return np.abs(settled - self.settled.mean(axis=0)) / width

    def line(self, evidence: Evidence, level: float) -> SpectralLine | None:
        """Finds the most prominent line of data, where it is farther than in all but a share
        `level` of nulls; None where spectra are not looked at.

        Raises:
            UsageError: they are, of the data or of the nulls alone.
        """
        if self.lines is None and evidence.lines is None:
            return None
        if self.lines is None or evidence.lines is None or self.standing_out is None:
            raise UsageError(
                "only the nulls or only the data have spectra",
                where="reference",
                fix="look at lines in both or in none",
            )
        centre = float(self.standing_out.mean())
        width = max(float(self.standing_out.std()), _NARROWEST)
        line = self.lines.line(evidence.lines, centre=centre, width=width)
        null = GroupedConformal(null=(self.standing_out - centre) / width, kinds=self.kinds)
        return line if null.p(line.far) <= level else None

    def _scores(self, evidence: Evidence, chosen: Sequence[int] = ()) -> DirectedScores:
        places = [self.columns.index(one.name) for one in self.directed.sought]
        summary = summarise_evidence(
            evidence, places, usual_speed=self.usual_speed, damping=self.damping
        )
        free = [places.index(column) for column in chosen if column in places]
        return self.directed.scores(summary, free)

    def _course(self, evidence: Evidence) -> _Course | None:
        """Computes how far the wind's course swings, of data and of each kind by all others.

        Raises:
            UsageError: it is of the data, and was not of the nulls.
        """
        observed = evidence.swing
        if observed is None:
            return None
        if self.swings.shape[1] != len(observed):
            raise UsageError(
                "only the data have courses of the wind",
                where="reference",
                fix="look at them in the nulls as well",
            )
        dampings = np.array([kind.damping for kind in self.directed.kinds])
        powers = np.array([power(np.abs(part), dampings) for part in self.swings.T])
        own = self.swings * np.exp(-np.outer(dampings, powers))
        of_kinds = [
            _farthest_part(own[kind], np.delete(own, kind, axis=0)) for kind in range(len(own))
        ]
        value = _farthest_part(observed * np.exp(-self.damping * powers), own)
        return _Course(value=value, null=np.array(of_kinds))

    def _place(self, column: int) -> int:
        """Returns the place of a column among the effects that are sought."""
        return [one.name for one in self.directed.sought].index(self.columns[column])

    def _counted(self, null: FloatArray) -> GroupedConformal:
        return GroupedConformal(null=null, kinds=np.arange(len(null)))


@dataclass(frozen=True, kw_only=True, eq=False)
class _Course:
    """How far the wind's course swings, of data and of each kind (kind,)."""

    value: float
    null: FloatArray


def _farthest_part(swings: FloatArray, others: FloatArray) -> float:
    """Computes how far the farthest part (part,) is from the mean of others (kind, part)."""
    width = np.maximum(others.std(axis=0, ddof=1), _NARROWEST)
    return float((np.abs(swings - others.mean(axis=0)) / width).max())


def _spread(shares: FloatArray) -> FloatArray:
    return np.maximum(shares.mean(axis=0), _UNOBSERVABLE)
