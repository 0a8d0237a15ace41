"""Dates in a column of their own beside a time of day, where they are digits alone or written in a way not known.

25082026 and 250826 have no signs between their numbers. A column that a heading calls a date and that no format reads
is said to be there: a time of day beside it is not taken without it, since whole days may be left out between rows.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence

from flagdata.ingest.anemometer.instants import month_names
from flagdata.ingest.anemometer.instants.dates import Order
from flagdata.ingest.anemometer.instants.midnight import parse_as
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.times.dateparts import CLOCKS
from flagdata.ingest.anemometer.times.timechoice import SHARE, TimeChoice, fits, share, time_choice
from flagdata.ingest.anemometer.words.headings import words_of

_SIX, _EIGHT = re.compile(r"^\s*\d{6}\s*$"), re.compile(r"^\s*\d{8}\s*$")
_FORMS: dict[Order, str] = {"ymd": "%y%m%d", "dmy": "%d%m%y", "mdy": "%m%d%y"}
_DATES = frozenset(
    {
        "date", "dates", "datum", "fecha", "data", "dato", "pvm", "päivämäärä", "дата", "dátum", "tarih", "tanggal",
        "ngày", "日期", "日付", "날짜", "ημερομηνία", "datums", "kuupäev", "jour", "giorno", "día", "dia",
    }
)  # fmt: skip
"""Headings of dates."""
_SCORE = 2.0


def names_date(heading: str) -> bool:
    """Whether a heading calls its column a date."""
    return bool(set(words_of(heading)) & _DATES)


def in_words(texts: Sequence[str]) -> bool:
    """Whether nine cells of ten are dates with the names of their months, and nothing behind them."""
    found = [month_names.DATE.match(text) for text in texts]
    whole = sum(match is not None and not text[match.end() :].strip() for match, text in zip(found, texts, strict=True))
    return whole >= SHARE * len(texts)


def choices(
    layout: Layout, columns: Sequence[Sequence[str]], clocks: Collection[int], dates: Sequence[int], order: Order | None
) -> Iterator[TimeChoice]:
    """Dates of digits, or of a writing that is not known, beside each column of times of day.

    Args:
        columns: the cells of each.
        clocks: columns that are times of day.
        dates: columns of dates that are read otherwise.
        order: of dates written with numbers only, as the user says.
    """
    for index, name in enumerate(layout.names):
        if not names_date(name):
            continue
        cells = [cell for cell in columns[index] if cell]
        for clock in clocks:
            if clock == index or not cells:
                continue
            digits = _of_digits(layout, columns, (index, clock), order)
            if digits is not None:
                yield digits
            elif index not in dates and index not in clocks and not dates:
                yield TimeChoice(
                    columns=(index, clock), form=None, zone=None, zoned=False, score=_SCORE + 1.0,
                    doubt=f"column {name!r} is headed as a date, and how it is written, {cells[0]!r}, is not known",
                    fix=f'write its format in --columns, as "{index + 1}=date[%d %m %Y],{clock + 1}=time" would',
                )  # fmt: skip


def _of_digits(
    layout: Layout, columns: Sequence[Sequence[str]], taken: tuple[int, int], order: Order | None
) -> TimeChoice | None:
    """A date of six or eight digits; in doubt where more than one order reads it. Years in front need no heading."""
    cells = [cell for cell in columns[taken[0]] if cell]
    eight = share(_EIGHT, cells)
    if not eight and not share(_SIX, cells):
        return None
    texts = [" ".join(pair) for pair in zip(*(columns[at] for at in taken), strict=True) if all(pair)]
    found: dict[Order, TimeChoice] = {}
    for one, digits in _FORMS.items():
        for clock in CLOCKS:
            form = f"{digits.replace('%y', '%Y') if eight else digits} {clock}"
            read, _ = parse_as(texts, form)
            if fits(read):
                found[one] = time_choice(layout, taken, form, read, _SCORE)
                break
    if order in found:
        return found[order]
    if eight and "ymd" in found:
        return found["ymd"]
    if len(found) == 1:
        return next(iter(found.values()))
    if not found:
        return None
    return TimeChoice(
        columns=taken, form=None, zone=None, zoned=False, score=_SCORE + 0.5,
        doubt=f"dates as {cells[0]!r} may be {', or '.join(found)} (y year, m month, d day)",
        fix=f"say which: --date-order {' or '.join(found)}",
    )  # fmt: skip
