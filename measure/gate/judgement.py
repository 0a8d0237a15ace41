"""The verdict on a clip: familiar or refused, with a p and the reasons in words."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import InputError
from flagdata.findings import Finding, Severity
from measure.gate.blank import blank
from measure.gate.checks import CHECKS
from measure.gate.distortions import DISTORTIONS
from measure.gate.features import features_of
from measure.gate.gate import SCORES, Gate, Vector
from measure.gate.motion import LEAST_AREA
from measure.gate.reasons import REASONS
from measure.gate.tail_probability import level
from models.estimator import Estimator

FALSE_ALARM = 0.05
"""Share of clips like the simulated ones that may be refused."""
CONFIDENCE = 0.9
"""Probability, over which clips the gate was calibrated by, that no larger share of them is."""
_USUAL = (0.01, 0.99)
_AREA = list(CHECKS).index("area")
_LIKENESS = 0.5
"""Weight of the likeness to a distortion beside the surprise, where reasons are put in order: chosen on development
clips, of the training side, where 1 called still pictures repeated and 0 called dark ones still."""


@dataclass(frozen=True, kw_only=True)
class Cause:
    """One reason for a refusal.

    Attributes:
        kind: of `measure.gate.reasons`.
        sentence: what is wrong, with the figure and its usual range.
        figure: these two alone.
        fix: what can be done.
        check: the score that shows it.
        value: its figure, in the unit that the sentence names; None where none could be measured.
        p: conformal p of the clip by this score alone, at the scale of all.
        blank: whether there is nothing to measure in the clip.
    """

    kind: str
    sentence: str
    figure: str = ""
    fix: str
    check: str
    value: float | None
    p: float
    blank: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class Judgement:
    """What the gate says of a clip.

    Attributes:
        familiar: whether intervals may be shown.
        p: conformal p over all checks together: of so many clips like the simulated ones, one looks at least as odd.
        level: p at or below which a clip is refused.
        false_alarm, confidence: what is kept by that level.
        reasons: why it is refused, the weightiest first; none for a familiar clip.
    """

    familiar: bool
    p: float
    level: float
    false_alarm: float
    confidence: float
    reasons: tuple[Cause, ...]

    @property
    def sentence(self) -> str:
        """The verdict as one sentence."""
        rate = f"p = {self.p:.2g}, refused from {self.level:.2g}: at most {self.false_alarm:.0%} false alarms"
        if self.familiar:
            return f"The clip is like those that the network was trained on ({rate})."
        return f"The clip is unlike those that the network was trained on ({rate}): {self.reasons[0].sentence}."

    def findings(self) -> tuple[Finding, ...]:
        """The reasons as findings."""
        return tuple(
            Finding(kind=f"gate-{one.kind}", severity=Severity.ERROR, what=one.sentence, value=one.value, fix=one.fix)
            for one in self.reasons
        )

    def as_dict(self) -> dict[str, object]:
        """As JSON."""
        return {
            "familiar": self.familiar,
            "p": self.p,
            "level": self.level,
            "false_alarm": self.false_alarm,
            "confidence": self.confidence,
            "reasons": [vars(one) for one in self.reasons],
        }


def judge(
    frames: NDArray[np.uint8],
    model: Estimator,
    gate: Gate,
    *,
    false_alarm: float = FALSE_ALARM,
    confidence: float = CONFIDENCE,
    summary: NDArray[np.floating] | None = None,
    without: Collection[str] = (),
) -> Judgement:
    """Whether a clip is like what a model was trained on.

    Args:
        frames: (n, height, width) gray at the model's frame rate, as many as the model takes.
        model: whose training it is compared with.
        gate: calibrated for this model.
        false_alarm: share of familiar clips that may be refused, by all checks together.
        confidence: probability that no larger share of them is, over the draw of the calibration clips.
        summary: (d,) the network's of these frames, where it is known already.
        without: kinds of reasons whose scores are left out. The others are compared with calibration clips judged by
            all scores, so that no more familiar clips are refused than `false_alarm` states.

    Raises:
        InputError: more frames than the model takes, another shape or type, or a rate that the calibration clips are
            too few for a judgement.
    """
    at = level(len(gate.calibration), false_alarm, confidence)
    wanted = model.front_end.frames
    if frames.ndim != 3 or frames.dtype != np.uint8 or len(frames) > wanted:
        raise InputError(
            f"frames of shape {frames.shape} and type {frames.dtype}",
            fix=f"give uint8 (frame, height, width), {wanted} frames: one window of the film",
        )
    least = 1 / (len(gate.calibration) + 1)

    def refused(cause: Cause) -> Judgement:
        return Judgement(
            familiar=False,
            p=least,
            level=at,
            false_alarm=false_alarm,
            confidence=confidence,
            reasons=(cause,),
        )

    if len(frames) < wanted:
        reason = REASONS["too-few-frames"]
        what = f"{reason.sentence}: {len(frames)} instead of {wanted}"
        cause = Cause(kind="too-few-frames", sentence=what, fix=reason.fix, check="frames", value=len(frames), p=least)
        return refused(cause)
    nothing = blank(frames)
    if nothing is not None:
        return refused(Cause(**vars(nothing), p=least, blank=True))
    found = features_of(model, frames, summary)
    vector = found.vector(model)
    scores, surprises = gate.scores(vector[None])[0], gate.surprises(vector[None])[0]
    surprises[[score.reason in without for score in SCORES]] = -np.inf
    p = gate.p_value(float(surprises.max()))
    still = found.checks[_AREA] <= np.log10(LEAST_AREA)
    reasons = () if p > at else _reasons(gate, scores, surprises, at, still=bool(still))
    return Judgement(
        familiar=p > at,
        p=p,
        level=at,
        false_alarm=false_alarm,
        confidence=confidence,
        reasons=reasons,
    )


def _reasons(gate: Gate, scores: Vector, surprises: Vector, at: float, *, still: bool) -> tuple[Cause, ...]:
    """Each kind once, of those whose scores would refuse the clip alone. Of a still clip none is about what moves.

    A fault shows in many scores. The kinds are in the order of two voices: the surprise of the kind's weightiest score
    as a share of the clip's largest, and, by `_LIKENESS`, the log-likelihood ratio of the kind's likeliest distortion
    as a share of the largest. The figure in the message is that of the picture's weightiest statistic, where one
    refuses.
    """
    weightiest: dict[str, int] = {}
    pictured: dict[str, int] = {}
    for place in np.argsort(-surprises):
        of_motion = REASONS[SCORES[place].reason].of_motion
        if gate.p_value(float(surprises[place])) <= at and not (still and of_motion):
            weightiest.setdefault(SCORES[place].reason, int(place))
            if SCORES[place].name in CHECKS:
                pictured.setdefault(SCORES[place].reason, int(place))
    ratios = dict.fromkeys(weightiest, 0.0)
    for place in range(len(SCORES) - len(DISTORTIONS), len(SCORES)):
        kind = SCORES[place].reason
        if kind in ratios:
            ratios[kind] = max(ratios[kind], float(scores[place]))
    most, likeliest = float(surprises.max()), max(1.0, *(float(one) for one in scores[-len(DISTORTIONS) :]))
    order = sorted(
        weightiest, key=lambda kind: -surprises[weightiest[kind]] / most - _LIKENESS * ratios[kind] / likeliest
    )
    return tuple(
        _cause(gate, place, float(scores[place]), gate.p_value(float(surprises[place])))
        for place in (pictured.get(kind, weightiest[kind]) for kind in order)
    )


def _cause(gate: Gate, place: int, value: float, p: float) -> Cause:
    score, reason = SCORES[place], REASONS[SCORES[place].reason]
    check = CHECKS.get(score.name)
    if check is None:
        shown, limit = value, gate.tails.start[place] + np.log(20) * gate.tails.excess[place]
        usual = f"normal up to {limit:.3g}, as 99 % of the simulated clips"
    else:
        column = gate.statistics[:, list(CHECKS).index(score.name)]
        shown = check.shown(score.sign * value)
        low, high = (check.shown(float(end)) for end in np.quantile(column, _USUAL))
        usual = f"normal from {low:.3g} to {high:.3g}, as 98 % of the simulated clips"
    figure = f"{score.what}: {shown:.3g}; {usual}"
    return Cause(
        kind=score.reason,
        sentence=f"{reason.sentence} ({figure})",
        figure=figure,
        fix=reason.fix,
        check=score.name,
        value=shown,
        p=p,
    )
