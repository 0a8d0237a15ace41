"""A place in a bucket, with the part of `Path` that a lake uses.

A bucket has no folders: one is there as long as something lies in it. Each put shows whole or not
at all, and is durable when it returns. `create` takes a name only if it is free. A request that
fails is repeated, so a `create` may find the name taken by its own first try: then the bytes are
there, and it has succeeded.
"""

from __future__ import annotations

import errno
import fnmatch
import posixpath
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from flagdata.errors import UsageError
from flagdata.storage import connection
from flagdata.storage.refusals import DeniedError, StoreError, refusal, store_time
from flagdata.storage.uploads import Upload, list_unfinished

if TYPE_CHECKING:
    from obstore.store import S3Store

SCHEME = "s3://"
BLOCK = 8 << 20
"""Bytes that one request reads or writes of a larger object."""
_UPLOADS = 3
"""How often a file is put whose parts the store does not find."""
_BROKEN = 5
"""How often a request is sent whose answer breaks off; each may be sent twice, see
`RemotePath.create`."""
_CONFLICTS = 8
"""How often a conditional put is made that the store calls in conflict with another, and neither
shows."""
_ADDRESS = re.compile(r"s3://([a-z0-9][a-z0-9.-]{1,61}[a-z0-9])(?:/(.*))?", re.DOTALL)
_SECRET = re.compile(r"(?<!^[sS]3):|[@?]")
"""What stands beside credentials in an address: a user's name and password, or the query of a
signed one."""
_KEY = re.compile(r"[A-Za-z0-9._=+-]+(?:/[A-Za-z0-9._=+-]+)*")

T = TypeVar("T")


@dataclass(frozen=True, kw_only=True)
class Status:
    """Size [B], when it was written [s since 1970, by the store's clock], and the version that
    conditions name."""

    st_size: int
    st_mtime: float
    e_tag: str | None = None


