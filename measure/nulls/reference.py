"""What the tests' statistics are when nothing is missing: groups of null recordings that the null model did not see."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import InputError, UsageError
from flagdata.rng import stream
from measure.forecasting.calibration import DAMPING, PRIOR, THETA, Calibration
from measure.forecasting.regressors import TURNED
from measure.forecasting.setting import Design
from measure.inference.evidence import Evidence, best_gain
from measure.inference.fluctuation import fluctuation
from measure.inference.growth import power
from measure.inference.random_effect import NullModel, Nulls
from measure.nulls.conformal import GroupedConformal, kinds_needed
from measure.nulls.directions import APPEARS, NOTHING, Move, directed, moves, pulled, shares_of, standardised
from measure.nulls.tails import as_normal, freedom
from measure.probes.lines import Line, Lines, strongest
from measure.probes.rows import Rows
from measure.verdict.criteria import CRITERIA

Floats = NDArray[np.float64]
_GROUPS = 400
GUSTS = "air-density.change"
"""The column that gusts fluctuate along: the scale of the wind's pressure, twice their relative intensity."""


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
    groups: tuple[NDArray[np.int64], ...]


def left_out_groups(nulls: Nulls, pool: Nulls, segments: int, *, seed: int) -> Iterator[LeftOut]:
    """Groups like data, of each experiment in turn: so many segments of its recordings.

    Args:
        nulls: what the null models learn from.
        pool: those of them that groups are made of.

    Raises:
        InputError: an experiment has fewer segments.
    """
    rng = stream(seed, "null", "groups")
    each = math.ceil(_GROUPS / len(np.unique(pool.experiment)))
    for index in range(pool.experiment.max() + 1):
        outside = pool.select(pool.experiment == index)
        recording = outside.statistics.recording
        places = [np.flatnonzero(recording == r) for r in np.unique(recording)]
        groups: list[NDArray[np.int64]] = []
        for _ in range(each):
            chosen = np.concatenate([places[k] for k in rng.permutation(len(places))])[:segments]
            if len(chosen) < segments:
                raise InputError(
                    f"{segments} segments of data against {len(chosen)} nulls of one cloth",
                    where="null bank",
                    fix="simulate longer nulls, or give shorter recordings",
                )
            groups.append(chosen)
        others = nulls.select(nulls.numerics != outside.numerics[0])
        yield LeftOut(model=NullModel.fit(others, outside.design), outside=outside, groups=tuple(groups))


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
                f"nulls of {kinds} kinds of numerics",
                where="null bank",
                fix=f"simulate at least {CRITERIA.fewest_kinds}, and {kinds_needed(CRITERIA.level)} to test at a level "
                f"of {CRITERIA.level:g}",
            )

    def model(self, design: Design) -> NullModel:
        """Learnt from all, for data of a design."""
        return NullModel.fit(self.nulls, design)

    def plain(self) -> NullBank:
        """For those who look at the errors alone: without moments about the pole, the wind's course and settled
        quantities."""
        own = replace(self.nulls.statistics, turning=None, course=None, settled=None)
        return replace(self, nulls=replace(self.nulls, statistics=own))

    def reference(self, segments: int, *, noise: float, seed: int, prior: Floats = PRIOR) -> Reference:
        """Statistics of groups like the data: so many segments of recordings of one null experiment, by a null model
        that has seen none of its numerics.

        Args:
            noise: of the data's markers [m].
            prior: (theta,) standard deviations of the data's calibrated parameters about the nominal ones: nulls are
                judged under the same.

        Raises:
            InputError: no experiment has that many segments, or too few kinds have such noise.
        """
        plain: list[_Found] = []
        beside_gusts: list[_Found] = []
        groups: list[_Group] = []
        for kept in left_out_groups(self.nulls, self.nulls, segments, seed=seed):
            evidence = Evidence.of(kept.outside.statistics, kept.outside.speeds, kept.model.under(prior))
            for chosen in {tuple(sorted(group.tolist())): group for group in kept.groups}.values():
                picked, own = evidence.select(chosen), kept.outside.select(chosen[:1])
                plain.append(_Found.of(picked, self.columns, own))
                beside_gusts.append(_Found.of(picked.freed(self.columns.index(GUSTS)), self.columns, own))
            first = kept.groups[0]
            groups.append(_Group(evidence=evidence.select(first), own=kept.outside.select(first[:1])))
        beside = Reference.of(_Found.joined(beside_gusts), noise)
        return Reference.of(_Found.joined(plain), noise, beside_gusts=beside, columns=self.columns, groups=groups)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Group:
    """The evidence of one null group, by a null model without its kind, and one segment of it."""

    evidence: Evidence
    own: Nulls


