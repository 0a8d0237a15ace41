"""Formats of serial instruments, each described by a file of catalogs/sensors/serial, which cites
the maker's manual.

    about, name, line   what the format, the instrument and one of its lines are called in messages
    described-by        the description that it follows; none was tested on a real log
    frame               pattern of a line, with the groups "body", "sum" (its checksum) and "end"
                        (the mark that ends it; without that, two digits that look like a checksum
                        may be the status); else all is the body
    telegrams           patterns of the body, of which the first that fits counts. Groups named as
                        fields hold values; "status", the instrument's own judgement; "unit", the
                        letter of its unit of speed; "pairs", a list of names, values and letters of
                        units, which `pair` takes apart
    begins              pattern of the beginning of a reading, by which a line that fits nothing
                        counts as cut off
    before              pattern of what is removed from a line before all this
    clock               pattern of a line by which the instrument states its own time
    checksum, counted   how it is computed, and the texts behind the body that may be counted too
    missing             pattern of a text that means "no value"
    right, invalid      statuses of a sound reading; letter in place of a unit that marks a fault
    stated-units        letter of the group "unit" → unit of the fields that name none; asks-unit:
                        the user gives it where no telegram states it
    needs, fewest       sets of fields one of which a reading has; number of its fields; lacking:
                        else the line is this
    unread              further names of pairs; where there are any, a line with another is no
                        reading
    first-counts        of a name of pairs that comes twice: else the last
    speed               fields of the horizontal speed: the first that are there; of two, the length
                        of the components
    channels            of the reading, in this order
    axes-from-south     whether wind along +x comes from the south mark, and not from the azimuth
    [sensor], [fields]  the sensor; field → channel (none: it only serves others), unit or letters
                        of units, and factor

The fields "length" and "elevation" are those of the whole wind vector.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial
from typing import Any

from flagdata.core.schema import SampleFlag
from flagdata.core.units import UNITS
from flagdata.errors import UsageError
from flagdata.ingest.anemometer.formats.nmea_sentences import checksum
from flagdata.ingest.anemometer.formats.serial_lines import (
    GIVEN_CLOCK,
    LONGEST,
    NOTHING,
    Defect,
    Instrument,
    Sample,
    read_lines,
    split_stamp,
    turn_directions,
)
from flagdata.ingest.anemometer.log_reading import Reading, with_horizontal
from flagdata.ingest.anemometer.sniffing import Guess, Head
from flagdata.ingest.anemometer.text.text_file import TextFile
from flagdata.ingest.anemometer.wind_options import WindOptions
from flagdata.recipes.shelves import Shelf, parse_recipe
from flagdata.record.signals import Sensor

_SHELF = Shelf(folder="sensors/serial", noun="serial format")
_AXES = ("wind_x", "wind_y")


@dataclass(frozen=True, kw_only=True)
class Field:
    """What a field of a telegram holds: see above."""

    channel: str = ""
    unit: str = ""
    units: Mapping[str, str] = field(default_factory=dict)
    factor: float = 1.0


@dataclass(frozen=True, kw_only=True)
class Maker:
    """A file of catalogs/sensors/serial: see above."""

    about: str
    name: str
    line: str
    described_by: str
    telegrams: Sequence[str]
    begins: str
    channels: Sequence[str]
    sensor: Sensor
    fields: Mapping[str, Field]
    frame: str = "(?P<body>.*)"
    before: str = "^(?!)"
    clock: str = "(?!)"
    pair: str = "(?!)"
    missing: str = "(?!)"
    checksum: str = ""
    counted: Sequence[str] = ("",)
    right: Sequence[str] = ()
    invalid: str = ""
    stated_units: Mapping[str, str] = field(default_factory=dict)
    asks_unit: bool = False
    needs: Sequence[str] = ()
    fewest: int = 0
    lacking: str = "OTHER"
    unread: Sequence[str] = ()
    first_counts: bool = False
    speed: Sequence[str] = ()
    axes_from_south: bool = False


@cache
def maker(name: str) -> Maker:
    """Reads the description of a format of the catalog."""
    data: dict[str, Any] = parse_recipe(_SHELF.named(name).text, where=name)
    sensor = Sensor(**data.pop("sensor"))
    fields = {key: Field(**value) for key, value in data.pop("fields").items()}
    return Maker(
        sensor=sensor,
        fields=fields,
        **{key.replace("-", "_"): value for key, value in data.items()},
    )


class Telegrams:
    """Reads the lines of a maker's instruments, without their stamps.

    Args:
        maker: its description.
        unit: of the speeds of telegrams that state none, if it is known.
    """

    def __init__(self, maker: Maker, unit: str | None = None) -> None:
        self._maker, self._unit = maker, unit
        self._frame, self._begins, self._clock = map(
            re.compile, (maker.frame, maker.begins, maker.clock)
        )
        self._pair, self._missing = re.compile(maker.pair), re.compile(maker.missing)
        self._telegrams = [re.compile(text) for text in maker.telegrams]
        self._needs = [frozenset(names.split()) for names in maker.needs]
        self._names = maker.fields.keys() | set(maker.unread)

    def __call__(self, raw: str) -> Sample | Defect:
        """Reads one line: its sample, or why it has none."""
        maker = self._maker
        if self._clock.fullmatch(raw):
            return Defect.BESIDE
        frame = self._frame.fullmatch(raw)
        framed = {} if frame is None else frame.groupdict()
        body, total = framed.get("body", ""), framed.get("sum")
        match = self._telegram(body)
        if match is None and total and framed.get("end", body) is None:
            match, total = self._telegram(body + total), None
        if match is None:
            return Defect.CUT if self._begins.match(raw) else Defect.OTHER
        if total and total not in [
            _CHECKSUMS[maker.checksum](body + text) for text in maker.counted
        ]:
            return Defect.CHECKSUM
        groups = match.groupdict()
        if groups.get("pairs") is None:
            texts = {
                key: (text, "")
                for key, text in groups.items()
                if key in maker.fields and text is not None
            }
        else:
            pairs = self._pair.findall(groups["pairs"])
            texts = {
                key: (text, letter)
                for key, text, letter in pairs[:: -1 if maker.first_counts else 1]
            }
        if self._lacks(texts):
            return Defect[maker.lacking]
        stated_unit = maker.stated_units.get(groups.get("unit") or "", self._unit)
        if maker.stated_units and stated_unit is None:
            return Defect.UNIT
        sound = not maker.right or groups.get("status") in (None, *maker.right)
        values: dict[str, float] = {}
        for key in texts.keys() & maker.fields.keys():
            (text, letter), field = texts[key], maker.fields[key]
            unit = field.unit or (field.units.get(letter) if field.units else stated_unit)
            if unit is not None:
                values[key] = self._si(text, unit, field.factor, pairs="pairs" in groups)
            elif any(key in names for names in self._needs):
                if letter != maker.invalid:
                    return Defect.CUT
                sound = False
        return self._sample(values), SampleFlag.OK if sound else SampleFlag.SENSOR_FAULT

    def _telegram(self, body: str) -> re.Match[str] | None:
        return next(
            (match for form in self._telegrams if (match := form.fullmatch(body)) is not None), None
        )

    def _lacks(self, texts: Mapping[str, object]) -> bool:
        maker = self._maker
        complete = not self._needs or any(names <= texts.keys() for names in self._needs)
        return (
            not complete
            or len(texts) < maker.fewest
            or bool(maker.unread and texts.keys() - self._names)
        )

    def _si(self, text: str, unit: str, factor: float, *, pairs: bool) -> float:
        if self._missing.fullmatch(text):
            return math.nan
        # Adding -0.0 preserves the sign of a zero, which a telegram of numbers in order may have.
        offset = UNITS[unit].offset
        return float(text) * factor * UNITS[unit].scale + (offset if offset or pairs else -0.0)

    def _sample(self, values: Mapping[str, float]) -> dict[str, float]:
        fields = self._maker.fields
        sample = {
            fields[key].channel: value for key, value in values.items() if fields[key].channel
        }
        if "elevation" in values:
            length, up = values["length"], values["elevation"]
            sample |= {"wind_speed": length * math.cos(up), "wind_z": length * math.sin(up)}
        elif self._maker.speed:
            sample["wind_speed"] = math.nan
            for names in self._maker.speed:
                if not all(name in values for name in names.split()):
                    continue
                parts = [values[name] for name in names.split()]
                sample["wind_speed"] = parts[0] if len(parts) == 1 else math.hypot(*parts)
                if len(parts) == 1 or not math.isnan(sample["wind_speed"]):
                    break
        return sample


class _Split:
    """Splits lines as `split_stamp` does, without what stands before a message; stamps those
    without a stamp by the last line of the instrument's own clock."""

    def __init__(self, maker: Maker) -> None:
        self._before, self._clock = re.compile(maker.before), re.compile(maker.clock)
        self._last = ""

    def __call__(self, line: str) -> tuple[str, str]:
        stamp, raw = split_stamp(line)
        raw = self._before.sub("", raw)
        match = self._clock.fullmatch(raw)
        if match is not None:
            self._last = "20{year}-{month}-{day}T{time}".format(**match.groupdict())
        return stamp or self._last, raw