class RemotePath:
    """A key of a bucket.

    Args:
        bucket: its name.
        key: without a slash at either end; "" is the bucket itself.
        status: as a listing gave it; what `stat` returns.
    """

    __slots__ = ("_status", "bucket", "key")

    def __init__(self, bucket: str, key: str, *, status: Status | None = None) -> None:
        self.bucket = bucket
        self.key = key
        self._status = status

    @classmethod
    def parse(cls, address: str) -> RemotePath:
        """Parses an address "s3://bucket/prefix".

        Raises:
            UsageError: not such an address, or a prefix that not every client writes in the same
                way.
        """
        match = _ADDRESS.fullmatch(address)
        if match is None:
            safe_address = "s3://…" if _SECRET.search(address) else address
            raise UsageError(
                "this is not the address of a bucket",
                where=safe_address,
                fix="write s3://bucket/prefix; credentials are read from the environment or a "
                "profile",
            )
        key = (match[2] or "").rstrip("/")
        if key and (not _KEY.fullmatch(key) or {".", ".."} & set(key.split("/"))):
            safe_address = f"{SCHEME}{match[1]}/…" if _SECRET.search(address) else address
            raise UsageError(
                "the prefix of a lake has letters, digits and . _ = + - only, between single "
                "slashes",
                where=safe_address,
                fix="choose another prefix",
            )
        return cls(match[1], key)

    def __reduce__(self) -> tuple[type[RemotePath], tuple[str, str]]:
        return (RemotePath, (self.bucket, self.key))

    def __str__(self) -> str:
        return f"{SCHEME}{self.bucket}/{self.key}" if self.key else f"{SCHEME}{self.bucket}"

    def __repr__(self) -> str:
        return f"RemotePath({str(self)!r})"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, RemotePath) and (self.bucket, self.key) == (
            other.bucket,
            other.key,
        )

    def __hash__(self) -> int:
        return hash((self.bucket, self.key))

    def __lt__(self, other: RemotePath) -> bool:
        return (self.bucket, self.key) < (other.bucket, other.key)

    def __truediv__(self, name: str | Path) -> RemotePath:
        return RemotePath(self.bucket, posixpath.join(self.key, str(name)))

    def joinpath(self, *names: str) -> RemotePath:
        return RemotePath(self.bucket, posixpath.join(self.key, *names))

    @property
    def name(self) -> str:
        return posixpath.basename(self.key)

    @property
    def stem(self) -> str:
        return posixpath.splitext(self.name)[0]

    @property
    def suffix(self) -> str:
        return posixpath.splitext(self.name)[1]

    @property
    def parent(self) -> RemotePath:
        return RemotePath(self.bucket, posixpath.dirname(self.key))

    def as_uri(self) -> str:
        return str(self)

    def exists(self) -> bool:
        """Checks whether there is an object of this key; what only has others beneath it is
        none."""
        try:
            self.stat()
        except FileNotFoundError:
            return False
        return True

    def is_file(self) -> bool:
        return self.exists()

    def is_dir(self) -> bool:
        """Checks whether there is anything beneath."""
        return next(iter(self.rglob("*")), None) is not None

    def is_symlink(self) -> bool:
        return False

    def stat(self) -> Status:
        """Asks for its size and age.

        Raises:
            FileNotFoundError: no object of this key.
            StoreError: the store did not say.
        """
        if self._status is not None:
            return self._status
        return _status(self._ask(lambda obstore, store: obstore.head(store, self.key)))

    lstat = stat

    def read_bytes(self) -> bytes:
        """Reads the object.

        Raises:
            FileNotFoundError: no object of this key.
            StoreError: it could not be read.
        """
        return self._ask(lambda obstore, store: bytes(obstore.get(store, self.key).bytes()))

    def read_range(self, offset: int, length: int) -> bytes:
        """Reads at most `length` bytes at `offset`, fewer at the end of the object."""
        if length == 0:
            return b""
        return self._ask(
            lambda obstore, store: bytes(
                obstore.get_range(store, self.key, start=offset, length=length)
            )
        )

    def read_ranges(self, offsets: Sequence[int], lengths: Sequence[int]) -> list[bytes]:
        """Reads several ranges; those that lie within 1 MiB of each other are read together."""
        return self._ask(
            lambda obstore, store: [
                bytes(part)
                for part in obstore.get_ranges(store, self.key, starts=offsets, lengths=lengths)
            ]
        )

    def blocks(self) -> Iterator[bytes]:
        """Yields the object, block after block."""
        size = self.stat().st_size
        for offset in range(0, size, BLOCK):
            yield self.read_range(offset, min(BLOCK, size - offset))

    def write_bytes(self, data: bytes) -> None:
        """Put an object, in place of another or not."""
        self._ask(lambda obstore, store: obstore.put(store, self.key, data))

    def upload(self, file: Path) -> None:
        """Put a file's bytes; of a large file in parts, which show together. What fails leaves no
        parts behind.

        Raises:
            StoreError: the store did not take it.
        """
        if file.stat().st_size <= BLOCK:
            self._upload(file)
            return
        before = self._unfinished_uploads()
        try:
            self._upload(file)
        except BaseException:
            for upload in self._unfinished_uploads() - before:
                with suppress(StoreError):  # what is left is a collection's
                    upload.abort()
            raise

    def uploads(self) -> list[Upload]:
        """Lists uploads of this key and of those beneath that were begun and are not finished, nor
        aborted.

        Raises:
            StoreError: the store did not list them; some cannot.
        """
        beneath = list_unfinished(self.bucket, self.key)
        return [
            upload
            for upload in beneath
            if upload.key == self.key or not self.key or upload.key.startswith(f"{self.key}/")
        ]

    def now(self) -> float:
        """Reads the store's clock, which gives objects their times [s since 1970].

        Raises:
            StoreError: the store did not say.
        """
        return store_time(self.bucket)

    def _unfinished_uploads(self) -> set[Upload]:
        """Lists what `uploads` gives; nothing where the store does not say."""
        with suppress(StoreError):
            return {*self.uploads()}
        return set()

    def _upload(self, file: Path) -> None:
        for _ in range(_UPLOADS):
            # A store that is asked again to join the parts, since its first answer was lost, knows
            # of no parts.
            with suppress(FileNotFoundError):
                self._ask(
                    lambda obstore, store: obstore.put(
                        store, self.key, file, chunk_size=BLOCK, max_concurrency=4
                    )
                )
                return
        raise StoreError(errno.EREMOTEIO, "the store lost the parts of an upload", str(self))

    def create(self, data: bytes) -> bool:
        """Puts an object if its key is free; False where it was taken.

        Raises:
            StoreError: the store did not say whether it took it; it may yet appear.
        """
        for _ in range(_CONFLICTS):
            try:
                self._ask(lambda obstore, store: obstore.put(store, self.key, data, mode="create"))
            except FileExistsError:
                if (content := self._content()) is not None:
                    return content == data
                continue  # 409: of two puts in one moment the store may take neither
            except DeniedError:
                raise
            except StoreError:
                with suppress(StoreError):
                    if self._content() == data:
                        return True
                raise
            return True
        raise StoreError(
            errno.EREMOTEIO, "the store took none of several puts of this object", str(self)
        )

    def replace_if(self, e_tag: str | None, data: bytes) -> str | None:
        """Put an object in place of the one of that version; the new one's version, or None where
        it was not that."""
        mode: Any = {"e_tag": e_tag}
        for _ in range(_CONFLICTS):
            try:
                return self._ask(
                    lambda obstore, store: obstore.put(store, self.key, data, mode=mode)
                )["e_tag"]
            except FileExistsError:
                with suppress(FileNotFoundError):
                    if RemotePath(self.bucket, self.key).stat().e_tag == e_tag:  # 409, as above
                        continue
            except FileNotFoundError:
                pass
            break
        return None

    def unlink(self, missing_ok: bool = False) -> None:
        self._ask(lambda obstore, store: obstore.delete(store, self.key))

    def mkdir(self, *, parents: bool = False, exist_ok: bool = False) -> None:
        """Does nothing: what is put makes the folders that it is in."""

    def names(self, *, after: str | None = None) -> Iterator[tuple[str, Status]]:
        """Keys beneath, from this one on, and their status, in order.

        Args:
            after: only those that come after this name.
        """
        prefix = f"{self.key}/" if self.key else ""
        offset = None if after is None else prefix + after
        broken = 0
        while True:
            try:
                for meta in self._list_beneath(offset):
                    offset = meta["path"]
                    yield meta["path"].removeprefix(prefix), _status(meta)
                return
            except StoreError as error:
                broken += 1
                if not error.passing or broken == _BROKEN:
                    raise

    def _list_beneath(self, offset: str | None) -> Iterator[Any]:
        """Yields what is beneath, after a key; a listing that breaks off cannot be gone on with."""
        store = connection.client(self.bucket)
        import obstore
        from obstore import exceptions

        stream = iter(obstore.list(store, self.key or None, offset=offset, chunk_size=1000))
        while True:
            try:
                chunk = next(stream, None)
            except (exceptions.BaseError, OSError) as error:
                raise self._refusal(error) from None
            if chunk is None:
                return
            yield from chunk

    def rglob(self, pattern: str) -> Iterator[RemotePath]:
        """Yields all objects beneath whose last name fits; folders are none."""
        for name, status in self.names():
            if fnmatch.fnmatchcase(posixpath.basename(name), pattern):
                yield RemotePath(self.bucket, posixpath.join(self.key, name), status=status)

    def iterdir(self) -> Iterator[RemotePath]:
        """Yields what lies directly beneath: objects, and folders."""
        listing = self._ask(
            lambda obstore, store: obstore.list_with_delimiter(store, self.key or None)
        )
        for key in listing["common_prefixes"]:
            yield RemotePath(self.bucket, key.rstrip("/"))
        for meta in listing["objects"]:
            yield RemotePath(self.bucket, meta["path"], status=_status(meta))

    def glob(self, pattern: str) -> Iterator[RemotePath]:
        """Yields what lies directly beneath and has a name that fits."""
        return (path for path in self.iterdir() if fnmatch.fnmatchcase(path.name, pattern))

    def relative_to(self, other: RemotePath) -> Path:
        """Returns the rest of the key behind that of `other`."""
        return Path(self.key).relative_to(other.key)

    def remove_tree(self, *, first: str | None = None) -> None:
        """Delete the object and all beneath, the one called `first` before all others."""
        if first is not None:
            (self / first).unlink()
        keys = [path.key for path in self.rglob("*")]
        self._ask(lambda obstore, store: obstore.delete(store, [self.key, *keys]))

    def _content(self) -> bytes | None:
        try:
            return self.read_bytes()
        except FileNotFoundError:
            return None

    def _ask(self, request: Callable[[Any, S3Store], T]) -> T:
        """Asks the store; what it refuses is an error of the system that shows no credentials."""
        store = connection.client(self.bucket)
        import obstore
        from obstore import exceptions

        for tries_left in reversed(range(_BROKEN)):
            try:
                return request(obstore, store)
            except (FileNotFoundError, exceptions.NotFoundError) as error:
                if "NoSuchBucket" in str(error):
                    raise self._refusal(error) from None
                raise FileNotFoundError(
                    errno.ENOENT, "there is no such object", str(self)
                ) from None
            except (exceptions.AlreadyExistsError, exceptions.PreconditionError) as error:
                if "performing PUT" not in str(error):  # 409 of a bucket that is being changed
                    raise self._refusal(error) from None
                raise FileExistsError(
                    errno.EEXIST, "there is such an object, or another version of it", str(self)
                ) from None
            except (exceptions.BaseError, OSError) as error:
                refused = self._refusal(error)
                if not refused.passing or not tries_left:
                    raise refused from None
        raise AssertionError("the last try returns or raises")

    def _refusal(self, error: Exception) -> StoreError:
        return refusal(error, bucket=self.bucket, where=str(self))


def _status(meta: Any) -> Status:
    return Status(
        st_size=meta["size"], st_mtime=meta["last_modified"].timestamp(), e_tag=meta["e_tag"]
    )
