"""`flagdata init|ls|show|log|tag|branch|diff|withdraw`: looking at a lake and naming its versions."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, TypeVar

import click
from click.core import ParameterSource

from flagdata.console import at_option, document, json_option, lake_option, say, table
from flagdata.errors import UsageError

if TYPE_CHECKING:
    from flagdata.lake import Lake
    from flagdata.lake.refs import Ref

F = TypeVar("F", bound=Callable[..., Any])

_MOST = 20
"""Parents, and artifacts made from one, that are listed without --all."""
_INNER = ("recipe", "parameters", "clock_model", "recipe_hash")
"""Columns that are JSON or hashes, for --all."""
_SHORT = 12  # characters of an id that are shown; look-ups take any unique beginning


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
        raise UsageError("two folders for one lake", fix="give FOLDER or --lake, not both")
    lake = Lake.create(folder if folder is not None else lake_path)
    if as_json:
        document("init", {"lake": str(lake.path), "format_version": FORMAT_VERSION})
    else:
        click.echo(lake.path)


@click.command()
@click.option("--kind", metavar="KIND", help="Only this kind: camera, wind, recording, clip, meshes, …")
@at_option
@json_option
@lake_option
def ls(kind: str | None, at: str | None, as_json: bool, lake_path: str) -> None:
    """List artifacts, clips counted only (--kind clip lists them); filters and SQL are `flagdata query`'s."""
    from flagdata.errors import UnknownNameError
    from flagdata.lake import Lake
    from flagdata.lake.matching import matching
    from flagdata.lake.removals import lost
    from flagdata.lake.revisions import superseded
    from flagdata.schema import Kind

    if kind is not None and kind not in list(Kind):
        raise UnknownNameError.of("kind", kind, [k.value for k in Kind])
    lake = Lake.open(lake_path)
    found = lake.rows(None if kind is None else {"kind": kind}, at=at, columns=["name", "object"])
    rows = lake.rows("kind <> 'clip'" if kind is None else {"kind": kind}, at=at).to_pylist()
    gone = lost(lake, found)
    older = superseded(row for row in rows if row["kind"] in (Kind.MEASUREMENT, Kind.MODEL))
    clips = found.num_rows - len(rows)
    if as_json:
        listed = [
            {
                **_plain(row), "data": "lost" if row["object"] in gone else "there",
                "superseded": row["artifact"] in older,
            }
            for row in rows
        ]  # fmt: skip
        document("ls", {"at": at, "artifacts": listed, "clips_not_listed": clips})
        return
    header = ("artifact", "kind", "name", "start", "frames", "wind [m/s]", "size", "quality")
    if rows:
        lines = [_line(row, lost=row["object"] in gone, superseded=row["artifact"] in older) for row in rows]
        table(header, lines)
    more = f" and {counted(clips, 'clip')} (--kind clip lists them)" if clips else ""
    say(f"{counted(len(rows), 'artifact')}{more}" if found.num_rows else "no artifacts")
    for name, why in gone.items():
        names = sorted(matching(found, {"object": name})["name"].unique().to_pylist())
        say(f"without data: {', '.join(names)}: {why.what}")


