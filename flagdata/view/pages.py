"""The HTML of the page: the artifacts of a version, one artifact, and SQL over the catalog."""

from __future__ import annotations

import json
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import urlencode

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from markupsafe import Markup

from flagdata.core.printable import SHORT, printable, size_text
from flagdata.core.schema import Kind
from flagdata.errors import FlagdataError, NotFoundError, UnknownNameError, UsageError
from flagdata.lake import Artifact, Lake
from flagdata.lake.ancestry import ancestry
from flagdata.lake.catalog_cells import plain, said
from flagdata.lake.label_columns import PREFIX
from flagdata.lake.lineage import labels_of
from flagdata.lake.refs import MAIN, View
from flagdata.lake.results import versions
from flagdata.lake.selection import COLUMNS, Request, Selection
from flagdata.pages.graph import COLOURS
from flagdata.pages.lineage_picture import picture
from flagdata.pages.render import render, text_of
from flagdata.recipes.documents import column_json
from flagdata.timebase import iso
from flagdata.view.media import Media
from flagdata.view.moving_pictures import DRAWN

_VIEWS = 3
_ORDER = {"created": "descending", "start": "ascending", "artifact": "ascending"}
CARDS = 60
"""Artifacts on one page."""
CLIPS = 24
"""Clips of a recording that its page shows, spread over it."""
ROWS, SECONDS, CHARACTERS = 200, 5.0, 10_000
"""Most that a query of the page may show, take and have."""
EXAMPLES = (
    "select kind, count(*) n, sum(object_bytes) bytes from catalog group by kind order by n desc",
    (
        "select artifact, name, start_time, wind, wind_sigma from catalog where kind = 'clip' "
        "order by wind desc"
    ),
    (
        "select session, day, count(*) clips, round(avg(wind), 2) wind from catalog where kind = "
        "'clip' group by all"
    ),
)
ICON = (
    b'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 16 16">'
    b'<path d="M3 1v14" stroke="#56646b" stroke-width="1.6"/>'
    b'<path d="M4 2c4-2 6 2 10 0v7c-4 2-6-2-10 0z" fill="#3b7d6b"/></svg>'
)
_ID = 32  # characters of an artifact's id
_FILMED = frozenset({Kind.CAMERA, Kind.RECORDING, Kind.CLIP, *DRAWN})
_REPORTED = frozenset({Kind.WIND, Kind.MEASUREMENT, Kind.MODEL})
_ASIDE = frozenset(
    {
        "artifact",
        "name",
        "kind",
        "parents",
        "report",
        "recipe",
        "parameters",
        "clock_model",
        "quality",
    }
)
_CLOCK = (
    ("clock_offset", "offset", "s"),
    ("clock_sigma", "σ of the offset", "s"),
    ("clock_drift", "drift", "s/s"),
)
_EVIDENCE = (
    ("interval", "interval of the offset", "s"),
    ("drift_sigma", "σ of the drift", "s/s"),
    ("confidence", "confidence", ""),
    ("chance", "probability by chance", ""),
    ("correlation", "correlation", ""),
)


