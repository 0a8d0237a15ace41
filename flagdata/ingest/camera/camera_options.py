"""What a user can say about a camera file, and the limits that are kept whatever the file says."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any, Literal

from flagdata.core.schema import FRAME_RATE, FRAME_SIZE
from flagdata.errors import UsageError
from flagdata.timebase import zone

_BOX = re.compile(r"^\s*([0-9]{1,9})\s*,\s*([0-9]{1,9})\s*,\s*([0-9]{1,9})\s*,\s*([0-9]{1,9})\s*$")


@dataclass(frozen=True, kw_only=True)
class CropBox:
    """A rectangle of the upright source image in whole pixels: `x` to the right, `y` down, from the
    top left corner."""

    x: int
    y: int
    width: int
    height: int

    def __post_init__(self) -> None:
        if self.x < 0 or self.y < 0 or self.width < 1 or self.height < 1:
            raise UsageError(
                f"crop {self} is empty or outside the image",
                fix="give x,y ≥ 0 and width,height ≥ 1",
            )

    def __str__(self) -> str:
        return f"{self.x},{self.y},{self.width},{self.height}"

    def as_tuple(self) -> tuple[int, int, int, int]:
        return (self.x, self.y, self.width, self.height)


Crop = CropBox | Literal["whole", "square", "auto"]


def parse_crop(text: str) -> Crop:
    """Reads the crop that `text` names: "x,y,width,height" in pixels of the upright image, "whole",
    "square" or "auto".

    Raises:
        UsageError: anything else.
    """
    match = _BOX.match(text)
    if match:
        x, y, width, height = (int(part) for part in match.groups())
        return CropBox(x=x, y=y, width=width, height=height)
    word = text.strip().lower()
    if word == "whole" or word == "square" or word == "auto":
        return word
    raise UsageError(
        f"crop {text!r} is not a crop",
        where="--crop",
        fix="give x,y,width,height in pixels, or whole, square or auto",
    )


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Bounds checked against a file's headers before anything of that size is allocated.

    Attributes:
        frame_pixels: pixels of one frame; the default admits 8K video (33 Mpx) twice over.
        frames: frames of one file; the default is 18 hours at 60 Hz.
        duration: from the first to the last stamp [s], after `true_fps`.
        total_pixels: frames × pixels; the default is 40 hours of 1080p60.
    """

    frame_pixels: int = 2**26
    frames: int = 4_000_000
    duration: float = 48 * 3600.0
    total_pixels: int = 18 * 10**12

    def __post_init__(self) -> None:
        if min(self.frame_pixels, self.frames, self.duration, self.total_pixels) <= 0:
            raise UsageError(
                "a limit that is not positive admits nothing", fix="give positive limits"
            )


