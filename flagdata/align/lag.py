"""The offset between a camera's and an anemometer's clock, from the flag itself.

A flag moves more when the wind is stronger, a fraction of a second later. Neither the relation's
shape nor its noise is known, so the estimator uses only that it rises:

1. Wind x_k is the mean over bins of length P. Motion energy is averaged alike, at every P/10, so
   that a shift by any multiple of P/10 is a choice of samples, not an interpolation.
2. Both become normal scores, Φ⁻¹(rank): any monotone relation between Gaussian gusts and motion is
   then linear, and outliers weigh no more than their rank (van der Waerden, 1952).
3. The motion is modelled as y(t) = Σ a_w (G_w * x)(t + o) + e(t): Gaussians G_w of several widths
   with a_w ≥ 0, since the quick gusts at the sensor are not those at the flag (Davenport, 1961:
   coherence exp(−c n d / U)), and e autoregressive, φ(B) e = ε (Cochrane and Orcutt, 1949). Both
   are filtered by φ. Frequencies so count by their signal-to-noise ratio: the time-domain form of
   the maximum-likelihood weighting of Knapp and Carter, IEEE Trans. ASSP 24 (1976) 320.
4. r(o) is the correlation of the two at offset o over the n(o) bins that both cover, z = atanh(r)
   √(n − 3) its score. The estimate is where z is greatest, refined by a parabola.
5. σ is that of the regression y = g x(t + o) + ε in o, with dependent scores
   ψ_k = (y_k − g x_k) dx_k/dt:
   σ² = Λ / (n (g var(dx/dt))²), Λ the long-run variance of ψ (Newey and West, 1987). Where
   exp(z²/2), the likelihood over all of the peak, is wider than that, its standard deviation
   counts. The uncertainty of the flag's response and of the stamps is added in quadrature.
6. Chance is measured, not assumed: winds with the same spectrum and random phases (Theiler et al.,
   1992) go through step 4, and a Gumbel distribution fitted to their greatest scores gives the
   probability of a score as high by accident. A periodic wind stays periodic under this, and so
   fails by itself. Here both are filtered by the motion's own autoregression (Box and Jenkins,
   1970), behind which accidents are rarest.

Everything here is a function of its arguments: no files, no clocks, no random generator of its own.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from flagdata.align.bins import STEPS, LagBins
from flagdata.align.film_motion import MotionSeries
from flagdata.align.whitened import FEWEST_BINS, Whitened, fit, longest_compared
from flagdata.core.clock_model import NINETY
from flagdata.core.findings import Finding, Severity
from flagdata.errors import InputError
from flagdata.record.signals import Series, WindAverage

_WIDEST = 7200.0  # s
_WINDS_AT_ONCE = 25
_EULER = 0.5772156649015329


@dataclass(frozen=True, kw_only=True)
class LagSearch:
    """What is searched, and what is asked of the answer.

    Attributes:
        centre: offset around which to search [s]: what the stamps say, 0 if they are believed.
        window: the search goes from centre − window to centre + window [s]. Raise it where the
            clocks may be further apart; a wider search takes longer and meets more accidents, so
            that peaks must be higher.
        response: time by which the flag's motion follows the wind that the bins report [s]: about
            L/U for a flag of length L, and d/U where the sensor stands d upwind of it. The sensor's
            own lag is not part of it: see `flagdata.align.windbins`.
        response_sigma: its standard uncertainty [s]. It bounds from below what this method can
            know.
        stamp_sigma: standard uncertainty of the wind's stamps as a whole [s]; 0.29 for stamps cut
            to whole seconds.
        overlap: least time both must cover [s]; and never fewer than 30 bins. Lowered, it allows
            offsets at which little is compared, where high correlations are common.
        gustiness: least standard deviation over mean of the binned wind. Below it the wind says
            nothing about time.
        chance: greatest probability of such a peak by accident. Raised, it accepts more wrong
            offsets; lowered, it refuses more right ones.
        rival: a second peak at this share of the greatest score makes the estimate ambiguous.
            Raised, it accepts an offset though another one agrees nearly as well.
        sigma: greatest standard uncertainty that is still an answer [s].
        surrogates: how many winds of random phase measure chance. More make the chance less noisy,
            and take longer.
    """

    centre: float = 0.0
    window: float = 120.0
    response: float = 0.3
    response_sigma: float = 0.15
    stamp_sigma: float = 0.0
    overlap: float = 120.0
    gustiness: float = 0.03
    chance: float = 0.01
    rival: float = 0.8
    sigma: float = 0.5
    surrogates: int = 200

    def __post_init__(self) -> None:
        numbers = (
            self.centre,
            self.window,
            self.response,
            self.overlap,
            self.gustiness,
            self.chance,
            self.sigma,
        )
        if not all(math.isfinite(number) for number in numbers):
            raise InputError(
                "a lag search with numbers that are not finite", fix="give finite numbers"
            )
        if self.window <= 0 or self.overlap <= 0 or self.sigma <= 0:
            raise InputError("window, overlap and sigma must be positive", fix="give seconds > 0")
        if self.window > _WIDEST:
            raise InputError(
                f"the search window ±{self.window:g} s is too wide",
                fix=f"search ±{_WIDEST:g} s at most, around a centre that is known better",
            )
        if self.response_sigma < 0 or self.stamp_sigma < 0 or self.gustiness < 0:
            raise InputError(
                "uncertainties and gustiness must not be negative", fix="give numbers ≥ 0"
            )
        if not (0 < self.chance < 1 and 0 < self.rival < 1):
            raise InputError("chance and rival are shares", fix="give numbers between 0 and 1")
        if self.surrogates < 50:
            raise InputError(
                f"{self.surrogates} surrogates cannot measure chance", fix="use 50 at least"
            )


@dataclass(frozen=True, kw_only=True)
class LagCurve:
    """Agreement of motion and wind against the offset, for the plot.

    Attributes:
        offset: (m,) offsets tried [s].
        score: (m,) z; NaN where the overlap is too short.
        overlap: (m,) time covered by both [s].
        evidence: (m,) the score of step 6, of white motion; NaN likewise.
        chance_score: the evidence that accidents exceed with the probability `LagSearch.chance`;
            NaN where nothing was searched.
    """

    offset: Series
    score: Series
    evidence: Series
    overlap: Series
    chance_score: float


@dataclass(frozen=True, kw_only=True)
class LagEstimate:
    """An offset to add to the camera's clock to reach the wind's, and whether it may be used.

    Attributes:
        offset: [s]; NaN where there is no peak at all.
        sigma: standard uncertainty, all parts [s].
        sigma_statistical: the part that a longer recording would shrink [s].
        at: instant on the camera's clock at which it holds, mid-overlap [UTC ns].
        confidence: probability that the peak is neither an accident nor a rival's; the interval is
            given that.
        correlation: of filtered normal scores at the peak.
        chance: probability of a score as high by accident.
        bins: how many wind bins were compared at the peak.
        findings: reasons; one of severity "error" refuses the estimate.
        curve: the whole search.
    """

    offset: float
    sigma: float
    sigma_statistical: float
    at: int
    confidence: float
    correlation: float
    chance: float
    bins: int
    findings: tuple[Finding, ...]
    curve: LagCurve

    @property
    def interval(self) -> tuple[float, float]:
        """Its 90 % interval [s], without ends where there is no peak."""
        if not math.isfinite(self.sigma):
            return -math.inf, math.inf
        return self.offset - NINETY * self.sigma, self.offset + NINETY * self.sigma

    @property
    def is_accepted(self) -> bool:
        return not any(finding.severity is Severity.ERROR for finding in self.findings)

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why it was refused; empty when accepted."""
        return tuple(
            finding.what for finding in self.findings if finding.severity is Severity.ERROR
        )


