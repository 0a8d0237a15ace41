"""`flagdata init|log|tag|branch|merge|diff|withdraw`: a lake, its versions and their names."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from flagdata.api.lake_verbs import Naming
from flagdata.commands.list_artifacts import relative
from flagdata.core.console import document, echo, say, table
from flagdata.core.printable import SHORT, count_of
from flagdata.errors import UsageError
from flagdata.verbs.option_types import POSITIVE
from flagdata.verbs.shared_options import OnBranch, OnLake, Reasoned
from flagdata.verbs.verb_options import (
    AsJson,
    Result,
    argument,
    command,
    option,
    options,
    typed_names,
    verb,
)

if TYPE_CHECKING:
    from flagdata.lake import Lake
    from flagdata.lake.refs import Ref


@options
class Making(OnLake):
    """Where a lake is made."""

    folder: Path | str | None = argument(
        "A folder, or s3://bucket/prefix; by default what lake says.", "[FOLDER]", default=None
    )


@verb(Making, example='flagdata.init("new.lake")')
def init(chosen: Making) -> Iterator[Result]:
    """Create an empty lake in FOLDER, which may be s3://bucket/prefix, or where --lake says."""
    from flagdata.core.schema import FORMAT_VERSION
    from flagdata.lake import Lake

    if chosen.folder is not None and "lake" in typed_names(chosen):
        raise UsageError(
            "two folders are given for one lake", fix="give FOLDER or --lake, not both"
        )
    lake = Lake.create(str(chosen.lake) if chosen.folder is None else chosen.folder)
    yield Result("init", {"lake": str(lake.path), "format_version": FORMAT_VERSION})
    echo(lake.path)


@options
class Logging(OnLake):
    """How many commits are listed."""

    limit: int | None = option("The newest commits only.", default=None, type=POSITIVE)


@verb(Logging, example='flagdata.log(lake="field.lake", limit=10)["commits"]')
def log(chosen: Logging) -> Iterator[Result]:
    """List commits, newest first."""
    entries = [
        {
            "version": entry["version"],
            "commit": entry.get("commit"),
            "time": datetime.fromtimestamp(entry["timestamp"] / 1000, UTC).isoformat(
                timespec="seconds"
            ),
            "branch": entry.get("branch"),
            "added": int(entry.get("rows", 0)),
            "withdrawn": int(entry.get("withdrawn", 0)),
            "message": entry.get("message"),
            "code_version": entry.get("code_version"),
        }
        for entry in chosen.opened().catalog.history(chosen.limit)
    ]
    yield Result("log", {"commits": entries})
    columns = ("version", "commit", "time", "branch", "added", "withdrawn", "message")
    table(columns, [[entry[column] for column in columns] for entry in entries])


@options
class NamingCommand(AsJson, Naming):
    """The same on the command line."""


@command(NamingCommand)
def tag(chosen: NamingCommand) -> None:
    """Name what REF shows, for good; without NAME, list the tags.

    The name of a tag that was deleted never shows anything else. A tag keeps how the clips of its
    version are divided; --json shows it.
    """
    from flagdata.dataset import tagged

    lake = chosen.opened()
    if chosen.name is not None and chosen.delete:
        version = lake.delete_tag(chosen.name, chosen.message, discard=chosen.discard)
        _report_deletion("tag", chosen.name, version, as_json=chosen.as_json)
        return
    refs = (
        lake.refs.tags().values()
        if chosen.name is None
        else [tagged.tag(lake, chosen.name, at=chosen.at)]
    )
    _print_refs("tags", refs, as_json=chosen.as_json)


