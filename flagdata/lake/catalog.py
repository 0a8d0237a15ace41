"""The catalog: one Delta table, appended to under optimistic concurrency, every version readable
for good.

Each append is one Parquet file and one log entry. The file is written and flushed to disk first;
the log entry is put only if its version number is free, so of two writers at the same version one
wins and the other gets `Moved` and looks again. The log is never expired: a tag must be readable
for as long as the lake exists.

After every `_TIDY_EVERY` versions the small files are merged, in a commit of its own that changes
no row; a checkpoint is written, which bounds the log that must be replayed, and a summary of what
the log states. The old files stay, since old versions are made of them. (Each file costs a fresh
reader about 1 ms; tidying takes about 0.1 s, so some 3 ms a commit.) The library's own checkpoints
are off: it does not flush them to the disk, so a power cut could leave one that is empty and a
table that does not open.

Each commit notes the SHA-256 of its file, which is compared whenever the file is read.
"""

from __future__ import annotations

import hashlib
import json
import tempfile
import threading
import time
import uuid
from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from pathlib import Path
from typing import Any, Concatenate, ParamSpec, TypeVar

import deltalake
import pyarrow as pa
import pyarrow.compute as pc
from deltalake import CommitProperties, DeltaTable
from deltalake.exceptions import CommitFailedError, DeltaError

from flagdata.core.files.durable import (
    confirming,
    flush_file,
    flush_folder,
    put_if_absent,
    write_durably,
)
from flagdata.core.files.regular_files import is_beside, open_regular
from flagdata.core.provenance import file_hash
from flagdata.core.schema import CATALOG, FORMAT_VERSION, catalog_schema
from flagdata.errors import ConflictError, CorruptError
from flagdata.lake.attempts import Looks, Moved
from flagdata.lake.catalog_log_errors import DELETE_HINTS, HINT, LogErrors, newer
from flagdata.lake.delta_log import (
    CHECKPOINT,
    FILE_HASH,
    PREVIOUS_HASH,
    Entry,
    Log,
    is_stated,
)
from flagdata.lake.log_summaries import Summaries
from flagdata.lake.rowfiles import RowFiles, Scan, changed_file, encode_rows
from flagdata.storage import Place
from flagdata.storage.forks import OneProcess

P = ParamSpec("P")
T = TypeVar("T")

# neither this package nor another's VACUUM may take what an old version is made of
_CONFIGURATION = {
    "delta.enableExpiredLogCleanup": "false",
    "delta.deletedFileRetentionDuration": "interval 36500 days",
    "delta.logRetentionDuration": "interval 36500 days",
}
_INFO_PREFIX = "flagdata."
_TIDY_EVERY = 32
_SMALL = 4 << 20  # B
_LISTED = 8  # versions whose files are kept in mind
_PROCESS = OneProcess(
    "the catalog", fix="resolve the query in the parent, or start workers by spawn"
)


def _one_at_a_time(
    method: Callable[Concatenate[Catalog, P], T],
) -> Callable[Concatenate[Catalog, P], T]:
    """Keeps other threads out of the catalog, and the Delta library out of forked children, where
    it would hang."""

    @wraps(method)
    def call_alone(self: Catalog, *args: P.args, **kwargs: P.kwargs) -> T:
        _PROCESS.check()
        with self._lock:
            return method(self, *args, **kwargs)

    return call_alone