@click.command()
@click.argument("artifact")
@click.option("--all", "whole", is_flag=True, help="All columns, with their JSON, and all that was made from it.")
@at_option
@json_option
@lake_option
def show(artifact: str, whole: bool, at: str | None, as_json: bool, lake_path: str) -> None:
    """Show one artifact: what it says, what it was made from and what was made from it.

    ARTIFACT is an id or its beginning, a name, the file it came from, or NAME@TAG. Of a verdict or a measurement its
    sentence comes first, of a network its card.
    """
    from flagdata.ingest.before import unconfirmed
    from flagdata.lake import Lake
    from flagdata.lake.labels import PREFIX
    from flagdata.lake.results import versions
    from flagdata.lake.tabled import labels_of

    lake = Lake.open(lake_path)
    found = lake.artifact(artifact, at=at)
    row = _plain(found.row())
    for column in ("recipe", "parameters", "clock_model", "report"):
        row[column] = json.loads(row[column]) if row[column] else None
    shown = lake.table(lake.view(at))
    labels = labels_of(shown).get(found.id, {})
    others = shown.select(["artifact", "kind", "name", "parents"]).to_pylist()
    parents = [_relative(other) for other in others if other["artifact"] in row["parents"]]
    children = [_relative(other) for other in others if row["artifact"] in other["parents"]]
    path = lake.objects.path(row["object"]) if row["object"] else None
    doubts = unconfirmed([found])
    stated = [
        {"version": number, "artifact": one.id, "code_version": one.code_version}
        for number, one in enumerate(versions(lake, found, at=at), start=1)
    ]
    if as_json:
        document(
            "show",
            {
                "artifact": row, "labels": labels, "path": str(path) if path else None, "parents": parents,
                "children": children, "versions": stated,
                "findings": [finding.as_dict() for finding in doubts],
            },
        )  # fmt: skip
        return
    for name, text in _gist(lake, row):
        click.echo(f"{name:<15} {text}")
    left_out = ("parents", "report") if whole else ("parents", "report", *_INNER)
    for column, value in row.items():
        if value is not None and value != [] and column not in left_out:
            click.echo(f"{column:<15} {said(column, value)}")
    for name, value in labels.items():
        click.echo(f"{PREFIX + name:<15} {value}")
    if path is not None:
        click.echo(f"{'path':<15} {path}")
    for one in stated if len(stated) > 1 else ():
        this = " (this one)" if one["artifact"] == found.id else ""
        label = f"version {one['version']}"
        click.echo(f"{label:<15} {one['artifact'][:_SHORT]} by code {one['code_version']}{this}")
    for label, relatives in (("made from", parents), ("made into", children)):
        for relative in relatives if whole else relatives[:_MOST]:
            click.echo(f"{label:<15} {relative['artifact'][:_SHORT]} {relative['kind']} {relative['name']}")
        if len(relatives) > _MOST and not whole:
            kinds = Counter(relative["kind"] for relative in relatives[_MOST:])
            more = ", ".join(counted(count, kind) for kind, count in sorted(kinds.items()))
            click.echo(f"{label:<15} … and {more} more (--all lists them)")
    for finding in (*(row["report"] or {}).get("findings", []), *(finding.as_dict() for finding in doubts)):
        click.echo(f"{finding.get('severity', 'note'):<15} {finding.get('kind')}: {finding.get('what')}")


