"""`flagdata query`: rows of the catalog by filter or SQL, at any version."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from flagdata.api.lake_verbs import Querying
from flagdata.core.console import LocalPath, csv_rows, document, say, table
from flagdata.core.printable import SHORT
from flagdata.errors import UsageError
from flagdata.lake.catalog_cells import plain
from flagdata.lake.sql_process import sql_process
from flagdata.timebase import iso
from flagdata.verbs.verb_options import AsJson, command, option, options

if TYPE_CHECKING:
    import pyarrow as pa

    from flagdata.lake.rowfiles import Scan
    from flagdata.lake.selection import Request, Selection

PEOPLE_LIMIT = 20
_INSTANTS = ("start", "end")
_TIME_LIMIT = 60.0  # s; that of `flagdata.lake.selection`, which is not imported for --help

# What people see without --columns, by the one kind that was selected.
VIEWS: dict[str | None, tuple[str, ...]] = {
    "camera": ("artifact", "name", "start_time", "duration", "frame_count", "rate", "quality"),
    "wind": ("artifact", "name", "start_time", "duration", "rate", "quality"),
    "recording": (
        "artifact",
        "name",
        "start_time",
        "duration",
        "frame_count",
        "clock_method",
        "clock_offset",
        "clock_sigma",
        "quality",
    ),
    "clip": (
        "artifact",
        "name",
        "start_time",
        "frame_first",
        "frame_count",
        "wind",
        "wind_sigma",
        "wind_coverage",
        "wind_staleness",
        "quality",
    ),
    "meshes": ("artifact", "name", "frame_count", "rate", "seed", "wind", "quality"),
    "markers": ("artifact", "name", "frame_count", "rate", "quality"),
    "model": ("artifact", "name", "created", "code_version", "quality"),
    "network": ("artifact", "name", "seed", "created", "code_version", "quality"),
    "measurement": ("artifact", "name", "created", "wind", "wind_sigma", "quality"),
    None: ("artifact", "kind", "name", "start_time", "duration", "wind", "wind_sigma", "quality"),
}


@options
class QueryCommand(AsJson, Querying):
    """The same on the command line, how long it may take, and what is written."""

    where: str | None = option(
        "SQL condition, e.g. \"kind = 'clip' and wind between 3 and 6\".",
        default=None,
        metavar="EXPR",
    )
    time_limit: float = option(
        "What the query may take, before it is stopped.",
        default=_TIME_LIMIT,
        type=click.FloatRange(min=0, min_open=True),
        metavar="SECONDS",
    )
    arrow: Path | None = option(
        "Write an Arrow IPC file.", default=None, type=LocalPath(), metavar="FILE"
    )
    as_csv: bool = option("Comma-separated values on stdout.", "--csv", default=False)
    describe: bool = option("List the columns with their units.", default=False)


@command(QueryCommand)
def query(chosen: QueryCommand) -> None:
    """Select rows of the catalog by filter or SQL.

    The SQL is DuckDB's, over one read-only table, catalog. Times are compared through start_time
    and end_time:

    \b
      flagdata query --where "kind = 'clip' and wind between 3 and 6" --order "wind desc"
      flagdata query --where "start_time >= '2026-05-01 12:00+02:00'" \\
          --columns name,wind,wind_sigma
      flagdata query --json \\
          --sql "select session, count(*) n, avg(wind) wind from catalog group by session"
    """
    if sum((chosen.as_json, chosen.as_csv, chosen.arrow is not None)) > 1:
        raise UsageError(
            "more than one form of output is given", fix="choose one of --json, --csv and --arrow"
        )
    if chosen.describe:
        _describe(as_json=chosen.as_json)
        return
    sql_process()  # starts while the lake is read
    from flagdata.core.files.outputs import check_file
    from flagdata.dataset.lake_source import open_source
    from flagdata.lake.selection import Request, Selection

    if chosen.arrow is not None:
        check_file(chosen.arrow)
    lake = open_source(chosen.lake).lake
    view = lake.view(chosen.at)
    version = view[0].version
    request = Request(
        where=chosen.where,
        sql=chosen.sql,
        columns=None if chosen.columns is None else tuple(chosen.columns),
        order=chosen.order,
        limit=chosen.limit,
        time_limit=chosen.time_limit,
    )
    catalog = lake.scan(view)
    if chosen.arrow is not None:
        count = write_arrow(Selection(catalog, request), chosen.arrow)
        say(f"{count:,} rows of version {version} → {chosen.arrow}")
    elif chosen.as_csv:
        _print_csv(Selection(catalog, request))
    elif chosen.as_json:
        document("query", as_document(Selection(catalog, request), at=chosen.at, version=version))
    else:
        _print_table(catalog, request)


def write_arrow(selection: Selection, path: Path) -> int:
    """Stream a selection into a new Arrow IPC file; the file appears whole or not at all. Returns
    the rows written.

    Raises:
        ConflictError: the file is there already.
        InputError: its folder is not.
        FlagdataError: no space, no permission.
    """
    import pyarrow as pa

    from flagdata.core.files.outputs import fresh_file

    count = 0
    with fresh_file(path) as scratch:
        batches = selection.batches()
        with pa.OSFile(str(scratch), "wb") as sink, pa.ipc.new_file(sink, batches.schema) as writer:
            for batch in batches:
                writer.write_batch(batch)
                count += batch.num_rows
    return count


def as_document(selection: Selection, *, at: str | None, version: int) -> dict[str, Any]:
    """The JSON form: columns with type and unit, rows, and what JSON cannot say.

    JSON has no NaN or infinity: such cells are null, and `not_finite` counts them by column.
    """
    result = selection.table()
    fields = [
        {
            "name": f.name,
            "type": str(f.type),
            "unit": (f.metadata or {}).get(b"unit", b"").decode() or None,
        }
        for f in result.schema
    ]
    names = [field["name"] for field in fields]
    if len(set(names)) < len(names):
        raise UsageError("two columns have one name", fix="name them apart in the SQL, by AS")
    not_finite: dict[str, int] = {}
    rows = []
    for source in result.to_pylist():
        row = {name: plain(value) for name, value in source.items()}
        for name, value in row.items():
            if isinstance(value, float) and not math.isfinite(value):
                row[name] = None
                not_finite[name] = not_finite.get(name, 0) + 1
        rows.append(row)
    return {
        "at": at,
        "version": version,
        "where": selection.request.where,
        "sql": selection.request.sql,
        "count": len(rows),
        "total": selection.total(),
        "columns": fields,
        "not_finite": not_finite,
        "rows": rows,
    }


def _print_csv(selection: Selection) -> None:
    batches = selection.batches()
    csv_rows([batches.schema.names])
    for batch in batches:
        cells = [[_csv_cell(value) for value in column.to_pylist()] for column in batch.columns]
        csv_rows(zip(*cells, strict=True))


def _csv_cell(value: Any) -> Any:
    value = plain(value)
    return ";".join(str(item) for item in value) if isinstance(value, list) else value


def _print_table(catalog: pa.Table | Scan, request: Request) -> None:
    from dataclasses import replace

    from flagdata.lake.selection import Request, Selection
    from flagdata.lake.unknown_values import unknown_value

    if request.sql is None and request.columns is None:
        kinds = (
            Selection(catalog, replace(request, columns=("kind",), limit=None))
            .table()["kind"]
            .unique()
            .to_pylist()
        )
        shown = replace(request, columns=VIEWS[kinds[0] if len(kinds) == 1 else None])
        short = True
    else:
        shown, short = request, False
    if shown.limit is None:
        shown = replace(shown, limit=PEOPLE_LIMIT)
    selection = Selection(catalog, shown)
    result, total = selection.table(), selection.total()
    if not total:
        unknown = unknown_value(request.where if isinstance(request.where, str) else None, catalog)
        why = "" if unknown is None else f": {unknown}"
        say(f"no rows of {Selection(catalog, Request()).total():,} match{why}")
        return
    header = [
        f"{f.name} [{unit}]" if (unit := _unit(f)) and not _is_instant(f) else f.name
        for f in result.schema
    ]
    columns = [
        [
            iso(value) if _is_instant(f) and value is not None else _cell(value, short=short)
            for value in column
        ]
        for f, column in zip(
            result.schema, (column.to_pylist() for column in result.columns), strict=True
        )
    ]
    table(header, zip(*columns, strict=True))
    if result.num_rows < total:
        say(f"{result.num_rows:,} of {total:,} rows; more by --limit")


def _unit(field: pa.Field) -> str:
    unit = (field.metadata or {}).get(b"unit", b"").decode()
    return "" if unit == "1" else unit


def _is_instant(field: pa.Field) -> bool:
    """Returns whether a column holds instants [UTC ns], which people read as times."""
    return field.name in _INSTANTS and _unit(field) == "ns"


def _cell(value: Any, *, short: bool) -> str | None:
    """A cell for people: floats to 4 digits, times to milliseconds, lists by commas, identities cut
    if `short`."""
    if isinstance(value, datetime):
        return value.isoformat(timespec="milliseconds").replace("+00:00", "Z")
    value = plain(value)
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list):
        return ",".join(str(item) for item in value)
    if (
        short
        and isinstance(value, str)
        and len(value) == 32
        and not value.strip("0123456789abcdef")
    ):
        return value[:SHORT]
    return None if value is None else str(value)


def _describe(*, as_json: bool) -> None:
    from flagdata.lake.selection import COLUMNS

    if as_json:
        columns = [
            {"name": name, "type": str(f.type), "unit": f.unit or None, "about": f.about}
            for name, f in COLUMNS.items()
        ]
        document("columns", {"columns": columns})
        return
    rows: Iterable[Sequence[object]] = [
        (name, str(f.type), f.unit, f.about) for name, f in COLUMNS.items()
    ]
    table(("column", "type", "unit", "about"), rows)
