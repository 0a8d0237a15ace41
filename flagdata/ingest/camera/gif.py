"""What the delays of a GIF say of its frames' rate: whole hundredths of a second, and nothing at all below two.

GIF89a counts delays in hundredths (section 23, Graphic Control Extension). Programs write 0 or 1 for "as fast as
possible"; browsers play both as 10, a demuxer plays 1 as 1: a camera of unknown rate would count as one of 100 Hz.
"""

from __future__ import annotations

import re
import struct
from fractions import Fraction
from pathlib import Path

import numpy as np

from flagdata.errors import TimeError
from flagdata.findings import Finding, Severity
from flagdata.ingest.camera.stamps import Timing

CONTAINER = "gif"
SHORTEST = 2
"""The shortest delay that is taken for a statement [hundredths of a second]."""
HALF = Fraction(1, 200)
"""What rounding to hundredths leaves open [s]."""
LOOKED_AT = 16 * 1024**2
"""Bytes of the file whose delays are read."""
# The extension's label, its size, flags, the delay, an index, the end; a picture or another extension follows.
_DELAY = re.compile(rb"\x21\xf9\x04.(..).\x00[\x21\x2c]", re.DOTALL)


def delays(path: Path) -> list[int]:
    """Delays that a GIF states, as far as `LOOKED_AT` [hundredths of a second]."""
    with path.open("rb") as stream:
        head = stream.read(LOOKED_AT)
    return [struct.unpack("<H", match)[0] for match in _DELAY.findall(head)]


def check(path: Path, timing: Timing, *, true_fps: float | None) -> list[Finding]:
    """What is open about the rate of a GIF with `timing`; nothing where the user named the camera's.

    Raises:
        TimeError: its delays say nothing, and no rate was named.
    """
    if true_fps is not None:
        return []
    period = timing.period * timing.tick
    stated = delays(path)
    if stated and float(np.median(stated)) < SHORTEST:
        raise TimeError(
            f'the GIF states delays of {float(np.median(stated)):g} hundredths of a second, which stands for "as fast '
            "as possible\": the camera's rate is not known",
            where=str(path),
            fix="give the rate at which the camera ran, --true-fps HZ, or the film that the GIF was made of",
        )
    if timing.variable or period.denominator > 100:
        return []  # delays of 3, 3 and 4 hundredths keep a mean
    low, high = float(1 / (period + HALF)), float(1 / (period - HALF))
    return [
        Finding(
            kind="gif-delays",
            severity=Severity.WARNING,
            value=float(1 / period),
            what=f"a GIF states times in hundredths of a second: delays of {float(period):g} s say that the rate is "
            f"between {low:.3g} and {high:.3g} Hz, and {float(1 / period):.4g} Hz is assumed",
            fix="if the camera's rate is known, give it: --true-fps HZ",
        )
    ]
