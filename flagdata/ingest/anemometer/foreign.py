"""Texts that hold a wind but are no table of it, told by their first lines, each with what their user can do."""

from __future__ import annotations

import re
from collections.abc import Sequence

from flagdata.ingest.anemometer.sniffing import Guess

_METAR = re.compile(r"\b(\d{3}|VRB)\d{2,3}(G\d{2,3})?(KT|MPS)\b")
_SYNOP = re.compile(r"\b(?:AAXX|BBXX|OOXX)\s")
_SHEF = re.compile(r"\.[AEB]R? [A-Z0-9]{3,8} \d{4,8} ")
_PROFILER = re.compile(r"\s*WINDS\s+rev\s+\d", re.IGNORECASE)
_BUFKIT = re.compile(r"\s*(?:SNPARM\s*=|STID\s*=\s*\w+\s+STNM\s*=|STN YYMMDD/HHMM)")
_SLCAN = re.compile(r"\s*(?:<-|->|[<>])?\s*\d*\s*T[0-9A-F]{8}[0-8](?:[0-9A-F]{2}){0,8}\s*$")
_ONE_HEIGHT = "write a table of one height with the program that reads them: one row a time, with speed and direction"
_MARKUP = ("<?xml", "<gpx", "<html", "<!doctype", "<kml")


def surely(lines: Sequence[str]) -> Guess | None:
    """What a text surely is, although its numbers may look like a table's; `None` where its first lines do not tell."""
    if list(lines[:1]) == ["FORMAT-1"]:
        text = "profiles of a SODAR, in blocks whose stamp stands above them (Scintec, APRun, FORMAT-1)"
        return _other("SODAR profiles", text, _ONE_HEIGHT)
    if any(_PROFILER.match(line) for line in lines[:20]):
        text = "consensus winds of a radar wind profiler, in blocks whose stamp stands above them"
        return _other("wind profiles", text, _ONE_HEIGHT)
    if any(_BUFKIT.match(line) for line in lines[:20]):
        text = "BUFKIT soundings, which are a model's forecast and no measurement"
        return _other("BUFKIT", text, "give a log of measured wind")
    if sum(bool(_SHEF.match(line)) for line in lines) > len(lines) / 3:
        text = "SHEF messages (National Weather Service), whose codes US and UD are a wind's speed [mph] and direction"
        fix = "decode them to a table with one row a time: its stamp with its zone, speed and direction"
        return _other("SHEF", text, fix)
    return None


def told(lines: Sequence[str]) -> Guess | None:
    """What a text is that no format has recognised; `None` where its first lines do not tell."""
    start = next((line for line in lines if line.strip()), "")
    if sum(bool(_SLCAN.match(line)) for line in lines) > len(lines) / 2:
        text = "frames of a CAN adapter (SLCAN): behind a T identifier, length and bytes, without a stamp"
        fix = "write each as candump -l does, with its time in front, which is read: "
        return _other("SLCAN", text, f"{fix}(1651406400.123456) can0 09FD0202#8FAB30090DFFAFFF")
    if start.lstrip("\ufeff \t").lower().startswith(_MARKUP):
        text = "this is XML or HTML without a table of readings that have a time and a wind"
        fix = "convert it to CSV with one row a reading: its time and its wind (GPX: with the program that wrote it)"
        return _other("XML", text, fix)
    if sum(bool(_METAR.search(line)) for line in lines) > len(lines) / 3:
        text = "METAR reports, which hold the wind as a code of three digits of direction and two of speed"
        fix = "their month is not told: put the date and time of each report [UTC] before it, as archives do "
        fix += '("202601271850 METAR EFHK 271850Z 08006KT …"), or decode them to a table with one row a report'
        return _other("METAR", text, fix)
    if any(_SYNOP.search(line) for line in lines):
        text = "SYNOP reports (WMO-No. 306), of ships, or of land stations without a day, a wind or its unit (iw)"
        fix = "decode them to a table with one row a report: its time, station, speed and direction, each with its unit"
        return _other("SYNOP", text, fix)
    return None


def _other(name: str, text: str, fix: str) -> Guess:
    return Guess(format=name, score=0.0, reasons=(text,), kind="other", fix=fix)
