"""NMEA 0183 sentences, each after the stamp of the computer that logged it: "2026-05-01T12:00:00.123Z,$WIMWV,…".

So log LCJ CV7, Calypso, Gill, Vaisala and other instruments whose sentences carry no time themselves. The stamps are
handed to the reader of NMEA streams as TAG blocks (IEC 61162-450, parameter "c", Unix milliseconds); what the sentences
mean is said in nmea.py. Sources for the instruments: LCJ Capteurs, CV7 user manual (MWV relative, and XDR); Calypso
Instruments, ULP STD user manual, 3.1 (data format NMEA 0183).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from flagdata.errors import InputError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.formats import receiver_clock
from flagdata.ingest.anemometer.formats.nmea import WINDS, Nmea, no_wind
from flagdata.ingest.anemometer.formats.sentences import ChecksumError, checksum, split
from flagdata.ingest.anemometer.formats.serial_lines import GIVEN_CLOCK, split_stamp, stamps_of, without_comments
from flagdata.ingest.anemometer.instants.zones import instants
from flagdata.ingest.anemometer.options import WindOptions
from flagdata.ingest.anemometer.reading import Reading
from flagdata.ingest.anemometer.sniffing import Guess, Head
from flagdata.ingest.anemometer.text.source import TextFile
from flagdata.schema import SampleFlag

_MILLISECOND = 1_000_000


class StampedNmea:
    """Format "nmea-stamped"."""

    name = "nmea-stamped"
    about = "NMEA 0183 sentences of wind, each after a computer's stamp"
    uses = frozenset({"zone", "platform", "azimuth", "talker"})

    def recognise(self, head: Head) -> Guess | None:
        """Lines of a stamp and a sentence, some of them of wind."""
        stamped, wind = count(head)
        lines = without_comments(head.lines)
        if stamped < max(1, len(lines) // 2):
            return None
        what = "a computer's stamp and an NMEA 0183 sentence"
        if head.counted:
            what = f"NMEA 0183 sentences; {GIVEN_CLOCK}"
        reasons = (
            f"{stamped} of the first {len(lines)} lines are {what}",
            f"{wind} of them are wind ({', '.join(WINDS)})",
        )
        fix = None if wind else no_wind([split_stamp(line)[1] for line in lines], self.name)
        return Guess(format=self.name, score=0.96 if wind else 0.3, reasons=reasons, fix=fix)

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """Read all wind sentences, each at its own stamp."""
        where = str(source.path)
        line: list[int] = []
        texts: list[str] = []
        marks: list[tuple[int, int]] = []
        for first, lines in source.blocks():
            for number, text in enumerate(lines, start=first):
                stamp, raw = split_stamp(text)
                if stamp and raw.startswith(("$", "!")):
                    line.append(number)
                    texts.append(stamp)
                    said = receiver_clock.mark(raw)
                    marks += [] if said is None else [(number, said)]
        if not line:
            raise InputError("no NMEA 0183 sentence after a stamp", where=where, fix="name another format by --as")
        stamps = stamps_of(texts)
        lines = np.array(line, dtype=np.int64)[stamps.valid]
        time, found = instants(
            stamps.ns[stamps.valid], stamps.utc[stamps.valid], line=lines, zone_name=options.zone, where=where
        )
        at = dict(zip(lines.tolist(), time.tolist(), strict=True))
        tagged = _Tagged(
            path=source.path, encoding=source.encoding, lines=source.lines, findings=source.findings, instants=at,
            source=source,
        )  # fmt: skip
        reading = Nmea().read(tagged, options)
        keep = np.array([number in at for number in reading.line.tolist()], dtype=bool)
        reading = reading.take(keep)
        kept = tuple(finding for finding in reading.findings if finding.kind != "time-interpolated")
        dropped = int((~keep).sum())
        if dropped:
            text = f"{dropped} wind sentences without a stamp; left out"
            kept = (*kept, Finding(kind="no-stamp", severity=Severity.ERROR, count=dropped, what=text))
        return replace(
            reading,
            time=np.array([at[number] for number in reading.line.tolist()], dtype=np.int64),
            flags=reading.flags & ~np.uint16(SampleFlag.TIME_UNSURE),
            step=stamps.step,
            findings=(*found, *kept, *receiver_clock.report(at, marks)),
        )


@dataclass(frozen=True, kw_only=True)
class _Tagged(TextFile):
    """The same lines with a TAG block in the place of the stamp.

    Attributes:
        instants: line → its stamp [UTC ns].
        source: whose lines they are, which may be other than the file's.
    """

    instants: Mapping[int, int]
    source: TextFile

    def blocks(self, size: int = 200_000) -> Iterator[tuple[int, list[str]]]:
        """See `TextFile.blocks`."""
        for first, lines in self.source.blocks(size):
            yield first, [self._tagged(number, text) for number, text in enumerate(lines, start=first)]

    def _tagged(self, number: int, text: str) -> str:
        instant = self.instants.get(number)
        if instant is None:
            return split_stamp(text)[1]
        block = f"c:{instant // _MILLISECOND:013d}"
        return f"\\{block}*{checksum(block):02X}\\{split_stamp(text)[1]}"


def count(head: Head) -> tuple[int, int]:
    """Numbers of lines that are a stamp and a sentence, and of those that are wind."""
    stamped = wind = 0
    for text in head.lines:
        stamp, raw = split_stamp(text)
        if not stamp or not raw.startswith(("$", "!")):
            continue
        try:
            sentence = split(raw)
        except ChecksumError:
            continue
        if sentence is not None:
            stamped += 1
            wind += sentence.kind in WINDS
    return stamped, wind
