"""Files and folders under names that a user gave: whole or not there at all, and never on top of
what is not ours.

One policy for all commands:

- A name is checked before work begins (`check_file`, `check_folder`): a command fails in its first
  second.
- What is written goes under a scratch name beside it, `.flagdata-<hex>.partial`, is flushed to the
  disk, and takes its name in one step. What fails is removed; what a killed process leaves behind
  does not hinder the next one.
- A name that is taken is refused, with two exceptions that are replaced: a file that the same
  command wrote and that is unchanged since, as its signature shows, and a folder that holds only
  what its manifest lists, unchanged (`flagdata.core.files.manifest`). An empty folder is free.
- Links are never followed, and nothing but a regular file is ever replaced.

A file's own statement of which command wrote it, with a hash of the rest: whether anybody changed
it since.

The statement is a comment at the end of HTML, Markdown, SVG, TOML, Python and PDF, the last member
of a JSON object, and a text chunk of a PNG. Other formats carry none.
"""

from __future__ import annotations

import errno
import hashlib
import os
import shutil
import struct
import uuid
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

from flagdata.core.files.durable import (
    confirming,
    disk_errors,
    flush_file,
    flush_folder,
    lacks,
    make_folders,
)
from flagdata.core.files.manifest import remove_listed, unlisted_files, write_manifest
from flagdata.errors import ConflictError, InputError

_COMMENTS = {
    ".html": "<!-- {} -->\n",
    ".htm": "<!-- {} -->\n",
    ".md": "<!-- {} -->\n",
    ".svg": "<!-- {} -->\n",
    ".toml": "# {}\n",
    ".py": "# {}\n",
    ".pdf": "% {}\n",
}
_OBJECT_END = b"\n}\n"  # of JSON that is indented
_WORDS = "written by flagdata"
_TAIL = 512  # bytes at the end of a file that hold its statement
_PNG, _PNG_END = b"\x89PNG\r\n\x1a\n", 12  # signature; bytes of the last chunk


def sign_output(data: bytes, *, name: str, command: str) -> bytes:
    """Adds to the bytes of a file `name` the statement that `flagdata COMMAND` wrote them.

    A format that has no place for it leaves them as they are."""
    block, end = _block(data, name, command, hashlib.sha256(data).hexdigest())
    at = len(data) - end
    return data[:at] + block + data[at:]


def is_signed(path: Path, *, command: str) -> bool:
    """Checks whether `flagdata COMMAND` wrote the file and nobody has changed it since.

    Raises:
        OSError: it cannot be read.
    """
    with path.open("rb") as stream:
        stream.seek(max(0, path.stat().st_size - _TAIL))
        if _WORDS.encode() not in stream.read():
            return False
    data = path.read_bytes()
    block, end = _block(data, path.name, command, "0" * 64)
    at = len(data) - end
    rest = data[: at - len(block)] + data[at:]
    return len(rest) < len(data) and sign_output(rest, name=path.name, command=command) == data


def _block(data: bytes, name: str, command: str, digest: str) -> tuple[bytes, int]:
    """Builds the statement as bytes, and says how many bytes of `data` stand behind it."""
    words = f"{_WORDS} {command}; SHA-256 of the rest {digest}"
    suffix = Path(name).suffix.lower()
    if suffix in _COMMENTS:
        return _COMMENTS[suffix].format(words).encode(), 0
    if suffix == ".json" and data.endswith(_OBJECT_END):
        return f',\n "written": "{words}"'.encode(), len(_OBJECT_END)
    if suffix == ".png" and data.startswith(_PNG):
        body = b"tEXtSoftware\0" + words.encode("latin-1")
        return struct.pack(">I", len(body) - 4) + body + struct.pack(
            ">I", zlib.crc32(body)
        ), _PNG_END
    return b"", 0


_NAMED = 3  # files that a refusal names


def check_file(path: Path, *, command: str | None = None) -> None:
    """Refuse a name that a new file cannot take.

    Args:
        command: what writes it, without "flagdata"; its own unchanged file may be replaced. None
            replaces nothing.

    Raises:
        ConflictError: something is there.
        InputError: the folder is not there or cannot be written.
    """
    with disk_errors("looking at the output's name", path):
        if not path.absolute().parent.is_dir():
            raise InputError(
                "there is no such folder",
                where=str(path.parent),
                fix="create it first, or name another",
            )
        _check_writable(path.absolute().parent)
        _check_free(path, command)


