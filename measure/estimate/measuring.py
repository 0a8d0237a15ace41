"""From a film to a measurement: windows, what the model says of each, the gate, one answer for all."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from flagdata.errors import FlagdataError, InputError, UsageError
from flagdata.findings import Finding, Severity
from flagdata.rng import child_seed, stream
from measure.estimate.answer import Quantity, quantities, sentence
from measure.estimate.combine import OWN, Dependence, combined
from measure.estimate.film import Film
from measure.estimate.gate import Gate, Reason, Verdict, verdict
from measure.estimate.repeats import Distinct
from measure.estimate.similarity import POWERS, TRAINED, FlagSize, Sizes, scaled_back, sizes, spacing
from measure.estimate.windows import Layout, Window, cut, findings_of, lay_out
from models.estimator import Estimator
from models.learner import Loss
from models.restriction import MORE, Known, restricted

DRAWS = 400
"""How many draws there are of each window's posterior, for each size of flag."""
CONTRADICTION = 0.002
"""Share of the network's draws within the area weight that was stated, below which a warning is due: of 400 not one."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """How a film is measured.

    Attributes:
        size: of the flag; None if unknown.
        step: from one window to the next [s]; None for windows that follow each other.
        first, last: the part of the film [s]; None for its ends.
        level: of the intervals.
        false_alarm: rate of the gate.
        seed: of all draws.
        refine: simulated clips of a refinement; None for none.
        area_weight: range in which the cloth's area weight is known to lie [kg/m²]; None if it is unknown.

    Raises:
        UsageError: a refinement of a flag whose size is not known.
    """

    size: FlagSize | None = None
    step: float | None = None
    first: float | None = None
    last: float | None = None
    level: float = 0.9
    false_alarm: float = 0.05
    seed: int = 0
    refine: int | None = None
    area_weight: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if self.refine is not None and self.size is None:
            raise UsageError(
                "a refinement simulates the flag, whose size is not known",
                fix="give --flag-size, length along the wind times height, as in 1.5x1.0",
            )

    def recipe(self) -> dict[str, Any]:
        """JSON values."""
        return {
            "flag_size": None if self.size is None else [self.size.length, self.size.height], "step": self.step,
            "first": self.first, "last": self.last, "level": self.level, "false_alarm": self.false_alarm,
            "refine": self.refine, "area_weight": None if self.area_weight is None else list(self.area_weight),
        }  # fmt: skip

    def known(self, sizes: Sizes, model: Estimator) -> Known | None:
        """The given range of the cloth, at each size considered, as that of a flag of the network's own size."""
        if self.area_weight is None:
            return None
        target = next((target for target in model.targets if target.name == "density"), None)
        if target is None:
            raise UsageError(
                f"the model {model.name!r} does not estimate an area weight", where="--area-weight", fix="leave it out"
            )
        least, most = target.low * float(sizes.scale.max()), target.high * float(sizes.scale.min())
        if not least * (1 - 1e-9) <= self.area_weight[0] < self.area_weight[1] <= most * (1 + 1e-9):
            raise UsageError(
                f"an area weight of {self.area_weight[0]:g} to {self.area_weight[1]:g} kg/m²; of a flag of this size "
                f"the model knows {least:.3g} to {most:.3g}",
                where="--area-weight", fix="give a range within that" + ("" if sizes.given else ", and --flag-size"),
            )  # fmt: skip
        low, high = (np.full(len(sizes.scale), end) / sizes.scale ** POWERS["density"] for end in self.area_weight)
        return Known(name="density", low=low, high=high)


@dataclass(frozen=True, kw_only=True, eq=False)
class WindowAnswer:
    """What one window said by itself.

    Attributes:
        start, end: of its frames, at the smallest and largest size considered [s from the film's first frame].
        quantities: with their intervals.
        p: that a familiar clip is at least as strange.
    """

    start: float
    end: float
    quantities: tuple[Quantity, ...]
    p: float

    def quantity(self, name: str) -> Quantity:
        """The one of that name."""
        return next(quantity for quantity in self.quantities if quantity.name == name)

    def as_dict(self) -> dict[str, Any]:
        """JSON values."""
        return {
            "start": self.start, "end": self.end, "p": self.p,
            "quantities": {quantity.name: quantity.as_dict() for quantity in self.quantities},
        }  # fmt: skip


