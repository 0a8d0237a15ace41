"""`flagdata verify|doctor|gc|expire|recover`: is the lake whole, and putting it right."""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from datetime import timedelta
from pathlib import Path

import click

from flagdata.addresses import local_path
from flagdata.console import LocalPath, document, echo, json_option, lake_option, progress, say, table
from flagdata.errors import UsageError
from flagdata.files import check_input
from flagdata.findings import Finding, Severity
from flagdata.printable import counted, size_text
from flagdata.timebase import iso

_GATE_NOT_MET = 3
_CENTURY = 36_525 * 86_400  # s
_UNITS = {"s": 1, "m": 60, "h": 3600, "d": 86_400}


class Duration(click.ParamType):
    """A time span on the command line: a number and s, m, h or d ("24h", "0s")."""

    name = "duration"

    def convert(self, value: str | timedelta, param: click.Parameter | None, ctx: click.Context | None) -> timedelta:
        if isinstance(value, timedelta):
            return value
        match = re.fullmatch(r"(\d{1,9}(?:\.\d+)?)([smhd])", value.strip())
        if match is None:
            self.fail(f"{value!r} is not a duration; write it as 24h, 30m, 7d or 0s", param, ctx)
        seconds = float(match[1]) * _UNITS[match[2]]
        if seconds > _CENTURY:
            self.fail(f"{value!r} is more than a century", param, ctx)
        return timedelta(seconds=seconds)


grace_option = click.option(
    "--older-than",
    "grace",
    type=Duration(),
    default="24h",
    show_default=True,
    metavar="AGE",
    help="How old something must be, with nothing referring to it, to be garbage.",
)


@click.command()
@click.option("--sample", type=click.IntRange(min=1), help="So many objects drawn at random, instead of all.")
@json_option
@lake_option
def verify(sample: int | None, as_json: bool, lake_path: str) -> None:
    """Re-hash the catalog's files and every object; exits with 3 when one is missing or has changed."""
    from flagdata.lake import Lake
    from flagdata.lake.health import object_names, read_refs, sampled, verify_catalog
    from flagdata.lake.health import verify as verified

    lake = Lake.open(lake_path)
    refs = read_refs(lake)
    findings = verify_catalog(lake, refs)
    names = object_names(lake, refs)
    chosen = names if sample is None else sampled(names, sample)
    with progress(len(chosen), label="verify", unit="object") as advance:
        findings += verified(lake, chosen, refs, advance=advance)
    hashed = len(chosen) - sum(finding.kind == "object-missing" for finding in findings)
    _conclude("verify", findings, f"{hashed} of {counted(len(names), 'object')} re-hashed", as_json=as_json)


@click.command()
@click.argument("source", required=False, type=LocalPath())
@click.option("--deep", is_flag=True, help="Re-hash the catalog's files and every object, too.")
@grace_option
@json_option
@lake_option
def doctor(source: Path | None, deep: bool, grace: timedelta, as_json: bool, lake_path: str) -> None:
    """Find and explain what is wrong with a lake; exits with 3 when there is something to act on.

    With SOURCE, an MCAP file or a LeRobot data set of another program, that is examined instead: stamps in order,
    rates, gaps, and what an ingest would leave out.
    """
    if source is not None:
        if deep:
            raise UsageError("--deep cannot be combined with a SOURCE", fix="leave it out: stamps are all that is read")
        _examine(source, as_json=as_json)
        return
    from flagdata.ingest.before import unconfirmed
    from flagdata.lake import Artifact, Lake
    from flagdata.lake.health import catalog_files, read_refs
    from flagdata.lake.health import doctor as examined
    from flagdata.lake.health import verify as verified
    from flagdata.schema import Kind

    lake = Lake.open(lake_path)
    findings = examined(lake, grace=grace)
    if all(f.severity is not Severity.ERROR for f in findings):  # else rows may not be readable
        winds = lake.rows({"kind": Kind.WIND}).to_pylist()
        findings += unconfirmed(Artifact.from_row(row) for row in winds)
    checked = "structure checked, contents not (flagdata verify)"
    if deep:
        findings += tuple(f for f in catalog_files(lake) if f.kind not in {found.kind for found in findings})
        names = [stored.name for stored in lake.objects]
        with progress(len(names), label="re-hash", unit="object") as advance:
            known = {(f.kind, f.where) for f in findings}
            found = verified(lake, names, read_refs(lake), advance=advance)
            findings += tuple(f for f in found if (f.kind, f.where) not in known)
        checked = f"structure checked, {counted(len(names), 'object')} re-hashed"
    _conclude("doctor", findings, checked, as_json=as_json)


def _examine(source: Path, *, as_json: bool) -> None:
    from flagdata.ingest.foreign import as_dict, examine
    from flagdata.lake.health import is_healthy

    found = examine(source)
    if as_json:
        document("foreign", {"source": str(source), **as_dict(found), "healthy": is_healthy(found.findings)})
        if not is_healthy(found.findings):
            sys.exit(_GATE_NOT_MET)
        return
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
    _conclude("doctor", found.findings, f"{found.format}: {counted(len(rows), 'stream')} examined", as_json=False)


