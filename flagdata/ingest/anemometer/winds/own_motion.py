"""Velocities that may be of the drone, boat or car that carries the instrument, and not of the wind.

A flight log writes its own velocity as Vx, Vy, Vz, vel_x or velocity.x, as a sonic's log may write the wind. It is the
platform's where a position beside it changes, where the table tells how the platform is turned, or where other columns
are the wind or may be it (Um, Vm, Wm). It is neither read nor offered as the wind then.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from flagdata.ingest.anemometer.text.cells import numbers
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.words.headings import understand, words_of
from flagdata.ingest.anemometer.words.wind_words import WIND

LATITUDE, LONGITUDE = frozenset({"lat", "latitude"}), frozenset({"lon", "lng", "long", "longitude"})
_PLACED = LATITUDE | LONGITUDE - {"long"}
"""Words of a position; "long" is as well of waves and of times."""
_STILL = 1e-4
"""Change of a coordinate [deg] below which a receiver at rest may show it: some 10 m."""
_HEIGHTS = frozenset({"alt", "altitude", "height", "elevation"})
_CLIMBS = 2.0
"""Change of a height [m] above which a platform climbs."""
_TURNS = frozenset({"roll", "pitch", "yaw", "orientation", "attitude", "quaternion", "gimbal"})
"""Words of how a platform is turned."""
_SPEED, _AXIS = "v|vel|velo|velocity|speed|spd", "[xyzned]|north|east|down|up"
_ALONG = re.compile(
    rf"(?P<stem>.*?)(?:(?<![a-z])(?:{_SPEED})[\s._-]*(?P<axis>{_AXIS})|(?<![a-z])(?P<first>[xyz])[\s._-]*(?:vel|velocity|speed))"
)
"""A velocity along an axis, without its unit, lower-case."""
_VESSEL = frozenset({"stw", "bsp", "boat", "vessel", "vehicle", "ship", "sog", "cog"})
"""Words of how fast a vessel moves, and where to."""
_PAIRS = (("x", "y"), ("n", "e"))
_OF_AIR = WIND | {"sonic", "csat", "csat3", "sat", "anemometer", "anem", "air", "gill", "metek", "young", "usa"}
"""Words of headings whose velocity is the wind's."""
_CARRIED = frozenset(
    {
        "sog", "cog", "gps", "course", "heading", "hdg", "stw", "bsp", "boat", "vessel", "ship", "car", "vehicle",
        "bike", "drone", "rotor", "rpm", "wheel", "truck", "aircraft", "airspeed", "groundspeed",
    }
)  # fmt: skip
"""Words of what has a speed of its own."""
_WEATHER = frozenset({"air_temperature", "relative_humidity", "air_pressure"})
_ROWS = 3
"""Rows from which a position that does not change is a station's."""
_UNIT = re.compile(r"\s*[\[(<{].*$|[\s_,]+(?:m[/_ ]?s|mps|km[/_ ]?h|kph|mph|kn|kts?|knots)$", re.IGNORECASE)


def columns(layout: Layout) -> tuple[int, ...]:
    """The columns that may be the platform's own velocity; none where nothing speaks for it."""
    named = _velocities(layout)
    if not named or not (_moving(layout) or _turned(layout) or _windy(layout, named) or _others(layout, named)):
        return ()
    other_wind = _windy(layout, named) or bool(_others(layout, named))
    return () if _stands_still(layout) and not other_wind else named


def components(layout: Layout) -> Mapping[int, str]:
    """The columns that may be the wind beside the platform's own velocity, as channels by their index."""
    own = columns(layout)
    return _others(layout, own) if own and not _windy(layout, own) else {}


def may_have_speed(layout: Layout) -> bool:
    """Whether a speed whose heading says no more may be the platform's own: beside a position, but for a station's.

    A station's does not change, and beside the speed stand a direction and the weather, and nothing that moves.
    """
    words = {word for name in layout.names for word in words_of(name)}
    if not words & (_PLACED | {"sog", "cog", "gps", "altitude", "course"}):
        return False
    if words & _CARRIED or len(layout.rows) < _ROWS or not _stands_still(layout):
        return True
    headings = [understand(name, stated) for name, stated in zip(layout.names, layout.units, strict=True)]
    channels = {heading.channel for heading in headings}
    return "wind_direction" not in channels or not (channels & _WEATHER or "cloud" in words)


