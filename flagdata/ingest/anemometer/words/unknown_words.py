"""Words of a wind's heading that are not known: a name of the place or the sensor, or a statistic in a foreign word."""

from __future__ import annotations

from collections.abc import Sequence

from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.words.headings import understand
from flagdata.ingest.anemometer.words.wind_words import PLACES

_SHORTEST = 4
"""Letters of a word that can say what a number is; shorter ones are codes of places."""
_NAMES = frozenset(
    {
        "weather", "source", "ultrasonic", "digital", "analog", "height", "surface", "outside", "hourly", "horaria",
        "horario", "horária", "hrly", "daily", "field", "roof", "garden", "local", "meteo", "météo", "wetter",
        "variable", "parameter", "quantity", "observed", "gill", "davis", "vaisala", "lufft", "young", "campbell",
        "thies", "metek", "windsonic", "windmaster", "trisonica", "kestrel", "airmar", "calypso", "ecowitt", "ambient",
        "hobo",
    }
)  # fmt: skip
"""Words that say nothing of what was made of the readings."""


def unknown(heading: str) -> tuple[str, ...]:
    """The words of a heading of the wind that nothing here knows, in its order."""
    label = understand(heading).label
    return tuple(word for word in label if word.isalpha() and len(word) >= _SHORTEST and word not in _NAMES | PLACES)


def told(headings: Sequence[str]) -> tuple[Finding, ...]:
    """A note on each heading that holds such words."""
    found: list[Finding] = []
    for heading in headings:
        if words := unknown(heading):
            listed = ", ".join(repr(word) for word in words)
            found.append(
                Finding(
                    kind="words-not-known", severity=Severity.NOTE,
                    what=f"of the heading {heading!r} nothing is known of {listed}: taken for a name; if it says an "
                    "extreme, a sum or another statistic, the column is no mean wind",
                )
            )  # fmt: skip
    return tuple(found)
