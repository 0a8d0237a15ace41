"""The catalog: one Delta table, appended to under optimistic concurrency, every version readable for good.

Each append is one Parquet file and one log entry. The file is written and flushed to disk first; the log entry is put
only if its version number is free, so of two writers at the same version one wins and the other is told (`Moved`) and
looks again. The log is never expired: a tag must be readable for as long as the lake exists.

Small files are merged when `_MERGE_AT` of them have gathered, in a commit of its own that changes no row; the old files
stay, since old versions are made of them. (Each file costs a reader about 1 ms, a merge of 32 about 60 ms.) Delta's own
checkpoint, every 100 versions, bounds the log that must be replayed.
"""

from __future__ import annotations

import json
import os
import random
import time
import uuid
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import wraps
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import deltalake
import pyarrow as pa
import pyarrow.parquet as pq
from deltalake import CommitProperties, DeltaTable, PostCommitHookProperties
from deltalake.exceptions import CommitFailedError, DeltaError, TableNotFoundError
from deltalake.transaction import AddAction, RemoveAction

from flagdata.errors import ConflictError, CorruptError, FlagdataError, NotFoundError
from flagdata.lake.durable import flush_file, flush_folder
from flagdata.schema import CATALOG, FORMAT_VERSION, catalog_schema

P = ParamSpec("P")
T = TypeVar("T")

_CONFIGURATION = {
    "delta.enableExpiredLogCleanup": "false",
    "delta.logRetentionDuration": "interval 36500 days",
}
_INFO_PREFIX = "flagdata."
_LOG_NAME = "{:020d}.json"
_MERGE_AT = 32
_SMALL = 4 << 20  # B
_PATIENCE = 120.0  # s, how long a commit competes with other writers before it gives up
_FIRST_WAIT = 0.01  # s
_LONGEST_WAIT = 0.5  # s
_user_pid: int | None = None


class Moved(Exception):  # noqa: N818 — an outcome to act on, never shown to a user
    """Another writer has published since the version the append was based on."""


def _in_one_process(function: Callable[P, T]) -> Callable[P, T]:
    """Refuses the Delta library in a forked child of a process that used it: it would hang or crash there."""

    @wraps(function)
    def guarded(*args: P.args, **kwargs: P.kwargs) -> T:
        global _user_pid
        if _user_pid is None:
            _user_pid = os.getpid()
        elif _user_pid != os.getpid():
            raise FlagdataError(
                "the catalog was used before this process was forked, and cannot be used in the child",
                where=f"process {os.getpid()}",
                fix="resolve the query in the parent, or start workers by spawn",
            )
        return function(*args, **kwargs)

    return guarded


def persist(attempt: Callable[[], T], *, where: Path) -> T:
    """Run `attempt` until it does not raise `Moved`, with random waits that grow.

    Raises:
        ConflictError: after two minutes of others always being faster.
    """
    deadline = time.monotonic() + _PATIENCE
    wait = _FIRST_WAIT
    while True:
        try:
            return attempt()
        except Moved:
            if time.monotonic() > deadline:
                raise ConflictError(
                    f"other processes kept committing for {_PATIENCE:.0f} s", where=str(where), fix="try again"
                ) from None
            time.sleep(random.uniform(0, wait))
            wait = min(2 * wait, _LONGEST_WAIT)


