"""The rate at which two clocks part, from the offsets of the parts of a long recording."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from flagdata.align.declared import PRIOR_DRIFT, QUARTZ
from flagdata.align.film_motion import MotionSeries
from flagdata.align.lag import LagEstimate, LagSearch, estimate_offset
from flagdata.core.findings import Finding
from flagdata.errors import InputError
from flagdata.record.signals import Series, WindAverage
from flagdata.timebase import NANOSECONDS

PART = 600.0  # s
FEWEST_PARTS = 3
_AROUND = 10.0  # s either side of the whole recording's offset, at least
_FASTEST = 3e-4  # s/s, beyond which no clock in a camera parts from another
_PART_SIGMA = (
    2.0  # s; a part known worse than this says nothing; lowered, fewer parts are left for a drift
)
_DISAGREEMENT = 5.0  # σ of a part from the line


@dataclass(frozen=True, kw_only=True)
class ClockLine:
    """offset + drift · (time − origin): the camera's clock to the wind's over a whole recording.

    Attributes:
        origin: on the camera's clock [UTC ns]; where offset and drift are uncorrelated.
        offset, drift: [s] and [s/s].
        sigma_offset, sigma_drift: standard uncertainties.
        parts: the parts that the drift was measured from; empty where it is a prior's, 0 ±
            `QUARTZ`.
        findings: a clock that does not run straight.
    """

    origin: int
    offset: float
    drift: float
    sigma_offset: float
    sigma_drift: float
    parts: tuple[LagEstimate, ...] = ()
    findings: tuple[Finding, ...] = ()


def clock_line(
    motion: MotionSeries,
    wind: WindAverage,
    overall: LagEstimate,
    *,
    search: LagSearch,
    generator: np.random.Generator,
) -> ClockLine:
    """Fits a drift about an accepted offset, from parts of ten minutes where there are three or
    more.

    The parts' offsets are fitted by a line, weighted by their statistical σ; a scatter beyond those
    widens the result (Birge, 1932: √(χ²/ν) where it exceeds 1). What is common to all parts, the
    flag's response and the stamps, goes into the offset alone. A prior of 0 ± `PRIOR_DRIFT` takes
    part as one more datum.

    A part more than 5 σ off the line says that a clock was set or stalled; then the finding
    "crooked-clock" is an error, and the line is not to be used.

    Raises:
        InputError: `overall` was refused.
    """
    if not overall.is_accepted:
        raise InputError("no drift about an offset that was refused", fix="check accepted first")
    alone = ClockLine(
        origin=overall.at,
        offset=overall.offset,
        drift=0.0,
        sigma_offset=overall.sigma,
        sigma_drift=QUARTZ,
    )
    duration = float(motion.time[-1] - motion.time[0]) / NANOSECONDS
    count = int(duration / PART)
    if count < FEWEST_PARTS:
        return alone
    reach = max(_AROUND, 4 * overall.sigma + _FASTEST * duration)
    search_nearby = replace(search, centre=overall.offset, window=reach, sigma=_PART_SIGMA)
    parts = tuple(
        part
        for chunk in _chunks(motion, count)
        if (
            part := estimate_offset(chunk, wind, search=search_nearby, generator=generator)
        ).is_accepted
    )
    if len(parts) < FEWEST_PARTS:
        return alone
    return line_through(parts, overall)


def _chunks(motion: MotionSeries, count: int) -> list[MotionSeries]:
    edges = np.linspace(float(motion.time[0]), float(motion.time[-1]) + 1, count + 1)
    number = np.clip(
        np.searchsorted(edges, motion.time.astype(np.float64), side="right") - 1, 0, count - 1
    )
    chunks = []
    for part in range(count):
        inside = number == part
        if np.count_nonzero(inside) > 1:
            chunks.append(MotionSeries(time=motion.time[inside], energy=motion.energy[inside]))
    return chunks


def line_through(parts: tuple[LagEstimate, ...], overall: LagEstimate) -> ClockLine:
    """Fits the weighted line of `clock_line` through the offsets of three parts or more; `overall`
    lends its common σ."""
    at = np.array([(part.at - overall.at) / NANOSECONDS for part in parts])
    offset = np.array([part.offset for part in parts])
    sigma = np.array([part.sigma_statistical for part in parts])
    mean, drift, origin, weight, information = _weighted_offset(at, offset, sigma)
    residual = (offset - mean - drift * (at - origin)) / sigma
    worst = int(np.argmax(np.abs(residual)))
    scatter = math.sqrt(float(residual @ residual) / (len(parts) - 2))
    if scatter > 1:
        mean, drift, origin, weight, information = _weighted_offset(at, offset, sigma * scatter)
    common = math.sqrt(max(overall.sigma**2 - overall.sigma_statistical**2, 0.0))
    findings: tuple[Finding, ...] = ()
    if abs(residual[worst]) > _DISAGREEMENT:
        findings = (
            Finding.of(
                "crooked-clock",
                f"the offset of part {worst + 1} of {len(parts)} is {offset[worst]:+.2f} ± "
                f"{sigma[worst]:.2f} s,"
                f" {abs(residual[worst]):.0f} σ off a steady clock: one of the clocks was set or "
                "stalled",
                value=float(offset[worst]),
                fix="cut the recording there and align the pieces",
            ),
        )
    return ClockLine(
        origin=overall.at + round(origin * NANOSECONDS),
        offset=mean,
        drift=drift,
        sigma_offset=math.hypot(1 / math.sqrt(weight), common),
        sigma_drift=1 / math.sqrt(information),
        parts=parts,
        findings=findings,
    )


def _weighted_offset(
    at: Series, offset: Series, sigma: Series
) -> tuple[float, float, float, float, float]:
    """Computes the offset at the weighted mean time, drift, that time, and the information (1/σ²)
    of offset and drift."""
    weight = sigma**-2
    total = float(weight.sum())
    origin, mean = float(weight @ at) / total, float(weight @ offset) / total
    away = at - origin
    information = float(weight @ away**2) + PRIOR_DRIFT**-2  # the prior is a datum of drift 0
    return mean, float(weight @ (away * (offset - mean))) / information, origin, total, information
