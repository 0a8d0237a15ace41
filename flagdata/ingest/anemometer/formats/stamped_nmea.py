"""NMEA 0183 streams whose sentences a computer stamped.

In the format "nmea-stamped" each sentence has the stamp of the computer that logged it:
"2026-05-01T12:00:00.123Z,$WIMWV,…". So log LCJ CV7, Calypso, Gill, Vaisala and other instruments
whose sentences carry no time themselves; a TAG block (IEC 61162-450, parameter "c") is such a stamp
too. Sources for the instruments: LCJ Capteurs, CV7 user manual (MWV relative, and XDR); Calypso
Instruments, ULP STD user manual, 3.1 (data format NMEA 0183).
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace

import numpy as np

from flagdata.core.findings import Finding, Severity
from flagdata.errors import InputError
from flagdata.ingest.anemometer.formats.nmea import (
    WINDS,
    gather_sentences,
    keep,
    no_wind,
    reading_of,
)
from flagdata.ingest.anemometer.formats.nmea_sentences import (
    ChecksumError,
    split,
    time_mark,
)
from flagdata.ingest.anemometer.formats.serial_lines import (
    GIVEN_CLOCK,
    split_stamp,
    stamps_of,
    without_comments,
)
from flagdata.ingest.anemometer.instants.zones import instants
from flagdata.ingest.anemometer.log_reading import Reading
from flagdata.ingest.anemometer.sniffing import Guess, Head
from flagdata.ingest.anemometer.text.text_file import TextFile
from flagdata.ingest.anemometer.wind_options import WindOptions
from flagdata.timebase import NANOSECONDS

_OFF = 60.0
"""Median difference of a receiver's time from the stamps that no delay of a serial line explains
[s]."""
_REPORTED = 2.0
"""Median difference that is worth a word [s]: clips are paired with winds by the second."""


class StampedNmea:
    """Format "nmea-stamped"."""

    name = "nmea-stamped"
    about = "NMEA 0183 sentences of wind, each after a computer's stamp"
    uses = frozenset({"zone", "platform", "azimuth", "talker"})

    def recognise(self, head: Head) -> Guess | None:
        """Lines of a stamp and a sentence, some of them of wind."""
        lines = [split_stamp(line) for line in without_comments(head.lines)]
        kinds: list[str] = []
        for stamp, raw in lines:
            with suppress(ChecksumError):
                sentence = split(raw) if stamp and raw.startswith(("$", "!")) else None
                kinds += [] if sentence is None else [sentence.kind]
        if len(kinds) < max(1, len(lines) // 2):
            return None
        wind = sum(kind in WINDS for kind in kinds)
        message = (
            f"NMEA 0183 sentences; {GIVEN_CLOCK}"
            if head.counted
            else "a computer's stamp and an NMEA 0183 sentence"
        )
        reasons = (
            f"{len(kinds)} of the first {len(lines)} lines are {message}",
            f"{wind} of them are wind ({', '.join(WINDS)})",
        )
        fix = None if wind else no_wind([raw for _, raw in lines], self.name)
        return Guess(format=self.name, score=0.96 if wind else 0.3, reasons=reasons, fix=fix)

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """Read all wind sentences, each at its own stamp."""
        where = str(source.path)
        texts: dict[int, str] = {}
        marks: dict[int, int] = {}

        def divide(number: int, line: str) -> str:
            stamp, raw = split_stamp(line)
            if stamp and raw.startswith(("$", "!")):
                texts[number] = stamp
                instant = _mark(raw)
                marks.update({} if instant is None else {number: instant})
            return raw

        stream = gather_sentences(source, options, divide, timed=True)
        if not texts:
            raise InputError(
                "no line has an NMEA 0183 sentence after a stamp",
                where=where,
                fix="name another format by --as",
            )
        stamps = stamps_of(list(texts.values()))
        line = np.array(list(texts), dtype=np.int64)[stamps.valid]
        time, findings = instants(
            stamps.ns[stamps.valid],
            stamps.utc[stamps.valid],
            line=line,
            zone_name=options.zone,
            where=where,
        )
        at = dict(zip(line.tolist(), time.tolist(), strict=True))
        timed = [index for index, number in enumerate(stream.line) if number in at]
        dropped = len(stream.line) - len(timed)
        keep(stream, timed)
        if dropped:
            message = f"{dropped} wind sentences without a stamp; left out"
            findings = (*findings, Finding.of("no-stamp", message, count=dropped))
        reading = reading_of(
            stream, np.array([at[number] for number in stream.line], np.int64), options, where=where
        )
        findings = (*findings, *reading.findings, *_receiver(at, marks))
        return replace(reading, step=stamps.step, findings=findings)


def _mark(text: str) -> int | None:
    """Reads the instant [UTC ns] that a sentence states; `None` for one without a date, and for a
    damaged one."""
    if not text[3:7].startswith(("ZDA,", "RMC,")):
        return None
    try:
        sentence = split(text)
    except ChecksumError:
        return None
    mark = None if sentence is None else time_mark(sentence)
    if mark is None or mark.date is None:
        return None
    day = np.datetime64("-".join(f"{part:02d}" for part in mark.date), "D").astype(np.int64)
    return int(day) * 86_400 * NANOSECONDS + mark.clock


def _receiver(stamps: Mapping[int, int], marks: Mapping[int, int]) -> tuple[Finding, ...]:
    """Reports a satellite receiver whose time is another than that of the stamps; nothing where
    they agree."""
    off = [(at, (mark - stamps[at]) / NANOSECONDS) for at, mark in marks.items() if at in stamps]
    median = float(np.median([seconds for _, seconds in off])) if off else 0.0
    if abs(median) < _REPORTED:
        return ()
    size = f"{abs(median) / 3600:.3g} h" if abs(median) >= 3600 else f"{abs(median):.1f} s"
    side = "behind" if median < 0 else "before"
    return (
        Finding(
            kind="receiver-clock-off",
            severity=Severity.WARNING if abs(median) >= _OFF else Severity.NOTE,
            count=len(off),
            value=median,
            where=f"line {off[0][0]}",
            what=f"the satellite receiver's time (RMC, ZDA) is {size} {side} the stamps of the "
            "lines, which are taken",
            fix="check the zone of the stamps and the computer's clock; for the receiver's time, "
            "take the stamps out",
        ),
    )
