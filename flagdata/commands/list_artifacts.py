"""`flagdata ls|show`: the artifacts of a lake, in a table and one by one."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator, Mapping
from datetime import datetime
from typing import TYPE_CHECKING, Any

from flagdata.core.console import echo, say, table
from flagdata.core.json_values import json_values
from flagdata.core.printable import SHORT, count_of, size_text
from flagdata.verbs.shared_options import AtVersion, InFull, OnLake
from flagdata.verbs.verb_options import Result, argument, option, options, verb

if TYPE_CHECKING:
    from flagdata.lake import Lake

_MOST = 20
"""Parents, and artifacts made from one, that are listed without --all."""
_INNER = ("recipe", "parameters", "clock_model", "recipe_hash")
"""Columns that are JSON or hashes, for --all."""


@options
class Listing(AtVersion, OnLake):
    """Which artifacts are listed."""

    kind: str | None = option(
        "Only this kind: camera, wind, recording, clip, meshes, …", default=None, metavar="KIND"
    )


@verb(Listing, example='flagdata.ls(lake="field.lake", kind="wind")["artifacts"]')
def ls(chosen: Listing) -> Iterator[Result]:
    """List artifacts, clips counted only (--kind clip lists them); filters and SQL are `flagdata
    query`'s."""
    from flagdata.core.schema import Kind
    from flagdata.errors import UnknownNameError
    from flagdata.lake.matching import matching
    from flagdata.lake.naming import superseded_rows
    from flagdata.lake.removal import lost

    kind, at = chosen.kind, chosen.at
    if kind is not None and kind not in list(Kind):
        raise UnknownNameError.of("kind", kind, [k.value for k in Kind])
    lake = chosen.opened()
    found = lake.rows(None if kind is None else {"kind": kind}, at=at, columns=["name", "object"])
    rows = lake.rows("kind <> 'clip'" if kind is None else {"kind": kind}, at=at).to_pylist()
    gone = lost(lake, found)
    older = superseded_rows(row for row in rows if row["kind"] in (Kind.MEASUREMENT, Kind.MODEL))
    clips = found.num_rows - len(rows)
    listed = [
        {
            **_plain(row),
            "data": "lost" if row["object"] in gone else "there",
            "superseded": row["artifact"] in older,
        }
        for row in rows
    ]
    yield Result("ls", {"at": at, "artifacts": listed, "clips_not_listed": clips})
    header = ("artifact", "kind", "name", "start", "frames", "wind [m/s]", "size", "quality")
    if rows:
        lines = [
            _line(row, lost=row["object"] in gone, superseded=row["artifact"] in older)
            for row in rows
        ]
        table(header, lines)
    more = f" and {count_of(clips, 'clip')} (--kind clip lists them)" if clips else ""
    say(f"{count_of(len(rows), 'artifact')}{more}" if found.num_rows else "no artifacts")
    for name, why in gone.items():
        names = sorted(matching(found, {"object": name})["name"].unique().to_pylist())
        say(f"without data: {', '.join(names)}: {why.what}")


@options
class Showing(InFull, AtVersion, OnLake):
    """Which artifact is looked at."""

    artifact: str = argument("Its id, name or file.", "ARTIFACT")