@dataclass(frozen=True, kw_only=True, eq=False)
class Measurement:
    """A film, measured.

    Attributes:
        film: its name.
        rate, duration: of it [Hz, s].
        model: name of the estimator.
        options: how it was measured.
        names: of the targets.
        draws: (n, target) of the joint posterior.
        quantities: of these.
        windows: each by itself, in order; those without anything to measure are left out.
        combined: how many of them the answer rests on.
        dependence: of their errors.
        verdict: of the gate.
        sizes: of flags at which the gate does not refuse it; all that were considered where it is refused.
        summary: (dimension,) of the window of median p.
        clip: (frames, height, width) of the first window, at the size at which the film is least strange.
        findings: on film, size and windows.
        bounds: why quantities are bounded on one side only; a part of the answer.
    """

    film: str
    rate: float
    duration: float
    model: str
    options: Options
    names: tuple[str, ...]
    draws: NDArray[np.float64]
    quantities: tuple[Quantity, ...]
    windows: tuple[WindowAnswer, ...]
    combined: int
    dependence: Dependence
    verdict: Verdict
    sizes: Sizes
    summary: NDArray[np.float32]
    clip: NDArray[np.uint8]
    findings: tuple[Finding, ...]
    bounds: tuple[Finding, ...]

    @property
    def sentence(self) -> str:
        """The answer in one line; whether it may be believed, the verdict says."""
        return sentence(self.quantities)

    def shown(self, *, anyway: bool) -> bool:
        """Whether it is reported: a refused film only `anyway`, of one with nothing to measure never."""
        return self.verdict.measurable and (anyway or not self.verdict.refused)

    def noticed(self, *, anyway: bool) -> tuple[Finding, ...]:
        """The findings, those on the answer where it is `shown`."""
        return (*self.findings, *self.bounds) if self.shown(anyway=anyway) else self.findings

    def as_dict(self, *, anyway: bool) -> Mapping[str, Any]:
        """JSON values. What is not `shown` is left out."""
        shown = self.shown(anyway=anyway)
        return {
            "film": self.film, "rate": self.rate, "duration": self.duration, "model": self.model,
            "options": {**self.options.recipe(), "seed": self.options.seed}, "gate": self.verdict.as_dict(),
            "sentence": self.sentence if shown else None,
            "quantities": {q.name: q.as_dict() for q in self.quantities} if shown else None,
            "windows": [window.as_dict() for window in self.windows] if shown else None,
            "combined": self.combined,
            "dependence": {
                "wind": self.dependence.wind, "cloth": self.dependence.cloth, "source": self.dependence.source,
            },
            "findings": [finding.as_dict() for finding in self.noticed(anyway=anyway)],
        }  # fmt: skip


@dataclass(frozen=True, kw_only=True, eq=False)
class _Seen:
    """A window as the model sees it at each size: logits (i, n, target), its first network's summaries (i, dimension),
    reasons, and the share of the network's draws that lay where the area weight is known to lie (1 if nothing is
    known)."""

    start: float
    logits: NDArray[np.float64]
    summaries: NDArray[np.float32]
    reasons: tuple[list[Reason], ...]
    within: float

    @property
    def blank(self) -> bool:
        """Whether there is nothing to measure, at any size."""
        return all(reasons[0].blank for reasons in self.reasons)

    def only(self, places: Sequence[int]) -> _Seen:
        """The same at some of the sizes."""
        chosen = list(places)
        return replace(
            self, logits=self.logits[chosen], summaries=self.summaries[chosen],
            reasons=tuple(self.reasons[place] for place in chosen),
        )  # fmt: skip


