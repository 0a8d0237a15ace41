"""What the numbers of a column of directions are in, by its heading and by themselves, and what is in doubt."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flagdata import compass
from flagdata.ingest.anemometer.winds import codes
from flagdata.ingest.anemometer.words.headings import Heading, fits, words_of
from flagdata.ingest.anemometer.words.wind_words import COURSES

_TURN = (-181.0, 361.0)
_GON, _MILS = 401.0, 6401.0
_FASTEST = 100.0
"""Number that no speed of a log reaches in any unit, by which angles are told [of whatever unit]."""
_EIGHT = 8
"""The highest number of eight sectors that are counted from 1."""
_FEW = 3
"""Different values from which a column with a stated unit shows that it is in another."""
_DEGREES = frozenset({"d", "dg", "dgr", "gr", "grd", "º", "?", "\ufffd"})
"""What stands for degrees behind a direction, and for nothing or something else elsewhere."""


@dataclass(frozen=True, kw_only=True)
class Judged:
    """What a column of directions is.

    Attributes:
        unit: as `flagdata.units` spells it; `None` where it is not read.
        told: how the unit is known.
        left_out: why it is not read, as the rest of a sentence that begins with the column; "" where it is, or where
            its heading states a unit that is no angle's.
        may_be: units it may be in, of one that is left out and of one that is read with a doubt.
        doubt: what speaks against the stated unit, as `left_out`.
    """

    unit: str | None = None
    told: str = ""
    left_out: str = ""
    may_be: tuple[str, ...] = ()
    doubt: str = ""


def judge(heading: Heading, value: NDArray[np.float64], channel: str) -> Judged:
    """The unit of a direction.

    Args:
        heading: of the column.
        value: (n,) its numbers, NaN where there is none; of points of the compass, their degrees.
        channel: that it is of.
    """
    if heading.unit is not None and not fits(channel, heading.unit):
        return Judged()
    if heading.unit in compass.BY_UNIT:
        return Judged(unit=heading.unit, told="as points of the compass, 22.5° apart")
    if heading.strange and heading.strange.lower() not in _DEGREES:
        return Judged(left_out=f"is in {heading.strange!r}, which is no direction clockwise from north: left out")
    if holds_marks(heading, value):
        return Judged(left_out="holds nothing but 0 and 1, as a mark does, no angles: left out")
    stated = f"in {heading.unit} by its heading"
    if heading.unit in ("gon", "mil", "0.1 deg", "0.01 deg"):
        return Judged(unit=heading.unit, told=stated)
    known = value[np.isfinite(value)]
    coded = codes.angles(known)
    known = known[~coded] if not bool(coded.all()) else known
    low, high = (float(known.min()), float(known.max())) if len(known) else (np.nan, np.nan)
    if not len(known) or high > _TURN[1] or low < _TURN[0]:
        return _beyond(low, high)
    if high - low > _TURN[1]:
        return Judged(left_out=f"runs over more than a turn, {low:g} to {high:g}, as a difference does: left out")
    whole, several = bool(np.all(known % 1 == 0)), len(np.unique(known)) > _FEW
    if heading.unit in (None, "deg") and low >= 0 and high <= 16 and whole and several:
        eight = high <= _EIGHT
        counted = ("sixteenths",) if high < 16 else ()  # of sixteen that are counted from 0 none is 16
        return Judged(
            left_out=f"holds sectors of the compass ({low:g} to {high:g}), no angle; left out; they may be the "
            f"{'eight or the ' if eight else ''}sixteen from north on, counted from 0, or tens of degrees; where they "
            "begin elsewhere, a recipe's offset turns them",
            may_be=("45 deg", *counted, "10 deg", "deg") if eight else (*counted, "10 deg", "deg"),
        )
    if heading.misstated:
        return _misstated(heading.misstated, low, high)
    north = channel == "wind_direction"  # a boat writes the angle from its bow in degrees
    if heading.unit is None and 0 < high <= 6.3 and low >= -3.2 and (several or not whole):
        return Judged(left_out="may be in degrees or radians: left out", may_be=("rad", "deg"))
    if heading.unit is None and north and 0 <= low < high <= 36 and whole:
        return Judged(left_out="may be in degrees or in tens of degrees: left out", may_be=("10 deg", "deg"))
    unit, told = heading.unit or "deg", stated if heading.unit else f"in degrees by its values, up to {high:g}"
    if heading.unit is None and north and 0 < low == high <= 36 and whole:
        doubt = f"holds nothing but {high:g}, taken as degrees: it may be a sixteenth of the compass or tens of degrees"
        return Judged(unit=unit, told=told, may_be=("sixteenths", "10 deg"), doubt=doubt)
    if unit == "deg" and north and several and low >= 0 and high <= 36 and whole:
        doubt = f"is stated in degrees, but holds whole numbers up to {high:g}: likely tens of degrees"
        return Judged(unit=unit, told=told, may_be=("10 deg",), doubt=doubt)
    if unit == "deg" and several and low >= -3.2 and 0 < high <= 6.3 and not whole:
        doubt = f"is stated in degrees, but holds numbers from {low:g} to {high:g}: likely radians"
        return Judged(unit=unit, told=told, may_be=("rad",), doubt=doubt)
    if north and not heading.towards and set(words_of(heading.name)) & COURSES:
        doubt = "is taken as where the wind comes from"
        return Judged(unit=unit, told=told, doubt=doubt)
    return Judged(unit=unit, told=told)


def holds_marks(heading: Heading, value: NDArray[np.float64]) -> bool:
    """Whether a column holds 0 and 1 and nothing else, as a mark does, below a heading that states no unit.

    Args:
        value: (n,) its numbers, NaN where there is none.
    """
    return heading.unit is None and set(np.unique(value[np.isfinite(value)]).tolist()) == {0.0, 1.0}


def _misstated(stated: str, low: float, high: float) -> Judged:
    """A direction whose heading states the unit of a speed: in degrees where its numbers are no speeds."""
    if low >= 0 and high > _FASTEST:
        doubt = f"says a direction, but in {stated}, a unit of speed: taken as degrees by its values, up to {high:g}"
        return Judged(unit="deg", told=f"in degrees by its values, up to {high:g}", may_be=("deg",), doubt=doubt)
    left_out = f"says a direction, but in {stated}, a unit of speed, and its values, {low:g} to {high:g}, do not tell "
    return Judged(left_out=f"{left_out}which it is: left out", may_be=("deg",))


def _beyond(low: float, high: float) -> Judged:
    """What angles beyond a turn of 360° may be."""
    left_out = f"holds no angle: {low:g} to {high:g}; left out"
    if low >= 0 and high < _GON:
        return Judged(left_out=f"{left_out}; up to 400 it may be in gon", may_be=("gon",))
    if low >= 0 and 1100 < high <= 3601:
        return Judged(left_out=f"{left_out}; up to 3600 it may be in tenths of a degree", may_be=("0.1 deg",))
    if low >= 0 and 3601 < high <= _MILS:
        return Judged(left_out=f"{left_out}; up to 6400 it may be in mils", may_be=("mil",))
    if low >= 0 and high <= 4096:
        left_out += "; it may be what a converter of 10 or 12 bits reads: a recipe gives scale and offset of its vane"
    return Judged(left_out=left_out)
