"""Whether a recording is one that the model can judge, before any interval is shown.

Two kinds of reasons refuse it: faults of the film that were counted while it was made fit
(`measure.gate.counted`), each with a figure that a person can check, and windows unlike those that
the model was trained on. Faults come first.

A gate looks at one window and gives reasons, each with the p-value of a familiar clip being as
strange. A recording has several windows, of which some may be strange.

A flag has one size. Where it is not given, the model looks at the film as that of each of several
sizes, and each of
them is judged as if it had been given: by the same windows, at the same level. Where the recording
is refused at all of them it is unlike what the model was trained on: this is the test of the
composite hypothesis "of one of these sizes", whose p-value is the largest of its parts' (Lehmann
and Romano, Testing Statistical Hypotheses, 2005, section 3.1), and refuses a familiar recording no
more often than its own size does. Where it is refused at some of them only, the size decides, and
it is asked for. So nothing is shown without the size that would be refused with one of those sizes.

A recording of K windows is refused if more than a `SHARE` of them, and two at least where there are
two, are strange: with p at or below a level that is the same for all. So windows that are left out
of the answer count toward the verdict, and a recording of which half the windows just pass is no
familiar one.

Windows of one recording are alike, how much is not known. Let each have the probability a of being
strange, and let their normal scores be jointly Gaussian with one correlation ρ from 0 to 1. With Φ
the normal distribution, the share of the familiar recordings that are refused is

    r(a, ρ) = ∫ P(Binomial(K, q(z)) ≥ m) φ(z) dz,   q(z) = Φ((Φ⁻¹(a) − √ρ z)/√(1 − ρ)),

with m the number of windows that refuse. The level is that of the largest a at which r is at most
the stated rate for every ρ. It is below the rate, since windows that are nearly but not quite alike
gather more often than they would if
they were independent or the same: for many windows the largest r is Φ(−√(z² − c²)) with z and c the
normal scores of a and of the share m/K, at ρ = 1 − c²/z². A quarter costs little: a = 0.038 for a
rate of 0.05. A tenth would cost more (0.019), and a half, which is free of charge, lets a recording
pass of which 48 in 100 windows are strange.

Neighbouring windows are more alike than distant ones. If the correlation falls as e^(−t/τ), the
rate is largest for τ about the length of the recording, and up to 1.14 times the largest r above
(simulated for 3 to 100 windows and rates of 0.01 to 0.2); the level leaves room for that.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar

import numpy as np
from scipy.special import bdtrc, ndtr, ndtri

from flagdata.core.arrays import BoolArray
from flagdata.core.findings import Finding, Severity
from flagdata.errors import InputError
from measure.gate.reasons import REASONS, UNCALIBRATED

SHARE = 0.25
"""Share of strange windows above which a recording is refused, fixed on 2026-11-27 by the text
above, before any film was judged by it. A choice of this project, from no publication."""
_MOST = 3
"""Windows of which one, or most, have to be strange: r is then at most a, at ρ = 1."""
_FADING = 1.15
"""By how much likeness that fades with time may raise the rate of more windows: see above."""
_CORRELATIONS = np.concatenate([np.linspace(0.0, 0.95, 39), [0.97, 0.985]])
_NORMAL = np.linspace(-8.0, 8.0, 801)
_DENSITY = np.exp(-np.square(_NORMAL) / 2) / np.exp(-np.square(_NORMAL) / 2).sum()
GIVE_SIZE = (
    "give --flag-size, the length along the wind times the height along the pole in metres, as in "
    "1.5x1.0"
)


@dataclass(frozen=True, kw_only=True)
class Reason:
    """One thing that was looked at in a film or a window.

    Attributes:
        kind: stable name in kebab-case.
        what: a sentence for people, with the figure in it.
        p: probability that a familiar clip is at least as strange; None of what was counted.
        fix: what the user can do about it.
        blank: whether there is nothing to measure in the window, so that no number is given of it
            in any case.
        value: the figure in the sentence, in its unit; None where there is none.
        figure: the figure with its name and its usual range, without what it may mean.
        check: the score that shows it; empty for what was counted in the film.
    """

    JSON_NAMES: ClassVar[tuple[str, ...]] = ("kind", "what", "p", "value", "fix")

    kind: str
    what: str
    p: float | None
    fix: str = "crop to the flag by --crop, give another film, or look at it with --anyway"
    blank: bool = False
    value: float | None = None
    figure: str = ""
    check: str = ""

    @classmethod
    def counted(cls, fault: Finding) -> Reason:
        """Converts a fault of the film to a reason."""
        return cls(
            kind=fault.kind, what=fault.what, p=None, fix=fault.fix or cls.fix, value=fault.value
        )

    def of(self, p: float | None) -> Reason:
        """Returns what a recording's verdict states of it: of a statistic that the window is
        unlike, by its figure."""
        if self.blank or not self.figure:
            return Reason(kind=self.kind, what=self.what, p=p, fix=self.fix, blank=self.blank)
        return Reason(kind="unlike-training", what=self.figure, p=p)

    @property
    def finding(self) -> Finding:
        """The same as a finding, whose value is the figure or the p."""
        return Finding(
            kind=self.kind,
            severity=Severity.WARNING,
            what=self.what,
            fix=self.fix,
            value=self.value if self.p is None else self.p,
        )


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """Whether a recording may be judged.

    Attributes:
        false_alarm: share of familiar recordings that are refused, at most.
        level: p at or below which a window is strange.
        refusing: how many strange windows refuse the recording.
        considered: how many sizes were.
        sizes: (i,) places of the sizes at which it is not refused; all of them where it is at each.
        size: place of the size at which it is least strange.
        p: of the window that decides there, the `refusing`-th strangest.
        window_p: (k,) of each window there.
        blank: (k,) whether there is nothing to measure in it, at any size.
        faults: of the film, that were counted, of kinds of `REASONS` or
            `UNCALIBRATED`; any of them refuses it.
        window_reasons: of a usual window, among the strange ones where these refuse the recording;
            the strongest first.
    """

    JSON_NAMES: ClassVar[tuple[str, ...]] = (
        "refused",
        "p",
        "level",
        "false_alarm",
        "strange=strange_count",
        "refusing",
        "windows=window_p",
        "blank=blank_count",
        "reasons",
    )

    false_alarm: float
    level: float
    refusing: int
    considered: int
    sizes: tuple[int, ...]
    size: int
    p: float
    window_p: tuple[float, ...]
    blank: tuple[bool, ...]
    faults: tuple[Reason, ...]
    window_reasons: tuple[Reason, ...]

    @property
    def unlike(self) -> bool:
        """Whether its windows refuse it."""
        return self.p <= self.level

    @property
    def is_undecided(self) -> bool:
        """Whether the flag's size decides, which was not given."""
        return len(self.sizes) < self.considered

    @property
    def refused(self) -> bool:
        return bool(self.faults) or self.unlike or self.is_undecided

    @property
    def reasons(self) -> tuple[Reason, ...]:
        """Returns all reasons, the weightiest first."""
        if self.is_undecided:
            sentence = (
                f"at {len(self.sizes)} of {self.considered} sizes of the flag it is, at the others "
                "it is not"
            )
            return (
                *self.faults,
                Reason(kind="size-needed", what=sentence, p=self.p, fix=GIVE_SIZE),
            )
        return (
            self.faults if self.faults and not self.unlike else (*self.faults, *self.window_reasons)
        )

    @property
    def measurable(self) -> bool:
        """Whether there is anything to measure, familiar or not."""
        return not all(self.blank)

    @property
    def strange(self) -> BoolArray:
        """(k,) whether a window by itself would be refused."""
        return np.array(self.window_p) <= self.level

    @property
    def strange_count(self) -> int:
        """How many windows are strange."""
        return int(self.strange.sum())

    @property
    def blank_count(self) -> int:
        """How many windows show nothing to measure."""
        return sum(self.blank)

    @property
    def refusal(self) -> str:
        """Says in a few words why the film is refused, without a figure."""
        if not self.measurable:
            return "there is nothing to measure in it"
        if self.faults:
            kind = self.faults[0].kind
            return UNCALIBRATED[kind] if kind in UNCALIBRATED else REASONS[kind].brief
        if self.unlike:
            return "the film is unlike those that the network was trained on"
        return "the answer depends on the size of the flag, which was not given"

    @property
    def sentence(self) -> str:
        """Phrases the verdict; of a film that is refused with the level that is applied and the
        rate it keeps to."""
        strange, count = self.strange_count, len(self.window_p)
        windows = (
            f"p = {self.p:.2g} (refused from {self.level:.2g} down)"
            if count == 1
            else f"{strange} of {count} windows look unfamiliar (refused from {self.refusing} on)"
        )
        if not self.measurable:
            cause = self.window_reasons[0].what
            return (
                "there is nothing to measure, so that no number is given, not even with --anyway: "
                f"{cause}"
            )
        if self.faults:
            further = len(self.reasons) - 1
            suffix = (
                "" if not further else f" ({further} more {'reasons' if further > 1 else 'reason'})"
            )
            return f"the film cannot be measured: {self.faults[0].what}{suffix}"
        if self.unlike:
            return (
                "this is not like the films that the network was trained on: "
                f"{self.reasons[0].what}; {windows}; "
                f"a window is unfamiliar at p ≤ {self.level:.2g}, which refuses "
                f"{self.false_alarm:.0%} of familiar "
                "films at most"
            )
        if self.is_undecided:
            return (
                "whether this is like the films that the network was trained on depends on the "
                "size: "
                f"{self.reasons[0].what}"
            )
        return f"like the films that the network was trained on: {windows}"


