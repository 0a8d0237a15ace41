"""Image sequences: a folder of PNG, JPEG, TIFF, BMP or WebP files, in the order of the numbers in
their names.

Single pictures in files: opened safely, and what their heads state.
"""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

import numpy as np
from PIL import Image

from flagdata.core.files.regular_files import is_beside
from flagdata.core.findings import Finding
from flagdata.errors import InputError, LimitError, TimeError
from flagdata.ingest.camera import depth
from flagdata.ingest.camera.camera_options import CameraOptions, Limits, exact
from flagdata.ingest.camera.damage import resized_findings, undecoded_findings
from flagdata.ingest.camera.frame_stamps import survey
from flagdata.ingest.camera.luma import BROKEN, DEEP, Luma, luma_of_image
from flagdata.ingest.camera.picture_geometry import Orientation
from flagdata.ingest.camera.picture_names import order_pictures
from flagdata.ingest.camera.picture_source import Picture, SourceFacts

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
VIDEOS = frozenset({".mp4", ".mov", ".mts", ".avi", ".mkv", ".webm"})
"""Endings of films, one of which is given by its own path."""
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
        return (
            (self.height, self.width) if self.orientation.transpose else (self.width, self.height)
        )


def open_picture(path: Path, limits: Limits) -> Image.Image:
    """Opens a picture with its head read, its pixels not yet.

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
            f"the image is absurdly large ({error})",
            where=str(path),
            fix="scale it down, or leave it out",
        ) from None
    if image.width * image.height > limits.frame_pixels:
        image.close()
        raise LimitError(
            f"an image of {image.width} × {image.height} px is beyond the limit of "
            f"{limits.frame_pixels} px",
            where=str(path),
            fix="raise the limit if the file is to be trusted",
        )
    return image


def heads(paths: Sequence[Path], limits: Limits) -> list[Head | None]:
    """Reads the heads of pictures; None of those that are damaged.

    Raises:
        LimitError: one is larger than the limits.
    """
    known_heads: dict[Head, Head] = {}
    heads_read: list[Head | None] = []
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
                    # A phone's JPEG may carry a second picture that only says how to show the
                    # first.
                    several=image.format not in ("JPEG", "MPO")
                    and getattr(image, "n_frames", 1) > 1,
                )
        except BROKEN:
            heads_read.append(None)
        else:
            heads_read.append(known_heads.setdefault(head, head))
    return heads_read


def size_of_most(heads_read: Sequence[Head | None], *, where: str) -> tuple[int, int]:
    """Finds width and height that most pictures have once they are upright.

    Raises:
        InputError: no size is that of more pictures than any other, or all are damaged.
    """
    counts = Counter(head.upright for head in heads_read if head is not None).most_common(2)
    if not counts:
        raise InputError(
            f"not one of {len(heads_read)} images can be read",
            where=where,
            fix="copy them from the camera again",
        )
    if len(counts) > 1 and counts[0][1] == counts[1][1]:
        sizes = " and ".join(f"{wide} × {high}" for (wide, high), _ in sorted(counts))
        raise InputError(
            f"as many images have one size as another, {sizes} px: which of them are the recording "
            "is not known",
            where=where,
            fix="keep the images of one size in a folder",
        )
    return counts[0][0]


def taken(image: Image.Image) -> str | None:
    """Reads ISO 8601 text of Exif's DateTimeOriginal, its fraction and its zone, the last two where
    it has them."""
    exif = image.getexif().get_ifd(_EXIF)
    date, _, clock = str(exif.get(_TAKEN, "")).partition(" ")
    if not clock:
        return None
    part = str(exif.get(_TAKEN_PART, "")).strip()
    zone_text = str(exif.get(_TAKEN_ZONE, "")).strip()
    return (
        f"{date.replace(':', '-')}T{clock.strip()}{'.' + part if part.isdigit() else ''}{zone_text}"
    )


class SequenceSource:
    """A folder of images. See `Source`.

    The numbers in the names say the order and which frames are missing, see `picture_names`. Images
    of another size than most are left out. The rate is `options.sequence_fps`; file times are not
    looked at.

    Raises:
        InputError: no images, images of several kinds, names or sizes that do not say which are the
            recording, or none that can be read.
        LimitError: larger than `options.limits`.
        TimeError: no `sequence_fps`.
    """

    def __init__(self, folder: Path, options: CameraOptions) -> None:
        self._limits = options.limits
        self._where = str(folder)
        paths, findings_of_folder = self._files(folder)
        if options.sequence_fps is None:
            raise TimeError(
                "images have no time stamps",
                where=self._where,
                fix="give the camera's frame rate: --sequence-fps HZ",
            )
        rate = exact(options.sequence_fps)
        order = order_pictures([path.name for path in paths], rate=rate, where=self._where)
        self._paths = [paths[i] for i in order.order]
        self._stamps = order.places
        self._broken: list[str] = []
        self._heads = heads(self._paths, self._limits)
        self._size = size_of_most(self._heads, where=self._where)
        heads_kept = [
            head for head in self._heads if head is not None and head.upright == self._size
        ]
        self._resized = sum(head is not None for head in self._heads) - len(heads_kept)
        self._orientation = Counter(head.orientation for head in heads_kept).most_common(1)[0][0]
        self._white, depths = self._depth()
        self.facts = self._describe(
            rate, [*findings_of_folder, *order.findings, *depths, *_shown_otherwise(heads_kept)]
        )
        pixels = self.facts.width * self.facts.height * len(paths)
        if pixels > options.limits.total_pixels:
            raise LimitError(
                f"{pixels} px in all are beyond the limit of {options.limits.total_pixels}",
                where=self._where,
                fix="split the folder, or raise the limit",
            )

    def _files(self, folder: Path) -> tuple[list[Path], list[Finding]]:
        """Lists the folder's images by name, with a note of what else is in it."""
        try:
            files = sorted(
                path for path in folder.iterdir() if not is_beside(path.name) and path.is_file()
            )
        except OSError as error:
            message = f"the folder cannot be read ({error.strerror})"
            raise InputError(message, where=self._where, fix="check its rights") from error
        paths = [path for path in files if path.suffix.lower() in PICTURES]
        other_files = Counter(
            path.suffix.lower() or "no ending"
            for path in files
            if path.suffix.lower() not in PICTURES
        )
        listed = ", ".join(f"{count} of {ending}" for ending, count in other_files.most_common(5))
        if not paths:
            raise InputError(
                "the folder holds no PNG, JPEG, TIFF, BMP or WebP image"
                + (f", but files: {listed}" if other_files else ""),
                where=self._where,
                fix="give one video by its own path, not the folder"
                if VIDEOS & set(other_files)
                else "give the folder of the images; convert those of other formats to PNG",
            )
        kinds = sorted({PICTURES[path.suffix.lower()] for path in paths})
        if len(kinds) > 1:
            raise InputError(
                f"the folder holds images of several kinds ({', '.join(kinds)})",
                where=self._where,
                fix="keep one recording in a folder",
            )
        if len(paths) > self._limits.frames:
            raise LimitError(
                f"{len(paths)} images are beyond the limit of {self._limits.frames}",
                where=self._where,
                fix="split the folder, or raise the limit",
            )
        if not other_files:
            return paths, []
        return paths, [
            Finding.of(
                "files-not-read",
                f"{other_files.total()} files beside the images were not read: {listed}",
                count=other_files.total(),
            )
        ]

    def _depth(self) -> tuple[float, tuple[Finding, ...]]:
        """Finds the white of images of 16 bits by the brightest gray of all."""
        brightest = 0
        for path, head in zip(self._paths, self._heads, strict=True):
            if head is None or not head.mode.startswith(DEEP) or depth.fills(brightest):
                continue
            try:
                with open_picture(path, self._limits) as image:
                    brightest = max(brightest, int(np.asarray(image).max()))
            except BROKEN:
                continue
        return depth.white(brightest, which="these images")

    def _describe(self, rate: Fraction, findings: list[Finding]) -> SourceFacts:
        """Facts from the first image that can be read."""
        stamps = np.array(self._stamps, dtype=np.int64)
        timing = survey(stamps, tick=1 / rate, missing=0, fallback_rate=rate)
        problem = "none"
        for index, path in enumerate(self._paths):
            if not self._is_kept(index):
                continue
            try:
                with open_picture(path, self._limits) as image:
                    recorded = taken(image) if index == 0 else None
                    name, mode = str(image.format).lower(), image.mode
                    self._luma(image, index)
            except BROKEN as error:
                problem = f"{path.name}: {error}"
                continue
            wide, high = self._size
            return SourceFacts(
                container="image-sequence",
                codec=name,
                pixel_format=mode,
                width=high if self._orientation.transpose else wide,
                height=wide if self._orientation.transpose else high,
                aspect=Fraction(1),
                orientation=self._orientation,
                interlaced=False,
                timing=timing,
                metadata={},
                recorded=recorded,
                sequence=True,
                findings=tuple(findings),
            )
        raise InputError(
            f"not one of {len(self._paths)} images can be read ({problem})",
            where=self._where,
            fix="copy them from the camera again",
        )

    def _is_kept(self, index: int) -> bool:
        """Checks whether an image has the size of most; one whose head is damaged has none."""
        head = self._heads[index]
        return head is not None and head.upright == self._size

    def _luma(self, image: Image.Image, index: int) -> Luma:
        """Extracts the luma of an open image, turned as most of them are stored."""
        luma = luma_of_image(image)
        if image.mode.startswith(DEEP):
            luma = replace(luma, white=self._white)
        head = self._heads[index]
        if head is None or head.orientation == self._orientation:
            return luma
        return replace(luma, image=self._orientation.stored(head.orientation.upright(luma.image)))

    def _picture(self, index: int) -> Picture | None:
        """Decodes the image at a place in the order; None where it cannot be decoded."""
        try:
            with open_picture(self._paths[index], self._limits) as image:
                luma = self._luma(image, index)
        except BROKEN:
            return None
        return Picture(stamp=self._stamps[index], luma=lambda: luma)

    def pictures(self) -> Iterator[Picture]:
        for index, head in enumerate(self._heads):
            picture = self._picture(index) if self._is_kept(index) else None
            if picture is not None:
                yield picture
            elif head is None or self._is_kept(index):
                self._broken.append(self._paths[index].name)

    def samples(self, runs: int, count: int, stride: int) -> Iterator[list[Picture]]:
        length = len(self._paths)
        first: int = 0
        for run in range(runs):
            start = max(first, length * run // runs)
            chosen = range(start, min(start + count * stride, length), stride)
            first = chosen.stop
            decoded = [self._picture(index) for index in chosen if self._is_kept(index)]
            pictures = [picture for picture in decoded if picture is not None]
            if pictures:
                yield pictures

    def damage(self) -> list[Finding]:
        first = self._broken[0] if self._broken else None
        return undecoded_findings(
            len(self._broken), total=len(self._paths), first=first
        ) + resized_findings(self._resized, than="most")

    def close(self) -> None:
        """Closes nothing: no file stays open between images."""


def _shown_otherwise(heads_read: Sequence[Head]) -> list[Finding]:
    """Reports what in the images is not shown as their files say: transparency, further pages,
    turns that differ."""
    alpha, pages = sum(head.alpha for head in heads_read), sum(head.several for head in heads_read)
    turned = len(heads_read) - max(Counter(head.orientation for head in heads_read).values())
    findings = []
    if alpha:
        findings.append(
            Finding.of(
                "alpha-ignored",
                f"transparency of {alpha} images was left aside: the picture below it is read",
                count=alpha,
            )
        )
    if pages:
        findings.append(
            Finding.of(
                "pages-not-read",
                f"{pages} files hold several pictures each, of which the first was read",
                count=pages,
                fix="write each picture to a file of its own, numbered",
            )
        )
    if turned:
        findings.append(
            Finding.of(
                "orientation-changed",
                f"{turned} images are to be turned otherwise than the rest, by their Exif; they "
                "were turned so",
                count=turned,
                fix="if the camera did not turn, remove the tag Orientation from all of them",
            )
        )
    return findings
