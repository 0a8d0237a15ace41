"""What a count of time without a unit counts, by its steps: told where one unit alone is plausible.

A logger counts in steps that are round in its own unit: 1, 300 or 3600 s, 50 or 200 ms, 1/144 of a day. A step that is
round in two units (100 ms or 100 s, 60 s or 60 min) tells neither, and a line to paste leaves the unit open then.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flagdata.ingest.anemometer.instants import counted

DAYS = frozenset({"jd", "jday", "julian", "doy", "yday"})
"""Words of headings whose numbers are days."""
_SECONDS = (1, 300, 600, 900, 1800, 3600)
"""Whole steps [s] of loggers that are no usual step of another unit."""
_MILLISECONDS = (20, 25, 40, 50, 125, 200, 250)
"""Whole steps [ms] of loggers that are no usual step of another unit."""
_YEAR_AND_DAY = (10_001, 100_000)
"""Numbers of five digits that may be a year of two digits and the day of it."""
_SEVERAL = {
    5: ("s", "min", "ms"), 10: ("s", "min", "ms"), 15: ("s", "min"), 20: ("ms", "s", "min"), 30: ("s", "min"),
    60: ("s", "min"), 100: ("ms", "s", "us"), 500: ("ms", "us"), 1000: ("ms", "us"),
}  # fmt: skip
"""Steps of several units, which are named."""
_OF_A_DAY = (1, 2, 5, 10, 15, 20, 30, 60, 120, 300, 600, 900, 1200, 1800, 3600)
_OF_AN_HOUR = (1, 5, 10, 30, 60, 300, 600, 900, 1800)
"""Steps [s] that are usual where a count is in days or hours."""
_CLOSE = 0.002
"""Share of a step within which a fraction of a day or hour is the round one, as far as its digits tell."""
_VAGUE = 0.04
"""Share of a step that its last digit may be for it to tell a fraction of a day or hour."""
_SHORTEST, _FASTEST, _LARGEST = 2e-4, 0.3, 5.0
"""Steps [s] between which fractions that are of no day are of seconds, and that from which noisy ones may be of others.
"""
_LEAST_MILLISECONDS, _MOST_MILLISECONDS = 15.0, 5000.0
"""Noisy whole steps between which a count is of milliseconds: a microcontroller's loop is never quite as long."""
_NEAR, _NOISY = 0.03, 0.3
"""Share of a step by which a noisy one is still about another, and share of steps that are no multiple of the usual."""


@dataclass(frozen=True, kw_only=True)
class Likely:
    """What a count counts.

    Attributes:
        form: as `counted` names it, or that of a date; "" where nothing tells.
        words: for a message.
    """

    form: str
    words: str


def likely(value: NDArray[np.float64], *, digits: int, words: Collection[str] = ()) -> Likely:
    """The unit of a count that rises.

    Args:
        value: (n,) of the rows.
        digits: behind its points, at most.
        words: of its heading, lower-case.
    """
    if DAYS & set(words):
        return _sure("d", ", by its heading")
    steps = np.diff(value)
    steps = steps[np.isfinite(steps) & (steps > 0)]
    if not len(steps):
        return _open(())
    usual = float(np.median(steps))
    whole = bool(np.all(value[np.isfinite(value)] % 1 == 0))
    away = np.abs(steps / usual - np.round(steps / usual)) > (0.0 if whole else 2 * 10.0**-digits / usual) + 1e-6
    noisy = float(away.mean()) > _NOISY
    if not whole and usual < 1:
        return _of_fractions(usual, digits, noisy=noisy)
    if not whole:
        return _sure("s") if noisy and usual < _LARGEST else _open(())
    if noisy:
        about = (*_SECONDS, *(step for step, units in _SEVERAL.items() if "ms" not in units))
        minutes = any(abs(usual - step) <= max(1.0, _NEAR * step) for step in about)
        tells = _LEAST_MILLISECONDS <= usual < _MOST_MILLISECONDS and not minutes
        return _sure("ms") if tells else _open(())
    if usual == 1 and bool(
        np.all((value >= _YEAR_AND_DAY[0]) & (value < _YEAR_AND_DAY[1]) & (value % 1000 >= 1) & (value % 1000 <= 366))
    ):
        return Likely(form="%y%j", words="likely %y%j, a year of two digits and the day of it, else s")
    if usual in _SECONDS:
        return _sure("s")
    if usual >= _MOST_MILLISECONDS and usual % 86_400:
        return Likely(form="", words="ms of a slow logger, or us of a fast one")
    return _sure("ms") if usual in _MILLISECONDS else _open(_SEVERAL.get(int(usual), ()))


def _of_fractions(usual: float, digits: int, *, noisy: bool) -> Likely:
    """The unit of a count that grows by less than one."""
    of_day, of_hour = _round_in(usual, 86_400, _OF_A_DAY, digits), _round_in(usual, 3600, _OF_AN_HOUR, digits)
    if (usual < _SHORTEST and not of_day) or (of_day and noisy):
        return _open(("s", "d"))
    if of_day and not of_hour:
        return _sure("d", f", its steps being {of_day} s then")
    if of_hour or of_day:
        return _open(("s", "h", *(["d"] if of_day else [])))
    return _sure("s") if usual < _FASTEST or noisy else _open(())


def _round_in(usual: float, seconds: int, steps: Collection[int], digits: int) -> int:
    """The one of some steps [s] that a fraction of so many seconds is; 0 where it is none."""
    last = 10.0**-digits if 10.0**-digits <= _VAGUE * usual else 0.0
    near = (step for step in steps if abs(usual * seconds - step) <= _CLOSE * step + last * seconds)
    return min(near, key=lambda step: abs(usual * seconds - step), default=0)


def _sure(unit: str, why: str = "") -> Likely:
    return Likely(form=f"elapsed-{unit}", words=f"likely {unit}{why}")


def _open(units: Collection[str]) -> Likely:
    """What may be any of some units, or any unit at all."""
    listed = [f"elapsed-{unit}" for unit in units]
    if len(listed) > 1:
        return Likely(form="", words=f"it may be {', '.join(listed[:-1])} or {listed[-1]}")
    return Likely(form="", words=f"it may be {', '.join(counted.UNITS[:-1])} or {counted.UNITS[-1]}")