def verdict(
    windows: Sequence[Sequence[Sequence[Reason]]],
    *,
    false_alarm: float,
    level: Callable[[float], float],
    faults: Sequence[Finding] = (),
) -> Verdict:
    """Judges a recording.

    Args:
        windows: the reasons of each window, for each size of flag considered; the first of each has
            a p-value.
        false_alarm: between 0 and 1.
        level: p at or below which a window is strange, of the rate at which familiar windows may
            be; see `measure.gate.window`.
        faults: of the film, the weightiest first.

    Raises:
        InputError: no window, a rate out of range, or a window about which the gate said nothing.
    """
    if not windows or any(not sizes or any(not reasons for reasons in sizes) for sizes in windows):
        raise InputError("a window has no reason", where="gate", fix="this is a defect of the gate")
    count = len(windows)
    at, needed = level(window_rate(count, false_alarm)), refusing(count)
    p = np.array([[reasons[0].p for reasons in sizes] for sizes in windows])
    deciding = np.sort(p, axis=0)[needed - 1]
    size = int(np.argmax(deciding))
    measurable_sizes = tuple(np.flatnonzero(deciding > at).tolist()) or tuple(range(p.shape[1]))
    order = np.argsort(p[:, size], kind="stable")
    speaking = int((p[:, size] <= at).sum()) if deciding[size] <= at else count
    return Verdict(
        false_alarm=false_alarm,
        level=at,
        refusing=needed,
        considered=p.shape[1],
        sizes=measurable_sizes,
        size=size,
        p=float(deciding[size]),
        window_p=tuple(p[:, size].tolist()),
        blank=tuple(all(reasons[0].blank for reasons in sizes) for sizes in windows),
        faults=tuple(Reason.counted(fault) for fault in faults),
        window_reasons=tuple(windows[int(order[speaking // 2])][size]),
    )


def refusing(windows: int) -> int:
    """Returns how many strange windows refuse a recording of so many."""
    return max(int(SHARE * windows) + 1, min(windows, 2))


def refused_share(strange: float, windows: int) -> float:
    """Computes the share of familiar recordings that are refused, at the correlation at which it is
    largest.

    Args:
        strange: probability of a familiar window being strange.
        windows: of a recording.
    """
    score = (ndtri(strange) - np.sqrt(_CORRELATIONS)[:, None] * _NORMAL) / np.sqrt(
        1 - _CORRELATIONS
    )[:, None]
    return max(
        strange, float((bdtrc(refusing(windows) - 1, windows, ndtr(score)) @ _DENSITY).max())
    )


@lru_cache(maxsize=64)
def window_rate(windows: int, false_alarm: float) -> float:
    """Finds the largest probability of a familiar window being strange that keeps to the stated
    rate of recordings.

    Args:
        windows: of a recording.
        false_alarm: share of familiar recordings that may be refused.

    Raises:
        InputError: no window, or a rate that is not between 0 and 1.
    """
    if windows < 1 or not 0 < false_alarm < 1:
        raise InputError(
            f"a false-alarm rate of {false_alarm:g} of {windows} windows",
            where="--false-alarm",
            fix="give a share between 0 and 1, as in 0.05",
        )
    if windows <= _MOST:
        return false_alarm
    low, high = 0.0, false_alarm / _FADING
    while high - low > 1e-4 * high:
        middle = (low + high) / 2
        low, high = (
            (middle, high)
            if refused_share(middle, windows) <= false_alarm / _FADING
            else (low, middle)
        )
    return low
