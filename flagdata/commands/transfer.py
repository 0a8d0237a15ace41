"""`flagdata push|pull|clone`: versions of a lake, moved to another one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from flagdata.console import document, echo, json_option, lake_option, progress, say, say_finding
from flagdata.printable import counted, size_text

if TYPE_CHECKING:
    from flagdata.lake.copying import Transfer


@click.command()
@click.argument("target")
@json_option
@lake_option
def push(target: str, as_json: bool, lake_path: str) -> None:
    """Move the versions that TARGET lacks to it, with their tags, branches and data.

    TARGET is a folder or s3://bucket/prefix with a clone of this lake, or the lake that this one is a clone of. Data
    are found by their hash: what is there is not moved again, and a push that was stopped goes on.
    """
    from flagdata.lake import Lake
    from flagdata.lake.copying import transfer

    lake = Lake.open(target)
    _report("push", str(lake.path), transfer(Lake.open(lake_path), lake, bars=progress), as_json=as_json)


@click.command()
@click.argument("source")
@json_option
@lake_option
def pull(source: str, as_json: bool, lake_path: str) -> None:
    """Bring the versions of SOURCE that this lake lacks in, with their tags, branches and data; push's opposite."""
    from flagdata.lake import Lake
    from flagdata.lake.copying import transfer

    lake = Lake.open(lake_path)
    _report("pull", str(lake.path), transfer(Lake.open(source), lake, bars=progress), as_json=as_json)


@click.command()
@click.argument("source")
@click.argument("target")
@json_option
def clone(source: str, target: str, as_json: bool) -> None:
    """Make a lake at TARGET with all versions, tags and branches of SOURCE; each a folder or s3://bucket/prefix.

    Where it was stopped, flagdata push TARGET --lake SOURCE goes on with it.
    """
    from flagdata.lake import Lake
    from flagdata.lake.copying import clone as cloned

    lake, done = cloned(Lake.open(source), target, bars=progress)
    _report("clone", str(lake.path), done, as_json=as_json)


def _report(tag: str, place: str, done: Transfer, *, as_json: bool) -> None:
    if as_json:
        document(
            tag,
            {
                "lake": place,
                "head": done.head,
                "versions": done.versions,
                "objects": list(done.objects),
                "bytes": done.size,
                "refs": list(done.refs),
                "findings": [finding.as_dict() for finding in done.findings],
            },
        )
        return
    for finding in done.findings:
        say_finding(finding)
    refs = f", {counted(len(done.refs), 'ref')} ({', '.join(done.refs)})" if done.refs else ""
    say(f"{counted(done.versions, 'version')}, {counted(len(done.objects), 'object')}, {size_text(done.size)}{refs}")
    echo(f"{place} is at version {done.head}")
