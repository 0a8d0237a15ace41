"""Lines that say what each number is, all in the same words, as programs print to a console.

    12:00:01.007 -> Wind Speed: 3.21 m/s, Direction: 231
     23:11:01:17:39:22.316 SN150 U -00.90 V -00.21 T  19.78 BATTV  4.16

The words before a number name its column, those between it and the next name are its unit where they spell one. What
the words mean, and what is missing, is told as of any table. Formats that know the lines themselves go first.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence

from flagdata.ingest.anemometer.recognition import recognise
from flagdata.ingest.anemometer.restating.name_value import Record, wide
from flagdata.ingest.anemometer.restating.restate import rows_of, table
from flagdata.ingest.anemometer.sniffing import SURE
from flagdata.ingest.anemometer.text.layout import lay_out
from flagdata.ingest.anemometer.text.source import TableText, TextFile
from flagdata.ingest.anemometer.times.timecolumns import find_time
from flagdata.ingest.anemometer.words.headings import interest, understand
from flagdata.units import spelled

_STAMP = re.compile(
    r"(?:\s*[A-Za-z][\w.-]{0,20}(?::\s+|=)(?=\d{4}-\d\d-))?"
    r"[\s\[(\"]*(?P<stamp>\d{4}[-/.]\d{1,2}[-/.]\d{1,2}[T ,_]+\d{1,2}:\d{2}(?::\d{2}(?:[.,]\d+)?)?"
    r"(?:\s?[AaPp]\.?[Mm]\b\.?|\s?Z|[+-]\d{2}:?\d{2})?"
    r"|\d{1,2}[-/.]\d{1,2}[-/.]\d{2,4}[T ,_]+\d{1,2}:\d{2}(?::\d{2}(?:[.,]\d+)?)?(?:\s?[AaPp]\.?[Mm]\b\.?)?"
    r"|(?P<parts>\d{2}:\d{2}:\d{2}):(?P<clock>\d{2}:\d{2}:\d{2}(?:\.\d+)?)"
    r"|\d{1,2}:\d{2}:\d{2}(?:[.,]\d+)?(?:\s?[AaPp]\.?[Mm]\b\.?)?|\d{10}(?:\.\d+)?|\d{13})(?![\d:])"
)
_FRACTION = re.compile(r"(?P<seconds>:\d{2}),(?=\d)")
"""The comma before the fraction of a second, as Python's logging writes it."""
_NUMBER = re.compile(r"(?<![\w.])[-+]?(?:(?:\d+(?:\.\d*)?|\.\d+)(?!\d)|[Nn][Aa][Nn](?!\w))")
_UNIT = re.compile(r"\s?(?P<unit>[^\s\d,;:|=()\[\]]{1,10})")
_WORDS = re.compile(r"[^\W\d_]")
_SERIAL = re.compile(r"\d{3}")
_MOST = 40
"""Columns of the widest line that is looked at."""
_SHARE = 0.8


def matches(lines: Sequence[str]) -> bool:
    """Most lines have the same words, some of them before numbers, and one of these is a wind.

    Lines of a program's log, each after a stamp, may be of several kinds: then those of one are of the wind.
    """
    return _heading(lines) is not None


def alike(lines: Sequence[str]) -> bool:
    """Whether the lines are all of one kind, the wind among what they name."""
    return _usual(lines) is not None and matches(lines)


def stamped(lines: Sequence[str]) -> bool:
    """Whether a stamp stands before any of the lines."""
    return any(cut is not None and bool(cut[1]) for cut in map(_cut, lines))


def as_table(source: TextFile) -> TableText | None:
    """The numbers below the words before them; `None` where another format knows the lines."""
    lines = source.head()
    heading = _heading(lines)
    if heading is None:
        return None
    words, names = heading
    if any(guess.score >= SURE and not guess.doubts for guess in recognise(source)):
        return None
    layout = lay_out(lines, interest=interest) if _usual(lines) is None else None
    if layout is not None and find_time(layout) is not None:
        return None  # a table

    if _usual(lines) is None and len(_kinds(lines)) > 1:
        left = [0]
        told = "lines that each name what they tell"
        return wide(source, ["time"], _told(source, left), what=told, left_out=left)

    def row(line: str) -> list[str] | None:
        cut = _cut(line)
        return [cut[1], *cut[2]] if cut is not None and cut[0] == words else None

    found, other = rows_of(source, row)
    return table(
        source, ["time", *names], found, kind="labelled-lines", what="lines that name each number",
        left_out=other,
    )  # fmt: skip