@dataclass(frozen=True, kw_only=True)
class CameraOptions:
    """How to read one camera file.

    Attributes:
        start: instant of the first frame on the camera's clock [UTC ns] (`timebase.parse` makes it
            of text with a zone); `None` takes it from the file's metadata, or refuses.
        zone: the zone of a camera whose metadata state a wall-clock time without one
            ("Europe/Amsterdam"); used for nothing else.
        true_fps: rate at which a high-speed camera really ran [Hz], where its container states a
            slower play-back rate; all stamps are rescaled by container rate / true_fps. `None`
            believes the container.
        sequence_fps: rate of image sequences and raw streams, which have no stamps [Hz]. Refused
            for files that have.
        rate: rate of the frames that come out [Hz], on an exact grid of instants from the first
            frame on; "native" keeps each source frame at its own stamp.
        crop: a box, "whole" (all of the image), "square" (the largest centred square) or "auto"
            (where the motion is). Any of them is scaled into the output without distortion and
            padded with black where it is not square.
        exposure: exposure time [s], no longer than the true step from frame to frame; half of it is
            added to each stamp, which then is mid-exposure. `None` when unknown.
        tolerance: largest distance of a source frame from the grid instant it may stand for [s].
            `None` takes half a grid period or 3/4 of a source period, whichever is more, but no
            more than 3 grid periods.
        size: side of the square frames that come out [px].
        threads: decoder threads; frames do not depend on it.
        topic: of pictures in an MCAP file, or camera of a LeRobot data set; `None` takes the only
            one.
        episode: of a LeRobot data set; `None` takes the only one.
        chapters: files of the same recording that follow the one that is opened, in order; see
            `joined`.
        stream: number of the video stream in its container; `None` takes the first.
    """

    start: int | None = None
    zone: str | None = None
    true_fps: float | None = None
    sequence_fps: float | None = None
    rate: float | Literal["native"] = FRAME_RATE
    crop: Crop = "whole"
    exposure: float | None = None
    tolerance: float | None = None
    size: int = FRAME_SIZE
    threads: int = 1
    limits: Limits = field(default_factory=Limits)
    topic: str | None = None
    episode: int | None = None
    chapters: tuple[Path, ...] = ()
    stream: int | None = None

    def __post_init__(self) -> None:
        rates = {"true_fps": self.true_fps, "sequence_fps": self.sequence_fps}
        if self.rate != "native":
            rates["rate"] = self.rate
        for name, value in rates.items():
            if value is not None and not (math.isfinite(value) and 1e-6 <= value <= 1e6):
                raise UsageError(
                    f"{name} = {value} Hz is not a frame rate", fix="give a rate of 1e-6 to 1e6 Hz"
                )
        for name, value in {"exposure": self.exposure, "tolerance": self.tolerance}.items():
            if value is not None and not (math.isfinite(value) and 0 <= value <= 10):
                raise UsageError(f"{name} = {value} s is out of range", fix="give seconds, 0 to 10")
        if self.rate == "native" and self.tolerance is not None:
            raise UsageError(
                "a tolerance has no meaning at the native rate", fix="drop it, or give a rate"
            )
        if not 8 <= self.size <= 4096:
            raise UsageError(f"size = {self.size} px is out of range", fix="give 8 to 4096")
        if not 1 <= self.threads <= 64:
            raise UsageError(f"threads = {self.threads} is out of range", fix="give 1 to 64")
        if not (isinstance(self.crop, CropBox) or self.crop in ("whole", "square", "auto")):
            raise UsageError(
                f"crop {self.crop!r} is not a crop",
                fix="give a CropBox, 'whole', 'square' or 'auto'",
            )
        if self.zone is not None:
            zone(self.zone, where="zone")

    def recipe(self) -> dict[str, Any]:
        """Returns all options that shape the frames or their times, as JSON values; threads and
        limits do not. Chapters are a part of the source.

        A topic, an episode and a stream are there only where they are given, so that older
        artifacts keep their hash.
        """
        chosen = {"topic": self.topic, "episode": self.episode, "stream": self.stream}
        return {
            "start": self.start,
            "zone": self.zone,
            "true_fps": self.true_fps,
            "sequence_fps": self.sequence_fps,
            "rate": self.rate,
            "crop": str(self.crop),
            "exposure": self.exposure,
            "tolerance": self.tolerance,
            "size": self.size,
            **{name: value for name, value in chosen.items() if value is not None},
        }


def exact(rate: float) -> Fraction:
    """Finds the rate that a user's decimal number means: 25.0 is 25, and 29.97 is 30000/1001 as in
    television.

    NTSC rates are 1000/1001 of a whole number (SMPTE 170M); their decimal forms (23.98, 29.97,
    59.94, 119.88) are rounded names.
    """
    plain = Fraction(str(rate))
    for frames in (24, 30, 48, 60, 120, 240):
        ntsc = Fraction(frames * 1000, 1001)
        if plain.denominator > 1 and abs(plain - ntsc) <= Fraction(1, 200):
            return ntsc
    return plain
