"""From a film to a measurement: windows, what the model says of each, the gate, one answer for
all."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch

from flagdata.answer import Quantity
from flagdata.core.arrays import Float32Array, FloatArray, UInt8Array
from flagdata.core.findings import Finding
from flagdata.core.json_values import json_values
from flagdata.core.rng import child_seed, stream
from flagdata.errors import FlagdataError, RefusedError, UsageError
from flagdata.ingest.films.film import Film
from measure.estimate.combine import OWN, Dependence
from measure.estimate.film_answer import explain_bound, sentence
from measure.estimate.film_posterior import (
    DRAWS,
    WEIGHT,
    WIND,
    Among,
    FilmAnswer,
    Look,
    WindowAnswer,
)
from measure.estimate.gusty_series import Gusts, SeriesErrors, errors_of_model
from measure.estimate.measuring_options import Options
from measure.film.similarity import RATE_SLACK, Sizes, Trained, length_first, sizes, trained_on
from measure.film.windows import Window, WindowLayout, WindowReader, findings_of
from measure.gate.gate_verdict import Reason, Verdict, verdict, window_rate
from measure.gate.reasons import REASONS
from measure.gate.window import WindowGate
from models.networks.learner import Loss
from models.networks.targets import ASPECT, Cloth
from models.trained.estimator import Estimator

CONTRADICTION = 1 / 150
"""Bayes factor of the area weight that was stated, below which a warning is due: very strong
evidence against it (Kass and Raftery, Journal of the American Statistical Association 90, 1995,
section 3.2)."""

EXCLUDED = 0.05
"""Share of the sizes that are possible without the area weight that was given, and not with it,
above which a warning is due."""

_REPEATING = 0.1
"""Share of frames that repeat the one before, above which they are the reason where no window is
whole. Lower says so of films that lack windows for another reason; of films made with half of the
frames a second it is a half."""

_PART = 1 / 3
"""Share of the film's windows on which an answer rests at least. Lower answers films of which most
shows no whole flag, or lacks frames; higher refuses films that a flag leaves for a while."""


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
        gusts: how strong they are; None where the windows are not taken as one series.
        verdict: of the gate.
        sizes: of flags at which the gate does not refuse it; all that were considered where it is
            refused.
        summary: (dimension,) of the window of median p.
        clip: (frames, height, width) of the first window that counts, at the size at which the film
            is least strange.
        findings: on film, size and windows.
        bounds: why quantities are bounded on one side only, and how the wind depends on a weight
            that is open: parts of the answer.
    """

    film: str
    rate: float
    duration: float
    model: str
    options: Options
    names: tuple[str, ...]
    draws: FloatArray
    quantities: tuple[Quantity, ...]
    windows: tuple[WindowAnswer, ...]
    combined: int
    dependence: Dependence
    gusts: Gusts | None
    verdict: Verdict
    sizes: Sizes
    summary: Float32Array
    clip: UInt8Array
    findings: tuple[Finding, ...]
    bounds: tuple[Finding, ...]

    @property
    def sentence(self) -> str:
        """The answer in one line; whether it may be believed, the verdict says."""
        return sentence(self.quantities)

    def shown(self, *, anyway: bool) -> bool:
        """Returns whether it is reported: a refused film only `anyway`, one with nothing to measure
        never."""
        return self.verdict.measurable and (anyway or not self.verdict.refused)

    def notices(self, *, anyway: bool) -> tuple[Finding, ...]:
        """Returns the findings, those on the answer where it is `shown`."""
        return (*self.findings, *self.bounds) if self.shown(anyway=anyway) else self.findings

    def document(self, *, anyway: bool) -> dict[str, Any]:
        """Returns JSON values. What is not `shown` is null."""
        values = json_values(
            {
                "film": self.film,
                "rate": self.rate,
                "duration": self.duration,
                "model": self.model,
                "options": {**self.options.recipe(), "seed": self.options.seed},
                "gate": self.verdict,
                "sentence": self.sentence,
                "quantities": {q.name: q for q in self.quantities},
                "windows": self.windows,
                "combined": self.combined,
                "dependence": self.dependence,
                "gusts": self.gusts,
                "findings": self.notices(anyway=anyway),
            }
        )
        return values if self.shown(anyway=anyway) else values | dict.fromkeys(_OF_ANSWER)


_OF_ANSWER = ("sentence", "quantities", "windows", "gusts")
"""What a document states of a film that may be measured."""


