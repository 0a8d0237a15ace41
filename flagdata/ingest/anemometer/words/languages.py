"""Headings in other scripts and languages than the Western European ones that `headings` knows word by word.

Their words are replaced by the English ones they stand for; then they are understood as any heading is.
"""

from __future__ import annotations

import re

from flagdata.ingest.anemometer.words.ghcn import ELEMENTS

_GUST = (
    r"最大|极大|瞬[間时]|阵风|陣風|突風|최대|순간|돌풍|порыв\w*|пориви?|макс|\bporyw\w*|\bmaks|\bnáraz|puuska|puhang|vindby|"
    r"vindkast|széllökés|rafal[ăa]|ριπή|משב|sunek|udar"
)
_SPEED = (
    r"风速|風速|풍속|скорость\s*ветра|швидкість\s*вітру|скорост\s*на\s*вятъра|pr[ęe]dko[śs][ćc][\s_]*wiatru|rychlost[\s_]*v[ěe]tru|"
    r"r[ýy]chlos[ťt][\s_]*vetra|r[üu]zgar[\s_]*h[ıi]z[ıi]|kecepatan\s*angin|tuulen\s*(?:keski)?nopeus|tuule\s*kiirus|"
    r"vindhastighe[dt]|vindstyrka|middelvind|medelvind|szélsebesség|vitez[aă]\s*v[aâ]ntului|hitrost\s*vetra|"
    r"brzina\s*vjetra|ταχύτητα\s*(?:του\s*)?ανέμου|מהירות\s*ה?רוח|سرعة\s*الرياح|tốc\s*độ\s*gió|vēja\s*ātrums|"
    r"vėjo\s*greitis|velocita\s*vento|velocidad\s*viento|(?:meðal)?vindhraði|velocitat\s*(?:mitjana\s*)?(?:del\s*)?vent|"
    r"haizearen\s*abiadura|ความเร็วลม|سرعت\s*باد|shpejtësia\s*e\s*erës"
)
_DIRECTION = (
    r"风向|風向|풍향|направление\s*ветра|напрям(?:ок)?\s*вітру|посока\s*на\s*вятъра|kierunek[\s_]*wiatru|sm[ěe]r[\s_]*v[ěe]tru|"
    r"smer[\s_]*vetra|r[üu]zgar[\s_]*y[öo]n[üu]|arah\s*angin|tuulen\s*suun\w*|tuule\s*suund|vindretning|vindriktning|"
    r"szélirány|direc[tț]i[ae]\s*v[aâ]ntului|smjer\s*vjetra|(?:διεύθυνση|κατεύθυνση)\s*(?:του\s*)?ανέμου|"
    r"כיוון\s*ה?רוח|اتجاه\s*الرياح|hướng\s*gió|vēja\s*virziens|vėjo\s*kryptis|vindátt|vindstefna|"
    r"\bdd?[\s_]+vi?ento\b|direcció\s*(?:mitjana\s*)?(?:del\s*)?vent|haizearen\s*norabidea|ทิศทางลม|جهت\s*باد|drejtimi\s*i\s*erës"
)
_TIME = (
    r"时间|時間|时刻|時刻|日時|日期|年月日|시간|일시|날짜|\b(?:время|годин[аи]|godzina|čas|zaman|waktu|tanggal|aika|"
    r"kellonaika|tidspunkt|időpont|ώρα|שעה|الوقت|thời gian|laikas|laiks)\b"
)
_STATION = (
    r"城市|站点|站點|站名|[测測]站|(?:自[动動])?[气氣]象站|[监監][测測]站|観測所|観測地点|地点名|관측소|지점명|"
    r"\b(?:город|станция|станції|станція|пункт|asema|állomás)\b"
)
_WORDS = tuple(
    (re.compile(pattern, re.IGNORECASE), word)
    for pattern, word in (
        (r"godzina[\s_]*pomiaru", "hour"), (r"data[\s_]*pomiaru", "date"),
        (_STATION, "station"), (_GUST, "gust"), (_SPEED, "wind speed"), (_DIRECTION, "wind direction"), (_TIME, "time"),
        (r"平均|평균", "mean"), (r"径向|徑向", "radial"), (r"[\d一二三五十]+\s*(?:分[鐘钟間间]?|분)", "10 min"),
        (r"\((?:十六|16)?\s*方位[點点]?\)", ""),
        (r"\b(?:дата|päivämäärä|dátum|ημερομηνία|תאריך|التاريخ|ngày)\b", "date"),
        (r"^\s*[年년]\s*$", "year"), (r"^\s*[月월]\s*$", "month"), (r"^\s*[日일]\s*$", "day"),
        (r"^\s*[時时시]\s*$", "hour"), (r"^\s*[分분]\s*$", "minute"), (r"^\s*[秒초]\s*$", "second"),
        (r"м/с(?:ек)?|מטר\s*לשנ\w*|מ/ש|م/ث|متر/ثانیه|เมตร/วินาที|mét/giây", "m/s"), (r"км/ч", "km/h"),
        (r"μοίρες|מעלות|asteet|(?<=\[)fok(?=\])|(?<=\()fok(?=\))|องศา|درجه|درجة", "deg"),
        (r"\bград(?:усы)?\b\.?", "deg"), (r"℃", "°C"),
    )
)  # fmt: skip


_ASCII = re.compile(
    r"angin|poryw|ruzgar|godzina|zaman|waktu|tanggal|maks|tuule|\baika\b|vind|wiatru|pomiaru|vetru|vjetra|vetra|vantului|viento|vento|velocitat|haizea",
    re.IGNORECASE,
)
"""What there is of these words in letters of ASCII."""


_WIDE = {0xFF01 + at: 0x21 + at for at in range(94)}
"""Signs in the width of Chinese and Japanese letters, and those they stand for."""


def in_english(name: str) -> str:
    """A heading with the words of other languages that are known replaced, and those that NOAA's elements stand for."""
    if name in ELEMENTS:
        return ELEMENTS[name]
    if name.isascii() and not _ASCII.search(name):
        return name
    name = name.translate(_WIDE)
    for pattern, word in _WORDS:
        name = pattern.sub(f" {word} ", name)
    return " ".join(name.split())