def estimate_offset(
    motion: MotionSeries, wind: WindAverage, *, search: LagSearch, generator: np.random.Generator
) -> LagEstimate:
    """Estimates the offset of the camera's clock from the wind's by the lag of the flag's motion
    (see the module's text).

    Args:
        motion: energy on the camera's clock; several values a wind bin.
        wind: bins on one regular grid; missing bins are gaps.
        generator: for the phases of the surrogate winds only; the offset does not depend on it.

    Raises:
        InputError: no wind bins, bins off their grid, or fewer than two motion values a bin.
    """
    # Steps 1 and 2: bins and normal scores.
    bins = LagBins.of(motion, wind, centre=search.centre - search.response, window=search.window)
    if bins.gustiness < search.gustiness:
        return _nothing(bins, search, (*motion.findings, _no_gusts(bins, search)))
    # Steps 3 and 4: the filter, and the offset of the greatest score.
    model = fit(bins, overlap=search.overlap)
    if model is None:
        return _nothing(bins, search, (*motion.findings, _unfit(bins, search)))
    pair = model.best
    score, counts, best = pair.search(overlap=search.overlap)
    peak = pair.peak(score, best)

    # Step 5: the uncertainty, and a second peak that agrees nearly as well.
    rival, mass, spread = _lobe(bins.offsets, score, best)
    statistical = max(peak.sigma, spread)
    reach = max(STEPS, round(2 * min(statistical, search.window) / bins.period * STEPS))
    # Step 6: the probability of such a score by accident.
    evidence, _, _ = model.whitest.search(overlap=search.overlap)
    evidence_near_peak = evidence[max(best - reach, 0) : best + reach + 1]
    accidents = _Accidents.of(model.whitest, search, generator)
    chance = accidents.chance(float(np.nanmax(evidence_near_peak)))
    sigma = math.sqrt(statistical**2 + search.response_sigma**2 + search.stamp_sigma**2)
    offset = peak.offset + search.response
    estimate = LagEstimate(
        offset=offset,
        sigma=sigma,
        sigma_statistical=statistical,
        at=bins.middle(best),
        confidence=(1 - chance) * mass,
        correlation=peak.correlation,
        chance=chance,
        bins=peak.bins,
        findings=motion.findings,
        curve=LagCurve(
            offset=bins.offsets + search.response,
            score=score,
            evidence=evidence,
            overlap=counts * bins.period,
            chance_score=accidents.score(search.chance),
        ),
    )
    return replace(
        estimate, findings=(*motion.findings, *_judge(estimate, search, best=best, rival=rival))
    )


