"""`flagdata push|pull|clone`: versions of a lake, moved to another one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING

from flagdata.core.console import echo, progress, say, say_finding
from flagdata.core.json_values import json_values
from flagdata.core.printable import count_of, size_text
from flagdata.verbs.shared_options import OnLake
from flagdata.verbs.verb_options import Result, argument, options, verb

if TYPE_CHECKING:
    from flagdata.lake.copying import Transfer


@options
class Pushing(OnLake):
    """Where versions go."""

    target: str = argument("Another lake: a folder, or s3://bucket/prefix.", "TARGET")


@options
class Pulling(OnLake):
    """Where versions come from."""

    source: str = argument("Another lake: a folder, or s3://bucket/prefix.", "SOURCE")


@options
class Cloning:
    """Which lake is copied, and where to."""

    source: str = argument("A lake: a folder, or s3://bucket/prefix.", "SOURCE")
    target: str = argument("The new lake.", "TARGET")


@verb(Pushing, example='flagdata.push("s3://bucket/field", lake="field.lake")["versions"]')
def push(chosen: Pushing) -> Iterator[Result]:
    """Move the versions that TARGET lacks to it, with their tags, branches and data.

    TARGET is a folder or s3://bucket/prefix with a clone of this lake, or the lake that this one is
    a clone of. Data
    are found by their hash: what is there is not moved again, and a push that was stopped goes on.
    """
    from flagdata.lake import Lake
    from flagdata.lake.copying import transfer

    lake = Lake.open(chosen.target)
    yield from _reporting("push", str(lake.path), transfer(chosen.opened(), lake, bars=progress))


@verb(Pulling, example='flagdata.pull("s3://bucket/field", lake="field.lake")["versions"]')
def pull(chosen: Pulling) -> Iterator[Result]:
    """Bring the versions of SOURCE that this lake lacks in, with their tags, branches and data;
    push's opposite.

    Where SOURCE is behind, as a backup of this lake is, it has nothing new. What this lake lost, or
    what verify found damaged, is taken from it; flagdata heal compares all data before.
    """
    from flagdata.lake import Lake
    from flagdata.lake.copying import pull as pulled

    lake = chosen.opened()
    yield from _reporting(
        "pull", str(lake.path), pulled(Lake.open(chosen.source), lake, bars=progress)
    )


@verb(Cloning, example='flagdata.clone("s3://bucket/field", "field.lake")["head"]')
def clone(chosen: Cloning) -> Iterator[Result]:
    """Make a lake at TARGET with all versions, tags and branches of SOURCE; each a folder or
    s3://bucket/prefix.

    Where it was stopped, flagdata push TARGET --lake SOURCE goes on with it.
    """
    from flagdata.lake import Lake
    from flagdata.lake.copying import clone as cloned

    lake, done = cloned(Lake.open(chosen.source), chosen.target, bars=progress)
    yield from _reporting("clone", str(lake.path), done)


def _reporting(tag: str, address: str, done: Transfer) -> Iterator[Result]:
    yield Result(
        tag,
        {
            "lake": address,
            "head": done.head,
            "versions": done.versions,
            "objects": list(done.objects),
            "bytes": done.size,
            "refs": list(done.refs),
            "findings": json_values(done.findings),
            "healed": [asdict(taken) for taken in done.healed],
        },
    )
    for finding in done.findings:
        say_finding(finding)
    for taken in done.healed:
        say(f"{taken.kind} {taken.name}: {taken.why}")
    refs = f", {count_of(len(done.refs), 'ref')} ({', '.join(done.refs)})" if done.refs else ""
    say(
        f"{count_of(done.versions, 'version')}, {count_of(len(done.objects), 'object')}, "
        f"{size_text(done.size)}{refs}"
    )
    echo(f"{address} is at version {done.head}")
