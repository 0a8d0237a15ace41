"""Stamps as spreadsheets of East Asia write them, rewritten with the signs of ISO 8601.

    2026年5月1日 14时20分05秒        2026. 5. 1. 오후 2:20:05        2026/5/1 下午 2:20:05

Source: Unicode CLDR 44, date formats of ja, ko and zh.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_DATE = re.compile(
    r"(?<![\d.])(?P<y>(?:19|20)\d\d)\s?(?:年|년)\s?(?P<m>\d{1,2})\s?(?:月|월)\s?(?P<d>\d{1,2})\s?(?:日|일)"
    r"|(?<![\d.])(?P<y2>(?:19|20)\d\d)\. (?P<m2>\d{1,2})\. (?P<d2>\d{1,2})\.(?!\d)"
)
_CLOCK = re.compile(
    r"(?<!\d)(?P<h>\d{1,2})\s?(?:时|時|點|点|시)\s?(?P<m>\d{1,2})\s?(?:分|분)(?:\s?(?P<s>\d{1,2}(?:\.\d+)?)\s?(?:秒|초))?"
)
_HALF = re.compile(r"(?P<half>오전|오후|上午|下午|午前|午後)\s?(?P<h>\d{1,2})(?P<rest>:\d{2}(?::\d{2}(?:\.\d+)?)?)")
_AFTER_NOON = frozenset({"오후", "下午", "午後"})
_SHARE = 0.8
_LEAST = 3


def matches(lines: Sequence[str]) -> bool:
    """Whether most lines, headings apart, hold such a date or clock."""
    filled = [line for line in lines if any(map(str.isdigit, line))]
    found = sum(rewritten(line) != line for line in filled)
    return found >= max(_LEAST, _SHARE * len(filled))


def as_table(source: TextFile) -> TableText | None:
    """The same lines with their stamps rewritten."""
    before = next((line for line in source.head() if rewritten(line) != line), "")
    text = [rewritten(line) for _, lines in source.blocks() for line in lines]
    what = f"stamps are rewritten: {before.strip()[:40]!r} is read as {rewritten(before).strip()[:40]!r}"
    return TableText.of(source, text, [Finding(kind="stamps-rewritten", severity=Severity.NOTE, what=what)])


def rewritten(line: str) -> str:
    """A line with its stamps as YYYY-MM-DD and HH:MM:SS."""
    line = _DATE.sub(lambda found: "-".join(_padded(found[part] or found[f"{part}2"]) for part in "ymd"), line)
    line = _HALF.sub(_of_twelve, line)
    return _CLOCK.sub(lambda found: ":".join(_padded(part) for part in found.groups() if part), line)


def _of_twelve(found: re.Match[str]) -> str:
    hour = int(found["h"]) % 12 + 12 * (found["half"] in _AFTER_NOON)
    return f"{hour:02d}{found['rest']}"


def _padded(number: str) -> str:
    whole, point, fraction = number.partition(".")
    return f"{int(whole):02d}{point}{fraction}"
