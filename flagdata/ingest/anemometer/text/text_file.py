"""The file under a log: refused when it is no text or too large, its encoding settled; its text,
line by line.

Of a file compressed by gzip what is in it; workbooks and netCDF files are opened as the table that
they hold.
"""

from __future__ import annotations

import codecs
import gzip
import io
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import IO

import numpy as np

from flagdata.core.files.regular_files import MCAP, check_input
from flagdata.core.findings import Finding
from flagdata.errors import InputError, LimitError
from flagdata.ingest.anemometer.wind_options import Limits

GZIP = b"\x1f\x8b"
"""First bytes of a file compressed by gzip (RFC 1952); a log may be: it is read as what is in
it."""

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
        serial_days: what "excel-days" are in it: "excel-days-1904" in a workbook of that date
            system.
    """

    path: Path
    encoding: str
    lines: int
    findings: tuple[Finding, ...] = ()
    serial_days: str = "excel-days"

    @property
    def counted(self) -> bool:
        """Whether its timestamps were generated from --start and --rate."""
        return any(finding.kind == RATE_GIVEN for finding in self.findings)

    def blocks(self, size: int = 200_000) -> Iterator[tuple[int, list[str]]]:
        """Lines without their ends, `size` at a time, each block with the number (from 1) of its
        first line."""
        first = 1
        with _text(self.path, self.encoding) as stream:
            while lines := [line.rstrip("\n") for line in islice(stream, size)]:
                yield first, lines
                first += len(lines)

    def each_line(self) -> Iterator[str]:
        """Lines without their ends, one after the other."""
        return (line for _, block in self.blocks() for line in block)

    def raw_blocks(self, size: int = 2 << 20) -> Iterator[bytes]:
        """Yields the file's bytes without a byte-order mark of UTF-8, about `size` at a time; each
        block ends with a line."""
        with open_bytes(self.path) as stream:
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
        """Returns the first `count` lines."""
        with _text(self.path, self.encoding) as stream:
            return [line.rstrip("\n") for line in islice(stream, count)]


@dataclass(frozen=True, kw_only=True)
class TableText(TextFile):
    """What is no table of text, made one: a workbook's sheet, JSON, labelled lines, as lines of
    comma-separated text.

    Attributes:
        text: one line a row.
    """

    text: tuple[str, ...]

    @classmethod
    def of(
        cls, source: TextFile, lines: Sequence[str], findings: Iterable[Finding] = ()
    ) -> TableText:
        """Converts a file to these lines, with what was found beside the file's own findings."""
        return cls(
            path=source.path,
            encoding="utf-8",
            lines=len(lines),
            findings=(*source.findings, *findings),
            text=tuple(lines),
        )

    def blocks(self, size: int = 200_000) -> Iterator[tuple[int, list[str]]]:
        """Yields blocks of lines as `TextFile.blocks` does."""
        for first in range(0, len(self.text), size):
            yield first + 1, list(self.text[first : first + size])

    def raw_blocks(self, size: int = 2 << 20) -> Iterator[bytes]:
        """Yields bytes as `TextFile.raw_blocks` does: the rows' text, not the file's bytes."""
        for _, lines in self.blocks():
            yield "".join(f"{line}\n" for line in lines).encode(self.encoding)

    def head(self, count: int = 60) -> list[str]:
        """Returns the first lines as `TextFile.head` does."""
        return list(self.text[:count])


def open_bytes(path: Path) -> IO[bytes]:
    """Opens the bytes of a file, of one compressed by gzip those that are in it."""
    with path.open("rb") as stream:
        packed = stream.read(2) == GZIP
    return gzip.open(path, "rb") if packed else path.open("rb")  # type: ignore[return-value]


@contextmanager
def _text(path: Path, encoding: str) -> Iterator[IO[str]]:
    with open_bytes(path) as raw, io.TextIOWrapper(raw, encoding=encoding, newline=None) as stream:
        yield stream


