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

from flagdata.ingest.anemometer.formats.serial_lines import Defect, Instrument, Sample, guess, read_lines, turned
from flagdata.ingest.anemometer.options import WindOptions
from flagdata.ingest.anemometer.reading import Reading
from flagdata.ingest.anemometer.sniffing import Guess, Head
from flagdata.ingest.anemometer.text.source import TextFile
from flagdata.schema import SampleFlag
from flagdata.signals import Sensor
from flagdata.units import UNITS

CHANNELS = ("wind_speed", "wind_direction", "wind_x", "wind_y", "wind_z", "sonic_temperature")
_TAIL = r"\s+(?P<sound>3[0-9]{2}\.\d{2})\s+(?P<t>-?\d{1,2}\.\d{2})\s*"
_POLAR = re.compile(r"\s*(?P<a>\d{1,2}\.\d{2})\s+(?P<b>\d{1,3}\.\d)\s+(?P<c>-?\d{1,2}\.\d)" + _TAIL)
_UVW = re.compile(r"\s*(?P<a>-?\d{1,2}\.\d{2})\s+(?P<b>-?\d{1,2}\.\d{2})\s+(?P<c>-?\d{1,2}\.\d{2})" + _TAIL)
_BEGINS = re.compile(r"\s*-?\d{1,2}\.\d{2}(?:\s+-?\d{1,3}(?:\.\d{0,2})?){0,4}\s*")


class Young:
    """Format "young"."""

    name = "young"
    about = "Young 81000 lines, each after a computer's stamp"
    uses = frozenset({"zone", "azimuth"})

    def recognise(self, head: Head) -> Guess | None:
        """Lines of five numbers with the decimals of the manual, the fourth a speed of sound."""
        return guess(head, self.name, "five numbers of a Young 81000, the fourth a speed of sound", parse)

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """Read either format."""
        # Manual, specification: ±1 % rms ±0.05 m/s up to 30 m/s; already standard deviations.
        instrument = Instrument(
            name="a Young 81000", channels=CHANNELS, parse=parse,
            sensor=Sensor(name="Young 81000", resolution=0.01, accuracy=0.05, accuracy_relative=0.01),
            described_by="the manual of the 81000",
        )  # fmt: skip
        reading = read_lines(source, instrument, zone_name=options.zone)
        return turned(reading, options.azimuth, where=str(source.path))


def parse(raw: str) -> Sample | Defect:
    """One line."""
    match = _POLAR.fullmatch(raw) or _UVW.fullmatch(raw)
    if match is None:
        return Defect.CUT if _BEGINS.fullmatch(raw) else Defect.OTHER
    a, b, c = (float(match[name]) for name in "abc")
    temperature = float(match["t"]) + UNITS["degC"].offset
    missing = math.nan
    if match.re is _POLAR:
        up = math.radians(c)
        horizontal, vertical = a * math.cos(up), a * math.sin(up)
        return (horizontal, math.radians(b), missing, missing, vertical, temperature), int(SampleFlag.OK)
    return (math.hypot(a, b), missing, a, b, c, temperature), int(SampleFlag.OK)
