"""Gill Instruments' ASCII lines: WindSonic, WindObserver and WindMaster; polar, UV and UVW.

    <STX>Q,229,002.74,M,00,<ETX>16                                        direction, speed
    <STX>Q,+001.59,-002.74,M,00,<ETX>2D                                   U, V
    <STX>Q,-000.07,+000.04,+000.03,M,+344.22,+021.50,00,<ETX>CC           U, V, W, speed of sound, temperature

Source: Gill Instruments, WindSonic User Manual (1405-PS-0019, issue 28), 9.1 "Gill format, polar", 9.2 "Gill format,
UV", 11.5 "Status"; WindObserver 65 (1390-PS-0039), 7.8 and appendix K; WindMaster (1561-PS-0001, issue 11), 7.1 to 7.4.
The checksum is the exclusive or of what stands between STX and ETX; in the WindObserver manual's examples ETX is
counted too, so that both are right here. +U blows from the south mark to the north mark, +V
from east to west, +W upwards. Control characters may have been lost, or written as "<STX>". Written by the manuals; no
log of such an instrument was at hand.
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

_LINE = re.compile(r"(?:\x02|<STX>)?\s*(?P<body>[A-Z],.*?)(?P<end>\x03|<ETX>)?\s*(?P<sum>[0-9A-F]{2})?\s*", re.DOTALL)
_BEGINS = re.compile(r"(?:\x02|<STX>)?\s*[A-Z],\s*(?:[+-]?\d|,)")
_POLAR = re.compile(r"(?:\d{1,3}(?:\.\d)?)?")
_SIGNED = re.compile(r"[+-]\d+\.\d+")
_SPEED = re.compile(r"\d+\.\d+")
_STATUS = re.compile(r"[0-9A-F]{1,2}")
RIGHT = {"0", "00", "60", "51", "A"}
"""Status of a sound reading: no fault; heating and no fault; average still building up; acceptable (NMEA)."""
_LONGEST = 160
_SOUND = 100.0
"""A speed of sound is above this in every unit but not a temperature [°C]."""

GILL = {"M": "m/s", "N": "kn", "P": "mph", "K": "km/h", "F": "ft/min"}
"""Gill Instruments, WindSonic User Manual (1405-PS-0019, issue 28), 9.1: the unit's letter behind the speed."""


def parse(raw: str) -> Sample | Defect:
    """One line, with or without its frame."""
    match = _LINE.fullmatch(raw) if len(raw) <= _LONGEST else None
    if match is None:
        return Defect.CUT if _BEGINS.match(raw) else Defect.OTHER
    body, stated = match["body"], match["sum"]
    sample = _fields(body)
    if sample is None and match["end"] is None and stated is not None:
        body, stated = f"{body}{stated}", None  # without a frame, what ends the line may be the status
        sample = _fields(body)
    if sample is None:
        return Defect.CUT if _BEGINS.match(raw) else Defect.OTHER
    if stated is not None and int(stated, 16) not in (checksum(body), checksum(f"{body}\x03")):
        return Defect.CHECKSUM
    return sample


def _fields(body: str) -> Sample | None:
    cells = [cell.strip() for cell in body.split(",")]
    at = next((index for index in (3, 4) if len(cells) > index and cells[index] in GILL), None)
    if at is None or any(len(cell) > 12 for cell in cells):
        return None
    scale = UNITS[GILL[cells[at]]].scale
    rest = cells[at + 1 :]
    numbers: list[float] = []
    while rest and _SIGNED.fullmatch(rest[0]) and len(numbers) < 2:
        numbers.append(float(rest.pop(0)))
    if not rest or not _STATUS.fullmatch(rest[0]) or (at == 4 and not _SIGNED.fullmatch(cells[3])):
        return None
    temperature = next((value for value in numbers if abs(value) < _SOUND), math.nan)
    values = {"sonic_temperature": temperature + UNITS["degC"].offset}
    if at == 4:
        values["wind_z"] = float(cells[3]) * scale
    first, second = cells[1], cells[2]
    if _SIGNED.fullmatch(first) and _SIGNED.fullmatch(second):
        values |= {"wind_x": float(first) * scale, "wind_y": float(second) * scale}
    elif _POLAR.fullmatch(first) and _SPEED.fullmatch(second):
        values |= {"wind_speed": float(second) * scale}
        values |= {"wind_direction": math.radians(float(first))} if first else {}
    else:
        return None
    return values, SampleFlag.OK if rest[0] in RIGHT else SampleFlag.SENSOR_FAULT


INSTRUMENT = Instrument(
    format="gill",
    about="Gill WindSonic, WindObserver or WindMaster ASCII lines",
    name="a Gill anemometer",
    line="Gill ASCII (identifier, wind, unit, status)",
    parse=parse,
    axes_from_south=True,
    channels=("wind_speed", "wind_direction", "wind_x", "wind_y", "wind_z", "sonic_temperature"),
    sensor=Sensor(name="Gill ultrasonic anemometer", resolution=0.01),
    described_by="Gill's manuals of WindSonic, WindObserver and WindMaster",
)
Gill = partial(InstrumentLines, INSTRUMENT)
