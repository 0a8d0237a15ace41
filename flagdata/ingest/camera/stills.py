"""Single pictures in files: opened safely, and what their heads state."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from PIL import Image

from flagdata.errors import InputError, LimitError
from flagdata.ingest.camera.geometry import Orientation
from flagdata.ingest.camera.luma import BROKEN
from flagdata.ingest.camera.options import Limits

PICTURES = {
    ".png": "PNG",
    ".jpg": "JPEG",
    ".jpeg": "JPEG",
    ".tif": "TIFF",
    ".tiff": "TIFF",
    ".bmp": "BMP",
    ".webp": "WEBP",
}
"""Endings of the names of pictures that are read, and their formats."""
_FORMATS = tuple(sorted(set(PICTURES.values())))
_EXIF = 0x8769
_ORIENTATION, _TAKEN, _TAKEN_PART, _TAKEN_ZONE = 0x0112, 0x9003, 0x9291, 0x9011


@dataclass(frozen=True, kw_only=True)
class Head:
    """What the head of a picture's file states.

    Attributes:
        width, height: of the stored picture [px].
        alpha: whether it holds transparency.
        several: whether the file holds more than one picture.
    """

    width: int
    height: int
    orientation: Orientation
    mode: str
    alpha: bool
    several: bool

    @property
    def upright(self) -> tuple[int, int]:
        """Width and height of the picture once it is upright."""
        return (self.height, self.width) if self.orientation.transpose else (self.width, self.height)


def open_picture(path: Path, limits: Limits) -> Image.Image:
    """The picture with its head read, its pixels not yet.

    Raises:
        LimitError: its head states a size beyond the limit.
        OSError, ValueError, ...: it is damaged, see `luma.BROKEN`.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of EXIF data that are damaged
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            image = Image.open(path, formats=_FORMATS)
    except (Image.DecompressionBombWarning, Image.DecompressionBombError) as error:
        raise LimitError(
            f"the image is absurdly large ({error})", where=str(path), fix="scale it down, or leave it out"
        ) from None
    if image.width * image.height > limits.frame_pixels:
        image.close()
        raise LimitError(
            f"an image of {image.width} × {image.height} px is beyond the limit of {limits.frame_pixels} px",
            where=str(path),
            fix="raise the limit if the file is to be trusted",
        )
    return image


def heads(paths: Sequence[Path], limits: Limits) -> list[Head | None]:
    """The heads of pictures; None of those that are damaged.

    Raises:
        LimitError: one is larger than the limits.
    """
    alike: dict[Head, Head] = {}
    found: list[Head | None] = []
    for path in paths:
        try:
            with warnings.catch_warnings(), open_picture(path, limits) as image:
                warnings.simplefilter("ignore", UserWarning)  # of EXIF data that are damaged
                head = Head(
                    width=image.width,
                    height=image.height,
                    mode=image.mode,
                    alpha=image.has_transparency_data,
                    orientation=Orientation.of_exif(int(image.getexif().get(_ORIENTATION, 1))),
                    # A phone's JPEG may carry a second picture that only says how to show the first.
                    several=image.format not in ("JPEG", "MPO") and getattr(image, "n_frames", 1) > 1,
                )
        except BROKEN:
            found.append(None)
        else:
            found.append(alike.setdefault(head, head))
    return found


def size_of_most(found: Sequence[Head | None], *, where: str) -> tuple[int, int]:
    """Width and height that most pictures have once they are upright.

    Raises:
        InputError: no size is that of more pictures than any other, or all are damaged.
    """
    counts = Counter(head.upright for head in found if head is not None).most_common(2)
    if not counts:
        raise InputError(
            f"not one of {len(found)} images can be read", where=where, fix="copy them from the camera again"
        )
    if len(counts) > 1 and counts[0][1] == counts[1][1]:
        sizes = " and ".join(f"{wide} × {high}" for (wide, high), _ in sorted(counts))
        raise InputError(
            f"as many images have one size as another, {sizes} px: which of them are the recording is not known",
            where=where,
            fix="keep the images of one size in a folder",
        )
    return counts[0][0]


def taken(image: Image.Image) -> str | None:
    """ISO 8601 text of Exif's DateTimeOriginal, its fraction and its zone, the last two where it has them."""
    exif = image.getexif().get_ifd(_EXIF)
    date, _, clock = str(exif.get(_TAKEN, "")).partition(" ")
    if not clock:
        return None
    part = str(exif.get(_TAKEN_PART, "")).strip()
    place = str(exif.get(_TAKEN_ZONE, "")).strip()
    return f"{date.replace(':', '-')}T{clock.strip()}{'.' + part if part.isdigit() else ''}{place}"
