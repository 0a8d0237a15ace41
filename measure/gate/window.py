"""Gates of windows: whether one clip is like those of the training, with a p and the reasons in
words.

Two gates answer the same question: the distance of the network's summary, and the calibrated checks
of `measure.gate.gate`, all of them together. Before either, clips in which nothing moves or is
visible are refused: a network gives numbers for these as well, which say nothing of a flag and are
not shown even where a gate is overruled.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from flagdata.core.arrays import FloatArray, UInt8Array
from flagdata.errors import InputError
from measure.gate.checks import CHECKS
from measure.gate.clip_motion import LEAST_AREA
from measure.gate.clip_statistics import LEAST_DEVIATION, ClipStatistics
from measure.gate.counted import COUNTED
from measure.gate.distortions import DISTORTIONS
from measure.gate.gate import SCORES, Gate
from measure.gate.gate_features import features_of
from measure.gate.gate_verdict import Reason
from measure.gate.reasons import REASONS
from measure.gate.tail_probability import level
from models.trained.estimator import Estimator
from models.trained.outliers import Familiarity

FALSE_ALARM = 0.05
"""Share of clips like the simulated ones that may be refused."""
CONFIDENCE = 0.9
"""Probability, over which clips the gate was calibrated by, that no larger share of them is."""
_FLAT = 1.0
"""Standard deviation of all gray levels of a clip below which nothing is visible: one step of the
camera's."""
_USUAL = (0.01, 0.99)
_AREA = list(CHECKS).index("area")
_LIKENESS = 0.5
"""Weight of the likeness to a distortion beside the surprise, where reasons are put in order:
chosen on development clips, of the training side, where 1 called still pictures repeated and 0
called dark ones still."""


class WindowGate(Protocol):
    """Looks at one window at a time."""

    def judge(self, frames: UInt8Array, summary: NDArray[np.floating]) -> list[Reason]:
        """Judges a window; returns at least one reason, strange or not.

        Where there are several, the first speaks for all: its p holds for the checks together.

        Args:
            frames: (n, height, width) gray, at the model's rate.
            summary: (dimension,) what the model's first network made of them.
        """
        ...

    def level(self, false_alarm: float) -> float:
        """Returns the p at or below which a window is strange, so that this happens to familiar
        ones at most so often.

        The rate itself where p-values are exact; less where the clips that they were calibrated by
        are few and the rate is to hold for most draws of these.

        Raises:
            InputError: too few of these for such a rate: no window would be strange.
        """
        ...


@dataclass(frozen=True, kw_only=True, eq=False)
class FamiliarityGate:
    """The distance of a window's summary to those of the training clips; see
    `models.trained.outliers`."""

    cloud: Familiarity

    def judge(self, frames: UInt8Array, summary: NDArray[np.floating]) -> list[Reason]:
        nothing = blank(frames)
        if nothing is not None:
            return [nothing.of(1 / (len(self.cloud.reference) + 1))]
        distance = float(self.cloud.distance(summary[None])[0])
        p = float(self.cloud.p_value(summary[None])[0])
        usual = float(np.median(self.cloud.reference))
        sentence = (
            f"its summary is {distance:.1f} standard deviations from the training clips, usual are "
            f"{usual:.1f}; "
            f"p = {p:.3f} among {len(self.cloud.reference)} validation clips"
        )
        return [Reason(kind="unlike-training", what=sentence, p=p)]

    def level(self, false_alarm: float) -> float:
        self.cloud.threshold(false_alarm)  # checks that the clips suffice for this rate
        return false_alarm