class Tables:
    """The rows of the views that were asked for last: what a view shows never changes, and a page
    asks many times."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._known: dict[View, pa.Table] = {}

    def of(self, lake: Lake, view: View) -> pa.Table:
        """Reads all rows of a view."""
        with self._lock:
            if view not in self._known:
                self._known = {
                    view: lake.table(view),
                    **dict(list(self._known.items())[: _VIEWS - 1]),
                }
            return self._known[view]


@dataclass(frozen=True, kw_only=True)
class Site:
    """A lake at a version, and the addresses of its pages.

    Attributes:
        lake: that is shown.
        media: its pictures.
        base: path before all addresses, with a slash at both ends.
        at: the version asked for, `None` for the head of main.
        tables: the rows of versions.
    """

    lake: Lake
    media: Media
    base: str
    at: str | None = None
    tables: Tables = field(default_factory=Tables)

    def link(self, path: str = "", **values: Any) -> str:
        """Returns the address of a page of this version."""
        query = {
            name: value
            for name, value in {"at": self.at, **values}.items()
            if value not in (None, "")
        }
        return f"{self.base}{path}" + (f"?{urlencode(query)}" if query else "")

    def rows(self) -> pa.Table:
        """Reads all rows that the version shows.

        Raises:
            NotFoundError: no such version.
        """
        return self.tables.of(self.lake, self.lake.view(self.at))

    def row(self, artifact: str) -> dict[str, Any]:
        """Reads one row, by its full id.

        Raises:
            NotFoundError: the version does not show it.
        """
        matches = self.rows().filter(pc.field("artifact") == artifact).to_pylist()
        if not matches:
            raise NotFoundError(
                f"there is no artifact {artifact[:SHORT]} at this version",
                fix="choose another version, or go to the overview",
            )
        return matches[0]


@dataclass(frozen=True, kw_only=True)
class PageTable:
    """Rows of a query's answer, ready to be shown.

    Attributes:
        header: names of the columns.
        rows: texts of the cells, and the address that a cell leads to.
        total: how many rows there are without the limit.
    """

    header: Sequence[str] = ()
    rows: Sequence[Sequence[tuple[str, str | None]]] = ()
    total: int = 0


def overview(site: Site, *, kind: str | None, name: str | None, page: int) -> str:
    """Renders the artifacts of a version, newest first; clips are listed where that kind is asked
    for.

    Raises:
        NotFoundError: no such version.
        UnknownNameError: no such kind.
    """
    if kind is not None and kind not in list(Kind):
        raise UnknownNameError.of("kind", kind, [known_kind.value for known_kind in Kind])
    rows = site.rows()
    counted = pc.value_counts(rows["kind"])  # type: ignore[attr-defined]
    counts = {entry["values"]: entry["counts"] for entry in counted.to_pylist()}
    chosen = pc.field("kind") != Kind.CLIP.value if kind is None else pc.field("kind") == kind
    if name:
        chosen &= pc.match_substring(  # type: ignore[attr-defined]
            pc.field("name"), name, ignore_case=True
        )
    # Of a large catalog a filter or sort of whole rows would copy them all.
    listed = rows.select([*_ORDER, "kind", "name"]).append_column(
        "row", pa.array(np.arange(rows.num_rows))
    )
    newest_first = listed.filter(chosen).sort_by(list(_ORDER.items()))["row"]
    last = max(0, (len(newest_first) - 1) // CARDS)
    page = min(page, last)
    cards = [
        _card(site, row) for row in rows.take(newest_first.slice(page * CARDS, CARDS)).to_pylist()
    ]
    return _page(
        site,
        "overview.html.j2",
        cards=cards,
        counts=counts,
        kind=kind,
        name=name or "",
        page=page,
        last=last,
        total=len(newest_first),
        everything=rows.num_rows - counts.get(Kind.CLIP.value, 0),
    )


def artifact(site: Site, identity: str) -> str:
    """Renders one artifact: its film beside its wind, what was found, how it was aligned, where it
    comes from.

    Raises:
        NotFoundError: no such version, or it does not show the artifact.
    """
    rows, row = site.rows(), site.row(identity)
    report = _from_column(row, "report") or {}
    lost = site.media.is_lost(row)
    clips, count = _clips(site, rows, row)
    labels = labels_of(rows).get(identity, {})
    facts = [
        (name, printable(said(name, value))) for name, value in row.items() if _is_fact(name, value)
    ]
    facts += [(PREFIX + name, printable(str(value))) for name, value in labels.items()]
    facts += [(f"version {number}", text) for number, text in _versions(site, row)]
    drawn = picture(
        ancestry(rows, identity), link=lambda relative: site.link(f"artifact/{relative}")
    )
    documents = {name: _from_column(row, name) for name in ("recipe", "parameters", "clock_model")}
    return _page(
        site,
        "artifact.html.j2",
        card=_card(site, row),
        row=row,
        facts=facts,
        lost=lost,
        findings=_findings(report),
        words=_sentence(report),
        evidence=_evidence(row, report),
        stated={
            name: json.dumps(value, indent=2, ensure_ascii=False)
            for name, value in documents.items()
            if value
        },
        films=row["kind"] in _FILMED and row["object"] is not None,
        blows=row["kind"] == Kind.WIND,
        lineage=Markup(drawn),  # its texts are escaped
        clips=clips,
        clip_count=count,
    )


def sql(site: Site, text: str | None) -> tuple[str, FlagdataError | None]:
    """Renders the page of a query, and says what is wrong with it.

    Raises:
        NotFoundError: no such version.
    """
    table, error = PageTable(), None
    if text:
        try:
            table = _answer(site, text)
        except FlagdataError as refused:
            error = refused
    columns = [
        (name, str(column.type), column.unit, column.about) for name, column in COLUMNS.items()
    ]
    return _page(
        site, "query.html.j2", sql=text or "", found=table, error=error, columns=columns, rows=ROWS
    ), error


def problem(site: Site, error: FlagdataError, status: int) -> str:
    """Renders the page of an error; it reads nothing of the lake."""
    return _fill_template(
        site, "problem.html.j2", error=error, status=status, refs=[], version=None
    )


def style() -> bytes:
    """Returns the sheet of all pages."""
    kinds = "".join(f".k-{kind} {{ --kind: {colour}; }}\n" for kind, colour in COLOURS.items())
    return (
        text_of("flagdata.pages", "base.css") + text_of("flagdata.view", "view.css") + kinds
    ).encode()


def script() -> bytes:
    """Returns what moves on the pages."""
    return text_of("flagdata.view", "view.js").encode()


def _page(site: Site, template: str, **values: Any) -> str:
    branches, tags = site.lake.refs.branches(), site.lake.refs.tags()
    refs = [*((name, "branch") for name in (MAIN, *branches)), *((name, "tag") for name in tags)]
    return _fill_template(site, template, refs=refs, version=site.lake.resolve(site.at), **values)


def _fill_template(site: Site, template: str, **values: Any) -> str:
    common_values = {
        "site": site,
        "link": site.link,
        "lake": str(site.lake.path),
        "examples": EXAMPLES,
        "short": SHORT,
    }
    return render(
        "flagdata.view", template, {**common_values, **values}, filters={"printable": printable}
    )


def _card(site: Site, row: Mapping[str, Any]) -> dict[str, Any]:
    """Returns what a tile shows of a row."""
    seconds = (
        None if row["start"] is None or row["end"] is None else (row["end"] - row["start"]) / 1e9
    )
    length = (
        None
        if seconds is None
        else f"{seconds:.3g} s"
        if seconds < 120
        else f"{seconds / 60:.3g} min"
    )
    size = None if row["kind"] == Kind.CLIP else size_text(row["object_bytes"])
    wind = row["wind"]
    report = _from_column(row, "report") or {} if row["kind"] in _REPORTED else {}
    if row["kind"] == Kind.WIND:
        wind = report.get("mean_speed")
    sigma = "" if row["wind_sigma"] is None else f" ± {row['wind_sigma']:.2f}"
    return {
        "artifact": row["artifact"],
        "kind": row["kind"],
        "name": printable(row["name"]),
        "quality": row["quality"],
        "start": None
        if row["start"] is None
        else iso(row["start"] // 10**9 * 10**9).replace("T", " "),
        "length": _together(length),
        "size": _together(size),
        "drawn": row["kind"] in DRAWN,
        "wind": None if wind is None else f"{wind:.2f}{sigma} m/s",
        "lost": site.media.is_lost(row),
        "pictured": row["kind"] in _FILMED and row["object"] is not None,
        "says": _sentence(report),
    }


def _sentence(report: Mapping[str, Any]) -> str | None:
    """Returns what a result says in a sentence, as `flagdata show` prints it."""
    text = report.get("sentence") or report.get("words")
    return None if text is None else printable(str(text))


def _together(text: str | None) -> str | None:
    """Joins a number and its unit in one line."""
    return text and text.replace(" ", "\N{NO-BREAK SPACE}")


def _versions(site: Site, row: Mapping[str, Any]) -> list[tuple[int, str]]:
    """Lists number, id and code of each version of a result that has several."""
    result_versions = versions(site.lake, Artifact.from_row(row), at=site.at)
    return [
        (
            number,
            (
                f"{result.id[:SHORT]} by code "
                f"{result.code_version}{', this one' if result.id == row['artifact'] else ''}"
            ),
        )
        for number, result in enumerate(
            result_versions if len(result_versions) > 1 else (), start=1
        )
    ]


def _clips(site: Site, rows: pa.Table, row: Mapping[str, Any]) -> tuple[list[dict[str, Any]], int]:
    """Lists some of the clips of a recording, in order, and counts them."""
    if row["kind"] != Kind.RECORDING:
        return [], 0
    wanted = (pc.field("kind") == Kind.CLIP.value) & (pc.field("recording") == row["artifact"])
    clips = rows.filter(wanted).sort_by("start")
    step = max(1, -(-clips.num_rows // CLIPS))
    return [
        _card(site, clip) for clip in clips.take(list(range(0, clips.num_rows, step))).to_pylist()
    ], clips.num_rows


def _evidence(row: Mapping[str, Any], report: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Lists in numbers how the clocks of a recording were brought together."""
    if row["clock_method"] is None:
        return []
    facts = [("method", str(row["clock_method"]))]
    facts += [
        (words, f"{row[name]:.4g} {unit}") for name, words, unit in _CLOCK if row[name] is not None
    ]
    for name, words, unit in _EVIDENCE:
        value = report.get(name)
        if isinstance(value, int | float):
            facts.append((words, f"{value:.4g} {unit}".strip()))
        elif isinstance(value, list) and len(value) == 2:
            facts.append(
                (
                    f"{words}, {report.get('level', 0.9):.0%}",
                    f"{value[0]:.4g} to {value[1]:.4g} {unit}",
                )
            )
    return facts


