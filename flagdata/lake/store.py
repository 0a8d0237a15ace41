"""The parts of a lake and the rows that its refs show: what every operation on a lake reads."""

from __future__ import annotations

import os
import time
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager, suppress
from tempfile import TemporaryFile

import pyarrow as pa
import pyarrow.compute as pc

from flagdata.core.files.durable import disk_errors
from flagdata.core.printable import SHORT
from flagdata.core.schema import CATALOG, Kind
from flagdata.core.shell import command_line
from flagdata.errors import NotFoundError, UnknownNameError, suggest
from flagdata.lake import naming
from flagdata.lake import refs as references
from flagdata.lake.artifact import Artifact
from flagdata.lake.attempts import Moved
from flagdata.lake.catalog import Catalog
from flagdata.lake.lake_layout import STAGING, check_writable
from flagdata.lake.lake_locks import Check
from flagdata.lake.leases import collecting, keeping_collectors_out
from flagdata.lake.lineage import Lineage, with_labels
from flagdata.lake.matching import Values, Where, condition, matching
from flagdata.lake.objects import Objects, RemoteObjects
from flagdata.lake.place_probing import probe
from flagdata.lake.refs import Refs, Slice, View
from flagdata.lake.rowfiles import ROW_ORDER, Scan, in_order
from flagdata.storage import Place, RemotePath

_ORDER = ", ".join(ROW_ORDER)
_NAMES = 10_000
"""Names at most among which one that is nearly right is sought."""


