"""Angles of a camera as a user states them, as priors."""

from __future__ import annotations

import math
from dataclasses import replace

from flagdata.errors import UsageError
from flagdata.stated import Stated
from flagdata.tables import Range
from measure.calibrate.prior import DIRECTION, Normal, Uncertain


def known(about: Uncertain, stated: Stated, *, where: str) -> Uncertain:
    """An angle as the user states it [°], an exact value with the uncertainty of a direction.

    Raises:
        UsageError: an azimuth that is not between 0 and 180, or an elevation beyond 60.
    """
    least, most = (1.0, 179.0) if about.name == "azimuth" else (-60.0, 60.0)
    if stated.low < least or stated.high > most:
        raise UsageError(f"{stated.text}°", where=where, fix=f"give degrees from {least:g} to {most:g}, as in 70±7")
    low, high = math.radians(stated.low), math.radians(stated.high)
    if low < high:
        return replace(about, prior=Range(low=low, high=high), source="stated", limits=(low, high))
    sigma = math.radians(stated.sigma)
    # An azimuth is to the wind, whose direction is not better known than it is lined up.
    total = math.hypot(sigma, DIRECTION) if about.name == "azimuth" else max(sigma, math.radians(1.0))
    return replace(about, prior=Normal(mean=low, sigma=total), source="stated")