class Catalog:
    """The Delta table under `path`; holds no open files. Rows are ordered by commit, then start,
    then frame.

    `marks` is the folder where the newest version is noted, see `flagdata.lake.delta_log`.
    """

    def __init__(self, path: Place, marks: Place) -> None:
        self.path = path
        self._marks = marks
        self._log = path / "_delta_log"
        self._entries = Log(self._log, marks)
        self._errors = LogErrors(path=path, log=self._log, entries=self._entries)
        self._summaries = Summaries(marks.parent / "history", self._entries)
        self._lock = threading.RLock()
        self.looks = Looks()
        self._table: DeltaTable | None = None
        self._files = RowFiles(path, self._noted_hashes)
        self._hashes: dict[str, frozenset[str]] = {}
        self._rows: tuple[int, pa.Table] | None = None
        self._listed: dict[int, list[str]] = {}
        self._history: tuple[int, list[dict[str, Any]]] | None = None

    def __reduce__(self) -> tuple[type[Catalog], tuple[Place, Place]]:
        return (Catalog, (self.path, self._marks))

    @_one_at_a_time
    def create(self, info: Mapping[str, str]) -> None:
        """Make the empty table.

        Raises:
            ConflictError: there is one.
            OSError: what the disk refused.
        """
        # In a scratch folder: the Delta library takes a put whose answer was lost for one that
        # another made before it.
        with tempfile.TemporaryDirectory() as folder:
            try:
                DeltaTable.create(
                    folder,
                    catalog_schema(),
                    mode="error",
                    configuration=_CONFIGURATION,
                    commit_properties=_properties(info),
                )
            except DeltaError as error:
                raise self._errors.refusal_of(error) from None
            entry = (Path(folder) / "_delta_log" / self._entries.path(0).name).read_bytes()
        if not self._entries.adopt(0, entry):
            raise ConflictError(
                "another process is making a lake there", where=str(self.path), fix="open that one"
            )
        self._flush_log(0)

    @_one_at_a_time
    def head(self) -> int:
        """Finds the newest version.

        Raises:
            LogGapError: an entry of the log, or all of it, is missing.
        """
        return self.looks.find("head", self._entries.head)

    @_one_at_a_time
    def rows(self, version: int) -> pa.Table:
        """Reads all rows of one version, of all branches, see `RowFiles.table`.

        Args:
            version: at most `head()`.

        Raises:
            ConflictError: written by a newer format.
            CorruptError: the log or a file of the table cannot be read.
        """
        if self._rows is not None and self._rows[0] == version:
            return self._rows[1]
        rows = self._files.table(self._names(version))
        self._rows = (version, rows)
        return rows

    @_one_at_a_time
    def scan(self, version: int) -> Scan | None:
        """Opens the same rows, to be decoded as they are asked for, see `RowFiles.scan`.

        Raises:
            ConflictError, CorruptError: as `rows`.
        """
        return self._files.scan(self._names(version))

    @_one_at_a_time
    def objects(self) -> frozenset[str]:
        """Names of the objects that rows of any version point to.

        Raises:
            CorruptError: the log or a file of the table cannot be read.
        """
        return frozenset(self._files.objects(self._entries.files()))

    @_one_at_a_time
    def append(self, rows: pa.Table, *, base: int, info: Mapping[str, str]) -> int:
        """Publish `rows`, if any, as version `base + 1`; durable when it returns, or a warning says
        that it may not be.

        Raises:
            Moved: `base` is no longer the newest version; nothing was published.
        """
        table = self._writable(base)
        self._commit(table, rows, removed=(), rows_change=True, info=info)
        return base + 1

    @_one_at_a_time
    def drop(
        self, going: pc.Expression, *, fresh: pa.Table, base: int, info: Mapping[str, str]
    ) -> int:
        """Publish version `base + 1` without the rows that meet a condition on ids and branches,
        and with `fresh` ones.

        The files that have such rows are written anew without them; earlier versions keep theirs.

        Raises:
            Moved: `base` is no longer the newest version; nothing was published.
        """
        table = self._writable(base)
        files = self._files.holding(self._names(base), going)
        staying = [self._files.read(name).filter(~going) for name in files]
        self._commit(
            table, pa.concat_tables([*staying, fresh]), removed=files, rows_change=True, info=info
        )
        return base + 1

    def entry(self, version: int) -> tuple[bytes, dict[str, Place]]:
        """Reads a version's entry of the log, and where the files are that it adds, by name.

        Raises:
            CorruptError: it cannot be read.
        """
        entry, files = self._entries.entry(version)
        return entry, {name: self.path / name for name in files}

    def adopt(self, version: int, entry: bytes, files: Mapping[str, Place]) -> None:
        """Publish a version of another lake, whose versions before are this one's; what is there
        stays.

        Raises:
            ConflictError: another version of that number is there.
        """
        noted = self._entries.noted_of(version, entry)
        for name, file in files.items():
            with open_regular(file) as stream:
                content = stream.read()
            if noted is not None and hashlib.sha256(content).hexdigest() != noted:
                raise changed_file(file)
            put_if_absent(self.path / name, content)
        self.looks.forget()
        if not self._entries.adopt(version, entry):
            raise ConflictError(
                f"version {version} was committed here by another",
                where=str(self.path),
                fix="try again",
            )

    def written(self, version: int) -> float:
        """Returns when a version's entry was put here, by the clock of the disk or store [s since
        1970]."""
        return self._entries.path(version).stat().st_mtime

    def check_entries(self, first: int) -> None:
        """Checks whether the entries from a version on are those that were written.

        Raises:
            CorruptError: one has changed, or cannot be read.
        """
        head = self.head()
        self._entries.entries(range(first, head + 1), head=head)

    def acknowledge(self, version: int) -> None:
        """Notes that a version that was adopted, and those before it, are there for good."""
        self._entries.acknowledge(version)

    def renew_mark(self) -> bool:
        """Note the newest version as acknowledged where the note of it is lost; False where it is
        there.

        Raises:
            OSError: what the disk refused.
        """
        if self._entries.acknowledged() >= 0:
            return False
        self._flush_log(self.head())
        return True

    def is_due_for_tidying(self) -> bool:
        """Checks whether `tidy` would do anything: `_TIDY_EVERY` versions after it last did."""
        return self.head() - self._checkpoint() >= _TIDY_EVERY

    @_one_at_a_time
    def tidy(self) -> None:
        """Summarise the log and merge the small files, if it is due; called before a commit.

        Raises:
            Moved: another writer intervened; the small files are left to the next time.
        """
        if not self.is_due_for_tidying():
            return
        version = self.head()
        table = self._writable(version)
        self.summarise()
        small = [
            name for name in self._names(version) if (self.path / name).stat().st_size < _SMALL
        ]
        if len(small) > 1:
            rows = pa.concat_tables(self._files.read(name) for name in small)
            info = {"message": f"merge {len(small)} files of the catalog; no row changed"}
            self._commit(table, rows, removed=small, rows_change=False, info=info)

    @_one_at_a_time
    def summarise(self) -> None:
        """Write a checkpoint and a summary of the log, if that is due; no version is added."""
        if not self.is_due_for_tidying():
            return
        version = self.head()
        try:
            self._open(version).create_checkpoint()
        except DeltaError as error:
            raise self._errors.refusal_of(error) from None
        if isinstance(self._log, Path):
            flush_file(self._log / f"{version:020d}{CHECKPOINT}")
            if (hint := self._log / HINT).exists():
                flush_file(hint)
            flush_folder(self._log)
        checkpoint_hash = file_hash(self._log / f"{version:020d}{CHECKPOINT}")
        self._summaries.extend(self.history()[::-1], checkpoint=checkpoint_hash)

    def unpublished_files(self) -> Sequence[Place]:
        """Lists what processes left that died before, or while, they put their log entry: no
        version refers to it.

        Raises:
            CorruptError: a log entry that cannot be read.
        """
        tracked = self._entries.files()
        rows = [
            path
            for path in self.path.glob("*.parquet")
            if path.name not in tracked and not is_beside(path.name)
        ]
        entries = self._log.glob(
            "*#*"
        )  # the Delta library's own name for an entry it has not linked yet
        return sorted([*rows, *entries])  # type: ignore[type-var]

    def file_hashes(self) -> dict[Place, str | None]:
        """Maps each file that some version is made of to its SHA-256 when it was written, `None` if
        that was not noted.

        Raises:
            CorruptError: a log entry that cannot be read.
        """
        return {self.path / name: digest for name, digest in self._entries.files().items()}

    def changed_entries(self) -> list[Place]:
        """Entries of the log whose bytes are not those that were committed, as far as that was
        noted.

        Raises:
            CorruptError: a log entry that cannot be read.
        """
        return self._entries.changed_entries()

    @_one_at_a_time
    def history(self, limit: int | None = None) -> list[dict[str, Any]]:
        """Lists one entry a version, newest first: version, timestamp (UTC ms), operation, what the
        writer said of it.

        Args:
            limit: the newest so many; all if `None`.

        Raises:
            CorruptError: an entry of the log that cannot be read, or that no writer of a catalog
                writes.
        """
        head = self.head()
        cached = self._history
        if cached is None or cached[0] > head:
            summarised = self._summaries.read(head)
            cached = (len(summarised) - 1, [dict(version) for version in reversed(summarised)])
        # Entries never change, so that a process reads each once: in a bucket each is a request.
        unread = range(cached[0] + 1, head + 1)
        later = map(self._version_entry, unread, self._entries.entries(unread, head=head))
        self._history = (head, [*reversed([*later]), *cached[1]])
        return self._history[1][:limit]

    def _version_entry(self, version: int, entry: Entry) -> dict[str, Any]:
        """Returns what the log says of a version."""
        info = {
            k.removeprefix(_INFO_PREFIX): v
            for k, v in entry.info.items()
            if k.startswith(_INFO_PREFIX)
        }
        message = {key: entry.info.get(key) for key in ("timestamp", "operation")}
        version_facts = {"version": version, **message, **info, "files": list(entry.files)}
        if not is_stated(version_facts, version):
            raise self._entries.damaged(version)
        return version_facts

    def _noted_hashes(self, name: str) -> frozenset[str]:
        """Returns the SHA-256 of a file as its commit noted it; nothing where it noted none. Of one
        whose commit is known from a summary without names of files, those of all such commits."""
        if name not in self._hashes:
            noted: dict[str, frozenset[str]] = {}
            unnamed: set[str] = set()
            complete = True
            for version in self.history():
                file_sha = version.get(_FILE_HASH)
                if "files" in version:
                    noted |= dict.fromkeys(
                        version["files"], frozenset({file_sha} if file_sha else ())
                    )
                elif file_sha:
                    unnamed.add(file_sha)
                else:
                    complete &= version["operation"] != "WRITE"
            self._hashes = {name: frozenset(unnamed if complete else ()), **noted}
        return self._hashes[name]

    def _commit(
        self,
        table: DeltaTable,
        rows: pa.Table,
        *,
        removed: Sequence[str],
        rows_change: bool,
        info: Mapping[str, str],
    ) -> None:
        version = table.version() + 1
        if (protocol := table.protocol()).min_writer_version > _WRITER:
            raise newer(
                f"writing to it takes version {protocol.min_writer_version} of Delta's protocol",
                self.path,
            )
        now = time.time_ns() // 1_000_000
        path = self.path / f"{uuid.uuid4().hex}.parquet"
        added, hashes = [], {}
        if rows.num_rows or removed:  # a commit of notes alone needs no file
            content = encode_rows(rows)
            write_durably(path, content)
            hashes = {FILE_HASH: hashlib.sha256(content).hexdigest()}
            stats = json.dumps({"numRecords": rows.num_rows})
            facts = {
                "size": len(content),
                "modificationTime": now,
                "dataChange": rows_change,
                "stats": stats,
            }
            added = [{"add": {"path": path.name, "partitionValues": {}, **facts}}]
        written = {
            "timestamp": now,
            "operation": "WRITE",
            "operationParameters": {"mode": "Append", "partitionBy": "[]"},
            "engineInfo": "flagdata",
            **{f"{_INFO_PREFIX}{key}": value for key, value in info.items()},
            **hashes,
            PREVIOUS_HASH: self._entries.hash(version - 1),
        }
        dropped = [
            {"path": name, "dataChange": rows_change, "deletionTimestamp": now} for name in removed
        ]
        # Not by the Delta library, which reads the log again after it has put the entry, and may
        # fail then.
        actions = [{"commitInfo": written}, *added, *({"remove": action} for action in dropped)]
        self.looks.forget()
        if not self._entries.put(version, actions):
            path.unlink(missing_ok=True)
            raise Moved
        with confirming(f"version {version}", self._entries.path(version)):
            self._entries.acknowledge(version)

    def _checkpoint(self) -> int:
        """Finds the newest checkpoint's version, by file names: a process may die before
        `_last_checkpoint` is written."""
        return max(self._entries.checkpoints(), default=0)

    def _check_read(self, version: int) -> None:
        """Compares what the Delta library reads for a version with what was noted of it: the newest
        checkpoint up to it, and the entries after that. Those that no summary covers were compared
        when the history was read."""
        newest = max(
            (number for number in self._entries.checkpoints() if number <= version), default=-1
        )
        checkpoint = self._log / f"{newest:020d}{CHECKPOINT}"
        for log_file in (self._log / HINT, checkpoint):
            if (
                isinstance(log_file, Path) and log_file.exists() and not log_file.is_file()
            ):  # of a pipe it would wait for ever
                message = f"{log_file.name} of the catalog's log is no regular file"
                raise CorruptError(message, where=str(log_file), fix=DELETE_HINTS)
        noted = self._summaries.checkpoints.get(newest)
        if noted is not None and file_hash(checkpoint) != noted:
            message = "a checkpoint of the catalog's log has changed since it was written"
            raise CorruptError(message, where=str(checkpoint), fix=DELETE_HINTS)
        if newest + 1 < self._summaries.covered:
            history = self.history()
            *_, last = self._entries.entries(
                range(newest + 1, version + 1), head=history[0]["version"]
            ) or [None]
            following = (
                history[-2 - version] if last is not None and version + 1 < len(history) else {}
            )
            if last is not None and following.get(_PREVIOUS_HASH, last.hash) != last.hash:
                raise self._entries.disagreeing(version, self._entries.path(version + 1))

    def _open(self, version: int) -> DeltaTable:
        newest = self.history(1)[0]["version"] if self._history is None else self._history[0]
        if version > newest and version > self.head():
            raise CorruptError(
                f"version {version} is named, but the newest is {self.head()}",
                where=str(self.path),
                fix="run flagdata doctor: it lists the refs that cannot be read",
            )
        with self._errors.of_version(version):
            table = self._table = self._errors.repeat_reading(lambda: self._at(version))
        unknown = [f.name for f in table.schema().fields if f.name not in CATALOG]
        if unknown:
            raise newer(f"the catalog has the columns {', '.join(unknown)}", self.path)
        return table

    def _at(self, version: int) -> DeltaTable:
        table = self._table
        if table is None or table.version() != version:
            self._check_read(version)
        if table is not None and table.version() < version:
            table.update_incremental()
        if table is None or table.version() != version:
            table = DeltaTable(
                self.path.as_uri(), version=version, storage_options=self._errors.options
            )
        return table

    def _names(self, version: int) -> list[str]:
        """Lists the files of a version, which never change; those of the versions that were asked
        for last are kept."""
        if version not in self._listed:
            table = self._open(version)
            with self._errors.of_version(version):
                names = [Path(uri).name for uri in table.file_uris()]
            self._listed = {**dict(list(self._listed.items())[1 - _LISTED :]), version: names}
        return self._listed[version]

    def _writable(self, version: int) -> DeltaTable:
        """Opens the table at `version`, if it has all columns of this format; else adds them and
        raises `Moved`."""
        table = self._open(version)
        present = {field.name for field in table.schema().fields}
        missing = [name for name in CATALOG if name not in present]
        if missing:
            self._evolve(table, missing)
            raise Moved
        return table

    def _evolve(self, table: DeltaTable, missing: Sequence[str]) -> None:
        schema = catalog_schema()
        fields = [
            deltalake.Field.from_arrow(schema.field(name).with_nullable(True)) for name in missing
        ]
        version = table.version() + 1
        self.looks.forget()
        try:
            table.alter.add_columns(
                fields,
                commit_properties=_properties(
                    {"message": f"format {FORMAT_VERSION}: {', '.join(missing)}"}
                ),
            )
        except CommitFailedError:
            raise Moved from None
        except DeltaError as error:
            raise self._errors.refusal_of(error) from None
        self._flush_log(version)

    def _flush_log(self, version: int) -> None:
        if isinstance(self._log, Path):
            flush_file(self._log / self._entries.path(version).name)
            flush_folder(self._log)
        self._entries.acknowledge(version)


_FILE_HASH, _PREVIOUS_HASH = (key.removeprefix(_INFO_PREFIX) for key in (FILE_HASH, PREVIOUS_HASH))
_WRITER = 2
"""Version of Delta's protocol that tables of this package ask of writers; a later one has duties
unknown here."""


def _properties(info: Mapping[str, str]) -> CommitProperties:
    return CommitProperties(
        custom_metadata={f"{_INFO_PREFIX}{key}": value for key, value in info.items()},
        max_commit_retries=0,
    )
