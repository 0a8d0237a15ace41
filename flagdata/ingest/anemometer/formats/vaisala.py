"""Vaisala WXT510, WXT520, WXT530 and WMT50 ASCII messages: "0R1,Dn=236D,Dm=283D,Dx=031D,Sn=0.0M,Sm=1.0M,Sx=2.2M".

Source: Vaisala, WXT530 Series User Guide, "Wind data message (aR1)", "Composite data message (aR0)", settings of wind
units (M m/s, K km/h, S mph, N knots; D degrees), "#" for invalid data, and the appendix "CRC-16 computation": a message
asked for with a small letter (0r1) ends in three characters of checksum. Sm and Dm, the averages, are read; lull, gust
and extremes are not. Written by the manual; no log of such an instrument was at hand.
"""

from __future__ import annotations

import math
import re

from flagdata.ingest.anemometer.formats.serial_lines import (
    Defect,
    Instrument,
    Sample,
    guess,
    read_lines,
    split_stamp,
    turned,
)
from flagdata.ingest.anemometer.options import WindOptions
from flagdata.ingest.anemometer.reading import Reading
from flagdata.ingest.anemometer.sniffing import Guess, Head
from flagdata.ingest.anemometer.text.source import TextFile
from flagdata.schema import SampleFlag
from flagdata.signals import Sensor
from flagdata.units import UNITS

CHANNELS = ("wind_speed", "wind_direction", "air_temperature", "relative_humidity", "air_pressure")
_KEYS = {"Sm": 0, "Dm": 1, "Ta": 2, "Ua": 3, "Pa": 4}
_UNITS = (
    {"M": "m/s", "K": "km/h", "S": "mph", "N": "kn"},
    {"D": "deg"},
    {"C": "degC", "F": "degF"},
    {"P": "%"},
    {"H": "hPa", "P": "Pa", "I": "inHg"},
)
_MESSAGE = re.compile(
    r"[0-9A-Za-z](?P<kind>[Rr])[0-5](?P<fields>(?:,[A-Z][a-z]=-?\d+(?:\.\d+)?[A-Za-z#])+)(?P<crc>.{3})?"
)
_FIELD = re.compile(r",([A-Z][a-z])=(-?\d+(?:\.\d+)?)([A-Za-z#])")
_NAMED = re.compile(r"^[A-Za-z]\w{0,15}[\s,;:]+(?=[0-9A-Za-z][Rr][0-5],[A-Z][a-z]=)")
_BEGINS = re.compile(r"[0-9A-Za-z][Rr][0-5],[A-Z]")


class Vaisala:
    """Format "vaisala"."""

    name = "vaisala"
    about = "Vaisala WXT or WMT50 ASCII messages, each after a computer's stamp"
    uses = frozenset({"zone", "azimuth"})

    def recognise(self, head: Head) -> Guess | None:
        """Messages of an address, R and a number, then key=value pairs with units; some of wind."""
        found = guess(head, self.name, "Vaisala messages with an average wind speed (Sm=)", parse, split)
        if found is not None:
            return found
        # Wind may be one of several messages sent in turn.
        lines = [line for line in head.lines if line.strip()]
        messages = [line for line in lines if _MESSAGE.search(line)]
        wind = sum(",Sm=" in line for line in messages)
        if not wind or len(messages) < max(1, len(lines) // 2):
            return None
        reasons = (f"{len(messages)} of the first {len(lines)} lines are Vaisala messages", f"{wind} of them hold Sm=")
        return Guess(format=self.name, score=0.95, reasons=reasons)

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """Read the messages that hold an average wind speed."""
        instrument = Instrument(
            name="a Vaisala transmitter", channels=CHANNELS, parse=parse,
            sensor=Sensor(name="Vaisala weather transmitter", resolution=0.1),
            described_by="the WXT530 user guide", split=split,
        )  # fmt: skip
        reading = read_lines(source, instrument, zone_name=options.zone)
        return turned(reading, options.azimuth, where=str(source.path))


def split(line: str) -> tuple[str, str]:
    """The stamp before a message, and the message without the name that a data system writes before it."""
    stamp, raw = split_stamp(line)
    return stamp, _NAMED.sub("", raw)


def parse(raw: str) -> Sample | Defect:
    """One message. Those without Sm are other messages."""
    match = _MESSAGE.fullmatch(raw.rstrip())
    if match is None:
        return Defect.CUT if _BEGINS.match(raw) else Defect.OTHER
    crc = match["crc"]
    if (match["kind"] == "r") != (crc is not None):
        return Defect.CUT
    if crc is not None and crc16(raw[: match.start("crc")]) != crc:
        return Defect.CHECKSUM
    values = [math.nan] * len(CHANNELS)
    flag = SampleFlag.OK
    wind = False
    for key, text, spelled in _FIELD.findall(match["fields"]):
        index = _KEYS.get(key)
        if index is None:
            continue
        wind |= index == 0
        if spelled == "#":
            flag |= SampleFlag.SENSOR_FAULT if index == 0 else SampleFlag.OK
            continue
        name = _UNITS[index].get(spelled)
        if name is not None:
            values[index] = float(UNITS[name].to_si(float(text)))
        elif index == 0:
            return Defect.CUT
    return (values, int(flag)) if wind else Defect.OTHER


def crc16(text: str) -> str:
    """The three characters of checksum of a message: CRC-16 with polynomial A001, six bits a character."""
    crc = 0
    for byte in text.encode("latin-1", "replace"):
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ 0xA001 if crc & 1 else crc >> 1
    return "".join(chr(0x40 | part) for part in (crc >> 12, (crc >> 6) & 0x3F, crc & 0x3F))
