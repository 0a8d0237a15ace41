"""How quantities are written: digits by the interval's width, units everywhere, real minus signs.

Digits follow the Particle Data Group's rule ("Review of Particle Physics", Introduction, section
5.3): an uncertainty keeps two digits if its three leading digits lie below 355, and one above (from
950 on it is rounded up to 1000); the value and both ends of the interval are rounded to the same
place; never to more than four significant digits, since an interval from a few values can be narrow
by chance.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from flagdata.answer import Bound, Quantity

MINUS = "\N{MINUS SIGN}"
NONE = "\N{EM DASH}"
_DIGITS = 3  # of a number that comes without an uncertainty
_MOST_DIGITS = 4  # of a number that comes with one
_WIDEST = 1e5  # from here on, and below 1e-3, powers of ten
_NARROWEST = 1e-3
_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_THOUSANDTHS = {"m": "mm", "s": "ms"}


@dataclass(frozen=True, kw_only=True)
class Display:
    """How the numbers of a column or axis are shown: `shown = value · factor`, in `unit`."""

    factor: float
    unit: str

    @property
    def suffix(self) -> str:
        """What follows a number."""
        return f" {self.unit}" if self.unit not in ("", "1") else ""


def display(values: Iterable[float], unit: str) -> Display:
    """Millimetres and milliseconds where every value is below 0.1 m or s; the unit as it is
    elsewhere."""
    largest = max((abs(v) for v in values if math.isfinite(v)), default=0.0)
    if unit in _THOUSANDTHS and 0 < largest < 0.1:
        return Display(factor=1e3, unit=_THOUSANDTHS[unit])
    return Display(factor=1.0, unit=unit)


def known(estimate: Quantity | None) -> bool:
    """Returns whether there is anything to show."""
    return estimate is not None and not math.isnan(estimate.point)


def decimals(uncertainty: float) -> int:
    """Decimals that an uncertainty justifies; negative to the left of the point."""
    exponent = math.floor(math.log10(uncertainty))
    leading = uncertainty / 10.0**exponent
    return 1 - exponent if leading < 3.55 else -exponent


def number(value: float | None, *, digits: int = _DIGITS) -> str:
    """Formats a number without an uncertainty, to `digits` significant digits."""
    if value is None or math.isnan(value):
        return NONE
    if value == 0 or math.isinf(value):
        return _round_fixed(value, 0)
    exponent = math.floor(math.log10(float(f"{abs(value):.{digits - 1}e}")))
    if _NARROWEST <= abs(value) < _WIDEST:
        return _round_fixed(value, digits - 1 - exponent)
    return f"{_round_fixed(value / 10.0**exponent, digits - 1)} × {_power(exponent)}"


def probability(value: float | None) -> str:
    """Formats a p-value: two digits, one below 0.001."""
    if value is None or math.isnan(value):
        return NONE
    return number(value, digits=2 if value >= 1e-3 else 1)


def estimate_text(estimate: Quantity | None, *, display_as: Display | None = None) -> str:
    """Formats `6.2 m/s [5.7, 6.8]` or `at least 5.7 m/s`, without the level, which a table's
    caption or `with_level` states."""
    return " ".join(estimate_parts(estimate, display_as=display_as)).rstrip()


def estimate_parts(
    estimate: Quantity | None, *, display_as: Display | None = None
) -> tuple[str, str]:
    """Formats `6.2 m/s` and `[5.7, 6.8]`; the second is empty where there is no interval."""
    if estimate is None or not known(estimate):
        return NONE, ""
    if estimate.bound is not None:
        return _bound_words(estimate, display_as), ""
    inside = display_as or display((estimate.point, estimate.low, estimate.high), estimate.unit)
    value, low, high = (inside.factor * v for v in (estimate.point, estimate.low, estimate.high))
    half = (high - low) / 2
    if math.isnan(half):
        return f"{number(value)}{inside.suffix}", ""
    if not 0 < half < math.inf:
        return f"{number(value)}{inside.suffix}", f"[{number(low)}, {number(high)}]"
    largest = max(abs(value), abs(low), abs(high))
    rounded_to = min(decimals(half), _MOST_DIGITS - 1 - math.floor(math.log10(largest)))
    power = ""
    if not (_NARROWEST <= largest < _WIDEST):
        exponent = math.floor(math.log10(largest))
        value, low, high = (v / 10.0**exponent for v in (value, low, high))
        rounded_to += exponent
        power = f" × {_power(exponent)}"
    ends = f"[{_round_fixed(low, rounded_to)}{power}, {_round_fixed(high, rounded_to)}{power}]"
    return f"{_round_fixed(value, rounded_to)}{power}{inside.suffix}", ends


def _bound_words(estimate: Quantity, display_as: Display | None) -> str:
    """Formats `at least 900 N/m²`."""
    if estimate.bound is Bound.NOTHING:
        return "not determined"
    inside = display_as or display((estimate.point,), estimate.unit)
    return estimate.span.word(lambda end: number(inside.factor * end, digits=2), inside.suffix)


def with_level(estimate: Quantity) -> str:
    """Formats `6.2 m/s [5.7, 6.8] 90 %`."""
    if not known(estimate):
        return NONE
    if estimate.bound is Bound.NOTHING:
        return estimate_text(estimate)
    return f"{estimate_text(estimate)} {level_text(estimate.level)}"


def in_errors(value: float | None) -> str:
    """Formats a number of standard errors: one decimal, none from 10 on."""
    if value is None or math.isnan(value):
        return NONE
    return _round_fixed(value, 0 if abs(value) >= 9.95 else 1)


def share(value: float | None) -> str:
    """Formats a fraction, two decimals."""
    return NONE if value is None or math.isnan(value) else _round_fixed(value, 2)


def level_text(level: float) -> str:
    """Formats `90 %`."""
    return f"{100 * level:g} %"


def with_error(value: float, error: float) -> str:
    """Formats `12.3 ± 0.4`."""
    if math.isnan(value):
        return NONE
    if not 0 < error < math.inf:
        return number(value)
    rounded_to = decimals(error)
    return f"{_round_fixed(value, rounded_to)} ± {_round_fixed(error, rounded_to)}"


def _power(exponent: int) -> str:
    return f"10{str(exponent).translate(_SUPERSCRIPTS)}"


def _round_fixed(value: float, places: int) -> str:
    """Rounds `value` to `places` decimals (negative: to tens, hundreds), zero without a sign."""
    if math.isinf(value):
        return f"{MINUS if value < 0 else ''}∞"
    text = f"{round(value, places) + 0.0:.{max(places, 0)}f}"
    return text.replace("-", MINUS)
