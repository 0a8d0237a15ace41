"""NMEA 2000 as text: frames, and the canboat project's raw lines (PLAIN, FAST), analyzer's text and
its JSON.

    (1502979132.106111) can0 09FD0223#00A50267FE02FFFF
    17:33:21.107 R 09FD0223 00 A5 02 67 FE 02 FF FF
    2016-02-28T19:57:02.364Z,2,130306,130,255,8,f7,df,01,67,00,fa,ff,ff
    2011-11-24-22:42:04.437 2  36 255 130306 Wind Data:  SID = 177; Wind Speed = 0.92 m/s; …
    {"timestamp":"…","prio":2,"src":36,"dst":255,"pgn":130306,…,"fields":{"Wind Speed":0.92,…}}

The first is of Linux' candump -L, the second the RAW text of Yacht Devices' gateways, of which the
user gives the day.
Source: SocketCAN, candump(1); Yacht Devices, Wi-Fi Gateway YDWG-02 user manual, appendix "Format of
messages in RAW mode" (UTC, R received, identifier, data); SAE J1939-21, 5.2, for the identifier's
29 bits: priority 3, then data page, PDU format and PDU specific, which make the number of the
message, and the sender's address 8; canboat project, README "File formats", wiki "analyzer", and
its table of PGNs: 130306 Wind Data is SID, speed (uint16, 0.01 m/s), angle (uint16, 0.0001 rad),
reference (3 bits: 0 over ground from true north, 1 from magnetic north, 2 apparent, 3 boat-
referenced, 4 water-referenced); 129026 COG & SOG holds the speed over ground (uint16 in bytes 4 and
5, 0.01 m/s); the three largest numbers of a field mean no value. References 3 and 4 are winds
computed as if the platform were at rest (theoretical). JSON says by "units" in its first line
whether angles are rad ("si") or deg.
"""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from flagdata.core.schema import SampleFlag
from flagdata.core.shell import command_line
from flagdata.core.units import UNITS
from flagdata.errors import InputError
from flagdata.ingest.anemometer.formats.serial_lines import Defect, Instrument, Sample, read_lines
from flagdata.ingest.anemometer.log_reading import Reading
from flagdata.ingest.anemometer.samples.platform import settle_platform
from flagdata.ingest.anemometer.sniffing import Guess, Head
from flagdata.ingest.anemometer.text.text_file import TextFile
from flagdata.ingest.anemometer.wind_options import WindOptions
from flagdata.record.signals import Sensor

_CANDUMP = re.compile(
    r"\((?P<stamp>\d{10}\.\d{1,9})\)\s+\S+\s+"
    r"(?P<id>[0-9A-F]{8})#(?P<bytes>(?:[0-9A-F]{2}){0,8})\s*[RT]?"
)
_GATEWAY = re.compile(
    r"(?:(?P<date>\d{4}-\d{2}-\d{2})T)?(?P<stamp>\d{2}:\d{2}:\d{2}\.\d{3})\s+[RT]\s+"
    r"(?P<id>[0-9A-F]{8})(?P<bytes>(?:\s+[0-9A-F]{2}){0,8})\s*"
)
_WIND = 130306
_OVER_GROUND = 129026
_STAMP = r"(?P<date>\d{4}-\d{2}-\d{2})[T Z-](?P<time>\d{2}:\d{2}:\d{2}(?:\.\d{1,9})?)(?P<zone>Z?)"
_RAW = re.compile(
    _STAMP
    + r",(?P<rest>\d,(?P<pgn>\d{4,6}),(?P<src>\d{1,3}),\d{1,3},\d{1,3}(?:,[0-9A-Fa-f]{2})*)\s*"
)
_TEXT = re.compile(
    _STAMP
    + r"\s+(?P<rest>\d\s+(?P<src>\d{1,3})\s+\d{1,3}\s+(?P<pgn>\d{4,6})\s[^:]{0,80}:(?P<fields>.*))"
)
_RESTS = re.compile(
    r"\d,(?P<pgn>\d{4,6}),(?P<src>\d{1,3}),\d{1,3},(?P<size>\d{1,3})(?P<bytes>(?:,[0-9A-Fa-f]{2})*)"
)
_WORDS = re.compile(
    r"\d\s+(?P<src>\d{1,3})\s+\d{1,3}\s+(?P<pgn>\d{4,6})\s[^:]{0,80}:(?P<fields>.*)"
)
_CUT = re.compile(r"\d{4}-\d{2}-\d{2}[T Z-]|\{\"timestamp\"")
_REFERENCES: Mapping[str, int] = {
    "true (ground referenced to north)": 0,
    "true": 0,
    "magnetic (ground referenced to magnetic north)": 1,
    "apparent": 2,
    "true (boat referenced)": 3,
    "true (water referenced)": 4,
}
_CHANNELS = {
    0: ("wind_speed", "wind_direction"),
    1: ("wind_speed", "wind_direction_magnetic"),
    2: ("apparent_wind_speed", "apparent_wind_direction"),
    3: ("theoretical_wind_speed", "theoretical_wind_direction"),
    4: ("theoretical_wind_speed", "theoretical_wind_direction"),
}
"""Reference of a wind → its channels."""


