"""What a verdict has to know of an effect before it weighs it: what its recordings have to have,
what of the base model copies it, and with which other effects it is confused."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum


class Need(StrEnum):
    """What recordings, or what is stated of their set-up, may have."""

    MARKERS = "markers or meshes"
    FILMS = "films"
    FREE_HOIST = "a hoist that is free between its corners"
    STILL = "attachments that stand still"
    TURBULENCE = "a log of the wind's turbulence"
    MAST = "a mast that measures the wind at several heights"
    AREA_WEIGHT = "the cloth's area weight, stated to a few percent"
    DIRECTION = "the wind's direction, stated to a degree or two"
    ANCHORS = "the places of the attachments, stated"


@dataclass(frozen=True, kw_only=True)
class Copied:
    """How the base model does what an effect does, by parameters of its own.

    Attributes:
        by: the parameters, as in "the area weight": what they may be as long as they are fitted.
        shown_by: what has to be stated before the effect shows.
        how: that is measured.
    """

    by: str
    shown_by: Need
    how: str


CLASSES: Mapping[str, str] = {
    "dynamic-pressure": "scale of the wind's pressure",
    "tangential-drag": "friction along the cloth",
    "fluid-inertia": "air that moves with the cloth",
    "hem": "mass at the edges and in all the cloth",
    "bending": "bending at the hems and friction in bending",
    "turbulence": "wind that is not as steady as logged",
}
"""Effects that recordings of one flag in a few steady winds hardly separate, from the known
confusions: class → what its effects have in common."""
