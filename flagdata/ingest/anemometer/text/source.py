"""The text under a log, line by line; of a file compressed by gzip what is in it."""

from __future__ import annotations

import codecs
import gzip
import io
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import IO

from flagdata.findings import Finding

GZIP = b"\x1f\x8b"
"""First bytes of a file compressed by gzip (RFC 1952); a log may be: it is read as what is in it."""

RATE_GIVEN = "rate-given"
"""The finding that the stamps of a file were counted at a rate that the user gave."""


@dataclass(frozen=True, kw_only=True)
class TextFile:
    """A text file that passed the limits.

    Attributes:
        path: of the file.
        encoding: a Python codec name.
        lines: number of line ends, roughly the number of lines.
        findings: about encoding, line ends and NUL bytes.
    """

    path: Path
    encoding: str
    lines: int
    findings: tuple[Finding, ...] = ()

    @property
    def counted(self) -> bool:
        """Whether the stamps of its lines are none of its own: counted at a rate that the user gave."""
        return any(finding.kind == RATE_GIVEN for finding in self.findings)

    def blocks(self, size: int = 200_000) -> Iterator[tuple[int, list[str]]]:
        """Lines without their ends, `size` at a time, each block with the number (from 1) of its first line."""
        first = 1
        with _text(self.path, self.encoding) as stream:
            while lines := [line.rstrip("\n") for line in islice(stream, size)]:
                yield first, lines
                first += len(lines)

    def each_line(self) -> Iterator[str]:
        """Lines without their ends, one after the other."""
        return (line for _, block in self.blocks() for line in block)

    def raw_blocks(self, size: int = 2 << 20) -> Iterator[bytes]:
        """The file's bytes without a byte-order mark of UTF-8, about `size` at a time; each block ends with a line."""
        with opened(self.path) as stream:
            rest = b""
            first = True
            while chunk := stream.read(size):
                if first:
                    chunk, first = chunk.removeprefix(codecs.BOM_UTF8), False
                data = rest + chunk
                cut = data.rfind(b"\n") + 1
                rest = data[cut:]
                if cut:
                    yield data[:cut]
            if rest:
                yield rest

    def head(self, count: int = 60) -> list[str]:
        """The first `count` lines."""
        with _text(self.path, self.encoding) as stream:
            return [line.rstrip("\n") for line in islice(stream, count)]


@dataclass(frozen=True, kw_only=True)
class TableText(TextFile):
    """What is no table of text, made one: a workbook's sheet, JSON, labelled lines, as lines of comma-separated text.

    Attributes:
        text: one line a row.
    """

    text: tuple[str, ...]

    @classmethod
    def of(cls, source: TextFile, lines: Sequence[str], findings: Iterable[Finding] = ()) -> TableText:
        """A file converted to these lines, with what was found beside the file's own findings."""
        return cls(
            path=source.path, encoding="utf-8", lines=len(lines), findings=(*source.findings, *findings),
            text=tuple(lines),
        )  # fmt: skip

    def blocks(self, size: int = 200_000) -> Iterator[tuple[int, list[str]]]:
        """See `TextFile.blocks`."""
        for first in range(0, len(self.text), size):
            yield first + 1, list(self.text[first : first + size])

    def raw_blocks(self, size: int = 2 << 20) -> Iterator[bytes]:
        """See `TextFile.raw_blocks`: the rows' text, not the file's bytes."""
        for _, lines in self.blocks():
            yield "".join(f"{line}\n" for line in lines).encode(self.encoding)

    def head(self, count: int = 60) -> list[str]:
        """See `TextFile.head`."""
        return list(self.text[:count])


def opened(path: Path) -> IO[bytes]:
    """The bytes of a file, of one compressed by gzip those that are in it."""
    with path.open("rb") as stream:
        packed = stream.read(2) == GZIP
    return gzip.open(path, "rb") if packed else path.open("rb")  # type: ignore[return-value]


@contextmanager
def _text(path: Path, encoding: str) -> Iterator[IO[str]]:
    with opened(path) as raw, io.TextIOWrapper(raw, encoding=encoding, newline=None) as stream:
        yield stream
