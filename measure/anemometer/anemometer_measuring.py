"""A film read by a reading model, in the form of any other measurement."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from flagdata.answer import Quantity, Span
from flagdata.core.arrays import FloatArray
from flagdata.core.findings import Finding
from flagdata.core.rng import stream
from flagdata.errors import UsageError
from measure.estimate.combine import Dependence
from measure.estimate.film_answer import LEAST_INFORMATION, information
from measure.estimate.film_measuring import Measurement
from measure.estimate.film_posterior import DRAWS, WIND, WindowAnswer
from measure.estimate.measuring_options import Options
from measure.film.conditioned_film import ConditionedFilm
from measure.film.similarity import FlagSize, Sizes, trained_on
from measure.gate.gate_verdict import Reason, Verdict
from measure.gate.reasons import REASONS
from measure.measuring_model.intervals import half_width, mean_errors
from measure.measuring_model.novelty import Compared
from measure.measuring_model.reading_model import ReadingModel
from measure.measuring_model.window_features import Features, features_of
from measure.posterior_ends import limits_of
from models.trained.estimator import Estimator

_SAME_SIZE = 0.01
"""Share by which a stated size may differ from that of the calibration: printed sizes are
rounded."""


@dataclass(frozen=True, kw_only=True)
class Familiarity(Verdict):
    """A verdict by the film of the calibration.

    Attributes:
        figures: what was compared, in words.
    """

    figures: str

    @property
    def sentence(self) -> str:
        if self.faults:
            further = len(self.faults) - 1
            suffix = (
                "" if not further else f" ({further} more {'reasons' if further > 1 else 'reason'})"
            )
            return f"{self.faults[0].what}{suffix}"
        return f"like the film of the calibration: {self.figures}"


def measure_by(
    film: ConditionedFilm,
    model: ReadingModel,
    estimator: Estimator,
    options: Options,
    *,
    name: str,
    advance: Callable[[int, int], None] | None = None,
) -> Measurement:
    """Measure a film by a reading model.

    Args:
        estimator: the network whose summary the model uses.
        options: size, part, level and seed; the others belong to networks.
        name: of the model.
        advance: called after each window with how many there are and 1.

    Raises:
        UsageError: an option that belongs to networks.
        RefusedError: nothing moves like cloth, or no window is whole.
    """
    _check(options, model)
    features = features_of(
        film, estimator, model.size, first=options.first, last=options.last, advance=advance
    )
    return measured_from(film, features, model, estimator, options, name=name)


def measured_from(
    film: ConditionedFilm,
    features: Features,
    model: ReadingModel,
    estimator: Estimator,
    options: Options,
    *,
    name: str,
) -> Measurement:
    """Measures a film whose features were computed already."""
    findings = film.findings()
    used = model.used(features)
    winds = model.read(used)
    read = np.flatnonzero(np.isfinite(winds))
    verdict = _verdict(film, features, used, winds, model, options, findings)
    half = half_width(model.errors, options.level)
    windows = tuple(
        _window(features, k, float(winds[k]), half, verdict, model, options) for k in read.tolist()
    )
    rng = stream(options.seed, "anemometer", "mean")
    errors = mean_errors(
        model.errors, count=len(read), length=model.block, draws=DRAWS, generator=rng
    )
    draws = np.maximum(winds[read].mean() + errors, 0.0)
    low, high = (
        float(end) for end in np.quantile(draws, [(1 - options.level) / 2, (1 + options.level) / 2])
    )
    span = Span(low=low, high=high, level=options.level, bound=None, estimated=True)
    mean_wind = _wind(float(draws.mean()), float(draws.std()), span, draws, model)
    middle = read[len(read) // 2]
    scale = model.size.scale(trained_on(estimator.targets))
    return Measurement(
        film=film.name,
        rate=film.rate,
        duration=film.duration,
        model=name,
        options=replace(options, size=model.size),
        names=(WIND,),
        draws=draws[:, None],
        quantities=(mean_wind,),
        windows=windows,
        combined=len(read),
        dependence=_dependence(errors, model, len(read)),
        gusts=None,
        verdict=verdict,
        sizes=Sizes(
            given=model.size, scale=np.array([scale]), draws=np.full((1, DRAWS), scale), findings=()
        ),
        summary=features.summaries[middle],
        clip=features.clip,
        findings=(*findings, *_about(winds[read], features, model)),
        bounds=(),
    )


def _check(options: Options, model: ReadingModel) -> None:
    for where, conflicts in (
        ("--area-weight", options.area_weight is not None),
        ("--refine", options.refine is not None),
        ("--windows", options.step is not None and abs(options.step - model.step) > 1e-6),
    ):
        if conflicts:
            raise UsageError(
                f"a reading model knows its flag, and its windows are {model.step:.4g} s long",
                where=where,
                fix=f"leave {where} out, or choose a network by --model",
            )


def _size_reason(stated_size: FlagSize | None, model: ReadingModel) -> list[Finding]:
    size = model.size
    if (
        stated_size is None
        or max(abs(stated_size.length / size.length - 1), abs(stated_size.height / size.height - 1))
        <= _SAME_SIZE
    ):
        return []
    return [
        Finding.of(
            "another-size",
            f"the flag is stated as {stated_size.length:g} m × {stated_size.height:g} m, that of "
            "the calibration as "
            f"{size.length:g} m × {size.height:g} m",
            value=stated_size.length / size.length,
            fix="check --flag-size, or calibrate this flag",
        )
    ]


def _verdict(
    film: ConditionedFilm,
    features: Features,
    used: FloatArray,
    winds: FloatArray,
    model: ReadingModel,
    options: Options,
    findings: Sequence[Finding],
) -> Familiarity:
    read = np.isfinite(winds)
    compared = Compared.of(
        model.familiar.shift(used[read], winds[read]), features.place, model.places
    )
    faults = [finding for finding in findings if finding.kind in REASONS]
    faults += [*_size_reason(options.size, model), *compared.reasons()]
    p = model.familiar.p_value(used[read], winds[read])
    return Familiarity(
        false_alarm=options.false_alarm,
        level=0.0,
        refusing=len(p),
        sizes=(0,),
        considered=1,
        size=0,
        p=float(np.median(p)),
        window_p=tuple(p.tolist()),
        blank=(False,) * len(p),
        faults=tuple(Reason.counted(finding) for finding in faults),
        window_reasons=(
            Reason(
                kind="familiar",
                what=f"the median p of its windows is {np.median(p):.2f}",
                p=float(np.median(p)),
            ),
        ),
        figures=compared.figures,
    )


def _window(
    features: Features,
    k: int,
    wind: float,
    half: float,
    verdict: Verdict,
    model: ReadingModel,
    options: Options,
) -> WindowAnswer:
    least, _ = limits_of(WIND)
    value = max(wind, least)
    position = int(np.count_nonzero(features.whole[:k]))
    span = Span(
        low=max(wind - half, least),
        high=wind + half,
        level=options.level,
        bound=None,
        estimated=True,
    )
    quantity = _wind(value, model.rmse, span, wind + model.errors, model)
    start = float(features.starts[k])
    return WindowAnswer(
        start=start,
        end=start + features.layout.length,
        quantities=(quantity,),
        p=verdict.window_p[position],
    )


def _wind(
    value: float, sigma: float, span: Span, draws: FloatArray, model: ReadingModel
) -> Quantity:
    """Returns a wind that is read, with what its draws (n,) add to the winds of the calibration."""
    learned = information(draws, model.winds)
    return Quantity(
        name=WIND,
        unit="m/s",
        value=value,
        sigma=sigma,
        span=span,
        assumed=model.range,
        constrained=learned >= LEAST_INFORMATION,
        information=learned,
    )


def _dependence(errors: FloatArray, model: ReadingModel, count: int) -> Dependence:
    """Returns the correlation of windows at which the mean of so many errs as `errors` do."""
    ratio = float(errors.var() / model.errors.var()) * count
    correlation = 0.0 if count < 2 else float(np.clip((ratio - 1) / (count - 1), 0.0, 1.0))
    return Dependence(
        wind=correlation, cloth=1.0, source="blocks of the calibration that were left out"
    )


def _about(winds: FloatArray, features: Features, model: ReadingModel) -> list[Finding]:
    findings = []
    low, high = model.range
    beyond = int(np.count_nonzero((winds < low) | (winds > high)))
    if beyond:
        findings.append(
            Finding.of(
                "beyond-calibration",
                f"{beyond} of {len(winds)} windows read winds beyond those of the calibration "
                f"({low:.1f} to "
                f"{high:.1f} m/s), where nothing checked the intervals",
                count=beyond,
                value=beyond / len(winds),
                fix="calibrate in stronger and weaker winds as well",
            )
        )
    missing = len(features.starts) - len(winds)
    if missing:
        findings.append(
            Finding.of(
                "windows-left-out",
                f"{missing} of {len(features.starts)} windows lack frames and were left out",
                count=missing,
            )
        )
    return findings
