"""Columns of the wind of a whole day or month beside readings: summaries, which few rows of a table hold."""

from __future__ import annotations

from flagdata.ingest.anemometer.winds.found import Found
from flagdata.ingest.anemometer.words.ghcn import ELEMENTS
from flagdata.ingest.anemometer.words.headings import words_of

_LONGER = frozenset(
    {
        "daily", "monthly", "weekly", "yearly", "annual", "seasonal", "diario", "diaria", "mensual", "mensal",
        "mensuel", "mensuelle", "journalier", "journalière", "tagesmittel", "monatsmittel", "giornaliero", "mensile",
    }
)  # fmt: skip
"""Words of periods that are longer than those between readings."""


def beside_readings(found: Found) -> tuple[int, ...]:
    """Speeds of longer periods by their headings, where other speeds of the table are of none."""
    speeds = found.of("wind_speed")
    longer = [at for at in speeds if _is_longer(found.layout.names[at])]
    others = [at for at in speeds if at not in longer and found.headings[at].sure]
    return tuple(longer) if others else ()


def _is_longer(heading: str) -> bool:
    """Whether a heading says a day, a month or a year; NOAA's elements are all of days."""
    return heading in ELEMENTS or bool(set(words_of(heading)) & _LONGER)
