"""Headings of components of the wind along the axes of the Earth, which no heading tells alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.winds import named_axes, own_motion
from flagdata.ingest.anemometer.winds.beside import has_companions
from flagdata.ingest.anemometer.words.headings import Heading, words_of
from flagdata.ingest.anemometer.words.wind_words import VERTICAL

NORTH = frozenset({"north", "northward", "meridional", "merid", "vwn", "vwnd", "vgrd", "ns"})
EAST = frozenset({"east", "eastward", "zonal", "vwe", "uwnd", "ugrd", "ew"})
"""Words of the components towards north and towards east."""
_AXES = (NORTH, EAST, frozenset({"south", "southward"}), frozenset({"west", "westward"}))
"""Words of the components towards north and east, and of what cannot be beside them."""
_COMPONENTS = ("wind_x", "wind_y", "wind_z")
_SPEED_UNITS = frozenset({"m/s", "km/h", "kn", "mph", "cm/s", "ft/s"})


def along_axes(layout: Layout, headings: Sequence[Heading]) -> tuple[list[Heading], bool]:
    """The headings with components towards north and east as what they are, and whether there are such.

    One column of each, and none of south or west, which would be the sides of a mast. A lone U or V is no component,
    but perhaps the speed itself. A velocity that may be the platform's own is none of the wind (`own_motion`).
    """
    own, beside = own_motion.columns(layout), own_motion.components(layout)
    headings = [
        replace(heading, channel="", quantity="", label=()) if at in own
        else replace(heading, channel=beside[at], quantity=beside[at], sure=False, label=()) if at in beside
        else heading
        for at, heading in enumerate(headings)
    ]  # fmt: skip
    if beside:
        return headings, False
    words = [set() if at in own else set(words_of(name)) for at, name in enumerate(layout.names)]
    found = list(headings)
    for at, channel in named_axes.components(layout, headings, apart=own).items():
        found[at] = replace(headings[at], channel=channel, quantity=channel, sure=True, label=())
    sides = [[at for at, said in enumerate(words) if _towards(said, headings[at], side)] for side in _AXES]
    if [len(side) for side in sides[:2]] == [1, 1] and not any(sides[2:]):
        for side, channel in ((sides[0][0], "wind_y"), (sides[1][0], "wind_x")):
            found[side] = replace(headings[side], channel=channel, quantity=channel, sure=True, spread=False, label=())
        for at, said in enumerate(words):
            if said & {"up", "upward", *VERTICAL} and headings[at].quantity in ("", "wind_z") and "wind" in said:
                found[at] = replace(headings[at], channel="wind_z", quantity="wind_z", sure=True, label=())
        return found, True
    if not any(heading.quantity for heading in headings if heading.sure and "wind" in heading.quantity):
        triple = {name: at for at, said in enumerate(words) for name in ("vx", "vy", "vz") if name in said}
        if {"vx", "vy"} <= set(triple):
            for name, at in triple.items():
                channel = f"wind_{name[1]}"
                found[at] = replace(headings[at], channel=channel, quantity=channel, sure=False, label=())
            return found, False
    _speed_beside_its_direction(found, words)
    for letter, own_axis, other in (("u", "wind_x", "wind_y"), ("v", "wind_y", "wind_x")):
        if not any(heading.channel == other for heading in headings):
            for at, heading in enumerate(headings):
                if heading.channel == own_axis and words_of(layout.names[at])[:1] == [letter]:
                    said = has_companions(layout, at)
                    found[at] = replace(heading, channel="wind_speed", quantity="wind_speed", sure=said)
    return found, False


def _speed_beside_its_direction(found: list[Heading], words: Sequence[set[str]]) -> None:
    """Make W_vel beside W_dir, and VVel (viento) beside VDir, the speed of the wind where no other component stands."""
    for letter, channel in (("w", "wind_z"), ("v", "wind_y")):
        if any(heading.channel in _COMPONENTS and heading.channel != channel for heading in found):
            continue
        own = [heading for heading, said in zip(found, words, strict=True) if letter in said]
        if not any(heading.channel == "wind_direction" for heading in own):
            continue
        for at, heading in enumerate(found):
            if heading.channel == channel and words[at] in ({letter, "vel"}, {letter, "velocity"}):
                found[at] = replace(heading, channel="wind_speed", quantity="wind_speed", sure=True)


def _towards(words: set[str], heading: Heading, side: frozenset[str]) -> bool:
    """Whether a heading is of the wind along an axis of the Earth, and not of its direction or spread."""
    if words & {"vwn", "vwe", "uwnd", "vwnd", "ugrd", "vgrd"}:
        return bool(words & side)
    windy = any("wind" in word for word in words) or heading.unit in _SPEED_UNITS
    none = heading.quantity.endswith("direction") or heading.spread or words & {"variance", "pos", "position"}
    return windy and bool(words & side) and not none
