"""Immutable objects in a bucket: `mcap/<sha256>.mcap`, and folders as `zarr/<treehash>.zarr/…`.

A folder's files are put first and `.sums`, the lines whose SHA-256 is its name, last: without it the folder is not
there. It is deleted first. Objects are read from a local copy, see `flagdata.object_cache`; of large records only
the parts that are needed are fetched, see `flagdata.object_ranges`.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

from flagdata.checksums import content_hash, files_of, read_sums, size_of, sums_of
from flagdata.errors import CorruptError
from flagdata.files import is_beside
from flagdata.lake.artifact import OBJECT_NAME
from flagdata.lake.layout import STORES
from flagdata.lake.objects import DAMAGED, REMEDY, Objects, StoredObject, path_in_lake
from flagdata.object_cache import copy_of, fetched, forget, kept
from flagdata.storage import Place, RemotePath

SUMS = ".sums"
WHOLE = 8 << 20
"""Records of at most so many bytes are fetched whole, and compared with their hash."""
_AT_ONCE = 8
"""Files of a folder that are moved at the same time."""
_FEW = 16
"""Objects at most that are asked for one by one, in place of a list of all."""


class RemoteObjects(Objects):
    """The stores of a lake in a bucket."""

    def __init__(self, root: RemotePath) -> None:
        self._root = root

    def path(self, name: str) -> RemotePath:
        """Where the object called `name` is in the bucket, whether or not it is there.

        Raises:
            InputError: not an object name.
        """
        return self._root / path_in_lake(name)

    def has(self, name: str) -> bool:
        return self._whole_by(name).exists()

    def existing(self, name: str) -> Path:
        """A local copy of the object.

        Raises:
            NotFoundError: it is not there.
            CorruptError: its bytes are not what its name says.
        """
        place = self.path(name)
        if (copy := copy_of(name, place.suffix)) is not None:
            return copy
        size = self.size(name)
        try:
            return fetched(name, place.suffix, size=size, fetch=partial(self._fetch, name), where=str(place))
        except CorruptError:
            self.note_damage(name)
            raise

    def readable(self, name: str) -> Place:
        """A local copy, or the place in the bucket of a record that is larger than `WHOLE`: of it only what is needed
        is fetched.

        Raises:
            NotFoundError, CorruptError: see `existing`.
        """
        place = self.path(name)
        if self._copied(name):
            return self.existing(name)
        try:
            status = place.stat()
        except FileNotFoundError:
            raise self.missing(name) from None
        large = status.st_size > WHOLE
        return RemotePath(place.bucket, place.key, status=status) if large else self.existing(name)

    def openers(self, names: Sequence[str]) -> tuple[Callable[[], Place], ...]:
        """As for a disk; what is needed is fetched once its function was called."""
        if not all(map(self._copied, names)):
            there = {stored.name for stored in self}
            for name in names:
                if name not in there:
                    raise self.missing(name)
        return tuple(partial(self.readable, name) for name in names)

    def whole(self, name: str) -> Path:
        """A local copy, whose bytes are compared with its name again."""
        path = self.existing(name)
        if content_hash(path) != name.partition("/")[2]:
            forget(name, path.suffix)
            path = self.existing(name)
        return path

    def size(self, name: str) -> int:
        place = self.path(name)
        try:
            if place.suffix == ".mcap":
                return place.stat().st_size
            found = {key: status.st_size for key, status in place.names()}
        except FileNotFoundError:
            raise self.missing(name) from None
        if found.pop(SUMS, None) is None:
            raise self.missing(name)
        return sum(size for key, size in found.items() if not _is_beside(key))

    def is_sound(self, name: str, size: int | None) -> bool:
        """As `is_there`: to compare the bytes would fetch all of them. What verify or a reader found damaged counts."""
        return self.is_there(name, size)

    def unsound(self, sizes: Mapping[str, int | None]) -> frozenset[str]:
        if len(sizes) <= _FEW:
            return super().unsound(sizes)
        found = {stored.name: stored.size for stored in self}
        noted = {path.name for store in STORES for path in (self._root / store).glob(f"*{DAMAGED}")}
        return frozenset(
            name
            for name, size in sizes.items()
            if name not in found or size not in (None, found[name]) or self._note(name).name in noted
        )

    def publish(self, staged: Path, name: str) -> bool:
        """Put `staged`, whose name was computed by `name_of`; durable when it returns.

        What is there under that name has the same bytes, unless it was damaged, and is put anew: so it counts as young,
        and ingesting again heals a lake.

        Returns:
            whether nothing that `is_sound` was there before.
        """
        place = self.path(name)
        fresh = not self.is_sound(name, size_of(staged))
        if staged.is_file():
            place.upload(staged)
        else:
            with ThreadPoolExecutor(_AT_ONCE) as pool:
                uploads = [pool.submit((place / file.relative_to(staged)).upload, file) for file in files_of(staged)]
                for upload in uploads:
                    upload.result()
            (place / SUMS).write_bytes(sums_of(staged).encode())
        if fresh:
            self._mended(name)
        kept(name, place.suffix, staged)
        return fresh

    def check(self, name: str) -> None:
        place = self.path(name)
        if not self.has(name):
            raise self.missing(name)
        try:
            whole = self._hash(name) == name.partition("/")[2]
        except FileNotFoundError:
            whole = False
        if not whole:
            raise CorruptError(
                f"the bytes of {name} have changed since they were written", where=str(place), fix=REMEDY
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
                yield StoredObject(name=name, path=self.path(name), size=size, modified=modified[name])

    @staticmethod
    def remove(path: Place) -> None:
        if isinstance(path, RemotePath):
            path.remove_tree(first=None if path.suffix == ".mcap" else SUMS)
            forget(f"{path.parent.name}/{path.stem}", path.suffix)  # what is erased stays nowhere on this machine
        else:
            Objects.remove(path)

    def _copied(self, name: str) -> bool:
        return copy_of(name, self.path(name).suffix) is not None

    def _whole_by(self, name: str) -> RemotePath:
        """What was put last of an object."""
        place = self.path(name)
        return place if place.suffix == ".mcap" else place / SUMS

    def _fetch(self, name: str, target: Path) -> None:
        place = self.path(name)
        if place.suffix == ".mcap":
            _download(place, target)
            return
        target.mkdir()
        files = self._sums(place)
        for file in files:
            (target / file).parent.mkdir(parents=True, exist_ok=True)
        with ThreadPoolExecutor(_AT_ONCE) as pool:
            list(pool.map(lambda file: _download(place / file, target / file), files))

    def _sums(self, place: RemotePath) -> dict[str, str]:
        """Relative path → SHA-256 of a folder's files.

        Raises:
            CorruptError: they cannot be read, are not those of its name, or name files outside the folder.
        """
        stated = (place / SUMS).read_bytes()
        try:
            sums = read_sums(stated.decode())
        except ValueError:
            sums = None
        if (
            sums is None
            or hashlib.sha256(stated).hexdigest() != place.stem
            or any("\0" in file or file.startswith("/") or ".." in Path(file).parts for file in sums)
        ):
            raise CorruptError("the sums of its files are damaged", where=str(place / SUMS), fix=REMEDY)
        return sums

    def _hash(self, name: str) -> str:
        place = self.path(name)
        if place.suffix == ".mcap":
            return _digest(place)
        text = "".join(f"{_digest(place / file)}  {file}\n" for file in sorted(self._sums(place)))
        return hashlib.sha256(text.encode()).hexdigest()


def _is_beside(key: str) -> bool:
    """Whether a key is that of the sums, or of what an operating system put beside an object's files."""
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