@dataclass(frozen=True, kw_only=True, eq=False)
class CheckedGate:
    """A gate that was calibrated for a model, all of its checks together.

    Attributes:
        model: whose training windows are compared with.
        calibrated: its checks, by clips that the model was not trained on.
        false_alarm: rate at which reasons are given.
    """

    model: Estimator
    calibrated: Gate
    false_alarm: float

    def judge(self, frames: UInt8Array, summary: NDArray[np.floating]) -> list[Reason]:
        """Judges as `WindowGate`. Of a statistic it says that the window is unlike the training
        clips, and in which
        figure: faults such as a moving camera are counted in the film (`measure.gate.counted`), and
        are stated from there."""
        judgement = judge(
            frames,
            self.model,
            self.calibrated,
            false_alarm=self.false_alarm,
            summary=summary,
            without=COUNTED,
        )
        if not judgement.reasons:
            return [
                Reason(
                    kind="familiar",
                    what=f"no check is unusual, p = {judgement.p:.3f} over all checks",
                    p=judgement.p,
                )
            ]
        # The first speaks for all checks together.
        return [
            reason.of(reason.p if number else judgement.p)
            for number, reason in enumerate(judgement.reasons)
        ]

    def level(self, false_alarm: float) -> float:
        return level(len(self.calibrated.calibration), false_alarm, CONFIDENCE)


def gate_of(model: Estimator) -> WindowGate:
    """Returns the gate that belongs to a model.

    Raises:
        InputError: the model does not know its training clips.
    """
    if model.cloud is None:
        raise InputError(
            "the network has no data on its training clips, so it cannot be checked whether it "
            "applies to this film",
            where=f"model {model.name!r}",
            fix="ship it, in a checkout of flagdata: python -m tests.studies shipping stores its "
            "training clips",
        )
    return FamiliarityGate(cloud=model.cloud)


@dataclass(frozen=True, kw_only=True, eq=False)
class Judgement:
    """What the gate says of a clip.

    Attributes:
        familiar: whether intervals may be shown.
        p: conformal p over all checks together: of so many clips like the simulated ones, one looks
            at least as odd.
        level: p at or below which a clip is refused.
        reasons: why it is refused, the weightiest first; none for a familiar clip.
    """

    familiar: bool
    p: float
    level: float
    reasons: tuple[Reason, ...]


def judge(
    frames: UInt8Array,
    model: Estimator,
    gate: Gate,
    *,
    false_alarm: float = FALSE_ALARM,
    confidence: float = CONFIDENCE,
    summary: NDArray[np.floating] | None = None,
    without: Collection[str] = (),
) -> Judgement:
    """Judges whether a clip is like what a model was trained on.

    Args:
        frames: (n, height, width) gray at the model's frame rate, as many as the model takes.
        model: whose training it is compared with.
        gate: calibrated for this model.
        false_alarm: share of familiar clips that may be refused, by all checks together.
        confidence: probability that no larger share of them is, over the draw of the calibration
            clips.
        summary: (d,) the network's of these frames, where it is known already.
        without: kinds of reasons whose scores are left out. The others are compared with
            calibration clips judged by all scores, so that no more familiar clips are refused than
            `false_alarm` states.

    Raises:
        InputError: more frames than the model takes, another shape or type, or a rate that the
            calibration clips are too few for a judgement.
    """
    at = level(len(gate.calibration), false_alarm, confidence)
    wanted = model.front_end.frames
    if frames.ndim != 3 or frames.dtype != np.uint8 or len(frames) > wanted:
        raise InputError(
            f"frames of shape {frames.shape} and type {frames.dtype}",
            fix=f"give uint8 (frame, height, width), {wanted} frames: one window of the film",
        )
    least = 1 / (len(gate.calibration) + 1)

    nothing = _too_few(len(frames), wanted) if len(frames) < wanted else blank(frames)
    if nothing is not None:
        return Judgement(familiar=False, p=least, level=at, reasons=(replace(nothing, p=least),))
    features = features_of(model, frames, summary)
    vector = features.vector(model)
    scores, surprises = gate.scores(vector[None])[0], gate.surprises(vector[None])[0]
    surprises[[score.reason in without for score in SCORES]] = -np.inf
    p = gate.p_value(float(surprises.max()))
    still = features.checks[_AREA] <= np.log10(LEAST_AREA)
    reasons = () if p > at else _reasons(gate, scores, surprises, at, still=bool(still))
    return Judgement(familiar=p > at, p=p, level=at, reasons=reasons)


def _too_few(count: int, wanted: int) -> Reason:
    row = REASONS["too-few-frames"]
    sentence = f"{row.sentence}: {count} instead of {wanted}"
    return Reason(
        kind="too-few-frames", what=sentence, p=None, fix=row.fix, check="frames", value=count
    )


