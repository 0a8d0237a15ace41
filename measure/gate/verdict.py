"""Whether a recording is one that the model can judge, before any interval is shown.

Two kinds of reasons refuse it: faults of the film that were counted while it was made fit (`measure.gate.counted`),
each with a figure that a person can check, and windows unlike those that the model was trained on. Faults come first.

A gate looks at one window and gives reasons, each with the p-value of a familiar clip being as strange. A recording has
several windows; how many of them may be strange, and from which p on one is, `measure.gate.several` says.

A flag has one size. Where it is not given, the model looks at the film as that of each of several sizes, and each of
them is judged as if it had been given: by the same windows, at the same level. Where the recording is refused at all of
them it is unlike what the model was trained on: this is the test of the composite hypothesis "of one of these sizes",
whose p-value is the largest of its parts' (Lehmann and Romano, Testing Statistical Hypotheses, 2005, section 3.1), and
refuses a familiar recording no more often than its own size does. Where it is refused at some of them only, the size
decides, and it is asked for. So nothing is shown without the size that would be refused with one of those sizes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import InputError
from flagdata.findings import Finding
from measure.gate.several import refusing, window_rate

GIVE_SIZE = "give --flag-size, the length along the wind times the height along the pole in metres, as in 1.5x1.0"


@dataclass(frozen=True, kw_only=True)
class Reason:
    """One thing that was looked at in a film or a window.

    Attributes:
        kind: stable name in kebab-case.
        what: a sentence for people, with the figure in it.
        p: probability that a familiar clip is at least as strange; None of what was counted.
        fix: what the user can do about it.
        blank: whether there is nothing to measure in the window, so that no number is given of it in any case.
        value: the figure in the sentence, in its unit; None where there is none.
        figure: the figure with its name and its usual range, without what it may mean.
        check: the score that shows it; empty for what was counted in the film.
    """

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
        """A fault of the film."""
        return cls(kind=fault.kind, what=fault.what, p=None, fix=fault.fix or cls.fix, value=fault.value)

    def of(self, p: float | None) -> Reason:
        """Returns what a recording's verdict states of it: of a statistic that the window is unlike, by its figure."""
        if self.blank or not self.figure:
            return Reason(kind=self.kind, what=self.what, p=p, fix=self.fix, blank=self.blank)
        return Reason(kind="unlike-training", what=self.figure, p=p)

    def as_dict(self) -> dict[str, Any]:
        """JSON values."""
        return {"kind": self.kind, "what": self.what, "p": self.p, "value": self.value, "fix": self.fix}


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
        faults: of the film, that were counted; any of them refuses it.
        window_reasons: of a usual window, among the strange ones where these refuse the recording; the strongest first.
    """

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
    def undecided(self) -> bool:
        """Whether the flag's size decides, which was not given."""
        return len(self.sizes) < self.considered

    @property
    def refused(self) -> bool:
        return bool(self.faults) or self.unlike or self.undecided

    @property
    def reasons(self) -> tuple[Reason, ...]:
        """All of them, the weightiest first."""
        if self.undecided:
            what = f"at {len(self.sizes)} of {self.considered} sizes of the flag it is, at the others it is not"
            return (*self.faults, Reason(kind="size-needed", what=what, p=self.p, fix=GIVE_SIZE))
        return self.faults if self.faults and not self.unlike else (*self.faults, *self.window_reasons)

    @property
    def measurable(self) -> bool:
        """Whether there is anything to measure, familiar or not."""
        return not all(self.blank)

    @property
    def strange(self) -> NDArray[np.bool_]:
        """(k,) whether a window by itself would be refused."""
        return np.array(self.window_p) <= self.level

    @property
    def sentence(self) -> str:
        """In words, with the level that is applied and the rate that it keeps to."""
        strange, count = int(self.strange.sum()), len(self.window_p)
        rate = f"at most {self.false_alarm:.0%} of familiar films are refused"
        windows = (
            f"p = {self.p:.2g}, {self.level:.2g} or below would refuse it"
            if count == 1
            else f"{strange} of {count} windows look unfamiliar (p ≤ {self.level:.2g}), {self.refusing} would refuse it"
        )
        if not self.measurable:
            what = self.window_reasons[0].what
            return f"there is nothing to measure, so that no number is given, not even with --anyway: {what}"
        if self.faults:
            others = len(self.reasons) - 1
            more = "" if not others else f" ({others} more {'reasons' if others > 1 else 'reason'})"
            return f"the film cannot be measured: {self.faults[0].what}{more}"
        if self.unlike:
            return f"this is not like what the network was trained on: {self.reasons[0].what}; {windows} ({rate})"
        if self.undecided:
            return f"whether this is like what the network was trained on depends on the size: {self.reasons[0].what}"
        return f"like what the network was trained on; {windows} ({rate})"

    def as_dict(self) -> Mapping[str, Any]:
        """JSON values."""
        return {
            "refused": self.refused,
            "p": self.p,
            "level": self.level,
            "false_alarm": self.false_alarm,
            "strange": int(self.strange.sum()),
            "refusing": self.refusing,
            "windows": list(self.window_p),
            "blank": int(sum(self.blank)),
            "reasons": [reason.as_dict() for reason in self.reasons],
        }


def verdict(
    windows: Sequence[Sequence[Sequence[Reason]]],
    *,
    false_alarm: float,
    level: Callable[[float], float],
    faults: Sequence[Finding] = (),
) -> Verdict:
    """The verdict on a recording.

    Args:
        windows: the reasons of each window, for each size of flag considered; the first of each has a p-value.
        false_alarm: between 0 and 1.
        level: p at or below which a window is strange, of the rate at which familiar windows may be; see
            `measure.gate.window`.
        faults: of the film, the weightiest first.

    Raises:
        InputError: no window, a rate out of range, or a window about which the gate said nothing.
    """
    if not windows or any(not sizes or any(not reasons for reasons in sizes) for sizes in windows):
        raise InputError("a window without a reason", where="gate", fix="this is a defect of the gate")
    count = len(windows)
    at, needed = level(window_rate(count, false_alarm)), refusing(count)
    p = np.array([[reasons[0].p for reasons in sizes] for sizes in windows])
    deciding = np.sort(p, axis=0)[needed - 1]
    size = int(np.argmax(deciding))
    kept = tuple(np.flatnonzero(deciding > at).tolist()) or tuple(range(p.shape[1]))
    order = np.argsort(p[:, size], kind="stable")
    speaking = int((p[:, size] <= at).sum()) if deciding[size] <= at else count
    return Verdict(
        false_alarm=false_alarm,
        level=at,
        refusing=needed,
        considered=p.shape[1],
        sizes=kept,
        size=size,
        p=float(deciding[size]),
        window_p=tuple(p[:, size].tolist()),
        blank=tuple(all(reasons[0].blank for reasons in sizes) for sizes in windows),
        faults=tuple(Reason.counted(fault) for fault in faults),
        window_reasons=tuple(windows[int(order[speaking // 2])][size]),
    )