_CHUNK = 1 << 20
HEAD = 65_536
"""Bytes looked at to find what a file is."""

_OPEN_DOCUMENT = b"application/vnd.oasis.opendocument.spreadsheet"
# First bytes → what it is, what to do. Signatures as in the formats' own specifications.
_SIGNATURES: tuple[tuple[int, bytes, str, str], ...] = (
    (0, GZIP, "gzip-compressed and damaged", "copy it again, or unpack it: gunzip FILE"),
    (
        30,
        b"mimetype" + _OPEN_DOCUMENT,
        "an OpenDocument spreadsheet",
        "save it as .xlsx, or the sheet as CSV",
    ),
    (0, b"PK\x03\x04", "a zip archive or an Excel workbook", "unpack it, or save the sheet as CSV"),
    (0, b"PK\x05\x06", "an empty zip archive", "give the log itself"),
    (0, b"\xfd7zXZ\x00", "xz-compressed", "unpack it first: unxz FILE"),
    (0, b"BZh", "bzip2-compressed", "unpack it first: bunzip2 FILE"),
    (0, b"7z\xbc\xaf\x27\x1c", "a 7-Zip archive", "unpack it first"),
    (0, b"\x28\xb5\x2f\xfd", "zstd-compressed", "unpack it first: zstd -d FILE -o NEW"),
    (0, b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "an old Excel workbook", "save the sheet as CSV"),
    (
        0,
        b"{\\rtf",
        "rich text (RTF), whose marks stand among the readings",
        "save it as plain text, and ingest that",
    ),
    (0, b"%PDF", "a PDF document", "export the readings as CSV"),
    (
        0,
        b"\x00\x05\x16\x07",
        "macOS's note beside another file (AppleDouble)",
        "give that file: the name without ._",
    ),
    (0, b"\x89PNG", "a PNG picture", "give the anemometer's log"),
    (0, b"\xff\xd8\xff", "a JPEG picture", "give the anemometer's log"),
    (4, b"ftyp", "a video (MP4 or MOV)", "ingest it as a camera file"),
    (0, b"GIF8", "a video (GIF)", "ingest it as a camera file"),
    (0, b"RIFF", "a video or sound (AVI or WAV)", "ingest it as a camera file"),
    (0, b"\x1a\x45\xdf\xa3", "a video (Matroska or WebM)", "ingest it as a camera file"),
    (0, b"\x00\x00\x01\xba", "a video (MPEG)", "ingest it as a camera file"),
    (0, b"SQLite format 3", "a SQLite database", "export the table of readings as CSV"),
    (0, b"PAR1", "a Parquet file", "write it as CSV: duckdb -c \"copy 'FILE' to 'FILE.csv'\""),
    (0, b"<?xml", "an XML document", "export the readings as CSV, one row a reading"),
    (0, b"<html", "a page of HTML", "save its table as CSV"),
    (0, b"<!DOCTYPE", "a page of HTML", "save its table as CSV"),
    (0, b"<!doctype", "a page of HTML", "save its table as CSV"),
    (0, MCAP, "an MCAP record", "ingest it as it is"),
    (0, b"TOB1", "a Campbell TOB1 binary table", "convert it to TOA5 with LoggerNet's CardConvert"),
    (0, b'"TOB', "a Campbell binary table", "convert it to TOA5 with LoggerNet's CardConvert"),
)
_BOMS: tuple[tuple[bytes, str], ...] = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)


NETCDF = (b"CDF\x01", b"CDF\x02", b"CDF\x05", b"\x89HDF")
"""netCDF, or HDF5 as netCDF-4 is."""


def is_workbook(path: Path, head: bytes) -> bool:
    """Checks whether a file is an Excel workbook (Office Open XML), by its content."""
    if not head.startswith(b"PK\x03\x04"):
        return False
    try:
        with zipfile.ZipFile(path) as archive:
            return "xl/workbook.xml" in archive.namelist()
    except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError):
        return False