@dataclass(frozen=True, kw_only=True)
class _Accidents:
    """Gumbel distribution of the greatest score that winds of the same spectrum and random phases
    reach."""

    location: float
    scale: float

    @classmethod
    def of(cls, pair: Whitened, search: LagSearch, generator: np.random.Generator) -> _Accidents:
        present = np.isfinite(pair.wind)
        centred = np.where(present, pair.wind - np.mean(pair.wind[present]), 0.0)
        spectrum = np.abs(np.fft.rfft(centred))[:, None]
        greatest = np.empty(search.surrogates)
        for first in range(0, search.surrogates, _WINDS_AT_ONCE):
            part = greatest[first : first + _WINDS_AT_ONCE]
            phase = generator.uniform(0.0, 2 * math.pi, (len(spectrum), len(part)))
            winds = np.fft.irfft(spectrum * np.exp(1j * phase), n=len(centred), axis=0)
            scores, _ = pair.scores(winds, overlap=search.overlap)
            part[:] = np.max(scores[np.all(np.isfinite(scores), axis=1)], axis=0)
        scale = float(np.std(greatest, ddof=1)) * math.sqrt(6) / math.pi
        return cls(location=float(np.mean(greatest)) - _EULER * scale, scale=scale)

    def chance(self, score: float) -> float:
        """Computes the probability of a greatest score above `score`."""
        return -math.expm1(-math.exp(-(score - self.location) / self.scale))

    def score(self, chance: float) -> float:
        """Computes the score that is exceeded with probability `chance`."""
        return self.location - self.scale * math.log(-math.log1p(-chance))