def _reasons(
    gate: Gate, scores: FloatArray, surprises: FloatArray, at: float, *, still: bool
) -> tuple[Reason, ...]:
    """Gives each kind once, of those whose scores would refuse the clip alone. Of a still clip none
    is about motion.

    A fault shows in many scores. The kinds are in the order of two voices: the surprise of the
    kind's weightiest score as a share of the clip's largest, and, by `_LIKENESS`, the
    log-likelihood ratio of the kind's likeliest distortion as a share of the largest. The figure in
    the message is that of the picture's weightiest statistic, where one refuses.
    """
    weightiest: dict[str, int] = {}
    pictured: dict[str, int] = {}
    for index in np.argsort(-surprises):
        of_motion = REASONS[SCORES[index].reason].of_motion
        if gate.p_value(float(surprises[index])) <= at and not (still and of_motion):
            weightiest.setdefault(SCORES[index].reason, int(index))
            if SCORES[index].name in CHECKS:
                pictured.setdefault(SCORES[index].reason, int(index))
    ratios = dict.fromkeys(weightiest, 0.0)
    for index in range(len(SCORES) - len(DISTORTIONS), len(SCORES)):
        kind = SCORES[index].reason
        if kind in ratios:
            ratios[kind] = max(ratios[kind], float(scores[index]))
    most, likeliest = (
        float(surprises.max()),
        max(1.0, *(float(ratio) for ratio in scores[-len(DISTORTIONS) :])),
    )
    order = sorted(
        weightiest,
        key=lambda kind: -surprises[weightiest[kind]] / most - _LIKENESS * ratios[kind] / likeliest,
    )
    return tuple(
        _reason(gate, index, float(scores[index]), gate.p_value(float(surprises[index])))
        for index in (pictured.get(kind, weightiest[kind]) for kind in order)
    )


def _reason(gate: Gate, index: int, value: float, p: float) -> Reason:
    score, row = SCORES[index], REASONS[SCORES[index].reason]
    check = CHECKS.get(score.name)
    if check is None:
        figure_value, limit = value, gate.tails.start[index] + np.log(20) * gate.tails.excess[index]
        usual = f"normal up to {limit:.3g}, as 99 % of the simulated clips"
    else:
        column = gate.statistics[:, list(CHECKS).index(score.name)]
        figure_value = check.shown(score.sign * value)
        low, high = (check.shown(float(end)) for end in np.quantile(column, _USUAL))
        usual = f"normal from {low:.3g} to {high:.3g}, as 98 % of the simulated clips"
    figure = f"{score.what}: {figure_value:.3g}; {usual}"
    return Reason(
        kind=score.reason,
        what=f"{row.sentence} ({figure})",
        p=p,
        fix=row.fix,
        value=figure_value,
        figure=figure,
        check=score.name,
    )


def blank(frames: UInt8Array) -> Reason | None:
    """Explains what a clip lacks; None where there is something to measure.

    Args:
        frames: (n, height, width) gray.

    Raises:
        InputError: see `ClipStatistics.of`.
    """
    contrast = float(frames.std())
    if contrast < _FLAT:
        sentence = (
            f"{REASONS['too-dark'].sentence}: all gray levels lie within {contrast:.2g} of each "
            "other"
        )
        return _lacking("too-dark", sentence, check="contrast", value=contrast)
    most = float(ClipStatistics.of(frames).deviation.max())
    if most > LEAST_DEVIATION:
        return None
    sentence = (
        f"no motion is found in the picture: its gray levels change by {most:.1f} at most "
        "(standard deviation in "
        f"time), and up to {LEAST_DEVIATION:g} comes of rounding and coding"
    )
    return _lacking("no-motion", sentence, check="strength", value=most)


def _lacking(kind: str, sentence: str, *, check: str, value: float) -> Reason:
    return Reason(
        kind=kind,
        what=sentence,
        p=None,
        fix=REASONS[kind].fix,
        blank=True,
        check=check,
        value=value,
    )
