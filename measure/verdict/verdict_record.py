"""What closing the loop concludes, and everything a reader needs to judge it. Plain values only: it
becomes JSON."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from flagdata.answer.quantity import Quantity


class Conclusion(StrEnum):
    """What became of the base model."""

    UNTESTED = "cannot test"
    SUFFICIENT = "no effect needed"
    UNDECIDED = "not decided"
    EFFECT = "effect"
    ONE_OF = "one of"
    PARTLY = "partly explained"
    OUTSIDE = "none of the library"


QUANTITY_ENTRIES = {Quantity: ("value=point", "low", "high", "unit", "level", "bound")}
"""What documents of verdicts state of a quantity, since their first version; see
`flagdata.core.json_values`."""


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """An effect that was weighed.

    Attributes:
        effect: its name in the library, or "corrective-field" for the smooth field of forces
            outside it.
        parameter: of the effect.
        strength: as fitted, with the effect's own unit.
        null: the strength at which the effect is not there.
        z: how far the recordings go its way, in standard deviations of nulls.
        p_value: of z for this candidate alone.
        p_family: of the largest z of all candidates.
        gain: held-out improvement of the fit over the base model, in units of log likelihood;
            higher is better. On films the logarithm of the Bayes factor.
        gain_error: its standard error.
        behind: how many standard errors of the paired difference it lies behind the best candidate;
            0 for the best.
        leftover: p-value of what the model with it still leaves unexplained; on trajectories that
            of the test along all other effects.
        by_recording: strength fitted on each recording alone, in the order of the recordings; of a
            refitted candidate about what it then has.
        heterogeneity: p-value of the same strength in all of these (Cochran's Q); None of a single
            recording, and of gusts.
        why_not: why it was not named; empty where it was.
        probability: on films, given that one effect of the library is missing; None on
            trajectories.
    """

    effect: str
    parameter: str
    strength: Quantity
    z: float
    p_value: float
    p_family: float
    gain: float
    gain_error: float
    behind: float
    leftover: float
    by_recording: tuple[Quantity, ...] = ()
    heterogeneity: float | None = None
    why_not: str = ""
    null: float = 0.0
    probability: float | None = None


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """Errors on data neither model was fitted to: root mean square one-step prediction error [m].

    Attributes:
        what: which data ("recording 7.0 m/s, unseen", "last part of each recording, unseen").
        frames: how many.
        before, after: of the base model and of the model with the effect.
        reduction: paired, before − after [m].
        floor: of the model itself on data simulated from it with other numerics: differences below
            are not effects.
        share: E_red = (before − after) / (before − floor); None where before is not above it.
        control: after, with the same freedom spent on the best wrong effect.
        control_name: which.
        apart: mean half misfit of a segment by the control less that by the effect, paired, what
            the model's numerics leave taken out: natural units of log likelihood.
    """

    what: str
    frames: int
    before: Quantity
    after: Quantity
    reduction: Quantity
    floor: Quantity
    share: float | None
    control: Quantity | None
    control_name: str
    apart: Quantity | None = None


@dataclass(frozen=True, kw_only=True)
class Residual:
    """Where and when the model errs. Lists are over the grid named with them.

    Attributes:
        recording: its name.
        speed: mean logged wind [m/s].
        held_out: whether neither model was fitted to it.
        times: of the frames [s].
        in_time: root mean square over the markers, base model [m].
        in_time_after: with the effect; empty where none was named.
        markers: (u, v) of the markers [m].
        in_space: root mean square over the frames, base model [m], one a marker.
        in_space_after: with the effect.
        mean: (x, y, z) mean of observed − predicted over the frames, base model [m], one a marker.
        frequencies: [Hz].
        spectrum: of the error, base model [m²/Hz].
        spectrum_after: with the effect.
        observed: (frame, marker, xyz) of a short stretch [m].
        before: predicted from the frame before by the base model, the same stretch.
        after: predicted with the effect.
    """

    recording: str
    speed: float
    held_out: bool
    times: list[float]
    in_time: list[float]
    in_time_after: list[float]
    markers: list[list[float]]
    in_space: list[float]
    in_space_after: list[float]
    mean: list[list[float]]
    frequencies: list[float]
    spectrum: list[float]
    spectrum_after: list[float]
    observed: list[list[list[float]]]
    before: list[list[list[float]]]
    after: list[list[list[float]]]


@dataclass(frozen=True, kw_only=True)
class NullTest:
    """The global test.

    Attributes:
        statistic: observed: how far the recordings are from nulls' mean, in their standard
            deviations (see `measure.nulls.reference`).
        null: the same of every group of simulated nulls.
        p_value: (1 + kinds of numerics at least as far)/(kinds + 1), see `measure.nulls.conformal`,
            or the same of flags, see `effective`, with an interval of the share of all that are, by
            how many were simulated.
        kinds: of numerics among the nulls.
        level: at which it was judged.
        critical: the statistic beyond which the base model is rejected; None where there are too
            few kinds for any.
        nulls: how they were made, in words: how many, from which parameters, with which numerics.
        open: whether the interval of p includes the level, so that another draw of nulls could
            decide otherwise; None in documents without it.
        settling: kinds of numerics whose interval would exclude it, if as large a share deviates as
            much; None where the test is not open, or 1,000 would not do.
        effective: how many independent flags the nulls count as, see `measure.nulls.clustered`;
            None where kinds are counted.
        correlation: of flags of one kind, by which it is found.
        tail: p by the tail of Student's t, beside the one that is counted.
        suspected: the effect with its sign that was suspected before the recordings were looked at,
            along which alone was looked; empty where none was.
        directed: how far the recordings go the way of the effect that they go farthest, in nulls'
            deviations; None on films.
        course: how far the wind's course swings, on the same scale; None where it is not tested.
        course_share: of the level that is its.
    """

    statistic: float
    null: list[float]
    p_value: Quantity
    kinds: int
    level: float
    critical: float | None
    nulls: str
    open: bool | None = None
    settling: int | None = None
    effective: float | None = None
    correlation: float | None = None
    tail: float | None = None
    suspected: str = ""
    directed: float | None = None
    course: float | None = None
    course_share: float | None = None

    @property
    def least(self) -> float:
        """The smallest p that so many nulls allow."""
        return 1 / (1 + (self.kinds if self.effective is None else self.effective))

    @property
    def kinds_needed(self) -> int:
        """Computes the fewest kinds by which the level can be tested, each as many independent
        nulls as these."""
        nulls_of_kind = 1.0 if self.effective is None else self.effective / self.kinds
        return math.ceil((1 / self.level - 1) / nulls_of_kind - 1e-9)


@dataclass(frozen=True, kw_only=True)
class Power:
    """The chance that an effect is seen.

    Attributes:
        effect, parameter: which.
        strength: its expected one beyond null, in `unit`.
        share: of null flags that are beyond the critical value once the effect acts on them so.
    """

    effect: str
    parameter: str
    strength: float
    unit: str
    share: float


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """A calibrated parameter.

    Attributes:
        name: "area_weight", "bending" or "damping".
        before, after: of the base model, and with the effect; their intervals include the scatter
            between simulators.
        shift: from one to the other, in standard errors.
        within: standard error of its logarithm by noise and by the discretisations of one simulator
            alone; None where it was not recorded.
    """

    name: str
    before: Quantity
    after: Quantity | None
    shift: float | None
    within: float | None = None


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """The whole of it.

    Attributes:
        conclusion: see `Conclusion`.
        named: the effect, or the effects that fit equally well; empty for none.
        words: the verdict in a sentence or three.
        test: of the base model.
        parameters: of the base model.
        ranking: candidates, best first.
        comparisons: on unseen data.
        residuals: of every recording.
        assumptions: what was taken as given.
        separating: the cheapest experiment that would separate the named effects; empty where one
            is named.
        proposal: what remains beside what was named; what the corrective field looks like and the
            terms it proposes, where the library has no answer.
        apart: half misfit of the wrong-effect control less that of what was named, a segment, over
            all recordings left out in turn [nat]; None where no control was run.
        findings: remarks on the data (kind, text).
        unweighed: effects of the registry that were not weighed (effect, why).
        copied: effects that parameters of the base model copy here (effect, which, and what would
            show it).
        power: on films, of each effect that was weighed; empty on trajectories.
        open: why nothing was decided, where the base model is not rejected and not said to suffice;
            empty elsewhere.
        provenance: seed, versions, parents, recipe.
        seconds: wall time.
    """

    conclusion: Conclusion
    named: tuple[str, ...]
    words: str
    test: NullTest
    parameters: tuple[Parameter, ...]
    ranking: tuple[Candidate, ...]
    comparisons: tuple[Comparison, ...]
    residuals: tuple[Residual, ...]
    assumptions: tuple[str, ...] = ()
    separating: str = ""
    proposal: str = ""
    apart: Quantity | None = None
    findings: tuple[tuple[str, str], ...] = ()
    unweighed: tuple[tuple[str, str], ...] = ()
    copied: tuple[tuple[str, str], ...] = ()
    power: tuple[Power, ...] = ()
    open: tuple[str, ...] = ()
    provenance: dict[str, Any] = field(default_factory=dict)
    seconds: float = 0.0
