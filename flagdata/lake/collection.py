"""Garbage collection (`collect`): deletes files that nothing refers to and no running transaction
holds. Disk usage (`usage`): what a lake's files take.

- An object is kept if a branch or tag refers to it, if a row withdrawn less than the grace period
  ago points to it, or if a running transaction has put it or looked it up.
- A file younger than the grace period, by the clock that gave it its time, is kept.
- An unfinished upload in parts to a bucket goes by the same rules.
- An object that the log says was erased, or expired, is deleted at any age: that was not finished.
- A staging folder is deleted as soon as its owner is dead, which its lock proves; one without a
  lease, after the grace period.
- A file of the catalog that some version is made of is kept.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import timedelta
from pathlib import Path

import pyarrow as pa

from flagdata.core.files.durable import disk_errors, flush_folder
from flagdata.core.schema import Kind
from flagdata.lake.artifact import OBJECT_NAME
from flagdata.lake.lake import Lake
from flagdata.lake.lake_layout import STORES, check_own
from flagdata.lake.leases import LeaseState, last_written, leases, looking, unleased_entries
from flagdata.lake.marking import Marked, catalog_files, mark
from flagdata.lake.objects import Objects, bytes_at, path_in_lake
from flagdata.lake.removal import find_unfinished
from flagdata.storage import Place, RemotePath, StoreError
from flagdata.storage.uploads import Upload

UNSHOWN = "shown by no branch or tag"
CATALOG = "catalog and refs"
OTHER = "other files"
_ORDER = [*(kind for kind in Kind if kind is not Kind.CLIP), Kind.CLIP]
"""A clip is a slice of its recording's object, so it comes last: what two kinds share counts for
the first."""


@dataclass(frozen=True, kw_only=True)
class Garbage:
    """What a collection would delete.

    Attributes:
        objects: by name.
        leftovers: other paths: staging folders, unpublished files.
        size: of these and of the objects [B].
        uploads: to a bucket that were begun and not finished; no listing states the size of their
            parts.
        unlisted: why the store does not say which uploads there are; `None` where it does.
    """

    objects: tuple[str, ...]
    leftovers: tuple[Place, ...]
    size: int
    uploads: tuple[Upload, ...] = ()
    unlisted: StoreError | None = None


def garbage(lake: Lake, *, grace: timedelta) -> Garbage:
    """Lists what `collect` would delete now.

    Raises:
        LinkError: a folder of the lake is not its own.
        CorruptError: a ref cannot be read or the catalog is damaged, so what it needs is unknown.
    """
    check_own(lake.path)
    with looking(lake.staging), disk_errors("looking for garbage", lake.path):
        return _find(lake, grace)


def collect(lake: Lake, *, grace: timedelta) -> Garbage:
    """Deletes the garbage and says what it was. Transactions wait while it works; none loses
    anything.

    Raises:
        LinkError: a folder of the lake is not its own; nothing was deleted.
        CorruptError: a ref cannot be read or the catalog is damaged, so what it needs is unknown;
            nothing was deleted.
    """
    with lake.changing("collecting", alone=True) as check:
        deletable = _find(lake, grace)
        for error in lake.objects.delete_all(deletable.objects, check).values():
            raise error
        for path in deletable.leftovers:
            check()
            Objects.remove(path)
        for folder in sorted(
            {path.parent for path in deletable.leftovers if isinstance(path, Path)}
        ):
            flush_folder(folder)
        for upload in deletable.uploads:
            check()
            upload.abort()
    return deletable


def _find(lake: Lake, grace: timedelta) -> Garbage:
    states = leases(
        lake.staging
    )  # before the catalog: a lease that is gone by now has its rows committed
    marked = mark(lake, grace=grace)
    # Rows read from a changed file may name other objects than those they need, so files are
    # re-hashed first.
    marked.check(*catalog_files(lake))
    deletable = list_garbage(lake, marked, states, grace=grace)
    try:
        limit = lake.now() - grace.total_seconds()
        abandoned = tuple(upload for upload in left_uploads(lake, states) if upload.begun <= limit)
    except StoreError as error:
        return replace(deletable, unlisted=error)
    return replace(deletable, uploads=abandoned)


def left_uploads(lake: Lake, states: Sequence[LeaseState]) -> tuple[Upload, ...]:
    """Lists unfinished uploads to a lake in a bucket of which no living transaction has the object.

    Raises:
        StoreError: the store does not list them.
    """
    if not isinstance(lake.path, RemotePath):
        return ()
    held = {
        name
        for state in states
        if state.alive
        for name in state.objects
        if OBJECT_NAME.fullmatch(name)
    }
    protected = {str(lake.path / path_in_lake(name)) for name in held}
    return tuple(
        upload
        for upload in lake.path.uploads()
        if not any(f"{upload}/".startswith(f"{protected_path}/") for protected_path in protected)
    )


def list_garbage(
    lake: Lake, marked: Marked, states: Sequence[LeaseState], *, grace: timedelta
) -> Garbage:
    """Lists what neither a marked row nor a living transaction needs, and what is older than the
    grace period.

    Args:
        marked: what is needed, read after `states`.
        states: of all staging folders. Without the lock of `collecting`, what a transaction has put
            since, and which is not younger than the grace period, may be among what is found.
    """
    needed = marked.objects.union(*(state.objects for state in states if state.alive))
    limit = lake.now() - grace.total_seconds()
    given_up = {left.name for left in find_unfinished(lake, needed)}
    objects = [
        o
        for o in lake.objects
        if o.name not in needed and (o.modified <= limit or o.name in given_up)
    ]
    leftovers: list[Place] = [state.folder for state in states if state.leased and not state.alive]
    leftovers += [path for path in unleased_entries(lake.staging) if last_written(path) <= limit]
    leftovers += [path for path in lake.unpublished_files() if path.lstat().st_mtime <= limit]
    return Garbage(
        objects=tuple(o.name for o in objects),
        leftovers=tuple(leftovers),
        size=sum(o.size for o in objects) + sum(bytes_at(path) for path in leftovers),
    )


@dataclass(frozen=True, kw_only=True)
class Share:
    """Rows, objects and bytes of a group of files.

    Attributes:
        artifacts: rows that point to these files.
        objects: how many of them are objects of the stores.
        size: [B].
    """

    artifacts: int
    objects: int
    size: int


@dataclass(frozen=True, kw_only=True)
class Shown:
    """A branch, tag or version, and what its objects take.

    Attributes:
        name: of the branch or tag, or what the user wrote for a version.
        noun: "branch", "tag" or "version".
        share: its artifacts and all objects that it shows.
        own: bytes of those that no other branch or tag shows.
        lost: objects that it shows and that are not in the lake.
    """

    name: str
    noun: str
    share: Share
    own: int
    lost: int


@dataclass(frozen=True, kw_only=True)
class Usage:
    """What a lake takes.

    Attributes:
        kinds: name → what it takes; the sizes add up to `total`.
        versions: main, branches and tags, and the version that was asked for.
        total: of all files of the lake [B].
        freed: what `gc` would free now [B].
        grace: how old garbage must be.
    """

    kinds: Mapping[str, Share]
    versions: tuple[Shown, ...]
    total: int
    freed: int
    grace: timedelta


def usage(lake: Lake, *, at: str | None = None, grace: timedelta) -> Usage:
    """Computes what the lake takes, and of it what `at` shows, where one is given.

    Raises:
        CorruptError: a ref cannot be read or is lost, so what is needed is unknown.
        NotFoundError: no such ref.
    """
    states = leases(lake.staging)  # before the catalog, as for a collection
    marked = mark(lake, grace=grace)
    marked.check()
    freed = list_garbage(lake, marked, states, grace=grace).size
    sizes: Counter[str] = Counter()
    for key, size in files_of(lake.path):
        sizes[_owner(key)] += size
    tables = dict(marked.refs)
    if at is not None:
        tables.setdefault(at, lake.rows(at=at))
    branches, tags = lake.refs.branches(), lake.refs.tags()
    nouns = (
        dict.fromkeys(tables, "version")
        | dict.fromkeys(["main", *branches], "branch")
        | dict.fromkeys(tags, "tag")
    )
    objects_of_refs = {
        name: set(table["object"].drop_null().to_pylist()) for name, table in tables.items()
    }
    counts = Counter(
        name for ref, objects in objects_of_refs.items() if ref in marked.refs for name in objects
    )
    versions = tuple(
        Shown(
            name=ref,
            noun=nouns[ref],
            lost=len(objects - sizes.keys()),
            share=_share(objects & sizes.keys(), sizes, artifacts=tables[ref].num_rows),
            own=sum(sizes[name] for name in objects if counts[name] <= int(ref in marked.refs)),
        )
        for ref, objects in objects_of_refs.items()
    )
    concerned = marked.refs if at is None else {at: tables[at]}
    kinds = _kinds(concerned, sizes, with_rest=at is None)
    return Usage(kinds=kinds, versions=versions, total=sizes.total(), freed=freed, grace=grace)


def files_of(root: Place) -> Iterator[tuple[str, int]]:
    """Yields the files of a lake: the path from its root, with slashes, and the size [B]; a link
    counts for itself."""
    if isinstance(root, RemotePath):
        yield from ((key, status.st_size) for key, status in root.names())
        return
    for folder, folders, names in os.walk(root):
        links = [name for name in folders if Path(folder, name).is_symlink()]
        for path in (Path(folder, name) for name in (*names, *links)):
            with suppress(FileNotFoundError):  # of a transaction that has just ended
                yield path.relative_to(root).as_posix(), path.lstat().st_size


def _owner(key: str) -> str:
    """Returns the object that a file belongs to, or what other part of the lake."""
    store, _, rest = key.partition("/")
    name = f"{store}/{rest.partition('/')[0].removesuffix(STORES.get(store, ''))}"
    if store in STORES and OBJECT_NAME.fullmatch(name):
        return name
    return CATALOG if store in ("catalog", "refs", "lake.json") else OTHER


def _kinds(
    tables: Mapping[str, pa.Table], sizes: Mapping[str, int], *, with_rest: bool
) -> dict[str, Share]:
    """Computes what each kind of rows takes.

    Args:
        with_rest: whether also what no row needs, so that all files are counted.
    """
    objects: dict[str, set[str]] = {kind: set() for kind in _ORDER}
    artifacts: dict[str, set[str]] = {kind: set() for kind in _ORDER}
    for table in tables.values():
        columns = (table[name].to_pylist() for name in ("artifact", "kind", "object"))
        for artifact, kind, name in zip(*columns, strict=True):
            artifacts.setdefault(kind, set()).add(artifact)
            if name in sizes:
                objects.setdefault(kind, set()).add(name)
    shares: dict[str, Share] = {}
    counted: set[str] = set()
    for kind, names in objects.items():
        if artifacts[kind]:
            shares[str(kind)] = _share(names - counted, sizes, artifacts=len(artifacts[kind]))
        counted |= names
    if with_rest:
        rest = {name for name in sizes if name not in counted and OBJECT_NAME.fullmatch(name)}
        shares[UNSHOWN] = _share(rest, sizes, artifacts=0)
        shares |= {
            part: Share(artifacts=0, objects=0, size=sizes.get(part, 0))
            for part in (CATALOG, OTHER)
        }
    return shares


def _share(names: Collection[str], sizes: Mapping[str, int], *, artifacts: int) -> Share:
    return Share(artifacts=artifacts, objects=len(names), size=sum(sizes[name] for name in names))
