"""NMEA 0183 streams: wind from MWV and MWD, else VWR, VWT and MDA, time from the sentences around
them.

Wind sentences carry no time. Each gets one by interpolating, over line numbers, between the time
sentences (ZDA, RMC, GGA, GLL), or that of its burst (`bursts`), and the flag TIME_UNSURE. MWV,R is
wind past the platform; MWV,T is "theoretical": what the instrument computed as if the platform did
not move; both are relative to the bow. They stay in channels of their own, and neither is ground
truth unless the user says the platform is fixed. VWR, VWT and MDA are what older instruments and
weather stations send for MWV,R, MWV,T and MWD; beside these they are the same wind again.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np

from flagdata.core.findings import Finding, Severity
from flagdata.core.schema import SampleFlag
from flagdata.core.shell import command_line
from flagdata.core.units import UNITS
from flagdata.errors import InputError, UsageError
from flagdata.ingest.anemometer.formats.marks import NO_TIME_FIX, Placed, TimeLine
from flagdata.ingest.anemometer.formats.nmea_sentences import (
    SPEED_UNITS,
    ChecksumError,
    Sentence,
    number,
    speed_over_ground,
    split,
    time_mark,
)
from flagdata.ingest.anemometer.formats.serial_lines import (
    is_comment,
    most_stamped,
)
from flagdata.ingest.anemometer.log_reading import Reading
from flagdata.ingest.anemometer.samples import rules
from flagdata.ingest.anemometer.samples.platform import settle_platform
from flagdata.ingest.anemometer.sniffing import Guess, Head
from flagdata.ingest.anemometer.text.text_file import TextFile
from flagdata.ingest.anemometer.wind_options import WindOptions
from flagdata.record.signals import Instants, Sensor, Series
from flagdata.timebase import NANOSECONDS

_OTHERS = {"VWR": "apparent_wind", "VWT": "theoretical_wind", "MDA": "wind"}
"""Older sentences → the wind they hold."""
_NEWER = {"apparent_wind": "MWV,R", "theoretical_wind": "MWV,T", "wind": "MWD"}
"""The sentences of the same winds that are read before them."""
WINDS = ("MWV", "MWD", *_OTHERS)
_FIELDS = {"MWV": 4, "MWD": 8, "VWR": 4, "VWT": 4, "MDA": 20}
"""Fields that a sentence has at least."""
_SIDES = {"MWV": ("R", "T"), "VWR": ("L", "R", ""), "VWT": ("L", "R", "")}
_BEFORE = re.compile(r"(?=[^$!]*\d[^$!]*\d)(?!\\)[^$!]*(?=[$!])")
"""What stands before a sentence and holds numbers, as a stamp would."""
_CHANNELS = (
    "apparent_wind_speed",
    "apparent_wind_direction",
    "theoretical_wind_speed",
    "theoretical_wind_direction",
    "wind_speed",
    "wind_direction",
    "wind_direction_magnetic",
)


@dataclass
class Stream:
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
    older: list[tuple[Sentence, int]] = field(default_factory=list)
    unread: Counter[str] = field(default_factory=Counter)
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
        sure = (
            " with right checksums"
            if checked == right
            else f", {checked or 'none'} of them with a checksum"
        )
        wrong_ones = f"; {wrong} more have a wrong one" if wrong or checked else ""
        reasons = (
            (
                f"{right} of the first {len(head.lines)} lines are NMEA 0183 "
                f"sentences{sure}{wrong_ones}"
            ),
            f"{wind} of them are wind ({', '.join(WINDS)})",
        )
        fix = None if wind else no_wind(head.lines, self.name)
        return Guess(format="nmea", score=0.95 if wind else 0.3, reasons=reasons, fix=fix)

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """Read all wind sentences."""
        where = str(source.path)
        stream = gather_sentences(source, options, lambda number, line: line)
        line = np.array(stream.line, dtype=np.int64)
        winds = [frozenset(row) for row in stream.values]
        placed = stream.times.place(
            line, date=options.date, where=where, choice=options.clock, winds=winds
        )
        reading = reading_of(stream, placed.time, options, where=where)
        flags = reading.flags | np.uint16(SampleFlag.TIME_UNSURE)
        found = _placed_findings(len(line), placed)
        return replace(reading, flags=flags, findings=(*found, *reading.findings))


def gather_sentences(
    source: TextFile,
    options: WindOptions,
    divide: Callable[[int, str], str],
    *,
    timed: bool = False,
) -> Stream:
    """Gathers the wind sentences of one talker.

    Args:
        divide: number and text of a line → the sentence in it.
        timed: whether each line has a stamp.

    Raises:
        InputError: no wind, or that of several talkers.
        UsageError: an order that a stream cannot have.
    """
    stream, where = Stream(), str(source.path)
    for first, lines in source.blocks():
        for at, line in enumerate(lines, start=first):
            if line.strip(" \t\x00") and not is_comment(line):
                _take(stream, divide(at, line), at, options.talker)
    _take_others(stream)
    _leave_silent(stream)
    if not stream.line:
        by = f" of the talker {options.talker}" if options.talker is not None else ""
        message = f"no valid sentence of wind ({', '.join(WINDS)}){by}{_others_seen(stream.kinds)}"
        fix = "have the instrument send MWV, or check its baud rate if sentences are broken"
        raise InputError(message, where=where, fix=fix)
    talkers = Counter(stream.talkers)
    if len(talkers) > 1:
        message = (
            f"several talkers send wind: {', '.join(sorted(talkers))}; they are different "
            "instruments"
        )
        fix = f"choose one, e.g. {command_line('--talker', talkers.most_common(1)[0][0])}"
        if not timed and not stream.times.line:
            raise InputError(
                f"{message}, and the lines have no time",
                where=where,
                fix=f"{NO_TIME_FIX}; then {fix}",
            )
        raise InputError(message, where=where, fix=fix)
    if options.clock == "sort":
        fix = "give --clock first or --clock last, or leave it out"
        raise UsageError(
            "the lines of a stream are in the order in which they came", where=where, fix=fix
        )
    return stream


def reading_of(stream: Stream, time: Instants, options: WindOptions, *, where: str) -> Reading:
    """Builds the reading of a stream's sentences at these instants (n,).

    Raises:
        InputError: all are empty, or a platform that was given as fixed moves.
        UsageError: an azimuth that nothing can be turned by.
    """
    line = np.array(stream.line, dtype=np.int64)
    channels: dict[str, Series] = {}
    findings: list[Finding] = []
    for name in _CHANNELS:
        values = np.array([row.get(name, np.nan) for row in stream.values], dtype=np.float64)
        if name.endswith(("direction", "magnetic")):
            angle, impossible = rules.direction(name, values, line)
            values = np.mod(angle, 2 * np.pi)
            findings.extend(impossible)
        if np.isfinite(values).any():
            channels[name] = values
    if not channels:
        fix = "check that the sensor is connected and gives valid data"
        raise InputError(
            "every wind sentence is empty or invalid", where=f"{where}, line {line[0]}", fix=fix
        )
    source = _sources(stream, "wind")
    channels, about = settle_platform(
        channels, options, speeds=stream.speeds, source=source, where=where
    )
    return Reading(
        time=time,
        channels=channels,
        flags=np.array(stream.flags, dtype=np.uint16),
        line=line,
        sensor=Sensor(name=f"NMEA 0183 talker {stream.talkers[0]}"),
        step=NANOSECONDS,
        stamped=False,
        findings=(*_kinds(stream, time), *_findings(stream), *findings, about),
    )


def _take(stream: Stream, line: str, at: int, talker: str | None) -> None:
    try:
        sentence = split(line)
    except ChecksumError:
        stream.bad_checksums.append(at)
        return
    if sentence is None:
        stream.not_sentences.append(at)
        return
    if (before := _BEFORE.match(line)) is not None:
        stream.before.append(at)
        stream.first_before = stream.first_before or before[0].strip()
    stream.kinds[sentence.kind] += 1
    stream.times.bursts.sentence(f"{sentence.talker}{sentence.kind}", at)
    stream.unchecked += not sentence.checked
    mark = time_mark(sentence)
    if mark is not None:
        stream.times.add(sentence.kind, at, mark)
    over_ground = speed_over_ground(sentence)
    if over_ground is not None:
        stream.speeds.append(over_ground)
    if talker is not None and sentence.talker != talker:
        return
    if sentence.kind in _OTHERS:
        stream.older.append((sentence, at))
    elif sentence.kind in WINDS:
        _wind(stream, sentence, at)


def _take_others(stream: Stream) -> None:
    """Sentences of older kinds, of each wind that the stream holds in no other."""
    channels = {name for row in stream.values for name in row}
    added = False
    for sentence, at in stream.older:
        kind = _OTHERS[sentence.kind]
        if f"{kind}_speed" in channels:
            stream.unread[sentence.kind] += 1
            continue
        added = True
        _wind(stream, sentence, at)
    if added:
        keep(stream, np.argsort(np.array(stream.line, dtype=np.int64), kind="stable").tolist())


def _leave_silent(stream: Stream) -> None:
    """Leaves out the sentences of talkers whose wind is empty in all of them, where another talker
    has one."""
    speaking = {talker for talker, row in zip(stream.talkers, stream.values, strict=True) if row}
    if speaking:
        stream.silent = Counter(talker for talker in stream.talkers if talker not in speaking)
        keep(stream, [index for index, talker in enumerate(stream.talkers) if talker in speaking])


def keep(stream: Stream, order: Sequence[int]) -> None:
    stream.line = [stream.line[index] for index in order]
    stream.values = [stream.values[index] for index in order]
    stream.flags = [stream.flags[index] for index in order]
    stream.talkers = [stream.talkers[index] for index in order]


def _wind(stream: Stream, sentence: Sentence, at: int) -> None:
    """Reads the wind of one sentence.

    MWV: the angle from the bow, R or T, the speed, its unit, a status. MWD: the direction true and
    magnetic, the speed in knots and m/s. VWR and VWT: the angle to the left or right of the bow,
    the speed in knots, m/s and km/h. MDA: of the composite of a weather station the direction true
    and magnetic, the speed in knots and m/s.
    """
    fields, kind = sentence.fields, sentence.kind
    if len(fields) < _FIELDS[kind] or (
        kind not in ("MWD", "MDA") and fields[1] not in _SIDES[kind]
    ):
        stream.invalid.append(at)
        return
    source, flag, magnetic = kind, SampleFlag.OK, None
    if kind in ("MWD", "MDA"):
        first = 0 if kind == "MWD" else 12
        wind, angle, magnetic = "wind", number(fields[first]), number(fields[first + 2])
        speed = _speed((fields[6], "M", fields[4], "N") if kind == "MWD" else fields[16:20])
        if kind == "MWD" and angle is None and magnetic is None:
            stream.undirected += 1
            return
    elif kind == "MWV":
        wind, source = (
            ("apparent_wind" if fields[1] == "R" else "theoretical_wind"),
            f"MWV,{fields[1]}",
        )
        angle, speed = number(fields[0]), _speed(fields[2:4])
        stream.unstated += len(fields) == 4  # canboat's n2kd leaves the status out
        flag = SampleFlag.OK if len(fields) == 4 or fields[4] == "A" else SampleFlag.SENSOR_FAULT
    else:
        wind, angle, speed = (
            _OTHERS[kind],
            number(fields[0]) if fields[1] else None,
            _speed(fields[2:]),
        )
        angle = -angle if angle is not None and fields[1] == "L" else angle
    angles = {f"{wind}_direction": angle, f"{wind}_direction_magnetic": magnetic}
    row = {name: float(np.radians(value)) for name, value in angles.items() if value is not None}
    row |= {} if speed is None else {f"{wind}_speed": speed}
    stream.sources[wind].add(source)
    stream.talkers.append(sentence.talker)
    stream.line.append(at)
    stream.values.append(row)
    stream.flags.append(int(flag if speed is not None else flag | SampleFlag.MISSING))


def _speed(fields: Sequence[str]) -> float | None:
    """Reads the speed that pairs of a value and a letter hold [m/s], by the one that is written
    most finely."""
    speeds: list[tuple[float, float]] = []
    for text, letter in zip(fields[0::2], fields[1::2], strict=False):
        value, unit = number(text), SPEED_UNITS.get(letter)
        if value is not None and unit is not None:
            scale = UNITS[unit].scale
            speeds.append((scale * 10.0 ** -len(text.strip().partition(".")[2]), value * scale))
    return min(speeds)[1] if speeds else None


def _kinds(stream: Stream, time: Instants) -> tuple[Finding, ...]:
    """Counts the sentences of each kind of wind, and how far apart they are, where a stream holds
    several kinds."""
    parts: list[str] = []
    for prefix, kind in (
        ("apparent_wind", "relative"),
        ("theoretical_wind", "theoretical"),
        ("wind", "over ground"),
    ):
        name = f"{kind} ({_sources(stream, prefix)})"
        at = [index for index, row in enumerate(stream.values) if f"{prefix}_speed" in row]
        if len(at) > 1:
            parts.append(
                f"{len(at)} {name}, one every {np.median(np.diff(time[at])) / NANOSECONDS:.3g} s"
            )
        elif at:
            parts.append(f"1 {name}")
    if len(parts) < 2:
        return ()
    text = f"{len(stream.line)} wind sentences of {len(parts)} kinds: {'; '.join(parts)}"
    return (Finding.of("wind-kinds", text, count=len(stream.line)),)


def _sources(stream: Stream, wind: str) -> str:
    """Names the sentences that a wind was read from."""
    return " and ".join(sorted(stream.sources[wind]))


def no_wind(lines: Sequence[str], format_name: str) -> str:
    """Explains what to do with a log of which no sentence in these first lines is of wind."""
    kinds: Counter[str] = Counter()
    for line in lines:
        with suppress(ChecksumError):
            sentence = split(line)
            kinds.update([] if sentence is None else [sentence.kind])
    return (
        f"its first {len(lines)} lines hold no sentence of wind "
        f"({', '.join(WINDS)}){_others_seen(kinds)}: have the "
        f"instrument send MWV; if winds come later in the file: {command_line('--as', format_name)}"
    )


def _others_seen(kinds: Counter[str]) -> str:
    counted = ", ".join(f"{count} {kind}" for kind, count in kinds.most_common(6))
    return f"; there are {counted}" if counted else ""


def _placed_findings(count: int, placed: Placed) -> tuple[Finding, ...]:
    """Reports sentences that have their time from others."""
    if placed.marks < 2:
        return placed.findings
    kind, message = (
        "time-interpolated",
        f"interpolated between {placed.marks} {placed.kind} marks {placed.spacing:g} s apart",
    )
    if placed.bursts:
        kind, message = (
            "time-of-burst",
            f"sentences come in bursts {placed.spacing:g} s apart, with one {placed.kind} in ",
        )
        message += f"each, and each has the time of the {placed.kind} of its burst"
    message = f"{count} wind sentences carry no time: {message}"
    finding = Finding(
        kind=kind, severity=Severity.WARNING, count=count, value=placed.spacing, what=message
    )
    return (finding, *placed.findings)


def _findings(stream: Stream) -> tuple[Finding, ...]:
    findings: list[Finding] = []

    def note(rows: Sequence[int] | int, kind: str, severity: Severity, message: str) -> None:
        count, at = (
            (rows, None) if isinstance(rows, int) else (len(rows), rows[0] if rows else None)
        )
        if count:
            where = None if at is None else f"line {at}"
            findings.append(
                Finding(
                    kind=kind,
                    severity=severity,
                    count=count,
                    where=where,
                    what=f"{count} {message}",
                )
            )

    before = (
        f"sentences follow text that is not a timestamp, as in {stream.first_before[:60]!r}; the "
        "text was not read"
    )
    note(stream.before, "text-before-sentences", Severity.WARNING, before)
    for talker, silent in stream.silent.items():
        note(
            silent,
            "sentences-not-read",
            Severity.NOTE,
            f"wind sentences of talker {talker} are empty; left out",
        )
    note(
        stream.bad_checksums,
        "checksum-errors",
        Severity.ERROR,
        "sentences with a wrong checksum; left out",
    )
    note(
        stream.not_sentences,
        "malformed-lines",
        Severity.WARNING,
        "lines that are no sentence; left out",
    )
    note(
        stream.invalid,
        "malformed-sentences",
        Severity.ERROR,
        "wind sentences with fields missing; left out",
    )
    faults = sum(bool(flag & SampleFlag.SENSOR_FAULT) for flag in stream.flags)
    message = "wind sentences that the instrument itself marks invalid; left out of averages"
    note(faults, "sensor-fault", Severity.WARNING, message)
    note(
        stream.unchecked,
        "no-checksum",
        Severity.WARNING,
        "sentences without a checksum; taken as they are",
    )
    note(
        stream.unstated,
        "no-status",
        Severity.WARNING,
        "MWV sentences without a status; taken as valid",
    )
    for kind, number_of in stream.unread.items():
        message = f"{kind} sentences are not read: {_NEWER[_OTHERS[kind]]} is read for that wind"
        note(number_of, "sentences-not-read", Severity.NOTE, message)
    message = "MWD sentences without a direction: no wind over ground, not read"
    note(stream.undirected, "mwd-without-direction", Severity.NOTE, message)
    missing = sum(bool(flag & SampleFlag.MISSING) for flag in stream.flags)
    note(missing, "missing-values", Severity.WARNING, "wind sentences without a speed")
    return tuple(findings)
