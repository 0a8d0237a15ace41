"""What a table says against its columns as its user states them: it is read as stated, and told."""

from __future__ import annotations

from flagdata.ingest.anemometer.tables import against_components
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.winds import bow, own_motion
from flagdata.ingest.anemometer.winds.found import Wind
from flagdata.ingest.anemometer.words.gust_words import GUSTS, MAXIMA, MINIMA
from flagdata.ingest.anemometer.words.headings import understand, words_of

_SECTORS = frozenset({"sixteenths", "45 deg"})
_EXTREMES = GUSTS | MAXIMA | MINIMA | {"peak", "lull"}


def warnings(layout: Layout, wind: Wind) -> tuple[str, ...]:
    """A warning of a speed that is no mean by its heading, and of a direction that others speak against."""
    found: list[str] = [*against_components.warnings(layout, wind)]
    speed, direction = wind.columns.get("wind_speed"), wind.columns.get("wind_direction")
    name = layout.names[speed.index] if speed is not None else ""
    if speed is not None and understand(name).spread and set(words_of(name)) & _EXTREMES:  # the Min of 10 Min is none
        found.append(
            f"column {name!r} holds gusts or extremes by its heading: stored as wind_speed, as "
            "you said, though it is no mean"
        )
    if direction is not None and direction.unit in _SECTORS:
        found.append(
            f"column {layout.names[direction.index]!r} is taken as sectors of the compass that are counted clockwise "
            "from north, the first of which is 0, as you said: compare one with a wind that is known"
        )
    if direction is not None and bow.to_bow(layout, direction.index):
        found.append(
            f"column {layout.names[direction.index]!r} is an angle to the bow by its heading: taken as a direction "
            "from north, as you said; an angle to the bow is apparent_wind_direction or theoretical_wind_direction"
        )
    return tuple(found)


def afloat(layout: Layout, wind: Wind) -> str:
    """What is said of a platform that moves below a wind over ground; "" where none does."""
    stated = {layout.names[column.index] for column in wind.columns.values()}
    moves = own_motion.vessel(layout)
    if "wind_speed" not in wind.columns or not moves or moves in stated:
        return ""
    return (
        f"{moves!r} shows that the platform moves: {wind.label!r} is taken as wind over ground, as you said; what a "
        "moving platform measures is apparent wind: --platform moving"
    )
