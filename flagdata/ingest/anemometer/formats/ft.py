"""Sentences of FT Technologies' acoustic wind sensors: `$WI,WVP=007.4,212,0*72`.

Source: FT Technologies, FT702LT manual, "WV Polar": speed in m/s, direction in degrees from the sensor's datum, and a
status that is 0 where the reading is good; the checksum is that of NMEA 0183, or "//" for none.
"""

from __future__ import annotations

import math
import re
from functools import partial

from flagdata.ingest.anemometer.formats.sentences import checksum
from flagdata.ingest.anemometer.formats.serial_lines import Defect, Instrument, InstrumentLines, Sample
from flagdata.schema import SampleFlag
from flagdata.signals import Sensor

_SENTENCE = re.compile(
    r"\$(?P<body>[A-Z0-9/]{2},WVP=(?P<speed>\d{1,3}(?:\.\d+)?),(?P<away>\d{1,3}),(?P<status>[0-9A-Z])[^*]*)"
    r"(?:\*(?P<sum>[0-9A-Fa-f]{2}|//))?\s*"
)
_BEGINS = re.compile(r"\$[A-Z0-9/]{2},WVP=")


def parse(raw: str) -> Sample | Defect:
    """One sentence."""
    match = _SENTENCE.fullmatch(raw)
    if match is None:
        return Defect.CUT if _BEGINS.match(raw) else Defect.OTHER
    if match["sum"] not in (None, "//") and checksum(match["body"]) != int(match["sum"], 16):
        return Defect.CHECKSUM
    values = {"wind_speed": float(match["speed"]), "wind_direction": math.radians(float(match["away"]))}
    return values, SampleFlag.OK if match["status"] == "0" else SampleFlag.SENSOR_FAULT


INSTRUMENT = Instrument(
    format="ft",
    about="FT Technologies WV sentences",
    name="an FT wind sensor",
    parse=parse,
    line="sentences of an FT wind sensor (WVP=)",
    channels=("wind_speed", "wind_direction"),
    sensor=Sensor(name="FT wind sensor", resolution=0.1),
    described_by="the manual of the FT702LT",
)
Ft = partial(InstrumentLines, INSTRUMENT)
