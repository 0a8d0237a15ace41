"""Clock models that someone vouches for: by time stamps, or by a given offset."""

from __future__ import annotations

import math

import numpy as np

from flagdata.core.clock_model import ClockModel, Segment
from flagdata.errors import InputError, UsageError
from flagdata.record.signals import Instants
from flagdata.timebase import NANOSECONDS

QUARTZ = 3e-5
"""Standard uncertainty of the rate difference of two free-running quartz clocks [s/s]: ±50 ppm,
rectangular."""

PRIOR_DRIFT = 1e-4
"""Standard uncertainty of that rate before it is measured [s/s]: wide enough for poor oscillators
in the cold."""

_STEPS = (3600.0, 60.0, 10.0, 1.0, 0.1, 0.01, 0.001)  # s, that loggers cut their stamps to


def by_stamps(device: str, reference: str, *, start: int, end: int, sigma: float) -> ClockModel:
    """Takes both clocks as one, as their stamps say, to within `sigma` [s].

    Args:
        start, end: of what the device recorded, on its own clock [UTC ns].
        sigma: standard uncertainty of the difference of the two clocks, resolution of the stamps
            included.

    Raises:
        UsageError: σ is zero, negative or not finite: nobody can vouch for that.
    """
    return _declare(
        device, reference, method="stamps", start=start, end=end, offset=0.0, sigma=sigma
    )


def given(
    device: str, reference: str, *, start: int, end: int, offset: float, sigma: float
) -> ClockModel:
    """Declares that the device's clock plus `offset` [s], known to `sigma` [s], is the reference's.

    Raises:
        UsageError: an offset that is not finite, or a σ that is not positive and finite.
    """
    return _declare(
        device, reference, method="given", start=start, end=end, offset=offset, sigma=sigma
    )


def _declare(
    device: str, reference: str, *, method: str, start: int, end: int, offset: float, sigma: float
) -> ClockModel:
    if not math.isfinite(offset):
        raise UsageError(
            f"the clock offset {offset} s is not finite",
            where="offset",
            fix="give a finite number of seconds",
        )
    if not (math.isfinite(sigma) and sigma > 0):
        raise UsageError(
            f"the uncertainty {sigma} s of the clock offset is not a positive number",
            where="offset sigma",
            fix="state how well the two clocks were compared, e.g. 0.3 for whole seconds read off "
            "two displays",
        )
    segment = Segment(
        start=start,
        end=end,
        origin=(start + end) // 2,
        offset=offset,
        sigma_offset=sigma,
        sigma_drift=QUARTZ,
    )
    return ClockModel(
        device=device, reference=reference, method=method, confidence=1.0, segments=(segment,)
    )


def stamp_step(time: Instants) -> float:
    """Finds the step that stamps are cut or rounded to [s]: the coarsest of 1 h, 1 min, 10 s, … 1
    ms that divides all.

    0 where none does. A logger that writes exactly once a second looks like one that truncates to
    whole seconds.

    Raises:
        InputError: no stamps.
    """
    if len(time) == 0:
        raise InputError("there are no stamps to look at", fix="check the log's report")
    for step in _STEPS:
        if not np.any(time % round(step * NANOSECONDS)):
            return step
    return 0.0


def stamp_sigma(time: Instants) -> float:
    """Computes the standard uncertainty of stamps from their step alone [s]: step / √12,
    rectangular (JCGM 100:2008, 4.3.7)."""
    return stamp_step(time) / math.sqrt(12)
