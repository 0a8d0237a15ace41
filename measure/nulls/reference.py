"""What the tests' statistics are when nothing is missing: groups of null recordings that the null
model did not see."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from flagdata.core.arrays import FloatArray, IntArray
from flagdata.core.rng import stream
from flagdata.errors import InputError, UsageError
from measure.forecasting.calibrated_parameters import DAMPING, PRIOR, Calibration
from measure.forecasting.setting import Design
from measure.inference.random_effect import NullModel, Nulls
from measure.inference.segment_evidence import Evidence, best_gain
from measure.nulls.conformal import GroupedConformal, kinds_needed
from measure.nulls.directions import (
    APPEARS,
    Move,
    moves,
    pull_along,
    pulls_of,
    standardise_pulls,
)
from measure.nulls.null_groups import (
    GUSTS,
    NullGroups,
    UsualStatistics,
    uncounted_columns,
    unscaled_drops,
)
from measure.nulls.tails import as_normal
from measure.probes.lines import Lines, SpectralLine
from measure.verdict.criteria import CRITERIA

_GROUPS = 400


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
        plain: list[NullGroups] = []
        beside_gusts: list[NullGroups] = []
        groups: list[_Group] = []
        for left_out in left_out_groups(self.nulls, self.nulls, segments, seed=seed):
            evidence = Evidence.of(
                left_out.outside.statistics, left_out.outside.speeds, left_out.model.under(prior)
            )
            for chosen in {
                tuple(sorted(group.tolist())): group for group in left_out.groups
            }.values():
                picked, first_segment = evidence.select(chosen), left_out.outside.select(chosen[:1])
                plain.append(NullGroups.of(picked, self.columns, first_segment))
                beside_gusts.append(
                    NullGroups.of(
                        picked.freed(self.columns.index(GUSTS)), self.columns, first_segment
                    )
                )
            first = left_out.groups[0]
            groups.append(
                _Group(evidence=evidence.select(first), own=left_out.outside.select(first[:1]))
            )
        with_gusts = Reference.of(NullGroups.joined(beside_gusts), noise)
        return Reference.of(
            NullGroups.joined(plain),
            noise,
            beside_gusts=with_gusts,
            columns=self.columns,
            groups=groups,
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Group:
    """The evidence of one null group, by a null model without its kind, and one segment of it."""

    evidence: Evidence
    own: Nulls


@dataclass(frozen=True, kw_only=True, eq=False)
class Reference:
    """Null distributions.

    A column's statistic is the share of its drop in what is left with it, drop/(left − drop), over
    the mean share of nulls with about the same noise of the markers: 1 in the mean if nothing is
    missing. Sets whose errors are larger all over are so no larger here, nor are those whose noise
    alone moves a column. One more statistic stands for gusts: the likelihood ratio of a wind
    pressure that fluctuates, over one that differs by a constant.

    Some columns are near their mean in all nulls, others are far from it in some. The tests compare
    how far from the nulls' mean each cube root is, in their standard deviations: that of a variable
    like χ², of whatever freedom, is nearly normal (Wilson and Hilferty, Proc. Natl. Acad. Sci.
    17:684, 1931); one whose tail is heavier is brought to the normal deviate that is as rare (see
    `tails`). With the columns they weigh what is left, the same of moments about the pole, and the
    most prominent line of the errors' spectra, where these are looked at. What the calibrated
    parameters and the directions of the numerics take in of an effect shows on winds that they were
    not fitted to: so they weigh the best held-out gain as well. So they do how the wind's course
    swings: a covariance, of which nulls have what chance and their numerics leave, on either side
    of nothing, and both sides are far; it grows by a power of the damping, which is taken out (see
    `growth`). What recordings settle at is far on either side as well. Evidence whose moments,
    course or settled quantities are not to count goes without them.

    What is usual of a null group is that of other kinds of numerics, as it is for data: by means
    and deviations that it had a part in, 3 % of true nulls were rejected at 2 %, and 7 % at 5 % (20
    kinds; by other kinds 2 and 4 %).

    Attributes:
        scaled: (group, column) of `unscaled_drops`: columns, gusts, then moments.
        spread: (column,) mean share of nulls as noisy as the data.
        far: (group, column + 2 to 11) how far the cube root of each is from its mean in other
            kinds' nulls as noisy, in standard deviations; after the columns that of what the base
            model leaves, then the best held-out gain, swings, settled quantities and the line as
            they are.
        kinds: (group,) of numerics.
        deviations: (group, theta) of the calibrated parameters from those that the nulls were
            simulated with, in standard errors as Σ has them.
        centre, width: (column + 2 to 11,) mean and standard deviation of the same, of nulls as
            noisy as the data.
        degrees: (column + 2 to 11,) of freedom of their tails, see `measure.nulls.tails`.
        lines: of the nulls; None where spectra are not looked at.
        powers: (part,) of the damping by which swings grow.
        damping: of the data, the logarithm of its ratio to the nominal one.
        pulled: (group, column, part) of `pulled`, standardised as `far` is.
        pull, pull_width: (column, part) mean and standard deviation of the same, of nulls as noisy
            as the data.
        beside_gusts: the same of `Evidence.freed` along the pressure; None of such a one itself.
        columns: names of the columns; of one from a bank.
        groups: one of each kind; of one from a bank.
        usual: kind → what is usual in the other kinds' nulls.
        suspected: column and sign of the effect that was suspected beforehand, along which alone is
            tested; None to test along all.
    """

    scaled: FloatArray
    spread: FloatArray
    far: FloatArray
    kinds: IntArray
    deviations: FloatArray
    centre: FloatArray
    width: FloatArray
    degrees: FloatArray
    pulled: FloatArray
    pull: FloatArray
    pull_width: FloatArray
    lines: Lines | None = None
    powers: FloatArray = field(default_factory=lambda: np.zeros(0))
    damping: float = 0.0
    beside_gusts: Reference | None = None
    columns: tuple[str, ...] = ()
    groups: tuple[_Group, ...] = ()
    usual: Mapping[int, UsualStatistics] = field(default_factory=dict)
    suspected: tuple[int, int] | None = None

    @classmethod
    def of(
        cls,
        statistics: NullGroups,
        noise: float,
        *,
        beside_gusts: Reference | None = None,
        columns: tuple[str, ...] = (),
        groups: Sequence[_Group] = (),
    ) -> Reference:
        """Makes the null distributions for data of some noise [m].

        Args:
            groups: one of each kind.

        Raises:
            InputError: no nulls of such noise.
        """
        kinds = statistics.kinds
        similar = np.abs(statistics.noise - noise) <= CRITERIA.alike_noise
        count, needed = len(np.unique(kinds[similar])), kinds_needed(1 - CRITERIA.interval)
        if count < needed:
            raise InputError(
                f"the nulls are of {count} kinds of numerics with markers as noisy as "
                f"{1e3 * noise:.2g} mm",
                where="null bank",
                fix=f"build a bank of {needed} or more with such noise, or leave it out",
            )
        usual = UsualStatistics.of(statistics.select(similar))
        scaled, distances = (
            np.empty_like(statistics.shares),
            np.empty((len(kinds), len(usual.centre))),
        )
        pulls, usual_of_kind = np.empty_like(statistics.pulls), dict[int, UsualStatistics]()
        for kind in np.unique(kinds):
            of_kind = kinds == kind
            similar_noise = (
                np.abs(statistics.noise - statistics.noise[of_kind][0]) <= CRITERIA.alike_noise
            )
            if (
                len(np.unique(kinds[similar_noise & ~of_kind])) >= CRITERIA.fewest_kinds
            ):  # else no others have such noise
                similar_noise &= ~of_kind
            usual_of_others = replace(
                UsualStatistics.of(statistics.select(similar_noise)), degrees=usual.degrees
            )
            scaled[of_kind], distances[of_kind] = (
                statistics.shares[of_kind] / usual_of_others.spread,
                usual_of_others.far(statistics.select(of_kind)),
            )
            pulls[of_kind] = usual_of_others.pulled(statistics.pulls[of_kind])
            usual_of_kind[int(kind)] = usual_of_others
        return cls(
            scaled=scaled,
            spread=usual.spread,
            far=distances,
            kinds=kinds,
            deviations=statistics.deviations,
            centre=usual.centre,
            width=usual.width,
            degrees=usual.degrees,
            pulled=pulls,
            pull=usual.pull,
            pull_width=usual.pull_width,
            lines=usual.lines,
            powers=usual.powers,
            beside_gusts=beside_gusts,
            columns=columns,
            groups=tuple(groups),
            usual=usual_of_kind,
        )

    def at(self, calibration: Calibration) -> Reference:
        """Returns the null distributions for data whose statistics are taken at a calibration."""
        return replace(self, damping=calibration.steps_from(Calibration())[DAMPING])

    def beside(self) -> Reference:
        """Returns the null distributions of evidence with a pressure that is free in every segment.

        Raises:
            UsageError: this is it.
        """
        if self.beside_gusts is None:
            raise UsageError(
                "it is beside gusts itself", where="reference", fix="ask that of the bank"
            )
        return self.beside_gusts

    @cached_property
    def conformal(self) -> GroupedConformal:
        """The global test: how far the farthest is of all columns, what is left and the line."""
        return GroupedConformal(null=self.far.max(axis=1), kinds=self.kinds)

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

    def along(self, column: int, sign: int) -> Reference:
        """Returns the null distributions that test along one effect alone, which was suspected
        beforehand."""
        return replace(self, suspected=(column, sign))

    @cached_property
    def test(self) -> GroupedConformal:
        """That of the base model: along all, or along the suspected effect."""
        if self.suspected is None:
            return self.conformal
        return GroupedConformal(null=pull_along(self.pulled, *self.suspected), kinds=self.kinds)

    def tested(self, evidence: Evidence, columns: tuple[str, ...]) -> float:
        """Computes the statistic of data that the base model is tested by."""
        if self.suspected is None:
            return self.farthest(evidence, columns)
        return float(
            pull_along(
                standardise_pulls(pulls_of(evidence), self.pull, self.pull_width)[None],
                *self.suspected,
            )[0]
        )

    def power(self, level: float) -> tuple[tuple[Move, float], ...]:
        """Lists effects that are tested for, each with the share of nulls beyond the critical value
        once it acts on
        them at its expected strength: on average of both signs, where it may have either, but of
        the suspected one alone."""
        critical = self.test.critical(level)
        if critical is None:
            return ()
        shares = {
            move: float((statistics_of > critical).mean())
            for move, statistics_of in self._acting.items()
        }
        by_column: dict[int, list[Move]] = {}
        for move in shares:
            by_column.setdefault(move.column, []).append(move)
        return tuple(
            (signs[0], float(np.mean([shares[move] for move in signs])))
            for signs in by_column.values()
        )

    @cached_property
    def _acting(self) -> dict[Move, FloatArray]:
        """Computes the statistic of nulls on which each effect that is tested for acts, as far as
        appears, (group,)."""
        statistics_of: dict[Move, FloatArray] = {}
        for move in moves(self.columns):
            if self.suspected is None or (move.column, move.sign) == self.suspected:
                acted = [
                    group.evidence.moved(move.column, APPEARS * move.strength)
                    for group in self.groups
                ]
                statistics_of[move] = np.array(
                    [
                        self._statistic(evidence, group.own)
                        for evidence, group in zip(acted, self.groups, strict=True)
                    ]
                )
        return statistics_of

    def _statistic(self, evidence: Evidence, segment: Nulls) -> float:
        """Computes the test's statistic of a null group."""
        usual = self.usual[int(segment.numerics[0])]
        if self.suspected is None:
            return float(usual.far(NullGroups.of(evidence, self.columns, segment)).max())
        return float(pull_along(usual.pulled(pulls_of(evidence)[None]), *self.suspected)[0])

    def statistics(
        self, evidence: Evidence, columns: tuple[str, ...], along: Sequence[int] = ()
    ) -> FloatArray:
        """Computes (column,) statistics of data, as `scaled` has them, where some columns are
        fitted already."""
        shares = unscaled_drops(evidence, columns, along)
        return shares / self.spread[: len(shares)]

    def p_family(self, statistic: float, column: int) -> float:
        """Computes the chance that in nulls any column is as far as this one."""
        return self.conformal.p(float(self._distance(statistic * self.spread[column], column)))

    def p_alone(self, statistic: float, column: int) -> float:
        """Computes the chance that in nulls this column alone is as far."""
        return GroupedConformal(null=self.scaled[:, column], kinds=self.kinds).p(statistic)

    def reach_of(self, column: int) -> float:
        """Computes how many standard errors, those that make nulls' mean squared z 1, reach to
        either side of an interval."""
        null = GroupedConformal(null=self.scaled[:, column], kinds=self.kinds)
        return math.sqrt(null.quantile(CRITERIA.interval))

    def p_left_by(
        self, evidence: Evidence, columns: tuple[str, ...], chosen: Sequence[int]
    ) -> float:
        """Computes p of the global test on what some columns leave, fitted to the data."""
        return self.conformal.p(self.farthest(evidence, columns, chosen))

    def farthest(
        self, evidence: Evidence, columns: tuple[str, ...], chosen: Sequence[int] = ()
    ) -> float:
        """Computes how far the farthest of data is, where some columns are fitted already: the
        statistic of the global test."""
        shares, remainder = (
            unscaled_drops(evidence, columns, chosen),
            evidence.fit(chosen).remainder,
        )
        distance = max(
            float(self._distance(shares, slice(len(shares))).max()),
            float(self._distance(remainder, len(self.spread))),
        )
        best = best_gain(evidence, chosen, without=uncounted_columns(columns))
        gained = float(self._distance(best, len(self.spread) + 1))
        swing, line, settles = self.swing(evidence), self.line(evidence), self.settles(evidence)
        further = [
            swing,
            None if line is None else line.far,
            None if settles is None else float(settles.max()),
        ]
        return max(distance, gained, *(value for value in further if value is not None))

    def swing(self, evidence: Evidence) -> float | None:
        """Computes how far the wind's course of data swings, by the part that does most; None where
        it is not looked at.

        Raises:
            UsageError: it is of the data, and was not of the nulls.
        """
        observed = evidence.swing
        if observed is None:
            return None
        columns = slice(len(self.spread) + 2, len(self.spread) + 2 + len(self.powers))
        if len(self.centre[columns]) != len(observed):
            raise UsageError(
                "only the data have courses of the wind",
                where="reference",
                fix="look at them in the nulls as well",
            )
        damped = observed * np.exp(-self.damping * self.powers)
        return float(np.abs(self._by_tail(damped, columns)).max())

    def settles(self, evidence: Evidence) -> FloatArray | None:
        """Computes how far each quantity of data lies that recordings settle at, (quantity,); None
        where they are not looked at.

        Raises:
            UsageError: they are of the data, and were not of the nulls.
        """
        settled = evidence.settles
        if settled is None:
            return None
        begin = len(self.spread) + 2 + len(self.powers)
        columns = slice(begin, len(self.centre) - (self.lines is not None))
        if len(self.centre[columns]) != len(settled):
            raise UsageError(
                "only the data have settled quantities",
                where="reference",
                fix="look at them in the nulls as well",
            )
        return np.abs(self._by_tail(settled, columns))

    def line(self, evidence: Evidence) -> SpectralLine | None:
        """Finds the most prominent line of data; None where spectra are not looked at.

        Raises:
            UsageError: they are, of the data or of the nulls alone.
        """
        if self.lines is None and evidence.lines is None:
            return None
        if self.lines is None or evidence.lines is None:
            raise UsageError(
                "only the nulls or only the data have spectra",
                where="reference",
                fix="look at lines in both or in none",
            )
        line = self.lines.line(
            evidence.lines, centre=float(self.centre[-1]), width=float(self.width[-1])
        )
        return replace(line, far=float(as_normal(np.array(line.far), self.degrees[-1])))

    def _distance(self, values: FloatArray | float, columns: int | slice) -> FloatArray:
        """Computes how far shares, what is left or the best gain lie, as `far` has it."""
        return self._by_tail(np.cbrt(values), columns)

    def _by_tail(self, values: FloatArray | float, columns: int | slice) -> FloatArray:
        """Computes how far roots lie, as they are."""
        return as_normal(
            (values - self.centre[columns]) / self.width[columns], self.degrees[columns]
        )
