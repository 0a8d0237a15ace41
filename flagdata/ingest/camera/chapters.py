"""Chapters: the files into which a camera splits one recording, each stamped with the creation time
of the whole.

A later chapter begins where the earlier ones end. Where the file's name says that it is a later
chapter, and all earlier ones lie beside it and state the same creation time, its start is that time
plus their durations. Names are GoPro's: GH010042, GH020042, … (also GX, GL, GS) of the HERO6 and
later ones, and GOPR0042, GP010042, … of those before. Cameras that stamp each file by itself, as
AVCHD camcorders do, need none of it. Of other cameras, two files with successive numbers and one
creation time are reported, and neither is moved: they may as well be clips of one film.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from flagdata.core.findings import Finding
from flagdata.core.numbered import read_bounded
from flagdata.errors import FlagdataError
from flagdata.ingest.camera.camera_options import Limits
from flagdata.ingest.camera.video_container import open_container

_NEW = re.compile(r"(?P<head>G[HXLS])(?P<chapter>[0-9]{2})(?P<file>\d{4}\.\w+)", re.IGNORECASE)
_OLD = re.compile(r"(?P<head>GP)(?P<chapter>[0-9]{2})(?P<file>\d{4}\.\w+)", re.IGNORECASE)
_FIRST = re.compile(r"GOPR(?P<file>\d{4}\.\w+)", re.IGNORECASE)
_CHAPTERS = 99  # that two digits count
_MOST = 10**18
# The last number of a name, of as many digits as cameras count with.
_COUNTED = re.compile(r"(?P<head>.*?)(?P<number>\d{3,})(?P<rest>\D*\.\w+)")


@dataclass(frozen=True, kw_only=True)
class Chapter:
    """What the files beside a file say of where it begins within its recording.

    Attributes:
        before: length of all earlier chapters, by their containers' stamps [s]; 0 where it is not
            known.
        finding: what to report where the start is taken from the creation time.
    """

    before: float
    finding: Finding


def chapter_of(path: Path) -> Chapter | None:
    """Finds where a later chapter begins; None for any other file, and for a chapter that states
    its own creation time."""
    counted = _COUNTED.fullmatch(path.name)
    header = _header(path) if counted is not None and not path.is_dir() else None
    if counted is None or header is None or header[0] is None:
        return None
    earlier = _earlier(path.name)
    if not earlier:
        digits = counted["number"]
        number = read_bounded(digits, most=_MOST)
        if not number:
            return None
        former = f"{counted['head']}{number - 1:0{len(digits)}}{counted['rest']}"
        other_header = _header(path.with_name(former))
        text = (
            f"{former} beside it states the same creation time: if both are of one recording, this "
            "one starts later"
        )
        return (
            _not_placed(text, fix="give --start")
            if other_header is not None and other_header[0] == header[0]
            else None
        )
    before = Fraction(0)
    for name in earlier:
        other_header = _header(path.with_name(name))
        if other_header is None or other_header[1] is None:
            message = (
                f"chapter {len(earlier) + 1} of a recording carries the creation time of the whole "
                "one; it begins "
                f"after the earlier chapters, of which {name} is not beside it or cannot be read"
            )
            return _not_placed(
                message, fix="put the earlier chapters into its folder, or give --start"
            )
        if other_header[0] != header[0]:
            return None
        before += other_header[1]
    placed = Finding.of(
        "chapter-placed",
        f"chapter {len(earlier) + 1} of a recording carries the creation time of the whole one; it "
        "begins "
        f"{float(before):.3f} s later, after {', '.join(earlier)}",
        value=float(before),
    )
    return Chapter(before=float(before), finding=placed)


def _not_placed(text: str, *, fix: str) -> Chapter:
    return Chapter(before=0.0, finding=Finding.of("chapter-not-placed", text, fix=fix))


def place_by_name(name: str) -> tuple[str, int] | None:
    """Reads the recording that a GoPro's file name states, and its chapter from 1 on; None for any
    other name."""
    if match := _NEW.fullmatch(name):
        return f"{match['head']}{match['file']}".upper(), _chapter(match)
    if match := _OLD.fullmatch(name):
        return match["file"].upper(), _chapter(match) + 1
    if match := _FIRST.fullmatch(name):
        return match["file"].upper(), 1
    return None


def _chapter(match: re.Match[str]) -> int:
    return read_bounded(match["chapter"], most=_CHAPTERS) or 0


def _earlier(name: str) -> list[str]:
    """Names of the chapters before a file; empty where its name does not say that it is a later
    chapter."""
    if match := _NEW.fullmatch(name):
        return [f"{match['head']}{k:02}{match['file']}" for k in range(1, _chapter(match))]
    if match := _OLD.fullmatch(name):
        first = "GOPR" if match["head"].isupper() else "gopr"
        later = [f"{match['head']}{k:02}{match['file']}" for k in range(1, _chapter(match))]
        return [f"{first}{match['file']}", *later]
    return []


def _header(path: Path) -> tuple[str | None, Fraction | None] | None:
    """Reads creation time and length [s] from the header of a file; None where there is none that
    can be read."""
    if not path.is_file():
        return None
    try:
        container, stream = open_container(path, Limits(), threads=1)
    except FlagdataError:
        return None
    with container:
        metadata = {
            key.lower(): value for key, value in {**container.metadata, **stream.metadata}.items()
        }
        length = (
            None
            if stream.duration is None or stream.time_base is None
            else stream.duration * stream.time_base
        )
        return metadata.get("creation_time"), length
