"""Anemoment TriSonica Mini: lines of tags and values, "S  00.08 S2 00.07 D  245 U  00.06 V  00.03 W  00.05 T  21.40".

Source: Anemoment (LI-COR), TriSonica Mini User Manual (July 2022), "Output data": tags S (wind speed), S2 and S3 (in
two and three dimensions), D and DV (direction, clockwise from the north mark, and its elevation), U, V, W, T [°C], C
(speed of sound), H [%], DP, P [mbar], PI, RO, MD and others; m/s. Tags may be switched off one by one; values of -99
and below are codes for "no value". Tags can be renamed: where one comes twice (P for the pressure and the pitch, D
for the wind and the compass), the first is the one of the manual's order, in which the wind and the air go before the
attitude. U and V are kept as written: their axes are a setting. Written by the manual and examples of lines; no log
of such an instrument was at hand.
"""

from __future__ import annotations

import math
import re
from functools import partial

from flagdata.ingest.anemometer.formats.serial_lines import Defect, Instrument, InstrumentLines, Sample
from flagdata.schema import SampleFlag
from flagdata.signals import Sensor
from flagdata.units import UNITS

_CHANNELS = {
    "U": ("wind_x", "m/s"),
    "V": ("wind_y", "m/s"),
    "W": ("wind_z", "m/s"),
    "T": ("sonic_temperature", "degC"),
    "H": ("relative_humidity", "%"),
    "P": ("air_pressure", "hPa"),
}
_LINE = re.compile(r"(?:[A-Z][A-Z0-9]{0,2}[ ,:]+(?:-?\d+(?:\.\d+)?|nan)(?:[ ,;]+|$))++")
_PAIR = re.compile(r"([A-Z][A-Z0-9]{0,2})[ ,:]+(-?\d+(?:\.\d+)?|nan)")
_BEGINS = re.compile(r"S[23]?[ ,:]+-?\d")
_TAGS = frozenset(
    ("S", "S2", "S3", "D", "DV", "U", "V", "W", "T", "T1", "T2", "C", "H", "DP", "P", "TU", "AD", "AX", "AY", "AZ")
) | frozenset(("PI", "RO", "R", "MX", "MY", "MZ", "MD", "TD", "ID", "NW", "Q"))
_CODE = -99.0


def parse(raw: str) -> Sample | Defect:
    """One line: of its speeds the horizontal one, S2, else of U and V, else S."""
    text = raw.strip()
    if not _LINE.fullmatch(text):
        return Defect.CUT if _BEGINS.match(text) else Defect.OTHER
    values: dict[str, float] = {}
    for tag, number in _PAIR.findall(text):
        values.setdefault(tag, float(number))
    wind = {"S", "S2", "S3"} & set(values) or {"U", "V"} <= set(values)
    if len(values) < 3 or not wind or not set(values) <= _TAGS:
        return Defect.OTHER
    known = {tag: number if number > _CODE else math.nan for tag, number in values.items()}
    speed = known.get("S2", math.hypot(known.get("U", math.nan), known.get("V", math.nan)))
    if math.isnan(speed) and "S2" not in known:
        speed = known.get("S", known.get("S3", math.nan))
    sample = {"wind_speed": speed, "wind_direction": math.radians(known.get("D", math.nan))}
    for tag, (name, unit) in _CHANNELS.items():
        sample[name] = known.get(tag, math.nan) * UNITS[unit].scale + UNITS[unit].offset
    return sample, SampleFlag.OK


INSTRUMENT = Instrument(
    format="trisonica",
    about="TriSonica Mini tagged lines",
    name="a TriSonica",
    parse=parse,
    line="tags and values of a TriSonica (S, D, U, V, W, …)",
    channels=("wind_speed", "wind_direction", *(name for name, _ in _CHANNELS.values())),
    sensor=Sensor(name="TriSonica Mini", resolution=0.01),
    described_by="the TriSonica Mini user manual",
)
TriSonica = partial(InstrumentLines, INSTRUMENT)
