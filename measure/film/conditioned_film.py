"""A film that is made fit while it is read: steadied, cropped to its flag, all else frozen
(`models.conditioning`).

Parts of a film in which the picture's edge cuts the flag off: left out, where enough is left
without them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from flagdata.core.arrays import BoolArray, FloatArray, UInt8Array
from flagdata.core.findings import Finding, Severity
from flagdata.core.schema import FRAME_SIZE
from flagdata.errors import UsageError
from flagdata.ingest.camera import CropBox
from flagdata.ingest.films.film import Film
from measure.gate.counted import SUSPECTED, reasons
from measure.gate.reasons import REASONS
from measure.gate.watch import FilmWatch
from models.conditioning import Conditioning, Follower, conditioning_of
from models.conditioning.conditioning import LEAST, SAMPLE
from models.conditioning.regions import MOMENT
from models.conditioning.repeats import TimedFrame
from models.conditioning.whole import CUT, SIDES

_REPORTED = 0.05
"""Share of the film in which the flag is cut off, from which on it is reported."""


@dataclass(frozen=True, kw_only=True, eq=False)
class CutOff:
    """When the flag is cut off.

    Attributes:
        times: (n,) of a sample of the film's frames [s].
        cut: (n, 4) whether the edge on each of `SIDES` cuts the flag off.
        enough: time with the whole flag, in one piece, that a film must have for the rest to be
            left out [s].
    """

    times: FloatArray
    cut: BoolArray
    enough: float

    @cached_property
    def any(self) -> BoolArray:
        """(n,) whether any edge does."""
        return np.asarray(self.cut.any(axis=1), dtype=np.bool_)

    @cached_property
    def partly(self) -> bool:
        """Whether the film is cut off in a part and whole for long enough in another."""
        return bool(self.any.any()) and self._longest >= self.enough

    @property
    def _longest(self) -> float:
        """Longest time from the first to the last of frames in a row that are whole [s]; 0 without
        any."""
        whole = np.split(np.arange(len(self.times)), np.flatnonzero(np.diff(self.any)) + 1)
        return max(
            (float(np.ptp(self.times[run])) for run in whole if not self.any[run[0]]), default=0.0
        )

    def left_out(self, time: float) -> bool:
        """Returns whether the frame of a time [s] is: next to a frame of the sample that is cut
        off."""
        if not self.partly:
            return False
        after = int(np.searchsorted(self.times, time))
        return bool(self.any[max(after - 1, 0) : after + 1].any())

    def findings(self) -> tuple[Finding, ...]:
        """Reports where the flag is cut off."""
        share = float(self.any.mean())
        if not share or (share < _REPORTED and not self.partly):
            return ()
        where = ", ".join(
            f"the {side} edge in {side_share:.0%}"
            for side, side_share in zip(SIDES, self.cut.mean(axis=0), strict=True)
            if side_share > 0
        )
        done = "; those are left out" if self.partly else ""
        return (
            Finding.of(
                "flag-cut-off",
                f"the flag reaches beyond the picture at {where} of the film's frames{done}",
                value=share,
                fix="film so that the whole flag is in the picture",
            ),
        )


_HELD = 640_000_000
"""Bytes of frames up to which a film is held, so that it is decoded once: ten seconds of 1080p.
Longer ones are decoded twice and hold a sample."""
_LOST = 0.05
"""Share of frames without the background's features from which on a warning is due."""
_ENLARGED = 2.0
_LONGER = 1.15
"""By how much an outline may be longer, for its height at the hoist, than the flag that was given:
it is foreshortened, droops and flutters, all of which make it shorter."""


class WholeFilm(Film, Protocol):
    """A film of the whole picture."""

    @property
    def width(self) -> int:
        """Of the picture in which a crop is given [px]."""
        ...

    @property
    def height(self) -> int:
        """Of the picture in which a crop is given [px]."""
        ...


