"""Headings in other scripts and languages than the Western European ones that `headings` knows word by word.

Their words are replaced by the English ones they stand for; then they are understood as any heading is.
"""

from __future__ import annotations

import re

_GUST = r"最大|极大|瞬[間时]|阵风|陣風|突風|최대|순간|돌풍|порыв|макс|\bporyw|\bmaks|\bnáraz"
_SPEED = (
    r"风速|風速|풍속|скорость\s*ветра|prędkość\s*wiatru|rychlost\s*větru|r[üu]zgar[\s_]*h[ıi]z[ıi]|kecepatan\s*angin"
)
_DIRECTION = r"风向|風向|풍향|направление\s*ветра|kierunek\s*wiatru|směr\s*větru|r[üu]zgar[\s_]*y[öo]n[üu]|arah\s*angin"
_TIME = r"时间|時刻|日時|日期|年月日|시간|일시|날짜|\b(?:время|godzina|čas|zaman|waktu|tanggal)\b"
_WORDS = tuple(
    (re.compile(pattern, re.IGNORECASE), word)
    for pattern, word in (
        (_GUST, "gust"), (_SPEED, "wind speed"), (_DIRECTION, "wind direction"), (_TIME, "time"), (r"\bдата\b", "date"),
        (r"^\s*[年년]\s*$", "year"), (r"^\s*[月월]\s*$", "month"), (r"^\s*[日일]\s*$", "day"),
        (r"^\s*[時时시]\s*$", "hour"), (r"^\s*[分분]\s*$", "minute"), (r"^\s*[秒초]\s*$", "second"),
        (r"м/с", "m/s"), (r"км/ч", "km/h"), (r"\bград(?:усы)?\b\.?", "deg"), (r"℃", "°C"),
    )
)  # fmt: skip


def in_english(name: str) -> str:
    """A heading with the words of other languages that are known replaced; one of ASCII letters as it is."""
    if name.isascii() and not re.search(r"angin|ruzgar|godzina|zaman|waktu|tanggal|maks", name, re.IGNORECASE):
        return name
    for pattern, word in _WORDS:
        name = pattern.sub(f" {word} ", name)
    return " ".join(name.split())
