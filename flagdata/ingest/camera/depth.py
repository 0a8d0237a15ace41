"""The white of grays that are stored in 16 bits, by the bits used: cameras of 10, 12 or 14 bits
store theirs so."""

from __future__ import annotations

from flagdata.core.findings import Finding

_DEPTHS = (10, 12, 14, 16)
"""Bits of gray of the cameras that store it in 16."""
WHITE = float(2 ** _DEPTHS[-1] - 1)
"""Of pictures that use all 16 bits."""


def fills(brightest: int) -> bool:
    """Checks whether a gray shows that all 16 bits are used: no brighter one can change what
    `white` says."""
    return brightest >> _DEPTHS[-2] > 0


def white(brightest: int, *, which: str, otherwise: str = "") -> tuple[float, tuple[Finding, ...]]:
    """Finds the gray that counts as white, and reports it where it is not that of 16 bits.

    Args:
        brightest: gray of the pictures that were looked at.
        which: pictures these are, for people.
        otherwise: what else to do, where the values may be no grays.
    """
    bits = next(bits for bits in _DEPTHS if not brightest >> bits)
    if not brightest or bits == _DEPTHS[-1]:
        return WHITE, ()
    most = 2**bits - 1
    finding = Finding.of(
        "depth-by-content",
        f"no pixel of {which}, of 16 bits, is brighter than {brightest}: they are read as gray of "
        f"{bits} bits, 0 "
        f"to {most}",
        value=float(bits),
        fix=f"if they are only dark, convert them to 8 bits first{otherwise}",
    )
    return float(most), (finding,)
