"""A transaction: objects put first, rows collected, one Delta append publishes them all or nothing.

What was published is read from the transaction's result, which was complete before publication: a
disk that refuses to be read afterwards changes no answer.
"""

from __future__ import annotations

import secrets
import uuid
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType

import pyarrow as pa

from flagdata.core.files.durable import disk_errors
from flagdata.core.provenance import code_version
from flagdata.core.schema import catalog_schema
from flagdata.errors import ConflictError, FlagdataError, NotFoundError, UsageError
from flagdata.lake.artifact import Artifact
from flagdata.lake.attempts import persist
from flagdata.lake.commits import Change, commit
from flagdata.lake.deposit import Deposit, copy_object
from flagdata.lake.leases import Lease
from flagdata.lake.refs import Slice
from flagdata.lake.remaking import Remade, describe_remade
from flagdata.lake.store import Store


@dataclass(frozen=True, kw_only=True)
class CommitResult:
    """What a transaction did.

    Attributes:
        version: of the table after it; the head it found when there was nothing new.
        commit: commit id, `None` when there was nothing new.
        added: ids of rows it published, in order.
        existing: ids that were on the branch already, so nothing was published for them.
        artifacts: all of these by id, as the branch has them; none of it is read after publication.
        healed: of the existing ones, by id, those whose object was damaged or missing, and is not
            any more.
    """

    version: int
    commit: str | None
    added: tuple[str, ...]
    existing: tuple[str, ...]
    artifacts: Mapping[str, Artifact] = field(default_factory=dict)
    healed: Mapping[str, Remade] = field(default_factory=dict)


