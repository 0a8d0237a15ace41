"""Bags of ROS: the folder that `ros2 bag record` writes, its parts, and bags of other kinds."""

from __future__ import annotations

import gzip
import re
import zlib
from collections.abc import Sequence
from pathlib import Path

import zstandard

from flagdata.core.files.regular_files import MCAP, is_beside, is_folder, is_mcap, open_regular
from flagdata.core.numbered import by_numbers
from flagdata.core.shell import command_line
from flagdata.errors import InputError

_DESCRIPTION = "metadata.yaml"
_NAMED = "rosbag2_bagfile_information"
_LIST = re.compile(r"^\s*relative_file_paths:\s*\n((?:\s*-.*\n?)*)", re.MULTILINE)
_ITEM = re.compile(r"^\s*-\s*[\"']?(.*?)[\"']?\s*$", re.MULTILINE)
_LONGEST = 1 << 20  # of a description [B]
_SQLITE, _ROS_1 = b"SQLite format 3\0", b"#ROSBAG V"
_ZSTD, _GZIP = b"\x28\xb5\x2f\xfd", b"\x1f\x8b"
_HEAD = 16 << 10


def is_bag(path: Path) -> bool:
    """Checks whether a path is an MCAP file, a folder of such files, or any folder that `ros2 bag
    record` wrote."""
    return is_mcap(path) or (
        is_folder(path) and (is_described(path) or any(map(is_mcap, _files(path))))
    )


def is_described(path: Path) -> bool:
    """Checks whether a path is a folder whose description names its parts, which follow one another
    then."""
    return _description(path) is not None


def parts_of(path: Path) -> tuple[Path, ...]:
    """Lists the MCAP files of a recording: of a folder its parts in order, of a file the file
    itself.

    Raises:
        InputError: a part that the folder's description names is not there, or is no MCAP file.
    """
    if not is_folder(path):
        return (path,)
    listed = _LIST.search(_description(path) or "")
    names = _ITEM.findall(listed[1]) if listed else []
    parts = [path / Path(name).name for name in names] or _files(path)
    for part in parts:
        if not part.is_file():
            raise InputError(
                f"the bag's {_DESCRIPTION} names {part.name}, which is not there",
                where=str(path),
                fix="copy it again; or read the parts that are there: "
                f"{command_line('rm', path / _DESCRIPTION)}",
            )
        if not is_mcap(part):
            reason, fix = other_bag(part) or (f"{part.name} is no MCAP file", "copy it again")
            raise InputError(f"a part of the bag is not read: {reason}", where=str(part), fix=fix)
    if not parts:
        raise InputError("the bag's folder has no part", where=str(path), fix="copy it again")
    return tuple(parts)


def other_bag(path: Path) -> tuple[str, str] | None:
    """Names what a file is, of the kinds of bags that are not read, and what to do with it; `None`
    for anything else."""
    try:
        with open_regular(path) as stream:
            head = stream.read(_HEAD)
    except (OSError, ValueError):
        return None
    bare, new = path.with_suffix(""), path.with_suffix(".mcap")
    convert = (
        f"convert it: {command_line('mcap', 'convert', path, new)}; then "
        f"{command_line('ingest', new)}"
    )
    if head.startswith(_SQLITE) and b"serialization_format" in head:
        return "a ROS 2 bag kept in SQLite (.db3)", convert
    if head.startswith(_ROS_1):
        return "a ROS 1 bag", convert
    if head.startswith(_ZSTD) and _inside_zstd(head).startswith((MCAP, _SQLITE)):
        return (
            "a bag that was compressed as a whole by zstd",
            (
                f"unpack it: {command_line('zstd', '-d', path, '-o', bare)}; then "
                f"{command_line('ingest', bare)}"
            ),
        )
    if head.startswith(_GZIP) and _inside_gzip(path).startswith(MCAP):
        unpack = (
            f"unpack it: {command_line('gunzip', '-k', path)}; then {command_line('ingest', bare)}"
        )
        return "a bag that was compressed as a whole by gzip", unpack
    return None


def to_join(paths: Sequence[Path]) -> str:
    """Advises on MCAP files that are the parts of one recording: a folder of them alone is read as
    one."""
    (folder, *other_folders) = {path.parent for path in paths}
    if not other_folders and is_described(folder):
        return (
            "the folder of the parts is read as one recording: "
            f"{command_line('flagdata', 'ingest', folder)}"
        )
    move = command_line("mv", *paths, "whole")
    return (
        f"a folder of the parts alone is read as one recording: mkdir whole; {move}; flagdata "
        "ingest whole"
    )


def by_number(paths: Sequence[Path]) -> list[Path]:
    """Paths by the numbers in their names: part 10 comes after part 9."""
    return sorted(paths, key=lambda path: by_numbers(path.name))


def _description(path: Path) -> str | None:
    """Reads the text of a bag's description; `None` where a path is no folder that has one."""
    where = path / _DESCRIPTION
    if not is_folder(path) or not where.is_file():
        return None
    with where.open("rb") as stream:
        text = stream.read(_LONGEST).decode(errors="replace").replace("\r\n", "\n")
    return text if _NAMED in text else None


def _files(folder: Path) -> list[Path]:
    return by_number([file for file in folder.glob("*.mcap") if not is_beside(file.name)])


def _inside_zstd(head: bytes) -> bytes:
    try:
        return zstandard.ZstdDecompressor().stream_reader(head).read(len(_SQLITE))
    except zstandard.ZstdError:
        return b""


def _inside_gzip(path: Path) -> bytes:
    try:
        with gzip.open(path) as stream:
            return stream.read(len(MCAP))
    except (OSError, EOFError, zlib.error):
        return b""