def check_folder(path: Path, *, schema: str | None = None) -> None:
    """Refuse a name that a new folder cannot take; an empty folder is free.

    Args:
        schema: of the manifest that `fresh_folder` writes. A folder that holds only what such a
            manifest lists, as it was written, may be replaced. None replaces nothing.

    Raises:
        ConflictError: something is there.
        InputError: the folder above cannot be written.
    """
    with disk_errors("looking at the output's name", path):
        if path.is_symlink() or (path.exists() and not path.is_dir()):
            raise _taken(path)
        _check_writable(_nearest(path.absolute().parent))
        if not path.exists() or not any(path.iterdir()):
            return
        if schema is None:
            raise _taken(path)
        if foreign := unlisted_files(path, schema=schema):
            further = f" and {len(foreign) - _NAMED:,} more" if len(foreign) > _NAMED else ""
            raise ConflictError(
                "the folder holds what this command did not write there, or what was changed "
                "since: "
                f"{', '.join(foreign[:_NAMED])}{further}",
                where=str(path),
                fix="move away what you want to keep and remove the folder, or name another one",
            )


def check_files(folder: Path, *names: str, command: str | None = None) -> None:
    """Refuse a folder in which one of these files cannot be written; the folder may be there or
    not.

    Raises:
        ConflictError: one of them is there and is not the command's own; the folder is no folder.
        InputError: the folder cannot be written.
    """
    with disk_errors("looking at the outputs' names", folder):
        _check_writable(_nearest(folder.absolute()))
        for name in names:
            _check_free(folder / name, command)


def check_rewrite(path: Path) -> None:
    """Refuse a file that `rewrite` cannot replace; that it is the program's own, the caller makes
    sure of.

    Raises:
        ConflictError: it is a folder or a link.
        InputError: the folder cannot be written.
    """
    with disk_errors("looking at the output's name", path):
        _check_writable(_nearest(path.absolute().parent))
        if path.is_symlink() or (path.exists() and not path.is_file()):
            raise _taken(path, " and is no file")


def write_file(path: Path, content: str | bytes, *, command: str | None = None) -> None:
    """Write a file: new, or in place of the command's own; signed where a command is named.

    Raises:
        ConflictError: something else is there.
        FlagdataError: the disk refuses it; nothing has changed.
    """
    with fresh_file(path, command=command) as scratch:
        scratch.write_bytes(_bytes(path.name, content, command))


def write_files(
    folder: Path, contents: Mapping[str, str | bytes | None], *, command: str | None = None
) -> None:
    """Write files into a folder, which is made; all of them are on the disk before the first takes
    its name.

    They take their names one after the other: a process that is killed in this moment leaves files
    of two runs, each whole, which the same command replaces when it is given again.

    Args:
        contents: by name; None removes the command's own file of that name from an earlier run.

    Raises:
        ConflictError: one of the names holds something else; nothing is written.
        FlagdataError: the disk refuses it.
    """
    check_files(folder, *contents, command=command)
    with disk_errors("writing the output", folder), _scratch_paths() as scratch:
        make_folders(folder)
        for name, content in contents.items():
            if content is not None:
                scratch[name] = _scratch(folder)
                scratch[name].write_bytes(_bytes(name, content, command))
                flush_file(scratch[name])
        for name in contents:
            if name in scratch:
                _publish(scratch[name], folder / name, command)
            else:
                _check_free(folder / name, command)
                (folder / name).unlink(missing_ok=True)


def rewrite(path: Path, content: str | bytes) -> None:
    """Replaces a file of the program's own by its next state, such as a log with one more entry; a
    reader sees the old one or the new one. The folder is made where it is missing. That it is the
    program's own, the caller has made sure of.

    Raises:
        ConflictError, InputError: as `check_rewrite`.
        FlagdataError: the disk refuses it; the file is as it was.
    """
    check_rewrite(path)
    with disk_errors("writing the file", path), _scratch_paths() as scratch:
        make_folders(path.parent)
        scratch[path.name] = _scratch(path.parent)
        scratch[path.name].write_bytes(_bytes(path.name, content, None))
        flush_file(scratch[path.name])
        scratch[path.name].replace(path)


