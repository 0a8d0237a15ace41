"""The amplitude of a term in time: steady, growing with the wind, or oscillating?

With e the prediction errors of the model that has the term and s its sensitivity, the amplitude in
a stretch of time is the fitted one plus Σ e·s / Σ s², sums over the stretch's frames and all
markers.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.stats import t as student

from flagdata.answer import Quantity
from flagdata.core.arrays import FloatArray
from measure.forecasting.model import Model
from measure.forecasting.regressors import EffectColumn
from measure.forecasting.setting import Setting
from measure.propose.outcome import PeriodogramLine, StrengthCourse
from sim.effects import apply

BIN = 0.2
"""Duration of a stretch [s]: five frames at 25 a second."""
_LEVEL = 0.9
_RARE = 0.01
"""Probability of a line in white noise below which it is reported."""
_SLOW = 3
"""Periods in a recording below which a line is no more than a trend."""


def course(setting: Setting, model: Model, effect: int) -> StrengthCourse:
    """Computes the course of the effect at an index of a model, along all recordings."""
    column, fitted = model.effects[effect]
    amplitudes, period = _amplitudes(setting, model, column, fitted)
    stretch = max(1, round(BIN / period))
    binned: list[FloatArray] = []
    lines: list[PeriodogramLine] = []
    times: list[FloatArray] = []
    segments = setting.segments
    for index in range(len(setting.speeds)):
        of_recording = np.flatnonzero(setting.recording == index)
        parts, places, frames = [], [], []
        for segment in of_recording:
            top, bottom = amplitudes[0][:, segment], amplitudes[1][:, segment]
            frames.append(top / bottom)
            count = len(top) // stretch
            sums = [
                values[: count * stretch].reshape(count, stretch).sum(axis=1)
                for values in (top, bottom)
            ]
            parts.append(fitted + sums[0] / sums[1])
            middle = (np.arange(count) + 0.5) * stretch * period
            places.append(segments.items[segment].start + segments.first * period + middle)
        binned.append(np.concatenate(parts))
        times.append(np.concatenate(places))
        lines.append(line(np.concatenate(frames), period))
    by_recording = [_mean(values, column.unit) for values in binned]
    spread = float(np.sqrt(np.mean([np.var(values, ddof=1) for values in binned])))
    speeds = [float(u) for u in setting.speeds]
    height = float(np.ptp(setting.experiment.specimen.mesh.rest[:, 1]))
    return StrengthCourse(
        bin=stretch * period,
        times=[t.tolist() for t in times],
        amplitudes=[a.tolist() for a in binned],
        by_recording=by_recording,
        speeds=speeds,
        fluctuation=spread,
        lines=lines,
        words=_words(by_recording, speeds, spread, lines, height),
    )


def _amplitudes(
    setting: Setting, model: Model, column: EffectColumn, fitted: float
) -> tuple[tuple[FloatArray, FloatArray], float]:
    """Computes Σ e·s and Σ s² over the markers, (frame, segment), and the time between frames
    [s]."""
    forecaster, segments = setting.forecaster, setting.segments
    base = forecaster.errors(*model.system(forecaster, segments), segments)
    other_effects = tuple(effect for effect in model.effects if effect[0] is not column)
    rest = Model(calibration=model.calibration, effects=other_effects)
    moved = apply([column.at(fitted + column.step)], *rest.system(forecaster, segments))
    change = (base - forecaster.errors(*moved, segments)) / column.step
    top, bottom = (base * change).sum((1, 2)), (change**2).sum((1, 2))
    return (top.double().cpu().numpy(), bottom.double().cpu().numpy()), segments.period


def _mean(values: FloatArray, unit: str) -> Quantity:
    """Averages, with an interval from blocks of five stretches, which hardly know of one
    another."""
    blocks = (
        values[: len(values) // 5 * 5].reshape(-1, 5).mean(axis=1) if len(values) >= 10 else values
    )
    reach = float(
        student.ppf(0.5 + _LEVEL / 2, len(blocks) - 1) * blocks.std(ddof=1) / math.sqrt(len(blocks))
    )
    value = float(values.mean())
    return Quantity.of(value=value, low=value - reach, high=value + reach, unit=unit, level=_LEVEL)


def line(values: FloatArray, period: float) -> PeriodogramLine:
    """Finds the largest line of the periodogram, of three periods or more (Fisher, Proc. R. Soc. A
    125, 1929).

    Args:
        values: equally spaced.
        period: between them [s].
    """
    power = np.abs(np.fft.rfft(values - values.mean()))[_SLOW:] ** 2
    best = int(np.argmax(power))
    share = float(power[best] / max(power.sum(), 1e-300))
    count = len(power)
    terms = [
        (-1) ** (k - 1) * math.comb(count, k) * (1 - k * share) ** (count - 1)
        for k in range(1, min(count, int(1 / share) if share > 0 else count) + 1)
    ]
    # The sum alternates and cancels for small lines, which its first term bounds.
    p_value = min(1.0, terms[0]) if share < 0.05 else min(1.0, max(0.0, sum(terms)))
    frequency = float(np.fft.rfftfreq(len(values), period)[_SLOW + best])
    return PeriodogramLine(frequency=frequency, share=share, p_value=p_value)


def _words(
    by_recording: list[Quantity],
    speeds: list[float],
    spread: float,
    lines: list[PeriodogramLine],
    height: float,
) -> str:
    unit = "" if by_recording[0].unit == "1" else f" {by_recording[0].unit}"
    means = "; ".join(
        f"{e.point:+.3g} [{e.low:.3g}, {e.high:.3g}]{unit} at {u:.1f} m/s"
        for e, u in zip(by_recording, speeds, strict=True)
    )
    text = f"{means}; in time it varies by {spread:.2g}{unit}, errors included"
    significant = [
        f"{line.frequency:.2f} Hz ({100 * line.share:.0f} %; f L/U = "
        f"{line.frequency * height / u:.2g}) at {u:.1f} m/s"
        for line, u in zip(lines, speeds, strict=True)
        if line.p_value < _RARE
    ]
    return (
        f"{text}, with lines at {', '.join(significant)}; L is the cloth's height"
        if significant
        else text
    )
