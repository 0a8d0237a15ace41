"""`flagdata verify|doctor|heal|gc|expire|recover`: is the lake whole, and putting it right."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import timedelta
from pathlib import Path

from flagdata.core.console import LocalPath, echo, progress, say, table
from flagdata.core.files.addresses import local_path
from flagdata.core.files.regular_files import check_input
from flagdata.core.findings import Finding, Severity
from flagdata.core.json_values import json_values
from flagdata.core.printable import count_of, size_text
from flagdata.errors import UsageError
from flagdata.timebase import iso
from flagdata.verbs.option_types import DURATION, POSITIVE
from flagdata.verbs.shared_options import OfGarbage, OnLake, Reasoned, Rehearsed
from flagdata.verbs.verb_options import Result, argument, option, options, verb

_GATE_NOT_MET = 3


@options
class Verifying(OnLake):
    """How much of a lake is re-hashed."""

    sample: int | None = option(
        "So many objects drawn at random, instead of all.", default=None, type=POSITIVE
    )


@verb(Verifying, example='flagdata.verify(lake="field.lake")["healthy"]')
def verify(chosen: Verifying) -> Iterator[Result]:
    """Re-hash the catalog's files and every object; exits with 3 when one is missing or has
    changed."""
    from flagdata.lake.health import object_names, read_refs, sample_names, verify_catalog
    from flagdata.lake.health import verify as verified

    lake = chosen.opened()
    refs = read_refs(lake)
    findings = verify_catalog(lake, refs)
    names = object_names(lake, refs)
    drawn = names if chosen.sample is None else sample_names(names, chosen.sample)
    with progress(len(drawn), label="verify", unit="object") as advance:
        findings += verified(lake, drawn, refs, advance=advance)
    hashed = len(drawn) - sum(finding.kind == "object-missing" for finding in findings)
    yield from _concluding(
        "verify", findings, f"{hashed} of {count_of(len(names), 'object')} re-hashed"
    )


@options
class Examining(OfGarbage, OnLake):
    """What is examined, and how thoroughly."""

    source: Path | str | None = argument(
        "An MCAP file or a LeRobot data set, instead of a lake.",
        "[SOURCE]",
        default=None,
        type=LocalPath(),
    )
    deep: bool = option("Re-hash the catalog's files and every object, too.", default=False)


@verb(Examining, example='flagdata.doctor(lake="field.lake")["findings"]')
def doctor(chosen: Examining) -> Iterator[Result]:
    """Find and explain what is wrong with a lake; exits with 3 when there is something to act on.

    With SOURCE, an MCAP file or a LeRobot data set of another program, that is examined instead:
    stamps in order, rates, gaps, and what an ingest would leave out.
    """
    if chosen.source is not None:
        if chosen.deep:
            raise UsageError(
                "--deep cannot be combined with a SOURCE",
                fix="leave it out: stamps are all that is read",
            )
        yield from _examining(local_path(chosen.source))
        return
    from flagdata.core.schema import Kind
    from flagdata.ingest.before import unconfirmed_findings
    from flagdata.lake import Artifact
    from flagdata.lake.health import catalog_files, read_refs
    from flagdata.lake.health import doctor as examined
    from flagdata.lake.health import verify as verified

    lake = chosen.opened()
    findings = examined(lake, grace=timedelta(seconds=chosen.grace))
    if all(f.severity is not Severity.ERROR for f in findings):  # else rows may not be readable
        winds = lake.rows({"kind": Kind.WIND}).to_pylist()
        findings += unconfirmed_findings(Artifact.from_row(row) for row in winds)
    checked = "structure checked, contents not (flagdata verify)"
    if chosen.deep:
        findings += tuple(
            f for f in catalog_files(lake) if f.kind not in {found.kind for found in findings}
        )
        names = [stored.name for stored in lake.objects]
        with progress(len(names), label="re-hash", unit="object") as advance:
            known = {(f.kind, f.where) for f in findings}
            found = verified(lake, names, read_refs(lake), advance=advance)
            findings += tuple(f for f in found if (f.kind, f.where) not in known)
        checked = f"structure checked, {count_of(len(names), 'object')} re-hashed"
    yield from _concluding("doctor", findings, checked)


def _examining(source: Path) -> Iterator[Result]:
    from flagdata.ingest.foreign import examine
    from flagdata.lake.health import is_healthy

    found = examine(source)
    healthy = is_healthy(found.findings)
    content = {"source": str(source), **json_values(found), "healthy": healthy}
    yield Result("foreign", content, 0 if healthy else _GATE_NOT_MET)
    header = ("stream", "holds", "messages", "rate [Hz]", "from", "to")
    rows = [
        (
            one.name,
            one.holds,
            one.count,
            "" if one.rate is None else f"{one.rate:.4g}",
            iso(one.start),
            iso(one.end),
        )
        for one in found.streams
    ]
    table(header, rows)
    _print_health(found.findings, f"{found.format}: {count_of(len(rows), 'stream')} examined")


@options
class Healing(OnLake):
    """Where what a lake lost is taken from."""

    source: str = argument(
        "A clone or a backup of this lake: a folder, or s3://bucket/prefix.", "FROM"
    )


@verb(Healing, example='flagdata.heal("backup.lake", lake="field.lake")["left"]')
def heal(chosen: Healing) -> Iterator[Result]:
    """Take what is damaged or missing in this lake from FROM; exits with 3 when something is left.

    FROM is a clone or a backup of this lake, older or newer, or the lake that this one is a clone
    of. It may be damaged
    itself: what is right by its hash is taken. What is whole here stays, and nothing newer comes
    in. All data of this lake are compared with their hashes. A heal that was stopped goes on when
    it is given again.
    """
    from dataclasses import asdict

    from flagdata.lake import Lake
    from flagdata.lake.restoring import heal as healed

    lake = chosen.found()
    done = healed(lake, Lake.found(chosen.source), bars=progress)
    content = {
        "lake": str(lake.path),
        "taken": [asdict(taken) for taken in done.taken],
        "left": json_values(done.left),
    }
    yield Result("heal", content, _GATE_NOT_MET if done.left else 0)
    for taken in done.taken:
        echo(f"{taken.kind} {taken.name}: {taken.why}")
    _print(done.left)
    size = size_text(sum(taken.size for taken in done.taken))
    say(
        f"{count_of(len(done.taken), 'item')} taken, {size}; {len(done.left) or 'nothing'} still "
        "damaged"
    )


@options
class Collecting(OfGarbage, Rehearsed, OnLake):
    """What is deleted."""


@verb(Collecting, example='flagdata.gc(lake="field.lake", dry_run=True)["bytes"]')
def gc(chosen: Collecting) -> Iterator[Result]:
    """Delete what no branch, tag or running transaction refers to."""
    from flagdata.lake.collection import collect, garbage

    dry_run, grace = chosen.dry_run, timedelta(seconds=chosen.grace)
    found = (garbage if dry_run else collect)(chosen.opened(), grace=grace)
    yield Result(
        "gc",
        {
            "deleted": not dry_run,
            "objects": list(found.objects),
            "leftovers": [str(path) for path in found.leftovers],
            "uploads": [str(upload) for upload in found.uploads],
            "bytes": found.size,
        },
    )
    for name in (*found.objects, *map(str, found.leftovers), *map(str, found.uploads)):
        echo(name)
    verb = "would be deleted" if dry_run else "deleted"
    what = (
        f"{count_of(len(found.objects), 'object')} and {count_of(len(found.leftovers), 'leftover')}"
    )
    say(f"{what}, {size_text(found.size)}, {verb}")
    if found.uploads:
        say(
            f"{count_of(len(found.uploads), 'unfinished upload')} "
            f"{'would be aborted' if dry_run else 'aborted'}"
        )
    if found.unlisted is not None:
        say(
            f"the store does not say which uploads are unfinished: {found.unlisted.strerror}",
            mark="note",
        )


@options
class Expiring(Reasoned, Rehearsed, OnLake):
    """Which versions expire."""

    older_than: float | None = option(
        "Versions that another replaced so long ago [s]: 30d.",
        default=None,
        type=DURATION,
        metavar="AGE",
    )
    keep: int | None = option(
        "All but the newest N versions.", default=None, type=POSITIVE, metavar="N"
    )


@verb(Expiring, example='flagdata.expire(lake="field.lake", keep=20)["objects"]')
def expire(chosen: Expiring) -> Iterator[Result]:
    """Let old versions expire: delete the data that no other version, branch or tag shows, at once.

    The log keeps which versions expired, why, and what went; ls, export and doctor say so. With
    both options the versions expire that both name. Catalog rows stay readable.
    """
    from dataclasses import asdict

    from flagdata.lake.removal import expire as expiring
    from flagdata.lake.removal import last_version

    if chosen.older_than is None and chosen.keep is None:
        raise UsageError(
            "which versions expire is not given", fix="give --older-than AGE, --keep N, or both"
        )
    lake, dry_run = chosen.opened(), chosen.dry_run
    older_than = None if chosen.older_than is None else timedelta(seconds=chosen.older_than)
    last = last_version(lake, older_than=older_than, keep=chosen.keep)
    found = expiring(lake, last, chosen.message, dry_run=dry_run)
    yield Result("expire", {**asdict(found), "deleted": not dry_run})
    for name in found.objects:
        echo(name)
    if found.up_to < 0:
        say("no version is that old")
        return
    by = "would expire" if found.version is None else f"expired by version {found.version}"
    gone = f"{count_of(len(found.objects), 'object')}, {size_text(found.size)}"
    say(f"versions up to {found.up_to} {by}: {gone}, {'would go' if dry_run else 'deleted'}")


@options
class Recovering(OnLake):
    """What is salvaged, and where it goes."""

    source: Path | str = argument("An .mcap file, or an object of the lake (mcap/…).", "SOURCE")
    target: Path | str = argument("The new file.", "TARGET", type=LocalPath())


@verb(Recovering, example='flagdata.recover("cut.mcap", "whole.mcap")["findings"]')
def recover(chosen: Recovering) -> Iterator[Result]:
    """Salvage what a cut-off or damaged record still holds.

    SOURCE is an .mcap file or an object of the lake (mcap/…); all that can be read goes to the new
    file TARGET.
    """
    from flagdata.core.files.outputs import fresh_file
    from flagdata.lake.artifact import OBJECT_NAME
    from flagdata.record import salvage

    source, target = str(chosen.source), local_path(chosen.target)
    path = (
        chosen.opened().object_path(source) if OBJECT_NAME.fullmatch(source) else local_path(source)
    )
    check_input(path, noun="record")
    with fresh_file(target) as scratch:
        findings = salvage(path, scratch)
    found = json_values(findings)
    yield Result("recover", {"source": str(path), "target": str(target), "findings": found})
    _print(findings)
    echo(target)


def _concluding(tag: str, findings: Sequence[Finding], checked: str) -> Iterator[Result]:
    from flagdata.lake.health import is_healthy

    healthy = is_healthy(findings)
    content = {
        "healthy": healthy,
        "checked": checked,
        "findings": json_values(findings),
    }
    yield Result(tag, content, 0 if healthy else _GATE_NOT_MET)
    _print_health(findings, checked)


def _print_health(findings: Sequence[Finding], checked: str) -> None:
    from flagdata.lake.health import is_healthy

    _print(findings)
    echo("healthy" if is_healthy(findings) else "not healthy")
    say(checked)


def _print(findings: Sequence[Finding]) -> None:
    for finding in findings:
        echo(f"{finding.severity}: {finding.kind}: {finding.what}")
        if finding.where:
            echo(f"  where: {finding.where}")
        if finding.fix:
            echo(f"  fix:   {finding.fix}")
