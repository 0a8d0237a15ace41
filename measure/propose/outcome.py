"""What became of a search for terms. Plain values only: it becomes JSON."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from flagdata.answer import Quantity
from measure.propose.search import Step


class Decision(StrEnum):
    """About what was tried."""

    KEPT = "kept"
    REJECTED = "rejected"


@dataclass(frozen=True, kw_only=True)
class Ranked:
    """A term alone.

    Attributes:
        name: of its column.
        statistic: calibrated, 1 in the mean of nulls.
        gain: in log likelihood of left-out recordings.
    """

    name: str
    statistic: float
    gain: float


@dataclass(frozen=True, kw_only=True)
class PeriodogramLine:
    """The largest line of the periodogram of an amplitude in one recording.

    Attributes:
        frequency: [Hz].
        share: of the variance.
        p_value: of a line as large in white noise (Fisher's g).
    """

    frequency: float
    share: float
    p_value: float


@dataclass(frozen=True, kw_only=True)
class StrengthCourse:
    """How the amplitude of a term behaves: fitted to each stretch of time, with the rest of the
    model as it is.

    Attributes:
        bin: duration of a stretch [s].
        times: of the middles of the stretches, of each recording from its first frame [s].
        amplitudes: of each recording, in the unit of the strength.
        by_recording: mean amplitude of each, with the interval of its scatter in time; what the
            fit's numerics leave in a recording is in the value, not in the interval.
        speeds: of the wind, of each recording [m/s].
        fluctuation: standard deviation of the amplitudes about their recording's mean, their errors
            included.
        lines: of each recording, from amplitudes of single frames.
        words: the same in words.
    """

    bin: float
    times: list[list[float]]
    amplitudes: list[list[float]]
    by_recording: list[Quantity]
    speeds: list[float]
    fluctuation: float
    lines: list[PeriodogramLine]
    words: str


@dataclass(frozen=True, kw_only=True)
class TermStrength:
    """A strength of the proposal.

    Attributes:
        name: of the term, a Python name; or "Class.parameter" of an effect from a file.
        words: what it is.
        estimate: fitted to the observed motion.
        course: in time.
    """

    name: str
    words: str
    estimate: Quantity
    course: StrengthCourse


@dataclass(frozen=True, kw_only=True)
class Retest:
    """Models before and after on segments that neither choice nor fit has seen.

    Errors are root mean squares [m]. The half misfit of the projected errors decides [nat a
    segment]; the bias of the fit's mesh, most of a squared distance, is taken out of it with the
    help of the nulls.

    Attributes:
        what: which data.
        segments: how many.
        before, after: of each model.
        reduction: paired, before − after.
        helped: the same of half misfits.
        floor: of the larger model on data simulated from it with other numerics: differences below
            are not effects.
        share: of what the model before leaves above the floor, in squares, that the proposal takes
            away; None where it leaves nothing above.
        control: after, with the same freedom spent on terms of other directions; None where there
            are none.
        apart: paired, control − after, of half misfits.
        control_names: of those terms.
    """

    what: str
    segments: int
    before: Quantity
    after: Quantity
    reduction: Quantity
    helped: Quantity
    floor: Quantity
    share: float | None
    control: Quantity | None
    apart: Quantity | None
    control_names: tuple[str, ...]

    @property
    def decision(self) -> tuple[Decision, str]:
        """Whether the proposal is kept, and why: misfits must fall beyond their interval, and below
        the control's."""
        if self.helped.low <= 0:
            return (
                Decision.REJECTED,
                "the misfit on unseen data is not significantly lower than before",
            )
        lower = "the misfit on unseen data is significantly lower than before"
        if self.apart is None:
            return Decision.KEPT, f"{lower}; there was no term of another direction to compare with"
        wrong = " and ".join(self.control_names)
        if self.apart.point <= 0:
            return (
                Decision.REJECTED,
                f"{lower}, but the same freedom spent on {wrong} lowers it as much",
            )
        if self.apart.low <= 0:
            return Decision.KEPT, f"{lower}; its form is open: {wrong} fits as well"
        return Decision.KEPT, f"{lower}, and lower than with the same freedom spent on {wrong}"


@dataclass(frozen=True, kw_only=True)
class ProposalOutcome:
    """The whole of it.

    Attributes:
        decision: whether the proposal is kept.
        reason: why.
        steps: terms looked at, in order.
        tried: how many terms were candidates.
        ranking: of all candidates, each alone, best first.
        strengths: of the proposal; empty where no term was taken.
        retest: on untouched data; None where there was nothing to test.
        level: of the search's tests.
        nulls: how they were made.
        proposed_from, tested_on: SHA-256 of the data.
        known: effects that both models have.
        seed: of the nulls.
    """

    decision: Decision
    reason: str
    steps: tuple[Step, ...]
    tried: int
    ranking: tuple[Ranked, ...]
    strengths: tuple[TermStrength, ...]
    retest: Retest | None
    level: float
    nulls: str
    proposed_from: str
    tested_on: str
    known: tuple[str, ...]
    seed: int