def _kinds(lines: Sequence[str]) -> set[tuple[str, ...]]:
    """The words of the stamped lines that name the wind's speed or direction."""
    cuts = {cut[0] for line in lines if (cut := _cut(line)) is not None and cut[1]}
    return {words for words in cuts if any("wind" in understand(name).channel for name in _names(words))}


def _told(source: TextFile, left: list[int]) -> Iterator[Record]:
    """What each stamped line tells of the wind and the weather; `left` counts those that tell nothing of it."""
    known: dict[tuple[str, ...], list[str | None]] = {}
    for _, lines in source.blocks():
        for line in lines:
            cut = _cut(line)
            if cut is None or not cut[1]:
                left[0] += bool(line.strip())
                continue
            if cut[0] not in known:
                names = _names(cut[0])
                known[cut[0]] = [name if understand(name).sure and understand(name).channel else None for name in names]
            if not any(known[cut[0]]):
                left[0] += 1
            for name, value in zip(known[cut[0]], cut[2], strict=True):
                if name is not None:
                    yield Record(stamp=(cut[1],), name=name, value=value)


def _heading(lines: Sequence[str]) -> tuple[tuple[str, ...], list[str]] | None:
    """The words of the lines of the wind, and the names of their columns with units; `None` where there are none."""
    filled = [line for line in lines if line.strip()]
    cuts = [cut for line in filled if (cut := _cut(line)) is not None]
    if len(cuts) < 3:
        return None
    if (usual := _usual(lines)) is not None:
        return _named(usual)
    stamped = Counter(cut[0] for cut in cuts if cut[1])
    if stamped.total() < _SHARE * len(filled):
        return None
    kinds = (words for words, count in stamped.most_common() if count >= 3)
    return next((found for words in kinds if (found := _named(words)) is not None), None)


def _usual(lines: Sequence[str]) -> tuple[str, ...] | None:
    """The words of most lines; `None` where none are."""
    filled = [line for line in lines if line.strip()]
    counts = Counter(cut[0] for line in filled if (cut := _cut(line)) is not None)
    words, count = counts.most_common(1)[0] if counts else ((), 0)
    return words if count and count >= _SHARE * len(filled) else None


def _names(words: tuple[str, ...]) -> list[str]:
    """The names of the numbers between the words of a line, each with its unit."""
    names: list[str] = []
    label, unit = words[0], None
    for text in words[1:]:
        unit, following = _unit(text)
        bare = " ".join(word for word in re.findall(r"[^\W_]+(?:[-/][^\W_]+)*", label) if not _SERIAL.search(word))
        names.append(f"{bare} [{unit}]" if unit else bare)
        label = following
    return names


def _named(words: tuple[str, ...]) -> tuple[tuple[str, ...], list[str]] | None:
    """The words of a line, and the names of its columns with units; `None` where they name no wind."""
    names = _names(words)
    if not any(_WORDS.search(name) for name in names):
        return None
    headings = [understand(name) for name in names]
    winds = {heading.channel for heading in headings if heading.sure and "wind" in heading.channel}
    spoken = winds & {"wind_speed", "apparent_wind_speed"} or {"wind_x", "wind_y"} <= winds
    return (words, names) if spoken and len(set(names)) == len(names) else None


def _unit(text: str) -> tuple[str | None, str]:
    """The unit that a text between two numbers begins with, and the rest of it."""
    found = _UNIT.match(text)
    if found is None or spelled(found["unit"]) is None:
        return None, text
    return found["unit"], text[found.end() :]


def _cut(line: str) -> tuple[tuple[str, ...], str, list[str]] | None:
    """The texts around the numbers of a line, its stamp ("" where there is none) and the numbers."""
    stamp = _STAMP.match(line)
    rest = line[stamp.end() :] if stamp is not None else line
    numbers = list(_NUMBER.finditer(rest))
    if not 0 < len(numbers) <= _MOST:
        return None
    edges = [0, *(at for number in numbers for at in number.span()), len(rest)]
    words = tuple(" ".join(rest[low:high].split()) for low, high in zip(edges[0::2], edges[1::2], strict=True))
    if stamp is None:
        when = ""
    elif stamp["parts"]:
        when = f"{stamp['parts'].replace(':', '-')} {stamp['clock']}"
    else:
        when = _FRACTION.sub(r"\g<seconds>.", stamp["stamp"]).replace(",", " ")
    return words, when, [number[0] for number in numbers]
