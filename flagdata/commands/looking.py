"""`flagdata lineage|du|view`: looking at what is in a lake."""

from __future__ import annotations

import sys
import webbrowser
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING

import click

from flagdata.core.console import LocalPath, document, echo, say, table
from flagdata.core.printable import SHORT, printable, size_text
from flagdata.errors import UsageError
from flagdata.verbs.shared_options import AtVersion, InFull, OfGarbage, OnLake
from flagdata.verbs.verb_options import AsJson, Result, argument, command, option, options, verb

if TYPE_CHECKING:
    from flagdata.lake.ancestry import Ancestry, Line, Relative


@options
class Tracing(InFull, AtVersion, OnLake):
    """Whose relatives are shown, and how."""

    artifact: str = argument("Its id, name or file.", "ARTIFACT")
    details: bool = option("With recipe hash, code version and seed.", default=False)
    picture: Path | None = option(
        "Write the lineage as a picture, too: .svg or .png.",
        default=None,
        type=LocalPath(),
        metavar="FILE",
    )


@verb(Tracing, example='flagdata.lineage("flag", lake="field.lake")["edges"]')
def lineage(chosen: Tracing) -> Iterator[Result]:
    """Show what an artifact was made from and what was made from it, over all generations."""
    from flagdata.core.files.outputs import check_file, write_file
    from flagdata.lake.ancestry import ancestry
    from flagdata.pages.lineage_picture import MOST, graph
    from flagdata.pages.lineage_picture import picture as drawn

    picture, details = chosen.picture, chosen.details
    kind = "" if picture is None else picture.suffix.lower()
    if picture is not None:
        if kind not in (".svg", ".png"):
            raise UsageError(
                "a lineage is drawn as SVG or PNG",
                where=str(picture),
                fix="name a .svg or .png file",
            )
        check_file(picture)
    lake, at = chosen.opened(), chosen.at
    found = ancestry(lake.table(lake.view(at)), lake.identity(chosen.artifact, at=at))
    most = None if chosen.whole else MOST
    if picture is not None:
        if kind == ".png":
            from flagdata.pages.graph_png import png

            write_file(picture, png(*graph(found, details=details, most=most)))
        else:
            write_file(picture, drawn(found, details=details, most=most))
    relatives = [asdict(relative) for relative in found.relatives.values()]
    yield Result(
        "lineage",
        {"at": at, "artifact": found.artifact, "relatives": relatives, "edges": found.edges},
    )
    for text in _lines(found, details=details, most=most):
        echo(text)


def _lines(found: Ancestry, *, details: bool, most: int | None) -> Iterator[str]:
    from flagdata.lake.ancestry import tree

    yield _relative(found.relatives[found.artifact], details=details)
    for title, up in (("made from", True), ("made into", False)):
        lines = list(tree(found, up=up, most=most))
        yield title if lines else f"{title} no other artifact"
        yield from (_tree_line(line, details=details) for line in lines)


def _tree_line(line: Line, *, details: bool) -> str:
    outer, last = line.ends[:-1], line.ends[-1]
    stem = "".join("   " if ended else "│  " for ended in outer) + ("└─ " if last else "├─ ")
    first, *others = line.relatives
    if others:
        text = f"{len(line.relatives):,} × {first.kind or 'artifact'} (--all lists them)"
    else:
        text = _relative(first, details=details and not line.repeated)
    return f"{stem}{text}{' (see above)' if line.repeated else ''}"


def _relative(relative: Relative, *, details: bool) -> str:
    from flagdata.pages.lineage_picture import detail_lines

    if relative.kind is None:
        return f"{relative.artifact[:SHORT]} not at this version"
    more = f"  ({', '.join(detail_lines(relative))})" if details else ""
    return f"{relative.artifact[:SHORT]} {relative.kind} {printable(relative.name or '')}{more}"


@options
class Weighing(OfGarbage, AtVersion, OnLake):
    """The version of which the disk usage is shown."""


@verb(Weighing, example='flagdata.du(lake="field.lake")["total"]  # bytes')
def du(chosen: Weighing) -> Iterator[Result]:
    """Show what takes space: by kind, by branch and tag, shared or own, and what gc would free.

    With --at the kinds are those of that version alone. A version's own bytes are those that no
    other branch or tag shows.
    """
    from flagdata.lake.collection import usage

    found = usage(chosen.opened(), at=chosen.at, grace=timedelta(seconds=chosen.grace))
    versions = [
        {**asdict(version), "shared": version.share.size - version.own}
        for version in found.versions
    ]
    shares = {name: asdict(share) for name, share in found.kinds.items()}
    sums = {"total": found.total, "kinds": shares, "versions": versions, "gc_frees": found.freed}
    yield Result("du", {"at": chosen.at, **sums})
    kinds = [
        (name, one.artifacts or "", one.objects or "", size_text(one.size))
        for name, one in found.kinds.items()
    ]
    whole = sum(one.size for one in found.kinds.values())
    table(("kind", "artifacts", "objects", "size"), [*kinds, ("total", "", "", size_text(whole))])
    echo()
    table(
        ("shown by", "", "artifacts", "size", "own", "shared", "lost"),
        [
            (
                version.name,
                version.noun,
                version.share.artifacts,
                size_text(version.share.size),
                size_text(version.own),
                size_text(version.share.size - version.own),
                version.lost or "",
            )
            for version in found.versions
        ],
    )
    say(
        f"{size_text(found.total)} in all; gc would free {size_text(found.freed)} (flagdata gc "
        "--dry-run lists it)"
    )


@options
class Viewing(AsJson, OnLake):
    """How a lake is served."""

    port: int = option(
        "On loopback; a free one where none is given.",
        default=0,
        type=click.IntRange(0, 65535),
        show_default=False,
    )
    opens: bool = option("Open the page in the browser.", "--open", default=False)


@command(Viewing)
def view(chosen: Viewing) -> None:
    """Look at a lake in the browser: artifacts, films beside their winds, alignments, lineages,
    SQL.

    Prints the address of a page that only this machine can open, and only by the whole address;
    Ctrl-C ends it. The page changes nothing, loads nothing from elsewhere, and shows what other
    processes commit when it is reloaded.
    """
    from flagdata.view.server import Server

    lake = chosen.opened()
    lake.catalog.head()
    with Server(lake, port=chosen.port) as server:
        if chosen.as_json:
            document("view", {"address": server.address})
        else:
            echo(server.address)
            say("only this machine can open it; Ctrl-C ends it")
        sys.stdout.flush()
        if chosen.opens:
            webbrowser.open(server.address)
        with suppress(KeyboardInterrupt):
            server.serve_forever()