def measure(
    film: Film, model: Estimator, *, gate: Gate, dependence: Dependence, options: Options,
    advance: Callable[[int, int], None] | None = None,
) -> Measurement:  # fmt: skip
    """Measure a film.

    Args:
        gate: decides whether the model applies to the film.
        dependence: of the errors of the film's windows.
        advance: called after each window with how many there are and 1.

    Raises:
        UsageError: a model without distributions, a part that the film does not have, or gaps in every window.
        InputError: a film that is too short or too slow, or whose frames repeat too often.
    """
    if model.learners[0].objective is not Loss.POSTERIOR:
        raise UsageError(
            f"the model {model.name!r} gives values without intervals", where="--model",
            fix="name a model that was trained for a posterior, as the shipped one",
        )  # fmt: skip
    considered = sizes(
        options.size, rate=film.rate, frames_rate=model.front_end.rate, draws=DRAWS,
        generator=stream(options.seed, "sizes"), trained=TRAINED[model.cloth],
    )  # fmt: skip
    known = options.known(considered, model)
    layout = lay_out(
        frames=model.front_end.frames, rate=film.rate, duration=film.duration, step=options.step, first=options.first,
        last=options.last, spacings=tuple(spacing(s, rate=model.front_end.rate) for s in considered.scale.tolist()),
    )  # fmt: skip
    seen: list[_Seen] = []
    clips: NDArray[np.uint8] | None = None  # of the first window, or of the first with something to measure
    interpolated = 0
    margin = 2 * layout.period
    distinct = Distinct(film.frames(layout.first - margin, layout.last + margin))
    for window in cut(distinct, layout):
        one = _look(window, model, gate, seed=options.seed, known=known)
        if clips is None or (all(before.blank for before in seen) and not one.blank):
            clips = window.clips
        seen.append(one)
        interpolated += window.interpolated
        if advance is not None:
            advance(layout.count, 1)
    if clips is None:
        raise _without_windows(film, layout, distinct)
    judged = verdict([one.reasons for one in seen], false_alarm=options.false_alarm, level=gate.level)
    kept = considered.only(judged.sizes)
    answer = _Answer(model=model, sizes=kept, options=options)
    whole = [one.only(judged.sizes) for one in seen]
    used = _used(whole, judged, layout)
    draws, places = answer.joint([whole[k] for k in used], dependence)
    middle = seen[int(np.argsort(judged.window_p, kind="stable")[len(seen) // 2])]
    found = findings_of(
        layout, found=len(seen), interpolated=interpolated, frames=distinct.frames, repeated=distinct.repeated
    )
    windows = tuple(
        answer.window(one, layout, p)
        for one, p, blank in zip(whole, judged.window_p, judged.blank, strict=True)
        if not (blank and judged.measurable)
    )
    own = answer.quantities(draws, places)
    return Measurement(
        film=film.name, rate=film.rate, duration=film.duration, model=model.name, options=options,
        names=tuple(answer.names), draws=draws, quantities=own, windows=windows, combined=len(used),
        dependence=dependence, verdict=judged, sizes=kept, summary=middle.summaries[judged.size],
        clip=clips[judged.size],
        findings=(*film.findings(), *kept.findings, *found, *_about_windows(whole, judged, used, dependence)),
        bounds=tuple(_at_ends(own, windows)),
    )  # fmt: skip


@torch.no_grad()
def _look(window: Window, model: Estimator, gate: Gate, *, seed: int, known: Known | None) -> _Seen:
    embeddings = model.embeddings(model.inputs(window.clips))
    own, within = child_seed(seed, "window", window.index), 1.0
    if known is None:
        logits = model.logits(embeddings, seed=own, draws=DRAWS)[:, :DRAWS]
    else:
        logits, shares = model.logits_within(embeddings, known, seed=own, draws=DRAWS)
        within = float(shares.mean())
    summaries = embeddings[0].cpu().numpy().astype(np.float32)
    reasons = tuple(gate.judge(clip, summary) for clip, summary in zip(window.clips, summaries, strict=True))
    return _Seen(
        start=window.start, logits=logits.double().cpu().numpy(), summaries=summaries, reasons=reasons, within=within
    )


def _without_windows(film: Film, layout: Layout, distinct: Distinct) -> FlagdataError:
    """Why no window of a film is whole."""
    if distinct.repeated:
        return InputError(
            f"{distinct.share:.0%} of {distinct.frames} frames repeat the one before, so that the camera took "
            f"{(1 - distinct.share) * film.rate:.3g} pictures a second; none of {layout.count} windows has enough",
            where=film.name, fix="film with light enough for at least 25 pictures a second",
        )  # fmt: skip
    return UsageError(
        f"none of {layout.count} windows has all its frames", where=film.name,
        fix="the film's stamps have gaps: choose another part by --start and --end",
    )  # fmt: skip


def _used(seen: Sequence[_Seen], judged: Verdict, layout: Layout) -> list[int]:
    """Windows that the answer rests on: none that overlap, none without anything to measure where others have it; of a
    familiar recording none that are strange."""
    apart = layout.frames * max(layout.spacings)
    left_out = np.array(judged.blank) & judged.measurable
    if not judged.refused:
        left_out |= judged.strange
    chosen: list[int] = []
    for k in np.flatnonzero(~left_out).tolist():
        if not chosen or seen[k].start - seen[chosen[-1]].start >= apart - layout.period:
            chosen.append(k)
    return chosen


def _about_windows(
    seen: Sequence[_Seen], judged: Verdict, used: Sequence[int], dependence: Dependence
) -> list[Finding]:
    found = []
    within = float(np.median([one.within for one in seen]))
    if within < CONTRADICTION:
        found.append(
            Finding(
                kind="area-weight-contradicted", severity=Severity.WARNING, value=within,
                what=f"the model gave the area weight that was stated a probability of {within:.2g} only: either it is "
                "wrong, or the flag's size is, or the model errs on this film",
                fix="check --area-weight and --flag-size",
            )
        )  # fmt: skip
    strange = int(judged.strange.sum())
    if strange and not judged.refused:
        found.append(
            Finding(
                kind="strange-windows", severity=Severity.WARNING, count=strange,
                what=f"{strange} of {len(seen)} windows are unlike what the network was trained on, p at most "
                f"{judged.level:.2g}, and were left out of the answer; {judged.refusing} would refuse the film",
                fix="choose a part of the film without them by --start and --end",
            )
        )  # fmt: skip
    if len(used) > 1:
        found.append(
            Finding(
                kind="windows-combined", severity=Severity.NOTE, count=len(used),
                what=f"the answer combines {len(used)} windows of one cloth, each with its own wind; their errors "
                f"count as correlated by {dependence.wind:.2f} in wind and {dependence.cloth:.2f} in cloth "
                f"({dependence.source})",
            )
        )  # fmt: skip
    return found


def _at_ends(found: Sequence[Quantity], windows: Sequence[WindowAnswer]) -> list[Finding]:
    """Why quantities are bounded on one side only, and of how many windows the wind is where the answer's is not."""
    own = [finding for quantity in found if (finding := quantity.finding()) is not None]
    bounded = [one.quantity(name).value is None for one in windows for name in OWN]
    if any(bounded) and not any(quantity.value is None for quantity in found if quantity.name in OWN):
        own.append(
            Finding(
                kind="windows-at-end", severity=Severity.WARNING, count=sum(bounded),
                what=f"{sum(bounded)} of {len(windows)} windows bound the wind on one side only: theirs may lie beyond "
                "what the model knows, and so may the mean over all windows lie beyond its interval",
                fix="give the wind of single windows by --windows",
            )
        )  # fmt: skip
    return own


@dataclass(frozen=True, kw_only=True, eq=False)
class _Answer:
    """Turns logits at the sizes considered into quantities of the flag itself."""

    model: Estimator
    sizes: Sizes
    options: Options

    @property
    def names(self) -> tuple[str, ...]:
        return self.model.learners[0].scaling.quantities

    def joint(self, seen: Sequence[_Seen], dependence: Dependence) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(n, target) draws of all windows together, the wind their mean, and (m, target) places of the windows' own in
        the network's range."""
        own = [place for place, name in enumerate(self.names) if name in OWN]
        cloth = [place for place, name in enumerate(self.names) if name not in OWN]
        parts, places = [], []
        for stratum in range(len(self.sizes.scale)):
            prior = self.prior_logits[stratum]
            winds, shared = combined(
                np.stack([one.logits[stratum] for one in seen]), names=self.names, centre=prior.mean(axis=0),
                spread=prior.std(axis=0), dependence=dependence,
                generator=stream(self.options.seed, "combine", stratum),
            )  # fmt: skip
            logits = np.empty((*winds.shape[:2], len(self.names)))
            logits[..., own] = winds
            logits[..., cloth] = shared
            values = self._values(logits)
            parts.append(scaled_back(values.mean(axis=0), self.names, self.sizes.draws[stratum]))
            places.append(self._places(values))
        draws = np.concatenate(parts)
        if self.options.area_weight is not None:  # combining windows moves draws a little, some out of the range
            column = self.names.index("density")
            draws[:, column] = np.clip(draws[:, column], *self.options.area_weight)
        return draws, np.concatenate(places)

    def window(self, one: _Seen, layout: Layout, p: float) -> WindowAnswer:
        values = [self._values(logits) for logits in one.logits]
        draws = [scaled_back(v, self.names, s) for v, s in zip(values, self.sizes.draws, strict=True)]
        places = np.concatenate([self._places(v) for v in values])
        return WindowAnswer(
            start=one.start, end=one.start + layout.length,
            quantities=self.quantities(np.concatenate(draws), places), p=p,
        )  # fmt: skip

    def quantities(self, draws: NDArray[np.float64], places: NDArray[np.float64]) -> tuple[Quantity, ...]:
        weight = self.options.area_weight
        return quantities(
            draws, self.prior, self.names, level=self.options.level, assumed=self.assumed, places=places,
            stated={} if weight is None else {"density": weight},
        )  # fmt: skip

    def _places(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """(m, target) of values (…, target) in the network's range, 0 to 1: the range moves with the flag's size."""
        low, high = self._ends
        return ((values - low) / (high - low)).reshape(-1, len(self.names))

    @property
    def _ends(self) -> NDArray[np.float64]:
        """(2, target) of the range that the model learned."""
        return np.array([[t.low for t in self.model.targets], [t.high for t in self.model.targets]])

    @cached_property
    def prior(self) -> NDArray[np.float64]:
        """(n, target) draws of what is assumed of a flag of these sizes."""
        logits = self.prior_logits
        return scaled_back(
            self._values(logits.reshape(-1, len(self.names))), self.names, self.sizes.draws.ravel()
        )  # fmt: skip

    @cached_property
    def prior_logits(self) -> NDArray[np.float64]:
        """(i, n, target) draws of the same as the model knows them, for each size of flag."""
        learner, shape = self.model.learners[0], self.sizes.draws.shape
        known = self.options.known(self.sizes, self.model)
        more = 1 if known is None else MORE
        generator = stream(self.options.seed, "prior")
        normal = generator.standard_normal((shape[0], shape[1] * more, len(self.names)))
        logits = learner.centre.double().cpu().numpy() + learner.spread.double().cpu().numpy() * normal
        if known is None:
            return logits
        return restricted(torch.from_numpy(logits), learner.scaling, known, draws=shape[1])[0].numpy()

    @cached_property
    def assumed(self) -> NDArray[np.float64]:
        """(target, 2) range that was simulated, at these sizes; of what was not simulated evenly 90 % of it."""
        ends = self._ends
        smallest, largest = np.quantile(self.sizes.draws, [0.05, 0.95])
        low, high = scaled_back(ends[0], self.names, smallest), scaled_back(ends[1], self.names, largest)
        even = np.array([name in POWERS for name in self.names])[:, None]
        found = np.where(even, np.stack([low, high], axis=1), np.quantile(self.prior, [0.05, 0.95], axis=0).T)
        if self.options.area_weight is not None:
            found[self.names.index("density")] = self.options.area_weight
        return found

    def _values(self, logits: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.model.learners[0].scaling.values(torch.from_numpy(logits)).numpy()
