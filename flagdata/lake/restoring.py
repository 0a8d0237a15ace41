"""`flagdata heal`: what is damaged or missing in a lake is taken from another lake of the same
history.

The other one may be older, as a backup is, or newer, a clone of this lake or the lake that this is
a clone of, and may
be damaged itself: what is right in it is taken. An entry of the log is right by the hash that the
entry after it or the mark notes, see `flagdata.lake.right_entries`; a file of rows by the hash that
its commit notes; an object by its name. Nothing that is whole is touched, and nothing that this
lake never had comes in: that is `pull`'s.

The order is that in which one makes the other readable: folders, marker, log, files of rows, refs,
objects. Each item is put durably before the next, so that what was stopped is gone on with by the
same command. Others are kept out while the catalog is healed; objects come as any writer's do.
"""

from __future__ import annotations

import hashlib
import uuid
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, closing, suppress
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from flagdata.core.files import object_cache
from flagdata.core.files.durable import disk_errors, flush_folder, make_folders, replace_durably
from flagdata.core.findings import Finding, Severity
from flagdata.errors import ConflictError, CorruptError, FlagdataError, NotFoundError
from flagdata.lake.catalog_log_errors import HINT
from flagdata.lake.delta_log import CHECKPOINT, Log
from flagdata.lake.deposit import copy_object
from flagdata.lake.health import object_names, read_refs, verify, verify_catalog
from flagdata.lake.lake import MARKER, Lake
from flagdata.lake.lake_layout import FOLDERS, check_own
from flagdata.lake.leases import Lease, collecting
from flagdata.lake.log_summaries import Summaries, summaries_in
from flagdata.lake.marking import Marked
from flagdata.lake.refs import MAIN, Deletion, Ref, content_of
from flagdata.lake.removal import find_unfinished
from flagdata.lake.right_entries import are_of_one_history, mending, read_bytes
from flagdata.recipes.documents import from_json
from flagdata.storage import Place, RemotePath

_MISSING = "was missing"
_CHANGED = "had changed"


@dataclass(frozen=True, kw_only=True)
class Taken:
    """Something that was damaged or missing, and is whole.

    Attributes:
        kind: "object", "file of rows", "log entry", "mark", "summary", "checkpoint", "ref",
            "marker" or "folder"; or "local copy", of a bucket's object.
        name: of an object; of anything else, where it is.
        why: what was wrong with it.
        size: bytes that were taken; 0 where it was deleted, and is made again when it is needed.
    """

    kind: str
    name: str
    why: str
    size: int = 0


@dataclass(frozen=True, kw_only=True)
class Healed:
    """What was done.

    Attributes:
        taken: what is whole now and was not.
        left: what is still damaged.
    """

    taken: tuple[Taken, ...]
    left: tuple[Finding, ...]


Bars = Callable[[int, str, str], AbstractContextManager[Callable[[int], None]]]
"""Makes a progress bar of a total, a label and a unit; in its block a function advances it."""
Unsound = Callable[[Lake, Sequence[str]], Iterable[str]]
"""Selects the damaged or missing ones among objects."""


def heal(lake: Lake, source: Lake, *, bars: Bars) -> Healed:
    """Takes what is damaged or missing in a lake from another one. All bytes of the lake are
    compared.

    Args:
        lake, source: as `Lake.found` gives them: neither need be readable.
        bars: makes a progress bar.

    Raises:
        ConflictError: the lakes have nothing in common.
        LinkError: a folder of the lake is not its own.
        FlagdataError: what the disk or the store refused; what was taken before stays.
    """

    def changed_objects(lake: Lake, names: Sequence[str]) -> Iterator[str]:
        with bars(len(names), "compare", "object") as advance:
            for name in names:
                if lake.objects.is_whole(name):
                    lake.objects.note_whole(name)
                else:
                    yield name
                advance(1)

    return _heal_lake(lake, source, changed_objects, bars=bars)


def heal_noted(lake: Lake, source: Lake, *, bars: Bars) -> Healed:
    """As `heal`, but of the objects those alone that are missing, of another size, or were found
    damaged before."""

    def noted_objects(lake: Lake, names: Sequence[str]) -> Iterator[str]:
        sizes = read_refs(lake).sizes
        return (name for name in names if not lake.objects.is_there(name, sizes.get(name)))

    return _heal_lake(lake, source, noted_objects, bars=bars)