def doubt(layout: Layout) -> str:
    """Why columns may be the platform's own velocity, and where the wind may stand instead; "" where none is."""
    own = columns(layout)
    if not own:
        return ""
    moving, turned = _moving(layout), _turned(layout)
    why = f", since {moving!r} changes" if moving else f", since {turned!r} tells how it is turned" if turned else ""
    where = _named(layout, components(layout))
    return f"{_named(layout, own)} may be how the platform itself moves{why}" + (
        f"; the wind may be {where}" if where else ""
    )


def remarks(layout: Layout) -> tuple[str, ...]:
    """That the platform's own velocity is not read, beside a wind that is."""
    own = columns(layout)
    return (f"columns {_named(layout, own)} may be how the platform itself moves: not read as the wind",) if own else ()


def carried(layout: Layout) -> str:
    """The first column that speaks of a platform which carries the instrument about; "" where none does.

    It is the platform's own velocity, where a column tells that the platform moves or turns; or how it is turned, where
    there is a column for its position as well, though it may be empty.
    """
    own = columns(layout)
    if own and (_moving(layout) or _turned(layout)):
        return layout.names[own[0]]
    places = LATITUDE | LONGITUDE
    return _turned(layout) if any(set(words_of(name)) & places for name in layout.names) else ""


def vessel(layout: Layout) -> str:
    """The first column that shows that the platform moves: of a vessel's speed or course, or see `carried`."""
    named = (name for name in layout.names if set(words_of(name)) & _VESSEL)
    return next(named, "") or carried(layout)


def _named(layout: Layout, indices: Collection[int]) -> str:
    return ", ".join(repr(layout.names[index]) for index in indices)


def _velocities(layout: Layout) -> tuple[int, ...]:
    """Columns of a velocity along two or three axes, whose headings do not say that it is the wind's."""
    stems: dict[str, dict[str, int]] = {}
    for index, name in enumerate(layout.names):
        match = _ALONG.fullmatch(_bare(name))
        if match is None or "wind" in name.lower() or set(words_of(name)) & _OF_AIR:
            continue
        stems.setdefault(match["stem"], {}).setdefault((match["axis"] or match["first"])[0], index)
    found = [axes for axes in stems.values() if any(set(pair) <= set(axes) for pair in _PAIRS)]
    return tuple(sorted(index for axes in found for index in axes.values()))


def _bare(name: str) -> str:
    return _UNIT.sub("", name.strip()).strip().lower()


def _windy(layout: Layout, apart: Collection[int]) -> bool:
    """Whether the heading of another column names the wind."""
    headings = (understand(name, layout.units[at]) for at, name in enumerate(layout.names) if at not in apart)
    return any(heading.sure and "wind" in heading.channel for heading in headings)


def _others(layout: Layout, apart: Collection[int]) -> Mapping[int, str]:
    """Columns called u, v and w with the same letters behind, such as Um, Vm, Wm, as components of the wind."""
    by_name = {_bare(name): at for at, name in enumerate(layout.names) if at not in apart}
    for name in by_name:
        if name[:1] == "u" and all(f"{letter}{name[1:]}" in by_name for letter in "vw"):
            return {by_name[f"{letter}{name[1:]}"]: f"wind_{axis}" for letter, axis in zip("uvw", "xyz", strict=True)}
    return {}


def _turned(layout: Layout) -> str:
    """The first column of how the platform is turned; "" where there is none."""
    return next((name for name in layout.names if set(words_of(name)) & _TURNS), "")


def _moving(layout: Layout) -> str:
    """The first column of a position that changes; "" where none does."""
    return next((name for name, changes in _positions(layout) if changes), "")


def _stands_still(layout: Layout) -> bool:
    """Whether the table has a position, and none of it changes."""
    changing = [changes for _, changes in _positions(layout)]
    return bool(changing) and not any(changing)


def _positions(layout: Layout) -> Sequence[tuple[str, bool]]:
    """The columns of a position, and whether each changes."""
    found: list[tuple[str, bool]] = []
    for index, name in enumerate(layout.names):
        words = set(words_of(name))
        least = _STILL if words & (LATITUDE | LONGITUDE) else _CLIMBS if words & _HEIGHTS else None
        if least is None:
            continue
        value = numbers(layout.column(index), decimal=layout.decimal).value
        known = value[np.isfinite(value)]
        if len(known):
            found.append((name, float(np.ptp(known)) > least))
    return found
