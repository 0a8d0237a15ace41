"""`flagdata init|log|tag|branch|merge|diff|withdraw`: a lake, its versions and their names."""

from __future__ import annotations

from collections.abc import Collection
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import click
from click.core import ParameterSource

from flagdata.api.lake_verbs import Naming
from flagdata.commands.artifacts import relative
from flagdata.console import document, echo, json_option, lake_option, say, table
from flagdata.errors import UsageError
from flagdata.options import command, options
from flagdata.printable import SHORT, counted
from flagdata.shared_options import AsJson

if TYPE_CHECKING:
    from flagdata.lake import Lake
    from flagdata.lake.refs import Ref


@click.command()
@click.argument("folder", required=False)
@json_option
@lake_option
@click.pass_context
def init(context: click.Context, folder: str | None, as_json: bool, lake_path: str) -> None:
    """Create an empty lake in FOLDER, which may be s3://bucket/prefix, or where --lake says."""
    from flagdata.lake import Lake
    from flagdata.schema import FORMAT_VERSION

    if folder is not None and context.get_parameter_source("lake_path") is ParameterSource.COMMANDLINE:
        raise UsageError("two folders are given for one lake", fix="give FOLDER or --lake, not both")
    lake = Lake.create(folder if folder is not None else lake_path)
    if as_json:
        document("init", {"lake": str(lake.path), "format_version": FORMAT_VERSION})
    else:
        echo(lake.path)


@click.command()
@click.option("--limit", type=click.IntRange(min=1), help="The newest commits only.")
@json_option
@lake_option
def log(limit: int | None, as_json: bool, lake_path: str) -> None:
    """List commits, newest first."""
    from flagdata.lake import Lake

    entries = [
        {
            "version": entry["version"],
            "commit": entry.get("commit"),
            "time": datetime.fromtimestamp(entry["timestamp"] / 1000, UTC).isoformat(timespec="seconds"),
            "branch": entry.get("branch"),
            "added": int(entry.get("rows", 0)),
            "withdrawn": int(entry.get("withdrawn", 0)),
            "message": entry.get("message"),
            "code_version": entry.get("code_version"),
        }
        for entry in Lake.open(lake_path).catalog.history(limit)
    ]
    if as_json:
        document("log", {"commits": entries})
    else:
        columns = ("version", "commit", "time", "branch", "added", "withdrawn", "message")
        table(columns, [[entry[column] for column in columns] for entry in entries])


@options
class NamingCommand(AsJson, Naming):
    """The same on the command line."""


@command(NamingCommand)
def tag(chosen: NamingCommand) -> None:
    """Name what REF shows, for good; without NAME, list the tags.

    The name of a tag that was deleted never shows anything else.
    """
    from flagdata.dataset.source import opened

    lake = opened(chosen.lake).lake
    if chosen.name is not None and chosen.delete:
        version = lake.delete_tag(chosen.name, chosen.message, discard=chosen.discard)
        _report_deletion("tag", chosen.name, version, as_json=chosen.as_json)
        return
    refs = lake.refs.tags().values() if chosen.name is None else [lake.tag(chosen.name, at=chosen.at)]
    _print_refs("tags", refs, as_json=chosen.as_json)


@command(NamingCommand)
def branch(chosen: NamingCommand) -> None:
    """Begin a line of work NAME from what REF shows; without NAME, list the branches.

    A branch that is deleted leaves its commits to the log, to its tags and to branches made from it.
    """
    from flagdata.dataset.source import opened

    lake = opened(chosen.lake).lake
    if chosen.name is not None and chosen.delete:
        version = lake.delete_branch(chosen.name, chosen.message, discard=chosen.discard)
        _report_deletion("branch", chosen.name, version, as_json=chosen.as_json)
        return
    refs = lake.refs.branches().values() if chosen.name is None else [lake.branch(chosen.name, at=chosen.at)]
    _print_refs("branches", refs, as_json=chosen.as_json)


@click.command()
@click.argument("branch_name", metavar="BRANCH")
@click.option("--into", default="main", show_default=True, help="The branch that takes the rows.")
@click.option("--message", "-m", help="What is merged and why.")
@json_option
@lake_option
def merge(branch_name: str, into: str, message: str | None, as_json: bool, lake_path: str) -> None:
    """Commit on main what BRANCH changed since the two were last the same: what it added, and what it withdrew.

    What main withdrew meanwhile stays withdrawn, and is listed where the branch still has it.
    """
    from dataclasses import asdict

    from flagdata.lake import Lake

    result = Lake.open(lake_path).merge(branch_name, message or f"merge {branch_name}", into=into)
    if as_json:
        document("merge", asdict(result))
        return
    for artifact, version in result.left_out.items():
        say(f"stays withdrawn from {into}: {artifact[:SHORT]}, since version {version}")
    for artifact, version in result.brought_back.items():
        say(f"comes back to {into}: {artifact[:SHORT]}, which version {version} had withdrawn")
    if result.commit is None:
        echo(f"nothing new on {branch_name}")
        return
    withdrawn = f", {len(result.withdrawn)} withdrawn" if result.withdrawn else ""
    echo(f"version {result.version}: {len(result.added)} added, {len(result.existing)} were there{withdrawn}")


