"""NMEA 0183 streams: wind from MWV and MWD, else VWR, VWT and MDA, time from the sentences around them.

Wind sentences carry no time. Each gets one by interpolating, over line numbers, between the time sentences (ZDA, RMC,
GGA, GLL, or the time of a TAG block), or that of its burst (`bursts`), and the flag TIME_UNSURE. MWV,R is wind past the
platform; MWV,T is "theoretical": what the instrument computed as if the platform did not move; both are relative to the
bow. They stay in channels of their own, and neither is ground truth unless the user says the platform is fixed. VWR,
VWT and MDA are what older instruments and weather stations send for MWV,R, MWV,T and MWD; beside these they are the
same wind again.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from flagdata.errors import InputError, UsageError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.formats import over_ground
from flagdata.ingest.anemometer.formats.marks import NO_TIME, NO_TIME_FIX, Placed, TimeLine
from flagdata.ingest.anemometer.formats.sentences import (
    SPEED_UNITS,
    ChecksumError,
    Sentence,
    number,
    speed_over_ground,
    split,
    tag_time,
    time_mark,
)
from flagdata.ingest.anemometer.formats.serial_lines import is_comment, most_stamped
from flagdata.ingest.anemometer.options import WindOptions
from flagdata.ingest.anemometer.reading import Reading
from flagdata.ingest.anemometer.samples import rules
from flagdata.ingest.anemometer.sniffing import Guess, Head
from flagdata.ingest.anemometer.text.source import TextFile
from flagdata.schema import SampleFlag
from flagdata.signals import Instants, Sensor
from flagdata.timebase import NANOSECONDS
from flagdata.units import UNITS

_OTHERS = {"VWR": "apparent_wind", "VWT": "theoretical_wind", "MDA": "wind"}
"""Older sentences → the wind they hold."""
_NEWER = {"apparent_wind": "MWV,R", "theoretical_wind": "MWV,T", "wind": "MWD"}
"""The sentences of the same winds that are read before them."""
WINDS = ("MWV", "MWD", *_OTHERS)
_BEFORE = re.compile(r"(?=[^$!]*\d[^$!]*\d)(?!\\)[^$!]*(?=[$!])")
"""What stands before a sentence and holds numbers, as a stamp would."""
_CHANNELS = (
    "apparent_wind_speed", "apparent_wind_direction", "theoretical_wind_speed", "theoretical_wind_direction",
    "wind_speed", "wind_direction", "wind_direction_magnetic",
)  # fmt: skip


@dataclass
class _Stream:
    """What one pass over the lines gathers."""

    line: list[int] = field(default_factory=list)
    values: list[dict[str, float]] = field(default_factory=list)
    flags: list[int] = field(default_factory=list)
    times: TimeLine = field(default_factory=TimeLine)
    kinds: Counter[str] = field(default_factory=Counter)
    talkers: list[str] = field(default_factory=list)
    silent: Counter[str] = field(default_factory=Counter)
    before: list[int] = field(default_factory=list)
    first_before: str = ""
    bad_checksums: list[int] = field(default_factory=list)
    unchecked: int = 0
    not_sentences: list[int] = field(default_factory=list)
    invalid: list[int] = field(default_factory=list)
    undirected: int = 0
    unstated: int = 0
    speeds: list[float] = field(default_factory=list)
    others: list[tuple[Sentence, int]] = field(default_factory=list)
    beside: Counter[str] = field(default_factory=Counter)
    sources: dict[str, set[str]] = field(default_factory=lambda: {wind: set() for wind in _NEWER})


class Nmea:
    """Format "nmea"."""

    name = "nmea"
    about = "NMEA 0183 sentences MWV and MWD, or VWR, VWT and MDA"
    uses = frozenset({"date", "platform", "azimuth", "talker"})

    def recognise(self, head: Head) -> Guess | None:
        """Lines that are sentences, most of them with a right checksum, some of them of wind."""
        if most_stamped(head):
            return None  # they are of the format nmea-stamped
        right = checked = wrong = wind = 0
        for line in head.lines:
            try:
                sentence = split(line)
            except ChecksumError:
                wrong += 1
                continue
            if sentence is not None:
                right += 1
                checked += sentence.checked
                wind += sentence.kind in WINDS
        if right < max(1, len(head.lines) // 2):
            return None
        sure = " with right checksums" if checked == right else f", {checked or 'none'} of them with a checksum"
        more = f"; {wrong} more have a wrong one" if wrong or checked else ""
        reasons = (
            f"{right} of the first {len(head.lines)} lines are NMEA 0183 sentences{sure}{more}",
            f"{wind} of them are wind ({', '.join(WINDS)})",
        )
        fix = None if wind else no_wind(head.lines, self.name)
        return Guess(format="nmea", score=0.95 if wind else 0.3, reasons=reasons, fix=fix)

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """Read all wind sentences."""
        stream = _Stream()
        for first, lines in source.blocks():
            for at, line in enumerate(lines, start=first):
                if line.strip(" \t\x00") and not is_comment(line):
                    _take(stream, line, at, options.talker)
        _take_others(stream)
        _leave_silent(stream)
        where = str(source.path)
        if not stream.line:
            by = f" of the talker {options.talker}" if options.talker is not None else ""
            raise InputError(
                f"no valid sentence of wind ({', '.join(WINDS)}){by}{_others_seen(stream.kinds)}",
                where=where, fix="have the instrument send MWV, or check its baud rate if sentences are broken",
            )  # fmt: skip
        talkers = Counter(stream.talkers)
        if len(talkers) > 1:
            what = f"several talkers send wind: {', '.join(sorted(talkers))}; they are different instruments"
            fix = f"choose one, e.g. --talker {talkers.most_common(1)[0][0]}"
            if not stream.times.line:
                raise InputError(f"{what}, and {NO_TIME}", where=where, fix=f"{NO_TIME_FIX}; then {fix}")
            raise InputError(what, where=where, fix=fix)
        line = np.array(stream.line, dtype=np.int64)
        if options.clock == "sort":
            fix = "give --clock first or --clock last, or leave it out"
            raise UsageError("the lines of a stream are in the order in which they came", where=where, fix=fix)
        winds = [frozenset(row) for row in stream.values]
        once = len(set(winds)) == len(winds)
        placed = stream.times.place(line, date=options.date, where=where, choice=options.clock, once=once, winds=winds)
        channels = {
            name: np.array([row.get(name, np.nan) for row in stream.values], dtype=np.float64) for name in _CHANNELS
        }
        found: list[Finding] = []
        for name in channels:
            if name.endswith(("direction", "magnetic")):
                angle, impossible = rules.direction(name, channels[name], line)
                channels[name] = np.mod(angle, 2 * np.pi)
                found.extend(impossible)
        channels = {name: values for name, values in channels.items() if np.isfinite(values).any()}
        if not channels:
            raise InputError(
                "every wind sentence is empty or invalid", where=f"{where}, line {line[0]}", fix="check the sensor"
            )
        channels, about = over_ground.settled(
            channels, options, speeds=stream.speeds, source=_sources(stream, "wind"), where=where
        )
        flags = np.array(stream.flags, dtype=np.uint16) | np.uint16(SampleFlag.TIME_UNSURE)
        return Reading(
            time=placed.time, channels=channels, flags=flags, line=line,
            sensor=Sensor(name=f"NMEA 0183 talker {next(iter(talkers))}"), step=NANOSECONDS,
            stamped=False, findings=(*_kinds(stream, placed.time), *_findings(stream, placed), *found, about),
        )  # fmt: skip


def _take(stream: _Stream, line: str, at: int, talker: str | None) -> None:
    tagged = tag_time(line) if line.startswith("\\") else None
    try:
        sentence = split(line)
    except ChecksumError:
        stream.bad_checksums.append(at)
        return
    if sentence is None:
        stream.not_sentences.append(at)
        return
    if tagged is None and (before := _BEFORE.match(line)) is not None:
        stream.before.append(at)
        stream.first_before = stream.first_before or before[0].strip()
    stream.kinds[sentence.kind] += 1
    stream.times.bursts.sentence(f"{sentence.talker}{sentence.kind}", at)
    stream.unchecked += not sentence.checked
    if tagged is not None:
        stream.times.add_instant(at, tagged * 1_000_000)
    mark = time_mark(sentence)
    if mark is not None:
        stream.times.add(sentence.kind, at, mark)
    over_ground = speed_over_ground(sentence)
    if over_ground is not None:
        stream.speeds.append(over_ground)
    if talker is not None and sentence.talker != talker:
        return
    if sentence.kind == "MWV":
        _mwv(stream, sentence, at)
    elif sentence.kind == "MWD":
        _mwd(stream, sentence, at)
    elif sentence.kind in _OTHERS:
        stream.others.append((sentence, at))


def _take_others(stream: _Stream) -> None:
    """Sentences of older kinds, of each wind that the stream holds in no other."""
    known = {name for row in stream.values for name in row}
    added = False
    for sentence, at in stream.others:
        kind = _OTHERS[sentence.kind]
        if f"{kind}_speed" in known:
            stream.beside[sentence.kind] += 1
            continue
        added = True
        stream.sources[kind].add(sentence.kind)
        (_mda if kind == "wind" else _vwr)(stream, sentence, at)
    if added:
        _keep(stream, np.argsort(np.array(stream.line, dtype=np.int64), kind="stable").tolist())


def _leave_silent(stream: _Stream) -> None:
    """Leave out the sentences of talkers whose wind is empty in all of them, where another talker has one."""
    speaking = {talker for talker, row in zip(stream.talkers, stream.values, strict=True) if row}
    if speaking:
        stream.silent = Counter(talker for talker in stream.talkers if talker not in speaking)
        _keep(stream, [index for index, talker in enumerate(stream.talkers) if talker in speaking])


def _keep(stream: _Stream, order: Sequence[int]) -> None:
    stream.line = [stream.line[index] for index in order]
    stream.values = [stream.values[index] for index in order]
    stream.flags = [stream.flags[index] for index in order]
    stream.talkers = [stream.talkers[index] for index in order]


def _vwr(stream: _Stream, sentence: Sentence, at: int) -> None:
    """VWR and VWT: the angle to the left or right of the bow, then the speed in knots, m/s and km/h."""
    fields = sentence.fields
    if len(fields) < 4 or fields[1] not in ("L", "R", ""):
        stream.invalid.append(at)
        return
    kind = _OTHERS[sentence.kind]
    angle = number(fields[0])
    row: dict[str, float] = {}
    if angle is not None and fields[1]:
        row[f"{kind}_direction"] = float(np.radians(angle if fields[1] == "R" else -angle))
    speed = _speed(fields[2:])
    if speed is not None:
        row[f"{kind}_speed"] = speed
    _add(stream, sentence, at, row, SampleFlag.OK if speed is not None else SampleFlag.MISSING)


def _mda(stream: _Stream, sentence: Sentence, at: int) -> None:
    """MDA: of the composite of a weather station the direction (true, magnetic) and the speed (knots, m/s)."""
    fields = sentence.fields
    if len(fields) < 20:
        stream.invalid.append(at)
        return
    true, magnetic, speed = number(fields[12]), number(fields[14]), _speed(fields[16:20])
    row: dict[str, float] = {}
    if true is not None:
        row["wind_direction"] = float(np.radians(true))
    if magnetic is not None:
        row["wind_direction_magnetic"] = float(np.radians(magnetic))
    if speed is not None:
        row["wind_speed"] = speed
    _add(stream, sentence, at, row, SampleFlag.OK if speed is not None else SampleFlag.MISSING)


def _speed(fields: Sequence[str]) -> float | None:
    """The speed that pairs of a value and a letter hold [m/s], by the one that is written most finely."""
    known: list[tuple[float, float]] = []
    for text, letter in zip(fields[0::2], fields[1::2], strict=False):
        value, unit = number(text), SPEED_UNITS.get(letter)
        if value is not None and unit is not None:
            scale = UNITS[unit].scale
            known.append((scale * 10.0 ** -len(text.strip().partition(".")[2]), value * scale))
    return min(known)[1] if known else None


def _mwv(stream: _Stream, sentence: Sentence, at: int) -> None:
    fields = sentence.fields
    if len(fields) < 4 or fields[1] not in ("R", "T"):
        stream.invalid.append(at)
        return
    kind = "apparent" if fields[1] == "R" else "theoretical"
    stream.sources[f"{kind}_wind"].add(f"MWV,{fields[1]}")
    angle, speed, unit = number(fields[0]), number(fields[2]), SPEED_UNITS.get(fields[3])
    row: dict[str, float] = {}
    unstated = len(fields) == 4  # canboat's n2kd leaves the status out
    stream.unstated += unstated
    flag = SampleFlag.OK if unstated or fields[4] == "A" else SampleFlag.SENSOR_FAULT
    if angle is not None:
        row[f"{kind}_wind_direction"] = float(np.radians(angle))
    if speed is not None and unit is not None:
        row[f"{kind}_wind_speed"] = speed * UNITS[unit].scale
    else:
        flag |= SampleFlag.MISSING
    _add(stream, sentence, at, row, flag)


def _mwd(stream: _Stream, sentence: Sentence, at: int) -> None:
    fields = sentence.fields
    if len(fields) < 8:
        stream.invalid.append(at)
        return
    true, magnetic = number(fields[0]), number(fields[2])
    speed = _speed((fields[6], "M", fields[4], "N"))
    if true is None and magnetic is None:
        stream.undirected += 1
        return
    stream.sources["wind"].add("MWD")
    row: dict[str, float] = {}
    if true is not None:
        row["wind_direction"] = float(np.radians(true))
    if magnetic is not None:
        row["wind_direction_magnetic"] = float(np.radians(magnetic))
    flag = SampleFlag.OK
    if speed is None:
        flag = SampleFlag.MISSING
    else:
        row["wind_speed"] = speed
    _add(stream, sentence, at, row, flag)


def _add(stream: _Stream, sentence: Sentence, at: int, row: dict[str, float], flag: SampleFlag) -> None:
    stream.talkers.append(sentence.talker)
    stream.line.append(at)
    stream.values.append(row)
    stream.flags.append(int(flag))


def _kinds(stream: _Stream, time: Instants) -> tuple[Finding, ...]:
    """How many sentences of each kind of wind there are, and how far apart, where a stream holds several kinds."""
    parts: list[str] = []
    for prefix, kind in (("apparent_wind", "relative"), ("theoretical_wind", "theoretical"), ("wind", "over ground")):
        name = f"{kind} ({_sources(stream, prefix)})"
        at = [index for index, row in enumerate(stream.values) if f"{prefix}_speed" in row]
        if len(at) > 1:
            parts.append(f"{len(at)} {name}, one every {np.median(np.diff(time[at])) / NANOSECONDS:.3g} s")
        elif at:
            parts.append(f"1 {name}")
    if len(parts) < 2:
        return ()
    text = f"{len(stream.line)} wind sentences of {len(parts)} kinds: {'; '.join(parts)}"
    return (Finding(kind="wind-kinds", severity=Severity.NOTE, count=len(stream.line), what=text),)


def _sources(stream: _Stream, wind: str) -> str:
    """The sentences that a wind was read from."""
    return " and ".join(sorted(stream.sources[wind]))


def no_wind(lines: Sequence[str], format_name: str) -> str:
    """What to do with a log of which no sentence in these first lines is of wind."""
    kinds: Counter[str] = Counter()
    for line in lines:
        with suppress(ChecksumError):
            sentence = split(line)
            kinds.update([] if sentence is None else [sentence.kind])
    return (
        f"its first {len(lines)} lines hold no sentence of wind ({', '.join(WINDS)}){_others_seen(kinds)}: have the "
        f"instrument send MWV; if winds come later in the file: --as {format_name}"
    )


def _others_seen(kinds: Counter[str]) -> str:
    counted = ", ".join(f"{count} {kind}" for kind, count in kinds.most_common(6))
    return f"; there are {counted}" if counted else ""


def _findings(stream: _Stream, placed: Placed) -> tuple[Finding, ...]:
    count = len(stream.line)
    found = list(placed.findings)
    if placed.marks > 1:
        what = f"{count} wind sentences carry no time: interpolated between {placed.marks} {placed.kind} marks "
        what += f"{placed.spacing:g} s apart"
        kind = "time-interpolated"
        if placed.bursts:
            what = f"{count} wind sentences carry no time: sentences come in bursts {placed.spacing:g} s apart, with "
            what += f"one {placed.kind} in each, and each has the time of the {placed.kind} of its burst"
            kind = "time-of-burst"
        found.insert(0, Finding(kind=kind, severity=Severity.WARNING, count=count, value=placed.spacing, what=what))

    def note(places: list[int], kind: str, severity: Severity, what: str) -> None:
        if places:
            text = f"{len(places)} {what}"
            found.append(Finding(kind=kind, severity=severity, count=len(places), where=f"line {places[0]}", what=text))

    if stream.before:
        text = stream.first_before[:60]
        what = f"before {len(stream.before)} sentences stands no stamp that is known, as {text!r}; not read"
        found.append(Finding(kind="text-before-sentences", severity=Severity.WARNING, count=len(stream.before),
                             where=f"line {stream.before[0]}", what=what))  # fmt: skip
    for talker, silent in stream.silent.items():
        what = f"the {silent} wind sentences of talker {talker} are empty; left out"
        found.append(Finding(kind="sentences-not-read", severity=Severity.NOTE, count=silent, what=what))
    note(stream.bad_checksums, "checksum-errors", Severity.ERROR, "sentences with a wrong checksum; left out")
    note(stream.not_sentences, "malformed-lines", Severity.WARNING, "lines that are no sentence; left out")
    note(stream.invalid, "malformed-sentences", Severity.ERROR, "wind sentences with fields missing; left out")
    faults = sum(1 for flag in stream.flags if flag & SampleFlag.SENSOR_FAULT)
    if faults:
        text = f"{faults} wind sentences that the instrument itself marks invalid; left out of averages"
        found.append(Finding(kind="sensor-fault", severity=Severity.WARNING, count=faults, what=text))
    if stream.unchecked:
        text = f"{stream.unchecked} sentences without a checksum; taken as they are"
        found.append(Finding(kind="no-checksum", severity=Severity.WARNING, count=stream.unchecked, what=text))
    if stream.unstated:
        text = f"{stream.unstated} MWV sentences without a status; taken as valid"
        found.append(Finding(kind="no-status", severity=Severity.WARNING, count=stream.unstated, what=text))
    for kind, number_of in stream.beside.items():
        text = f"{number_of} {kind} sentences are not read: {_NEWER[_OTHERS[kind]]} is read for that wind"
        found.append(Finding(kind="sentences-not-read", severity=Severity.NOTE, count=number_of, what=text))
    if stream.undirected:
        text = f"{stream.undirected} MWD sentences without a direction: no wind over ground, not read"
        found.append(Finding(kind="mwd-without-direction", severity=Severity.NOTE, count=stream.undirected, what=text))
    missing = sum(1 for flag in stream.flags if flag & SampleFlag.MISSING)
    if missing:
        text = f"{missing} wind sentences without a speed"
        found.append(Finding(kind="missing-values", severity=Severity.WARNING, count=missing, what=text))
    return tuple(found)