@command(NamingCommand)
def branch(chosen: NamingCommand) -> None:
    """Begin a line of work NAME from what REF shows; without NAME, list the branches.

    A branch that is deleted leaves its commits to the log, to its tags and to branches made from
    it.
    """
    from flagdata.lake.refs import ERASED

    lake = chosen.opened()
    if chosen.name is not None and chosen.delete:
        version = lake.delete_branch(chosen.name, chosen.message, discard=chosen.discard)
        _report_deletion("branch", chosen.name, version, as_json=chosen.as_json)
        return
    if chosen.name is None:
        _print_refs("branches", lake.refs.branches().values(), as_json=chosen.as_json)
        return
    begun = lake.branch(chosen.name, at=chosen.at)
    _print_refs("branches", [begun], as_json=chosen.as_json)
    if (count := begun.notes.get(ERASED)) is not None:
        say(f"{begun.name} does not show {count} of the artifacts: they were erased")


@options
class Merging(Reasoned, OnLake):
    """Which branch is merged."""

    branch: str = argument("The branch whose changes are taken over.", "BRANCH")
    into: str = option("The branch that takes the rows.", default="main")


@verb(Merging, example='flagdata.merge("trial", lake="field.lake")["added"]')
def merge(chosen: Merging) -> Iterator[Result]:
    """Commit on main what BRANCH changed since the two were last the same: what it added, and what
    it withdrew.

    What main withdrew meanwhile stays withdrawn, and is listed where the branch still has it.
    """
    from dataclasses import asdict

    result = chosen.opened().merge(
        chosen.branch, chosen.message or f"merge {chosen.branch}", into=chosen.into
    )
    yield Result("merge", asdict(result))
    for artifact, version in result.left_out.items():
        say(f"stays withdrawn from {chosen.into}: {artifact[:SHORT]}, since version {version}")
    for artifact, version in result.brought_back.items():
        say(
            f"comes back to {chosen.into}: {artifact[:SHORT]}, which version {version} had "
            "withdrawn"
        )
    if result.commit is None:
        echo(f"nothing new on {chosen.branch}")
        return
    withdrawn = f", {len(result.withdrawn)} withdrawn" if result.withdrawn else ""
    echo(
        f"version {result.version}: {len(result.added)} added, {len(result.existing)} were "
        f"there{withdrawn}"
    )


@options
class Comparing(OnLake):
    """Which versions are compared."""

    before: str = argument("A tag, branch, version number or commit.", "BEFORE")
    after: str | None = argument("Another; by default the head of main.", "[AFTER]", default=None)


@verb(Comparing, example='flagdata.diff("v1", lake="field.lake")["added"]')
def diff(chosen: Comparing) -> Iterator[Result]:
    """Rows and objects that AFTER has and BEFORE has not (+), and the other way round (-).

    Both are tags, branches, version numbers or commits; AFTER is the head of main by default.
    """
    from flagdata.lake.merging import difference

    found = difference(chosen.opened(), chosen.before, chosen.after)
    added = [relative(row) for row in found.added.to_pylist()]
    removed = [relative(row) for row in found.removed.to_pylist()]
    content = {"before": chosen.before, "after": chosen.after, "added": added, "removed": removed}
    changed = {
        "objects_added": list(found.objects_added),
        "objects_removed": list(found.objects_removed),
    }
    yield Result("diff", {**content, **changed})
    for sign, rows, objects in (
        ("+", added, found.objects_added),
        ("-", removed, found.objects_removed),
    ):
        for row in rows:
            echo(f"{sign} {row['kind']:<11} {row['artifact'][:SHORT]} {row['name']}")
        for name in objects:
            echo(f"{sign} object      {name}")
    say(f"{count_of(len(added), 'row')} added, {len(removed)} removed")


@options
class Withdrawing(OnBranch, OnLake):
    """What is hidden, from where and why."""

    artifacts: Sequence[str] = argument("Names or ids.", "ARTIFACTS...", nargs=-1)
    message: str = option("Why.", "--message", "-m")
    with_descendants: bool = option(
        "Hide all that was made from them as well, directly or not.", default=False
    )
    everywhere: bool = option(
        "Off every branch, and delete their data at once, also where tags and older versions show "
        "them.",
        default=False,
    )


