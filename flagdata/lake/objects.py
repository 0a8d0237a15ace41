"""Immutable objects under the hash of their content: single MCAP files, Zarr folders, and folders
of trained models.

In a bucket they are `mcap/<sha256>.mcap`, and folders as `zarr/<treehash>.zarr/…`. A folder's files
are put first and `.sums`, the lines whose SHA-256 is its name, last: without it the folder is not
there. `.sums` is deleted first. Objects are read from a local copy, see
`flagdata.core.files.object_cache`; of large records only the parts that are needed are fetched, see
`flagdata.core.files.object_ranges`.
"""

from __future__ import annotations

import errno
import hashlib
import os
import shutil
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from flagdata.core.files.checksums import content_hash, files_of, read_sums, size_of, sums_of
from flagdata.core.files.durable import HEAL, flush_folder, flush_tree, make_folders
from flagdata.core.files.object_cache import copy_of, fetch_copy, forget, kept
from flagdata.core.files.regular_files import is_beside
from flagdata.errors import CorruptError, FlagdataError, InputError, NotFoundError
from flagdata.lake.artifact import OBJECT_NAME
from flagdata.lake.lake_layout import STORES, LinkError
from flagdata.storage import Place, RemotePath

_READ_ONLY = 0o444
DAMAGED = ".damaged"
"""Ends the name of the note that an object was found damaged, which lies beside it."""
REMEDY = (
    "do again what made it: flagdata verify says what that is, and the damaged object is "
    f"replaced; or {HEAL}"
)
_AT_ONCE = 8
"""Objects that are compared with their names at the same time."""
_ATTEMPTS = 5
"""How often an object is moved to its place while other writers publish the same one."""


@dataclass(frozen=True, kw_only=True)
class StoredObject:
    """An object in the store: its name in the catalog, where it is, and its size [B]."""

    name: str
    path: Place
    size: int
    modified: float


