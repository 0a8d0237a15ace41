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

from flagdata.ingest.anemometer.formats.serial_lines import Defect, Instrument, Sample, guess, read_lines, turned
from flagdata.ingest.anemometer.options import WindOptions
from flagdata.ingest.anemometer.reading import Reading
from flagdata.ingest.anemometer.sniffing import Guess, Head
from flagdata.ingest.anemometer.text.source import TextFile
from flagdata.schema import SampleFlag
from flagdata.signals import Sensor
from flagdata.units import UNITS

CHANNELS = (
    "wind_speed", "wind_direction", "wind_x", "wind_y", "wind_z", "sonic_temperature", "relative_humidity",
    "air_pressure",
)  # fmt: skip
_LINE = re.compile(r"(?:[A-Z][A-Z0-9]{0,2}[ ,:]+(?:-?\d+(?:\.\d+)?|nan)(?:[ ,;]+|$))++")
_PAIR = re.compile(r"([A-Z][A-Z0-9]{0,2})[ ,:]+(-?\d+(?:\.\d+)?|nan)")
_BEGINS = re.compile(r"S[23]?[ ,:]+-?\d")
_TAGS = frozenset(
    ("S", "S2", "S3", "D", "DV", "U", "V", "W", "T", "T1", "T2", "C", "H", "DP", "P", "TU", "AD", "AX", "AY", "AZ")
) | frozenset(("PI", "RO", "R", "MX", "MY", "MZ", "MD", "TD", "ID", "NW", "Q"))
_CODE = -99.0


class TriSonica:
    """Format "trisonica"."""

    name = "trisonica"
    about = "TriSonica Mini tagged lines, each after a computer's stamp"
    uses = frozenset({"zone", "azimuth"})

    def recognise(self, head: Head) -> Guess | None:
        """Lines of nothing but the instrument's tags and numbers."""
        return guess(head, self.name, "tags and values of a TriSonica (S, D, U, V, W, …)", parse)

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """Read the horizontal speed (S2, else of U and V, else S) and the direction."""
        instrument = Instrument(
            name="a TriSonica", channels=CHANNELS, parse=parse,
            sensor=Sensor(name="TriSonica Mini", resolution=0.01), described_by="the TriSonica Mini user manual",
        )  # fmt: skip
        reading = read_lines(source, instrument, zone_name=options.zone)
        return turned(reading, options.azimuth, where=str(source.path))


def parse(raw: str) -> Sample | Defect:
    """One line."""
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
    missing = math.nan
    u, v = known.get("U", missing), known.get("V", missing)
    speed = known.get("S2", math.hypot(u, v))
    if math.isnan(speed) and "S2" not in known:
        speed = known.get("S", known.get("S3", missing))
    return (
        speed,
        math.radians(known.get("D", missing)),
        u,
        v,
        known.get("W", missing),
        known.get("T", missing) + UNITS["degC"].offset,
        known.get("H", missing) * UNITS["%"].scale,
        known.get("P", missing) * UNITS["hPa"].scale,
    ), int(SampleFlag.OK)