def _findings(report: Mapping[str, Any]) -> list[dict[str, str]]:
    """Lists what a report found; one of another program may lack parts of it."""
    return [
        {
            name: printable(str(finding.get(name) or ""))
            for name in ("severity", "kind", "what", "fix")
        }
        for finding in report.get("findings", [])
    ]


def _from_column(row: Mapping[str, Any], column: str) -> Any:
    return column_json(row[column], column, artifact=row["artifact"]) if row[column] else None


def _is_fact(name: str, value: object) -> bool:
    return name not in _ASIDE and value is not None and value != []


def _answer(site: Site, text: str) -> PageTable:
    if len(text) > CHARACTERS:
        raise UsageError(f"SQL of {len(text):,} characters", fix=f"write at most {CHARACTERS:,}")
    rows = site.rows()
    selection = Selection(rows, Request(sql=text, limit=ROWS, time_limit=SECONDS))
    answer = selection.table()
    values = [column.to_pylist() for column in answer.columns]
    texts = {
        value
        for column in values
        for value in column
        if isinstance(value, str) and len(value) == _ID
    }
    ids = rows["artifact"]
    named = pc.is_in(  # type: ignore[attr-defined]
        ids, value_set=pa.array(sorted(texts), pa.string())
    )
    identities = set(ids.filter(named).to_pylist())
    columns = [[_cell(site, value, identities) for value in column] for column in values]
    return PageTable(
        header=[printable(name) for name in answer.column_names],
        rows=list(zip(*columns, strict=True)),
        total=selection.total(),
    )


def _cell(site: Site, value: Any, identities: set[str]) -> tuple[str, str | None]:
    plain_value = plain(value)
    if plain_value is None:
        return "", None
    if isinstance(plain_value, str) and plain_value in identities:
        return plain_value[:SHORT], site.link(f"artifact/{plain_value}")
    if isinstance(plain_value, float):
        return f"{plain_value:.6g}", None
    return printable(
        ", ".join(map(str, plain_value)) if isinstance(plain_value, list) else str(plain_value)
    ), None
