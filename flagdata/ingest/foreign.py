"""A doctor for other programs' data sets, before they come in: stamps in order, rates, gaps, and
what would be lost.

MCAP files are examined topic by topic, LeRobot data sets episode by episode. Nothing is decoded but
stamps and the first message of a topic.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
import pyarrow.compute as pc

from flagdata.core.arrays import IntArray
from flagdata.core.files.regular_files import is_lerobot
from flagdata.core.findings import Finding, Severity
from flagdata.core.schema import FRAME_RATE, FRAME_SIZE
from flagdata.errors import CorruptError, FlagdataError, InputError
from flagdata.ingest.mcap.bags import is_bag, other_bag
from flagdata.timebase import NANOSECONDS, iso

_GAP = 1.5  # median steps
_EARLIEST = 315_532_800 * NANOSECONDS  # 1980: before it a stamp is no date
_STEADY = 1e-3  # s, that LeRobot's stamps may lie from frame / fps


@dataclass(frozen=True, kw_only=True)
class Stream:
    """A series of stamps in a data set: a topic, or an episode.

    Attributes:
        holds: what it is: "pictures", "numbers", or the type of its messages.
        start, end: first and last stamp [UTC ns].
        rate: one over the median step [Hz]; `None` for fewer than two stamps.
        gaps: steps of more than 1.5 median ones; longest: the longest of them [s].
        backward: stamps that are not after the one before.
    """

    name: str
    holds: str
    count: int
    start: int
    end: int
    rate: float | None
    gaps: int
    longest: float
    backward: int
    JSON_NAMES: ClassVar = (
        *("name", "holds", "count", "start=start_text", "end=end_text"),
        *("rate", "gaps", "longest", "backward"),
    )

    @property
    def start_text(self) -> str:
        """The first stamp in ISO 8601."""
        return iso(self.start)

    @property
    def end_text(self) -> str:
        """The last stamp in ISO 8601."""
        return iso(self.end)

    @classmethod
    def of(cls, name: str, holds: str, stamps: IntArray) -> Stream:
        steps = np.diff(stamps)
        forward = steps[steps > 0]
        median = float(np.median(forward)) if len(forward) else 0.0
        gaps = forward[forward > _GAP * median]
        return cls(
            name=name,
            holds=holds,
            count=len(stamps),
            start=int(stamps.min()),
            end=int(stamps.max()),
            rate=NANOSECONDS / median if median else None,
            gaps=len(gaps),
            longest=float(gaps.max()) / NANOSECONDS if len(gaps) else 0.0,
            backward=int((steps <= 0).sum()),
        )


@dataclass(frozen=True, kw_only=True)
class Examination:
    """What was found of a data set."""

    format: str
    streams: tuple[Stream, ...]
    findings: tuple[Finding, ...]


def examine(path: Path) -> Examination:
    """Examines an MCAP file or a LeRobot data set.

    Raises:
        InputError: it is neither.
        CorruptError: it cannot be read, or was cut off.
    """
    if is_bag(path):
        return _mcap(path)
    if is_lerobot(path):
        return _lerobot(path)
    kind, fix = other_bag(path) or (
        "neither an MCAP file nor a LeRobot data set",
        "flagdata ingest --sniff looks at others",
    )
    raise InputError(kind, where=str(path), fix=fix)


def _mcap(path: Path) -> Examination:
    from flagdata.ingest.anemometer.containers.mcap_topic import of_numbers
    from flagdata.ingest.mcap.mcap_pictures import of_pictures
    from flagdata.ingest.mcap.topics import index, topics

    present = topics(path)
    pictures, numbers = of_pictures(present), of_numbers(path, present)
    streams: list[Stream] = []
    findings: list[Finding] = []
    for topic in present:
        holds = (
            "pictures"
            if topic in pictures
            else "numbers"
            if topic in numbers
            else topic.schema or topic.encoding
        )
        try:
            read = index(path, topic.name, sort=False)
            if not len(read.stamps):
                raise CorruptError(
                    f"{topic.count} messages are stated and none is there",
                    fix="copy the file again",
                )
        except FlagdataError as error:
            findings.append(_unread(topic.name, error))
            continue
        stream = Stream.of(topic.name, holds, read.stamps)
        streams.append(stream)
        findings += _stream_findings(stream)
        findings += read.findings
    findings += _lost_pictures([stream for stream in streams if stream.holds == "pictures"])
    rest = [topic.name for topic in present if topic not in (*pictures, *numbers)]
    if rest:
        findings.append(
            _lost("topics", f"topics that hold neither pictures nor numbers: {', '.join(rest)}")
        )
    return Examination(format="MCAP", streams=tuple(streams), findings=tuple(findings))


def _lerobot(folder: Path) -> Examination:
    from flagdata.ingest.camera.lerobot_camera import (
        TIME,
        cameras,
        description_of,
        read,
        stamps_of,
        tables,
    )

    info = description_of(folder)
    fps = float(info["fps"])
    timed = TIME in info["features"]
    pictures = cameras(info)
    streams: list[Stream] = []
    findings: list[Finding] = []
    for path in tables(folder / "data"):
        table = read(
            path, ["episode_index", "frame_index", "timestamp", *([TIME] if timed else [])]
        )
        episodes = pc.unique(table["episode_index"])  # pyright: ignore[reportAttributeAccessIssue]
        for episode in episodes.to_pylist():
            rows = table.filter(pc.field("episode_index") == episode)
            stamps = stamps_of(rows, str(path))
            seconds = stamps_of(rows.select(["timestamp"]), str(path)) / NANOSECONDS
            stream = Stream.of(f"episode {episode}", "frames", stamps)
            streams.append(stream)
            findings += [
                finding
                for finding in _stream_findings(stream)
                if timed or finding.kind != "not-a-date"
            ]
            steady = np.abs(seconds - rows["frame_index"].to_numpy() / fps).max()
            if steady > _STEADY:
                findings.append(
                    Finding.of(
                        "timing-uneven",
                        f"its stamps lie up to {steady:.3f} s from frame / fps, where LeRobot "
                        "looks for its films",
                        where=stream.name,
                        value=float(steady),
                        fix="check it with LeRobot's own reader",
                    )
                )
    findings += _lost_pictures(streams if pictures else [])
    if not timed:
        message = (
            "no instants: LeRobot counts frame / fps, so gaps, jitter and the date of the camera "
            "are not in it"
        )
        findings.append(_lost("instants", message))
    own_features = {
        TIME,
        "timestamp",
        "frame_index",
        "episode_index",
        "index",
        "task_index",
        *pictures,
    }
    other_features = sorted(set(info["features"]) - own_features)
    if other_features:
        findings.append(
            _lost("features", f"features that are no pictures: {', '.join(other_features)}")
        )
    missing = [
        name for name in ("tasks.parquet", "stats.json") if not (folder / "meta" / name).is_file()
    ]
    if missing:
        message = f"meta/ lacks {', '.join(missing)}"
        findings.append(Finding.of("files-missing", message, fix="copy it again"))
    if len(streams) != info.get("total_episodes", len(streams)):
        message = (
            f"{len(streams)} episodes are there, its description states {info['total_episodes']}"
        )
        findings.append(Finding.of("episodes-missing", message, fix="copy it again"))
    return Examination(
        format=f"LeRobot {info['codebase_version']}",
        streams=tuple(streams),
        findings=tuple(findings),
    )


def _stream_findings(stream: Stream) -> Iterator[Finding]:
    if stream.backward:
        yield Finding.of(
            "stamps-disordered",
            f"{stream.backward} of {stream.count} stamps are not after the one before",
            where=stream.name,
            count=stream.backward,
            fix="an ingest leaves such frames out, and sorts or asks about rows; mend the "
            "recorder's clock",
        )
    if stream.gaps:
        yield Finding.of(
            "gaps",
            f"{stream.gaps} gaps, the longest of {stream.longest:.3f} s, at a usual "
            f"{stream.rate or 0:.4g} Hz",
            where=stream.name,
            count=stream.gaps,
            value=stream.longest,
            fix="none needed: gaps are kept as such, and clips never span one",
        )
    if stream.start < _EARLIEST:
        yield Finding.of(
            "not-a-date",
            f"its stamps begin at {iso(stream.start)}: they count from a start, or the clock was "
            "not set",
            where=stream.name,
            fix="give --start when you ingest a film",
        )


def _lost_pictures(streams: Sequence[Stream]) -> Iterator[Finding]:
    if streams:
        yield _lost(
            "colour",
            f"colour and size: films become gray squares of {FRAME_SIZE} px; --crop chooses the "
            "part",
        )
    fast = [
        stream for stream in streams if stream.rate is not None and stream.rate > FRAME_RATE * 1.01
    ]
    if fast:
        names = ", ".join(f"{stream.name} ({stream.rate:.4g} Hz)" for stream in fast[:5])
        yield _lost(
            "frames", f"frames beyond {FRAME_RATE:g} Hz of {names}; --rate native keeps them"
        )


def _lost(lost: str, text: str) -> Finding:
    return Finding(kind=f"lost-{lost}", severity=Severity.NOTE, what=f"not kept by ingest: {text}")


def _unread(name: str, error: FlagdataError) -> Finding:
    severity = Severity.ERROR if isinstance(error, CorruptError) else Severity.NOTE
    return Finding(
        kind="topic-unread", severity=severity, where=name, what=error.what, fix=error.fix
    )
