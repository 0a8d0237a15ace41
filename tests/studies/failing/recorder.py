"""The calls of a program that change files of one folder, in their order: `recorder.c` notes
them."""

from __future__ import annotations

import os
import shutil
import struct
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path

SOURCE = Path(__file__).with_name("recorder.c")
_HEADER = struct.Struct("@qqqqqq")  # as recorder.c has it


class Act(IntEnum):
    """What a call does, as recorder.c has it."""

    CREATE = 1
    FOLDER = 2
    WRITE = 3
    RESIZE = 4
    LINK = 5
    RENAME = 6
    REMOVE = 7
    FLUSH = 8
    FLUSH_ALL = 9
    SAY = 10


@dataclass(frozen=True, kw_only=True, slots=True)
class Call:
    """A call that was made.

    Attributes:
        act: what it does.
        file: inode of the file or folder that it makes, writes or flushes; 0 of others.
        at: place of the bytes that it writes, or size that it gives a file [B].
        path: of the entry, from the folder on; empty where the call has a descriptor, or makes a
            file without a name.
        target: new name of what is linked or renamed.
        data: bytes that it writes.
    """

    act: Act
    file: int = 0
    at: int = 0
    path: str = ""
    target: str = ""
    data: bytes = b""


@dataclass(frozen=True, kw_only=True)
class Recording:
    """A program that has ended.

    Attributes:
        code: its exit code.
        stderr: what it said there.
        calls: what it did to the folder, and `Act.SAY` for each time that it said something on
            standard output.
    """

    code: int
    stderr: str
    calls: tuple[Call, ...]

    @property
    def answered(self) -> int:
        """The number of calls after which the program began its answer: what it said last, without
        a break."""
        said = [call.act is Act.SAY for call in self.calls]
        if True not in said:
            return len(said)
        last = len(said) - said[::-1].index(True)
        return next((number for number in range(last, 0, -1) if not said[number - 1]), 0)


class Recorder:
    """Records programs; its files are in a folder of its own.

    Raises:
        RuntimeError: there is no compiler of C, or this is no Linux, see `can_record`.
    """

    def __init__(self, scratch: Path) -> None:
        if not can_record():
            raise RuntimeError("calls are recorded by a library of C that Linux loads first")
        self._library, self._record = scratch / "recorder.so", scratch / "calls"
        command = [
            _compiler(),
            "-shared",
            "-fPIC",
            "-O1",
            "-o",
            str(self._library),
            str(SOURCE),
            "-ldl",
            "-lpthread",
        ]
        subprocess.run(command, check=True)

    def record(
        self, arguments: Sequence[str], folder: Path, *, cwd: Path | None = None
    ) -> Recording:
        """Run Python with some arguments, and return what it does to `folder`.

        Args:
            folder: a path without links.
            cwd: where it runs; here if `None`.
        """
        self._record.write_bytes(b"")
        variables = {
            **os.environ,
            "LD_PRELOAD": str(self._library),
            "RECORDED_CALLS": str(self._record),
            "RECORDED_FOLDER": str(folder),
            "PYTHONDONTWRITEBYTECODE": "1",
        }
        command = [sys.executable, *arguments]
        done = subprocess.run(
            command,
            env=variables,
            cwd=cwd,
            capture_output=True,
            text=True,
            check=False,
            errors="replace",
        )
        calls = tuple(_read(self._record.read_bytes(), os.fsencode(folder)))
        return Recording(code=done.returncode, stderr=done.stderr, calls=calls)


def can_record() -> bool:
    """Whether calls can be recorded here: by Linux, with a compiler of C."""
    return sys.platform.startswith("linux") and bool(_compiler())


def _compiler() -> str:
    return shutil.which("gcc") or shutil.which("cc") or ""


def _read(record: bytes, folder: bytes) -> Iterator[Call]:
    place = 0
    while place < len(record):
        act, file, at, *sizes = _HEADER.unpack_from(record, place)
        place += _HEADER.size
        parts = []
        for size in sizes:
            parts.append(record[place : place + size])
            place += size
        path, target, data = parts
        yield Call(
            act=Act(act),
            file=file,
            at=at,
            path=_inside(path, folder),
            target=_inside(target, folder),
            data=data,
        )


def _inside(path: bytes, folder: bytes) -> str:
    """A path from the folder on; one that leads elsewhere stays as it is."""
    if not path:
        return ""
    normal = os.path.normpath(path)
    return os.fsdecode(normal.removeprefix(folder + b"/"))
