"""Lines that an instrument sent over a serial port, as a computer or logger wrote them down.

The instruments do not know the time: it is the stamp that the logging computer wrote before each
line, ISO 8601 or Unix time, alone or in brackets, set off by a comma, semicolon, tab or blank.
Signal K's server writes the connection's name between stamp and sentence, other programs what they
have to say about it; an NMEA sentence is found wherever its line holds a stamp. What the lines of
an instrument mean is declared beside: see `makers`.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum, auto
from functools import lru_cache
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from flagdata.core.arrays import BoolArray, FloatArray, IntArray
from flagdata.core.findings import Finding, Severity
from flagdata.core.schema import CHANNELS, SampleFlag
from flagdata.errors import InputError, TimeError, UsageError
from flagdata.ingest.anemometer.formats.nmea_sentences import tag_time
from flagdata.ingest.anemometer.instants.stamp_text import ABBREVIATED, ENGLISH, Stamps
from flagdata.ingest.anemometer.instants.stamp_text import parse as parse_stamps
from flagdata.ingest.anemometer.instants.zones import instants
from flagdata.ingest.anemometer.log_reading import Reading, followed_finding
from flagdata.ingest.anemometer.samples import rules
from flagdata.ingest.anemometer.sniffing import Head
from flagdata.ingest.anemometer.text.text_file import TextFile
from flagdata.record.signals import Sensor

_CLOCK = r"(?P<time>\d{2}:\d{2}:\d{2}(?:\.\d{1,9})?)"
_RAW = r"[\"\])]?[\s,;>|]+(?P<raw>\S.*)"
_STAMP = re.compile(
    r"\s*(?:[A-Za-z]\w{0,15}[ ,;:\t]+|[A-Za-z][\w.-]{0,60}\t)?"
    r"[\"\[(]?(?P<date>\d{4}[-/]\d{2}[-/]\d{2})[T "
    r",;\t](?P<time>\d{2}:\d{2}:\d{2}(?:\.\d{1,9}|,\d{3}(?=[\s\])]))?)"
    r"(?P<zone>Z|[+-]\d{2}:?\d{2})?[\"\])]?[\s,;>|]+"
    r"(?:(?:\w{0,40}[,;]){1,2}(?=\"?[$!])|[^$!]{1,120}(?=[$!][A-Z]{2}[A-Z0-9]{3},))?(?P<raw>\S.*)"
)
_AFTER = re.compile(r"(?<=\*[0-9A-Fa-f]{2})[\"\s].*")
"""What a program wrote behind a sentence."""
_EPOCH = re.compile(
    r"\s*[\"\[(]?(?P<epoch>\d{10}(?:\.\d{1,9})?|\d{13})[\"\])]?(?:\[[^\]]{0,10}\])?[\s,;>|]+"
    r"(?:(?:\w{0,40}[,;]){1,2}(?=\"?[$!]))?(?P<raw>\S.*)"
)
_MONTH = re.compile(
    r"\s*[\"\[(]?(?P<day>\d{1,2})[-/ ](?P<month>[A-Za-z]{3})[-/ ](?P<year>\d{4})[T ,;:\t]"
    + _CLOCK
    + "(?P<zone>)"
    + _RAW
)
_CTIME = re.compile(
    r"\s*[\"\[(]?(?:[A-Za-z]{3},? )?(?P<month>[A-Za-z]{3}) +(?P<day>\d{1,2}) "
    + _CLOCK
    + r" (?:(?P<zone>[A-Z]{3,4}) )?(?P<year>\d{4})"
    + _RAW
)
"""As C's asctime and the command date write it, perhaps with a fraction: "Tue Jul 17 12:48:36.971
2018"."""
_COMPACT = re.compile(
    r"\s*[\"\[(]?(?P<year>(?:19|20)\d{2})(?P<month>\d{2})(?P<day>\d{2})[T _-]?"
    r"(?P<hour>\d{2}):?(?P<minute>\d{2}):?(?P<second>\d{2}(?:\.\d{1,9})?)"
    r"(?P<zone>Z|[+-]\d{2}:?\d{2})?[\"\])]?"
    r"[\s,;>|]+(?P<raw>[$!]\S.*)"
)
"""A stamp without signs between its numbers, before a sentence: "20260501 120000+00:00
$WIMWV,…"."""
_SENTENCE = re.compile(r"[$!][A-Z]{2}[A-Z0-9]{3},[^*$!\"]*\*[0-9A-Fa-f]{2}")
_ANYWHERE = re.compile(
    r"(?<!\d)(?P<date>\d{4}[-/]\d{2}[-/]\d{2})[T "
    r",;\t]+(?P<time>\d{2}:\d{2}:\d{2}(?:[.,]\d{1,9})?)\s?"
    r"(?P<zone>Z|UTC|[+-]\d{2}:?\d{2})?(?![\d:])"
)
_UNIX = re.compile(
    r"(?<![\d.])(?P<whole>1\d{9})(?:\.(?P<part>\d{1,9})|(?P<rest>(?:\d{3}){0,3}))(?![\d.])"
)
"""Seconds, perhaps with a fraction, and milli-, micro- and nanoseconds since 1970."""
GIVEN_CLOCK = "they carry no time of their own: they are on the clock that was given"
NOTHING = " \t\x00\x02\x03\x1a"
"""What an empty line may hold."""
LONGEST = 2000
"""Characters of the longest line of an instrument; longer ones are something else."""
_SECONDS = re.compile(r"\d{10}(\.\d+)?")


