"""Columns that speak of the wind and are not read, such as gusts, extremes and deviations: told in one remark."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flagdata.ingest.anemometer.tables import offered_columns, speeds_offered, unread_rest
from flagdata.ingest.anemometer.text.cells import numbers
from flagdata.ingest.anemometer.text.kinds import cell_kind
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.times.timechoice import TimeChoice
from flagdata.ingest.anemometer.winds import beside, own_motion
from flagdata.ingest.anemometer.winds.found import Wind
from flagdata.ingest.anemometer.words.gust_words import GUSTS, MAXIMA, MINIMA
from flagdata.ingest.anemometer.words.headings import fits, understand, words_of
from flagdata.ingest.anemometer.words.wind_words import WIND

_SPEAKS = re.compile(
    r"wind|wnd|gust|rafale|racha|rajada|raffica|beaufort|(?:^|_)(?:wg|ws|wd|wspd|wdir)(?:_|$)|b(?:ö|oe)en?(?:_|$)"
)
"""What stands in headings of the wind and its gusts; words are joined with "_"."""
_NO_WIND = frozenset({"chill", "windchill", "window", "windows", "rewind", "winding", "windings", "windup"})
_SPEEDS = GUSTS | MAXIMA | MINIMA | frozenset({"peak", "lull", "hi", "high", "low", "lo", "samples"})
"""Words of extremes, whose numbers are speeds of the wind."""
_NO_SPEEDS = frozenset(
    {
        "dir", "direction", "time", "date", "qc", "flag", "quality", "std", "sd", "count", "force", "beaufort", "bft",
        "scale", "class", "run", "chill", "power", "angle", "bearing", "vane",
    }
)  # fmt: skip
"""Words of headings whose numbers are no speeds of the wind."""
_HIGHEST = GUSTS | MAXIMA | {"peak", "hi", "high"}
_INTERVAL = re.compile(r"(?<![^\W_])\d+[\s_-]?(?:min|mins|minutes?|m|s|sec|h|hr|hours?)(?![^\W_])", re.IGNORECASE)
"""A length of time in a heading, whose "min" is no minimum."""
_MOST = 60
"""Columns that are named; of more, the number."""


def remark(
    layout: Layout, time: TimeChoice | None, wind: Wind | None, winds: Sequence[Wind], remarks: Collection[str]
) -> tuple[str, ...]:
    """One remark that names the columns of the wind which are not read; none where there is no such column.

    Args:
        wind: the one that is read.
        winds: all of the table.
        remarks: what was said of columns already; those are not named again.
    """
    own = own_motion.columns(layout)
    every = winds if wind is None else (*winds, wind)
    found = [
        index
        for index in unread_rest.not_told(layout, time, every, remarks)
        if index not in own and _speaks_of_wind(layout, index)
    ]
    if not found:
        return ()
    names = unread_rest.listed(layout, found, most=_MOST)
    many = len(found) > 1
    what = f"columns {names} speak of the wind and are not read" if many else f"column {names} speaks of the wind"
    what += "" if many else " and is not read"
    speeds = [index for index in found if _is_speed(layout, index)]
    speed = next((index for index in speeds if _words(layout, index) & _HIGHEST), next(iter(speeds), None))
    if speed is None or time is None or wind is None:
        return (what,)
    every = (wind, *winds)
    option = offered_columns.read_instead(layout, time, _of_its_rows(layout, speed, every), speed)
    read = f"to read {layout.names[speed]!r} as a wind of its own, ingest the file once more with"
    others = [at for at in speeds if at != speed and beside.direction_of(layout, at, apart=time.columns) is not None]
    further = (
        f"{layout.names[at]!r} likewise with "
        f"{offered_columns.read_instead(layout, time, _of_its_rows(layout, at, every), at)}"
        for at in others
    )
    return ("; ".join([what, f"{read} {option}", *further]),)


def _of_its_rows(layout: Layout, speed: int, winds: Sequence[Wind]) -> Wind:
    """The wind of the same instrument as a further speed, or else the first that has values in most of its rows.

    Where the table has several directions, and none of its instruments is that of the speed, it is without a direction.
    """
    same = [wind for wind in winds if _instrument(layout, wind) == _key(layout, speed)]
    if same:
        return _in_its_rows(layout, speed, same)
    directions = {column.index for wind in winds if (column := wind.columns.get("wind_direction")) is not None}
    if len(directions) > 1:
        wind = _in_its_rows(layout, speed, winds)
        return replace(wind, columns={name: one for name, one in wind.columns.items() if name != "wind_direction"})
    return _in_its_rows(layout, speed, winds)


def _key(layout: Layout, index: int) -> tuple[tuple[str, ...], float | None]:
    """The words and the height of a heading that tell its instrument from others."""
    heading = understand(layout.names[index], layout.units[index])
    return heading.label, heading.height


def _instrument(layout: Layout, wind: Wind) -> tuple[tuple[str, ...], float | None]:
    """The words and the height of a wind's speed, or of its first column."""
    speed = wind.columns.get("wind_speed") or next(iter(wind.columns.values()))
    return _key(layout, speed.index)


def _in_its_rows(layout: Layout, speed: int, winds: Sequence[Wind]) -> Wind:
    """The first of the winds that has values in most rows in which a further speed has them."""

    def known(column: int) -> NDArray[np.bool_]:
        return np.isfinite(numbers(layout.column(column), decimal=layout.decimal).value)

    own = known(speed)
    if bool(known(next(iter(winds[0].columns.values())).index)[own].all()):
        return winds[0]  # as in most tables, of which some have hundreds of winds
    return max(winds, key=lambda wind: int((own & known(next(iter(wind.columns.values())).index)).sum()))


def _speaks_of_wind(layout: Layout, index: int) -> bool:
    """Whether a heading names the wind, its gusts or a statistic of its speed or direction."""
    words = words_of(layout.names[index])
    if set(words) & _NO_WIND:
        return False
    if set(words) & (WIND | GUSTS - {"spitze", "spitzen"}) or _SPEAKS.search("_".join(words)):
        return True
    return "wind" in understand(layout.names[index], layout.units[index]).quantity


def _is_speed(layout: Layout, index: int) -> bool:
    """Whether a column holds a gust, maximum or minimum of the wind's speed."""
    heading = understand(layout.names[index], layout.units[index])
    if heading.quantity not in ("", "wind_speed") or not (heading.unit is None or fits("wind_speed", heading.unit)):
        return False
    kinds = {cell_kind(cell) for cell in layout.column(index)}
    words = _words(layout, index)
    named = bool(words & _SPEEDS) and not words & _NO_SPEEDS and kinds <= {"number", "missing"}
    return named and speeds_offered.may_be(layout, index)


def _words(layout: Layout, index: int) -> set[str]:
    return set(words_of(_INTERVAL.sub(" ", layout.names[index])))