def measure(
    film: Film,
    model: Estimator,
    *,
    gate: WindowGate,
    dependence: Dependence,
    options: Options,
    advance: Callable[[int, int], None] | None = None,
) -> Measurement:
    """Measure a film.

    Args:
        gate: decides whether the model applies to the film.
        dependence: of the errors of the film's windows.
        advance: called after each window with how many there are and 1.

    Raises:
        UsageError: a model without distributions, a part that the film does not have, or gaps in
            every window.
        InputError: a film that is too short.
        RefusedError: a film whose frames are too few a second, or repeat too often, so that no
            window is whole.
    """
    if model.learners[0].objective is not Loss.POSTERIOR:
        raise UsageError(
            f"the model {model.name!r} gives values without intervals",
            where="--model",
            fix="name a model that was trained for a posterior, as the shipped one",
        )
    # Sizes of flag at which the film is looked at: one where the user states it, else a few of the
    # prior.
    considered = sizes(
        options.size,
        rate=film.rate,
        frames_rate=model.front_end.rate,
        draws=DRAWS,
        generator=stream(options.seed, "sizes"),
        trained=trained_on(model.targets),
    )
    joint = FilmAnswer(model=model, sizes=considered, options=options)
    scales = considered.scale.tolist()
    reader = WindowReader(
        film, model, scales, step=options.step, first=options.first, last=options.last
    )
    layout, distinct = reader.layout, reader.distinct
    # The network and the gate look at every window, at every size.
    looks: list[Look] = []
    clips: UInt8Array | None = (
        None  # of the first window that counts, else of the first with something to measure
    )
    interpolated, best = 0, -1
    familiar = window_rate(layout.count, options.false_alarm)
    for window in reader.windows(advance):
        look = _look(window, gate, joint)
        fitness = (
            0
            if look.blank
            else 1 + any((reasons[0].p or 0.0) > familiar for reasons in look.reasons)
        )
        if fitness > best:
            clips, best = window.clips, fitness
        looks.append(look)
        interpolated += window.interpolated
    # The gate judges the film; sizes at which it is unlike the training are dropped.
    of_film = tuple(
        finding
        for finding in film.findings()
        if model.cloth is Cloth.FLAG or not _of_flags(finding)
    )
    faults = [finding for finding in of_film if finding.kind in REASONS]
    if clips is None:
        raise _without_windows(film, reader, faults, considered, trained_on(model.targets))
    gate_verdict = verdict(
        [look.reasons for look in looks],
        false_alarm=options.false_alarm,
        level=gate.level,
        faults=faults,
    )
    if (few := _few_windows(gate_verdict, layout)) is not None:
        gate_verdict = replace(gate_verdict, faults=(*gate_verdict.faults, few))
    sizes_kept = considered.only(gate_verdict.sizes)
    answer = FilmAnswer(model=model, sizes=sizes_kept, options=options)
    kept_looks = [look.only(gate_verdict.sizes) for look in looks]
    # One answer of the windows that count, its draws shared by cloth, its winds one gusty series.
    alone = [
        answer.window(look, layout, p)
        for look, p in zip(kept_looks, gate_verdict.window_p, strict=True)
    ]
    counted = _counted_windows(gate_verdict)
    errors = errors_of_model(model)
    apart = _why_apart([alone[k] for k in counted], errors, model.name)
    used = _used_windows(kept_looks, counted, layout)
    among = None
    if errors is not None and apart is None and len(used) > 1:
        places = [counted.index(k) for k in used]
        series = answer.series([kept_looks[k] for k in counted], layout, errors, apart=places)
        among = Among(series=series, places=places)
    found = answer.joint([kept_looks[k] for k in used], dependence, among)
    middle = looks[int(np.argsort(gate_verdict.window_p, kind="stable")[len(looks) // 2])]
    of_reading = findings_of(
        layout,
        windows_read=len(looks),
        interpolated=interpolated,
        frames=distinct.frames,
        repeated=distinct.repeated,
    )
    windows = tuple(
        answer.window(look, layout, p, found.wind(counted.index(k)))
        if k in counted and among is not None
        else own
        for k, (look, own, p, blank) in enumerate(
            zip(kept_looks, alone, gate_verdict.window_p, gate_verdict.blank, strict=True)
        )
        if not (blank and gate_verdict.measurable)
    )
    # What is reported.
    quantities = answer.quantities(found.draws, found.places)
    open_weight = answer.by_weight(
        [kept_looks[k] for k in used],
        dependence,
        quantities,
        found.draws,
        series=None
        if errors is None or among is None
        else lambda at_weight, looks_at: at_weight.series(
            looks_at, layout, errors, apart=range(len(looks_at))
        ),
    )
    intensity = found.intensity
    return Measurement(
        film=film.name,
        rate=film.rate,
        duration=film.duration,
        model=model.name,
        options=options,
        names=tuple(answer.names),
        draws=found.draws,
        quantities=quantities,
        windows=windows,
        combined=len(used),
        dependence=dependence,
        gusts=None
        if intensity is None
        else Gusts.of(intensity, level=options.level, windows=len(used)),
        verdict=gate_verdict,
        sizes=sizes_kept,
        summary=middle.summaries[gate_verdict.size],
        clip=clips[gate_verdict.size],
        findings=(
            *of_film,
            *sizes_kept.findings,
            *of_reading,
            *_about_windows(
                kept_looks,
                gate_verdict,
                used,
                dependence,
                errors=None if among is None else errors,
                stated=tuple(options.stated(model)),
            ),
            *([] if apart is None or len(used) < 2 else [apart]),
        ),
        bounds=(*_at_ends(quantities, windows), *([] if open_weight is None else [open_weight])),
    )


@torch.no_grad()
def _look(window: Window, gate: WindowGate, joint: FilmAnswer) -> Look:
    model, seed = joint.model, child_seed(joint.options.seed, "window", window.index)
    embeddings = model.embeddings(model.inputs(window.clips))
    posterior = model.posterior(embeddings)
    if joint.known:
        logits, log_factor = joint.given(posterior, seed=seed)
    else:
        logits = model.logits(embeddings, seed=seed, draws=DRAWS)[:, :DRAWS].double().cpu().numpy()
        log_factor = np.zeros(logits.shape[:2])
    summaries = embeddings[0].cpu().numpy().astype(np.float32)
    reasons = tuple(
        gate.judge(clip, summary) for clip, summary in zip(window.clips, summaries, strict=True)
    )
    return Look(
        start=window.start,
        posterior=posterior,
        logits=logits,
        summaries=summaries,
        reasons=reasons,
        log_factor=log_factor,
    )


def _of_flags(finding: Finding) -> bool:
    """Returns whether it is a fault of flags only."""
    return finding.kind in REASONS and REASONS[finding.kind].of_flags


def _contradiction_finding(stated: Sequence[str], factor: float) -> Finding:
    """Reports that the film speaks against what the user gave, by this Bayes factor."""
    words = (
        f"the film much less probable (Bayes factor {factor:.2g}): either that is wrong, or the "
        "model errs on this film"
    )
    shape = "the shape of the flag by its size"
    if WEIGHT not in stated:
        what = f"{shape}, which was given, makes {words}"
        return Finding.of("flag-size-contradicted", what, value=factor, fix="check --flag-size")
    given = (
        f"the area weight and {shape}, which were given, make"
        if ASPECT in stated
        else "the area weight given makes"
    )
    return Finding.of(
        "area-weight-contradicted",
        f"{given} {words}",
        value=factor,
        fix="check --area-weight and --flag-size",
    )


def _few_windows(gate_verdict: Verdict, layout: WindowLayout) -> Reason | None:
    """Refuses an answer that would rest on too few of the film's windows, whatever the reason is
    that others do not count."""
    counting = int(np.count_nonzero(~(np.array(gate_verdict.blank) | gate_verdict.strange)))
    if gate_verdict.unlike or not gate_verdict.measurable or counting >= _PART * layout.count:
        return None
    fault = REASONS["few-windows"]
    return Reason(
        kind="few-windows",
        what=f"{fault.sentence}: on {counting} of {layout.count} windows, a third at least is "
        "needed",
        p=None,
        fix=fault.fix,
        value=counting / layout.count,
    )


def _without_windows(
    film: Film, reader: WindowReader, faults: Sequence[Finding], considered: Sizes, trained: Trained
) -> FlagdataError:
    """Explains why no window of a film is complete."""
    distinct = reader.distinct
    start, lack = next(iter(reader.lacks.items()))
    windows = (
        f"none of {reader.layout.count} windows has all its frames: in the one at {start:.2f} s "
        f"{lack}"
    )
    still = [fault for fault in faults if fault.kind == "no-motion"]
    if distinct.share > _REPEATING and not still:
        share = f"{distinct.share:.0%} of {distinct.frames}"
        scale = float(considered.scale.max())
        left, needed = (1 - distinct.share) * film.rate, RATE_SLACK / max(reader.layout.spacings)
        if (
            needed * math.sqrt(scale) <= left < needed
        ):  # enough of a flag as large as those of the training
            length = trained.length * scale
            return RefusedError(
                f"{REASONS['low-frame-rate'].sentence}: {share} frames repeat the one before, "
                f"{left:.3g} different "
                f"ones a second are left, a {trained.noun} of {length:.3g} m needs {needed:.3g}, "
                f"and {windows}",
                where=film.name,
                fix=f"film at {needed:.3g} frames a second or more that are all different"
                + length_first(considered.given),
            )
        repeated = REASONS["repeated-frames"]
        return RefusedError(
            f"{repeated.sentence}: {share} frames repeat the one before, and {windows}",
            where=film.name,
            fix=repeated.fix,
        )
    if faults:
        return RefusedError(
            faults[0].what, where=film.name, fix=faults[0].fix or "give another film"
        )
    return UsageError(
        windows,
        where=film.name,
        fix="frames are missing or repeat there: choose another part by --start and --end",
    )


def _counted_windows(gate_verdict: Verdict) -> list[int]:
    """Selects windows that show something to measure where others do, of a familiar recording none
    that are strange."""
    left_out = np.array(gate_verdict.blank) & gate_verdict.measurable
    if not gate_verdict.refused:
        left_out |= gate_verdict.strange
    return np.flatnonzero(~left_out).tolist()


def _why_apart(
    windows: Sequence[WindowAnswer], errors: SeriesErrors | None, model: str
) -> Finding | None:
    """Reports why the windows are not taken as one gusty series; None where nothing speaks against
    it."""
    if errors is None:
        return Finding.of(
            "windows-apart",
            f"each window has the interval that it gives by itself: how the model {model} errs in "
            "windows of one film "
            "was not measured",
        )
    bounded = sum(window.quantity(WIND).span.bound is not None for window in windows)
    if bounded:
        return Finding.of(
            "windows-apart",
            f"each window has the interval that it gives by itself: {bounded} of {len(windows)} "
            "bound the wind on one "
            "side only, and a series of gusts needs values",
            count=bounded,
        )
    return None


def _used_windows(looks: Sequence[Look], counted: Sequence[int], layout: WindowLayout) -> list[int]:
    """Selects windows that the answer rests on: of those that count none that overlap."""
    length = layout.frames * max(layout.spacings)
    chosen: list[int] = []
    for k in counted:
        if not chosen or looks[k].start - looks[chosen[-1]].start >= length - layout.period:
            chosen.append(k)
    return chosen


def _about_windows(
    looks: Sequence[Look],
    gate_verdict: Verdict,
    used: Sequence[int],
    dependence: Dependence,
    *,
    errors: SeriesErrors | None,
    stated: Sequence[str],
) -> list[Finding]:
    """Reports what is to be said of the windows.

    Args:
        errors: of the model in the series of windows; None where they are not one.
        stated: names of the quantities that the user gave.
    """
    findings = []
    factor = float(np.median([np.exp(look.log_factor).mean() for look in looks]))
    if factor < CONTRADICTION:
        findings.append(_contradiction_finding(stated, factor))
    excluded = float(np.isneginf(looks[0].log_factor).mean())
    if excluded > EXCLUDED:
        findings.append(
            Finding.of(
                "sizes-excluded-by-weight",
                f"{excluded:.0%} of the sizes that were taken as possible were left out: of a flag "
                "of these the "
                "network does not know the area weight that was given",
                value=excluded,
                fix="give --flag-size LENGTHxHEIGHT",
            )
        )
    strange = int(gate_verdict.strange.sum())
    if strange and not gate_verdict.refused:
        findings.append(
            Finding.of(
                "strange-windows",
                f"{strange} of {len(looks)} windows are unlike what the network was trained on, p "
                "at most "
                f"{gate_verdict.level:.2g}, and were left out of the answer; "
                f"{gate_verdict.refusing} would refuse the "
                "film",
                count=strange,
                fix="choose a part of the film without them by --start and --end",
            )
        )
    if len(used) > 1 and errors is not None:
        findings.append(
            Finding.of(
                "windows-combined",
                f"the answer combines {len(used)} windows of one cloth and one gusty wind; their "
                "errors count as those "
                f"of {errors.source} in wind, and as correlated by {dependence.cloth:.2f} in cloth "
                f"({dependence.source})",
                count=len(used),
            )
        )
    elif len(used) > 1:
        findings.append(
            Finding.of(
                "windows-combined",
                f"the answer combines {len(used)} windows of one cloth, each with its own wind; "
                "their errors "
                f"count as correlated by {dependence.wind:.2f} in wind and {dependence.cloth:.2f} "
                "in cloth "
                f"({dependence.source})",
                count=len(used),
            )
        )
    return findings


def _at_ends(quantities: Sequence[Quantity], windows: Sequence[WindowAnswer]) -> list[Finding]:
    """Reports quantities bounded on one side only, and how many windows bound the wind where the
    answer does not."""
    findings = [
        finding for quantity in quantities if (finding := explain_bound(quantity)) is not None
    ]
    bounded = [window.quantity(name).value is None for window in windows for name in OWN]
    if any(bounded) and not any(
        quantity.value is None for quantity in quantities if quantity.name in OWN
    ):
        findings.append(
            Finding.of(
                "windows-at-end",
                f"{sum(bounded)} of {len(windows)} windows bound the wind on one side only: theirs "
                "may lie beyond "
                "what the model knows, and so may the mean over all windows lie beyond its "
                "interval",
                count=sum(bounded),
                fix="give the wind of single windows by --windows",
            )
        )
    return findings