def _lobe(offsets: Series, score: Series, best: int) -> tuple[int | None, float, float]:
    """Finds the greatest score outside the peak's lobe, and the share and standard deviation [s] of
    exp(z²/2) inside it.

    The lobe reaches to where the score first falls below half of its greatest, and two bins at
    least.
    """
    low = high = best
    half = score[best] / 2
    while low > 0 and score[low - 1] > half:
        low -= 1
    while high < len(score) - 1 and score[high + 1] > half:
        high += 1
    lobe = slice(max(min(low, best - 2 * STEPS), 0), max(high, best + 2 * STEPS) + 1)
    outside = np.where(np.isfinite(score), score, -np.inf)
    positive = np.maximum(outside, 0.0)
    weight = np.where(positive > 0, np.exp((positive**2 - positive[best] ** 2) / 2), 0.0)
    inside = weight[lobe] / weight[lobe].sum()
    mean = float(inside @ offsets[lobe])
    spread = math.sqrt(float(inside @ np.square(offsets[lobe] - mean)))
    mass = float(weight[lobe].sum() / weight.sum())
    outside[lobe] = -np.inf
    rival = int(np.argmax(outside))
    return (rival if np.isfinite(outside[rival]) else None), mass, spread


def _judge(
    estimate: LagEstimate, search: LagSearch, *, best: int, rival: int | None
) -> list[Finding]:
    """Lists what speaks against an estimate, and what the user should know of it."""
    curve = estimate.curve
    score = curve.score
    findings: list[Finding] = []
    if estimate.chance > search.chance:
        findings.append(
            _error(
                "accidental-peak",
                f"unrelated winds reach such a peak with probability {estimate.chance:.2g} (limit "
                f"{search.chance:g})",
                estimate.chance,
            )
        )
    if rival is not None and score[rival] > search.rival * score[best]:
        findings.append(
            _error(
                "ambiguous-offset",
                f"{curve.offset[rival]:+.1f} s fits {100 * score[rival] / score[best]:.0f} % as "
                "well as"
                f" {curve.offset[best]:+.1f} s",
                float(curve.offset[rival]),
            )
        )
    usable = np.flatnonzero(np.isfinite(score))
    if min(best - usable[0], usable[-1] - best) < 2 * STEPS:
        findings.append(
            _error(
                "offset-at-edge",
                f"the best offset {curve.offset[best]:+.1f} s is at the edge of the"
                f" {curve.offset[usable[0]]:+.1f} to {curve.offset[usable[-1]]:+.1f} s searched",
                float(curve.offset[best]),
            )
        )
    if not estimate.sigma <= search.sigma:
        findings.append(
            _error(
                "wide-offset",
                f"the offset is known to {estimate.sigma:.2f} s only (limit {search.sigma:g} s)",
                estimate.sigma if math.isfinite(estimate.sigma) else None,
            )
        )
    return findings


def _no_gusts(bins: LagBins, search: LagSearch) -> Finding:
    return _error(
        "steady-wind",
        f"the wind varies by {100 * bins.gustiness:.1f} % of its mean only (limit "
        f"{100 * search.gustiness:g} %):"
        " without gusts nothing ties the film to it",
        bins.gustiness,
    )


def _unfit(bins: LagBins, search: LagSearch) -> Finding:
    """Explains why no model fits at any offset."""
    longest, least = longest_compared(bins), max(search.overlap, FEWEST_BINS * bins.period)
    if longest < least:
        return _short_overlap(longest, least)
    if not np.nanstd(bins.motion) > 0:
        return _error("still-flag", "the motion does not vary: nothing follows the wind", None)
    return _error("unmoved-flag", "at no offset searched does the motion rise with the wind", None)


def _short_overlap(longest: float, least: float) -> Finding:
    return _error(
        "short-overlap",
        f"film and wind log share {longest:.0f} s at most at any offset searched (limit {least:g} "
        "s)",
        longest,
    )


def _error(kind: str, text: str, value: float | None) -> Finding:
    return Finding(kind=kind, severity=Severity.ERROR, what=text, value=value)


def _nothing(bins: LagBins, search: LagSearch, findings: tuple[Finding, ...]) -> LagEstimate:
    """Refuses before there is a peak."""
    empty = np.full(len(bins.offsets), np.nan)
    return LagEstimate(
        offset=math.nan,
        sigma=math.inf,
        sigma_statistical=math.inf,
        at=bins.first,
        confidence=0.0,
        correlation=math.nan,
        chance=1.0,
        bins=0,
        findings=findings,
        curve=LagCurve(
            offset=bins.offsets + search.response,
            score=empty,
            evidence=empty,
            overlap=np.zeros(len(empty)),
            chance_score=math.nan,
        ),
    )
