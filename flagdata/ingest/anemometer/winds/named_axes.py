"""Columns that differ only by U, V and W in their headings, as "Aux 1 - U", "Aux 2 - V", "Aux 3 - W": one wind.

An analyser or logger names its inputs by number and lets the user write what is on them. A letter that has the others
beside it is a component, whatever else its heading says, and never a speed.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from itertools import groupby

from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.words.headings import Heading, words_of

_AXES = {"u": "wind_x", "v": "wind_y", "w": "wind_z"}
_UNIT = re.compile(r"\s*[\[(<{][^\])>}]*[\])>}]\s*$")
_NO_AIR = frozenset({"water", "ocean", "sea", "geostrophic", "stokes", "drift", "ice", "tide", "tidal", "swell"})
"""Words of velocities of what is not the air."""


def components(layout: Layout, headings: Sequence[Heading], *, apart: Collection[int] = ()) -> Mapping[int, str]:
    """Columns of three that differ only by U, V and W in their headings and are in one unit of speed, as channels.

    Args:
        headings: what they say otherwise; only those that are read as speeds are looked at.
        apart: columns that are none.
    """
    found: dict[int, str] = {}
    speeds = {at for at, heading in enumerate(headings) if heading.channel == "wind_speed" and heading.unit is not None}
    named = sorted((rest, headings[at].unit or "", at, axis) for at, rest, axis in _lettered(layout, speeds - {*apart}))
    for _, members in groupby(named, key=lambda one: one[:2]):
        axes = [(axis, at) for _, _, at, axis in members]
        if sorted(axis for axis, _ in axes) == ["u", "v", "w"]:
            found |= {at: _AXES[axis] for axis, at in axes}
    return found


def is_lettered(layout: Layout, index: int) -> bool:
    """Whether a heading has the letter of a component, and a column beside differs by another of them alone."""
    own = next(((rest, axis) for _, rest, axis in _lettered(layout, [index])), None)
    others = (at for at in range(layout.number_of_columns()) if at != index)
    return own is not None and any(rest == own[0] and axis != own[1] for _, rest, axis in _lettered(layout, others))


def is_letter(layout: Layout, index: int) -> bool:
    """Whether a heading is the letter of a component and no more, as U or v [m/s]."""
    return next((not rest for _, rest, _ in _lettered(layout, [index])), False)


def _lettered(layout: Layout, columns: Iterable[int]) -> list[tuple[int, str, str]]:
    """The columns with one letter of a component, the words of their heading beside it, and the letter."""
    found: list[tuple[int, str, str]] = []
    for at in columns:
        words = words_of(_UNIT.sub("", layout.names[at]))
        letters = [word for word in words if word in _AXES]
        rest = [word for word in words if word not in _AXES and not word.replace(".", "").isdigit()]
        if len(letters) == 1 and not _NO_AIR & set(rest):
            found.append((at, " ".join(rest), letters[0]))
    return found