class Objects:
    """The stores `mcap/`, `zarr/` and `model/` of a lake at `root`; a lake made before format 2
    gets `model/` when its first model is stored."""

    def __init__(self, root: Path) -> None:
        self.root = root

    def path(self, name: str) -> Place:
        """Returns where the object called `name` is, whether or not it is there.

        Raises:
            InputError: not an object name; nothing outside the stores can be named.
        """
        return self._file(name)

    def _file(self, name: str) -> Path:
        return self.root / path_in_lake(name)

    def has(self, name: str) -> bool:
        """Checks whether the object is there."""
        return self.path(name).exists()

    def existing(self, name: str) -> Path:
        """Finds where the object is.

        Raises:
            NotFoundError: it is not there.
        """
        path = self._file(name)
        if not path.exists():
            raise self.missing(name)
        return path

    def readable(self, name: str) -> Place:
        """Returns a place from which the record can be read, see `flagdata.record.Record`: the
        object itself; for a bucket, a local copy, or the bucket's own object if it is large.

        Raises:
            NotFoundError: it is not there.
        """
        return self.existing(name)

    def openers(self, names: Sequence[str]) -> tuple[Callable[[], Place], ...]:
        """Returns for each record a function that says where it is read from, which other processes
        may call, too.

        Raises:
            NotFoundError: one is not there.
        """
        return tuple(partial(Path, self.existing(name)) for name in names)

    def missing(self, name: str) -> NotFoundError:
        """Returns the error for an object that is not there."""
        return NotFoundError(
            f"object {name} is missing", where=str(self.path(name)), fix="run flagdata doctor"
        )

    def size(self, name: str) -> int:
        """Bytes of the object.

        Raises:
            NotFoundError: it is not there.
        """
        return size_of(self.existing(name))

    def name_of(self, staged: Path) -> str:
        """Computes the name the content at `staged` will have.

        Raises:
            InputError: neither an .mcap file nor a folder of a known kind, or empty.
        """
        files = files_of(staged)
        if staged.is_file() and staged.suffix != ".mcap":
            raise InputError(
                "this is not an .mcap file",
                where=str(staged),
                fix="objects are .mcap files and Zarr folders",
            )
        if sum(f.stat().st_size for f in files) == 0:
            raise InputError(
                "the object is empty", where=str(staged), fix="write it before putting it"
            )
        store = (
            "mcap" if staged.is_file() else "model" if staged.suffix == STORES["model"] else "zarr"
        )
        return f"{store}/{content_hash(staged)}"

    def publish(self, staged: Path, name: str) -> bool:
        """Move `staged`, whose name was computed by `name_of`, to its place; durable when it
        returns.

        An object of that name that is there and whole is kept and `staged` removed; one that does
        not hash to its name is replaced, so that ingesting again heals a damaged lake. So it is
        with one that another writer publishes in the same moment.

        Returns:
            whether a whole object is there now that was not before.
        """
        os.utime(staged)  # age counts from here
        for entry in files_of(staged):
            entry.chmod(_READ_ONLY)
        flush_tree(staged)
        target = self._file(name)
        make_folders(target.parent)
        for attempt in range(_ATTEMPTS):
            if os.path.lexists(target):
                if self.is_whole(name):
                    os.utime(target)
                    self.remove(staged)
                    self._remove_note(name)
                    return False
                if target.is_dir() or target.is_symlink():
                    with suppress(FileNotFoundError):  # another writer has moved it away
                        target.rename(staged.with_name(f"damaged-{attempt}-{target.name}"))
            try:
                staged.rename(target)
                break
            except OSError as error:  # another writer was faster: look at what it has left there
                if error.errno not in (errno.ENOTEMPTY, errno.EEXIST) or attempt == _ATTEMPTS - 1:
                    raise
        flush_folder(target.parent)
        self._remove_note(name)
        return True

    def is_there(self, name: str, size: int | None) -> bool:
        """Checks whether the object is there, has `size` bytes if that is known, and no note says
        that it is damaged.

        Its bytes are not hashed: see `is_whole`.
        """
        try:
            stored_size = self.size(name)
        except (NotFoundError, InputError):  # a link in its place
            return False
        return size in (None, stored_size) and not self._note(name).exists()

    def is_sound(self, name: str, size: int | None) -> bool:
        """As `is_there`, and its bytes are those that its name says."""
        return self.is_there(name, size) and self.is_whole(name)

    def unsound(self, sizes: Mapping[str, int | None]) -> frozenset[str]:
        """Selects those of many objects, by name with their sizes, that are not as `is_sound` has
        it."""
        with ThreadPoolExecutor(_AT_ONCE) as pool:
            sound = pool.map(lambda name: self.is_sound(name, sizes[name]), sizes)
            return frozenset(
                name for name, is_right in zip(sizes, sound, strict=True) if not is_right
            )

    def note_damage(self, name: str) -> None:
        """Notes beside an object that it was found damaged, so that what makes it again, or has it,
        replaces it; where the lake can only be read, nothing is noted."""
        with suppress(OSError, FlagdataError):
            self._note(name).write_bytes(b"")

    def note_whole(self, name: str) -> None:
        """Take the note away that an object is damaged, if there is one and the lake can be
        written."""
        with suppress(OSError, FlagdataError):
            if self._note(name).exists():
                self._remove_note(name)

    def delete_all(self, names: Sequence[str], check: Callable[[], None]) -> dict[str, OSError]:
        """Delete objects, and what is noted of them; they are gone for good when it returns.

        Args:
            check: raises where the lock may have been lost that keeps others from needing them.

        Returns:
            name → what the disk refused.
        """
        refused: dict[str, OSError] = {}
        try:
            for name in names:
                check()
                try:
                    self.delete(name)
                except OSError as error:
                    refused[name] = error
        finally:
            self._flush_stores({name.partition("/")[0] for name in names})
        return refused

    def delete(self, name: str) -> None:
        """Delete an object, and what is noted of it; a power cut may bring it back until its store
        is flushed.

        Raises:
            OSError: what the disk refused.
        """
        self.remove(self.path(name))
        with suppress(OSError):  # a note without its object says nothing
            self._remove_note(name)

    def _flush_stores(self, stores: Collection[str]) -> None:
        """Forces deletions to the disk."""
        for store in sorted(stores):
            flush_folder(self.root / store)

    def _remove_note(self, name: str) -> None:
        self._note(name).unlink(missing_ok=True)

    def _note(self, name: str) -> Place:
        path = self.path(name)
        return path.parent / f"{path.name}{DAMAGED}"

    def is_whole(self, name: str) -> bool:
        """Checks whether the object is there and its content hashes to its name."""
        try:
            self.check(name)
        except (NotFoundError, CorruptError):
            return False
        return True

    def check(self, name: str) -> None:
        """Hashes one object again.

        Raises:
            NotFoundError: it is not there.
            LinkError: it is, or holds, a link or special file.
            CorruptError: its bytes are not what its name says.
        """
        path = self.existing(name)
        try:
            is_unchanged = content_hash(path) == name.partition("/")[2]
        except InputError:
            raise LinkError(
                f"{name} is, or holds, a link or special file", where=str(path), fix=REMEDY
            ) from None
        if not is_unchanged:
            raise CorruptError(
                f"the bytes of {name} have changed since they were written",
                where=str(path),
                fix=REMEDY,
            )

    def whole(self, name: str) -> Path:
        """Returns where the object is, once its bytes have been compared with its name; raises as
        `check`."""
        self.check(name)
        return self.existing(name)

    def __iter__(self) -> Iterator[StoredObject]:
        """Yields everything in the stores that has an object's name; a link counts for itself, not
        for what it leads to."""
        for store, suffix in STORES.items():
            for path in sorted((self.root / store).glob("*")):
                name = f"{store}/{path.name.removesuffix(suffix)}"
                if path.name.endswith(suffix) and OBJECT_NAME.fullmatch(name):
                    yield StoredObject(
                        name=name, path=path, size=bytes_at(path), modified=path.lstat().st_mtime
                    )

    @staticmethod
    def remove(path: Place) -> None:
        """Delete a file or folder of the store or of staging; of a link, the link."""
        if isinstance(path, RemotePath):
            path.remove_tree()
        elif path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)


