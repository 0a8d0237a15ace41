"""A catalog of a million rows, and commits as versions add up: each figure of a fresh process,
beside others' stores.

The rows are written in ten commits, and the versions one row a commit, without waiting for the
disk; what is timed afterwards does wait. Peers of a query: DuckDB's own file, SQLite, and the Delta
library's reader with Arrow, each asked for the same groups. Peers of a commit: the Delta library's
append and SQLite, see `bench-lake.json`.
"""

from __future__ import annotations

import json
import os
import secrets
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from unittest.mock import patch
from urllib.parse import quote

import duckdb
import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from deltalake import DeltaTable, write_deltalake

from flagdata.core.rng import stream
from flagdata.core.schema import Kind, catalog_schema
from flagdata.lake import Artifact, Lake
from flagdata.view import Media, Site, answer

ROWS = int(os.environ.get("FLAGDATA_BENCH_ROWS", "1_000_000"))
BATCHES = 10
VIEWED = 10_000  # artifacts
VERSIONS = tuple(
    n
    for n in (10, 100, 1_000, 10_000)
    if n <= int(os.environ.get("FLAGDATA_BENCH_VERSIONS", "10_000"))
)
TIDY = 32  # versions; as commits do it
COMMITS = 20
SQL = (
    "select session, count(*) n, avg(wind) wind from catalog where wind between 3 and 6 group by "
    "session"
)
_LAP = """
import json, sys, time
def lap():
    global wall, cpu
    took = {"wall_s": time.perf_counter() - wall, "cpu_s": time.process_time() - cpu}
    wall, cpu = time.perf_counter(), time.process_time()
    return took
"""
_FRESH = (
    _LAP
    + """wall, cpu = time.perf_counter(), time.process_time()
from flagdata.lake import Artifact, Lake
from flagdata.lake.selection import select
found = {"import": lap()}
lake = Lake.open(sys.argv[1])
groups = select(lake, sql=sys.argv[2]).num_rows
found["open, filter and group"] = {**lap(), "groups": groups}
lake = Lake.open(sys.argv[1])
lake.tag(sys.argv[3])
found["tag"] = lap()
with lake.transaction("one row") as tx:
    tx.add(Artifact(kind="measurement", name="m", recipe={"of": sys.argv[3]}))
found["commit of one row"] = lap()
with lake.transaction("one more") as tx:
    tx.add(Artifact(kind="measurement", name="n", recipe={"of": sys.argv[3]}))
found["commit of another"] = lap()
"""
)
_BEGIN = (
    _LAP
    + """
from contextlib import redirect_stdout
from io import StringIO
from flagdata.lake import Artifact, Lake
from flagdata.view.media import Media
from flagdata.view.pages import Site
from flagdata.view.server import answer
def site():
    return Site(lake=lake, media=Media(lake), base="/key/")
wall, cpu = time.perf_counter(), time.process_time()
lake = Lake.open(sys.argv[1])
lap()
"""
)
_PEAK = """
with open("/proc/self/status") as status:  # what getrusage gives is the parent's, before the program began
    found["peak_MiB"] = int(next(line for line in status if line.startswith("VmHWM")).split()[1]) // 1024
print(json.dumps(found))
"""
_WHOLE = {
    "ls": """
from flagdata.commands.list_artifacts import ls
lap()
with redirect_stdout(StringIO()):
    ls.command.main(["--lake", sys.argv[1]], standalone_mode=False)""",
    "merge": """
lake.branch("side")
with lake.transaction("one row", branch="side") as tx:
    tx.add(Artifact(kind="measurement", name="aside", recipe={}))
lap()
lake.merge("side", "one row")""",
    "withdraw": """
clip = lake.rows({"name": "clip 77"})["artifact"][0].as_py()
lap()
lake.withdraw([clip], "wrong")""",
    "view, first page": "answer(site(), '/key/?kind=clip')",
    "view, another page": """
shown = site()
answer(shown, '/key/?kind=clip')
lap()
answer(shown, '/key/?kind=clip&page=9')""",
}
"""What looks at all rows, each in a process of its own."""


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Seconds of wall and processor, and memory; medians of commits [ms]."""
    del out
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        return {
            "rows": ROWS,
            "load_average": round(os.getloadavg()[0], 1),
            "fresh process": _million(folder, seed),
            "commits as versions add up": _growth(folder / "versions"),
            "pages of view [ms]": _view(folder / "viewed", seed),
        }


@contextmanager
def unflushed() -> Iterator[None]:
    """What is written meanwhile is not waited for."""
    with patch("os.fsync", lambda _: None):
        yield


def fill(lake: Lake, rows: int, seed: int) -> None:
    """Commit so many clips in `BATCHES` commits."""
    draws = stream(seed, "ids")
    with unflushed():
        for first in range(0, rows, rows // BATCHES):
            info = {"message": "a batch", "branch": "main", "commit": f"c{secrets.token_hex(8)}"}
            lake.catalog.append(
                clips(first, rows // BATCHES, draws), base=lake.catalog.head(), info=info
            )


def clips(first: int, count: int, draws: np.random.Generator) -> pa.Table:
    """Rows of clips, 10,000 a session."""
    one = Artifact(
        kind=Kind.CLIP,
        name="clip",
        source_hash="a" * 64,
        frame_first=0,
        frame_count=30,
        start=0,
        end=1,
        rate=25.0,
        wind=1.0,
        wind_sigma=0.1,
        session="s",
        day="2026-05-01",
        recipe={"window": 60.0},
    )
    row = replace(one, created=datetime.now(UTC)).row()
    rows = pa.Table.from_pylist([row], schema=catalog_schema()).take(
        pa.array(np.zeros(count, dtype=np.int64))
    )
    k = np.arange(first, first + count)
    own = {
        "artifact": [draws.bytes(16).hex() for _ in range(count)],
        "name": [f"clip {i}" for i in k],
        "start": k,
        "end": k + 1,
        "frame_first": 30 * k,
        "wind": k % 100 / 10,
        "session": [f"s{i // 10_000}" for i in k],
    }
    for name, values in own.items():
        number = rows.schema.get_field_index(name)
        rows = rows.set_column(
            number, rows.schema.field(number), pa.array(values, rows.schema.field(number).type)
        )
    return rows


def _million(folder: Path, seed: int) -> dict[str, Any]:
    lake = Lake.create(folder / "lake")
    fill(lake, ROWS, seed)
    whole = {name: _whole(lake.path, work) for name, work in _WHOLE.items()}
    ours = _fresh(lake.path, "first")
    table = lake.rows()
    asked = (
        table.filter((pc.field("wind") >= 3) & (pc.field("wind") <= 6))
        .group_by("session")
        .aggregate([])
    )
    assert ours["open, filter and group"]["groups"] == asked.num_rows
    return {"flagdata": ours, "of all rows": whole, **_peers(folder, table)}


def _fresh(lake: Any, tag: str) -> dict[str, Any]:
    return _in_a_process(_FRESH + _PEAK, str(lake), SQL, tag)


def _whole(lake: Any, work: str) -> dict[str, Any]:
    """What one of `_WHOLE` takes of a copy of the lake."""
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(shutil.copytree(lake, Path(folder) / "lake"))
        return _in_a_process(f"{_BEGIN}{work}\nfound = lap()\n{_PEAK}", str(copy))


def _in_a_process(program: str, *arguments: str) -> dict[str, Any]:
    done = subprocess.run(
        [sys.executable, "-c", program, *arguments], check=True, capture_output=True, text=True
    )
    return json.loads(done.stdout.splitlines()[-1])


def _peers(folder: Path, table: pa.Table) -> dict[str, Any]:
    """Seconds to open, filter and group the same rows, in this process, by others."""
    write_deltalake(str(folder / "delta"), table)
    duck = folder / "rows.duckdb"
    with duckdb.connect(str(duck)) as connection:
        connection.register("stored", table)
        connection.execute("CREATE TABLE catalog AS SELECT * FROM stored")
    lite = folder / "rows.sqlite"
    few = table.select(["artifact", "name", "session", "wind", "recipe", "created"])
    with sqlite3.connect(lite) as connection:
        connection.execute(f"CREATE TABLE catalog ({', '.join(few.column_names)})")
        columns = [
            column.cast(pa.string()) if str(column.type).startswith("time") else column
            for column in few.columns
        ]
        connection.executemany(
            f"INSERT INTO catalog VALUES ({', '.join('?' * few.num_columns)})",
            zip(*(column.to_pylist() for column in columns), strict=True),
        )

    def delta() -> int:
        rows = DeltaTable(str(folder / "delta")).to_pyarrow_dataset()
        with duckdb.connect() as connection:
            connection.register("catalog", rows)
            return len(connection.sql(SQL).fetchall())

    def duck_file() -> int:
        with duckdb.connect(str(duck), read_only=True) as connection:
            return len(connection.sql(SQL).fetchall())

    def lite_file() -> int:
        with sqlite3.connect(lite) as connection:
            return len(connection.execute(SQL).fetchall())

    return {
        "deltalake and DuckDB": _seconds(delta),
        "DuckDB's file": _seconds(duck_file),
        "SQLite, 6 of the columns": _seconds(lite_file),
    }


def _seconds(ask: Callable[[], int]) -> dict[str, Any]:
    wall, cpu = time.perf_counter(), time.process_time()
    groups = ask()
    return {
        "wall_s": time.perf_counter() - wall,
        "cpu_s": time.process_time() - cpu,
        "groups": groups,
    }


def _growth(path: Path) -> dict[str, Any]:
    """Of a lake of so many versions: what a fresh process takes, and the median commit of one that
    goes on [ms]."""
    lake = Lake.create(path)
    found: dict[str, Any] = {}
    for versions in VERSIONS:
        with unflushed():
            _commit_up_to(lake, versions)
        fresh = _fresh(path, f"v{versions}")
        for _ in range(2):  # the first reads the log
            _one(lake, 0)
        took = []
        for number in range(COMMITS):
            wall, cpu = time.perf_counter(), time.process_time()
            _one(lake, number + 1)
            took.append((time.perf_counter() - wall, time.process_time() - cpu))
        wall, cpu = np.median(took, axis=0) * 1e3
        found[f"{versions}"] = {
            "median_ms": float(wall),
            "median_cpu_ms": float(cpu),
            "fresh process": fresh,
        }
    return found


def _one(lake: Lake, number: int) -> None:
    with lake.transaction("one row") as tx:
        tx.add(
            Artifact(
                kind=Kind.MEASUREMENT,
                name="m",
                recipe={"at": lake.catalog.head(), "number": number},
            )
        )


def _commit_up_to(lake: Lake, versions: int) -> None:
    """Commits of one row each, until the lake has so many versions; the catalog alone is used, so
    that it is quick."""
    catalog, head = lake.catalog, lake.catalog.head()
    while head < versions:
        if head % TIDY == 0:
            catalog.tidy()
            head = catalog.head()
        artifact = replace(
            Artifact(kind=Kind.MEASUREMENT, name="m", recipe={"version": head}),
            created=datetime.now(UTC),
        )
        rows = pa.Table.from_pylist([artifact.row()], schema=catalog_schema())
        info = {
            "commit": f"c{secrets.token_hex(8)}",
            "message": "one row",
            "branch": "main",
            "rows": "1",
        }
        head = catalog.append(rows, base=head, info=info)


def _view(path: Path, seed: int) -> dict[str, float]:
    """Pages over a catalog of `VIEWED` artifacts, by the first request and later ones."""
    lake = Lake.create(path)
    fill(lake, VIEWED, seed)
    site = Site(lake=Lake.open(path), media=Media(lake), base="/key/")
    known = _one_measurement(lake)
    addresses = {
        "overview, first": "",
        "overview": "",
        "last page": f"?page={VIEWED // 60}&kind=clip",
        "search": "?name=clip%2077",
        "artifact": f"artifact/{known}",
        "SQL": f"query?sql={quote(SQL)}",
    }
    found: dict[str, float] = {}
    for name, address in addresses.items():
        began = time.perf_counter()
        page = answer(site, f"/key/{address}")
        found[name] = (time.perf_counter() - began) * 1e3
        assert page.status == 200, page.content
    return found


def _one_measurement(lake: Lake) -> str:
    with lake.transaction("one row") as tx:
        tx.add(Artifact(kind=Kind.MEASUREMENT, name="m", recipe={}))
    return tx.result.added[0]
