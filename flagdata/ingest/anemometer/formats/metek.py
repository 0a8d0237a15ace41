"""METEK uSonic-2, uSonic-3 and USA-1 telegrams: "M:v=460 d=4 t=2186" or "M:x = 12 y = -30 z = 3 t = 2186".

Those of the newest instruments (uSonic-3 Class A) are "status;x;y;z;T;vel;dir;vels;dirs": 32 hexadecimal digits, m/s,
°C and degrees. Source: the project waggle-sonic, README, "Data sample", whose sample agrees with vel = √(x² + y²) and
dir = atan2(−x, −y), where from, clockwise from y; what the digits of the status mean was found nowhere.

Source: METEK, uSonic-2 user manual, 3.3.3 "Examples of different serial output formats", and USA-1 user manual, data
sets: v speed and x, y, z components in cm/s, d direction in degrees (where from, clockwise from the north mark), t
temperature in 0.01 °C; -9999 is no value; "H:" instead of "M:" while the heads are heated. A line "T:dd.mm.yy hh:mm:ss"
gives the instrument's own clock to the lines below it, which are stamped by it where no computer's stamp is there. x, y
and z are kept as written. Written by the manual; no log of such an
instrument was at hand.
"""

from __future__ import annotations

import math
import re
from functools import partial

from flagdata.ingest.anemometer.formats.serial_lines import Defect, Instrument, InstrumentLines, Sample, split_stamp
from flagdata.schema import SampleFlag
from flagdata.signals import Sensor
from flagdata.units import UNITS

_DATA = re.compile(r"(?P<kind>[A-Z]):(?P<pairs>(?:\s*[xyzvdtq]\s*=\s*-?\d+(?:\s*,)?)+)\s*")
_PAIR = re.compile(r"([xyzvdtq])\s*=\s*(-?\d+)")
_CLOCK = re.compile(r"T:\s*(\d{2})\.(\d{2})\.(\d{2})\s+(\d{2}:\d{2}:\d{2})\s*")
_BEGINS = re.compile(r"[A-Z]:\s*[xyzvdt]\s*=")
_NEWEST = re.compile(r"(?P<status>[0-9A-Fa-f]{32})(?P<values>(;\s*(-?\d+(\.\d+)?)?){4,8})\s*")
_NEWEST_BEGINS = re.compile(r"[0-9A-Fa-f]{32};")
_CENTI = 0.01
_NOTHING = -9999
_RIGHT = ("M", "H")


class _Clock:
    """Splits lines as `split_stamp` does, and stamps those without one by the last line of the instrument's clock."""

    def __init__(self) -> None:
        self._last = ""

    def __call__(self, line: str) -> tuple[str, str]:
        stamp, raw = split_stamp(line)
        match = _CLOCK.fullmatch(raw)
        if match is not None:
            day, month, year, time = match.groups()
            self._last = f"20{year}-{month}-{day}T{time}"
        return stamp or self._last, raw


def parse(raw: str) -> Sample | Defect:
    """One telegram. A kind other than M and H is the instrument's mark of a fault."""
    if _CLOCK.fullmatch(raw):
        return Defect.BESIDE
    newest = _NEWEST.fullmatch(raw)
    if newest is not None:
        return _newest([float(cell) if cell.strip() else math.nan for cell in newest["values"].split(";")[1:]])
    match = _DATA.fullmatch(raw)
    if match is None:
        return Defect.CUT if _BEGINS.match(raw) or _NEWEST_BEGINS.match(raw) else Defect.OTHER
    values = {name: float(text) for name, text in _PAIR.findall(match["pairs"])}
    if not ({"v", "d"} <= set(values) or {"x", "y"} <= set(values)):
        return Defect.CUT
    known = {name: value * _CENTI if value != _NOTHING else math.nan for name, value in values.items()}
    degrees = values["d"] if values.get("d", _NOTHING) != _NOTHING else math.nan
    sample = _sample(known, known.get("v"), degrees, known.get("t", math.nan))
    return sample, SampleFlag.OK if match["kind"] in _RIGHT else SampleFlag.SENSOR_FAULT


def _newest(values: list[float]) -> Sample | Defect:
    """A telegram with semicolons: x, y, z, T and, where they are sent, speed and direction."""
    if len(values) not in (4, 6, 8):
        return Defect.CUT
    speed, degrees = values[4:6] if len(values) > 4 else (None, math.nan)
    return _sample(dict(zip("xyz", values, strict=False)), speed, degrees, values[3]), SampleFlag.OK


def _sample(axes: dict[str, float], speed: float | None, degrees: float, celsius: float) -> dict[str, float]:
    x, y, z = (axes.get(name, math.nan) for name in "xyz")
    return {
        "wind_speed": math.hypot(x, y) if speed is None else speed,
        "wind_direction": math.radians(degrees),
        "wind_x": x,
        "wind_y": y,
        "wind_z": z,
        "sonic_temperature": celsius + UNITS["degC"].offset,
    }


INSTRUMENT = Instrument(
    format="metek",
    about="METEK uSonic and USA-1 telegrams",
    name="a METEK sonic",
    parse=parse,
    splits=_Clock,
    line="METEK telegrams (M:x = …, M:v=… or status;x;y;z;T)",
    channels=("wind_speed", "wind_direction", "wind_x", "wind_y", "wind_z", "sonic_temperature"),
    sensor=Sensor(name="METEK sonic", resolution=0.01),
    described_by="METEK's manuals of uSonic-2 and USA-1, or a published sample",
)
Metek = partial(InstrumentLines, INSTRUMENT)
