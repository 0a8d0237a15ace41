"""The lake as users hold it: open it, ask for rows, publish, name versions."""

from __future__ import annotations

import json
import re
import uuid
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from urllib.parse import unquote

from flagdata.core import provenance
from flagdata.core.files.addresses import lake_place
from flagdata.core.files.durable import HEAL, disk_errors, make_folders, put_if_absent
from flagdata.core.files.regular_files import is_beside, open_regular
from flagdata.core.printable import printable
from flagdata.core.schema import FORMAT_VERSION
from flagdata.errors import ConflictError, CorruptError, NotFoundError, UsageError
from flagdata.lake.catalog_log_errors import newer
from flagdata.lake.delta_log import names_in
from flagdata.lake.label_columns import Value
from flagdata.lake.labels import put
from flagdata.lake.lake_layout import FOLDERS, STAGING, scratch_files
from flagdata.lake.lake_locks import MADE, TimedLocks
from flagdata.lake.merging import MergeResult, merge
from flagdata.lake.objects import Objects
from flagdata.lake.place_probing import probe
from flagdata.lake.ref_commits import delete_ref, make_ref
from flagdata.lake.refs import MAIN, Ref
from flagdata.lake.removal import Erasure, Withdrawal, descendants, erase, explain_missing, withdraw
from flagdata.lake.store import Store
from flagdata.lake.transaction import Transaction
from flagdata.recipes.documents import from_json
from flagdata.storage import Place, RemotePath

MARKER = "lake.json"
"""The file that says that a folder is a lake, and which."""
_MARKER_SCHEMA = "flagdata.lake/1"
_UNUSABLE = re.compile(
    "[\\\\\ud800-\udfff]"
)  # the Delta library takes a backslash for a separator; no UTF-8
_CONTROL = re.compile(
    "[\x00-\x1f\x7f-\x9f\u2028\u2029]"
)  # the Delta library leaves tabs and line breaks out of a path


