"""R. M. Young 81000: five numbers a line, "speed azimuth elevation" or "U V W", then speed of sound and temperature.

Source: R. M. Young Company, Model 81000 Ultrasonic Anemometer manual (81000-90), 3.0 "Initial checkout" (speed m/s with
two decimals, azimuth and elevation deg with one, speed of sound m/s, sonic temperature °C) and 6.8 "Serial output
format". The two formats differ by their decimals. Azimuth is clockwise from the side marked N, where the wind
comes from. Speed is the length of the whole vector: its horizontal part is speed × cos(elevation). U, V and W are kept
as written: their orientation is a setting. NMEA output is read by the format nmea. Written by the manual; no log of
such an instrument was at hand.
"""

from __future__ import annotations

import math
import re
from functools import partial

from flagdata.ingest.anemometer.formats.serial_lines import Defect, Instrument, InstrumentLines, Sample
from flagdata.schema import SampleFlag
from flagdata.signals import Sensor
from flagdata.units import UNITS

_TAIL = r"\s+(?P<sound>3[0-9]{2}\.\d{2})\s+(?P<t>-?\d{1,2}\.\d{2})\s*"
_POLAR = re.compile(r"\s*(?P<a>\d{1,2}\.\d{2})\s+(?P<b>\d{1,3}\.\d)\s+(?P<c>-?\d{1,2}\.\d)" + _TAIL)
_UVW = re.compile(r"\s*(?P<a>-?\d{1,2}\.\d{2})\s+(?P<b>-?\d{1,2}\.\d{2})\s+(?P<c>-?\d{1,2}\.\d{2})" + _TAIL)
_BEGINS = re.compile(r"\s*-?\d{1,2}\.\d{2}(?:\s+-?\d{1,3}(?:\.\d{0,2})?){0,4}\s*")


def parse(raw: str) -> Sample | Defect:
    """One line."""
    match = _POLAR.fullmatch(raw) or _UVW.fullmatch(raw)
    if match is None:
        return Defect.CUT if _BEGINS.fullmatch(raw) else Defect.OTHER
    a, b, c = (float(match[name]) for name in "abc")
    values = {"sonic_temperature": float(match["t"]) + UNITS["degC"].offset}
    if match.re is _POLAR:
        up = math.radians(c)
        values |= {"wind_speed": a * math.cos(up), "wind_direction": math.radians(b), "wind_z": a * math.sin(up)}
    else:
        values |= {"wind_speed": math.hypot(a, b), "wind_x": a, "wind_y": b, "wind_z": c}
    return values, SampleFlag.OK


INSTRUMENT = Instrument(
    format="young",
    about="Young 81000 lines",
    name="a Young 81000",
    parse=parse,
    line="five numbers of a Young 81000, the fourth a speed of sound",
    channels=("wind_speed", "wind_direction", "wind_x", "wind_y", "wind_z", "sonic_temperature"),
    # Manual, specification: ±1 % rms ±0.05 m/s up to 30 m/s; already standard deviations.
    sensor=Sensor(name="Young 81000", resolution=0.01, accuracy=0.05, accuracy_relative=0.01),
    described_by="the manual of the 81000",
)
Young = partial(InstrumentLines, INSTRUMENT)