def _heal_lake(lake: Lake, source: Lake, unsound: Unsound, *, bars: Bars) -> Healed:
    _check_kinship(lake, source)
    with disk_errors("healing", lake.path):
        check_own(lake.path)
        taken = [*_folders(lake, source)]
        lake.check_writable()
        with collecting(lake.staging) as check:
            for heal_part in (_marker, _log, _rows, _what_saves_time, _refs):
                check()
                taken += heal_part(Lake(lake.path), source)
        lake = Lake(lake.path)
        marked, names = _needed_objects(lake)
        missing = [*unsound(lake, names)]
        came = {taken.name: taken for taken in _objects(lake, source, missing, bars=bars)}
        taken += [*came.values(), *_copies(lake, names)]
    still_missing = [name for name in missing if name not in came]
    damaged = (
        *_marker_findings(lake),
        *verify_catalog(lake, marked),
        *verify(lake, still_missing, marked),
    )
    left = tuple(finding for finding in damaged if finding.severity is Severity.ERROR)
    return Healed(taken=tuple(taken), left=left)


def _needed_objects(lake: Lake) -> tuple[Marked, list[str]]:
    """Reads what refs show, and lists the objects that are needed or stored, but for what was
    erased."""
    marked = read_refs(lake)
    erased: set[str] = set()
    with suppress(FlagdataError):  # of a log that is damaged still, so that no erasure is known
        erased = {left.name for left in find_unfinished(lake, marked.objects)}
    return marked, [name for name in object_names(lake, marked) if name not in erased]


def _check_kinship(lake: Lake, source: Lake) -> None:
    identity = _identity(lake)
    if identity is not None and identity == _identity(source):
        return
    if not are_of_one_history(_log_of(lake), _log_of(source)):
        raise ConflictError(
            "the lakes share no history",
            where=f"{source.path} and {lake.path}",
            fix="name a clone or a backup of this lake, or the lake that it is a clone of",
        )


def _identity(lake: Lake) -> object:
    """Reads what a lake's marker says it is, which all its clones say; `None` where it cannot be
    read."""
    with suppress(ValueError, KeyError, TypeError):
        return from_json(read_bytes(lake.path / MARKER) or b"")["lake"]
    return None


def _log_of(lake: Lake) -> Log:
    return Log(lake.catalog.path / "_delta_log", lake.path / "refs" / "newest")


def _folders(lake: Lake, source: Lake) -> Iterator[Taken]:
    """Makes the folders that the other lake has."""
    root = lake.path
    if isinstance(root, RemotePath):
        return
    for folder in (root / name for name in FOLDERS if (source.path / name).is_dir()):
        if not folder.exists():
            make_folders(folder)
            yield Taken(kind="folder", name=str(folder), why=_MISSING)


def _put(path: Place, data: bytes, kind: str) -> Taken:
    why = _CHANGED if path.exists() else _MISSING
    replace_durably(path, data)
    return Taken(kind=kind, name=str(path), why=why, size=len(data))


def _marker(lake: Lake, source: Lake) -> Iterator[Taken]:
    if _marker_findings(lake) and not _marker_findings(source):
        yield _put(lake.path / MARKER, (source.path / MARKER).read_bytes(), "marker")


def _marker_findings(lake: Lake) -> list[Finding]:
    """Reports a marker that is missing or cannot be read."""
    try:
        Lake.open(lake.path)
    except (CorruptError, NotFoundError) as error:
        return [Finding.of("marker-damaged", error.what, where=error.where, fix=error.fix)]
    return []


def _log(lake: Lake, source: Lake) -> Iterator[Taken]:
    log = _log_of(lake)
    found = mending(log, _log_of(source))
    for version, entry in sorted(found.entries.items()):
        yield _put(log.path(version), entry, "log entry")
    if found.mark is not None:
        newest, entry_hash = found.mark
        yield _put(log.marks / str(newest), f"{entry_hash}\n".encode(), "mark")


def _rows(lake: Lake, source: Lake) -> Iterator[Taken]:
    """Heals the files of rows of all versions whose entries can be read."""
    log = _log_of(lake)
    seen: set[str] = set()
    for version in sorted(log.present()):
        with suppress(CorruptError):
            entry, names = log.entry(version)
            noted = log.noted_of(version, entry)
            for name in (name for name in names if name not in seen):
                seen.add(name)
                path = lake.catalog.path / name
                if not _is_right(read_bytes(path), noted):
                    instead = read_bytes(source.catalog.path / name)
                    if instead is not None and _is_right(instead, noted):
                        yield _put(path, instead, "file of rows")


def _is_right(content: bytes | None, noted: str | None) -> bool:
    """Checks whether a file of rows is what its commit noted; of one of before that was noted,
    whether it is read."""
    if content is None or noted is not None:
        return content is not None and hashlib.sha256(content).hexdigest() == noted
    return _is_table(content)


def _is_table(content: bytes) -> bool:
    try:
        pq.read_table(BytesIO(content)).validate(full=True)
    except (OSError, ValueError, pa.ArrowException):
        return False
    return True


