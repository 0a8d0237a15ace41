"""Chapters of one recording read as one file: the user names them, and each has to begin where the
one before ends.

What proves it is what the files state. Cameras that stamp all chapters with the creation time of
the whole number them by their names (GoPro); others stamp each by itself (DJI, dash cameras), and
its creation time is the end of the one before, to within the whole seconds in which both are
stated.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise
from pathlib import Path

import numpy as np

from flagdata.core.files.regular_files import is_folder, is_mcap
from flagdata.core.findings import Finding
from flagdata.core.numbered import by_numbers
from flagdata.core.shell import command_line
from flagdata.errors import FlagdataError, InputError, TimeError, UsageError
from flagdata.ingest.camera.camera_options import CameraOptions
from flagdata.ingest.camera.chapters import place_by_name
from flagdata.ingest.camera.frame_stamps import Timing
from flagdata.ingest.camera.picture_source import Picture, SourceFacts
from flagdata.ingest.camera.video_file import VideoSource
from flagdata.ingest.mcap.bags import to_join
from flagdata.timebase import NANOSECONDS, parse

_ROUNDED = 2.5
"""s by which a chapter may seem to begin beside the end of the one before: both times are stated in
whole seconds, and a camera takes up to a second to open a file."""
_RATE, _VARIES = Fraction(1, 100), Fraction(1, 4)
"""Parts by which the frame rates of one recording's chapters differ at most: of constant rates, and
of varying ones."""


def in_order(paths: Sequence[Path]) -> tuple[Path, ...]:
    """Chapters by the numbers in their names.

    Raises:
        UsageError: fewer than two, one of them twice, or what is no single file of a film.
    """
    check_films(paths)
    if len(paths) < 2:
        raise UsageError(
            "a single file cannot be joined",
            where="--join",
            fix="name all chapters of the recording",
        )
    if len({path.resolve() for path in paths}) < len(paths):
        raise UsageError("a file is named twice", where="--join", fix="name each chapter once")

    def key(path: Path) -> tuple[object, ...]:
        recording = place_by_name(path.name)
        if recording is not None:
            return (0, recording)
        return (1, by_numbers(path.name))

    return tuple(sorted(paths, key=key))


def check_films(paths: Sequence[Path]) -> None:
    """Make sure that all that is to be joined are files of the kind that is: no folders, no MCAP
    files.

    Raises:
        UsageError: one is not.
    """
    for path in paths:
        noun = "a folder" if is_folder(path) else "an MCAP file" if is_mcap(path) else None
        if noun is not None:
            alone = f"ingest each by itself: {command_line('flagdata', 'ingest', *paths)}"
            raise UsageError(
                f"{noun} cannot be joined with others, only video files can",
                where=str(path),
                fix=to_join(paths) if all(map(is_mcap, paths)) else alone,
            )


class JoinedSource:
    """Several video files, one after another. See `Source`.

    Stamps are counted in the first file's ticks from its first frame; a later chapter's first frame
    comes one period after the last of the one before.

    Args:
        paths: in the order of the recording.

    Raises:
        UsageError: chapters of different recordings.
        FlagdataError: as `VideoSource`.
    """

    def __init__(self, paths: Sequence[Path], options: CameraOptions) -> None:
        self._paths = tuple(paths)
        self._parts: list[VideoSource] = []
        try:
            for path in paths:
                self._parts.append(VideoSource(path, options))
            findings = self._check()
            self._offsets = _offsets([part.facts.timing for part in self._parts])
            self.facts = self._describe(findings)
        except BaseException:
            self.close()
            raise

    def _check(self) -> list[Finding]:
        """Checks whether the files are of one recording, and returns what to report of it."""
        first = self._parts[0].facts
        for path, part in zip(self._paths[1:], self._parts[1:], strict=True):
            if not _of_one_rate(part.facts.timing, first.timing):
                rates = (f"{float(facts.timing.rate):.5g} Hz" for facts in (part.facts, first))
                raise self._differing(path, "frame rate", *rates)
        for path, part in zip(self._paths[1:], self._parts[1:], strict=True):
            facts = part.facts
            for noun, mine, theirs in (
                (
                    "size of the pictures",
                    f"{facts.width} × {facts.height}",
                    f"{first.width} × {first.height}",
                ),
                ("shape of a pixel", facts.aspect, first.aspect),
                ("coding", facts.codec, first.codec),
                ("pixel format", facts.pixel_format, first.pixel_format),
                ("orientation", facts.orientation, first.orientation),
                ("unit of time stamps", facts.timing.tick, first.timing.tick),
            ):
                if mine != theirs:
                    raise self._differing(path, noun, mine, theirs)
        for path, part in zip(self._paths, self._parts, strict=True):
            if part.facts.timing.end is not None or part.facts.sequence:
                raise InputError(
                    "its time stamps start anew within the file, or are none",
                    where=str(path),
                    fix="ingest the files by themselves, without --join",
                )
        return self._follow()

    def _differing(self, path: Path, noun: str, mine: object, theirs: object) -> UsageError:
        return UsageError(
            f"the {noun} differs from that of {self._paths[0].name}: {mine} and {theirs}; they are "
            "not one recording",
            where=str(path),
            fix="ingest it by itself, without --join",
        )

    def _follow(self) -> list[Finding]:
        """Refuse chapters that do not follow one another, by their creation times.

        Returns:
            what to report: how they were joined, and a warning where nothing states that they
                follow one another.
        """
        created = [_creation_time(part.facts) for part in self._parts]
        lengths = [_length(part.facts.timing) for part in self._parts]
        names = ", ".join(path.name for path in self._paths)
        by_name = [place_by_name(path.name) for path in self._paths]
        joined = Finding.of(
            "chapters-joined",
            f"{len(self._paths)} chapters of one recording were joined: {names}",
            count=len(self._paths),
        )
        chapters_by_name = [chapter for chapter in by_name if chapter is not None]
        if (
            len(chapters_by_name) == len(by_name)
            and len(set(created)) == 1
            and created[0] is not None
        ):
            chapters = [chapter for _, chapter in chapters_by_name]
            successive = all(after - before == 1 for before, after in pairwise(chapters))
            if len({recording for recording, _ in chapters_by_name}) > 1 or not successive:
                raise UsageError(
                    f"by their names {names} are not successive chapters of one recording",
                    where="--join",
                    fix="name all chapters of one recording, and no others",
                )
            return [joined]
        for index, (before, after) in enumerate(pairwise(created)):
            if before is None or after is None:
                continue
            between = (after - before) / NANOSECONDS - float(lengths[index])
            if abs(between) > _ROUNDED:
                raise UsageError(
                    f"by its creation time it begins {abs(between):.1f} s "
                    f"{'after' if between > 0 else 'before'} the "
                    f"end of {self._paths[index].name}",
                    where=str(self._paths[index + 1]),
                    fix="name chapters that follow one another, or leave out --join",
                )
        if None in created:
            return [
                joined,
                Finding.of(
                    "chapters-unproven",
                    "nothing in the files states that each begins where the one before ends; it is "
                    "taken as given",
                ),
            ]
        return [joined]

    def _describe(self, joining: list[Finding]) -> SourceFacts:
        timings = [part.facts.timing for part in self._parts]
        first, last = timings[0], timings[-1]
        span = self._offsets[-1] + last.span
        count = sum(timing.count for timing in timings)
        variable = any(timing.variable for timing in timings)
        steps = sum(timing.count - 1 for timing in timings)
        mean = sum((timing.period * (timing.count - 1) for timing in timings), Fraction(0)) / max(
            1, steps
        )
        timing = Timing(
            tick=first.tick,
            origin=0,
            period=first.period if variable or not steps else mean,
            variable=variable,
            span=span,
            shortest=min(timing.shortest for timing in timings),
            longest=max(timing.longest for timing in timings),
            count=count,
            missing=sum(timing.missing for timing in timings),
        )
        findings = [
            replace(
                finding,
                where=path.name if finding.where is None else f"{path.name}, {finding.where}",
            )
            for path, part in zip(self._paths, self._parts, strict=True)
            for finding in part.facts.findings
        ]
        return replace(self._parts[0].facts, timing=timing, findings=(*joining, *findings))

    def pictures(self) -> Iterator[Picture]:
        for part, offset in zip(self._parts, self._offsets, strict=True):
            origin = part.facts.timing.origin
            for picture in part.pictures():
                yield _move_picture(picture, offset - origin)

    def samples(self, runs: int, count: int, stride: int) -> Iterator[list[Picture]]:
        spans = np.array(
            [max(1, part.facts.timing.count) for part in self._parts], dtype=np.float64
        )
        ends = np.rint(np.cumsum(spans) / spans.sum() * runs).astype(int).tolist()
        for part, offset, begin, end in zip(
            self._parts, self._offsets, [0, *ends], ends, strict=False
        ):
            if end > begin:
                origin = part.facts.timing.origin
                for run in part.samples(end - begin, count, stride):
                    yield [_move_picture(picture, offset - origin) for picture in run]

    def damage(self) -> list[Finding]:
        return [
            replace(
                finding,
                where=path.name if finding.where is None else f"{path.name}, {finding.where}",
            )
            for path, part in zip(self._paths, self._parts, strict=True)
            for finding in part.damage()
        ]

    def close(self) -> None:
        for part in self._parts:
            part.close()


def _offsets(timings: Sequence[Timing]) -> list[int]:
    """Stamps of the chapters' first frames [ticks]."""
    offsets = [0]
    for timing in timings[:-1]:
        offsets.append(offsets[-1] + timing.span + round(timing.period))
    return offsets


def _of_one_rate(first: Timing, second: Timing) -> bool:
    """Checks whether two files may be of one recording by their rates, of which a varying one
    states its median."""
    difference = abs(first.period * first.tick / (second.period * second.tick) - 1)
    return difference <= (_VARIES if first.variable or second.variable else _RATE)


def _length(timing: Timing) -> Fraction:
    """Computes the time from the first frame to the end of the last [s]."""
    return (timing.span + timing.period) * timing.tick


def _creation_time(facts: SourceFacts) -> int | None:
    """Reads a file's creation time [UTC ns]; None where it states none that can be read."""
    text = facts.metadata.get("creation_time")
    try:
        return None if text is None else parse(text)
    except (TimeError, FlagdataError):
        return None


def _move_picture(picture: Picture, by: int) -> Picture:
    return replace(picture, stamp=None if picture.stamp is None else picture.stamp + by)