@dataclass(frozen=True, kw_only=True, eq=False)
class _Found(Rows):
    """Statistics of null groups.

    Attributes:
        shares: (group, column) of `unscaled`.
        pulls: (group, column, part) of `pulled`.
        left: (group,) what the base model leaves.
        gained: (group,) best held-out gains.
        swings: (group, part) of the wind's course, of no part where it is not looked at.
        settled: (group, quantity) what recordings settle at, of none where it is not looked at.
        lines: (group, shape · axis) `strongest`; None where spectra are not looked at.
        deviations: (group, theta) of the calibrated parameters from the true ones, in standard errors.
        noise: (group,) of the markers [m].
        kinds: (group,) of numerics.
        damping: (group,) logarithm of its ratio to the nominal one.
    """

    shares: Floats
    pulls: Floats
    left: Floats
    gained: Floats
    swings: Floats
    settled: Floats
    lines: Floats | None
    deviations: Floats
    noise: Floats
    kinds: NDArray[np.int64]
    damping: Floats

    @classmethod
    def of(cls, evidence: Evidence, columns: tuple[str, ...], own: Nulls) -> _Found:
        """Of one group, whose statistics are at its true calibration.

        A null's cloth is as far from the nominal one as cloths known to `PRIOR` are. Where the data's is known better,
        that of a null lies nearer to its nominal one by as much.

        Args:
            own: one segment of it.
        """
        nominal = -own.calibration[0] * np.minimum(evidence.prior / PRIOR, 1.0)
        swing, settles = (np.zeros(0) if own is None else own for own in (evidence.swing, evidence.settles))
        return cls(
            shares=unscaled(evidence, columns)[None],
            pulls=pulled(evidence)[None],
            left=np.array([evidence.fit(()).left]),
            gained=np.array([best_gain(evidence, without=_uncounted(columns))]),
            swings=swing[None],
            settled=settles[None],
            lines=None if evidence.lines is None else strongest(evidence.lines)[None],
            deviations=evidence.fit((), centre=nominal).in_errors(range(len(THETA)))[None],
            noise=own.noise,
            kinds=own.numerics,
            damping=own.calibration[:, DAMPING],
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Usual:
    """What the statistics of some null groups are like: see `Reference`."""

    spread: Floats
    centre: Floats
    width: Floats
    lines: Lines | None
    powers: Floats
    degrees: Floats
    pull: Floats
    pull_width: Floats

    @classmethod
    def of(cls, found: _Found) -> _Usual:
        lines = None if found.lines is None else Lines.of(found.lines)
        powers = np.array([power(np.abs(own), found.damping) for own in found.swings.T])
        roots = _roots(found, lines, powers)
        return cls(
            powers=powers,
            spread=np.maximum(found.shares.mean(axis=0), NOTHING),
            centre=roots.mean(axis=0),
            width=np.maximum(roots.std(axis=0), np.cbrt(NOTHING)),
            lines=lines,
            degrees=freedom(roots),
            pull=found.pulls.mean(axis=0),
            pull_width=found.pulls.std(axis=0),
        )

    def pulled(self, pulls: Floats) -> Floats:
        """(group, column, part) how far each column pulls more than it does in nulls, in their standard deviations."""
        return standardised(pulls, self.pull, self.pull_width)

    def far(self, found: _Found) -> Floats:
        """(group, column + 2 to 11) how far groups are from their mean, in deviations by each one's own tail."""
        far = as_normal((_roots(found, self.lines, self.powers) - self.centre) / self.width, self.degrees)
        begin = found.shares.shape[1] + 2
        either = slice(begin, begin + found.swings.shape[1] + found.settled.shape[1])
        far[:, either] = np.abs(far[:, either])
        return far


def _roots(found: _Found, lines: Lines | None, powers: Floats) -> Floats:
    swings = found.swings * np.exp(-np.outer(found.damping, powers))
    roots = np.c_[np.cbrt(np.c_[found.shares, found.left, found.gained]), swings, found.settled]
    return roots if lines is None or found.lines is None else np.c_[roots, lines.standing_out(found.lines)]


@dataclass(frozen=True, kw_only=True, eq=False)
class Reference:
    """Null distributions.

    A column's statistic is the share of its drop in what is left with it, drop/(left − drop), over the mean share of
    nulls with about the same noise of the markers: 1 in the mean if nothing is missing. Sets whose errors are larger
    all over are so no larger here, nor are those whose noise alone moves a column. One more statistic stands for gusts:
    the likelihood ratio of a wind pressure that fluctuates, over one that differs by a constant.

    Some columns are near their mean in all nulls, others are far from it in some. The tests compare how far from the
    nulls' mean each cube root is, in their standard deviations: that of a variable like χ², of whatever freedom, is
    nearly normal (Wilson and Hilferty, Proc. Natl. Acad. Sci. 17:684, 1931); one whose tail is heavier is brought to
    the normal deviate that is as rare (see `tails`). With the columns they weigh what is left,
    the same of moments about the pole, and the most prominent line of the errors' spectra, where these are looked at.
    What the calibrated parameters and the directions of the numerics take in of an effect shows on winds that they were
    not fitted to: so they weigh the best held-out gain as well.
    So they do how the wind's course swings: a covariance, of which nulls have what chance and their numerics leave, on
    either side of nothing, and both sides are far; it grows by a power of the damping, which is taken out (see
    `growth`). What recordings settle at is far on either side as well. Evidence whose moments, course or settled
    quantities are not to count goes without them.

    What is usual of a null group is that of other kinds of numerics, as it is for data: by means and deviations that it
    had a part in, 3 % of true nulls were rejected at 2 %, and 7 % at 5 % (20 kinds; by other kinds 2 and 4 %).

    Attributes:
        scaled: (group, column) of `unscaled`: columns, gusts, then moments.
        spread: (column,) mean share of nulls as noisy as the data.
        far: (group, column + 2 to 11) how far the cube root of each is from its mean in other kinds' nulls as noisy, in
            standard deviations; after the columns that of what the base model leaves, then the best held-out gain,
            swings, settled quantities and the line as they are.
        kinds: (group,) of numerics.
        deviations: (group, theta) of the calibrated parameters from those that the nulls were simulated with, in
            standard errors as Σ has them.
        centre, width: (column + 2 to 11,) mean and standard deviation of the same, of nulls as noisy as the data.
        degrees: (column + 2 to 11,) of freedom of their tails, see `measure.nulls.tails`.
        lines: of the nulls; None where spectra are not looked at.
        powers: (part,) of the damping by which swings grow.
        damping: of the data, the logarithm of its ratio to the nominal one.
        pulled: (group, column, part) of `pulled`, standardised as `far` is.
        pull, pull_width: (column, part) mean and standard deviation of the same, of nulls as noisy as the data.
        beside_gusts: the same of `Evidence.freed` along the pressure; None of such a one itself.
        columns: names of the columns; of one from a bank.
        groups: one of each kind; of one from a bank.
        usual: kind → what is usual in the other kinds' nulls.
        suspected: column and sign of the effect that was suspected beforehand, along which alone is tested; None to
            test along all.
    """

    scaled: Floats
    spread: Floats
    far: Floats
    kinds: NDArray[np.int64]
    deviations: Floats
    centre: Floats
    width: Floats
    degrees: Floats
    pulled: Floats
    pull: Floats
    pull_width: Floats
    lines: Lines | None = None
    powers: Floats = field(default_factory=lambda: np.zeros(0))
    damping: float = 0.0
    beside_gusts: Reference | None = None
    columns: tuple[str, ...] = ()
    groups: tuple[_Group, ...] = ()
    usual: Mapping[int, _Usual] = field(default_factory=dict)
    suspected: tuple[int, int] | None = None

    @classmethod
    def of(
        cls,
        found: _Found,
        noise: float,
        *,
        beside_gusts: Reference | None = None,
        columns: tuple[str, ...] = (),
        groups: Sequence[_Group] = (),
    ) -> Reference:
        """For data of some noise [m].

        Args:
            groups: one of each kind.

        Raises:
            InputError: no nulls of such noise.
        """
        kinds = found.kinds
        similar = np.abs(found.noise - noise) <= CRITERIA.alike_noise
        count, needed = len(np.unique(kinds[similar])), kinds_needed(1 - CRITERIA.interval)
        if count < needed:
            raise InputError(
                f"{count} kinds of numerics with markers as noisy as {1e3 * noise:.2g} mm",
                where="null bank",
                fix=f"build a bank of {needed} or more with such noise, or leave it out",
            )
        usual = _Usual.of(found.select(similar))
        scaled, far = np.empty_like(found.shares), np.empty((len(kinds), len(usual.centre)))
        pulls, apart = np.empty_like(found.pulls), dict[int, _Usual]()
        for kind in np.unique(kinds):
            own = kinds == kind
            near = np.abs(found.noise - found.noise[own][0]) <= CRITERIA.alike_noise
            if len(np.unique(kinds[near & ~own])) >= CRITERIA.fewest_kinds:  # else no others have such noise
                near &= ~own
            others = replace(_Usual.of(found.select(near)), degrees=usual.degrees)
            scaled[own], far[own] = found.shares[own] / others.spread, others.far(found.select(own))
            pulls[own] = others.pulled(found.pulls[own])
            apart[int(kind)] = others
        return cls(
            scaled=scaled,
            spread=usual.spread,
            far=far,
            kinds=kinds,
            deviations=found.deviations,
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
            usual=apart,
        )

    def at(self, calibration: Calibration) -> Reference:
        """For data whose statistics are taken at a calibration."""
        return replace(self, damping=calibration.steps_from(Calibration())[DAMPING])

    def beside(self) -> Reference:
        """That of evidence with a pressure that is free in every segment.

        Raises:
            UsageError: this is it.
        """
        if self.beside_gusts is None:
            raise UsageError("it is beside gusts itself", where="reference", fix="ask that of the bank")
        return self.beside_gusts

    @cached_property
    def conformal(self) -> GroupedConformal:
        """The global test: how far the farthest is of all columns, what is left and the line."""
        return GroupedConformal(null=self.far.max(axis=1), kinds=self.kinds)

    @cached_property
    def reach(self) -> Floats:
        """(theta,) standard errors, as Σ has them, to either side of an interval of the calibrated parameters: as many
        as hold the true ones in a share of the kinds of numerics, themselves and one more counted, that is the
        intervals' level."""
        return np.array(
            [
                GroupedConformal(null=np.abs(own), kinds=self.kinds).quantile(CRITERIA.interval)
                for own in self.deviations.T
            ]
        )

    def along(self, column: int, sign: int) -> Reference:
        """That tests along one effect alone, which was suspected beforehand."""
        return replace(self, suspected=(column, sign))

    @cached_property
    def test(self) -> GroupedConformal:
        """That of the base model: along all, or along the suspected effect."""
        if self.suspected is None:
            return self.conformal
        return GroupedConformal(null=directed(self.pulled, *self.suspected), kinds=self.kinds)

    def tested(self, evidence: Evidence, columns: tuple[str, ...]) -> float:
        """The statistic of data that the base model is tested by."""
        if self.suspected is None:
            return self.farthest(evidence, columns)
        return float(directed(standardised(pulled(evidence), self.pull, self.pull_width)[None], *self.suspected)[0])

    def power(self, level: float) -> tuple[tuple[Move, float], ...]:
        """Effects that are tested for, each with the share of nulls beyond the critical value once it acts on them at
        its expected strength: on average of both signs, where it may have either, but of the suspected one alone."""
        critical = self.test.critical(level)
        if critical is None:
            return ()
        shares = {move: float((found > critical).mean()) for move, found in self._acting.items()}
        each: dict[int, list[Move]] = {}
        for move in shares:
            each.setdefault(move.column, []).append(move)
        return tuple((own[0], float(np.mean([shares[move] for move in own]))) for own in each.values())

    @cached_property
    def _acting(self) -> dict[Move, Floats]:
        """Effects that are tested for → (group,) the statistic of nulls on which each acts, as far as appears."""
        found: dict[Move, Floats] = {}
        for move in moves(self.columns):
            if self.suspected is None or (move.column, move.sign) == self.suspected:
                acted = [own.evidence.moved(move.column, APPEARS * move.strength) for own in self.groups]
                found[move] = np.array([self._found(one, own.own) for one, own in zip(acted, self.groups, strict=True)])
        return found

    def _found(self, evidence: Evidence, own: Nulls) -> float:
        """The test's statistic of a null group."""
        usual = self.usual[int(own.numerics[0])]
        if self.suspected is None:
            return float(usual.far(_Found.of(evidence, self.columns, own)).max())
        return float(directed(usual.pulled(pulled(evidence)[None]), *self.suspected)[0])

    def statistics(self, evidence: Evidence, columns: tuple[str, ...], beside: Sequence[int] = ()) -> Floats:
        """(column,) of data, as `scaled` has them, where some columns are fitted already."""
        shares = unscaled(evidence, columns, beside)
        return shares / self.spread[: len(shares)]

    def p_family(self, statistic: float, column: int) -> float:
        """Chance that in nulls any is as far as this column."""
        return self.conformal.p(float(self._far(statistic * self.spread[column], column)))

    def p_alone(self, statistic: float, column: int) -> float:
        """The same for the column alone."""
        return GroupedConformal(null=self.scaled[:, column], kinds=self.kinds).p(statistic)

    def reach_of(self, column: int) -> float:
        """How many standard errors, those that make nulls' mean squared z 1, reach to either side of an interval."""
        null = GroupedConformal(null=self.scaled[:, column], kinds=self.kinds)
        return math.sqrt(null.quantile(CRITERIA.interval))

    def p_left_by(self, evidence: Evidence, columns: tuple[str, ...], chosen: Sequence[int]) -> float:
        """p of the global test on what some columns leave, fitted to the data."""
        return self.conformal.p(self.farthest(evidence, columns, chosen))

    def farthest(self, evidence: Evidence, columns: tuple[str, ...], chosen: Sequence[int] = ()) -> float:
        """How far the farthest of data is, where some columns are fitted already: the statistic of the global test."""
        shares, left = unscaled(evidence, columns, chosen), evidence.fit(chosen).left
        far = max(float(self._far(shares, slice(len(shares))).max()), float(self._far(left, len(self.spread))))
        best = best_gain(evidence, chosen, without=_uncounted(columns))
        gained = float(self._far(best, len(self.spread) + 1))
        swing, line, settles = self.swing(evidence), self.line(evidence), self.settles(evidence)
        beside = [swing, None if line is None else line.far, None if settles is None else float(settles.max())]
        return max(far, gained, *(own for own in beside if own is not None))

    def swing(self, evidence: Evidence) -> float | None:
        """How far the wind's course of data swings, by the part that does most; None where it is not looked at.

        Raises:
            UsageError: it is of the data, and was not of the nulls.
        """
        found = evidence.swing
        if found is None:
            return None
        own = slice(len(self.spread) + 2, len(self.spread) + 2 + len(self.powers))
        if len(self.centre[own]) != len(found):
            raise UsageError("courses of the data alone", where="reference", fix="look at them in the nulls as well")
        damped = found * np.exp(-self.damping * self.powers)
        return float(np.abs(self._by_tail(damped, own)).max())

    def settles(self, evidence: Evidence) -> Floats | None:
        """(quantity,) how far each of data lies that recordings settle at; None where they are not looked at.

        Raises:
            UsageError: they are of the data, and were not of the nulls.
        """
        found = evidence.settles
        if found is None:
            return None
        begin = len(self.spread) + 2 + len(self.powers)
        own = slice(begin, len(self.centre) - (self.lines is not None))
        if len(self.centre[own]) != len(found):
            raise UsageError(
                "settled quantities of the data alone", where="reference", fix="look at them in the nulls as well"
            )
        return np.abs(self._by_tail(found, own))

    def line(self, evidence: Evidence) -> Line | None:
        """The most prominent one of data; None where spectra are not looked at.

        Raises:
            UsageError: they are, of the data or of the nulls alone.
        """
        if self.lines is None and evidence.lines is None:
            return None
        if self.lines is None or evidence.lines is None:
            raise UsageError(
                "spectra of the nulls or of the data alone", where="reference", fix="look at lines in both or in none"
            )
        line = self.lines.line(evidence.lines, centre=float(self.centre[-1]), width=float(self.width[-1]))
        return replace(line, far=float(as_normal(np.array(line.far), self.degrees[-1])))

    def _far(self, values: Floats | float, columns: int | slice) -> Floats:
        """How far shares, what is left or the best gain lie, as `far` has it."""
        return self._by_tail(np.cbrt(values), columns)

    def _by_tail(self, values: Floats | float, columns: int | slice) -> Floats:
        """The same of roots as they are."""
        return as_normal((values - self.centre[columns]) / self.width[columns], self.degrees[columns])


def _uncounted(columns: tuple[str, ...]) -> list[int]:
    """Columns whose held-out gains do not count in the test: what a log may be off by within its tolerance gains on
    recordings whose own log was not fitted."""
    return [columns.index(TURNED)] if TURNED in columns else []


def unscaled(evidence: Evidence, columns: tuple[str, ...], beside: Sequence[int] = ()) -> Floats:
    """Each column's drop over what is left with it in some segments, and the likelihood ratio of gusts; where moments
    about the pole are looked at, then the same drops of these, and what they leave.

    Args:
        beside: columns that are fitted already.
    """
    drops, left = evidence.drops(beside), evidence.fit(beside).left
    gusts = fluctuation(evidence, columns.index(GUSTS), beside).likelihood
    found = np.append(shares_of(drops, left), max(gusts, 0.0))
    if evidence.turning is None:
        return found
    drops, left = evidence.turning.drops(beside), evidence.turning.fit(beside).left
    return np.concatenate([found, shares_of(drops, left), [left]])
