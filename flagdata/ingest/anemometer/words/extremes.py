"""Headings of the day or time at which an extreme of something came, which is never the time of a row."""

from __future__ import annotations

import re

from flagdata.ingest.anemometer.words.gust_words import GUSTS, MAXIMA
from flagdata.ingest.anemometer.words.headings import words_of

_TIMES = frozenset(
    {
        "time", "date", "day", "hour", "datetime", "timestamp", "hhmm", "hhmmss", "hhmi", "yyyymmdd",
        "zeit", "zeitpunkt", "uhrzeit", "datum", "tag", "tijd", "tijdstip", "uur", "heure", "jour",
        "hora", "fecha", "día", "dia", "data", "ora", "tid", "dato", "tidspunkt", "klokkeslett",
        "시각", "나타난날", "나타난시각", "발생일", "발생시각", "起時", "起日", "時刻",
    }
)  # fmt: skip
_EXTREMES = GUSTS | MAXIMA | {"peak", "highest", "lowest", "fastest", "höchsten", "stärksten"}
_JOINED = re.compile(
    r"hora.*(?:max|min(?!u)|racha)|time(?:of|at)(?:max|min|gust|peak)|time(?:max|gust|peak)|(?:max|gust|peak).*time"
)
"""Headings whose words are joined."""
_WRITTEN_TOGETHER = re.compile(
    r"(?:최대|최고|최저|순간)\S*(?:일자|일시|시각|날짜)|(?:最大|极大|極大|瞬間)\S*(?:日期|时间|時間|日時|時刻|起時)"
)
"""Headings of languages that write words together, before they are put into English."""


def of_extreme(heading: str) -> bool:
    """Whether a heading is of the day or time of an extreme, as "Date of max gust" or "horaracha"."""
    words = words_of(heading)
    if _WRITTEN_TOGETHER.search(heading):
        return True
    return bool(set(words) & _TIMES and set(words) & _EXTREMES) or _JOINED.search("".join(words)) is not None


def is_extreme(heading: str) -> bool:
    """Whether a heading is of an extreme, as "fastest2minwinddir" or "Max gust"."""
    return bool(set(words_of(heading)) & _EXTREMES) or heading.lower().startswith("fastest")