class SerialLines:
    """A format of serial instruments, by its name in the catalog."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.maker = maker(name)
        self.about = f"{self.maker.about}, each after a computer's stamp"
        self.uses = frozenset({"zone", "azimuth", *(["unit"] if self.maker.asks_unit else [])})
        self.parse = Telegrams(self.maker)

    def recognise(self, head: Head) -> Guess | None:
        """Recognises a log most of whose lines are of the instrument, some of them readings."""
        split = _Split(self.maker)
        lines = [split(line) for line in head.lines if line.strip(NOTHING)]
        results = [self.parse(raw) if len(raw) <= LONGEST else Defect.OTHER for _, raw in lines]
        readings = sum(
            not isinstance(result, Defect) or result is Defect.UNIT for result in results
        )
        right = readings + results.count(Defect.BESIDE)
        if not readings or right < max(1, len(lines) // 2):
            return None
        stamps = sum(bool(stamp) for stamp, _ in lines)
        reasons = (
            f"{right} of the first {len(lines)} lines are {self.maker.line}",
            GIVEN_CLOCK
            if head.counted
            else f"{stamps} of them carry the stamp of the computer that logged them",
        )
        return Guess(format=self.name, score=0.95, reasons=reasons)

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """Reads speed and direction, or components, of every line whose checksum is right or
        absent."""
        maker, where, parse = self.maker, str(source.path), self.parse
        if options.unit is not None and maker.asks_unit:
            split = _Split(maker)
            if not any(parse(split(line)[1]) is Defect.UNIT for line in source.head()):
                raise UsageError(
                    "the lines state the unit of speed", where=where, fix="leave out --unit"
                )
            parse = Telegrams(maker, options.unit)
        instrument = Instrument(
            name=maker.name,
            channels=tuple(maker.channels),
            parse=parse,
            sensor=maker.sensor,
            described_by=maker.described_by,
            splits=lambda: _Split(maker),
        )
        reading = read_lines(source, instrument, zone_name=options.zone)
        if not maker.axes_from_south or "wind_x" not in reading.channels:
            return turn_directions(reading, options.azimuth, where=where)
        # with_horizontal takes wind along +x to come from the azimuth; here it comes from the
        # opposite.
        axes = {name: reading.channels[name] for name in _AXES}
        facing = replace(
            reading,
            channels={**reading.channels, **{name: -values for name, values in axes.items()}},
        )
        done = with_horizontal(facing, options.azimuth, where=where)
        return replace(done, channels={**done.channels, **axes})


def xor(text: str) -> str:
    """Returns the two hexadecimal digits of the exclusive or of all characters."""
    return f"{checksum(text):02X}"


def crc16(text: str) -> str:
    """Returns the three characters of checksum of a message of Vaisala: CRC-16 with polynomial
    A001, six bits each."""
    crc = 0
    for byte in text.encode("latin-1", "replace"):
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ 0xA001 if crc & 1 else crc >> 1
    return "".join(chr(0x40 | part) for part in (crc >> 12, (crc >> 6) & 0x3F, crc & 0x3F))


_CHECKSUMS = {"xor": xor, "crc16": crc16}
Ft = partial(SerialLines, "ft")
Gill = partial(SerialLines, "gill")
Metek = partial(SerialLines, "metek")
Thies = partial(SerialLines, "thies")
TriSonica = partial(SerialLines, "trisonica")
Vaisala = partial(SerialLines, "vaisala")
Young = partial(SerialLines, "young")
