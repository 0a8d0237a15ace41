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
from dataclasses import replace

from flagdata.ingest.anemometer.formats.serial_lines import (
    Defect,
    Instrument,
    Sample,
    checksum,
    guess,
    read_lines,
    turned,
)
from flagdata.ingest.anemometer.options import WindOptions
from flagdata.ingest.anemometer.reading import Reading
from flagdata.ingest.anemometer.sniffing import Guess, Head
from flagdata.ingest.anemometer.table.sonic import with_horizontal
from flagdata.ingest.anemometer.text.source import TextFile
from flagdata.schema import SampleFlag
from flagdata.signals import Sensor
from flagdata.units import UNITS

CHANNELS = ("wind_speed", "wind_direction", "wind_x", "wind_y", "wind_z", "sonic_temperature")
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


class Gill:
    """Format "gill"."""

    name = "gill"
    about = "Gill WindSonic, WindObserver or WindMaster ASCII lines, each after a computer's stamp"
    uses = frozenset({"zone", "azimuth"})

    def recognise(self, head: Head) -> Guess | None:
        """Lines of identifier, two or three numbers, unit and status."""
        return guess(head, self.name, "Gill ASCII (identifier, wind, unit, status)", parse)

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """Read every line whose checksum is right or absent."""
        instrument = Instrument(
            name="a Gill anemometer", channels=CHANNELS, parse=parse,
            sensor=Sensor(name="Gill ultrasonic anemometer", resolution=0.01),
            described_by="Gill's manuals of WindSonic, WindObserver and WindMaster",
        )  # fmt: skip
        where = str(source.path)
        reading = read_lines(source, instrument, zone_name=options.zone)
        if "wind_x" not in reading.channels:
            return turned(reading, options.azimuth, where=where)
        # with_horizontal takes wind along +x to come from the azimuth; along +U it comes from the south mark.
        own = {name: reading.channels[name] for name in ("wind_x", "wind_y")}
        facing = replace(reading, channels={**reading.channels, **{name: -values for name, values in own.items()}})
        done = with_horizontal(facing, options.azimuth, where=where)
        return replace(done, channels={**done.channels, **own})


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
    vertical = math.nan
    if at == 4:
        if not _SIGNED.fullmatch(cells[3]):
            return None
        vertical = float(cells[3]) * scale
    rest = cells[at + 1 :]
    numbers: list[float] = []
    while rest and _SIGNED.fullmatch(rest[0]) and len(numbers) < 2:
        numbers.append(float(rest.pop(0)))
    if not rest or not _STATUS.fullmatch(rest[0]):
        return None
    temperature = next((value for value in numbers if abs(value) < _SOUND), math.nan)
    flag = int(SampleFlag.OK if rest[0] in RIGHT else SampleFlag.SENSOR_FAULT)
    first, second = cells[1], cells[2]
    tail = (vertical, temperature + UNITS["degC"].offset)
    if _SIGNED.fullmatch(first) and _SIGNED.fullmatch(second):
        return (math.nan, math.nan, float(first) * scale, float(second) * scale, *tail), flag
    if _POLAR.fullmatch(first) and _SPEED.fullmatch(second):
        direction = math.radians(float(first)) if first else math.nan
        return (float(second) * scale, direction, math.nan, math.nan, *tail), flag
    return None