@verb(
    Withdrawing, example='flagdata.withdraw(["tunnel"], message="out of focus", lake="field.lake")'
)
def withdraw(chosen: Withdrawing) -> Iterator[Result]:
    """Hide artifacts from a branch, a recording with its clips.

    Tags, and the branch that this one began from, keep showing them; gc frees what no ref shows any
    more. With --everywhere the data are erased, and the rows that tags and older versions keep say
    by which version.
    """
    lake, branch = chosen.opened(), chosen.branch
    if chosen.everywhere:
        if "branch" in typed_names(chosen):
            raise UsageError(
                "--everywhere cannot be combined with --branch",
                fix="leave out --branch: every branch is meant",
            )
        yield from _erasing(lake, chosen)
        return
    named = {lake.identity(artifact, at=branch) for artifact in chosen.artifacts}
    made = lake.descendants(named, at=branch) if chosen.with_descendants else frozenset()
    done = lake.withdraw(sorted(named | made), chosen.message, branch=branch)
    along = {"clips": list(done.clips), "descendants": sorted(made)}
    yield Result("withdraw", {"version": done.version, "withdrawn": sorted(named), **along})
    parts = [f"{len(named)} withdrawn from {branch}"]
    if done.clips:
        parts.append(f"{count_of(len(done.clips), 'clip')} went along")
    if made:
        parts.append(f"{len(made)} made from them")
    echo(f"version {done.version}: {', '.join(parts)}")


def _erasing(lake: Lake, chosen: Withdrawing) -> Iterator[Result]:
    from dataclasses import asdict

    from flagdata.lake.removal import BEYOND

    artifacts = [_anywhere(lake, name) for name in chosen.artifacts]
    done = lake.erase(artifacts, chosen.message, with_descendants=chosen.with_descendants)
    yield Result("erasure", {**asdict(done), "not_reached": list(BEYOND)})
    for name, why in done.kept.items():
        say(f"its bytes stay: {name}: {why}")
    say(f"not reached from here: {'; '.join(BEYOND)}")
    tags = f"; listed without data by {', '.join(done.tags)}" if done.tags else ""
    what = (
        f"{count_of(len(done.artifacts), 'artifact')} erased, "
        f"{count_of(len(done.objects), 'object')} deleted"
    )
    echo(f"version {done.version}: {what}{tags}")


def _anywhere(lake: Lake, artifact: str) -> str:
    """The full id of an artifact that a branch or tag shows, or that was erased from all.

    Raises:
        NotFoundError: no branch or tag does, and none did.
    """
    from flagdata.errors import NotFoundError
    from flagdata.lake.removal import erased_as

    for ref in (*lake.refs.branches(), *lake.refs.tags()):
        try:
            return lake.identity(artifact, at=ref)
        except NotFoundError:
            continue
    try:
        return lake.identity(artifact)
    except NotFoundError:
        if found := erased_as(lake, artifact):
            return found
        raise


def _report_deletion(noun: str, name: str, version: int, *, as_json: bool) -> None:
    if as_json:
        document(f"{noun}-deleted", {"version": version, "name": name})
    else:
        echo(f"version {version}: {noun} {name} deleted")


def _print_refs(noun: str, refs: Collection[Ref], *, as_json: bool) -> None:
    entries = [
        {
            "name": ref.name,
            "created": ref.created,
            "view": [{"branch": part.branch, "version": part.version} for part in ref.view],
            "notes": dict(ref.notes),
        }
        for ref in refs
    ]
    if as_json:
        document(noun, {noun: entries})
    elif entries:
        table(
            ("name", "created", "shows" if noun == "tags" else "begins at"),
            [
                [ref.name, ref.created, " + ".join(f"{p.branch}@{p.version}" for p in ref.view)]
                for ref in refs
            ],
        )
    else:
        say(f"no {noun}")