class ConditionedFilm:
    """A film made fit. Camera and flag are sought in the part that is read, anew for each reading.

    Args:
        film: that is made fit.
        crop: the region in which the flag is; None for the whole picture.
        flag: number of the flag, from 1; None for the one that is most like a flag.
        aspect: length over height of the flag as the user gave it; None where it was not given.

    Attributes:
        found: what the last reading found; None before the first, and of fewer frames than a search
            takes.
        reference: (height, width) the frame that all others are registered to; None likewise.
        piece: time with the whole flag, in one piece, that is enough where the rest is cut off [s]:
            two windows of a flag of 1.5 m, unless a reader of other windows sets it.
        searched: called after each frame in which camera and flag are sought, with about how many
            there are and 1.

    Raises:
        UsageError: a crop beyond the picture.
    """

    def __init__(
        self,
        film: WholeFilm,
        *,
        crop: CropBox | None = None,
        flag: int | None = None,
        aspect: float | None = None,
    ) -> None:
        if crop is not None and (
            crop.x + crop.width > film.width or crop.y + crop.height > film.height
        ):
            raise UsageError(
                f"the crop {crop} reaches beyond the picture of {film.width} × {film.height} px",
                where="--crop",
                fix="give x,y,width,height of a region inside it",
            )
        self._film, self._crop, self._flag, self._aspect = film, crop, flag, aspect
        self._follower: Follower | None = None
        self._watch: FilmWatch | None = None
        self._cut: CutOff | None = None
        self.found: Conditioning | None = None
        self.reference: UInt8Array | None = None
        self.piece = 2.4
        self.searched: Callable[[int, int], None] | None = None

    @property
    def name(self) -> str:
        return self._film.name

    @property
    def rate(self) -> float:
        return self._film.rate

    @property
    def duration(self) -> float:
        return self._film.duration

    @property
    def start(self) -> int | None:
        return self._film.start

    def frames(self, first: float, last: float) -> Iterator[TimedFrame]:
        in_memory: list[TimedFrame] = []
        sample: list[TimedFrame] = []
        duration = min(last, self.duration) - max(first, 0.0)
        chosen, total = _chosen(self.rate, duration), math.ceil(duration * self.rate)
        is_held = True
        for k, (time, picture) in enumerate(self._film.frames(first, last)):
            if chosen(k):
                sample.append((time, picture))
            is_held = is_held and max(k + 1, total) * picture.nbytes <= _HELD
            if is_held:
                in_memory.append((time, picture))
            else:
                in_memory.clear()
            if self.searched is not None:
                self.searched(total, 1)
        source = in_memory if is_held else self._film.frames(first, last)
        if len(sample) < LEAST:
            yield from source
            return
        pictures = [picture for _, picture in sample]
        self.found = conditioning_of(
            pictures,
            size=FRAME_SIZE,
            times=np.array([time for time, _ in sample]),
            flag=self._flag,
            within=self._within(pictures[0].shape),
        )
        self.reference = pictures[len(pictures) // 2]
        times = np.array([time for time, _ in sample])
        self._cut = cut = CutOff(times=times, cut=self.found.cut > CUT, enough=self.piece)
        del sample, pictures
        self._follower, self._watch = follower, watch = (
            Follower(self.found),
            FilmWatch(rate=self.rate),
        )
        for time, picture in source:
            watch.look(time, picture)
            fit_frame = follower.show(picture)
            if not cut.left_out(time):
                yield time, fit_frame

    def _within(self, shape: tuple[int, ...]) -> tuple[int, int, int, int] | None:
        """Returns the crop in pixels of frames of this shape."""
        if self._crop is None:
            return None
        scale = shape[1] / self._film.width
        x, y, width, height = (round(value * scale) for value in self._crop.as_tuple())
        return x, y, width, height

    def findings(self) -> tuple[Finding, ...]:
        conditioning, follower, watch, cut = self.found, self._follower, self._watch, self._cut
        if conditioning is None or follower is None or watch is None or cut is None:
            return self._film.findings()
        faults = reasons(watch, conditioning, follower, aspect=self._aspect)
        if cut.partly:  # what is left shows the whole flag
            faults = tuple(fault for fault in faults if fault.kind != "cut-off")
        of_conditioning = [
            *_of_camera(conditioning, follower),
            *_of_flag(conditioning, self.reference, number_given=self._flag is not None),
        ]
        if all(fault.kind != "another-shape" for fault in faults):
            of_conditioning += _of_aspect(conditioning, self._aspect)
        if all(fault.kind != "second-pole" for fault in faults):
            of_conditioning += _of_second_pole(conditioning)
        if all(fault.kind != "cut-off" for fault in faults):
            of_conditioning += cut.findings()
        return (*self._film.findings(), *of_conditioning, *faults)

    @property
    def sentences(self) -> tuple[str, ...]:
        """What was found, for people; none before a reading."""
        before = len(self._film.findings())
        return tuple(finding.what for finding in self.findings()[before:])

    @property
    def figures(self) -> dict[str, Any] | None:
        """What was found, as JSON values; None before a reading."""
        if self.found is None or self._follower is None:
            return None
        conditioning, follower = self.found, self._follower
        return {
            "camera": {
                "moves": conditioning.camera.moves,
                "evidence": conditioning.camera.evidence,
                **follower.motion(),
                "lost": follower.lost,
            },
            "flags": [
                {
                    "box": [edge / conditioning.scale for edge in region.box],
                    "share": region.share,
                    "hoist": region.hoist,
                    "aspect": region.aspect,
                }
                for region in conditioning.regions
            ],
            "chosen": conditioning.chosen + 1 if conditioning.regions else None,
            "square": [conditioning.square.x, conditioning.square.y, conditioning.square.side],
            "cut_off": conditioning.cut_share,
        }


def _chosen(rate: float, duration: float) -> Callable[[int], bool]:
    """Selects the frames of a sample of some `SAMPLE`: evenly spread; of a long film in pairs, the
    frames of each `MOMENT` apart at most.

    Args:
        rate: of the film [Hz].
        duration: of the part that is read [s].
    """
    stride = max(1, math.ceil(duration * rate / SAMPLE))
    offset = max(1, math.floor(MOMENT * rate))
    if stride <= offset:
        return lambda k: k % stride == 0
    return lambda k: k % (2 * stride) in (0, offset)


def _of_camera(conditioning: Conditioning, follower: Follower) -> list[Finding]:
    if not conditioning.camera.known:
        return [
            Finding.of(
                "camera-unknown",
                "no feature of the background shows the camera's motion; no frame was moved",
            )
        ]
    if not conditioning.camera.moves:
        return [
            Finding.of(
                "camera-still",
                f"the camera is still: {conditioning.camera.evidence} stay in place",
                count=conditioning.camera.support,
            )
        ]
    motion = follower.motion()
    notes = [
        Finding.of(
            "camera-moves",
            f"the camera drifts {motion['drift']:.1f} px and shakes {motion['shake']:.2f} px from "
            "frame to frame, "
            f"by {conditioning.camera.evidence}; the frames were moved back",
            value=motion["drift"],
            count=conditioning.camera.support,
        )
    ]
    total = len(follower.path)
    if follower.lost > _LOST * total:
        notes.append(
            Finding.of(
                "camera-lost",
                f"in {follower.lost} of {total} frames the background's features were not found, "
                "and the place of "
                "the frame before was used",
                count=follower.lost,
                value=follower.lost / total,
                fix="choose a part of the film without cuts by --start and --end",
            )
        )
    return notes


def _of_flag(
    conditioning: Conditioning, reference: UInt8Array | None, *, number_given: bool
) -> list[Finding]:
    """Reports what was found of the flag; several are no matter where its number was given."""
    if conditioning.region is None or reference is None:
        return []
    height, width = reference.shape
    left, top, right, bottom = (
        round(edge / conditioning.scale) for edge in conditioning.region.box
    )
    square, beyond = conditioning.square, conditioning.square.beyond(width, height)
    notes = [
        Finding.of(
            "flag-found",
            f"{len(conditioning.regions)} moving "
            f"{'cloths' if len(conditioning.regions) > 1 else 'cloth'}; number "
            f"{conditioning.chosen + 1} visits {right - left} × {bottom - top} px and is shown in "
            "a square of "
            f"{square.side} px"
            + (
                f", {beyond:.0%} of which lie beyond the picture and were padded"
                if beyond > 0
                else ""
            ),
            count=len(conditioning.regions),
            value=conditioning.region.share,
        )
    ]
    if len(conditioning.regions) > 1 and not number_given:
        notes.append(
            Finding.of(
                "several-flags-found",
                f"{len(conditioning.regions)} regions move like cloth; number "
                f"{conditioning.chosen + 1} was measured, "
                "with "
                f"{conditioning.region.share:.0%} of the motion",
                count=len(conditioning.regions),
                fix="choose another by --flag, as numbered on the page of --report",
            )
        )
    if conditioning.size > _ENLARGED * square.side:
        notes.append(
            Finding(
                kind="enlarged",
                severity=Severity.WARNING,
                value=conditioning.size / square.side,
                what=f"the flag fills {square.side} px of the picture and the network takes "
                f"{conditioning.size} px: "
                "it was "
                f"enlarged {conditioning.size / square.side:.3g}-fold",
            )
        )
    return notes


def _of_second_pole(conditioning: Conditioning) -> list[Finding]:
    if conditioning.region is None:
        return []
    height = conditioning.standing.inside(
        conditioning.framed_box(conditioning.region), conditioning.places
    ).height
    if height < SUSPECTED:
        return []
    return [
        Finding.of(
            "second-pole-suspected",
            f"an upright edge stands still inside what moves, along {height:.0%} of its height: a "
            "stripe of the cloth, "
            "or the pole of a second flag",
            value=height,
            fix="look whether two flags overlap in the picture; if so, film from where they do not",
        )
    ]


def _of_aspect(conditioning: Conditioning, stated_aspect: float | None) -> list[Finding]:
    region = conditioning.region
    if (
        stated_aspect is None
        or region is None
        or region.hoist == "top"
        or region.aspect <= _LONGER * stated_aspect
    ):
        return []
    return [
        Finding.of(
            "flag-size-contradicted",
            f"the flag's outline is {region.aspect:.2f} times as long as high at the hoist; a flag "
            "of the size "
            f"given would be at most {stated_aspect:.2f} times",
            value=region.aspect,
            fix=REASONS["another-shape"].fix,
        )
    ]
