"""Dates and times in one text that are put together otherwise than most: led by a day of the week or by the clock,
with the day of the year, with a month's name or underlines between digits.

    Mo 13.05.2026 14:20      14:20 13/05/2026      2026-134T14:20:05Z      13MAY2026:14:20:05      2026_05_13_14_20_05
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace

from flagdata.ingest.anemometer.instants import month_names
from flagdata.ingest.anemometer.instants.midnight import parse_with_bare_dates
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.times.timechoice import TimeChoice, fits, share, time_choice

_WEEKDAY = re.compile(rf"^\s*[{month_names.LETTERS}]{{2,13}}\.?,?\s+(?=\d{{1,4}}[-/.]\d{{1,2}}[-/.]\d)")
"""The day of the week before a date of numbers."""
_CLOCK_FIRST = re.compile(
    r"^\s*(?P<clock>\d{1,2}:\d{2}(?::\d{2}(?:\.\d{1,9})?)?(?: ?[AaPp]\.?[Mm]\.?)?)(?P<gap>,?\s+)"
    r"(?P<date>\d.*[-/. ].*\d)\s*$"
)
_ISO = ("%Y-%m-%d %H:%M:%S%f", "%Y-%m-%d %H:%M", "%Y/%m/%d %H:%M:%S%f", "%Y/%m/%d %H:%M")
"""What "iso" reads, spelled."""
_SHAPES = (
    (r"\d{4}-\d{3}[ T]\d", ("%Y-%j %H:%M:%S%f", "%Y-%j %H:%M")),
    (r"\d{4}:\d{3}:\d", ("%Y:%j:%H:%M:%S%f", "%Y:%j:%H:%M")),
    (r"\d{1,2}[A-Za-z]{3}\d{2,4}", tuple(
        f"%d%b{year}{gap}{clock}" for year in ("%Y", "%y") for gap in ":_ " for clock in ("%H:%M:%S%f", "%H:%M")
    )),
    (r"\d{4}_\d{1,2}_\d{1,2}_\d{1,2}_\d", ("%Y_%m_%d_%H_%M_%S%f", "%Y_%m_%d_%H_%M")),
)  # fmt: skip
"""How texts begin, and the formats of such."""

Whole = Callable[[list[str]], TimeChoice | None]


def choice(layout: Layout, columns: tuple[int, ...], texts: Sequence[str], whole: Whole) -> TimeChoice | None:
    """The date and time of texts of one of these kinds; `None` where they are of none.

    Args:
        columns: that hold them.
        whole: what texts are of the usual kinds.
    """
    if share(_WEEKDAY, texts):
        return _again(whole, texts, [_WEEKDAY.sub("", text) for text in texts], _behind_weekday)
    if share(_CLOCK_FIRST, texts):
        found = [_CLOCK_FIRST.match(text) for text in texts]
        turned = [f"{match['date']} {match['clock']}" if match else "" for match in found]
        gap = next(match["gap"] for match in found if match is not None)
        return _again(whole, texts, turned, lambda form: _clock_first(form, gap))
    for shape, forms in _SHAPES:
        if share(re.compile(rf"^\s*{shape}"), texts):
            for form in (f"{form}{zone}" for form in forms for zone in ("", "%z")):
                stamps, _ = parse_with_bare_dates(texts, form)
                if fits(stamps):
                    return time_choice(layout, columns, form, stamps, 2.0)
    return None


def _again(whole: Whole, texts: Sequence[str], usual: list[str], form_of: Callable[[str], str]) -> TimeChoice | None:
    """What texts are by what they are when put as usual, with the format of the texts as they are."""
    found = whole(usual)
    if found is None or found.form is None:
        return found
    for form in _ISO if found.form == "iso" else (found.form,):
        own = form_of(form)
        if fits(parse_with_bare_dates(texts, own)[0]):
            return replace(found, form=own)
    return None


def _behind_weekday(form: str) -> str:
    return f"%a {form}"


def _clock_first(form: str, gap: str) -> str:
    """A format of a date and a clock with the clock in front."""
    at = min(place for directive in ("%H", "%I") if (place := form.find(directive)) >= 0)
    return f"{form[at:].strip()}{',' if ',' in gap else ''} {form[:at].strip()}"
