"""Image sequences: a folder of PNG, JPEG, TIFF or BMP files, in the order of the numbers in their names."""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Iterator, Sequence
from fractions import Fraction
from pathlib import Path

import numpy as np
from PIL import Image

from flagdata.errors import InputError, LimitError, TimeError
from flagdata.findings import Finding, Severity
from flagdata.ingest.camera.damage import resized, undecoded
from flagdata.ingest.camera.geometry import Orientation
from flagdata.ingest.camera.luma import BROKEN, luma_of_image
from flagdata.ingest.camera.options import CameraOptions, Limits, exact
from flagdata.ingest.camera.source import Picture, SourceFacts
from flagdata.ingest.camera.stamps import Timing, survey

_SUFFIXES = frozenset({".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp"})
_FORMATS = ("PNG", "JPEG", "TIFF", "BMP")
_NUMBER = re.compile(r"(\d+)(?!.*\d)")
_EXIF = 0x8769
_ORIENTATION, _TAKEN, _TAKEN_PART, _TAKEN_ZONE = 0x0112, 0x9003, 0x9291, 0x9011


class SequenceSource:
    """A folder of images. See `Source`.

    The last number in a file's name is its place in the sequence, so that a number that is missing is a missing frame.
    The rate is `options.sequence_fps`; file times are not looked at.

    Raises:
        InputError: no images, images of several kinds, or none that can be read.
        LimitError: larger than `options.limits`.
        TimeError: no `sequence_fps`.
    """

    def __init__(self, folder: Path, options: CameraOptions) -> None:
        self._limits = options.limits
        self._where = str(folder)
        try:
            paths = sorted(p for p in folder.iterdir() if p.suffix.lower() in _SUFFIXES and p.is_file())
        except OSError as error:
            what = f"the folder cannot be read ({error.strerror})"
            raise InputError(what, where=self._where, fix="check its rights") from error
        if not paths:
            raise InputError(
                "the folder holds no PNG, JPEG, TIFF or BMP image", where=self._where, fix="give the folder"
            )
        kinds = {p.suffix.lower() for p in paths}
        if len(kinds - {".jpeg", ".tiff"}) > 1:
            raise InputError(
                f"the folder holds images of several kinds ({', '.join(sorted(kinds))})",
                where=self._where, fix="keep one recording in a folder",
            )  # fmt: skip
        if len(paths) > options.limits.frames:
            raise LimitError(
                f"{len(paths)} images are beyond the limit of {options.limits.frames}",
                where=self._where, fix="split the folder, or raise the limit",
            )  # fmt: skip
        if options.sequence_fps is None:
            raise TimeError(
                "images have no time stamps", where=self._where, fix="give the camera's frame rate (sequence_fps)"
            )
        numbers, findings = _places(paths)
        order = np.argsort(numbers, kind="stable")
        self._paths = [paths[i] for i in order]
        self._stamps = [int(numbers[i]) for i in order]
        self._broken: list[str] = []
        self._resized = 0
        rate = exact(options.sequence_fps)
        timing = survey(np.array(self._stamps, dtype=np.int64), tick=1 / rate, missing=0, fallback_rate=rate)
        self.facts = self._describe(timing, findings)
        pixels = self.facts.width * self.facts.height * len(paths)
        if pixels > options.limits.total_pixels:
            raise LimitError(
                f"{pixels} px in all are beyond the limit of {options.limits.total_pixels}",
                where=self._where, fix="split the folder, or raise the limit",
            )  # fmt: skip

    def _describe(self, timing: Timing, findings: list[Finding]) -> SourceFacts:
        """Facts from the first image that can be read."""
        problem = "none"
        for path in self._paths:
            try:
                with _open(path, self._limits) as image:
                    exif = image.getexif()
                    orientation = Orientation.of_exif(int(exif.get(_ORIENTATION, 1)))
                    recorded = _taken(exif.get_ifd(_EXIF)) if path == self._paths[0] else None
                    if image.mode in ("LA", "PA", "RGBA") or "transparency" in image.info:
                        findings.append(
                            Finding(kind="alpha-ignored", severity=Severity.WARNING, what="transparency was left aside")
                        )
                    luma_of_image(image)
                    return SourceFacts(
                        container="image-sequence",
                        codec=str(image.format).lower(),
                        pixel_format=image.mode,
                        width=image.width,
                        height=image.height,
                        aspect=Fraction(1),
                        orientation=orientation,
                        interlaced=False,
                        timing=timing,
                        metadata={},
                        recorded=recorded,
                        sequence=True,
                        findings=tuple(findings),
                    )
            except BROKEN as error:
                problem = f"{path.name}: {error}"
        raise InputError(
            f"not one of {len(self._paths)} images can be read ({problem})", where=self._where,
            fix="copy them from the camera again",
        )  # fmt: skip

    def pictures(self) -> Iterator[Picture]:
        for path, stamp in zip(self._paths, self._stamps, strict=True):
            try:
                with _open(path, self._limits) as image:
                    if image.size != (self.facts.width, self.facts.height):
                        self._resized += 1
                        continue
                    luma = luma_of_image(image)
            except BROKEN:
                self._broken.append(path.name)
                continue
            yield Picture(stamp=stamp, luma=lambda luma=luma: luma)

    def samples(self, runs: int, count: int, stride: int) -> Iterator[list[Picture]]:
        length = len(self._paths)
        first: int = 0
        for run in range(runs):
            start = max(first, length * run // runs)
            chosen = range(start, min(start + count * stride, length), stride)
            first = chosen.stop
            pictures = []
            for index in chosen:
                try:
                    with _open(self._paths[index], self._limits) as image:
                        if image.size == (self.facts.width, self.facts.height):
                            luma = luma_of_image(image)
                            pictures.append(Picture(stamp=self._stamps[index], luma=lambda luma=luma: luma))
                except BROKEN:
                    continue
            if pictures:
                yield pictures

    def damage(self) -> list[Finding]:
        first = self._broken[0] if self._broken else None
        return undecoded(len(self._broken), total=len(self._paths), first=first) + resized(self._resized)

    def close(self) -> None:
        """Nothing stays open between images."""


def _places(paths: Sequence[Path]) -> tuple[list[int], list[Finding]]:
    """Place of each file in the sequence: the last number of its name in units of their common step."""
    found = [_NUMBER.search(path.stem) for path in paths]
    numbers = [int(match[1][-18:]) for match in found if match]
    if len(numbers) < len(paths) or len(set(numbers)) < len(numbers):
        note = Finding(
            kind="order-by-name", severity=Severity.WARNING,
            what="the file names have no numbers: the images are taken in the order of their names, none as missing",
        )  # fmt: skip
        return list(range(len(paths))), [note]
    first = min(numbers)
    step = math.gcd(*(number - first for number in numbers)) or 1
    places = [(number - first) // step for number in numbers]
    if step == 1:
        return places, []
    note = Finding(
        kind="numbered-by-steps", severity=Severity.NOTE,
        what=f"the file names count in steps of {step}; one step is taken as one frame", value=float(step),
    )  # fmt: skip
    return places, [note]


def _open(path: Path, limits: Limits) -> Image.Image:
    """The image with its header read, its pixels not yet.

    Raises:
        LimitError: its header states a size beyond the limit.
    """
    try:
        with warnings.catch_warnings():
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
            where=str(path), fix="raise the limit if the file is to be trusted",
        )  # fmt: skip
    return image


def _taken(exif: dict[int, object]) -> str | None:
    """ISO 8601 text of Exif's DateTimeOriginal, its fraction and its zone, the last two where it has them."""
    date, _, clock = str(exif.get(_TAKEN, "")).partition(" ")
    if not clock:
        return None
    part = str(exif.get(_TAKEN_PART, "")).strip()
    place = str(exif.get(_TAKEN_ZONE, "")).strip()
    return f"{date.replace(':', '-')}T{clock.strip()}{'.' + part if part.isdigit() else ''}{place}"