class Store:
    """A lake's catalog, objects and refs, and the rows that a ref shows. `Lake` adds what changes
    them.

    Attributes:
        path: the lake's folder, or its place in a bucket.
        staging: the folder in it in which new objects are written.
    """

    def __init__(self, path: Place) -> None:
        self.path = path
        self.catalog = Catalog(path / "catalog", path / "refs" / "newest")
        self.objects = RemoteObjects(path) if isinstance(path, RemotePath) else Objects(path)
        self.refs = Refs(path / "refs", self.catalog.history, self.catalog.looks)
        self.staging = path / STAGING
        self._lineage: tuple[int, dict[str, View], Lineage] | None = None
        self._identities: tuple[View, frozenset[str]] | None = None

    def __reduce__(self) -> tuple[type[Store], tuple[Place]]:
        return (type(self), (self.path,))

    def check_writable(self) -> None:
        """Checks whether this process may write here: called before the first second of work that
        ends in a commit.

        Raises:
            LinkError: a folder of the lake is a link, so that what is written would lie elsewhere.
            RefusedError: the place lacks what every commit relies on, see
                `flagdata.lake.place_probing`.
            FlagdataError: the lake can only be read.
        """
        check_writable(self.path)
        probe(self.staging)

    @contextmanager
    def changing(self, doing: str, *, alone: bool = False) -> Iterator[Check]:
        """Keeps collections out while the block commits, or all other processes that change the
        lake. Tidies before.

        Args:
            doing: what the block does, for errors of the disk ("withdrawing").

        Raises:
            FlagdataError: as `check_writable`, or what the disk refused.
        """
        self.check_writable()
        with disk_errors(doing, self.path):
            self.tidy()
            with (collecting if alone else keeping_collectors_out)(self.staging) as check:
                yield check

    def tidy(self) -> None:
        """Tidies the catalog, if that is due: alone, so that it is not always overtaken by
        commits."""
        if self.catalog.is_due_for_tidying():
            with collecting(self.staging), suppress(Moved):
                self.catalog.tidy()

    def now(self) -> float:
        """Read the clock by which files of the lake have their times [s since 1970].

        It is the store's. Of a folder it is the disk's, perhaps another machine's, and is read from
        a file without a name; where nothing can be written, this machine's.

        Raises:
            FlagdataError: the store did not say.
        """
        if isinstance(self.path, RemotePath):
            with disk_errors("asking for the store's time", self.path):
                return self.path.now()
        try:
            with TemporaryFile(dir=str(self.staging)) as file:
                return os.fstat(file.fileno()).st_mtime
        except OSError:
            return time.time()

    def rows(
        self,
        where: Where | None = None,
        *,
        at: str | None = None,
        columns: Sequence[str] | None = None,
    ) -> pa.Table:
        """Rows of the catalog in the order of commit, then start, then frame.

        Args:
            where: the values that columns must have, {"kind": Kind.CLIP, "recording": identity},
                see `flagdata.lake.matching`; or an SQL expression as in `flagdata.lake.selection`
                ("kind = 'clip' and wind between 3 and 6"; the column "end" needs its quotes,
                `end_time` does not).
            at: tag, branch, version number or commit id; the head of main if `None`.
            columns: which to return, in this order; all if `None`.

        Raises:
            UsageError: the expression is not one, or reads anything but the catalog.
            NotFoundError: no such ref.
            UnknownNameError: no such column.
        """
        for column in columns or ():
            if column not in CATALOG:
                raise UnknownNameError.of("column", column, CATALOG)
        view = self.view(at)
        if isinstance(where, str):
            table = _filter(self.scan(view), where)
        elif where:
            table = self.matching(view, where, columns)
        elif columns is not None:
            table = in_order(self.columns(view, list(dict.fromkeys([*columns, *ROW_ORDER]))))
        else:
            table = self.table(view)
        return table if columns is None else table.select(list(columns))

    def artifact(
        self, artifact: str, *, at: str | None = None, kinds: Collection[Kind] = ()
    ) -> Artifact:
        """Finds the artifact that `artifact` means, as in `flagdata.lake.naming`, or NAME@REF at
        that tag or branch.

        Args:
            kinds: which of several of that name are meant, if they are of these.

        Raises:
            NotFoundError: none, or several.
            InputError, CorruptError: its row is malformed.
        """
        return Artifact.from_row(self._row(artifact, at, kinds).to_pylist()[0])

    def identity(self, artifact: str, *, at: str | None = None) -> str:
        """Finds the full id of what `artifact` means, as in `artifact`; its row may be malformed.

        Raises:
            NotFoundError: none, or several.
        """
        return self._row(artifact, at)["artifact"][0].as_py()

    def _row(self, artifact: str, at: str | None, kinds: Collection[Kind] = ()) -> pa.Table:
        view = self.view(at)
        candidates = self.meeting(view, naming.condition(artifact), naming.OF_RESULTS)
        meant_rows = naming.meant(candidates.to_pylist(), artifact, kinds=kinds)
        name, _, ref = artifact.rpartition("@")
        if not meant_rows and name and at is None:
            return self._row(name, ref, kinds)
        if len(meant_rows) == 1:
            return self.matching(view, {"artifact": meant_rows[0]["artifact"]})
        where = str(self.path)
        listed = (
            "flagdata ls lists them"
            if at is None
            else f"{command_line('flagdata', 'ls', '--at', at)} lists them"
        )
        if not meant_rows:
            names = self.columns(view, ["name"])["name"].unique().to_pylist()
            near = suggest(artifact, filter(None, names[:_NAMES]))
            raise NotFoundError(
                f"there is no artifact {artifact!r}", where=where, fix=f"{near} {listed}".lstrip()
            )
        several = ", ".join(f"{row['kind']} {row['artifact'][:SHORT]}" for row in meant_rows[:4])
        message = (
            f"{artifact!r} may mean {len(meant_rows)} artifacts: "
            f"{several}{', …' if len(meant_rows) > 4 else ''}"
        )
        raise NotFoundError(message, where=where, fix=f"give the id of one: {listed}")

    def view(self, at: str | None) -> View:
        """Finds what a ref shows: the versions at which branches are read, see
        `flagdata.lake.refs`."""
        history = self.catalog.history
        return references.resolve(
            self.refs, at, head=self.catalog.head(), commits=self._commits, history=history
        )

    def table(self, view: View) -> pa.Table:
        """Reads all rows of a view, its base first. An identity is on one branch of a view only."""
        *later, first = view
        rows, lineage = self._of_branch(first), self.lineage()
        for part in reversed(later):
            hidden = lineage.hidden(part)
            if hidden:
                rows = rows.filter(~pc.field("artifact").isin(sorted(hidden)))
            rows = pa.concat_tables([rows, self._of_branch(part)])
        return with_labels(rows, lineage.labels(view[0]))

    def scan(self, view: View) -> pa.Table | Scan:
        """Opens what `table` gives, decoded as it is asked for where the view is one branch's rows
        without labels."""
        if len(view) == 1 and not self.lineage().labels(view[0]):
            opened = self.catalog.scan(view[0].version)
            if opened is not None:
                return opened.matching(pc.field("branch") == view[0].branch)
        return self.table(view)

    def meeting(
        self, view: View, condition: pc.Expression, columns: Sequence[str] = tuple(CATALOG)
    ) -> pa.Table:
        """Reads some columns of the rows of a view that meet a condition."""
        rows = self.scan(view)
        if isinstance(rows, Scan):
            return rows.matching(condition).table(columns)
        return rows.filter(condition).select(list(columns))

    def matching(
        self, view: View, values: Values, columns: Sequence[str] | None = None
    ) -> pa.Table:
        """Rows of a view with these values, see `flagdata.lake.matching`, with at least some
        columns; all if `None`.

        Raises:
            UnknownNameError, UsageError: as there.
        """
        scans = None if self.lineage().labels(view[0]) else self._scans(view)
        if scans is None:
            return matching(self.table(view), values)
        wanted = CATALOG if columns is None else dict.fromkeys([*columns, *ROW_ORDER])
        return pa.concat_tables(
            in_order(scan.matching(condition(values)).table(wanted)) for scan in scans
        )

    def columns(self, view: View, names: Sequence[str]) -> pa.Table:
        """Reads some columns of all rows of a view, its base first, by commit; no others are
        decoded where that can be."""
        scans = self._scans(view)
        if scans is None:
            return self.table(view).select(names)
        return pa.concat_tables(scan.table(names) for scan in scans)

    def _scans(self, view: View) -> list[Scan] | None:
        """Opens the rows of a view by branch, its base first, without labels; `None` where files
        cannot be scanned."""
        scans: list[Scan] = []
        hidden: frozenset[str] = frozenset()
        for part in view:
            rows = self.catalog.scan(part.version)
            if rows is None:
                return None
            condition = pc.field("branch") == part.branch
            if hidden:
                condition &= ~pc.field("artifact").isin(sorted(hidden))
            scans.append(rows.matching(condition))
            if len(view) > 1:
                hidden |= self.lineage().hidden(part)
        return scans[::-1]

    def identities(self, view: View) -> frozenset[str]:
        """Lists the ids of all rows of a view. Those of the view that was asked for last are
        kept."""
        if self._identities is None or self._identities[0] != view:
            self._identities = (
                view,
                frozenset(self.columns(view, ["artifact"])["artifact"].to_pylist()),
            )
        return self._identities[1]

    def lineage(self) -> Lineage:
        """Reads how branches came to be, as known at the head."""
        history = self.catalog.history()
        forks = {name: ref.view for name, ref in self.refs.branches().items()}
        if self._lineage is None or self._lineage[:2] != (history[0]["version"], forks):
            self._lineage = (history[0]["version"], forks, Lineage(history, forks))
        return self._lineage[2]

    def _of_branch(self, part: Slice) -> pa.Table:
        """Reads the rows of one branch at one version."""
        rows = self.catalog.rows(part.version)
        if rows["branch"].unique().to_pylist() == [part.branch]:
            return rows  # a filter would copy all columns
        return rows.filter(pc.field("branch") == part.branch)

    def _commits(self) -> dict[str, View]:
        lineage = self.lineage()
        parts = {
            entry["commit"]: Slice(branch=entry["branch"], version=entry["version"])
            for entry in self.catalog.history()
            if "commit" in entry
        }
        return {
            commit: lineage.view(part)
            for commit, part in parts.items()
            if lineage.fork(part) is not None
        }


def _filter(table: pa.Table | Scan, where: str) -> pa.Table:
    from flagdata.lake.selection import (
        Request,
        Selection,
    )  # it knows what a view is, so it imports this package

    return Selection(table, Request(where=where, order=_ORDER)).table()