class Lake(Store):
    """A lake in a folder; make it by `create` or `open`. Cheap, picklable, keeps nothing open.

    The catalog must not be used in a forked child of a process that used it (it says so); objects
    may be read anywhere.
    """

    @classmethod
    def create(cls, path: Place | str) -> Lake:
        """Make an empty lake in the folder `path`, which may exist if it is empty, or at
        `s3://bucket/prefix`.

        Raises:
            ConflictError: a lake, or anything else, is there.
            UsageError: any other address, or a path that the Delta library cannot work in.
            RefusedError: a disk or store that lacks what every commit relies on, see
                `flagdata.lake.place_probing`.
        """
        return cls._make(path, lambda lake: lake._fill())

    @classmethod
    def _make(cls, path: Place | str, fill: Callable[[Lake], None]) -> Lake:
        lake = cls(_usable(path))
        with disk_errors("creating a lake", lake.path):
            if lake._is_occupied():
                raise lake._taken()
            if not lake._claim():
                raise ConflictError(
                    "another process is making a lake there",
                    where=str(lake.path),
                    fix="open that one",
                )
            try:
                lake._clear()
                probe(lake.staging)
                make_folders(*(lake.path / folder for folder in FOLDERS))
                fill(lake)
            except BaseException:
                for entry in lake._entries():
                    Objects.remove(entry)
                raise
        return lake

    def _entries(self) -> list[Place]:
        """Lists what lies in the lake's folder, without what `files.is_beside`."""
        return [entry for entry in self.path.iterdir() if not is_beside(entry.name)]

    def _taken(self) -> ConflictError:
        """Returns the error for a lake that cannot be made since something is there."""
        where = str(self.path)
        if (self.path / MARKER).exists():
            return ConflictError(
                "there is a lake already", where=where, fix="choose an empty or new folder"
            )
        inside = {path.name for path in self._entries()} if self.path.is_dir() else set()
        if STAGING in inside and inside <= {*FOLDERS, MARKER}:
            return ConflictError(
                "a lake is being made there, or its making was stopped",
                where=where,
                fix="wait for it; where no process is making it, delete what is there and give the "
                "command again",
            )
        return ConflictError(
            "there is something else already", where=where, fix="choose an empty or new folder"
        )

    def _is_occupied(self) -> bool:
        """Checks whether anything is there but, in a bucket, what a process left that was killed
        while it made a lake."""
        if isinstance(self.staging, RemotePath):
            has_more = any(entry != self.staging for entry in self._entries())
            return has_more and not TimedLocks(self.staging).unfinished(done=self.path / MARKER)
        is_file = self.path.exists() and not self.path.is_dir()
        return is_file or (self.path.is_dir() and any(self._entries()))

    def _clear(self) -> None:
        """Delete what such a process left; nothing but the claim of this one is there then."""
        if isinstance(self.path, RemotePath):
            for entry in self.path.rglob("*"):
                if entry != self.staging / MADE:
                    entry.unlink()

    def _claim(self) -> bool:
        """Checks whether this process makes the lake: the one that succeeds in making its
        staging."""
        if isinstance(self.staging, RemotePath):
            self.check_writable()
            return TimedLocks(self.staging).is_claimed(done=self.path / MARKER)
        make_folders(self.path)
        try:
            self.staging.mkdir()
        except FileExistsError:
            return False
        return True

    @classmethod
    def adopt(cls, path: Place | str, source: Lake) -> Lake:
        """Make a lake at `path` whose history begins as that of `source`: its first version,
        nothing in it yet.

        Raises:
            ConflictError, UsageError, RefusedError: as `create`.
        """
        return cls._make(path, lambda lake: lake._begin_as(source))

    @classmethod
    def open(cls, path: Place | str) -> Lake:
        """Opens the lake in the folder `path`, or at `s3://bucket/prefix`.

        Raises:
            NotFoundError: no lake there.
            ConflictError: written by a newer format.
            CorruptError: its marker cannot be read.
            UsageError: any other address, or a path that the Delta library cannot work in.
        """
        lake = cls(_usable(path))
        marker = lake.path / MARKER
        try:
            with _readable(marker), open_regular(marker) as stream:
                content = from_json(stream.read())
            version = content["format_version"]
            if type(version) is not int or version < 1:
                raise ValueError("it states no version of the format")
        except (FileNotFoundError, NotADirectoryError):
            raise NotFoundError(
                "there is no lake here",
                where=str(lake.path),
                fix="make one with flagdata init, or name one by --lake",
            ) from None
        except (ValueError, KeyError, TypeError):
            raise CorruptError(
                "the lake's marker cannot be read", where=str(marker), fix=HEAL
            ) from None
        if version > FORMAT_VERSION:
            raise newer(f"it has format {version}", lake.path)
        return lake

    @classmethod
    def found(cls, path: Place | str) -> Lake:
        """Finds what there is of the lake at `path`, for what heals it: its marker, or its log, may
        be damaged or gone.

        Raises:
            NotFoundError: no lake there.
            ConflictError, UsageError: as `open`.
        """
        try:
            return cls.open(path)
        except (CorruptError, NotFoundError):
            lake = cls(_usable(path))
            if any(
                map(names_in, (lake.path / "catalog" / "_delta_log", lake.path / "refs" / "newest"))
            ):
                return lake
            if (lake.path / MARKER).exists():
                return lake
            raise

    def _begin_as(self, source: Lake) -> None:
        self.catalog.adopt(0, *source.catalog.entry(0))
        self.catalog.acknowledge(0)
        with open_regular(source.path / MARKER) as stream:
            put_if_absent(self.path / MARKER, stream.read())

    def _fill(self) -> None:
        self.catalog.create(
            {"message": "create the lake", "code_version": provenance.code_version()}
        )
        marker = {
            "schema": _MARKER_SCHEMA,
            "format_version": FORMAT_VERSION,
            "lake": uuid.uuid4().hex,
            "created": datetime.now(UTC).isoformat(timespec="seconds"),
        }
        put_if_absent(self.path / MARKER, (json.dumps(marker, indent=2) + "\n").encode())

    def transaction(self, message: str, *, branch: str = MAIN) -> Transaction:
        """Opens a context manager that collects objects and rows, publishes all when its block
        ends, nothing when that raises.

        Raises:
            NotFoundError: no such branch.
            ConflictError: other processes kept committing for two minutes.
            FlagdataError: no space, no permission; nothing was published.
        """
        return Transaction(self, message, branch=branch)

    def object_path(self, object: str) -> Path:  # noqa: A002 — the catalog's name for it
        """Returns where an object lies: a file for "mcap/…", a folder for "zarr/…".

        Raises:
            InputError: not an object's name.
            NotFoundError: it is not there; if gc deleted it, after which version.
        """
        try:
            return self.objects.existing(object)
        except NotFoundError as error:
            raise explain_missing(self, object, error) from None

    def record_place(self, object: str) -> Place:  # noqa: A002 — the catalog's name for it
        """Returns where `flagdata.record.Record.open` reads a record from: of a large one in a
        bucket the parts that are used.

        Raises:
            InputError, NotFoundError: as `object_path`.
        """
        try:
            return self.objects.readable(object)
        except NotFoundError as error:
            raise explain_missing(self, object, error) from None

    def openers(self, objects: Sequence[str]) -> tuple[Callable[[], Place], ...]:
        """Returns for each record a function that gives its place as `record_place` does, when it
        is needed; workers that read records take these with them.

        Raises:
            NotFoundError: as `object_path`.
        """
        try:
            return self.objects.openers(objects)
        except NotFoundError as error:
            name = next(name for name in objects if not self.objects.has(name))
            raise explain_missing(self, name, error) from None

    def whole_object(self, object: str) -> Path:  # noqa: A002 — the catalog's name for it
        """Returns where an object lies, once its bytes have been compared with its name.

        Raises:
            NotFoundError: as `object_path`.
            LinkError: it is, or holds, a link or special file.
            CorruptError: its bytes are not what its name says.
        """
        try:
            return self.objects.whole(object)
        except NotFoundError as error:
            raise explain_missing(self, object, error) from None

    def resolve(self, at: str | None) -> int:
        """Returns the Delta version a ref stands for (for a tag of a branch, the branch's).

        Raises:
            NotFoundError: no such ref.
        """
        return self.view(at)[0].version

    def tag(
        self, name: str, *, at: str | None = None, notes: Mapping[str, str] | None = None
    ) -> Ref:
        """Name what `at` shows, for good.

        Args:
            notes: what else is stated of it, by name.

        Raises:
            UsageError: a name that cannot be one.
            ConflictError: the name is taken, or was that of a tag that showed other artifacts; or
                some of the data went, with versions that expired or collected by gc.
        """
        return make_ref(self, "tags", name, at=at, notes=notes or {})

    def branch(self, name: str, *, at: str | None = None) -> Ref:
        """Begin a branch from what `at` shows, without what was erased since, which is on no
        branch.

        Raises:
            UsageError: a name that cannot be one.
            ConflictError: the name is taken; some of the data went, as for a tag, or were made from
                what was erased.
        """
        return make_ref(self, "branches", name, at=at, notes={})

    def delete_tag(self, name: str, message: str | None = None, *, discard: bool = False) -> int:
        """Delete a tag; the version that notes it. Its name never shows another version.

        Objects that only it showed stay for the grace period of garbage collection.

        Args:
            discard: also where it alone shows some rows.

        Raises:
            NotFoundError: no such tag.
            ConflictError: it alone shows some rows.
        """
        return delete_ref(self, "tags", name, message, discard=discard)

    def delete_branch(self, name: str, message: str | None = None, *, discard: bool = False) -> int:
        """Delete a branch; the version that takes its rows off. Tags, commits and branches made
        from it stay.

        Args:
            discard: also where it alone shows some rows.

        Raises:
            NotFoundError: no such branch.
            ConflictError: it alone shows some rows.
            UsageError: main.
        """
        return delete_ref(self, "branches", name, message, discard=discard)

    def merge(self, branch: str, message: str, *, into: str = MAIN) -> MergeResult:
        """Commit on `into` what `branch` changed since the two last had the same: its new rows
        come, rows that it withdrew go. Rows that `into` withdrew meanwhile stay withdrawn. See
        `flagdata.lake.merging`.

        Raises:
            NotFoundError: no such branch, or an object of a new row is missing.
            ConflictError: a row would lack what it was made from, which was withdrawn on the other
                branch.
            UsageError: no message, or a branch into itself.
        """
        return merge(self, branch, message, into=into)

    def withdraw(self, artifacts: Sequence[str], message: str, *, branch: str = MAIN) -> Withdrawal:
        """Take rows off a branch, in one commit; clips that are slices of a withdrawn recording go
        along with it.

        The branch that this one began from keeps showing its own; tags made before keep showing
        them. Their objects stay for as long as a tag or another branch needs them, and then for the
        grace period of garbage collection.

        Args:
            artifacts: full ids.

        Raises:
            NotFoundError: one that the branch does not show.
            ConflictError: a row that stays on the branch was made from one of them; see
                `descendants`.
        """
        return withdraw(self, artifacts, message, branch=branch)

    def erase(
        self, artifacts: Sequence[str], message: str, *, with_descendants: bool = False
    ) -> Erasure:
        """Take rows off every branch and delete their bytes at once, also where tags or older
        versions show them.

        Their rows stay in tags and in older versions, which say that the data were erased, and by
        which version.

        Args:
            artifacts: full ids.
            with_descendants: and all that was made from them, on any branch or tag.

        Raises:
            NotFoundError: one that no ref shows.
            ConflictError: a row that stays was made from one of them.
            CorruptError: a ref cannot be read, so that what other rows need is unknown; nothing was
                deleted.
        """
        return erase(self, artifacts, message, with_descendants=with_descendants)

    def label(
        self,
        artifacts: Sequence[str],
        values: Mapping[str, Value | None],
        message: str,
        *,
        branch: str = MAIN,
    ) -> tuple[int, frozenset[str]]:
        """Put the user's own values on artifacts, a recording's on its clips too: the version, and
        the ids of all.

        Args:
            artifacts: full ids.
            values: name → value; `None` takes one off.

        Raises:
            NotFoundError: one that the branch does not show.
            ConflictError: a name whose values on other artifacts are of another type.
        """
        return put(self, artifacts, values, message, branch=branch)

    def descendants(self, artifacts: Collection[str], *, at: str | None = None) -> frozenset[str]:
        """Ids of all rows at a ref that were made from `artifacts` (full ids), directly or not;
        without these."""
        return descendants(self.columns(self.view(at), ["artifact", "parents"]), artifacts)

    def unpublished_files(self) -> list[Place]:
        """Files that a process left which died while it wrote to the catalog or the refs, or made
        the lake."""
        return [*self.catalog.unpublished_files(), *scratch_files(self.path)]