@click.command()
@click.argument("before")
@click.argument("after", required=False)
@json_option
@lake_option
def diff(before: str, after: str | None, as_json: bool, lake_path: str) -> None:
    """Rows and objects that AFTER has and BEFORE has not (+), and the other way round (-).

    Both are tags, branches, version numbers or commits; AFTER is the head of main by default.
    """
    from flagdata.lake import Lake
    from flagdata.lake.merging import difference

    found = difference(Lake.open(lake_path), before, after)
    added = [relative(row) for row in found.added.to_pylist()]
    removed = [relative(row) for row in found.removed.to_pylist()]
    if as_json:
        content = {"before": before, "after": after, "added": added, "removed": removed}
        objects = {"objects_added": list(found.objects_added), "objects_removed": list(found.objects_removed)}
        document("diff", {**content, **objects})
        return
    for sign, rows, objects in (("+", added, found.objects_added), ("-", removed, found.objects_removed)):
        for row in rows:
            echo(f"{sign} {row['kind']:<11} {row['artifact'][:SHORT]} {row['name']}")
        for name in objects:
            echo(f"{sign} object      {name}")
    say(f"{counted(len(added), 'row')} added, {len(removed)} removed")


@click.command()
@click.argument("artifacts", nargs=-1, required=True)
@click.option("--message", "-m", required=True, help="Why.")
@click.option("--branch", "branch_name", default="main", show_default=True, help="The branch to take them off.")
@click.option("--with-descendants", is_flag=True, help="Hide all that was made from them as well, directly or not.")
@click.option(
    "--everywhere",
    is_flag=True,
    help="Off every branch, and delete their data at once, also where tags and older versions show them.",
)
@json_option
@lake_option
@click.pass_context
def withdraw(
    context: click.Context,
    artifacts: tuple[str, ...],
    message: str,
    branch_name: str,
    with_descendants: bool,
    everywhere: bool,
    as_json: bool,
    lake_path: str,
) -> None:
    """Hide artifacts from a branch, a recording with its clips.

    Tags, and the branch that this one began from, keep showing them; gc frees what no ref shows any more. With
    --everywhere the data are erased, and the rows that tags and older versions keep say by which version.
    """
    from flagdata.lake import Lake

    lake = Lake.open(lake_path)
    if everywhere:
        if context.get_parameter_source("branch_name") is ParameterSource.COMMANDLINE:
            raise UsageError(
                "--everywhere cannot be combined with --branch", fix="leave out --branch: every branch is meant"
            )
        _erase(lake, artifacts, message, with_descendants=with_descendants, as_json=as_json)
        return
    named = {lake.identity(artifact, at=branch_name) for artifact in artifacts}
    made = lake.descendants(named, at=branch_name) if with_descendants else frozenset()
    done = lake.withdraw(sorted(named | made), message, branch=branch_name)
    if as_json:
        along = {"clips": list(done.clips), "descendants": sorted(made)}
        document("withdraw", {"version": done.version, "withdrawn": sorted(named), **along})
        return
    parts = [f"{len(named)} withdrawn from {branch_name}"]
    if done.clips:
        parts.append(f"{counted(len(done.clips), 'clip')} went along")
    if made:
        parts.append(f"{len(made)} made from them")
    echo(f"version {done.version}: {', '.join(parts)}")


def _erase(lake: Lake, artifacts: tuple[str, ...], message: str, *, with_descendants: bool, as_json: bool) -> None:
    from dataclasses import asdict

    from flagdata.lake.removal import BEYOND

    done = lake.erase([_anywhere(lake, one) for one in artifacts], message, with_descendants=with_descendants)
    if as_json:
        document("erasure", {**asdict(done), "not_reached": list(BEYOND)})
        return
    for name, why in done.kept.items():
        say(f"its bytes stay: {name}: {why}")
    say(f"not reached from here: {'; '.join(BEYOND)}")
    tags = f"; listed without data by {', '.join(done.tags)}" if done.tags else ""
    what = f"{counted(len(done.artifacts), 'artifact')} erased, {counted(len(done.objects), 'object')} deleted"
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
        }
        for ref in refs
    ]
    if as_json:
        document(noun, {noun: entries})
    elif entries:
        table(
            ("name", "created", "shows" if noun == "tags" else "begins at"),
            [[ref.name, ref.created, " + ".join(f"{p.branch}@{p.version}" for p in ref.view)] for ref in refs],
        )
    else:
        say(f"no {noun}")