def path_in_lake(name: str) -> Path:
    """Returns where the object called `name` is in a lake, from its root.

    Raises:
        InputError: not an object name; nothing outside the stores can be named.
    """
    if not OBJECT_NAME.fullmatch(name):
        raise InputError(
            f"{name!r} is not an object name",
            where="lake",
            fix="give mcap/<sha256>, zarr/<treehash> or model/<treehash>",
        )
    store, _, digest = name.partition("/")
    return Path(store) / f"{digest}{STORES[store]}"


def bytes_at(path: Place) -> int:
    """Bytes of whatever lies at a path; a link counts for itself, not for what it leads to."""
    inside = path.rglob("*") if path.is_dir() and not path.is_symlink() else ()
    return sum(
        entry.lstat().st_size for entry in (path, *inside) if entry.is_symlink() or entry.is_file()
    )


SUMS = ".sums"
WHOLE = 8 << 20
"""Records of at most so many bytes are fetched whole, and compared with their hash."""
_FILES_AT_ONCE = 8
"""Files of a folder that are moved at the same time."""
_FEW = 16
"""Objects at most that are asked for one by one, in place of a list of all."""


class RemoteObjects(Objects):
    """The stores of a lake in a bucket."""

    def __init__(self, root: RemotePath) -> None:
        self._root = root

    def path(self, name: str) -> RemotePath:
        """Returns where the object called `name` is in the bucket, whether or not it is there.

        Raises:
            InputError: not an object name.
        """
        return self._root / path_in_lake(name)

    def has(self, name: str) -> bool:
        return self._put_last(name).exists()

    def existing(self, name: str) -> Path:
        """Returns a local copy of the object.

        Raises:
            NotFoundError: it is not there.
            CorruptError: its bytes are not what its name says.
        """
        remote = self.path(name)
        if (copy := copy_of(name, remote.suffix)) is not None:
            return copy
        size = self.size(name)
        try:
            return fetch_copy(
                name, remote.suffix, size=size, fetch=partial(self._fetch, name), where=str(remote)
            )
        except CorruptError:
            self.note_damage(name)
            raise

    def readable(self, name: str) -> Place:
        """Returns a local copy, or the place in the bucket of a record that is larger than `WHOLE`:
        of it only what is needed is fetched.

        Raises:
            NotFoundError, CorruptError: see `existing`.
        """
        remote = self.path(name)
        if self._is_copied(name):
            return self.existing(name)
        try:
            status = remote.stat()
        except FileNotFoundError:
            raise self.missing(name) from None
        large = status.st_size > WHOLE
        return (
            RemotePath(remote.bucket, remote.key, status=status) if large else self.existing(name)
        )

    def openers(self, names: Sequence[str]) -> tuple[Callable[[], Place], ...]:
        """Returns functions as for a disk; what is needed is fetched once its function was
        called."""
        if not all(map(self._is_copied, names)):
            stored_names = {stored.name for stored in self}
            for name in names:
                if name not in stored_names:
                    raise self.missing(name)
        return tuple(partial(self.readable, name) for name in names)

    def whole(self, name: str) -> Path:
        """Returns a local copy, whose bytes are compared with its name again."""
        path = self.existing(name)
        if content_hash(path) != name.partition("/")[2]:
            forget(name, path.suffix)
            path = self.existing(name)
        return path

    def size(self, name: str) -> int:
        remote = self.path(name)
        try:
            if remote.suffix == ".mcap":
                return remote.stat().st_size
            sizes = {key: status.st_size for key, status in remote.names()}
        except FileNotFoundError:
            raise self.missing(name) from None
        if sizes.pop(SUMS, None) is None:
            raise self.missing(name)
        return sum(size for key, size in sizes.items() if not _is_beside(key))

    def is_sound(self, name: str, size: int | None) -> bool:
        """As `is_there`: to compare the bytes would fetch all of them. What verify or a reader
        found damaged counts."""
        return self.is_there(name, size)

    def unsound(self, sizes: Mapping[str, int | None]) -> frozenset[str]:
        if len(sizes) <= _FEW:
            return super().unsound(sizes)
        stored_sizes = {stored.name: stored.size for stored in self}
        noted = {path.name for store in STORES for path in (self._root / store).glob(f"*{DAMAGED}")}
        return frozenset(
            name
            for name, size in sizes.items()
            if name not in stored_sizes
            or size not in (None, stored_sizes[name])
            or self._note(name).name in noted
        )

    def publish(self, staged: Path, name: str) -> bool:
        """Puts `staged`, whose name was computed by `name_of`; durable when it returns.

        What is there under that name has the same bytes, unless it was damaged, and is put anew: so
        it counts as young, and ingesting again heals a lake.

        Returns:
            whether nothing that `is_sound` was there before.
        """
        remote = self.path(name)
        fresh = not self.is_sound(name, size_of(staged))
        if staged.is_file():
            remote.upload(staged)
        else:
            with ThreadPoolExecutor(_FILES_AT_ONCE) as pool:
                uploads = [
                    pool.submit((remote / file.relative_to(staged)).upload, file)
                    for file in files_of(staged)
                ]
                for upload in uploads:
                    upload.result()
            (remote / SUMS).write_bytes(sums_of(staged).encode())
        if fresh:
            self._remove_note(name)
        kept(name, remote.suffix, staged)
        return fresh

    def check(self, name: str) -> None:
        remote = self.path(name)
        if not self.has(name):
            raise self.missing(name)
        try:
            is_unchanged = self._hash(name) == name.partition("/")[2]
        except FileNotFoundError:
            is_unchanged = False
        if not is_unchanged:
            raise CorruptError(
                f"the bytes of {name} have changed since they were written",
                where=str(remote),
                fix=REMEDY,
            )

    def __iter__(self) -> Iterator[StoredObject]:
        for store, suffix in STORES.items():
            sizes: dict[str, int] = {}
            modified: dict[str, float] = {}
            for key, status in (self._root / store).names():
                name = f"{store}/{key.partition('/')[0].removesuffix(suffix)}"
                if OBJECT_NAME.fullmatch(name) and key.startswith(path_in_lake(name).name):
                    sizes[name] = sizes.get(name, 0) + (0 if _is_beside(key) else status.st_size)
                    modified[name] = max(modified.get(name, 0.0), status.st_mtime)
            for name, size in sorted(sizes.items()):
                yield StoredObject(
                    name=name, path=self.path(name), size=size, modified=modified[name]
                )

    @staticmethod
    def remove(path: Place) -> None:
        if isinstance(path, RemotePath):
            name = f"{path.parent.name}/{path.stem}"
            forget(
                name, path.suffix
            )  # first: once the object is gone, nobody would ask for its copy again
            path.remove_tree(first=None if path.suffix == ".mcap" else SUMS)
            forget(
                name, path.suffix
            )  # what a reader fetched meanwhile: what is erased stays nowhere on this machine
        else:
            Objects.remove(path)

    def _flush_stores(self, stores: Collection[str]) -> None:
        """Does nothing: a store answers a deletion when it is done."""

    def _is_copied(self, name: str) -> bool:
        return copy_of(name, self.path(name).suffix) is not None

    def _put_last(self, name: str) -> RemotePath:
        """Returns what was put last of an object."""
        remote = self.path(name)
        return remote if remote.suffix == ".mcap" else remote / SUMS

    def _fetch(self, name: str, target: Path) -> None:
        remote = self.path(name)
        if remote.suffix == ".mcap":
            _download(remote, target)
            return
        target.mkdir()
        files = self._sums(remote)
        for file in files:
            (target / file).parent.mkdir(parents=True, exist_ok=True)
        with ThreadPoolExecutor(_FILES_AT_ONCE) as pool:
            list(pool.map(lambda file: _download(remote / file, target / file), files))

    def _sums(self, remote: RemotePath) -> dict[str, str]:
        """Reads relative path → SHA-256 of a folder's files.

        Raises:
            CorruptError: they cannot be read, are not those of its name, or name files outside the
                folder.
        """
        content = (remote / SUMS).read_bytes()
        try:
            sums = read_sums(content.decode())
        except ValueError:
            sums = None
        if (
            sums is None
            or hashlib.sha256(content).hexdigest() != remote.stem
            or any(
                "\0" in file or file.startswith("/") or ".." in Path(file).parts for file in sums
            )
        ):
            raise CorruptError(
                "the sums of its files are damaged", where=str(remote / SUMS), fix=REMEDY
            )
        return sums

    def _hash(self, name: str) -> str:
        remote = self.path(name)
        if remote.suffix == ".mcap":
            return _digest(remote)
        text = "".join(f"{_digest(remote / file)}  {file}\n" for file in sorted(self._sums(remote)))
        return hashlib.sha256(text.encode()).hexdigest()


def _is_beside(key: str) -> bool:
    """Checks whether a key is that of the sums, or of what an operating system put beside an
    object's files."""
    return any(map(is_beside, key.split("/")))


def _download(source: RemotePath, target: Path) -> None:
    with target.open("wb") as stream:
        for block in source.blocks():
            stream.write(block)


def _digest(path: RemotePath) -> str:
    digest = hashlib.sha256()
    for block in path.blocks():
        digest.update(block)
    return digest.hexdigest()
