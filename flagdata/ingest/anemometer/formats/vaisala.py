"""Vaisala WXT510, WXT520, WXT530 and WMT50 ASCII messages: "0R1,Dn=236D,Dm=283D,Dx=031D,Sn=0.0M,Sm=1.0M,Sx=2.2M".

Source: Vaisala, WXT530 Series User Guide, "Wind data message (aR1)", "Composite data message (aR0)", settings of wind
units (M m/s, K km/h, S mph, N knots; D degrees), "#" for invalid data, and the appendix "CRC-16 computation": a message
asked for with a small letter (0r1) ends in three characters of checksum. Sm and Dm, the averages, are read; lull, gust
and extremes are not. Written by the manual; no log of such an instrument was at hand.
"""

from __future__ import annotations

import re
from functools import partial

from flagdata.ingest.anemometer.formats.serial_lines import Defect, Instrument, InstrumentLines, Sample, split_stamp
from flagdata.schema import SampleFlag
from flagdata.signals import Sensor
from flagdata.units import UNITS

_FIELDS = {
    "Sm": ("wind_speed", {"M": "m/s", "K": "km/h", "S": "mph", "N": "kn"}),
    "Dm": ("wind_direction", {"D": "deg"}),
    "Ta": ("air_temperature", {"C": "degC", "F": "degF"}),
    "Ua": ("relative_humidity", {"P": "%"}),
    "Pa": ("air_pressure", {"H": "hPa", "P": "Pa", "I": "inHg"}),
}
"""Key of a field → its channel, and letters of its units."""
_MESSAGE = re.compile(
    r"[0-9A-Za-z](?P<kind>[Rr])[0-5](?P<fields>(?:,[A-Z][a-z]=-?\d+(?:\.\d+)?[A-Za-z#])+)(?P<crc>.{3})?"
)
_FIELD = re.compile(r",([A-Z][a-z])=(-?\d+(?:\.\d+)?)([A-Za-z#])")
_NAMED = re.compile(r"^[A-Za-z]\w{0,15}[\s,;:]+(?=[0-9A-Za-z][Rr][0-5],[A-Z][a-z]=)")
_BEGINS = re.compile(r"[0-9A-Za-z][Rr][0-5],[A-Z]")


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
    fields = {key: (text, letter) for key, text, letter in _FIELD.findall(match["fields"]) if key in _FIELDS}
    if "Sm" not in fields:
        return Defect.BESIDE
    values: dict[str, float] = {}
    for key, (text, letter) in fields.items():
        channel, units = _FIELDS[key]
        if letter in units:
            values[channel] = float(UNITS[units[letter]].to_si(float(text)))
        elif key == "Sm" and letter != "#":
            return Defect.CUT
    return values, SampleFlag.OK if "wind_speed" in values else SampleFlag.SENSOR_FAULT


def crc16(text: str) -> str:
    """The three characters of checksum of a message: CRC-16 with polynomial A001, six bits a character."""
    crc = 0
    for byte in text.encode("latin-1", "replace"):
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ 0xA001 if crc & 1 else crc >> 1
    return "".join(chr(0x40 | part) for part in (crc >> 12, (crc >> 6) & 0x3F, crc & 0x3F))


INSTRUMENT = Instrument(
    format="vaisala",
    about="Vaisala WXT or WMT50 ASCII messages",
    name="a Vaisala transmitter",
    parse=parse,
    line="Vaisala messages, some of them with an average wind speed (Sm=)",
    splits=lambda: split,
    channels=tuple(channel for channel, _ in _FIELDS.values()),
    sensor=Sensor(name="Vaisala weather transmitter", resolution=0.1),
    described_by="the WXT530 user guide",
)
Vaisala = partial(InstrumentLines, INSTRUMENT)
