"""A film that is made fit while it is read: steadied, cropped to its flag, all else frozen (`models.conditioning`).

Parts of a film in which the picture's edge cuts the flag off: left out, where enough is left without them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from flagdata.arrays import BoolArray, FloatArray, UInt8Array
from flagdata.errors import UsageError
from flagdata.film import Film
from flagdata.findings import Finding, Severity
from flagdata.ingest.camera import CropBox
from flagdata.schema import FRAME_SIZE
from measure.gate.counted import reasons
from measure.gate.watch import FilmWatch
from models.conditioning import Conditioning, Follower, conditioning_of
from models.conditioning.conditioning import LEAST, SAMPLE
from models.conditioning.regions import MOMENT
from models.conditioning.repeats import TimedFrame
from models.conditioning.whole import CUT, SIDES

_ENOUGH = 1.5
"""Time [s] with the whole flag, in one piece, that a film must have for the rest to be left out: more than a window."""
_REPORTED = 0.05
"""Share of the film in which the flag is cut off, from which on it is reported."""


@dataclass(frozen=True, kw_only=True, eq=False)
class CutOff:
    """When the flag is cut off.

    Attributes:
        times: (n,) of a sample of the film's frames [s].
        cut: (n, 4) whether the edge on each of `SIDES` cuts the flag off.
    """

    times: FloatArray
    cut: BoolArray

    @classmethod
    def of(cls, found: Conditioning, times: FloatArray) -> CutOff:
        """By what was found in the sample of frames of these times."""
        return cls(times=times, cut=found.cut > CUT)

    @cached_property
    def any(self) -> BoolArray:
        """(n,) whether any edge does."""
        return np.asarray(self.cut.any(axis=1), dtype=np.bool_)

    @cached_property
    def partly(self) -> bool:
        """Whether the film is cut off in a part and whole for long enough in another."""
        return bool(self.any.any()) and self._longest >= _ENOUGH

    @property
    def _longest(self) -> float:
        """Longest time between two frames that are cut off [s]."""
        ends = self.times[self.any]
        edges = np.concatenate([self.times[:1], ends, self.times[-1:]])
        return float(np.diff(edges).max())

    def left_out(self, time: float) -> bool:
        """Whether the frame of a time [s] is: beside a frame of the sample that is cut off."""
        if not self.partly:
            return False
        after = int(np.searchsorted(self.times, time))
        return bool(self.any[max(after - 1, 0) : after + 1].any())

    def findings(self) -> tuple[Finding, ...]:
        """One where the flag is cut off."""
        share = float(self.any.mean())
        if not share or (share < _REPORTED and not self.partly):
            return ()
        where = ", ".join(
            f"the {side} edge in {own:.0%}" for side, own in zip(SIDES, self.cut.mean(axis=0), strict=True) if own > 0
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


_HELD = 200_000_000
"""Bytes of frames that are held, so that a short film is decoded once."""
_LOST = 0.05
"""Share of frames without the background's features from which on a warning is due."""
_ENLARGED = 2.0
_LONGER = 1.15
"""By how much an outline may be longer, for its height at the hoist, than the flag that was given: it is foreshortened,
droops and flutters, all of which make it shorter."""


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
        found: what the last reading found; None before the first, and of fewer frames than a search takes.
        reference: (height, width) the frame that all others are registered to; None likewise.

    Raises:
        UsageError: a crop beyond the picture.
    """

    def __init__(
        self, film: WholeFilm, *, crop: CropBox | None = None, flag: int | None = None, aspect: float | None = None
    ) -> None:
        if crop is not None and (crop.x + crop.width > film.width or crop.y + crop.height > film.height):
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
        held: list[TimedFrame] | None = []
        sample: list[TimedFrame] = []
        chosen = _chosen(self.rate, min(last, self.duration) - max(first, 0.0))
        bytes_held = 0
        for k, (time, picture) in enumerate(self._film.frames(first, last)):
            if chosen(k):
                sample.append((time, picture))
            bytes_held += picture.nbytes
            if held is not None:
                held.append((time, picture))
            if bytes_held > _HELD:
                held = None
        source = held if held is not None else self._film.frames(first, last)
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
        self._cut = cut = CutOff.of(self.found, np.array([time for time, _ in sample]))
        del sample, pictures
        self._follower, self._watch = follower, watch = Follower(self.found), FilmWatch(rate=self.rate)
        for time, picture in source:
            watch.look(time, picture)
            shown = follower.show(picture)
            if not cut.left_out(time):
                yield time, shown

    def _within(self, shape: tuple[int, ...]) -> tuple[int, int, int, int] | None:
        """The crop in pixels of frames of this shape."""
        if self._crop is None:
            return None
        scale = shape[1] / self._film.width
        x, y, width, height = (round(value * scale) for value in self._crop.as_tuple())
        return x, y, width, height

    def findings(self) -> tuple[Finding, ...]:
        found, follower, watch, cut = self.found, self._follower, self._watch, self._cut
        if found is None or follower is None or watch is None or cut is None:
            return self._film.findings()
        faults = reasons(watch, found, follower)
        if cut.partly:  # what is left shows the whole flag
            faults = tuple(fault for fault in faults if fault.kind != "cut-off")
        own = [
            *_of_camera(found, follower),
            *_of_flag(found, self.reference, given=self._flag is not None),
            *_of_aspect(found, self._aspect),
        ]
        if all(fault.kind != "cut-off" for fault in faults):
            own += cut.findings()
        return (*self._film.findings(), *own, *faults)

    @property
    def sentences(self) -> tuple[str, ...]:
        """What was found, for people; none before a reading."""
        before = len(self._film.findings())
        return tuple(finding.what for finding in self.findings()[before:])

    def as_dict(self) -> dict[str, Any] | None:
        """JSON values of what was found; None before a reading."""
        if self.found is None or self._follower is None:
            return None
        found, follower = self.found, self._follower
        return {
            "camera": {
                "moves": found.camera.moves,
                "evidence": found.camera.evidence,
                **follower.motion(),
                "lost": follower.lost,
            },
            "flags": [
                {
                    "box": [edge / found.scale for edge in region.box],
                    "share": region.share,
                    "hoist": region.hoist,
                    "aspect": region.aspect,
                }
                for region in found.regions
            ],
            "chosen": found.chosen + 1 if found.regions else None,
            "square": [found.square.x, found.square.y, found.square.side],
            "cut_off": found.cut_share,
        }


def _chosen(rate: float, duration: float) -> Callable[[int], bool]:
    """Which frames of a film belong to a sample of some `SAMPLE`: evenly spread; of a long film in pairs, the frames of
    each `MOMENT` apart at most.

    Args:
        rate: of the film [Hz].
        duration: of the part that is read [s].
    """
    every = max(1, math.ceil(duration * rate / SAMPLE))
    beside = max(1, math.floor(MOMENT * rate))
    if every <= beside:
        return lambda k: k % every == 0
    return lambda k: k % (2 * every) in (0, beside)


def _of_camera(found: Conditioning, follower: Follower) -> list[Finding]:
    if not found.camera.known:
        return [
            Finding.of("camera-unknown", "no feature of the background shows the camera's motion; no frame was moved")
        ]
    if not found.camera.moves:
        return [
            Finding.of(
                "camera-still",
                f"the camera is still: {found.camera.evidence} stay in place",
                count=found.camera.support,
            )
        ]
    motion = follower.motion()
    notes = [
        Finding.of(
            "camera-moves",
            f"the camera drifts {motion['drift']:.1f} px and shakes {motion['shake']:.2f} px from frame to frame, "
            f"by {found.camera.evidence}; the frames were moved back",
            value=motion["drift"],
            count=found.camera.support,
        )
    ]
    total = len(follower.path)
    if follower.lost > _LOST * total:
        notes.append(
            Finding.of(
                "camera-lost",
                f"in {follower.lost} of {total} frames the background's features were not found, and the place of "
                "the frame before was used",
                count=follower.lost,
                value=follower.lost / total,
                fix="choose a part of the film without cuts by --start and --end",
            )
        )
    return notes


def _of_flag(found: Conditioning, reference: UInt8Array | None, *, given: bool) -> list[Finding]:
    """What was found of the flag; several are no matter where its number was given."""
    if found.region is None or reference is None:
        return []
    height, width = reference.shape
    left, top, right, bottom = (round(edge / found.scale) for edge in found.region.box)
    square, beyond = found.square, found.square.beyond(width, height)
    notes = [
        Finding.of(
            "flag-found",
            f"{len(found.regions)} moving {'cloths' if len(found.regions) > 1 else 'cloth'}; number "
            f"{found.chosen + 1} visits {right - left} × {bottom - top} px and is shown in a square of {square.side} px"
            + (f", {beyond:.0%} of which lie beyond the picture and were padded" if beyond > 0 else ""),
            count=len(found.regions),
            value=found.region.share,
        )
    ]
    if len(found.regions) > 1 and not given:
        notes.append(
            Finding.of(
                "several-flags-found",
                f"{len(found.regions)} regions move like cloth; number {found.chosen + 1} was measured, with "
                f"{found.region.share:.0%} of the motion",
                count=len(found.regions),
                fix="choose another by --flag, as numbered on the page of --report",
            )
        )
    if found.size > _ENLARGED * square.side:
        notes.append(
            Finding(
                kind="enlarged",
                severity=Severity.WARNING,
                value=found.size / square.side,
                what=f"the flag fills {square.side} px of the picture and the network takes {found.size} px: it was "
                f"enlarged {found.size / square.side:.3g}-fold",
            )
        )
    return notes


def _of_aspect(found: Conditioning, given: float | None) -> list[Finding]:
    region = found.region
    if given is None or region is None or region.hoist == "top" or region.aspect <= _LONGER * given:
        return []
    return [
        Finding.of(
            "flag-size-contradicted",
            f"the flag's outline is {region.aspect:.2f} times as long as high at the hoist; a flag of the size "
            f"given would be at most {given:.2f} times",
            value=region.aspect,
            fix="check --flag-size: length along the wind times height along the pole",
        )
    ]
