"""The amplitude of a term in time: steady, growing with the wind, or oscillating?

With e the prediction errors of the model that has the term and s its sensitivity, the amplitude in a stretch of time is
the fitted one plus Σ e·s / Σ s², sums over the stretch's frames and all markers.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from measure.loop.close import Setting
from measure.loop.columns import EffectColumn
from measure.loop.model import Model
from measure.loop.verdict import Estimate
from measure.propose.outcome import Course
from sim.effects import apply

Floats = NDArray[np.float64]

BIN = 0.2
"""Duration of a stretch [s]: five frames at 25 a second."""
_LEVEL = 0.9
_STROUHAL = "f L/U with L the cloth's height"


def course(setting: Setting, model: Model, place: int) -> Course:
    """Of the effect at a place of a model, along all recordings."""
    column, fitted = model.effects[place]
    amplitudes, period = _amplitudes(setting, model, column, fitted)
    stretch = max(1, round(BIN / period))
    binned: list[Floats] = []
    times: list[Floats] = []
    segments = setting.segments
    for index in range(len(setting.speeds)):
        own = np.flatnonzero(setting.recording == index)
        parts, places = [], []
        for segment in own:
            top, bottom = amplitudes[0][:, segment], amplitudes[1][:, segment]
            count = len(top) // stretch
            sums = [values[: count * stretch].reshape(count, stretch).sum(axis=1) for values in (top, bottom)]
            parts.append(fitted + sums[0] / sums[1])
            middle = (np.arange(count) + 0.5) * stretch * period
            places.append(segments.items[segment].start + segments.first * period + middle)
        binned.append(np.concatenate(parts))
        times.append(np.concatenate(places))
    by_recording = [_mean(values, column.unit) for values in binned]
    frequency, share = _peak(binned, stretch * period)
    spread = float(np.sqrt(np.mean([np.var(values, ddof=1) for values in binned])))
    speeds = [float(u) for u in setting.speeds]
    height = float(np.ptp(setting.experiment.specimen.mesh.rest[:, 1]))
    return Course(
        bin=stretch * period, times=[t.tolist() for t in times], amplitudes=[a.tolist() for a in binned],
        by_recording=by_recording, speeds=speeds, fluctuation=spread, frequency=frequency, peak_share=share,
        words=_words(by_recording, speeds, spread, frequency, share, height),
    )  # fmt: skip


def _amplitudes(
    setting: Setting, model: Model, column: EffectColumn, fitted: float
) -> tuple[tuple[Floats, Floats], float]:
    """(frame, segment) Σ e·s and Σ s² over the markers, and the time between frames [s]."""
    forecaster, segments = setting.forecaster, setting.segments
    base = forecaster.errors(*model.system(forecaster, segments), segments)
    others = tuple(effect for effect in model.effects if effect[0] is not column)
    rest = Model(calibration=model.calibration, effects=others)
    moved = apply([column.at(fitted + column.step)], *rest.system(forecaster, segments))
    change = (base - forecaster.errors(*moved, segments)) / column.step
    top, bottom = (base * change).sum((1, 2)), (change**2).sum((1, 2))
    return (top.double().cpu().numpy(), bottom.double().cpu().numpy()), segments.period


def _mean(values: Floats, unit: str) -> Estimate:
    """With an interval from blocks of five stretches, which hardly know of one another."""
    blocks = values[: len(values) // 5 * 5].reshape(-1, 5).mean(axis=1) if len(values) >= 10 else values
    reach = float(student.ppf(0.5 + _LEVEL / 2, len(blocks) - 1) * blocks.std(ddof=1) / math.sqrt(len(blocks)))
    value = float(values.mean())
    return Estimate(value=value, low=value - reach, high=value + reach, unit=unit, level=_LEVEL)


def _peak(binned: list[Floats], period: float) -> tuple[float, float]:
    """Frequency of the largest line of the mean periodogram, and its share of the variance."""
    shortest = min(len(values) for values in binned)
    spectra = [np.abs(np.fft.rfft(v[:shortest] - v[:shortest].mean())) ** 2 for v in binned]
    power = np.mean([s / max(s[1:].sum(), 1e-300) for s in spectra], axis=0)
    best = 1 + int(np.argmax(power[1:]))
    return float(np.fft.rfftfreq(shortest, period)[best]), float(power[best])


def _words(
    by_recording: list[Estimate], speeds: list[float], spread: float, frequency: float, share: float, height: float
) -> str:
    unit = "" if by_recording[0].unit == "1" else f" {by_recording[0].unit}"
    means = "; ".join(
        f"{e.value:+.3g} [{e.low:.3g}, {e.high:.3g}]{unit} at {u:.1f} m/s"
        for e, u in zip(by_recording, speeds, strict=True)
    )
    text = f"{means}; in time it varies by {spread:.2g}{unit}, errors included"
    if share > 0.3:
        numbers = ", ".join(f"{frequency * height / u:.2g}" for u in speeds)
        text += f", mostly at {frequency:.2g} Hz ({_STROUHAL}: {numbers})"
    return text