@click.command()
@grace_option
@click.option("--dry-run", is_flag=True, help="Say what would be deleted, delete nothing.")
@json_option
@lake_option
def gc(grace: timedelta, dry_run: bool, as_json: bool, lake_path: str) -> None:
    """Delete what no branch, tag or running transaction refers to."""
    from flagdata.lake import Lake
    from flagdata.lake.collection import collect, garbage

    lake = Lake.open(lake_path)
    found = garbage(lake, grace=grace) if dry_run else collect(lake, grace=grace)
    if as_json:
        document(
            "gc",
            {
                "deleted": not dry_run,
                "objects": list(found.objects),
                "leftovers": [str(path) for path in found.leftovers],
                "uploads": [str(upload) for upload in found.uploads],
                "bytes": found.size,
            },
        )
        return
    for name in (*found.objects, *map(str, found.leftovers), *map(str, found.uploads)):
        echo(name)
    verb = "would be deleted" if dry_run else "deleted"
    what = f"{counted(len(found.objects), 'object')} and {counted(len(found.leftovers), 'leftover')}"
    say(f"{what}, {size_text(found.size)}, {verb}")
    if found.uploads:
        say(f"{counted(len(found.uploads), 'unfinished upload')} {'would be aborted' if dry_run else 'aborted'}")
    if found.unlisted is not None:
        say(f"the store does not say which uploads are unfinished: {found.unlisted.strerror}", mark="note")


@click.command()
@click.option("--older-than", type=Duration(), metavar="AGE", help="Versions that another replaced so long ago: 30d.")
@click.option("--keep", type=click.IntRange(min=1), metavar="N", help="All but the newest N versions.")
@click.option("--message", "-m", help="Why.")
@click.option("--dry-run", is_flag=True, help="Say what would go, delete nothing.")
@json_option
@lake_option
def expire(
    older_than: timedelta | None, keep: int | None, message: str | None, dry_run: bool, as_json: bool, lake_path: str
) -> None:
    """Let old versions expire: delete the data that no other version, branch or tag shows, at once.

    The log keeps which versions expired, why, and what went; ls, export and doctor say so. With both options the
    versions expire that both name. Catalog rows stay readable.
    """
    from dataclasses import asdict

    from flagdata.lake import Lake
    from flagdata.lake.removal import expire as expiring
    from flagdata.lake.removal import last_version

    if older_than is None and keep is None:
        raise UsageError("which versions expire is not given", fix="give --older-than AGE, --keep N, or both")
    lake = Lake.open(lake_path)
    found = expiring(lake, last_version(lake, older_than=older_than, keep=keep), message, dry_run=dry_run)
    if as_json:
        document("expire", {**asdict(found), "deleted": not dry_run})
        return
    for name in found.objects:
        echo(name)
    if found.up_to < 0:
        say("no version is that old")
        return
    by = "would expire" if found.version is None else f"expired by version {found.version}"
    gone = f"{counted(len(found.objects), 'object')}, {size_text(found.size)}"
    say(f"versions up to {found.up_to} {by}: {gone}, {'would go' if dry_run else 'deleted'}")


@click.command()
@click.argument("source")
@click.argument("target", type=LocalPath())
@json_option
@lake_option
def recover(source: str, target: Path, as_json: bool, lake_path: str) -> None:
    """Salvage what a cut-off or damaged record still holds.

    SOURCE is an .mcap file or an object of the lake (mcap/…); all that can be read goes to the new file TARGET.
    """
    from flagdata.lake import Lake
    from flagdata.lake.artifact import OBJECT_NAME
    from flagdata.outputs import fresh_file
    from flagdata.record import salvage

    path = Lake.open(lake_path).object_path(source) if OBJECT_NAME.fullmatch(source) else local_path(source)
    check_input(path, noun="record")
    with fresh_file(target) as scratch:
        findings = salvage(path, scratch)
    if as_json:
        document("recover", {"source": str(path), "target": str(target), "findings": [f.as_dict() for f in findings]})
        return
    _print(findings)
    echo(target)


def _conclude(tag: str, findings: Sequence[Finding], checked: str, *, as_json: bool) -> None:
    from flagdata.lake.health import is_healthy

    healthy = is_healthy(findings)
    if as_json:
        document(tag, {"healthy": healthy, "checked": checked, "findings": [f.as_dict() for f in findings]})
    else:
        _print(findings)
        echo("healthy" if healthy else "not healthy")
        say(checked)
    if not healthy:
        sys.exit(_GATE_NOT_MET)


def _print(findings: Sequence[Finding]) -> None:
    for finding in findings:
        echo(f"{finding.severity}: {finding.kind}: {finding.what}")
        if finding.where:
            echo(f"  where: {finding.where}")
        if finding.fix:
            echo(f"  fix:   {finding.fix}")