@contextmanager
def _readable(marker: Place) -> Iterator[None]:
    """Turns what the system refuses, but that the marker is absent, into a clear error."""
    try:
        yield
    except (FileNotFoundError, NotADirectoryError):
        raise
    except OSError:
        with disk_errors("opening the lake", marker):
            raise


def _usable(path: Place | str) -> Place:
    try:
        location = lake_place(path)
        if isinstance(location, RemotePath):
            return location
        absolute = location.resolve()
    except (OSError, RuntimeError, ValueError) as error:  # links in a circle, a null byte
        raise UsageError(
            f"this is not a path: {error}", where=repr(str(path)), fix="name another folder"
        ) from None
    if _CONTROL.search(str(absolute)):
        raise UsageError(
            "the path of a lake cannot have a line break, a tab or another control character",
            where=printable(str(absolute)),
            fix="rename the folder",
        )
    if _UNUSABLE.search(str(absolute)):
        raise UsageError(
            "the path of a lake cannot have a backslash, or a byte that is not UTF-8",
            where=str(absolute).encode(errors="backslashreplace").decode(),
            fix="rename the folder",
        )
    if unquote(str(absolute)) != str(
        absolute
    ):  # deltalake 1.6 decodes such a path twice, and looks elsewhere
        raise UsageError(
            "the path of a lake cannot have a percent sign before two hexadecimal digits",
            where=str(absolute),
            fix="rename the folder",
        )
    return absolute