def _gist(lake: Lake, row: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """What matters of an artifact of its kind: a sentence of its report, what a model adds, a network's card."""
    from flagdata.schema import Kind

    report = row["report"] or {}
    if sentence := report.get("sentence") or report.get("words"):
        yield "says", sentence
    if row["kind"] == Kind.MODEL and row["parameters"]:
        yield "adds", ", ".join(row["parameters"].get("effects", {})) or "nothing to the base model"
    if row["kind"] == Kind.NETWORK and row["object"]:
        card = json.loads((lake.object_path(row["object"]) / "card.json").read_text(encoding="utf-8"))
        size = f"{card['parameters']:,} parameters, {card['epochs']} epochs, seed {card['seed']}"
        yield "card", f"{card['title']}; {size}"


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


def _deletion_options(command: F) -> F:
    """Adds --delete, --discard and --message to the command of tags or of branches."""
    for option in (
        click.option("--message", "-m", help="--delete: why."),
        click.option(
            "--discard",
            is_flag=True,
            help="--delete: even if no other tag or branch shows its artifacts, which gc then deletes.",
        ),
        click.option("-d", "--delete", is_flag=True, help="Delete NAME; the log notes what it showed."),
    ):
        command = option(command)
    return command


def _check_ref_options(name: str | None, given: Mapping[str, object], *, delete: bool) -> None:
    allowed = () if name is None else ("--discard", "--message") if delete else ("--at",)
    if name is None and delete:
        raise UsageError("--delete without a NAME", fix="give the NAME of what is to be deleted")
    for option, value in given.items():
        if value and option not in allowed:
            what = "without a NAME" if name is None else "with --delete" if delete else "without --delete"
            raise UsageError(f"{option} {what}", fix="leave it out, or see --help")


@click.command()
@click.argument("name", required=False)
@at_option
@_deletion_options
@json_option
@lake_option
def tag(
    name: str | None, at: str | None, delete: bool, discard: bool, message: str | None, as_json: bool, lake_path: str
) -> None:
    """Name what REF shows, for good; without NAME, list the tags.

    The name of a tag that was deleted never shows anything else.
    """
    from flagdata.lake import Lake

    _check_ref_options(name, {"--at": at, "--discard": discard, "--message": message}, delete=delete)
    lake = Lake.open(lake_path)
    if name is not None and delete:
        _report_deletion("tag", name, lake.delete_tag(name, message, discard=discard), as_json=as_json)
        return
    refs = lake.refs.tags().values() if name is None else [lake.tag(name, at=at)]
    _print_refs("tags", refs, as_json=as_json)


@click.command()
@click.argument("name", required=False)
@at_option
@_deletion_options
@json_option
@lake_option
def branch(
    name: str | None, at: str | None, delete: bool, discard: bool, message: str | None, as_json: bool, lake_path: str
) -> None:
    """Begin a line of work NAME from what REF shows; without NAME, list the branches.

    A branch that is deleted leaves its commits to the log, to its tags and to branches made from it.
    """
    from flagdata.lake import Lake

    _check_ref_options(name, {"--at": at, "--discard": discard, "--message": message}, delete=delete)
    lake = Lake.open(lake_path)
    if name is not None and delete:
        _report_deletion("branch", name, lake.delete_branch(name, message, discard=discard), as_json=as_json)
        return
    refs = lake.refs.branches().values() if name is None else [lake.branch(name, at=at)]
    _print_refs("branches", refs, as_json=as_json)


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
        say(f"stays withdrawn from {into}: {artifact[:_SHORT]}, since version {version}")
    for artifact, version in result.brought_back.items():
        say(f"comes back to {into}: {artifact[:_SHORT]}, which version {version} had withdrawn")
    if result.commit is None:
        click.echo(f"nothing new on {branch_name}")
        return
    withdrawn = f", {len(result.withdrawn)} withdrawn" if result.withdrawn else ""
    click.echo(f"version {result.version}: {len(result.added)} added, {len(result.existing)} were there{withdrawn}")


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
    from flagdata.lake.difference import difference

    found = difference(Lake.open(lake_path), before, after)
    added = [_relative(row) for row in found.added.to_pylist()]
    removed = [_relative(row) for row in found.removed.to_pylist()]
    if as_json:
        content = {"before": before, "after": after, "added": added, "removed": removed}
        objects = {"objects_added": list(found.objects_added), "objects_removed": list(found.objects_removed)}
        document("diff", {**content, **objects})
        return
    for sign, rows, objects in (("+", added, found.objects_added), ("-", removed, found.objects_removed)):
        for row in rows:
            click.echo(f"{sign} {row['kind']:<11} {row['artifact'][:_SHORT]} {row['name']}")
        for name in objects:
            click.echo(f"{sign} object      {name}")
    say(f"{counted(len(added), 'row')} added, {len(removed)} removed")


@click.command()
@click.argument("artifacts", nargs=-1, required=True)
@click.option("--message", "-m", required=True, help="Why.")
@click.option("--branch", "branch_name", default="main", show_default=True, help="The branch to take them off.")
@click.option("--with-descendants", is_flag=True, help="Hide all that was made from them as well, directly or not.")
@click.option(
    "--everywhere", is_flag=True,
    help="Off every branch, and delete their data at once, also where tags and older versions show them.",
)  # fmt: skip
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
            raise UsageError("--everywhere with --branch", fix="leave out --branch: every branch is meant")
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
    click.echo(f"version {done.version}: {', '.join(parts)}")


def _erase(lake: Lake, artifacts: tuple[str, ...], message: str, *, with_descendants: bool, as_json: bool) -> None:
    from dataclasses import asdict

    from flagdata.lake.erasure import BEYOND

    done = lake.erase([_anywhere(lake, one) for one in artifacts], message, with_descendants=with_descendants)
    if as_json:
        document("erasure", {**asdict(done), "not_reached": list(BEYOND)})
        return
    for name, why in done.kept.items():
        say(f"its bytes stay: {name}: {why}")
    say(f"not reached from here: {'; '.join(BEYOND)}")
    tags = f"; listed without data by {', '.join(done.tags)}" if done.tags else ""
    what = f"{counted(len(done.artifacts), 'artifact')} erased, {counted(len(done.objects), 'object')} deleted"
    click.echo(f"version {done.version}: {what}{tags}")


def _anywhere(lake: Lake, artifact: str) -> str:
    """The full id of an artifact that a branch or tag shows.

    Raises:
        NotFoundError: no branch or tag does.
    """
    from flagdata.errors import NotFoundError

    for ref in (*lake.refs.branches(), *lake.refs.tags()):
        try:
            return lake.identity(artifact, at=ref)
        except NotFoundError:
            continue
    return lake.identity(artifact)


def _report_deletion(noun: str, name: str, version: int, *, as_json: bool) -> None:
    if as_json:
        document(f"{noun}-deleted", {"version": version, "name": name})
    else:
        click.echo(f"version {version}: {noun} {name} deleted")


def counted(count: int, noun: str) -> str:
    """ "1 object", "2 objects": for nouns that take an s."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def size_text(size: float | None) -> str:
    """Bytes for people: "12.3 MB", decimal units."""
    if size is None:
        return ""
    for unit in ("B", "kB", "MB", "GB"):
        if size < 1000:
            return f"{size:.0f} {unit}" if unit == "B" else f"{size:.1f} {unit}"
        size /= 1000
    return f"{size:.1f} TB"


def _line(row: Mapping[str, Any], *, lost: bool, superseded: bool) -> list[object]:
    from flagdata.documents import column_json
    from flagdata.schema import Kind
    from flagdata.timebase import iso

    wind = "" if row["wind"] is None else f"{row['wind']:.2f}"
    if row["kind"] == Kind.WIND:  # a log's mean, over all of it
        mean = (column_json(row["report"], "report", artifact=row["artifact"]) if row["report"] else {}).get(
            "mean_speed"
        )
        wind = "" if mean is None else f"{mean:.2f}"
    if row["wind"] is not None and row["wind_sigma"] is not None:
        wind += f" ± {row['wind_sigma']:.2f}"
    return [
        row["artifact"][:_SHORT],
        row["kind"],
        row["name"],
        "" if row["start"] is None else iso(row["start"] // 10**9 * 10**9),
        row["frame_count"],
        wind,
        # A clip's object is its recording's.
        "lost" if lost else "" if row["kind"] == Kind.CLIP else size_text(row["object_bytes"]),
        ",".join([*row["quality"], *(["superseded"] if superseded else [])]),
    ]


def said(column: str, value: object) -> str:
    """A value for people: instants as times, numbers with their unit, mappings and lists as JSON."""
    from flagdata.schema import CATALOG
    from flagdata.timebase import iso

    unit = CATALOG[column].unit
    if unit == "ns" and isinstance(value, int):
        return iso(value)
    if isinstance(value, dict | list):
        return json.dumps(value, ensure_ascii=False)
    return f"{value} {unit}" if unit not in ("", "1") else str(value)


def _relative(row: Mapping[str, Any]) -> dict[str, str]:
    return {"artifact": row["artifact"], "kind": row["kind"], "name": row["name"]}


def _plain(row: Mapping[str, Any]) -> dict[str, Any]:
    return {column: value.isoformat() if isinstance(value, datetime) else value for column, value in row.items()}


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