def signature(head: bytes) -> tuple[str, str] | None:
    """Names what a file of another kind is by its first bytes, and what to do with it; `None` when
    none is recognised."""
    if len(head) > 188 * 2 and head[0] == head[188] == head[376] == 0x47:
        return "a video (MPEG transport stream)", "ingest it as a camera file"
    if len(head) > 4 + 192 and head[4] == head[4 + 192] == 0x47:
        return "a video (AVCHD, MTS)", "ingest it as a camera file"
    for at, magic, kind, fix in _SIGNATURES:
        if head[at : at + len(magic)] == magic:
            return kind, fix
    return None


def first_bytes(path: Path) -> bytes:
    """Reads the first `HEAD` bytes of a file; of one compressed by gzip, of what is in it.

    Raises:
        NotFoundError: there is none.
        InputError: it is a folder, cannot be read or is empty.
    """
    check_input(path, noun="log")
    try:
        with open_bytes(path) as stream:
            head = stream.read(HEAD)
    except (gzip.BadGzipFile, zlib.error, EOFError):
        return GZIP
    except OSError as error:
        raise InputError(
            f"cannot be read: {error.strerror}", where=str(path), fix="check its permissions"
        ) from None
    if not head:
        raise InputError("the file is empty", where=str(path), fix="copy it from the logger again")
    return head


def settle_text(
    path: Path, head: bytes, *, limits: Limits, encoding: str | None = None
) -> TextFile:
    """Settles the encoding of a file that begins so, and checks it against the limits, in one pass
    over its bytes.

    Raises:
        InputError: not text, or not in the encoding named.
        LimitError: larger than `limits` allow.
    """
    where = str(path)
    other_kind = signature(head)
    if other_kind:
        raise InputError(f"this is {other_kind[0]}, not a text log", where=where, fix=other_kind[1])
    codec = encoding or next((name for bom, name in _BOMS if head.startswith(bom)), None)
    if codec is None and _looks_utf16(head):
        raise InputError(
            "this looks like UTF-16 without a byte-order mark",
            where=where,
            fix="name it: --encoding utf-16-le",
        )
    if codec is None or not codec.startswith(("utf-16", "utf-32")):
        _refuse_binary(head, where)
    try:
        codec, problem = _settle(path, codec, limits)
        lines, findings = _count(path, limits, wide=codec.startswith(("utf-16", "utf-32")))
    except (gzip.BadGzipFile, zlib.error, EOFError):
        raise InputError(
            "the gzip file is damaged or incomplete",
            where=where,
            fix="copy it again, or save what is left: gunzip",
        ) from None
    return TextFile(path=path, encoding=codec, lines=lines, findings=(*problem, *findings))