def _what_saves_time(lake: Lake, source: Lake) -> Iterator[Taken]:
    """Takes summaries and checkpoints that have changed, or deletes them: the entries of the log
    hold all."""
    for name in summaries_in(lake.path / "refs" / "history"):
        summary_hash = name.removesuffix(".json").rpartition("-")[2]
        content, instead = (
            read_bytes(one.path / "refs" / "history" / name) for one in (lake, source)
        )
        if content is not None and hashlib.sha256(content).hexdigest() != summary_hash:
            is_right = instead is not None and hashlib.sha256(instead).hexdigest() == summary_hash
            yield _put_or_deleted(
                lake.path / "refs" / "history" / name, instead if is_right else None, "summary"
            )
    log = lake.catalog.path / "_delta_log"
    noted: dict[int, str] = {}
    with suppress(FlagdataError):  # of a log that is damaged still
        summaries = Summaries(lake.path / "refs" / "history", _log_of(lake))
        summaries.read(lake.catalog.head())
        noted = summaries.checkpoints
    changed = False
    for version in _log_of(lake).checkpoints():
        name = f"{version:020d}{CHECKPOINT}"
        if not _is_right(read_bytes(log / name), noted.get(version)):
            instead = read_bytes(source.catalog.path / "_delta_log" / name)
            is_right = instead is not None and _is_right(instead, noted.get(version))
            yield _put_or_deleted(log / name, instead if is_right else None, "checkpoint")
            changed = True
    hint = read_bytes(log / HINT)
    if hint is not None and (changed or not _names_checkpoint(hint, _log_of(lake).checkpoints())):
        yield _put_or_deleted(log / HINT, None, "checkpoint")


def _refs(lake: Lake, source: Lake) -> Iterator[Taken]:
    """Takes tags and branches that files alone state, as earlier versions of flagdata made them:
    damaged ones, and those that are missing and were not deleted. What the log states is in the
    log; its files are written anew."""
    with suppress(FlagdataError):  # of a log, here or there, that is damaged still
        head, lives = lake.catalog.head(), lake.refs.lives()
        damaged = lake.refs.damaged()
        alone = source.refs.enterable(head)
        stated = {key: ref for key, ref in source.refs.lives().items() if isinstance(ref, Ref)}
        there = {
            MAIN,
            *(name for kind, name in (*lives, *lake.refs.enterable(head)) if kind == "branches"),
        }
        lost = {*lake.catalog.rows(head)["branch"].to_pylist()} - there
        for key, ref in {**stated, **alone}.items():
            kind, name = key
            life, path = lives.get(key), lake.refs.root / kind / f"{name}.json"
            is_deleted = isinstance(life, Deletion) and life.ends(ref)
            is_missing = (kind == "branches" and name in lost) or (
                key in alone and not path.exists()
            )
            if not isinstance(life, Ref) and not is_deleted and (key in damaged or is_missing):
                yield _put(path, content_of(ref), "ref")
        for path in lake.refs.stale_files():
            yield Taken(
                kind="ref",
                name=str(path),
                why="did not say what the log says, and was written anew",
            )
        lake.refs.write_files()


def _names_checkpoint(hint: bytes, checkpoints: Sequence[int]) -> bool:
    with suppress(ValueError, KeyError, TypeError):
        return from_json(hint)["version"] in checkpoints
    return False


def _put_or_deleted(path: Place, content: bytes | None, kind: str) -> Taken:
    if content is not None:
        return _put(path, content, kind)
    path.unlink(missing_ok=True)
    if isinstance(path, Path):
        flush_folder(path.parent)
    return Taken(kind=kind, name=str(path), why=f"{_CHANGED}, and was deleted: it only saves time")


def _objects(lake: Lake, source: Lake, names: Sequence[str], *, bars: Bars) -> Iterator[Taken]:
    """Takes those of the objects that the other lake has rightly; of what is erased meanwhile, none
    comes back."""
    if not names:
        return
    with closing(Lease(lake.staging)) as lease, bars(len(names), "objects", "object") as advance:
        for name in names:
            lease.hold(name)  # an erasure that begins later sees it
        needed = {*_needed_objects(Lake(lake.path))[1]}
        for name in names:
            with suppress(NotFoundError, CorruptError):  # of the other lake's
                found = source.objects.whole(name)
                staged = lease.folder / f"{uuid.uuid4().hex}{found.suffix}"
                copy_object(found, staged)
                why = _CHANGED if lake.objects.has(name) else _MISSING
                if name in needed and lake.objects.name_of(staged) == name:
                    lake.objects.publish(staged, name)
                    yield Taken(kind="object", name=name, why=why, size=lake.objects.size(name))
            advance(1)


def _copies(lake: Lake, names: Sequence[str]) -> Iterator[Taken]:
    """Deletes the local copies of a bucket's objects whose bytes are wrong."""
    if not isinstance(lake.path, RemotePath):
        return
    for name in names:
        suffix = lake.objects.path(name).suffix
        if object_cache.has_copy(name, suffix) and not object_cache.is_whole(name, suffix):
            yield Taken(
                kind="local copy",
                name=name,
                why=f"{_CHANGED}, and was deleted: it is fetched again",
            )
