"""Lines of an instrument after stamps that are written another way than ISO 8601, as 14/03/2021 10:00:00 AM.

The stamp of each line is written anew as ISO 8601, so that the instrument's own reader takes it. Which number is the
day is decided as for any date, or asked for.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import islice

from flagdata.errors import TimeError
from flagdata.ingest.anemometer.formats.serial_lines import split_stamp
from flagdata.ingest.anemometer.instants.dates import Order, decide
from flagdata.ingest.anemometer.restating.untimed import of_an_instrument
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_LINE = re.compile(
    r"\s*[\[(\"]?(?P<date>\d{1,4}[-/.]\d{1,2}[-/.]\d{1,4})[T ,;\t_]+"
    r"(?P<hour>\d{1,2}):(?P<rest_of_clock>\d{2}(?::\d{2}(?:[.,]\d{1,9})?)?)(?:\s?(?P<half>[AaPp])\.?[Mm]\.?)?"
    r"(?P<zone>\s?(?:Z|[+-]\d{2}:?\d{2}))?[\])\"]?[\s,;>|]+(?P<rest>\S.*)"
)
_SHARE = 0.8


def spelled(lines: Sequence[str]) -> bool:
    """Whether most lines are an instrument's after a stamp that its reader does not know as one."""
    filled = [line for line in lines if line.strip()]
    found = [match for line in filled if (match := _LINE.match(line)) is not None and not split_stamp(line)[0]]
    if not filled or len(found) < _SHARE * len(filled):
        return False
    return of_an_instrument([f"2000-01-01T12:00:00 {match['rest']}" for match in found])


def restamped(source: TextFile, order: Order | None) -> TextFile:
    """The lines with their stamps in ISO 8601.

    Args:
        order: of dates written with numbers only, by the user's word.

    Raises:
        TimeError: nothing tells which number of the dates is the day.
    """
    dates = [match["date"] for line in source.head(1000) if (match := _LINE.match(line)) is not None]
    try:
        decision = decide(dates, told=order, where=str(source.path))
    except TimeError as error:
        if "day/month" not in error.what or not re.match(r"\d{2}/\d{2}/\d{2}$", dates[0]):
            raise
        fix = "give --date-order dmy, mdy or ymd"
        raise TimeError(error.what.replace("month/day", "month/day or year/month/day"), where=error.where,
                        fix=fix) from None  # fmt: skip
    letters = decision.order
    text: list[str] = []
    for _, lines in source.blocks():
        for line in lines:
            match = _LINE.match(line)
            text.append(line if match is None else f"{_iso(match, letters)} {match['rest']}")
    return TableText.of(source, text)


def provisional(source: TextFile) -> TextFile:
    """The lines with their stamps in ISO 8601, in an order that may be wrong: enough to tell whose lines they are."""
    lines = islice(source.each_line(), 1000)
    found = (match for line in lines if (match := _LINE.match(line)) is not None)
    return TableText.of(source, [f"2000-01-01T12:00:00 {match['rest']}" for match in found])


def _iso(match: re.Match[str], order: Order) -> str:
    numbers = dict(zip(order, re.split(r"[-/.]", match["date"]), strict=True))
    year = numbers["y"] if len(numbers["y"]) == 4 else f"{2000 + int(numbers['y']) - 100 * (int(numbers['y']) >= 70)}"
    hour = int(match["hour"])
    if match["half"]:
        hour = hour % 12 + 12 * (match["half"] in "Pp")
    clock = match["rest_of_clock"].replace(",", ".")
    clock = clock if ":" in clock else f"{clock}:00"
    return f"{year}-{int(numbers['m']):02d}-{int(numbers['d']):02d}T{hour:02d}:{clock}{(match['zone'] or '').strip()}"