class Canboat:
    """Format "canboat"."""

    name = "canboat"
    about = "NMEA 2000: frames of candump and gateways; canboat's text, raw, analyzed or JSON"
    uses = frozenset({"zone", "platform", "azimuth", "talker"})

    def recognise(self, head: Head) -> Guess | None:
        """Lines that are canboat's, some of them of wind."""
        network = _Network(None)
        lines = [line for line in head.lines if line.strip()]
        wind = sum(not isinstance(network(split(line)[1]), Defect) for line in lines)
        ours = sum(_is_message(line) for line in lines)
        if ours < max(1, len(lines) // 2):
            return None
        reasons = (
            f"{ours} of the first {len(lines)} lines are NMEA 2000 messages",
            f"{wind} of them are wind (PGN {_WIND})",
        )
        return Guess(format=self.name, score=0.96 if wind else 0.3, reasons=reasons)

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """Reads the wind messages of one device."""
        where = str(source.path)
        network = _Network(options.talker)
        instrument = Instrument(
            name="wind on NMEA 2000 (PGN 130306)",
            parse=network,
            splits=lambda: split,
            channels=tuple(name for pair in _CHANNELS.values() for name in pair),
            sensor=Sensor(name="NMEA 2000 wind sensor", resolution=0.01),
        )
        reading = read_lines(source, instrument, zone_name=options.zone)
        if len(network.devices) > 1:
            listed = ", ".join(sorted(network.devices, key=int))
            raise InputError(
                f"several devices send wind: {listed}; they are different instruments",
                where=where,
                fix="choose one by its address, e.g. "
                f"{command_line('--talker', min(network.devices, key=int))}",
            )
        kept_findings = tuple(
            finding for finding in reading.findings if finding.kind != "non-data-lines"
        )
        knots = [speed / UNITS["kn"].scale for speed in network.speeds]
        channels, about = settle_platform(
            reading.channels, options, speeds=knots, source=f"PGN {_WIND}", where=where
        )
        sensor = Sensor(name=f"NMEA 2000 device {next(iter(network.devices))}", resolution=0.01)
        return replace(reading, channels=channels, sensor=sensor, findings=(*kept_findings, about))


def split(line: str) -> tuple[str, str]:
    """Splits a message into its stamp, as ISO 8601, and the rest; JSON stays whole."""
    text = line.strip()
    if text.startswith("{"):
        match = re.search(r"\"timestamp\"\s*:\s*\"" + _STAMP + r"\"", text[:400])
        return (_iso(match) if match else ""), text
    match = _RAW.fullmatch(text) or _TEXT.fullmatch(text)
    if match is not None:
        return _iso(match), match["rest"]
    frame = _CANDUMP.fullmatch(text)
    if frame is not None:
        return frame["stamp"], _message(frame)
    frame = _GATEWAY.fullmatch(text)
    if frame is None:
        return "", text
    return f"{frame['date']}T{frame['stamp']}Z" if frame["date"] else "", _message(frame)


def _message(frame: re.Match[str]) -> str:
    """Writes a frame as canboat's raw line without its stamp."""
    identifier, data = int(frame["id"], 16), bytes.fromhex(frame["bytes"].replace(" ", ""))
    number = (identifier >> 8) & 0x1FFFF
    # Below 240 the second byte is the address the message is sent to, and no part of its number.
    number = number if (number >> 8) & 0xFF >= 240 else number & 0x1FF00
    listed = "".join(f",{byte:02x}" for byte in data)
    return f"{(identifier >> 26) & 7},{number},{identifier & 0xFF},255,{len(data)}{listed}"


def _iso(match: re.Match[str]) -> str:
    return f"{match['date']}T{match['time']}{match['zone']}"


def _is_message(line: str) -> bool:
    text = line.strip()
    if text.startswith("{"):
        return '"pgn":' in text and '"timestamp":' in text
    return any(form.fullmatch(text) for form in (_RAW, _TEXT, _CANDUMP, _GATEWAY))


class _Network:
    """Messages as they come in: wind of one device or all, and what else describes the platform.

    Attributes:
        devices: number of wind messages of each address.
        speeds: over ground [m/s].
    """

    def __init__(self, device: str | None) -> None:
        self._device = device
        self._radians = False
        self.devices: Counter[str] = Counter()
        self.speeds: list[float] = []

    def __call__(self, rest: str) -> Sample | Defect:
        if rest.startswith("{"):
            return self._json(rest)
        match = _RESTS.fullmatch(rest)
        if match is not None:
            return self._bytes(match)
        match = _WORDS.fullmatch(rest)
        if match is not None:
            pairs = (part.partition("=") for part in match["fields"].split(";"))
            return self._fields(
                int(match["pgn"]),
                match["src"],
                {key.strip(): value.strip() for key, _, value in pairs},
            )
        return Defect.CUT if _CUT.match(rest) else Defect.OTHER

    def _bytes(self, match: re.Match[str]) -> Sample | Defect:
        pgn, data = int(match["pgn"]), bytes.fromhex(match["bytes"].replace(",", ""))
        if pgn not in (_WIND, _OVER_GROUND):
            return Defect.OTHER
        if len(data) < 6 or len(data) != int(match["size"]):
            return Defect.CUT
        if pgn == _OVER_GROUND:
            self.speeds.extend(speed for speed in [_word(data, 4, 0.01)] if not math.isnan(speed))
            return Defect.OTHER
        return self._wind(match["src"], _word(data, 1, 0.01), _word(data, 3, 1e-4), data[5] & 7)

    def _json(self, text: str) -> Sample | Defect:
        try:
            message: Any = json.loads(text)
        except (ValueError, RecursionError):
            return Defect.CUT if _CUT.match(text) else Defect.OTHER
        if not isinstance(message, dict):
            return Defect.OTHER
        if "units" in message:
            self._radians = message["units"] == "si"
        fields = message.get("fields")
        pgn = message.get("pgn")
        if not isinstance(fields, dict) or not str(pgn).isdigit():
            return Defect.OTHER
        plain = {
            key: value.get("name") if isinstance(value, dict) else value
            for key, value in fields.items()
        }
        return self._fields(int(str(pgn)), str(message.get("src", "")), plain)

    def _fields(self, pgn: int, device: str, fields: Mapping[str, Any]) -> Sample | Defect:
        if pgn == _OVER_GROUND:
            speed = _number(fields.get("SOG"))
            self.speeds.extend([speed] if not math.isnan(speed) else [])
        if pgn != _WIND:
            return Defect.OTHER
        reference = _REFERENCES.get(str(fields.get("Reference", "")).strip().lower())
        if reference is None:
            return Defect.CUT
        angle = fields.get("Wind Angle")
        scale = 1.0 if self._radians or str(angle).rstrip().endswith("rad") else UNITS["deg"].scale
        unit = str(fields.get("Wind Speed")).strip().partition(" ")[2] or "m/s"
        if unit not in ("m/s", "kts", "km/h"):
            return Defect.CUT
        speed = _number(fields.get("Wind Speed")) * UNITS["kn" if unit == "kts" else unit].scale
        return self._wind(device, speed, _number(angle) * scale, reference)

    def _wind(self, device: str, speed: float, angle: float, reference: int) -> Sample | Defect:
        if reference not in _CHANNELS or (self._device is not None and device != self._device):
            return Defect.OTHER
        self.devices[device] += 1
        return dict(zip(_CHANNELS[reference], (speed, angle), strict=True)), SampleFlag.OK


def _word(data: bytes, at: int, scale: float) -> float:
    """Reads an unsigned 16-bit field; NaN for the three numbers that mean no value."""
    number = int.from_bytes(data[at : at + 2], "little")
    return number * scale if number < 0xFFFD else math.nan


def _number(value: object) -> float:
    """Reads a number, alone or before its unit; NaN where there is none."""
    match = re.match(r"-?\d+(?:\.\d+)?", str(value).strip())
    return float(match[0]) if match else math.nan
