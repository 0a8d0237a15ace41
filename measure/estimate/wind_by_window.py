"""Wind by window, beside an anemometer's: how far off, at which frequencies they agree, and how
much later one is.

Two references are taken from the anemometer. *Window*: its mean over the window's own time, what
the film should show.
*Minute*: its mean over the minute before the window's end, the ground truth of Runia et al. 2020,
section 5, of which a window is a sample; gusts within the minute count as errors against it.

Spectra are Welch's and the coherence is the magnitude-squared one (`scipy.signal`), with Hann
segments of a quarter of the longest run of windows without gaps, that overlap by a half. With k
such segments independent series exceed the coherence 1 − 0.05^(1/(k − 1)) at one frequency in
twenty (Carter, Knapp and Nuttall, IEEE Trans. AU 21, 1973), where the overlap is not counted. The
delay is found as `flagdata.align` finds a clock's offset, with the wind off the film in place of
the motion.

A window whose wind is bounded on one side only (`measure.posterior_ends`) has no value, and an
interval that ends at infinity. It counts where intervals are compared with the anemometer, and not
among the errors, spectra and delays of values.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from flagdata.answer import Span
from flagdata.core.arrays import FloatArray
from flagdata.core.rng import stream
from flagdata.core.schema import TRUTH_WINDOW
from flagdata.dataset.truth import TruthSeries, over_ground
from flagdata.errors import InputError
from flagdata.record.signals import WindSeries
from flagdata.timebase import NANOSECONDS
from measure.estimate.film_measuring import Measurement

WIND = "wind_speed"
LEAST_SPECTRUM = 32
"""Windows in a row below which there is no spectrum."""
_SEGMENTS = 4
_SEARCHED = 30.0  # s either way
_SHORTEST_DELAY = 120.0  # s that film and anemometer must share
_RESPONSE = (
    0.0,
    0.3,
)  # s: the network's windows are centred; the flag follows the wind by about L/U, of either sign
_RESAMPLES = 1000
_BLOCK = 12.0
"""Time over which windows are resampled together [s]: ten windows of a flag of 1.5 m. Neighbours
err alike."""
_FEWEST = 5
"""Blocks below which the RMSE has no interval: resampling two or three says nothing of how it
scatters."""


@dataclass(frozen=True, kw_only=True)
class Agreement:
    """Estimated less logged wind.

    Attributes:
        count: windows compared.
        bounded: of these, windows with a bound instead of a value.
        bias: mean difference of the others [m/s]; None where there are none.
        rmse: root mean square of the same [m/s], likewise.
        rmse_span: 90 % of the RMSE, by resampling blocks of `_BLOCK` [m/s]; None where there are
            fewer than `_FEWEST`.
        covered: share of all windows compared whose interval contains the reference.
    """

    JSON_NAMES: ClassVar[tuple[str, ...]] = (
        "count",
        "bounded",
        "bias",
        "rmse",
        "interval",
        "covered",
    )

    count: int
    bounded: int
    bias: float | None
    rmse: float | None
    rmse_span: Span | None
    covered: float

    @property
    def interval(self) -> list[float | None] | None:
        """Ends of the RMSE's interval [m/s]; None without one."""
        return None if self.rmse_span is None else self.rmse_span.ends()

    @property
    def sentence(self) -> str:
        """Phrases the agreement."""
        covered = f"the intervals contain {self.covered:.0%} of it, n = {self.count} windows"
        if self.bounded:
            covered += f", of which {self.bounded} give a bound and no value"
        if self.bias is None or self.rmse is None:
            return covered
        errors = f"bias {self.bias:+.2f} m/s, RMSE {self.rmse:.2f} m/s"
        if self.rmse_span is None:
            return f"{errors} (without an interval: too few windows), {covered}"
        return f"{errors} {self.rmse_span.phrase(2)} {self.rmse_span.percent}, {covered}"


@dataclass(frozen=True, kw_only=True, eq=False)
class Spectrum:
    """Spectra of both series, over the longest run without gaps.

    Attributes:
        frequency: (f,) [Hz].
        estimated, logged: (f,) power densities [(m/s)²/Hz].
        coherence: (f,) from 0 to 1.
        chance: coherence that independent series exceed at one frequency in twenty.
        windows: length of the run.
    """

    JSON_NAMES: ClassVar[tuple[str, ...]] = (
        "sentence",
        "frequency",
        "estimated",
        "logged",
        "coherence",
        "chance",
        "windows",
    )

    frequency: FloatArray
    estimated: FloatArray
    logged: FloatArray
    coherence: FloatArray
    chance: float
    windows: int

    @property
    def shared(self) -> float:
        """Frequency below which the series have more in common than chance gives [Hz]: that of the
        first of two neighbouring coherences at or below `chance`; infinite where there are none, 0
        where they are the lowest."""
        by_chance = self.coherence <= self.chance
        first = np.flatnonzero(by_chance[:-1] & by_chance[1:])
        if not len(first):
            return math.inf
        return float(self.frequency[first[0]]) if first[0] else 0.0

    @property
    def sentence(self) -> str:
        """Phrases the coherence."""
        if self.shared == 0:
            return (
                "The film's wind and the anemometer's are found to have nothing in common at any "
                "frequency"
            )
        common = self.coherence[self.frequency < self.shared].mean()
        if math.isinf(self.shared):
            last = self.frequency[-1]
            return (
                f"The film's wind follows the anemometer's up to {last:.2g} Hz (mean coherence "
                f"{common:.2f})"
            )
        return (
            f"Below {self.shared:.2g} Hz, in gusts of more than {1 / self.shared:.2g} s, the "
            "film's wind follows the "
            f"anemometer's (mean coherence {common:.2f}); above, they are found to have nothing in "
            "common"
        )


