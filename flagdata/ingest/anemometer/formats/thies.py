"""Telegrams of Thies' ultrasonic anemometers, framed by STX and ETX, behind a computer's stamp.

    <STX>02.4 213*cc<ETX>                                   1, VD: speed, direction
    <STX>02.4 213 +21.5 00*cc<ETX>                          2, VDT: and temperature, status
    <STX>002.4 213 +21.5 M 00*cc<ETX>                       3, V4DT: and the unit, of K, N, M and S
    <STX>02.4 00.3 213 007 +21.5 +00.1 00*cc<ETX>           5: each with its standard deviation behind it

Source: Thies Clima, Ultrasonic Anemometer 2D, manual 021537/06/10, 7.4.3 and 11, and Technical Manual, 6.2: the
checksum is the exclusive or of what stands between STX and "*"; F stands in place of digits where there is no value.
The unit of speeds is a setting (command OS), which only telegram 3 states. Written by the manuals; no real log was at
hand.
"""

from __future__ import annotations

import math
import re
from functools import partial

from flagdata.ingest.anemometer.formats.sentences import checksum
from flagdata.ingest.anemometer.formats.serial_lines import Defect, Instrument, InstrumentLines, Sample
from flagdata.schema import SampleFlag
from flagdata.signals import Sensor
from flagdata.units import UNITS

_SPEED, _ANGLE, _TEMPERATURE = r"(?:\d{2,3}\.\d|F{2,3}\.F)", r"(?:\d{3}|FFF)", r"[+-]?(?:\d{2,3}\.\d|F{2,3}\.F)"
_TELEGRAM = re.compile(
    r"(?:\x02|<STX>)?\s?(?P<body>"
    rf"(?P<speed>{_SPEED}) (?:(?P<deviation>{_SPEED}) )?(?P<away>{_ANGLE})(?: {_ANGLE})?"
    rf"(?: (?P<temperature>{_TEMPERATURE})(?: {_TEMPERATURE})?(?: (?P<unit>[KNMS]))? [0-9A-F]{{2}})?"
    r")\*(?P<sum>[0-9A-F]{2})\s*(?:\x03|<ETX>)?\s*"
)
_BEGINS = re.compile(rf"(?:\x02|<STX>)\s?{_SPEED}")
_UNITS = {"K": "km/h", "N": "kn", "M": "m/s", "S": "mph"}


def parse(raw: str, *, given: str | None = None) -> Sample | Defect:
    """One telegram.

    Args:
        given: the unit of speeds of telegrams that state none.
    """
    match = _TELEGRAM.fullmatch(raw)
    if match is None:
        return Defect.CUT if _BEGINS.match(raw) else Defect.OTHER
    if checksum(match["body"]) != int(match["sum"], 16):
        return Defect.CHECKSUM
    unit = _UNITS[match["unit"]] if match["unit"] else given
    if unit is None:
        return Defect.UNIT
    speed, away, celsius = (_number(match[name]) for name in ("speed", "away", "temperature"))
    values = {"wind_speed": speed * UNITS[unit].scale, "wind_direction": math.radians(away)}
    return {**values, "sonic_temperature": celsius + UNITS["degC"].offset}, SampleFlag.OK


def _number(text: str | None) -> float:
    return math.nan if text is None or "F" in text else float(text)


INSTRUMENT = Instrument(
    format="thies",
    about="Telegrams of a Thies ultrasonic anemometer",
    name="a Thies anemometer",
    parse=parse,
    line="telegrams of a Thies anemometer",
    in_unit=lambda unit: partial(parse, given=unit),
    channels=("wind_speed", "wind_direction", "sonic_temperature"),
    sensor=Sensor(name="Thies ultrasonic anemometer", resolution=0.1),
    described_by="Thies' manuals",
)
Thies = partial(InstrumentLines, INSTRUMENT)
