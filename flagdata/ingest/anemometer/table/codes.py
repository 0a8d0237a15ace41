"""Codes that stand for "no value" among the numbers of a log, recognised as far from all others, and one value alone.

A wind changes from reading to reading; a code is written the same each time. What no log can mean as a wind is a code
wherever it stands; what a wind might be, such as 99 m/s, only where it is at least twice everything else.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flagdata.findings import Finding, Severity

_NINES = (99_999.0, 9999.9, 9999.0, 999.99, 999.9, 999.0, 99.99, 99.9, 99.0)
_OFTEN = (
    8888.0, 7999.0, 6999.0, 888.8, 888.0, 88.8, 65_535.0, 6553.5, 655.35, 65_534.0, 32_767.0, 3276.7, 327.67, 255.0,
)  # fmt: skip
"""Eights, codes of Campbell's loggers, and the largest numbers of 16 and 8 bits, also scaled: codes where they come
again and again, since a slow unit may reach them once."""
_AGAIN = 3
_ENDLESS = 1e5
"""No speed in any unit is as large; codes such as 1e20 are."""
_OTHERS = 10
"""Other values that show how fast the wind is."""
_FEW = 2
"""Different codes of one column."""


def speeds(values: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(n,) which speeds are a code for no value that nobody named.

    Args:
        values: (n,) as written, NaN where missing.
    """
    found = below_zero(values)
    endless = np.isfinite(values) & (values >= _ENDLESS)
    if len(np.unique(values[endless])) == 1 < endless.sum() < np.isfinite(values).sum() / 2:
        found |= endless
    for code in (*_NINES, *_OFTEN):
        here = values == code
        if code in _OFTEN and here.sum() < _AGAIN:
            continue
        others = values[np.isfinite(values) & ~here & ~found]
        if here.any() and len(others) >= _OTHERS and 2 * float(others.max()) < code:
            found |= here
    return found


def below_zero(values: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(n,) which values are a code below zero: the only one there, again and again, from -1 down, among ten others.

    Components, and speeds about a zero that is off, have different values below zero.
    """
    below = np.isfinite(values) & (values < 0)
    others = values[np.isfinite(values) & ~below]
    codes = np.unique(values[below])
    few = 0 < len(codes) <= (_FEW if len(codes) and codes.max() <= -88 else 1)
    alone = few and codes.max() <= -1 and below.sum() > len(codes) and len(others) >= _OTHERS
    return below if alone else np.zeros(len(values), dtype=bool)


def within_a_turn(
    values: NDArray[np.float64], *, beside: NDArray[np.float64] | None = None
) -> NDArray[np.bool_]:  # fmt: skip
    """(n,) which directions are a code that might be an angle: -1 among angles to 360°, 99 among tens of degrees.

    Where north is 360 in steps of ten degrees, 0 is calm air (WMO-No. 306, code table 0877).

    Args:
        values: (n,) as written, NaN where missing.
        beside: of all rows of the file, where these are of one of its sites.
    """
    found = np.zeros(len(values), dtype=bool)
    known = np.isfinite(values)
    if known.any() and float(values[known].max()) > 180:
        found = below_zero(values)
    rest = _angles_among(values if beside is None else beside)
    if len(rest) >= _OTHERS and float(rest.min()) >= 0 and float(rest.max()) <= 36 and bool(np.all(rest % 1 == 0)):
        found |= values == 99
    for north, step in ((360.0, 10.0), (36.0, 1.0)):
        if len(rest) >= _OTHERS and float(rest.max()) == north and bool(np.all(rest % step == 0)):
            found |= values == 0
    return found


def _angles_among(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return values[np.isfinite(values) & (values != 99)]


def north_or_calm(
    values: NDArray[np.float64], *, beside: NDArray[np.float64] | None = None
) -> NDArray[np.bool_]:  # fmt: skip
    """(n,) which directions are 0 where all others are whole tens and none is 360: north, or a code for calm air.

    Args:
        values, beside: as in `within_a_turn`.
    """
    rest = _angles_among(values if beside is None else beside)
    others = rest[rest != 0]
    for north, step in ((360.0, 10.0), (36.0, 1.0)):
        coarse = len(others) >= _OTHERS and float(others.min()) > 0 and bool(np.all(others % step == 0))
        if coarse and north / 2 < float(others.max()) < north:
            return values == 0
    return np.zeros(len(values), dtype=bool)


def may_be_calm(channel: str, zero: NDArray[np.bool_], line: NDArray[np.int64]) -> tuple[Finding, ...]:
    """The finding about directions of `north_or_calm` at which there is a wind; none where there are none."""
    if not zero.any():
        return ()
    what = (
        f"{int(zero.sum())} values of {channel} are 0, all others are whole tens of degrees and none is 360: taken as "
        "north; stations that write directions in tens have 0 for calm or variable air, and 360 for north"
    )
    return (Finding(
        kind="north-or-calm", severity=Severity.WARNING, count=int(zero.sum()), where=f"line {line[zero][0]}",
        what=what, fix="see what the station's description says of 0",
    ),)  # fmt: skip


def report(
    channel: str, values: NDArray[np.float64], found: NDArray[np.bool_], line: NDArray[np.int64]
) -> tuple[Finding, ...]:
    """The finding about values that were taken for a code; none where there are none."""
    if not found.any():
        return ()
    listed = ", ".join(f"{value:g}" for value in np.unique(values[found]))
    why = "no angle" if channel.endswith(("direction", "magnetic")) else "at least twice all others, or below zero"
    what = f"{int(found.sum())} values of {channel} are {listed}, {why}: taken as a code for no value"
    return (Finding(
        kind="code-for-missing", severity=Severity.WARNING, count=int(found.sum()), where=f"line {line[found][0]}",
        what=what, fix="name the code in a recipe's [file] missing",
    ),)  # fmt: skip