class Defect(Enum):
    """Why a line gives no sample."""

    OTHER = auto()
    """It is no reading of the instrument: a menu, another message, noise."""
    CHECKSUM = auto()
    """Its checksum is wrong."""
    CUT = auto()
    """It begins as a reading, but is not whole."""
    BESIDE = auto()
    """It is another message of the instrument."""
    UNIT = auto()
    """It is a reading that states no unit of speed, which the user has to give."""


Sample: TypeAlias = tuple[Mapping[str, float], SampleFlag]
"""Values (SI, NaN or not there where missing) by names of schema.CHANNELS, and what the instrument
says of itself."""
Parse: TypeAlias = Callable[[str], Sample | Defect]
Split: TypeAlias = Callable[[str], tuple[str, str]]


@dataclass(frozen=True, kw_only=True)
class Instrument:
    """What an instrument's lines hold.

    Attributes:
        name: of the instrument, for messages.
        channels: names of schema.CHANNELS that its lines may have.
        parse: a line without its stamp → sample or defect.
        sensor: the instrument.
        described_by: the maker's description that `parse` follows, where no file of the instrument
            was at hand.
        splits: makes, for a file, what divides a line into stamp ("" where there is none; ISO 8601
            or Unix time) and the rest.
    """

    name: str
    channels: tuple[str, ...]
    parse: Parse
    sensor: Sensor
    described_by: str | None = None
    splits: Callable[[], Split] = lambda: split_stamp


@dataclass
class _Gathered:
    channels: dict[str, array[float]]
    stamps: list[str] = field(default_factory=list)
    line: list[int] = field(default_factory=list)
    flags: list[int] = field(default_factory=list)
    unstamped: list[int] = field(default_factory=list)
    defects: dict[Defect, list[int]] = field(
        default_factory=lambda: {defect: [] for defect in Defect}
    )
    last: int = 0


@lru_cache(maxsize=2048)
def split_stamp(line: str) -> tuple[str, str]:
    """Splits a line into the stamp that a computer wrote before it ("" where there is none) and the
    rest, out of its quotes.

    The stamp of an NMEA sentence may stand anywhere in its line.
    """
    if line.startswith("\\"):
        instant = tag_time(line)
        fraction = f".{instant % 1000:03d}" if instant is not None and instant % 1000 else ""
        return (
            ("", line)
            if instant is None
            else (f"{instant // 1000}{fraction}", line[line.rfind("\\") + 1 :])
        )
    match = _STAMP.match(line)
    if match is not None:
        stamp, raw = (
            f"{match['date']}T{match['time']}{match['zone'] or ''}",
            _unquote_text(match["raw"]),
        )
        return stamp, _AFTER.sub("", raw) if raw.startswith(("$", "!")) else raw
    match = _MONTH.match(line) or _CTIME.match(line)
    if match is not None and match["month"].lower() in ENGLISH:
        month = ENGLISH.index(match["month"].lower()) + 1
        east = {"UTC": 0, "GMT": 0, **ABBREVIATED}.get(match["zone"] or "")
        zone = "" if east is None else f"{east:+03d}:00"
        return (
            f"{match['year']}-{month:02d}-{match['day']:0>2}T{match['time']}{zone}",
            _unquote_text(match["raw"]),
        )
    match = _COMPACT.match(line)
    if match is not None:
        stamp = "{year}-{month}-{day}T{hour}:{minute}:{second}".format(**match.groupdict()) + (
            match["zone"] or ""
        )
        return stamp, _AFTER.sub("", match["raw"])
    match = _EPOCH.match(line)
    if match is not None:
        return match["epoch"], _unquote_text(match["raw"])
    sentences = _SENTENCE.findall(line)
    if len(sentences) == 1:
        stamp = _stamp_of(_SENTENCE.sub(" ", line))
        if stamp:
            return stamp, sentences[0]
    return "", _unquote_text(line)


