"""Intervals of posteriors that pile up at an end of the range that was simulated.

A network knows no value outside of the range that it learned from. A film of a stronger wind looks
to it like one of the strongest it knows, so that the draws pile up at the end of the range, and
their central interval ends there: of nine films of winds from 10.9 to 17.4 m/s that a network of 0
to 10 m/s accepted, no interval contained the wind. Such draws bound the quantity on one side only:

- *at least*: they pile up at the upper end; beyond it nothing is known, and no value is given;
- *at most*: the same at the lower end;
- *nothing*: at both ends; the quantity is not constrained.

A profile of a likelihood over a range says the same where it is flat towards an end (`of_profile`).

The bound is the end of the central interval on the other side, which holds with the level (1 +
level)/2.

An end of the range can be a limit of the quantity itself: no wind is slower than calm air, no cloth
weighs less than nothing, and an area weight that the user states lies where the user says. Draws
that pile up at such an end still bound the quantity on one side, since a central interval above 0
m/s would exclude calm air, but the interval then begins at the limit, nothing lies beyond it, and
the mean remains an estimate.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from flagdata.answer import Bound, Span

WITHIN = 0.03
"""Share of the range's width that counts as its end, fixed on 2026-11-27 before any film was judged
by the rule. A choice of this project, from no publication: draws of a uniform prior lie there with
a probability of 3 %."""
PILED = 0.10
"""Share of the draws in an end from which on they bound the quantity on one side only. Fixed with
`WITHIN`."""
LIMITS = {"wind_speed": (0.0, math.inf), "area_weight": (0.0, math.inf)}
"""Values that quantities can have at all; all others can have any."""


def limits_of(name: str) -> tuple[float, float]:
    """Values that a quantity can have at all."""
    return LIMITS.get(name, (-math.inf, math.inf))


def bound_of(places: NDArray[np.floating]) -> Bound | None:
    """Decides what draws bound.

    Args:
        places: (n,) of draws in their range, 0 at its lower and 1 at its upper end; those beyond it
            count as at it.
    """
    below, above = (
        float((places <= WITHIN).mean()) >= PILED,
        float((places >= 1 - WITHIN).mean()) >= PILED,
    )
    if below and above:
        return Bound.NOTHING
    return Bound.MOST if below else Bound.LEAST if above else None


def span(
    draws: NDArray[np.floating],
    places: NDArray[np.floating] | None,
    *,
    level: float,
    limits: tuple[float, float],
    assumed: tuple[float, float],
) -> Span:
    """Computes the interval of a posterior.

    Args:
        draws: (n,) of it.
        places: (m,) in their range of these draws, or of those that they are means of; None of a
            quantity whose range has no ends, as that of a normal prior.
        level: of a central interval.
        limits: values that the quantity can have at all.
        assumed: the range that was simulated.
    """
    low, high = (float(end) for end in np.quantile(draws, [(1 - level) / 2, (1 + level) / 2]))
    bound = None if places is None else bound_of(places)
    return _span_left(low, high, bound, level=level, limits=limits, assumed=assumed)


def of_profile(
    values: NDArray[np.floating],
    misfit: NDArray[np.floating],
    *,
    level: float,
    limits: tuple[float, float],
    larger: float = 1.0,
) -> Span:
    """Computes the interval of a profile: values whose misfit is less than the least by the
    quantile of χ² at the level. Where it still holds at an end of the values, the likelihood is
    flat towards that end, and only the other end is known.

    Args:
        values: (n,) ascending, the whole range that was looked at.
        misfit: (n,) −2 ln likelihood at each, infinite where there is no model.
        level: of an interval with two ends.
        limits: values that the quantity can have at all.
        larger: by how much standard errors are larger than the misfit says.
    """
    within = misfit - misfit.min() - (larger * float(ndtri((1 + level) / 2))) ** 2  # below 0 inside
    inside = np.flatnonzero(within <= 0)
    first, last = int(inside[0]), int(inside[-1])
    below, above = first == 0, last == len(values) - 1
    low = float(values[0]) if below else _crossing(values, within, first - 1)
    high = float(values[-1]) if above else _crossing(values, within, last)
    bound = (
        Bound.NOTHING
        if below and above
        else Bound.MOST
        if below
        else Bound.LEAST
        if above
        else None
    )
    return _span_left(
        low, high, bound, level=level, limits=limits, assumed=(float(values[0]), float(values[-1]))
    )


def _crossing(values: NDArray[np.floating], within: NDArray[np.floating], index: int) -> float:
    """Finds where a profile crosses zero behind an index: halfway if it is infinite on one side."""
    before, behind = float(within[index]), float(within[index + 1])
    share = before / (before - behind) if math.isfinite(before) and math.isfinite(behind) else 0.5
    return float(values[index] + share * (values[index + 1] - values[index]))


def _span_left(
    low: float,
    high: float,
    bound: Bound | None,
    *,
    level: float,
    limits: tuple[float, float],
    assumed: tuple[float, float],
) -> Span:
    """Computes the interval that is left of a central one where its ends are not known."""
    if bound is None:
        return Span(
            low=max(low, limits[0]),
            high=min(high, limits[1]),
            level=level,
            bound=None,
            estimated=True,
        )
    below, above = (
        limits[0] >= assumed[0],
        limits[1] <= assumed[1],
    )  # the range ends where the quantity does
    if bound is Bound.LEAST:
        return Span(low=low, high=limits[1], level=(1 + level) / 2, bound=bound, estimated=above)
    if bound is Bound.MOST:
        return Span(low=limits[0], high=high, level=(1 + level) / 2, bound=bound, estimated=below)
    return Span(low=limits[0], high=limits[1], level=1.0, bound=bound, estimated=below and above)
