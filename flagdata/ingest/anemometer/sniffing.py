"""The types of a guess at what a file is; the guessing itself is in `sniff`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

GuessKind = Literal["anemometer", "camera", "meshes", "markers", "record", "other"]


@dataclass(frozen=True, kw_only=True)
class Guess:
    """What a file may be.

    Attributes:
        format: a name of `formats.FORMATS`, or a word for what else it is ("video", "mesh folder",
            "gzip").
        score: 0 to 1; from `SURE` upwards it is taken without asking.
        reasons: what in the file speaks for it, with places.
        kind: which ingest it belongs to.
        recipe: the sensor recipe, for the format "delimited" and "host-stamped".
        fix: what to do next, where that is not to ingest it.
        draft: a recipe (TOML) for a table that no recipe describes; "?" stands where it is to be
            completed.
        notes: what was left out, and what is odd.
        doubts: what must be given before it can be read, each with the option that gives it.
        winds: labels of the anemometers, where a draft names several.
    """

    format: str
    score: float
    reasons: tuple[str, ...]
    kind: GuessKind = "anemometer"
    recipe: str | None = None
    fix: str | None = None
    draft: str | None = None
    notes: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    winds: tuple[str, ...] = ()


SURE = 0.5
NAMED = 0.98
"""Score of a format that the first bytes of a file name: no other is asked."""


@dataclass(frozen=True, kw_only=True)
class Head:
    """The beginning of a text file.

    Attributes:
        lines: up to `HEAD_LINES`, without their ends.
        counted: whether the stamps before them are none of the file's, but counted at a rate that
            the user gave.
    """

    lines: tuple[str, ...]
    counted: bool = False


HEAD_LINES = 1000