def _stamp_of(text: str) -> str:
    """Returns the stamp in a line without its sentence; "" where there is none."""
    if (match := _ANYWHERE.search(text)) is not None:
        zone = "Z" if match["zone"] == "UTC" else match["zone"] or ""
        return f"{match['date'].replace('/', '-')}T{match['time'].replace(',', '.')}{zone}"
    match = _UNIX.search(text)
    part = "" if match is None else match["part"] or match["rest"]
    return "" if match is None else f"{match['whole']}.{part}" if part else match["whole"]


def most_stamped(head: Head) -> bool:
    """Checks whether most lines are an NMEA 0183 sentence after a computer's stamp."""
    lines = without_comments(head.lines)
    split = [split_stamp(line) for line in lines]
    stamped = sum(bool(stamp) and raw.startswith(("$", "!")) for stamp, raw in split)
    return stamped >= max(1, len(lines) // 2)


def without_comments(lines: Sequence[str]) -> list[str]:
    """Returns the lines without those that a program marked as its own, by "#"."""
    return [line for line in lines if not is_comment(line)]


def is_comment(line: str) -> bool:
    """Checks whether a line is marked by "#" as a program's own."""
    return line.lstrip().startswith("#")


def read_lines(source: TextFile, instrument: Instrument, *, zone_name: str | None) -> Reading:
    """Read all lines of an instrument.

    Raises:
        InputError: hardly a line is a reading.
        TimeError: the lines carry no time, or stamps without a zone and none named.
    """
    where = str(source.path)
    gathered = _gather(source, instrument)
    count = len(gathered.line)
    if gathered.defects[Defect.UNIT]:
        raise UsageError(
            f"the lines of {instrument.name} state no unit of speed",
            where=f"{where}, line {gathered.defects[Defect.UNIT][0]}",
            fix="give the one that the instrument is set to: --unit m/s (or km/h, mph, kn)",
        )
    if count == 0 and gathered.unstamped:
        raise TimeError(
            f"the lines of {instrument.name} carry no time",
            where=f"{where}, line {gathered.unstamped[0]}",
            fix="log each line after the computer's stamp: 2026-05-01T12:00:00.123Z,LINE; if the "
            "readings came at a "
            "steady rate that is known: --start TIME --rate HZ, with the instant of the first",
        )
    if count == 0:
        bad = sum(len(places) for places in gathered.defects.values())
        raise InputError(
            f"none of {bad} lines is a reading of {instrument.name}",
            where=where,
            fix="a stamp before each line is known as 2026-05-01T12:00:00 or 2026/05/01 12:00:00: "
            "write it so; or "
            "look at the lines with flagdata ingest --sniff",
        )
    stamps = stamps_of(gathered.stamps)
    line = np.array(gathered.line, dtype=np.int64)
    keep = stamps.valid
    time, findings = instants(
        stamps.ns[keep], stamps.utc[keep], line=line[keep], zone_name=zone_name, where=where
    )
    flags = np.array(gathered.flags, dtype=np.uint16)[keep]
    channels, about = _channels(gathered, line, keep)
    if not channels:
        raise InputError(
            f"every reading of {instrument.name} is empty",
            where=f"{where}, line {line[0]}",
            fix="check the sensor",
        )
    flags |= _missing(channels)
    return Reading(
        time=time,
        channels=channels,
        flags=flags,
        line=line[keep],
        sensor=instrument.sensor,
        step=stamps.step,
        findings=(
            *findings,
            *_findings(gathered, instrument, flags, line[keep], int((~keep).sum())),
            *about,
        ),
    )


def stamps_of(texts: Sequence[str]) -> Stamps:
    """Stamps of `split_stamp` as instants, all in the form of the first."""
    first = texts[0]
    form = "epoch-s" if _SECONDS.fullmatch(first) else "epoch-ms" if first.isdigit() else "iso"
    return parse_stamps(texts, form)


def turn_directions(reading: Reading, azimuth: float | None, *, where: str) -> Reading:
    """Directions relative to the instrument's north mark, by the azimuth of that mark [rad].

    Raises:
        UsageError: an azimuth, but no direction.
    """
    if "wind_direction" not in reading.channels:
        if azimuth is None:
            return reading
        raise UsageError(
            "an azimuth was given, but the lines hold components in the instrument's own axes",
            where=where,
            fix="leave out --azimuth, or have the instrument send speed and direction",
        )
    text = "directions are relative to the instrument's north mark, which is taken to point north"
    fix: str | None = "if it does not, give the direction it points to: --azimuth DEG"
    channels = dict(reading.channels)
    if azimuth is not None:
        channels["wind_direction"] = np.mod(channels["wind_direction"] + azimuth, 2 * np.pi)
        text = (
            f"directions are turned by the azimuth of the north mark, {np.degrees(azimuth):.1f}°, "
            "as given"
        )
        fix = None
    finding = Finding.of("north-mark", text, fix=fix)
    return replace(reading, channels=channels).with_findings((finding,))


def _unquote_text(raw: str) -> str:
    raw = raw.strip(" \t")
    return raw[1:-1].replace('""', '"') if len(raw) > 1 and raw[0] == raw[-1] == '"' else raw


def _gather(source: TextFile, instrument: Instrument) -> _Gathered:
    gathered = _Gathered(channels={name: array("d") for name in instrument.channels})
    split = instrument.splits()
    for first, lines in source.blocks():
        for number, text in enumerate(lines, start=first):
            if not text.strip(NOTHING):
                continue
            gathered.last = number
            stamp, raw = split(text)
            sample = instrument.parse(raw) if len(raw) <= LONGEST else Defect.OTHER
            if isinstance(sample, Defect):
                gathered.defects[sample].append(number)
            elif not stamp:
                gathered.unstamped.append(number)
            else:
                gathered.stamps.append(stamp)
                gathered.line.append(number)
                gathered.flags.append(sample[1])
                for name, column in gathered.channels.items():
                    column.append(sample[0].get(name, np.nan))
    return gathered


def _channels(
    gathered: _Gathered, line: IntArray, keep: BoolArray
) -> tuple[dict[str, FloatArray], list[Finding]]:
    channels: dict[str, FloatArray] = {}
    findings: list[Finding] = []
    for name, column in gathered.channels.items():
        values = np.frombuffer(column, dtype=np.float64)[keep].copy()
        if not np.isfinite(values).any():
            continue
        if CHANNELS[name].unit == "rad" and CHANNELS[name].frame.startswith("from"):
            values, beyond = rules.direction(name, values, line[keep])
            values = np.mod(values, 2 * np.pi)
            findings.extend(beyond)
        channels[name] = values
    return channels, findings


def _missing(channels: dict[str, FloatArray]) -> NDArray[np.uint16]:
    """Returns the flag MISSING where there is neither a speed nor a pair of horizontal
    components."""
    speeds = [values for name, values in channels.items() if name.endswith("wind_speed")]
    pair = [channels[name] for name in ("wind_x", "wind_y") if name in channels]
    is_finite = [np.isfinite(values) for values in speeds]
    if len(pair) == 2 and not speeds:
        is_finite.append(np.isfinite(pair[0]) & np.isfinite(pair[1]))
    present = np.any(is_finite, axis=0) if is_finite else np.array(False)
    return np.where(present, np.uint16(0), np.uint16(SampleFlag.MISSING)).astype(np.uint16)


def _findings(
    gathered: _Gathered,
    instrument: Instrument,
    flags: NDArray[np.uint16],
    line: IntArray,
    unreadable: int,
) -> list[Finding]:
    findings: list[Finding] = []
    places = {defect: [n for n in numbers if n > 1] for defect, numbers in gathered.defects.items()}
    if places[Defect.CUT] and places[Defect.CUT][-1] == gathered.last:
        text = "the last line is incomplete, as when the logger lost power; left out"
        findings.append(Finding.of("cut-off", text, where=f"line {places[Defect.CUT].pop()}"))

    def note(numbers: Sequence[int], kind: str, severity: Severity, what: str) -> None:
        if len(numbers):
            text = f"{len(numbers)} {what}"
            findings.append(
                Finding(
                    kind=kind,
                    severity=severity,
                    count=len(numbers),
                    where=f"line {numbers[0]}",
                    what=text,
                )
            )

    note(
        places[Defect.CHECKSUM],
        "checksum-errors",
        Severity.ERROR,
        "lines with a wrong checksum; left out",
    )
    note(
        places[Defect.CUT],
        "malformed-lines",
        Severity.ERROR,
        f"incomplete lines of {instrument.name}; left out",
    )
    note(
        places[Defect.OTHER],
        "non-data-lines",
        Severity.WARNING,
        f"lines without a reading of {instrument.name}",
    )
    note(gathered.unstamped, "no-stamp", Severity.ERROR, "readings without a stamp; left out")
    note(
        places[Defect.BESIDE],
        "other-messages",
        Severity.NOTE,
        f"other messages of {instrument.name}; not read",
    )
    note(
        [0] * unreadable,
        "unreadable-stamps",
        Severity.ERROR,
        "readings whose stamp is no date; left out",
    )
    faults = line[(flags & SampleFlag.SENSOR_FAULT) != 0].tolist()
    note(
        faults,
        "sensor-fault",
        Severity.WARNING,
        "readings that the instrument marks as faulty; left out of averages",
    )
    missing = line[(flags & SampleFlag.MISSING) != 0].tolist()
    note(missing, "missing-values", Severity.WARNING, "readings without a wind speed")
    if instrument.described_by is not None:
        findings.append(followed_finding(instrument.described_by))
    return findings
