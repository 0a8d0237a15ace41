"""Whether files are as they were written: SHA-256 of a folder's files beside them, or of one file's
bytes at its end.

A folder that something is made from (a model, a checkpoint) holds `SHA256SUMS`, a line a file as
`sha256sum` prints it, so that `sha256sum -c SHA256SUMS` checks it without this package. A single
file of a cache ends with the 32 bytes of the SHA-256 of all before them, which numpy does not read.
"""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

from flagdata.core.files.regular_files import is_beside
from flagdata.core.provenance import file_hash
from flagdata.errors import CorruptError, InputError

SUMS = "SHA256SUMS"
"""Name of the file in a folder that states the SHA-256 of all others."""
_LINE = re.compile(r"([0-9a-f]{64})  (.+)")
_DIGEST = 32  # B


def files_of(path: Path) -> list[Path]:
    """Lists the regular files of a folder, sorted by relative path, without what `files.is_beside`;
    the file itself if it is one.

    Raises:
        InputError: a symbolic link or special file, whose content the hash would not cover.
    """
    if path.is_symlink() or not path.exists():
        raise InputError(
            "this is neither a file nor a folder",
            where=str(path),
            fix="give the object itself, not a link to it",
        )
    if path.is_file():
        return [path]
    files = []
    for entry in sorted(path.rglob("*"), key=lambda p: p.relative_to(path).as_posix()):
        if entry.is_symlink() or not (entry.is_dir() or entry.is_file()):
            raise InputError(
                "an object contains a link or special file",
                where=str(entry),
                fix="store plain files only",
            )
        if entry.is_file() and not any(map(is_beside, entry.relative_to(path).parts)):
            files.append(entry)
    return files


def size_of(path: Path) -> int:
    """Bytes of a file, or of all files in a folder.

    Raises:
        InputError: as `files_of`.
    """
    return sum(file.stat().st_size for file in files_of(path))


def content_hash(path: Path) -> str:
    """Computes the SHA-256 of a file; of a folder, SHA-256 over the lines "<file sha256>  <relative
    path>\n" sorted by path.

    The folder's form is what `sha256sum` prints, so that it can be checked without this package.
    Empty folders and file modes do not count.

    Raises:
        InputError: as `files_of`.
    """
    if files_of(path) == [path]:
        return file_hash(path)
    return hashlib.sha256(sums_of(path).encode()).hexdigest()


def sums_of(folder: Path) -> str:
    """Writes the lines of a folder whose SHA-256 is its `content_hash`."""
    return _lines({name: file_hash(file) for name, file in _files_by_path(folder).items()})


def read_sums(text: str) -> dict[str, str]:
    """Reads relative path → SHA-256, as `sums_of` wrote them.

    Raises:
        ValueError: a line that is none.
    """
    matches = [_LINE.fullmatch(line) for line in text.splitlines()]
    if not all(matches):
        raise ValueError("a line is not what sha256sum prints")
    return {match[2]: match[1] for match in matches if match is not None}


def write_sums(folder: Path) -> None:
    """State the SHA-256 of a folder's files in its `SHA256SUMS`.

    Raises:
        OSError: what the disk refuses.
    """
    sums = {name: file_hash(file) for name, file in _files_by_path(folder).items() if name != SUMS}
    (folder / SUMS).write_text(_lines(sums), encoding="utf-8")


def renewed_sums(folder: Path, name: str, content: bytes) -> str:
    """Writes the text of a folder's `SHA256SUMS` once a file of it, or a new one, has that content.
    What is stated of the others stays, so that damage to them is still found.

    Raises:
        CorruptError: `SHA256SUMS` cannot be read.
    """
    sums = _sums_in(folder, fix="restore the folder from a copy")
    return _lines({**sums, name: hashlib.sha256(content).hexdigest()})


def check_sums(folder: Path, *, fix: str) -> None:
    """Make sure that a folder holds the files that its `SHA256SUMS` states, each with that content,
    and no others.

    Raises:
        CorruptError: it does not; the message names the first file.
    """
    sums = _sums_in(folder, fix=fix)
    present = {name: file for name, file in _files_by_path(folder).items() if name != SUMS}
    for name in sorted(sums.keys() | present.keys()):
        if name not in present:
            raise CorruptError("a file is missing", where=str(folder / name), fix=fix)
        if name not in sums:
            raise CorruptError(f"{SUMS} does not list this file", where=str(folder / name), fix=fix)
        if file_hash(present[name]) != sums[name]:
            raise CorruptError(
                "its bytes have changed since it was written", where=str(folder / name), fix=fix
            )


def seal_bytes(data: bytes) -> bytes:
    """Appends to the bytes of a file their SHA-256."""
    return data + hashlib.sha256(data).digest()


def is_sealed(path: Path) -> bool:
    """Checks whether a file ends with the SHA-256 of all bytes before; a damaged, cut or foreign
    file does not.

    Raises:
        OSError: it cannot be read.
    """
    content = path.read_bytes()
    return (
        len(content) > _DIGEST
        and hashlib.sha256(memoryview(content)[:-_DIGEST]).digest() == content[-_DIGEST:]
    )


def _files_by_path(folder: Path) -> dict[str, Path]:
    return {file.relative_to(folder).as_posix(): file for file in files_of(folder)}


def _lines(sums: dict[str, str]) -> str:
    return "".join(f"{value}  {name}\n" for name, value in sorted(sums.items()))


def _sums_in(folder: Path, *, fix: str) -> dict[str, str]:
    path = folder / SUMS
    try:
        return read_sums(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise CorruptError(
            "there are no checksums of its files", where=str(path), fix=fix
        ) from None
    except (OSError, UnicodeDecodeError) as error:
        raise CorruptError(
            f"the checksums cannot be read: {error}", where=str(path), fix=fix
        ) from None
    except ValueError as error:
        raise CorruptError(str(error), where=str(path), fix=fix) from None
