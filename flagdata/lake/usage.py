"""What a lake's files take: by kind, by version, shared or not, and what garbage collection would free.

Each file is counted once, under one kind. A version shares an object with the branches and tags that show it too; its
own are those that it alone shows.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path

import pyarrow as pa

from flagdata.errors import CorruptError
from flagdata.findings import Severity
from flagdata.lake.artifact import OBJECT_NAME
from flagdata.lake.collect import unneeded
from flagdata.lake.lake import Lake
from flagdata.lake.layout import STORES
from flagdata.lake.leases import leases
from flagdata.lake.marking import mark
from flagdata.schema import Kind
from flagdata.storage import Place, RemotePath

UNSHOWN = "shown by no branch or tag"
CATALOG = "catalog and refs"
OTHER = "other files"
_ORDER = [*(kind for kind in Kind if kind is not Kind.CLIP), Kind.CLIP]
"""A clip is a slice of its recording's object, so it comes last: what two kinds share counts for the first."""


@dataclass(frozen=True, kw_only=True)
class Share:
    """What some of the files take.

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
    """What a version needs.

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
    """What the lake takes, and of it what `at` shows, where one is given.

    Raises:
        CorruptError: a ref cannot be read or is lost, so what is needed is unknown.
        NotFoundError: no such ref.
    """
    states = leases(lake.staging)  # before the catalog, as for a collection
    marked = mark(lake, grace=grace)
    if damage := [finding for finding in marked.findings if finding.severity is Severity.ERROR]:
        raise CorruptError(
            f"which objects are needed is unknown: {damage[0].what}",
            where=damage[0].where,
            fix=damage[0].fix or "run flagdata doctor",
        )
    garbage = unneeded(lake, marked, states, grace=grace)
    sizes: Counter[str] = Counter()
    for key, size in files_of(lake.path):
        sizes[_owner(key)] += size
    tables = dict(marked.refs)
    if at is not None:
        tables.setdefault(at, lake.rows(at=at))
    branches, tags = lake.refs.branches(), lake.refs.tags()
    nouns = dict.fromkeys(tables, "version") | dict.fromkeys(["main", *branches], "branch") | dict.fromkeys(tags, "tag")
    shown = {name: set(table["object"].drop_null().to_pylist()) for name, table in tables.items()}
    counts = Counter(name for ref, objects in shown.items() if ref in marked.refs for name in objects)
    versions = tuple(
        Shown(
            name=ref,
            noun=nouns[ref],
            lost=len(objects - sizes.keys()),
            share=_share(objects & sizes.keys(), sizes, artifacts=tables[ref].num_rows),
            own=sum(sizes[name] for name in objects if counts[name] <= int(ref in marked.refs)),
        )
        for ref, objects in shown.items()
    )
    concerned = marked.refs if at is None else {at: tables[at]}
    kinds = _kinds(concerned, sizes, others=at is None)
    return Usage(kinds=kinds, versions=versions, total=sizes.total(), freed=garbage.size, grace=grace)


def files_of(root: Place) -> Iterator[tuple[str, int]]:
    """The files of a lake: the path from its root, with slashes, and the size [B]; a link counts for itself."""
    if isinstance(root, RemotePath):
        yield from ((key, status.st_size) for key, status in root.names())
        return
    for folder, folders, names in os.walk(root):
        links = [name for name in folders if Path(folder, name).is_symlink()]
        for path in (Path(folder, name) for name in (*names, *links)):
            with suppress(FileNotFoundError):  # of a transaction that has just ended
                yield path.relative_to(root).as_posix(), path.lstat().st_size


def _owner(key: str) -> str:
    """The object that a file belongs to, or what other part of the lake."""
    store, _, rest = key.partition("/")
    name = f"{store}/{rest.partition('/')[0].removesuffix(STORES.get(store, ''))}"
    if store in STORES and OBJECT_NAME.fullmatch(name):
        return name
    return CATALOG if store in ("catalog", "refs", "lake.json") else OTHER


def _kinds(tables: Mapping[str, pa.Table], sizes: Mapping[str, int], *, others: bool) -> dict[str, Share]:
    """What each kind of rows takes.

    Args:
        others: whether also what no row needs, so that all files are counted.
    """
    objects: dict[str, set[str]] = {kind: set() for kind in _ORDER}
    artifacts: dict[str, set[str]] = {kind: set() for kind in _ORDER}
    for table in tables.values():
        columns = (table[name].to_pylist() for name in ("artifact", "kind", "object"))
        for artifact, kind, name in zip(*columns, strict=True):
            artifacts.setdefault(kind, set()).add(artifact)
            if name in sizes:
                objects.setdefault(kind, set()).add(name)
    found: dict[str, Share] = {}
    counted: set[str] = set()
    for kind, names in objects.items():
        if artifacts[kind]:
            found[str(kind)] = _share(names - counted, sizes, artifacts=len(artifacts[kind]))
        counted |= names
    if others:
        rest = {name for name in sizes if name not in counted and OBJECT_NAME.fullmatch(name)}
        found[UNSHOWN] = _share(rest, sizes, artifacts=0)
        found |= {part: Share(artifacts=0, objects=0, size=sizes.get(part, 0)) for part in (CATALOG, OTHER)}
    return found


def _share(names: Collection[str], sizes: Mapping[str, int], *, artifacts: int) -> Share:
    return Share(artifacts=artifacts, objects=len(names), size=sum(sizes[name] for name in names))
