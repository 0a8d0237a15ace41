"""Whether a recording is one that the model can judge, before any interval is shown.

A gate looks at one window and gives reasons, each with the p-value of a familiar clip being as strange. A recording has
several windows whose p-values depend on each other; its own is their median. With normal scores Φ⁻¹(p) that are
exchangeable and jointly Gaussian, of any correlation from 0 to 1, the median score has at most the variance of one of
them, so that the median p is below α < ½ at most as often as one p is: as often for windows that are alike, less often
the less they are. (Whatever the dependence, twice the median would do: Rüger, Metrika 25, 1978.) Where the flag's size
is unknown, a window counts as that of the size at which it is least strange, which is the p-value of the composite
hypothesis "of some size".
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import InputError
from models.estimator import Estimator
from models.outliers import Familiarity


@dataclass(frozen=True, kw_only=True)
class Reason:
    """One thing that was looked at in a window.

    Attributes:
        kind: stable name in kebab-case.
        what: a sentence for people, with the figure in it.
        p: probability that a familiar clip is at least as strange.
        fix: what the user can do about it.
    """

    kind: str
    what: str
    p: float
    fix: str = "crop to the flag by --crop, give another film, or look at it with --anyway"

    def as_dict(self) -> dict[str, Any]:
        """JSON values."""
        return {"kind": self.kind, "what": self.what, "p": self.p, "fix": self.fix}


class Gate(Protocol):
    """Looks at one window at a time."""

    def judge(self, frames: NDArray[np.uint8], summary: NDArray[np.floating]) -> list[Reason]:
        """What was found of a window, strange or not; at least one reason.

        Where there are several, the first speaks for all: its p holds for the checks together.

        Args:
            frames: (n, height, width) gray, at the model's rate.
            summary: (dimension,) what the model's first network made of them.
        """
        ...

    def level(self, false_alarm: float) -> float:
        """p at or below which a recording is refused, so that this happens to familiar ones at most so often.

        The rate itself where p-values are exact; less where the clips that they were calibrated by are few and the rate
        is to hold for most draws of these.
        """
        ...


@dataclass(frozen=True, kw_only=True, eq=False)
class FamiliarityGate:
    """The distance of a window's summary to those of the training clips; see `models.outliers`."""

    cloud: Familiarity

    def judge(self, frames: NDArray[np.uint8], summary: NDArray[np.floating]) -> list[Reason]:
        distance = float(self.cloud.distance(summary[None])[0])
        p = float(self.cloud.p_value(summary[None])[0])
        usual = float(np.median(self.cloud.reference))
        what = (
            f"its summary is {distance:.1f} standard deviations from the training clips, usual are {usual:.1f}; "
            f"p = {p:.3f} among {len(self.cloud.reference)} validation clips"
        )
        return [Reason(kind="unlike-training", what=what, p=p)]

    def level(self, false_alarm: float) -> float:
        return false_alarm


def gate_of(model: Estimator) -> Gate:
    """The gate that belongs to a model.

    Raises:
        InputError: the model does not know its training clips.
    """
    if model.cloud is None:
        raise InputError(
            "the model does not say what it was trained on, so that nothing tells whether it can judge this film",
            where=f"model {model.name!r}", fix="ship it by python -m models.shipping, which stores its training clips",
        )  # fmt: skip
    return FamiliarityGate(cloud=model.cloud)


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """Whether a recording may be judged.

    Attributes:
        false_alarm: share of familiar recordings that are refused, at most.
        level: p at or below which that is.
        p: of the recording.
        window_p: (k,) of each window, whatever the flag's size.
        reasons: of the window of median p, the strongest first.
    """

    false_alarm: float
    level: float
    p: float
    window_p: tuple[float, ...]
    reasons: tuple[Reason, ...]

    @property
    def refused(self) -> bool:
        return self.p <= self.level

    @property
    def strange(self) -> NDArray[np.bool_]:
        """(k,) whether a window by itself would be refused."""
        return np.array(self.window_p) <= self.level

    @property
    def sentence(self) -> str:
        """In words, with the rate."""
        rate = f"{self.false_alarm:.0%} of familiar recordings are refused at most"
        if self.refused:
            return f"this is not like what the model was trained on: {self.reasons[0].what} ({rate})"
        return f"like what the model was trained on, p = {self.p:.2f} ({rate})"

    def as_dict(self) -> Mapping[str, Any]:
        """JSON values."""
        return {
            "refused": self.refused, "p": self.p, "level": self.level, "false_alarm": self.false_alarm,
            "windows": list(self.window_p), "reasons": [reason.as_dict() for reason in self.reasons],
        }  # fmt: skip


def verdict(
    windows: Sequence[Sequence[Sequence[Reason]]], *, false_alarm: float, level: float | None = None
) -> Verdict:
    """The verdict on a recording.

    Args:
        windows: the reasons of each window, for each size of flag considered.
        false_alarm: between 0 and 1.
        level: p at or below which a recording is refused; the rate itself by default.

    Raises:
        InputError: no window, a rate out of range, or a window about which the gate said nothing.
    """
    if not windows or any(not sizes or any(not reasons for reasons in sizes) for sizes in windows):
        raise InputError("a window without a reason", where="gate", fix="this is a defect of the gate")
    if not 0 < false_alarm < 1:
        raise InputError(f"false-alarm rate {false_alarm:g}", where="--false-alarm", fix="give a share, as in 0.05")
    told = [max(sizes, key=lambda reasons: reasons[0].p) for sizes in windows]
    p = np.array([reasons[0].p for reasons in told])
    middle = told[int(np.argsort(p, kind="stable")[len(p) // 2])]
    return Verdict(
        false_alarm=false_alarm, level=false_alarm if level is None else level, p=float(np.median(p)),
        window_p=tuple(p.tolist()), reasons=tuple(middle),
    )  # fmt: skip