class Transaction:
    """Made by `Lake.transaction`; use it as a context manager.

    Order of events, each durable before the next: objects are written in staging, flushed, and
    renamed to their content hash (`put`); leaving the block writes all rows as one Parquet file and
    puts one log entry. A crash before that leaves only what nothing refers to. *Acknowledged means
    that the with-block was left without an exception*: a process that dies during the commit may or
    may not have published, and finds out by ingesting again.

    Idempotence holds in a race too: an append is accepted only at the version whose identities were
    checked. When two processes add the same identity at once, one publishes it; the other is
    refused, looks again, and reports it as existing. No reader ever sees an identity twice on one
    branch.

    Where the branch has an identity whose object is damaged or missing, what was put for it takes
    its place, see `flagdata.lake.remaking`.

    Raises:
        UsageError: no message; or anything but `result` used outside the block.
    """

    def __init__(self, lake: Store, message: str, *, branch: str) -> None:
        if not message.strip():
            raise UsageError(
                "the commit has no message", fix="say in a few words what it brings in"
            )
        self.branch = branch
        self.message = message
        self._result: CommitResult | None = None
        self._lake = lake
        self._known: frozenset[str] = frozenset()
        self._seen: int | None = None  # the head that these are of
        self._pending: dict[str, Artifact] = {}
        self._existing: dict[str, None] = {}
        self._fresh: set[str] = (
            set()
        )  # objects that were not there, or damaged, before they were put
        self._restored: dict[
            str, str
        ] = {}  # id of an existing artifact whose object was put back → that
        self._moved: dict[
            str, tuple[str, Artifact]
        ] = {}  # id of one that has another object now → the one before, row
        self._sizes: dict[str, int] = {}  # of the objects that the lease holds
        self._held: Lease | None = None

    def __enter__(self) -> Transaction:
        self._lake.check_writable()
        self._look()
        with disk_errors("starting a transaction", self._lake.staging):
            self._held = Lease(self._lake.staging)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        lease = self._lease
        try:
            if kind is None:
                self._commit()
        finally:
            self._held = None
            with suppress(OSError, FlagdataError):  # what is left is a collection's
                lease.close()

    @property
    def result(self) -> CommitResult:
        """What it did.

        Raises:
            UsageError: its block has not ended, or was left by an exception.
        """
        if self._result is None:
            raise UsageError(
                "the transaction has not committed", fix="ask for its result after its with-block"
            )
        return self._result

    def _commit(self) -> None:
        """Publish; once that is done no error of the disk is one of this transaction.

        Raises:
            FlagdataError: no space, no permission; nothing was published.
        """
        with disk_errors("committing", self._lake.catalog.path):
            try:
                self._result = self._publish()
                self._result = replace(self._result, healed=self._heal_rows())
            except (OSError, FlagdataError):
                if self._result is None:
                    raise

    def _heal_rows(self) -> dict[str, Remade]:
        objects = {identity: (name, name) for identity, name in self._restored.items()}
        objects |= {
            identity: (before, str(row.object)) for identity, (before, row) in self._moved.items()
        }
        remade = {
            pair: describe_remade(self._lake, before=pair[0], now=pair[1])
            for pair in set(objects.values())
        }
        return {identity: remade[pair] for identity, pair in objects.items()}

    def staging(self, suffix: str) -> Path:
        """Returns a fresh path with `suffix` (".mcap", ".zarr", ".model"), nothing at it yet;
        removed with the transaction."""
        return self._lease.folder / f"{uuid.uuid4().hex}{suffix}"

    def put(self, path: Path) -> str:
        """Store a finished .mcap file or a folder (Zarr, model) for good, and return its object
        name.

        What lies in this transaction's staging is moved, anything else copied. Content that is
        stored already is kept once.

        Raises:
            InputError: neither an .mcap file nor a folder of plain files, or empty.
            FlagdataError: no space, no permission.
        """
        lease = self._lease
        with disk_errors("storing an object", path):
            if lease.folder not in path.parents:
                path = self._copy(path)
            name = self._lake.objects.name_of(path)
            lease.hold(name)
            if self._lake.objects.publish(
                path, name
            ):  # a collection leaves alone what a lease holds
                self._fresh.add(name)
            self._sizes[name] = self._lake.objects.size(name)
        return name

    def hold(self, name: str) -> int:
        """Relies on an object that is stored and returns its size [B]. No collection takes it
        before the transaction ends.

        Raises:
            NotFoundError: it is not there.
        """
        return self._sizes[name] if name in self._sizes else self._hold(name)

    def rely(self, deposit: Deposit) -> str:
        """Takes over an object that another process has put into the store, as if it had been put
        here, and returns its name.

        Raises:
            NotFoundError: it is not there.
        """
        self.hold(deposit.name)
        if deposit.fresh:
            self._fresh.add(deposit.name)
        return deposit.name

    @contextmanager
    def keeping_collectors_out(self) -> Iterator[None]:
        """Keeps collections from running during the block, and anybody from taking this process for
        dead as it begins."""
        with self._lease.keeping_collectors_out() as check:
            check()
            yield

    def add(self, artifact: Artifact) -> bool:
        """Publish a row with this transaction; False when its identity is on the branch, or in this
        transaction.

        `branch`, `created` and `object_bytes` are filled in.

        Raises:
            NotFoundError: its object was not put, or a parent is neither on the branch nor in this
                transaction.
        """
        identity = artifact.id
        if identity in self._pending:
            return False
        if identity in self._known:
            self._existing.setdefault(identity)
            self._heal(identity, artifact)
            return False
        size = None
        if artifact.object is not None:
            size = self.hold(artifact.object)
        self._check_parents([artifact], self._known)
        self._pending[identity] = replace(artifact, branch=self.branch, object_bytes=size)
        return True

    def _heal(self, identity: str, remade: Artifact) -> None:
        """Notes what the object that was put for an existing artifact mends.

        Args:
            remade: the artifact as it was made now.
        """
        present = self._lake.artifact(identity, at=self.branch)
        if remade.object is None or present.object is None:
            return
        if remade.object == present.object:
            if remade.object in self._fresh:
                self._restored[identity] = remade.object
        elif not self._lake.objects.is_sound(present.object, present.object_bytes):
            row = replace(
                remade,
                branch=self.branch,
                object_bytes=self.hold(remade.object),
                name=present.name,
                session=present.session,
            )
            self._moved[identity] = (present.object, row)

    def find(self, artifact_id: str) -> Artifact | None:
        """Finds the artifact of that full id if it is in this transaction or on the branch, else
        `None`."""
        if artifact_id in self._pending:
            return self._pending[artifact_id]
        return (
            self._lake.artifact(artifact_id, at=self.branch) if artifact_id in self._known else None
        )

    @property
    def _lease(self) -> Lease:
        if self._held is None:
            raise UsageError("the transaction is not open", fix="use it inside its with-block")
        return self._held

    def _look(self) -> tuple[int, frozenset[str]]:
        """Reads the head, and the ids of the rows that the branch shows at it."""
        head = self._lake.catalog.head()
        if head != self._seen:
            self._known = self._lake.identities(self._lake.refs.view(self.branch, head))
            self._seen = head
        return head, self._known

    def _artifacts_at(self, version: int, identities: Collection[str]) -> dict[str, Artifact]:
        """Artifacts that the branch shows at a version, by id."""
        if not identities:
            return {}
        rows = self._lake.matching(
            self._lake.refs.view(self.branch, version), {"artifact": list(identities)}
        )
        return {row["artifact"]: Artifact.from_row(row) for row in rows.to_pylist()}

    def _publish(self) -> CommitResult:
        if not (self._pending or self._existing or self._moved):
            return CommitResult(version=self._seen or 0, commit=None, added=(), existing=())
        if self._pending:
            self._lake.tidy()
        created = datetime.now(UTC)
        commit_id = f"c{secrets.token_hex(8)}"

        def attempt() -> CommitResult:
            version, identities = self._look()
            fresh = {
                i: replace(a, created=created)
                for i, a in self._pending.items()
                if i not in identities
            }
            existing = (
                *self._existing,
                *(identity for identity in self._pending if identity in identities),
            )
            if gone := [identity for identity in self._existing if identity not in identities]:
                raise ConflictError(
                    f"{gone[0]} was withdrawn from branch {self.branch!r} meanwhile",
                    where=str(self._lake.path),
                    fix="do it again",
                )
            moved = {i: replace(row, created=created) for i, (_, row) in self._moved.items()}
            artifacts = self._artifacts_at(version, existing) | fresh | moved
            if not fresh and not moved:
                return CommitResult(
                    version=version, commit=None, added=(), existing=existing, artifacts=artifacts
                )
            self._check_parents(fresh.values(), identities)
            written = [artifact.row() for artifact in (*fresh.values(), *moved.values())]
            rows = pa.Table.from_pylist(written, schema=catalog_schema())
            change = Change(
                message=self.message,
                branch=self.branch,
                fresh=rows,
                held=self._sizes,
                leaving={self.branch: moved} if moved else {},
                labels=self._labels_left(fresh, version),
                notes={"commit": commit_id, "rows": str(len(rows)), "code_version": code_version()},
            )
            with self.keeping_collectors_out():
                version = commit(self._lake, change, base=version)
                self._result = CommitResult(
                    version=version,
                    commit=commit_id,
                    added=tuple(fresh),
                    existing=existing,
                    artifacts=artifacts,
                )
            return self._result

        return persist(attempt, looks=self._lake.catalog.looks, where=self._lake.catalog.path)

    def _labels_left(self, fresh: Collection[str], version: int) -> dict[str, dict[str, None]]:
        """Takes off what is left of labels of artifacts that were withdrawn: one that comes anew
        begins without."""
        labels = self._lake.lineage().labels(Slice(branch=self.branch, version=version))
        return {
            artifact: dict.fromkeys(labels[artifact])
            for artifact in sorted(labels.keys() & set(fresh))
        }

    def _hold(self, name: str) -> int:
        self._lease.hold(name)
        self._sizes[name] = self._lake.objects.size(name)
        return self._sizes[name]

    def _check_parents(self, artifacts: Iterable[Artifact], identities: frozenset[str]) -> None:
        for artifact in artifacts:
            for parent in artifact.parents:
                if parent not in identities and parent not in self._pending:
                    raise NotFoundError(
                        f"its parent {parent} is not on branch {self.branch!r}",
                        where=f"{artifact.kind} {artifact.name!r}",
                        fix="add the parent first",
                    )

    def _copy(self, path: Path) -> Path:
        if not (path.is_dir() or path.is_file()):
            raise NotFoundError(
                "there is no such file or folder", where=str(path), fix="write the object first"
            )
        inside = self.staging(path.suffix)
        copy_object(path, inside)
        return inside