def _looks_utf16(head: bytes) -> bool:
    sample = np.frombuffer(head[: len(head) // 2 * 2], dtype=np.uint8)
    if len(sample) < 8:
        return False
    zeros = (float((sample[::2] == 0).mean()), float((sample[1::2] == 0).mean()))
    return max(zeros) > 0.6 and min(zeros) < 0.1


def _refuse_binary(head: bytes, where: str) -> None:
    text = head.rstrip(b"\x00")
    if not text:
        raise InputError(
            "the file holds nothing but NUL bytes", where=where, fix="copy it from the logger again"
        )
    sample = np.frombuffer(text, dtype=np.uint8)
    # Tabs, line ends, form feeds, and the STX and ETX that serial instruments frame their lines
    # with.
    control = (sample < 32) & ~np.isin(sample, (2, 3, 9, 10, 12, 13))
    if float(control.mean()) > 0.05:
        raise InputError(
            "the file is binary, not a text log",
            where=where,
            fix="export it as text with the logger's own program",
        )


def _settle(path: Path, codec: str | None, limits: Limits) -> tuple[str, tuple[Finding, ...]]:
    """Chooses the codec that decodes the whole file."""
    where = str(path)
    try:
        info = codecs.lookup(codec or "utf-8")
        text = getattr(info, "_is_text_encoding", True)  # what open() itself looks at
    except LookupError:
        raise InputError(
            f"there is no encoding {codec!r}",
            where=where,
            fix="give a Python codec name such as cp1252",
        ) from None
    if not text or info.incrementaldecoder is None:
        raise InputError(
            f"{codec!r} is not a text encoding", where=where, fix="give one such as cp1252"
        )
    decoder = info.incrementaldecoder()
    done = size = 0
    with open_bytes(path) as stream:
        try:
            while chunk := stream.read(_CHUNK):
                size += len(chunk)
                if size > limits.size:
                    fix = "split it"
                    raise LimitError(
                        f"the file unpacks to more than {limits.size} bytes", where=where, fix=fix
                    )
                decoder.decode(chunk)
                done += chunk.count(b"\n")
            decoder.decode(b"", final=True)
        except UnicodeError as error:
            if isinstance(error, UnicodeDecodeError):
                done += error.object[: error.start].count(b"\n")
            if codec is not None:
                raise InputError(
                    f"the text is not valid {codec}: {error.__class__.__name__}",
                    where=f"{where}, line {done + 1}",
                    fix="name the encoding it is in, e.g. --encoding cp1252",
                ) from None
            return "latin-1", (
                Finding.of(
                    "encoding-assumed",
                    "not valid UTF-8, read as Latin-1: letters beyond ASCII may be wrong, numbers "
                    "are not",
                    where=f"line {done + 1}",
                    fix="name the encoding, e.g. --encoding cp1252",
                ),
            )
    return codec or "utf-8", ()


def _count(path: Path, limits: Limits, *, wide: bool) -> tuple[int, tuple[Finding, ...]]:
    """Counts line ends of each kind, NUL bytes and the longest line, within the limits.

    In `wide` encodings (2 or 4 bytes a character) the limits hold all the same, but bytes say
    nothing on line ends.
    """
    where = str(path)
    unix = windows = mac = nul = lines = tail = before = 0
    last = b""
    size = 0
    with open_bytes(path) as stream:
        while chunk := stream.read(_CHUNK):
            nul += chunk.count(0)
            size += len(chunk)
            pairs = chunk.count(b"\r\n") + (last == b"\r" and chunk[:1] == b"\n")
            feeds, returns = chunk.count(b"\n"), chunk.count(b"\r")
            windows, unix, mac = windows + pairs, unix + feeds - pairs, mac + returns - pairs
            lines = unix + windows + mac
            data = np.frombuffer(chunk, dtype=np.uint8)
            ends = np.flatnonzero((data == 10) | (data == 13))
            spans = np.diff(np.concatenate(([-1 - tail], ends, [len(data)])))
            tail = int(spans[-1]) - 1
            if lines > limits.rows:
                raise LimitError(
                    f"there are more than {limits.rows} lines", where=where, fix="split the file"
                )
            if int(spans.max()) > limits.line:
                at = int(np.append(ends, len(data))[int(np.argmax(spans))])
                number = before + max(chunk.count(b"\n", 0, at), chunk.count(b"\r", 0, at)) + 1
                message = f"a line longer than {limits.line} bytes"
                raise LimitError(
                    message, where=f"{where}, line {number}", fix="check that this is the log"
                )
            before = lines
            last = chunk[-1:]
    findings: list[Finding] = []
    kinds = {"LF": unix, "CR LF": windows, "CR": mac}
    if wide:
        return lines, ()
    if sum(1 for count in kinds.values() if count) > 1:
        text = ", ".join(f"{count} {name}" for name, count in kinds.items() if count)
        findings.append(Finding.of("mixed-line-ends", f"line ends of several kinds: {text}"))
    if nul and nul * 3 < size:
        findings.append(
            Finding.of(
                "nul-bytes",
                f"{nul} NUL bytes, as a logger leaves behind when it loses power; lines holding "
                "them are left out",
                count=nul,
            )
        )
    return lines, tuple(findings)