class Catalog:
    """The Delta table under `path`; holds no open files. Rows are ordered by commit, then start, then frame."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._log = path / "_delta_log"
        self._newest = 0
        self._last_read: tuple[int, pa.Table] | None = None

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_last_read": None}

    @_in_one_process
    def create(self, info: Mapping[str, str]) -> None:
        """Make the empty table."""
        DeltaTable.create(
            str(self.path),
            catalog_schema(),
            mode="error",
            configuration=_CONFIGURATION,
            commit_properties=_properties(info),
        )
        self._flush_log(0)

    def head(self) -> int:
        """The newest version; they have no holes and never expire, so it is enough to look for the next.

        Raises:
            CorruptError: there is no log.
        """
        version = max(self._newest, self._checkpoint())
        if not (self._log / _LOG_NAME.format(version)).exists():
            raise CorruptError("the catalog's log is gone", where=str(self._log), fix="restore it from a copy")
        while (self._log / _LOG_NAME.format(version + 1)).exists():
            version += 1
        self._newest = version
        return version

    @_in_one_process
    def rows(self, version: int) -> pa.Table:
        """All rows of one version, of all branches, in the catalog's schema; absent columns of old rows are null.

        Raises:
            NotFoundError: no such version.
            ConflictError: written by a newer format.
            CorruptError: the log or a file of the table cannot be read.
        """
        if self._last_read is not None and self._last_read[0] == version:
            return self._last_read[1]
        table = self._conform(self._read(self._open(version)))
        order = [(name, "ascending") for name in ("created", "start", "frame_first", "artifact")]
        table = table.sort_by(order)
        self._last_read = (version, table)
        return table

    @_in_one_process
    def append(self, rows: pa.Table, *, base: int, info: Mapping[str, str]) -> int:
        """Publish `rows` as version `base + 1`; durable when it returns.

        Raises:
            Moved: `base` is no longer the newest version; nothing was published.
        """
        table = self._writable(base)
        self._commit(table, rows, removed=(), rows_change=True, info=info)
        return base + 1

    @_in_one_process
    def replace(self, rows: pa.Table, *, base: int, info: Mapping[str, str]) -> int:
        """Publish `rows` as all there is at version `base + 1`; earlier versions stay.

        Raises:
            Moved: `base` is no longer the newest version; nothing was published.
        """
        table = self._writable(base)
        files = pa.table(table.get_add_actions(flatten=True))["path"].to_pylist()
        self._commit(table, rows, removed=files, rows_change=True, info=info)
        return base + 1

    @_in_one_process
    def merge_small_files(self) -> None:
        """Rewrite the small files as one if there are many; left to the next commit if another writer comes between."""
        table = self._open(self.head())
        files = pa.table(table.get_add_actions(flatten=True)).select(["path", "size_bytes"]).to_pylist()
        small = [f["path"] for f in files if f["size_bytes"] < _SMALL]
        if len(small) < _MERGE_AT:
            return
        rows = pa.concat_tables(self._conform(pq.read_table(self.path / name)) for name in small)
        info = {"message": f"merge {len(small)} files of the catalog; no row changed"}
        with suppress(Moved):
            self._commit(table, rows, removed=small, rows_change=False, info=info)

    def untracked_files(self) -> list[Path]:
        """Parquet files that no version refers to: written by a process that died before, or lost, its commit."""
        tracked = set()
        for entry in self._log.glob("*.json"):
            for line in entry.read_text().splitlines():
                added = json.loads(line).get("add")
                if added is not None:
                    tracked.add(added["path"])
        return sorted(path for path in self.path.glob("*.parquet") if path.name not in tracked)

    @_in_one_process
    def history(self, limit: int | None = None) -> list[dict[str, Any]]:
        """One entry a version, newest first: version, timestamp (UTC ms), operation and what the writer said of it.

        Args:
            limit: the newest so many; all if `None`.
        """
        return [
            {
                "version": entry["version"],
                "timestamp": entry["timestamp"],
                "operation": entry["operation"],
                **{k.removeprefix(_INFO_PREFIX): v for k, v in entry.items() if k.startswith(_INFO_PREFIX)},
            }
            for entry in self._open(None).history(limit)
        ]

    def _commit(
        self, table: DeltaTable, rows: pa.Table, *, removed: Sequence[str], rows_change: bool, info: Mapping[str, str]
    ) -> None:
        version = table.version() + 1
        path = self.path / f"{uuid.uuid4().hex}.parquet"
        pq.write_table(rows, path, compression="zstd")
        flush_file(path)
        flush_folder(self.path)
        now = time.time_ns() // 1_000_000
        added = AddAction(
            path=path.name,
            size=path.stat().st_size,
            partition_values={},
            modification_time=now,
            data_change=rows_change,
            stats=json.dumps({"numRecords": rows.num_rows}),
        )
        dropped = [RemoveAction(path=name, data_change=rows_change, deletion_timestamp=now) for name in removed]
        try:
            table.create_write_transaction(
                [added, *dropped],
                "append",
                table.schema(),
                commit_properties=_properties(info),
                post_commithook_properties=_HOOKS,
            )
        except CommitFailedError:
            path.unlink()
            raise Moved from None
        self._flush_log(version)

    def _checkpoint(self) -> int:
        try:
            return int(json.loads((self._log / "_last_checkpoint").read_text())["version"])
        except FileNotFoundError:
            return 0

    def _open(self, version: int | None) -> DeltaTable:
        try:
            return DeltaTable(str(self.path), version=version)
        except TableNotFoundError:
            raise CorruptError("the catalog is gone", where=str(self.path), fix="restore it from a copy") from None
        except DeltaError as error:
            if version is not None and version > self.head():
                raise NotFoundError(
                    f"there is no version {version}", where=str(self.path), fix=f"the newest is {self.head()}"
                ) from None
            raise CorruptError(
                f"the catalog's log cannot be read: {error}", where=str(self.path), fix="run flagdata doctor"
            ) from None

    def _writable(self, version: int) -> DeltaTable:
        """The table at `version`, if it has all columns of this format; else they are added, and `Moved` is raised."""
        table = self._open(version)
        present = {field.name for field in table.schema().fields}
        missing = [name for name in CATALOG if name not in present]
        if missing:
            self._evolve(table, missing)
            raise Moved
        return table

    def _read(self, table: DeltaTable) -> pa.Table:
        try:
            return table.to_pyarrow_dataset().to_table()
        except (OSError, pa.ArrowException) as error:
            raise CorruptError(
                f"a file of the catalog cannot be read: {error}", where=str(self.path), fix="restore it from a copy"
            ) from None

    def _conform(self, table: pa.Table) -> pa.Table:
        unknown = [name for name in table.column_names if name not in CATALOG]
        if unknown:
            raise newer(f"it has the columns {', '.join(unknown)}", self.path)
        schema = catalog_schema()
        columns = [
            table[f.name].cast(f.type) if f.name in table.column_names else pa.nulls(table.num_rows, f.type)
            for f in schema
        ]
        return pa.Table.from_arrays(columns, schema=schema)

    def _evolve(self, table: DeltaTable, missing: Sequence[str]) -> None:
        schema = catalog_schema()
        fields = [deltalake.Field.from_arrow(schema.field(name).with_nullable(True)) for name in missing]
        try:
            table.alter.add_columns(
                fields, commit_properties=_properties({"message": f"format {FORMAT_VERSION}: {', '.join(missing)}"})
            )
        except CommitFailedError:
            raise Moved from None

    def _flush_log(self, version: int) -> None:
        flush_file(self._log / _LOG_NAME.format(version))
        flush_folder(self._log)


_HOOKS = PostCommitHookProperties(create_checkpoint=True, cleanup_expired_logs=False)


def _properties(info: Mapping[str, str]) -> CommitProperties:
    return CommitProperties(
        custom_metadata={f"{_INFO_PREFIX}{key}": value for key, value in info.items()}, max_commit_retries=0
    )


def newer(why: str, where: Path) -> ConflictError:
    """The error for a lake of a later format."""
    return ConflictError(
        f"the lake was written by a newer flagdata than this one, which reads formats up to {FORMAT_VERSION}: {why}",
        where=str(where),
        fix="install the newer flagdata",
    )
