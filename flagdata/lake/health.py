"""Finding what is wrong with a lake: `doctor` by its structure, `verify` by re-hashing every byte.

How an artifact is made again whose object is damaged or missing: the remedy that a finding names.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Collection, Sequence
from contextlib import suppress
from datetime import timedelta
from pathlib import Path

import pyarrow as pa

from flagdata.core.files.durable import HEAL, SCRATCH
from flagdata.core.files.regular_files import is_beside
from flagdata.core.findings import Finding, Severity
from flagdata.core.printable import SHORT, count_of
from flagdata.core.schema import FORMAT_VERSION, Kind
from flagdata.core.shell import command_line
from flagdata.errors import FlagdataError
from flagdata.lake.artifact import OBJECT_NAME, Artifact
from flagdata.lake.collection import left_uploads
from flagdata.lake.delta_log import LogGapError
from flagdata.lake.label_columns import clashes, shown_labels
from flagdata.lake.lake import Lake
from flagdata.lake.lake_layout import FOLDERS, STORES, foreign_entries
from flagdata.lake.lake_locks import COLLECT, TURN
from flagdata.lake.leases import LeaseState, last_written, leases, looking, unleased_entries
from flagdata.lake.marking import Marked, catalog_files, mark
from flagdata.lake.objects import DAMAGED, StoredObject
from flagdata.lake.refs import MAIN
from flagdata.lake.removal import Unfinished, erased_objects, find_unfinished
from flagdata.lake.removal_findings import findings_of_removed, unfinished_finding
from flagdata.storage import Place, StoreError
from flagdata.storage.uploads import Upload

_BY_KIND = {
    Kind.MESHES: "simulate or build its recipe again",
    Kind.RECORDING: "align, declare or build it again as before",
    Kind.CLIP: "align, declare or build its recording again as before",
    Kind.NETWORK: "train it again",
    Kind.WIND: "align or declare it again as before",
}
"""Of what has no file that it was ingested from."""


def made_again(artifact: Artifact) -> str:
    """Names what replaces the object of an artifact that is damaged or missing."""
    branch = () if artifact.branch == MAIN else ("--branch", artifact.branch)
    if artifact.kind in (Kind.MEASUREMENT, Kind.MODEL):
        withdraw = command_line(
            "flagdata", "withdraw", artifact.id[:SHORT], *branch, "-m", "its data are lost"
        )
        return (
            f"give the command that made it again by the same code ({artifact.code_version}), "
            "which replaces the "
            f"object; or {HEAL}; or {withdraw}"
        )
    if artifact.source_name is not None:
        how = (
            f"{command_line('flagdata', 'ingest', artifact.source_name, *branch)} again, with the "
            "options of the first "
            "time"
        )
    else:
        on_branch = f", with {command_line(*branch)}" if branch else ""
        how = f"{_BY_KIND.get(artifact.kind, 'give the command that made it again')}{on_branch}"
    return f"{how}: it replaces the object; or {HEAL}"


GRACE = timedelta(hours=24)
"""How long unreferenced files are left alone."""


def doctor(lake: Lake, *, grace: timedelta = GRACE) -> tuple[Finding, ...]:
    """Finds all that is wrong with the lake's structure; contents are `verify`'s.

    Errors are damage: rows without object or parent, objects of another size than recorded, refs
    that cannot be read, links where the lake keeps files of its own, rows of a newer format.
    Warnings are what a crash leaves and `gc` removes. Notes are younger than `grace`, and nothing
    to act on.
    """
    foreign = _foreign(lake)
    stored = list(lake.objects)
    states: list[LeaseState] = []
    unowned: list[tuple[Place, float]] = []
    if not _is_among(lake.staging, foreign) and any(
        lake.staging.glob("*")
    ):  # in an empty one, a lock would have to be made
        with looking(lake.staging):
            states = leases(lake.staging)
            unowned = [(path, last_written(path)) for path in unleased_entries(lake.staging)]
    # The catalog last: what was put by now is protected by a lease read above, or committed below,
    # or left behind.
    marked = mark(lake, grace=grace)
    limit = lake.now() - grace.total_seconds()
    findings = [*map(_linked_finding, foreign), *marked.findings, *_rows(lake, marked, foreign)]
    if LogGapError.kind in {finding.kind for finding in marked.findings}:
        return tuple(
            findings
        )  # what follows would call the files of the missing entries' commits leftovers
    if not marked.findings:
        in_use = {name for state in states if state.alive for name in state.objects}
        needed = marked.objects | in_use
        leftovers: dict[str, Unfinished] = {}
        try:
            leftovers = {left.name: left for left in find_unfinished(lake, needed)}
            findings += findings_of_removed(
                lake, marked, {stored_object.name for stored_object in stored}
            )
        except FlagdataError as error:
            findings.append(_log_damaged(error))
        findings += [unfinished_finding(lake, left) for left in leftovers.values()]
        findings += [
            _orphan(stored_object, limit, grace)
            for stored_object in stored
            if stored_object.name not in needed | leftovers.keys()
        ]
        findings += _left_uploads(lake, states, limit, grace)
    findings += _label_clashes(lake, marked)
    findings += [*_strays(lake, foreign), *_system_files(lake), *_ref_files(lake)]
    findings += [_abandoned_finding(state) for state in states if state.leased and not state.alive]
    findings += [_unleased_finding(path, written, limit, grace) for path, written in unowned]
    try:
        findings += [_unpublished_finding(path, limit, grace) for path in lake.unpublished_files()]
    except FlagdataError as error:
        findings.append(_log_damaged(error))
    return tuple(dict.fromkeys(findings))  # an entry that cannot be read stops more than one check


def verify(
    lake: Lake,
    names: Sequence[str],
    marked: Marked | None = None,
    *,
    advance: Callable[[int], None] = lambda _: None,
) -> tuple[Finding, ...]:
    """Hashes the objects called `names` again; reports each that is missing or has changed. Damage
    is noted beside the object, so that what makes it again replaces it without comparing all its
    bytes, see `Objects.note_damage`.

    Args:
        marked: what every ref shows: of what they are, the findings say how it is made again.
        advance: called with the size [B] of each object done.
    """
    findings = []
    rows = _by_object(marked) if marked is not None else {}
    for name in names:
        try:
            lake.objects.check(name)
        except FlagdataError as error:
            kind = {"not-found": "object-missing", "link": "link"}.get(error.kind, "object-changed")
            if kind == "object-changed":
                lake.objects.note_damage(name)
            fix = made_again(rows[name]) if name in rows else error.fix
            findings.append(
                Finding(
                    kind=kind, severity=Severity.ERROR, what=error.what, where=error.where, fix=fix
                )
            )
        else:
            lake.objects.note_whole(name)
        advance(1)
    return tuple(findings)


def _by_object(marked: Marked) -> dict[str, Artifact]:
    """Maps each object to the artifact that it was made as, and not a part of it."""
    artifacts: dict[str, Artifact] = {}
    for table in marked.refs.values():
        for row in table.to_pylist():
            if row["object"] is not None and (
                row["object"] not in artifacts or row["kind"] != Kind.CLIP
            ):
                with suppress(FlagdataError):  # of a malformed row doctor says more
                    artifacts[row["object"]] = Artifact.from_row(row)
    return artifacts


def read_refs(lake: Lake) -> Marked:
    """Reads what every ref shows, for `verify_catalog` and `object_names`, which read it themselves
    where it is not given."""
    return mark(lake, grace=timedelta(0))


def verify_catalog(lake: Lake, marked: Marked | None = None) -> tuple[Finding, ...]:
    """Hashes the catalog's files again and reads every ref; reports what is missing, damaged, a
    link or unchecked."""
    foreign = [
        path for path in _foreign(lake) if path.parent.name not in STORES
    ]  # objects are `verify`'s
    findings = (
        *map(_linked_finding, foreign),
        *(marked or read_refs(lake)).findings,
        *catalog_files(lake),
    )
    return tuple(dict.fromkeys(findings))  # an entry that cannot be read stops both


def object_names(lake: Lake, marked: Marked | None = None) -> list[str]:
    """Lists every object that is stored or that a readable ref needs, sorted; `verify_catalog`
    reports unreadable refs."""
    needed = (marked or read_refs(lake)).objects
    return sorted(needed | {stored.name for stored in lake.objects})


def sample_names(names: Sequence[str], count: int) -> list[str]:
    """Draws `count` of them at random, others each time, so that repeated checks come round to
    all."""
    return sorted(random.SystemRandom().sample(list(names), min(count, len(names))))


def is_healthy(findings: Sequence[Finding]) -> bool:
    """Checks whether there is nothing to act on."""
    return all(f.severity is Severity.NOTE for f in findings)


def _foreign(lake: Lake) -> list[Path]:
    """Lists what is a link or special file, sorted; for what lies in an object, the object."""
    root = lake.path
    if not isinstance(root, Path):
        return []
    paths = set()
    for path in foreign_entries(root):
        parts = path.relative_to(root).parts
        paths.add(root.joinpath(*parts[:2]) if parts[0] in STORES else path)
    return sorted(paths)


def _is_among(path: Place, foreign: Collection[Path]) -> bool:
    return isinstance(path, Path) and path in foreign


def _linked_finding(path: Path) -> Finding:
    return Finding.of(
        "link",
        "a link or special file, or a folder that holds one: its content lies elsewhere, where it "
        "may change",
        where=str(path),
        fix="put in its place what the link leads to; commands that write refuse a lake whose "
        "folders are links",
    )


def _rows(lake: Lake, marked: Marked, foreign: Collection[Path]) -> list[Finding]:
    findings: list[Finding] = []
    identities: set[str] = set()
    gone = set(erased_objects(lake)) - marked.objects if not marked.findings else set()
    for ref, table in marked.refs.items():
        ids = table["artifact"].to_pylist()
        identities_here = set(ids)
        if len(identities_here) < len(ids):
            findings.append(
                Finding.of(
                    "identity-twice",
                    f"{len(ids) - len(identities_here)} rows have an identity that another row has",
                    where=f"ref {ref}",
                    fix="this is a defect of the lake: keep a copy and report it",
                )
            )
        fresh = table.filter(
            pa.array([identity not in identities for identity in ids], type=pa.bool_())
        )
        identities |= identities_here
        for row in fresh.to_pylist():
            if row["object"] not in gone:
                findings += _row(lake, row, identities_here, ref, foreign)
    return findings


_ROW_FIX = "withdraw the artifact and ingest its source again"


def _row(
    lake: Lake,
    row: dict[str, object],
    identities_here: set[str],
    ref: str,
    foreign: Collection[Path],
) -> list[Finding]:
    where = f"{row['kind']} {row['name']!r}, artifact {row['artifact']}, ref {ref}"

    def error(kind: str, message: str, fix: str) -> Finding:
        return Finding(kind=kind, severity=Severity.ERROR, what=message, where=where, fix=fix)

    if int(str(row["format_version"])) > FORMAT_VERSION:
        return [
            error(
                "newer-format",
                f"written by format {row['format_version']}",
                "install the newer flagdata",
            )
        ]
    try:
        artifact = Artifact.from_row(row)
    except FlagdataError as problem:
        return [error("row-malformed", problem.what, _ROW_FIX)]
    findings = [
        error("parent-missing", f"its parent {parent} is not there", "ingest the parent again")
        for parent in artifact.parents
        if parent not in identities_here
    ]
    if artifact.recording is not None and artifact.recording not in identities_here:
        findings.append(
            error(
                "parent-missing",
                f"its recording {artifact.recording} is not there",
                "align it again",
            )
        )
    if artifact.object is None and artifact.source_name is not None:
        findings.append(error("row-malformed", "it names no object", _ROW_FIX))
    if artifact.object is not None:
        again = made_again(artifact)
        if not lake.objects.has(artifact.object):
            findings.append(
                error("dangling-row", f"its object {artifact.object} is missing", again)
            )
        elif (
            artifact.object_bytes is not None
            and not _is_among(
                lake.objects.path(artifact.object), foreign
            )  # of which a finding says more
            and (size := lake.objects.size(artifact.object)) != artifact.object_bytes
        ):
            message = f"its object has {size} bytes instead of {artifact.object_bytes}"
            findings.append(
                error(
                    "object-size",
                    message,
                    f"{again}. flagdata recover saves what a cut-off record still has",
                )
            )
    return findings


def _log_damaged(error: FlagdataError) -> Finding:
    return Finding.of("log-damaged", error.what, where=error.where, fix=error.fix)


def _orphan(stored: StoredObject, limit: float, grace: timedelta) -> Finding:
    old = stored.modified <= limit
    return Finding(
        kind="orphan",
        severity=Severity.WARNING if old else Severity.NOTE,
        what=f"no row refers to {stored.name} ({stored.size} B): its ingest did not finish, or its "
        "rows were withdrawn",
        where=str(stored.path),
        value=float(stored.size),
        fix="run flagdata gc" if old else f"none needed; flagdata gc takes it, {_later(grace)}",
    )


def _left_uploads(
    lake: Lake, states: Sequence[LeaseState], limit: float, grace: timedelta
) -> list[Finding]:
    """Reports each upload to a bucket that was begun and not finished."""
    try:
        return [_left_upload(upload, limit, grace) for upload in left_uploads(lake, states)]
    except StoreError as error:
        return [
            Finding.of(
                "uploads-unlisted",
                "the store does not say whether parts of unfinished uploads are left: "
                f"{error.strerror}",
                where=str(lake.path),
                fix=f"{error.fix}; or give the bucket a lifecycle rule that aborts incomplete "
                "multipart uploads",
            )
        ]


def _left_upload(upload: Upload, limit: float, grace: timedelta) -> Finding:
    old = upload.begun <= limit
    return Finding(
        kind="upload-unfinished",
        severity=Severity.WARNING if old else Severity.NOTE,
        what="a multipart upload was cut off: its parts show nowhere, and are paid for",
        where=str(upload),
        fix="run flagdata gc" if old else f"none needed; flagdata gc aborts it, {_later(grace)}",
    )


def _later(grace: timedelta) -> str:
    hours = grace.total_seconds() / 3600
    return f"once it is {hours:g} h old" if hours < 48 else f"once it is {hours / 24:g} days old"


def _strays(lake: Lake, foreign: Collection[Path]) -> list[Finding]:
    paths_known: set[Place] = {stored.path for stored in lake.objects} | set(foreign)
    strays = [
        path
        for store, suffix in STORES.items()
        for path in (lake.path / store).glob("*")
        if path not in paths_known
        and not OBJECT_NAME.fullmatch(f"{store}/{path.name.removesuffix(suffix + DAMAGED)}")
    ]
    strays = [path for path in [*strays, *lake.refs.strays()] if not is_beside(path.name)]
    return [
        Finding.of(
            "stray-file",
            "neither an object nor a tag or branch: it has no name of theirs",
            where=str(path),
            fix="flagdata did not put it there: move it out of the lake (and flagdata ingest it "
            "from there, if it is"
            " a recording)",
        )
        for path in sorted(strays)  # type: ignore[type-var]
    ]


def _label_clashes(lake: Lake, marked: Marked) -> list[Finding]:
    """Warns of labels that are no columns together, which an earlier version let a merge bring
    together."""
    if marked.findings:
        return []
    return [
        Finding.of(
            "labels-clash",
            f"{clash.what}; queries see a column of texts, or one with a number behind its name",
            where=f"ref {ref}",
            fix=clash.fix({ref: labels}),
        )
        for ref in (MAIN, *lake.refs.branches())
        for labels in [shown_labels(marked.refs[ref])]
        for clash in clashes(labels)
    ]


def _ref_files(lake: Lake) -> list[Finding]:
    """Writes the files of refs anew that do not say what the log says, with the mark of the newest
    version where all of `refs/` is lost, and notes which they were."""
    try:
        stale = lake.refs.stale_files()
    except FlagdataError:  # of which the refs' own finding says more
        return []
    if not stale:
        return []
    try:
        lake.check_writable()
        lake.refs.write_files()
        lake.catalog.renew_mark()
        done, fix = "written anew from the log", "none needed"
    except (OSError, FlagdataError):
        done, fix = (
            "the lake can only be read, so that they stay as they are",
            "none needed: the log says what counts",
        )
    message = (
        f"{count_of(len(stale), 'file')} of tags and branches did not say what the log says: {done}"
    )
    return [Finding.of("ref-file-stale", message, where=str(stale[0]), count=len(stale), fix=fix)]


def _system_files(lake: Lake) -> list[Finding]:
    """Notes files of an operating system in the lake's folders; what lies in objects is passed
    over."""
    lock_names = {COLLECT, TURN}
    system_files = sorted(
        str(path)
        for folder in ("", *FOLDERS)
        for path in (lake.path / folder).glob("*")
        if is_beside(path.name) and path.name not in lock_names and not SCRATCH.fullmatch(path.name)
    )
    if not system_files:
        return []
    message = (
        f"{count_of(len(system_files), 'file')} of an operating system, as .DS_Store: passed over"
    )
    fix = "none needed; they may be deleted"
    note = Severity.NOTE
    return [
        Finding(
            kind="files-beside",
            severity=note,
            what=message,
            where=system_files[0],
            count=len(system_files),
            fix=fix,
        )
    ]


def _abandoned_finding(state: LeaseState) -> Finding:
    records = sorted(state.folder.glob("*.mcap"))
    fix = "run flagdata gc"
    if records:
        fix = (
            "run flagdata gc; to save its unfinished record first: "
            f"{command_line('flagdata', 'recover', records[0])}"
        )
    return Finding.of(
        "staging-left",
        f"a transaction ended without finishing ({state.owner})",
        where=str(state.folder),
        fix=fix,
    )


def _unleased_finding(path: Place, written: float, limit: float, grace: timedelta) -> Finding:
    old = written <= limit
    return Finding(
        kind="staging-unleased",
        severity=Severity.WARNING if old else Severity.NOTE,
        what="in staging without a lease: its owner is unknown",
        where=str(path),
        fix="move it away, or let flagdata gc delete it"
        if old
        else f"none needed; flagdata gc takes it, {_later(grace)}",
    )


def _unpublished_finding(path: Place, limit: float, grace: timedelta) -> Finding:
    old = path.lstat().st_mtime <= limit
    return Finding(
        kind="write-left",
        severity=Severity.WARNING if old else Severity.NOTE,
        what="written by a process that ended before it could publish it",
        where=str(path),
        fix="run flagdata gc" if old else f"none needed; flagdata gc takes it, {_later(grace)}",
    )