@verb(Showing, example='flagdata.show("tunnel", lake="field.lake")["parents"]')
def show(chosen: Showing) -> Iterator[Result]:
    """Show one artifact: what it says, what it was made from and what was made from it.

    ARTIFACT is an id or its beginning, a name, the file it came from, or NAME@TAG. Of a verdict or
    a measurement its sentence comes first, of a network its card.
    """
    from flagdata.ingest.before import unconfirmed_findings
    from flagdata.lake.catalog_cells import said
    from flagdata.lake.label_columns import PREFIX
    from flagdata.lake.lineage import labels_of
    from flagdata.lake.results import versions
    from flagdata.recipes.documents import column_json

    lake, at, whole = chosen.opened(), chosen.at, chosen.whole
    found = lake.artifact(chosen.artifact, at=at)
    row = _plain(found.row())
    for column in ("recipe", "parameters", "clock_model", "report"):
        row[column] = column_json(row[column], column, artifact=found.id) if row[column] else None
    shown = lake.table(lake.view(at))
    labels = labels_of(shown).get(found.id, {})
    others = shown.select(["artifact", "kind", "name", "parents"]).to_pylist()
    parents = [relative(other) for other in others if other["artifact"] in row["parents"]]
    children = [relative(other) for other in others if row["artifact"] in other["parents"]]
    path = lake.objects.path(row["object"]) if row["object"] else None
    doubts = unconfirmed_findings([found])
    stated = [
        {"version": number, "artifact": one.id, "code_version": one.code_version}
        for number, one in enumerate(versions(lake, found, at=at), start=1)
    ]
    yield Result(
        "show",
        {
            "artifact": row,
            "labels": labels,
            "path": str(path) if path else None,
            "parents": parents,
            "children": children,
            "versions": stated,
            "findings": json_values(doubts),
        },
    )
    for name, text in _gist(lake, row):
        echo(f"{name:<15} {text}")
    left_out = ("parents", "report") if whole else ("parents", "report", *_INNER)
    for column, value in row.items():
        if value is not None and value != [] and column not in left_out:
            echo(f"{column:<15} {said(column, value)}")
    for name, value in labels.items():
        echo(f"{PREFIX + name:<15} {value}")
    if path is not None:
        echo(f"{'path':<15} {path}")
    for one in stated if len(stated) > 1 else ():
        this = " (this one)" if one["artifact"] == found.id else ""
        label = f"version {one['version']}"
        echo(f"{label:<15} {one['artifact'][:SHORT]} by code {one['code_version']}{this}")
    for label, relatives in (("made from", parents), ("made into", children)):
        for one in relatives if whole else relatives[:_MOST]:
            echo(f"{label:<15} {one['artifact'][:SHORT]} {one['kind']} {one['name']}")
        if len(relatives) > _MOST and not whole:
            kinds = Counter(one["kind"] for one in relatives[_MOST:])
            more = ", ".join(count_of(count, kind) for kind, count in sorted(kinds.items()))
            echo(f"{label:<15} … and {more} more (--all lists them)")
    for finding in (
        *(row["report"] or {}).get("findings", []),
        *json_values(doubts),
    ):
        echo(f"{finding.get('severity', 'note'):<15} {finding.get('kind')}: {finding.get('what')}")


def _gist(lake: Lake, row: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """What matters of an artifact of its kind: a sentence of its report, what a model adds, a
    network's card."""
    from flagdata.core.schema import Kind

    report = row["report"] or {}
    if sentence := report.get("sentence") or report.get("words"):
        yield "says", sentence
    if row["kind"] == Kind.MODEL and row["parameters"]:
        yield "adds", ", ".join(row["parameters"].get("effects", {})) or "nothing to the base model"
    if row["kind"] == Kind.NETWORK and row["object"]:
        card = json.loads(
            (lake.object_path(row["object"]) / "card.json").read_text(encoding="utf-8")
        )
        size = f"{card['parameters']:,} parameters, {card['epochs']} epochs, seed {card['seed']}"
        yield "card", f"{card['title']}; {size}"


def _line(row: Mapping[str, Any], *, lost: bool, superseded: bool) -> list[object]:
    from flagdata.core.schema import Kind
    from flagdata.recipes.documents import column_json
    from flagdata.timebase import iso

    wind = "" if row["wind"] is None else f"{row['wind']:.2f}"
    if row["kind"] == Kind.WIND:  # a log's mean, over all of it
        mean = (
            column_json(row["report"], "report", artifact=row["artifact"]) if row["report"] else {}
        ).get("mean_speed")
        wind = "" if mean is None else f"{mean:.2f}"
    if row["wind"] is not None and row["wind_sigma"] is not None:
        wind += f" ± {row['wind_sigma']:.2f}"
    return [
        row["artifact"][:SHORT],
        row["kind"],
        row["name"],
        "" if row["start"] is None else iso(row["start"] // 10**9 * 10**9),
        row["frame_count"],
        wind,
        # A clip's object is its recording's.
        "lost" if lost else "" if row["kind"] == Kind.CLIP else size_text(row["object_bytes"]),
        ",".join([*row["quality"], *(["superseded"] if superseded else [])]),
    ]


def relative(row: Mapping[str, Any]) -> dict[str, str]:
    """What names an artifact beside others: its id, kind and name."""
    return {"artifact": row["artifact"], "kind": row["kind"], "name": row["name"]}


def _plain(row: Mapping[str, Any]) -> dict[str, Any]:
    return {
        column: value.isoformat() if isinstance(value, datetime) else value
        for column, value in row.items()
    }
