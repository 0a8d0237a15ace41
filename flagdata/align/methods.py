"""The three ways to a clock model, and what each needs: by stamps, given, estimated from the flag's
motion."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

import numpy as np

from flagdata.align.declared import by_stamps, given, stamp_sigma
from flagdata.align.drift import ClockLine, clock_line
from flagdata.align.film_motion import MotionSeries
from flagdata.align.film_recording import Alignment, Pair
from flagdata.align.lag import LagEstimate, LagSearch, estimate_offset
from flagdata.align.windbins import wind_bins
from flagdata.core.clock_model import NINETY, ClockModel, Segment
from flagdata.core.findings import Finding, Severity
from flagdata.core.rng import stream
from flagdata.errors import CorruptError, RefusedError, UsageError
from flagdata.record.metadata import CAMERA
from flagdata.record.signals import WindAverage
from flagdata.timebase import NANOSECONDS

Progress = Callable[[int], object]
_GIVEN = "use --by given --clock-offset SECONDS --offset-sigma SECONDS"
_PASSED = 3.0  # m of air, about twice the length of the flags that people film
_QUICKEST, _SLOWEST = 0.3, 1.0  # s
_UNCERTAIN = 0.3  # s; beyond it few estimates would be certain enough


class Method(StrEnum):
    STAMPS = "stamps"
    GIVEN = "given"
    ESTIMATE = "estimate"


@dataclass(frozen=True, kw_only=True)
class ClockOptions:
    """How to come by the clock model.

    Attributes:
        by: the method.
        offset: added to the camera's clock to reach the wind's [s]; for `GIVEN` only.
        offset_sigma: its standard uncertainty [s]; for `GIVEN`, and for `STAMPS`, where it is how
            well the two clocks are known to agree.
        search: for `ESTIMATE`; its response counts where the two below are stated.
        response, response_sigma: by how much the flag's motion follows the wind [s], and its
            standard uncertainty, as stated; None for what `responding` says of the logged wind.

    Raises:
        UsageError: what the method needs is missing, something it has no use for was given, or
            numbers make no sense.
    """

    by: Method = Method.ESTIMATE
    offset: float | None = None
    offset_sigma: float | None = None
    search: LagSearch | None = None
    response: float | None = None
    response_sigma: float | None = None

    def __post_init__(self) -> None:
        if self.offset is not None and not math.isfinite(self.offset):
            raise UsageError(
                f"the clock offset {self.offset} s is not finite",
                where="--clock-offset",
                fix="give a finite number of seconds",
            )
        if self.offset_sigma is not None and not (
            math.isfinite(self.offset_sigma) and self.offset_sigma > 0
        ):
            raise UsageError(
                f"the uncertainty {self.offset_sigma} s of the clock offset is not a positive "
                "number",
                where="--offset-sigma",
                fix="give seconds > 0",
            )
        if (self.offset is not None) != (self.by is Method.GIVEN):
            number = "an" if self.by is Method.GIVEN else "no"
            raise UsageError(
                f"alignment by {self.by} needs {number} offset", where="--clock-offset", fix=_GIVEN
            )
        if (self.offset_sigma is not None) == (self.by is Method.ESTIMATE):
            if self.by is Method.ESTIMATE:
                raise UsageError(
                    "the σ of an estimate is estimated",
                    where="--offset-sigma",
                    fix="leave it out, or use --by given",
                )
            raise UsageError(
                f"alignment by {self.by} needs the uncertainty of the clock offset",
                where="--offset-sigma",
                fix="state how well the clocks are known to agree, in seconds (one standard "
                "deviation)",
            )
        searching = (self.search, self.response, self.response_sigma)
        if self.by is not Method.ESTIMATE and any(option is not None for option in searching):
            raise UsageError(
                f"alignment by {self.by} searches nothing",
                where="--search",
                fix="leave the search's options out",
            )

    def recipe(self) -> dict[str, Any]:
        """Returns what the recording's identity depends on."""
        if self.by is Method.ESTIMATE:
            search = {**vars(self.search or LagSearch()), "response": self.response}
            return {
                "align": {
                    "by": self.by.value,
                    "search": {**search, "response_sigma": self.response_sigma},
                }
            }
        return {
            "align": {"by": self.by.value, "offset": self.offset, "offset_sigma": self.offset_sigma}
        }


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """What an estimate was made from, for the plot.

    Attributes:
        motion: on the camera's clock.
        wind: bins whose instants were corrected for the instrument's averaging, on the wind's
            clock.
        estimate: accepted or not.
        line: offset and drift over the whole recording; `None` where the estimate was refused.
        response: by how much motion was taken to follow the wind [s].
    """

    motion: MotionSeries
    wind: WindAverage
    estimate: LagEstimate
    line: ClockLine | None
    response: float

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why there is no clock model; empty when there is."""
        crooked = self.line.findings if self.line is not None else ()
        return (*self.estimate.reasons, *(f.what for f in crooked if f.severity is Severity.ERROR))

    def as_json(self) -> bytes:
        """Writes the search for the record: offsets [s], scores, evidence, and the evidence that
        accidents seldom reach."""
        curve = self.estimate.curve
        score, evidence = (
            [None if math.isnan(value) else round(value, 4) for value in values.tolist()]
            for values in (curve.score, curve.evidence)
        )
        content = {
            "schema": "flagdata.lag-curve/1",
            "offset": np.round(curve.offset, 3).tolist(),
            "score": score,
            "evidence": evidence,
            "chance_score": round(curve.chance_score, 4),
        }
        return json.dumps(content, allow_nan=False).encode()


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """An alignment that may be used, with its evidence where it was estimated."""

    alignment: Alignment
    evidence: Evidence | None = None


def declared_clock(pair: Pair, options: ClockOptions, *, recipe: Mapping[str, Any]) -> Outcome:
    """Builds a clock model by stamps or by a given offset. The stamps' own resolution is added to a
    σ by stamps.

    Raises:
        UsageError: `options.by` is neither, or a σ that is no uncertainty.
    """
    if options.offset_sigma is None:
        raise UsageError("an estimate is not declared", fix="call estimated")
    start, end = pair.span
    names = (pair.camera.name, pair.wind.name)
    if options.offset is not None:
        clock = given(
            *names, start=start, end=end, offset=options.offset, sigma=options.offset_sigma
        )
    else:
        resolution = math.hypot(_start_sigma(pair), stamp_sigma(pair.series().time))
        clock = by_stamps(
            *names, start=start, end=end, sigma=math.hypot(options.offset_sigma, resolution)
        )
    segment = clock.segments[0]
    details = {
        "method": clock.method,
        "offset": segment.offset,
        "sigma": segment.sigma_offset,
        "confidence": 1.0,
    }
    return Outcome(
        alignment=Alignment(
            clock=clock,
            recipe=recipe,
            details=details,
            findings=_too_good(pair, segment.sigma_offset),
        )
    )


def responding(wind: float) -> tuple[float, float]:
    """Computes by how much a flag's motion follows a mean wind [m/s], and the standard uncertainty
    of that [s].

    A flag follows when the air has passed it twice, and one that hangs in light wind later still:
    motion of simulated flags of 1.5 m by 1 m lags by 1.0 to 1.6 s in winds of 3 m/s. From 10 m/s on
    it is 0.3 ± 0.15 s.
    """
    response = min(max(_PASSED / max(wind, 1e-3), _QUICKEST), _SLOWEST)
    return response, min(response / 2, _UNCERTAIN)


def evidence(pair: Pair, options: ClockOptions, *, progress: Progress | None = None) -> Evidence:
    """Estimate the offset, whether it may be used or not.

    Args:
        progress: called with the number of frames read, now and then.

    Raises:
        InputError: the wind log holds no wind speed, or nothing to compare.
        RefusedError: film and log cannot both cover as long a time as is compared.
    """
    search = options.search or LagSearch()
    bins = wind_bins(pair.series())
    response, sigma = responding(float(bins.average.speed.mean()))
    if options.response is not None:
        response, sigma = options.response, search.response_sigma
    search = replace(
        search,
        stamp_sigma=math.hypot(search.stamp_sigma, bins.sigma),
        response=response,
        response_sigma=sigma if options.response_sigma is None else options.response_sigma,
    )
    _check_lengths(pair, bins.average, search)
    motion = pair.motion(progress=progress)
    generator = stream(0, "align", pair.camera.id, pair.wind.id)
    estimate = estimate_offset(motion, bins.average, search=search, generator=generator)
    line = None
    if estimate.is_accepted:
        line = clock_line(motion, bins.average, estimate, search=search, generator=generator)
    return Evidence(
        motion=motion, wind=bins.average, estimate=estimate, line=line, response=search.response
    )


def _check_lengths(pair: Pair, wind: WindAverage, search: LagSearch) -> None:
    """Refuse a film or log that is shorter than what both must cover, before a frame is read."""
    start, end = pair.span
    film, log = (
        (end - start) / NANOSECONDS,
        float(wind.time[-1] - wind.time[0]) / NANOSECONDS + wind.period,
    )
    if min(film, log) < search.overlap - wind.period:
        raise RefusedError(
            f"{film:.0f} s of film beside {log:.0f} s of log: an offset is estimated from "
            f"{search.overlap:g} s or more "
            "that both cover",
            where=f"{pair.camera.name} and {pair.wind.name}",
            fix=f"give a longer film and log, or state the offset: {_GIVEN}",
        )


def estimated_clock(pair: Pair, evidence: Evidence, *, recipe: Mapping[str, Any]) -> Outcome:
    """Builds the clock model of an estimate that may be used.

    Raises:
        RefusedError: it may not, with the reasons.
    """
    estimate, line = evidence.estimate, evidence.line
    if line is None or evidence.reasons:
        raise RefusedError(
            f"no offset can be estimated: {'; '.join(evidence.reasons)}",
            where=f"{pair.camera.name} and {pair.wind.name}",
            fix=f"look at it with --plot FILE.png; or state the offset: {_GIVEN}",
        )
    start, end = pair.span
    segment = Segment(
        start=start,
        end=end,
        origin=line.origin,
        offset=line.offset,
        drift=line.drift,
        sigma_offset=line.sigma_offset,
        sigma_drift=line.sigma_drift,
    )
    clock = ClockModel(
        device=pair.camera.name,
        reference=pair.wind.name,
        method="estimated",
        confidence=estimate.confidence,
        segments=(segment,),
    )
    alignment = Alignment(
        clock=clock,
        recipe=recipe,
        findings=(*estimate.findings, *_too_good(pair, line.sigma_offset)),
        details={"method": "estimated", **summary(estimate, line)},
        curve=evidence.as_json(),
    )
    return Outcome(alignment=alignment, evidence=evidence)


def summary(estimate: LagEstimate, line: ClockLine) -> dict[str, Any]:
    """Returns the numbers of a clock model that was estimated, for JSON; `drift_parts` is 0 where
    the drift is a prior's."""
    half = NINETY * line.sigma_offset
    return {
        "offset": line.offset,
        "sigma": line.sigma_offset,
        "interval": [line.offset - half, line.offset + half],
        "level": 0.9,
        "confidence": estimate.confidence,
        "chance": estimate.chance,
        "correlation": estimate.correlation,
        "bins": estimate.bins,
        "drift": line.drift,
        "drift_sigma": line.sigma_drift,
        "drift_parts": len(line.parts),
    }


def _too_good(pair: Pair, sigma: float) -> tuple[Finding, ...]:
    """Warns where an offset is claimed to be known better than one frame."""
    times = pair.camera_record.device_frame_times
    period = float(np.median(np.diff(times))) / NANOSECONDS if len(times) > 1 else 0.0
    if sigma >= period:
        return ()
    return (
        Finding.of(
            "sigma-below-frame",
            f"the offset's σ of {sigma:.2g} s is below the {period:.2g} s between frames: "
            "implausibly small",
            value=sigma,
            fix="give the σ with which the two clocks were really compared",
        ),
    )


def _start_sigma(pair: Pair) -> float:
    """Computes the standard uncertainty of reading the film's start off its file [s]; 0 where the
    user gave it."""
    text = pair.camera_record.metadata.get(CAMERA, {}).get("start_sigma")
    if text is None:
        return 0.0
    try:
        return float(text)
    except ValueError:
        raise CorruptError(
            f"the camera's start_sigma is {text!r}",
            where=pair.camera.id,
            fix="ingest the camera file anew",
        ) from None
