"""Photographs in a folder the user names."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageOps, UnidentifiedImageError

from flagdata.core.arrays import UInt8Array
from flagdata.errors import InputError, UnknownNameError

_SUFFIXES = (".jpg", ".jpeg", ".png", ".webp", ".tif", ".tiff", ".bmp")
_LONGEST = 1024  # px; larger ones are reduced, since a frame never shows more


@dataclass(frozen=True, kw_only=True)
class Photos:
    """The photographs of a folder and the folders in it, by their path in it with forward slashes.

    Attributes:
        folder: where they are.
        members: their names, sorted.
    """

    folder: Path
    members: tuple[str, ...]

    @classmethod
    def of(cls, folder: Path) -> Photos:
        """Lists a folder.

        Raises:
            InputError: it is no folder, or holds no photographs.
        """
        return _list_photos(folder.resolve())

    def draw(self, rng: np.random.Generator) -> str:
        return self.members[int(rng.integers(len(self.members)))]

    def image(self, member: str) -> UInt8Array:
        """Reads a photograph (height, width, 3), turned upright as its EXIF data say, at most 1024
        px long.

        Raises:
            UnknownNameError: it is not in the folder.
            InputError: it cannot be read.
        """
        if member not in self.members:
            raise UnknownNameError.of("photograph", member, self.members, where=str(self.folder))
        path = self.folder / member
        try:
            with Image.open(path) as opened:
                upright = ImageOps.exif_transpose(opened).convert("RGB")
        except (UnidentifiedImageError, OSError, Image.DecompressionBombError) as error:
            raise InputError(
                f"cannot be read: {error}", where=str(path), fix="mend it or take it out"
            ) from error
        upright.thumbnail((_LONGEST, _LONGEST), Image.Resampling.LANCZOS, reducing_gap=None)
        return np.asarray(upright)


@functools.cache
def _list_photos(folder: Path) -> Photos:
    if not folder.is_dir():
        raise InputError(
            "there is no such folder", where=str(folder), fix="name a folder of photographs"
        )
    members = sorted(
        path.relative_to(folder).as_posix()
        for path in folder.rglob("*")
        if path.suffix.lower() in _SUFFIXES
    )
    if not members:
        raise InputError(
            "no photographs are in this folder",
            where=str(folder),
            fix=f"put files {', '.join(_SUFFIXES)} there",
        )
    return Photos(folder=folder, members=tuple(members))
