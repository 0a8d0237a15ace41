"""Pictures that renders are made of, by name: textures of the cloth, and backgrounds.

A name is `kind/member`: `flag/japan`, `stripes/81234` (procedural, drawn from the seed 81234),
`photo/beach/3.jpg` (a file in the folder the user named). The same name gives the same picture, to
the last byte.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Protocol

import numpy as np

from flagdata.core.arrays import UInt8Array
from flagdata.errors import InputError
from flagdata.recipes.registry import Registry
from sim.assets.photos import Photos

PHOTO = "photo"


class AssetKind(Protocol):
    """A family of pictures."""

    def draw(self, rng: np.random.Generator) -> str:
        """Draws the name of one member."""
        ...

    def image(self, member: str) -> UInt8Array:
        """Renders a member's picture (height, width, 3), sRGB.

        Raises:
            UnknownNameError: there is no such member.
        """
        ...


TEXTURES = Registry(
    "texture",
    {
        "flag": "sim.assets.flags:NATIONAL",
        "banner": "sim.assets.banners:BANNER",
        "weave": "sim.assets.cloth_textures:WEAVE",
        "stripes": "sim.assets.cloth_textures:STRIPES",
        "checks": "sim.assets.cloth_textures:CHECKS",
        "print": "sim.assets.cloth_textures:PRINT",
    },
)
BACKGROUNDS = Registry(
    "background",
    {
        "sky": "sim.assets.backgrounds:SKY",
        "clouds": "sim.assets.backgrounds:CLOUDS",
        "hills": "sim.assets.backgrounds:HILLS",
        "foliage": "sim.assets.backgrounds:FOLIAGE",
        "buildings": "sim.assets.backgrounds:BUILDINGS",
    },
)


@dataclass(frozen=True, kw_only=True)
class Assets:
    """Where textures and backgrounds come from.

    Attributes:
        photos: a folder of photographs that take the place of procedural backgrounds; None for
            none.

    Raises:
        InputError: no such folder, or no photographs in it.
    """

    photos: Path | None = None

    def __post_init__(self) -> None:
        if self.photos is not None:
            self._photos()

    def texture(self, name: str) -> UInt8Array:
        """Renders a texture by name: (height, width, 3) sRGB, upper row first.

        Raises:
            UnknownNameError: there is no such texture.
        """
        kind, member = _split(name, "texture", "flag/japan")
        return TEXTURES[kind].image(member)

    def background(self, name: str) -> UInt8Array:
        """Renders a background by name: (height, width, 3) sRGB, read-only; the last few are not
        drawn anew.

        Raises:
            UnknownNameError: there is no such background.
            InputError: a photograph that cannot be read, or one without a folder of photographs.
        """
        kind, member = _split(name, "background", "sky/1")
        if kind == PHOTO:
            return self._photos().image(member)
        return _drawn_background(kind, member)

    def draw_texture(self, kinds: Sequence[str], rng: np.random.Generator) -> str:
        """Draws the name of a texture of one of these kinds, each with equal chance.

        Raises:
            UnknownNameError: a kind that does not exist.
        """
        return _draw(TEXTURES, kinds, rng)

    def draw_background(self, kinds: Sequence[str], rng: np.random.Generator) -> str:
        """Draws the name of a photograph where there is a folder of them, else of a background of
        one of these kinds.

        Raises:
            UnknownNameError: a kind that does not exist.
        """
        if self.photos is not None:
            return f"{PHOTO}/{self._photos().draw(rng)}"
        return _draw(BACKGROUNDS, kinds, rng)

    def _photos(self) -> Photos:
        if self.photos is None:
            raise InputError(
                "no folder of photographs was named", where=PHOTO, fix="name the folder they are in"
            )
        return Photos.of(self.photos)


@lru_cache(
    maxsize=8
)  # a film's background is that of the next one where a fit looks for what differs in the cloth
def _drawn_background(kind: str, member: str) -> UInt8Array:
    image = BACKGROUNDS[kind].image(member)
    image.flags.writeable = False
    return image


def _split(name: str, noun: str, example: str) -> tuple[str, str]:
    kind, slash, member = name.partition("/")
    if not slash or not member:
        raise InputError(
            f"{name!r} does not name a {noun}", where=noun, fix=f"write kind/member, as {example!r}"
        )
    return kind, member


def _draw(table: Mapping[str, AssetKind], kinds: Sequence[str], rng: np.random.Generator) -> str:
    sources = [table[kind] for kind in kinds]
    index = int(rng.integers(len(kinds)))
    return f"{kinds[index]}/{sources[index].draw(rng)}"