@dataclass(frozen=True, kw_only=True)
class Delay:
    """What is to be added to the film's clock to reach the anemometer's.

    Attributes:
        offset, sigma: [s]; None where nothing was found.
        reasons: why it may not be relied on; empty where it may.
    """

    offset: float | None
    sigma: float | None
    reasons: tuple[str, ...]

    @property
    def sentence(self) -> str:
        """Phrases it, without a full stop."""
        if self.offset is None or self.reasons:
            return (
                "no delay between film and anemometer could be estimated: "
                f"{'; '.join(self.reasons)}"
            )
        sigma = "" if self.sigma is None else f" ± {self.sigma:.2f} s (1 σ)"
        return (
            f"{self.offset:+.2f} s{sigma} are to be added to the film's clock to reach the "
            "anemometer's"
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Beside:
    """A wind series and its anemometer.

    Attributes:
        time: (n,) middles of the windows [s from the film's first frame].
        wind: (n,) estimated [m/s]; NaN where it is bounded on one side only.
        low, high: (n,) its interval [m/s]; infinite at an end that nothing bounds.
        p: (n,) of the gate.
        logged, minute: (n,) references [m/s]; NaN where the anemometer was silent. None without an
            anemometer.
        window, of_minute: agreement with them.
        spectrum: None where the series is too short.
        delay: None without an anemometer.
    """

    JSON_NAMES: ClassVar[tuple[str, ...]] = (
        "window",
        "minute=of_minute",
        "spectrum",
        "delay",
    )
    """What is concluded; the columns are elsewhere."""

    time: FloatArray
    wind: FloatArray
    low: FloatArray
    high: FloatArray
    p: FloatArray
    logged: FloatArray | None = None
    minute: FloatArray | None = None
    window: Agreement | None = None
    of_minute: Agreement | None = None
    spectrum: Spectrum | None = None
    delay: Delay | None = None

    def columns(self) -> dict[str, FloatArray]:
        """Name → (n,), as they are written to tables."""
        out = {
            "time": self.time,
            "wind": self.wind,
            "low": self.low,
            "high": self.high,
            "p": self.p,
        }
        if self.logged is not None and self.minute is not None:
            out |= {"anemometer": self.logged, "anemometer_minute": self.minute}
        return out

    def rows(self) -> Iterator[Sequence[str]]:
        """Lines of a table, its header first; unknown values are empty, an end that nothing bounds
        is "inf"."""
        columns = self.columns()
        yield list(columns)
        for values in zip(*columns.values(), strict=True):
            yield ["" if math.isnan(value) else f"{value:.6g}" for value in values]


def beside(measured: Measurement, *, start: int | None, wind: WindSeries | None) -> Beside:
    """Places the windows of a measurement as a series beside an anemometer on the film's clock.

    Args:
        start: instant of the film's first frame [UTC ns]; None where nobody said, and nothing is
            compared.
        wind: of the anemometer; None if there is none.
    """
    quantities = [window.quantity(WIND) for window in measured.windows]
    series = Beside(
        time=np.array([(window.start + window.end) / 2 for window in measured.windows]),
        wind=np.array(
            [math.nan if quantity.value is None else quantity.value for quantity in quantities]
        ),
        low=np.array([quantity.span.low for quantity in quantities]),
        high=np.array([quantity.span.high for quantity in quantities]),
        p=np.array([window.p for window in measured.windows]),
    )
    if start is None or wind is None or over_ground(wind) is None:
        return series
    truth = TruthSeries.of(wind)
    ends = [start + round(window.end * NANOSECONDS) for window in measured.windows]
    length = measured.windows[0].end - measured.windows[0].start
    # A slow logger's window holds no sample of its own, so it is as long as its sampling period at
    # least.
    logged = np.array([truth.before(end, window=max(length, truth.period)).wind for end in ends])
    minute = np.array([truth.before(end, window=TRUTH_WINDOW).wind for end in ends])
    return Beside(
        time=series.time,
        wind=series.wind,
        low=series.low,
        high=series.high,
        p=series.p,
        logged=logged,
        minute=minute,
        window=agreement(series, logged, seed=measured.options.seed),
        of_minute=agreement(series, minute, seed=measured.options.seed),
        spectrum=spectrum(series.time, series.wind, logged),
        delay=_delay(series, start, wind, measured.options.seed),
    )


def agreement(series: Beside, reference: FloatArray, *, seed: int) -> Agreement | None:
    """Compares the windows with the reference where it covers them; None where it covers none."""
    covered = np.isfinite(reference)
    count = int(covered.sum())
    if not count:
        return None
    both = covered & np.isfinite(series.wind)
    off = (series.wind - reference)[both]
    inside = (series.low[covered] <= reference[covered]) & (
        reference[covered] <= series.high[covered]
    )
    valued = bool(len(off))
    return Agreement(
        count=count,
        bounded=count - len(off),
        bias=float(off.mean()) if valued else None,
        rmse=float(np.sqrt(np.mean(off**2))) if valued else None,
        rmse_span=_rmse_span(off, series.time[both], seed),
        covered=float(inside.mean()),
    )


def _rmse_span(off: FloatArray, time: FloatArray, seed: int) -> Span | None:
    """Computes the RMSE's 90 % interval by resampling blocks of windows; None of too few."""
    if not len(off):
        return None
    _, block = np.unique(np.floor((time - time[0]) / _BLOCK), return_inverse=True)
    sums, sizes = np.bincount(block, weights=np.square(off)), np.bincount(block)
    if len(sums) < _FEWEST:
        return None
    drawn = stream(seed, "agreement").integers(len(sums), size=(_RESAMPLES, len(sums)))
    values = np.sqrt(sums[drawn].sum(axis=1) / sizes[drawn].sum(axis=1))
    low, high = np.quantile(values, [0.05, 0.95])
    return Span(low=float(low), high=float(high), level=0.9, bound=None, estimated=True)


def spectrum(time: FloatArray, estimated: FloatArray, logged: FloatArray) -> Spectrum | None:
    """Computes spectra over the longest run of windows one step apart, all estimated and logged;
    None where it is shorter than `LEAST_SPECTRUM`, or where one of the series does not vary."""
    if len(time) < LEAST_SPECTRUM:
        return None
    from scipy import signal

    step = float(np.median(np.diff(time)))
    both_valid = np.isfinite(estimated + logged)
    broken = (
        np.flatnonzero(
            (np.abs(np.diff(time) - step) > 0.01 * step) | ~(both_valid[1:] & both_valid[:-1])
        )
        + 1
    )
    runs = np.split(np.arange(len(time)), broken)
    run = max(runs, key=len)
    if len(run) < LEAST_SPECTRUM:
        return None
    segment = len(run) // _SEGMENTS
    pair = estimated[run] - estimated[run].mean(), logged[run] - logged[run].mean()
    if min(float(np.ptp(values)) for values in pair) == 0:
        return None
    frequency, power = signal.welch(pair[0], fs=1 / step, nperseg=segment)
    _, logged_power = signal.welch(pair[1], fs=1 / step, nperseg=segment)
    _, coherent = signal.coherence(*pair, fs=1 / step, nperseg=segment)
    return Spectrum(
        frequency=frequency[1:],
        estimated=power[1:],
        logged=logged_power[1:],
        coherence=coherent[1:],
        chance=1 - 0.05 ** (1 / (_SEGMENTS - 1)),
        windows=len(run),
    )


def _delay(series: Beside, start: int, wind: WindSeries, seed: int) -> Delay:
    if series.time[-1] - series.time[0] < _SHORTEST_DELAY:
        return Delay(
            offset=None, sigma=None, reasons=(f"the film is shorter than {_SHORTEST_DELAY:.0f} s",)
        )
    from flagdata.align.film_motion import MotionSeries
    from flagdata.align.lag import (
        LagSearch,
        estimate_offset,
    )  # only now: few films have an anemometer beside them
    from flagdata.align.windbins import wind_bins

    step = float(np.median(np.diff(series.time)))
    instants = start + np.round(series.time * NANOSECONDS).astype(np.int64)
    try:
        bins = wind_bins(wind, shortest=max(1.0, 2 * step))
        fit = estimate_offset(
            MotionSeries(time=instants, energy=np.maximum(series.wind, 0.0)),
            bins.average,
            search=LagSearch(
                window=_SEARCHED,
                response=_RESPONSE[0],
                response_sigma=_RESPONSE[1],
                stamp_sigma=bins.sigma,
            ),
            generator=stream(seed, "delay"),
        )
    except InputError as error:
        return Delay(offset=None, sigma=None, reasons=(error.what,))
    is_known = math.isfinite(fit.offset)
    return Delay(
        offset=fit.offset if is_known else None,
        sigma=fit.sigma if is_known and math.isfinite(fit.sigma) else None,
        reasons=fit.reasons,
    )
