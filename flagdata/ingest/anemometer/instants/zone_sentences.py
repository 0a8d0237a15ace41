"""Zones that a line tells in a sentence about its times ("All times in UTC", "Time sync: UTC +1,0 hrs")."""

from __future__ import annotations

import re
from collections.abc import Iterator

from flagdata.ingest.anemometer.instants.abbreviations import ABBREVIATED

_TIMES = (
    r"(?:date ?/ ?time|date and time|time[ _]?stamps?|times?|dates?|clock|zeiten?|uhrzeit(?:en)?|zeitangaben?|"
    r"zeitstempel|horas?|fechas?|heures?|horaires?|dates et heures|ore|orari|tijd(?:en|stip|stippen)?|tider|"
    r"klokkeslett)"
)
_SAYS = (
    r"(?:\b(?:in|are|is|as|all|en|em|sont|est|sind|ist|zijn|er|och|i|sync|base|reference|zone|local|given|recorded)\b"
    r"|[:=])"
)
_ALL = r"(?:all|alle|tutt[ei]|tod[ao]s|tous|toutes)"
_ABBREVIATION = "|".join(sorted(ABBREVIATED, key=len, reverse=True))
_SENTENCE = re.compile(
    rf"(?<![A-Za-z])(?:{_TIMES}(?![A-Za-z])[^\d;\t\n]{{0,40}}?{_SAYS}[^\d;\t\n]{{0,30}}?"
    rf"|{_ALL}\s+(?:las\s+|les\s+|the\s+)?{_TIMES}[^\w\n]{{1,3}})(?<![A-Za-z])"
    rf"(?:(?P<utc>(?i:UTC|GMT))(?:\s?(?P<sign>[+-])\s?(?P<hours>\d{{1,2}})(?:[:.,]?(?P<rest>\d{{1,2}}))?)?"
    rf"|(?P<place>{_ABBREVIATION}))(?![A-Za-z\d])",
    re.IGNORECASE,
)

_CONVERTED = re.compile(
    r"(?:converted |transformed )?from (?:UTC|GMT|[A-Z]{3,4})\b[^.;]{0,20}?\b(?:in)?to (?=UTC|GMT|[A-Z]{3,4})"
)
"""Of times that were converted from one zone to another, the second is theirs."""


def sentences(text: str) -> Iterator[tuple[str, str]]:
    """The words of each such sentence of a line, and the zone as `--zone` takes it."""
    for match in _SENTENCE.finditer(_CONVERTED.sub("in ", text)):
        name = _name(match)
        if name is not None:
            yield " ".join(match[0].split()), name


def _name(match: re.Match[str]) -> str | None:
    if match["place"]:
        # Abbreviations are written in capitals: "est" and "met" are words.
        return f"{ABBREVIATED[match['place']]:+03d}:00" if match["place"] in ABBREVIATED else None
    if match["hours"] is None:
        return "UTC"
    rest = match["rest"] or "0"
    decimal = match[0].endswith((f",{rest}", f".{rest}"))
    minutes = round(60 * float(f"0.{rest}")) if decimal else int(rest)
    if int(match["hours"]) > 14 or minutes > 59:
        return None
    return f"{match['sign']}{int(match['hours']):02d}:{minutes:02d}"
