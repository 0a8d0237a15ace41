"""NMEA sentences within lines that say more: in quotes, before their stamp, behind a number or a stamp as `date` writes
it. Each line is put as its stamp in ISO 8601 and the sentence, which the reader of stamped sentences takes.

    "2026-05-01 12:00:00","$WIMWV,200.0,T,3.5,M,A*2C"           17,2026-05-01 12:00:00,$WIMWV,…
    $WIMWV,200.0,T,3.5,M,A*2C,2026-05-01T12:00:00Z              <2026-05-01 12:00:00> $WIMWV,…
    Fri May  1 12:00:00 UTC 2026 $WIMWV,…                       2026 121 120000 $WIMWV,…
    1777636800123456 $WIMWV,…

Lines that the reader takes as they are stay as they are.
"""

from __future__ import annotations

import datetime as dt
import re
from collections.abc import Sequence

from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.formats.serial_lines import split_stamp
from flagdata.ingest.anemometer.instants.abbreviations import ABBREVIATED
from flagdata.ingest.anemometer.instants.month_names import ENGLISH
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_SENTENCE = re.compile(r"[$!][A-Z]{2}[A-Z0-9]{3},[^*$!\"]*\*[0-9A-Fa-f]{2}")
_ISO = re.compile(
    r"(?<!\d)(?P<date>\d{4}[-/]\d{2}[-/]\d{2})[T ,;\t]+(?P<time>\d{2}:\d{2}:\d{2}(?:[.,]\d{1,9})?)\s?"
    r"(?P<zone>Z|UTC|[+-]\d{2}:?\d{2})?(?![\d:])"
)
_DATE = re.compile(
    r"(?P<month>[A-Z][a-z]{2})\s+(?P<day>\d{1,2})\s+(?P<time>\d{2}:\d{2}:\d{2}(?:\.\d{1,9})?)\s+"
    r"(?P<zone>[A-Z]{3,4})\s+(?P<year>\d{4})(?!\d)"
)
_YEAR_AND_DAY = re.compile(
    r"(?<!\d)(?P<year>20\d{2})[ :,-](?P<day>[0-3]\d\d)[ :T,]"
    r"(?P<h>\d{2}):?(?P<m>\d{2}):?(?P<s>\d{2}(?:\.\d{1,9})?)(?!\d)"
)
_EPOCH = re.compile(r"(?<![\d.])(?P<epoch>1\d{9}(?:\.\d{1,9})?|1\d{12}|1\d{15}|1\d{18})(?![\d.])")
_LONG = {13: 3, 16: 6, 19: 9}
"""Digits of a Unix time, and how many of them are of the fraction of its second."""
_SHARE = 0.8
_LEAST = 3


def matches(lines: Sequence[str]) -> bool:
    """Whether most lines hold a sentence and a stamp, and most are none that the reader takes as they are."""
    filled = [line for line in lines if line.strip()]
    found = [line for line in filled if _SENTENCE.search(line)]
    if len(found) < max(_LEAST, _SHARE * len(filled)):
        return False
    plain = sum('"' not in line and bool(split_stamp(line)[0]) and split_stamp(line)[1][:1] in "$!\\" for line in found)
    return 2 * plain < len(found) and sum(rewritten(line) is not None for line in found) >= _SHARE * len(found)


def as_table(source: TextFile) -> TableText:
    """The lines with their stamps before their sentences."""
    text = [rewritten(line) or line for _, lines in source.blocks() for line in lines]
    before = next((line for line in source.head() if rewritten(line) is not None), "")
    what = f"stamps and sentences are taken out of their lines: {before.strip()[:80]!r} is read as "
    what += repr((rewritten(before) or "")[:80])
    return TableText.of(source, text, [Finding(kind="stamps-rewritten", severity=Severity.NOTE, what=what)])


def rewritten(line: str) -> str | None:
    """A line as its stamp in ISO 8601 and its sentence; `None` where it has not both, or two sentences."""
    found = _SENTENCE.findall(line)
    if len(found) != 1:
        return None
    stamp = _stamp(_SENTENCE.sub(" ", line))
    return None if stamp is None else f"{stamp} {found[0]}"


def _stamp(text: str) -> str | None:
    """The stamp of a line without its sentence."""
    if (match := _ISO.search(text)) is not None:
        zone = "Z" if match["zone"] == "UTC" else match["zone"] or ""
        return f"{match['date'].replace('/', '-')}T{match['time'].replace(',', '.')}{zone}"
    if (match := _DATE.search(text)) is not None and match["month"].lower() in ENGLISH:
        east = 0 if match["zone"] in ("UTC", "GMT") else ABBREVIATED.get(match["zone"])
        month = ENGLISH.index(match["month"].lower()) + 1
        zone = "" if east is None else "Z" if east == 0 else f"{east:+03d}:00"
        return f"{match['year']}-{month:02d}-{int(match['day']):02d}T{match['time']}{zone}"
    if (match := _YEAR_AND_DAY.search(text)) is not None and 1 <= int(match["day"]) <= 366:
        day = dt.date(int(match["year"]), 1, 1) + dt.timedelta(days=int(match["day"]) - 1)
        return f"{day.isoformat()}T{match['h']}:{match['m']}:{match['s']}"
    if (match := _EPOCH.search(text)) is not None:
        digits = match["epoch"]
        fraction = _LONG.get(len(digits), 0) if "." not in digits else 0
        return f"{digits[:-fraction]}.{digits[-fraction:]}" if fraction else digits
    return None