@contextmanager
def fresh_file(path: Path, *, command: str | None = None) -> Iterator[Path]:
    """Makes a scratch path beside `path`, nothing at it yet; what the block writes there becomes
    `path` when it ends.

    Raises:
        ConflictError: `path` is taken, before or after the block.
        FlagdataError: no space, no permission.
    """
    check_file(path, command=command)
    with disk_errors("writing the output", path), _scratch_paths() as scratch:
        scratch[path.name] = _scratch(path.absolute().parent)
        yield scratch[path.name]
        flush_file(scratch[path.name])
        _publish(scratch[path.name], path, command)


@contextmanager
def fresh_folder(path: Path, *, schema: str | None = None) -> Iterator[Path]:
    """Makes a scratch folder beside `path` that becomes `path` when the block ends.

    Args:
        schema: the folder gets a manifest of this schema at the end, and replaces an earlier one of
            the same schema.

    Raises:
        ConflictError: `path` is taken, before or after the block.
        FlagdataError: no space, no permission, no folder.
    """
    check_folder(path, schema=schema)
    parent = path.absolute().parent
    with disk_errors("writing the output", path), _scratch_paths() as scratch:
        make_folders(parent)
        scratch[path.name] = _scratch(parent)
        scratch[path.name].mkdir()
        yield scratch[path.name]
        if schema is not None:
            write_manifest(scratch[path.name], {"schema": schema})
        for entry in [*scratch[path.name].rglob("*"), scratch[path.name]]:
            flush_file(entry)
        check_folder(path, schema=schema)
        try:
            if schema is not None and path.exists():
                remove_listed(path, schema=schema)
            scratch[path.name].rename(path)  # POSIX refuses a folder that has meanwhile been filled
        except OSError as error:
            if error.errno not in (errno.EEXIST, errno.ENOTEMPTY):
                raise
            raise _taken(path) from None
        with confirming("the output", path):
            flush_folder(parent)


def _check_free(path: Path, command: str | None) -> None:
    if not path.is_symlink() and not path.exists():
        return
    if (
        not path.is_symlink()
        and path.is_file()
        and command is not None
        and is_signed(path, command=command)
    ):
        return
    raise _taken(
        path,
        ""
        if command is None
        else f", and flagdata {command} did not write it, or it was changed since",
    )


def _taken(path: Path, why: str = "") -> ConflictError:
    return ConflictError(f"{path} exists{why}", fix="name another, or move this one away first")


def _check_writable(folder: Path) -> None:
    if not folder.is_dir():
        raise ConflictError(
            "this is no folder", where=str(folder), fix="name another, or move this one away first"
        )
    if not os.access(folder, os.W_OK | os.X_OK):
        raise InputError(
            "the folder cannot be written",
            where=str(folder),
            fix="name another, or give yourself the permission",
        )


def _nearest(folder: Path) -> Path:
    """Finds the folder, or the nearest above it that is there."""
    return next(
        above for above in (folder, *folder.parents) if above.exists() or above.is_symlink()
    )


def _scratch(folder: Path) -> Path:
    return folder / f".flagdata-{uuid.uuid4().hex}.partial"


@contextmanager
def _scratch_paths() -> Iterator[dict[str, Path]]:
    """Collects scratch paths by the name that each is for; what is left of them is removed at the
    end."""
    scratch: dict[str, Path] = {}
    try:
        yield scratch
    finally:
        for path in scratch.values():
            with suppress(
                OSError
            ):  # gone, since it has its name; or a disk that refuses everything
                if path.is_dir():
                    shutil.rmtree(path, ignore_errors=True)
                else:
                    path.unlink()


def _bytes(name: str, content: str | bytes, command: str | None) -> bytes:
    data = content.encode() if isinstance(content, str) else content
    return data if command is None else sign_output(data, name=name, command=command)


def _publish(scratch: Path, path: Path, command: str | None) -> None:
    """Give a file its name, in one step."""
    if command is not None and path.exists():
        _check_free(path, command)
        scratch.replace(path)
    else:
        _take(scratch, path)
    with confirming("the output", path):
        flush_folder(path.absolute().parent)


def _take(scratch: Path, path: Path) -> None:
    """Give a file a name that is free."""
    try:
        os.link(scratch, path)
    except FileExistsError:
        raise _taken(path) from None
    except OSError as error:
        if not lacks(error, path.absolute().parent):
            raise
        _check_free(
            path, None
        )  # a file system without hard links: a name taken in this very moment would be lost
        scratch.rename(path)
