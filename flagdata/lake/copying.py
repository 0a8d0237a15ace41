"""Moving versions between lakes of one history: `flagdata push`, `pull` and `clone`.

A clone has the log of its source, entry by entry, so that versions, commits, tags and branches mean
the same in both. Each entry states the hash of the one before it: where two lakes have the same
entry, they have the same history up to it. Versions are only added, in order, each by the
conditional put that publishes a commit, after the objects that refs need; what is there, of its
size and not found damaged, is not moved again. So a transfer that was stopped goes on where it was,
and of two at once one finds the work done, or is refused.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from datetime import timedelta

from flagdata.core.files.durable import confirming, disk_errors
from flagdata.core.findings import Finding, Severity
from flagdata.core.printable import count_of
from flagdata.core.shell import command_line
from flagdata.errors import ConflictError, CorruptError, FlagdataError
from flagdata.lake.lake import Lake
from flagdata.lake.marking import Marked, mark
from flagdata.lake.refs import NOUNS, Deletion, deleted_by
from flagdata.lake.restoring import Bars, Taken, heal_noted
from flagdata.lake.transaction import Transaction
from flagdata.storage import Place

_SHOWN = ("name", "session", "source_name", "code_version", "branch", "kind")
"""Columns of text that commands show."""


@dataclass(frozen=True, kw_only=True)
class Transfer:
    """What was moved.

    Attributes:
        versions: how many the target did not have.
        head: the newest one of both lakes now.
        objects: names of those that the target did not have, sorted.
        size: of these [B].
        refs: names of the tags and branches that it did not have, sorted.
        findings: what texts of the versions that came hold which a terminal would obey.
        healed: what was damaged or missing in a target that is ahead of its source, and was taken
            from it.
    """

    versions: int
    head: int
    objects: tuple[str, ...]
    size: int
    refs: tuple[str, ...]
    findings: tuple[Finding, ...] = ()
    healed: tuple[Taken, ...] = ()


def clone(source: Lake, target: Place | str, *, bars: Bars) -> tuple[Lake, Transfer]:
    """Make a lake with all versions, tags and branches of another.

    Where the making was stopped, `transfer` goes on with it.

    Raises:
        ConflictError: something is there already.
    """
    source.catalog.head()
    try:
        lake = Lake.adopt(target, source)
    except ConflictError as error:
        raise _with_push(error, source, target) from None
    return lake, transfer(source, lake, bars=bars)


def _with_push(error: ConflictError, source: Lake, target: Place | str) -> ConflictError:
    """Returns the refusal to clone to where something is; how to go on, where that is a clone of
    the source."""
    try:
        lake = Lake.open(target)
        same = source.catalog.entry(0)[0] == lake.catalog.entry(0)[0]
    except FlagdataError:
        return error
    if not same:
        return error
    return ConflictError(
        "there is a clone of this lake already",
        where=str(lake.path),
        fix=f"{command_line('flagdata', 'push', lake.path, '--lake', source.path)} brings it up to "
        "date, also where a "
        "clone was stopped",
    )


def transfer(source: Lake, target: Lake, *, bars: Bars) -> Transfer:
    """Brings a lake to the newest version of another one.

    Args:
        bars: makes a progress bar.

    Raises:
        ConflictError: the target has versions, or a tag or branch of a name, that the source has
            otherwise.
        CorruptError: the source is damaged; nothing is published of it.
    """
    target.check_writable()
    marked = mark(source, grace=timedelta(0))
    if damage := [finding for finding in marked.findings if finding.severity is Severity.ERROR]:
        raise CorruptError(
            damage[0].what, where=damage[0].where, fix=damage[0].fix or "run flagdata doctor"
        )
    head, target_head = source.catalog.head(), target.catalog.head()
    _check_history(source, target, head=head, target_head=target_head)
    source.catalog.check_entries(min(head, target_head))
    _check_refs(source, target)
    refs_before = target.refs.stored()
    sizes = marked.sizes
    missing = [
        name
        for name in sorted(marked.objects)
        if not target.objects.is_there(name, sizes.get(name))
    ]
    size = 0
    with (
        disk_errors("moving versions", target.path),
        target.transaction(f"versions of {source.path}") as transaction,
        bars(len(missing), "objects", "object") as advance,
    ):
        for name in sorted(marked.objects.difference(missing)):
            transaction.hold(name)
        for name in missing:
            if transaction.put(source.objects.whole(name)) != name:
                raise CorruptError(
                    f"the bytes of {name} have changed",
                    where=str(source.path),
                    fix="run flagdata verify",
                )
            size += transaction.hold(name)
            advance(1)
        older, refs = source.refs.older(), source.refs.stored()
        findings = tuple(_unprintable(source, marked, versions=head - target_head))
        _adopt(source, target, transaction, versions=range(target_head + 1, head + 1), bars=bars)
        for kind, name in refs.keys() & older.keys():
            target.refs.adopt(kind, name, refs[kind, name])
        with confirming("what the log says of tags and branches", target.refs.root):
            target.refs.write_files()
        with (
            suppress(OSError, FlagdataError),
            transaction.keeping_collectors_out(),
        ):  # it saves time only
            target.catalog.summarise()
    names = tuple(sorted(name for _, name in refs.keys() - refs_before.keys()))
    return Transfer(
        versions=head - target_head,
        head=head,
        objects=tuple(missing),
        size=size,
        refs=names,
        findings=findings,
    )


def pull(source: Lake, target: Lake, *, bars: Bars) -> Transfer:
    """Brings a lake to the newest version of another one, as `transfer`. One that is behind, as a
    backup of this lake
    is, has nothing new: what this one lost, or what was found damaged in it, is taken, see
    `flagdata.lake.restoring`.

    Raises:
        ConflictError, CorruptError: as `transfer`.
    """
    head, target_head = source.catalog.head(), target.catalog.head()
    if head >= target_head:
        return transfer(source, target, bars=bars)
    _check_common(source, target, head)
    healed = heal_noted(target, source, bars=bars).taken
    objects = [taken for taken in healed if taken.kind == "object"]
    return Transfer(
        versions=0,
        head=target_head,
        objects=tuple(taken.name for taken in objects),
        size=sum(taken.size for taken in objects),
        refs=(),
        healed=healed,
    )


def _unprintable(source: Lake, marked: Marked, *, versions: int) -> Iterator[Finding]:
    """Warns where rows, or messages of the newest versions, hold what a terminal would obey. They
    come as they are: each version states the hash of the one before, so that a text that was
    cleaned would be another history."""
    unprintable: Counter[str] = Counter()
    for entry in source.catalog.history(versions):
        unprintable["message"] += not str(entry.get("message", "")).isprintable()
    for table in marked.refs.values() if versions else ():
        for name in _SHOWN:
            texts = table[name].unique().drop_null().to_pylist()
            unprintable[name] += sum(not text.isprintable() for text in texts)
    columns = [name for name, count in unprintable.items() if count]
    if columns:
        yield Finding.of(
            "control-characters",
            f"{count_of(unprintable.total(), 'text')} of {', '.join(columns)} hold control "
            "characters or marks of "
            "direction: they came as they are, and are shown escaped",
            count=unprintable.total(),
            where=str(source.path),
            fix="none needed for flagdata; give other programs what flagdata prints, not the files "
            "of the catalog",
        )


def _adopt(
    source: Lake, target: Lake, transaction: Transaction, *, versions: range, bars: Bars
) -> None:
    with bars(len(versions), "versions", "version") as advance:
        for version in versions:
            with transaction.keeping_collectors_out():
                target.catalog.adopt(version, *source.catalog.entry(version))
            advance(1)
    if versions:
        target.catalog.acknowledge(versions[-1])


def _check_history(source: Lake, target: Lake, *, head: int, target_head: int) -> None:
    """Checks whether all versions of the target are versions of the source.

    Raises:
        ConflictError: they are not.
    """
    _check_common(source, target, min(head, target_head))
    if target_head > head:
        raise ConflictError(
            f"{target.path} is ahead: it has versions up to {target_head}, {source.path} up to "
            f"{head}",
            where=str(target.path),
            fix=f"{command_line('flagdata', 'pull', target.path, '--lake', source.path)} brings "
            "them here",
        )


def _check_common(source: Lake, target: Lake, common: int) -> None:
    """Checks whether two lakes have the same versions up to one.

    Raises:
        ConflictError: they have not.
    """
    if source.catalog.entry(common)[0] != target.catalog.entry(common)[0]:
        same = source.catalog.entry(0)[0] == target.catalog.entry(0)[0]
        raise ConflictError(
            "each of the two lakes has versions that the other lacks"
            if same
            else "the lakes share no history",
            where=f"{source.path} and {target.path}",
            fix=f"{command_line('flagdata', 'clone', target.path, 'NEW')}, and commit there what "
            "it lacks; or write to "
            f"it directly: {command_line('--lake', target.path)}",
        )


def _check_refs(source: Lake, target: Lake) -> None:
    """Checks whether the refs that the target has as files only, of an earlier version, are those
    of the source, or refs that the source has deleted since, or that it does not know.

    Raises:
        ConflictError: the source has another one of the same name.
    """
    refs_of_source = {("tags", name): ref for name, ref in source.refs.tags().items()}
    refs_of_source |= {("branches", name): ref for name, ref in source.refs.branches().items()}
    deletions = [
        (key, Deletion(timestamp=int(entry["timestamp"])))
        for entry in source.catalog.history()
        if (key := deleted_by(entry)) is not None
    ]
    for key, ref in target.refs.older().items():
        is_ended = any(ended == key and deletion.ends(ref) for ended, deletion in deletions)
        if not is_ended and refs_of_source.get(key, ref) != ref:
            raise ConflictError(
                f"both lakes have a {NOUNS[key[0]]} {key[1]!r}, and not the same",
                where=str(target.path),
                fix="delete one of the two",
            )
