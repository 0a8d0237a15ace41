"""Queries without an end are stopped: after a time, and at a size."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time

import pyarrow as pa
import pytest

from flagdata.commands.query import as_document
from flagdata.commands.query import query as command
from flagdata.core.files.bounded import Child, End, EndedError
from flagdata.core.schema import catalog_schema
from flagdata.errors import FlagdataError, LimitError, UsageError
from flagdata.lake import Request, Selection, selection
from flagdata.lake.catalog_sql import PART
from tests.refusals import unrefused

EMPTY = catalog_schema().empty_table()
ENDLESS = {
    "recursive": "with recursive t(n) as (select 1 union all select n + 1 from t) select count(*) "
    "from t",
    "cross join": "select count(*) from range(1000000000000) a, range(1000000000000) b",
    "stream": "select * from range(1000000000000) a, range(1000000000000) b where a.range = "
    "b.range + 1",
}
LATE = 10.0  # s: far more than a block of 2,048 rows takes, far less than any of these


@pytest.mark.parametrize("sql", ENDLESS.values(), ids=ENDLESS)
def test_sql_without_an_end_is_stopped(sql: str) -> None:
    begun = time.process_time()
    with pytest.raises(LimitError, match=r"longer than 0\.2 s.*--time-limit"):
        Selection(EMPTY, Request(sql=sql, time_limit=0.2)).table()
    assert time.process_time() - begun < LATE


UNINTERRUPTED = {
    "comparison": "select levenshtein(repeat('a', 300000), repeat('b', 300000))",
    "comparisons": "select max(levenshtein(repeat('a', 30000 + range), repeat('b', 30000))) from "
    "range(2048)",
}
"""One step of each takes minutes, and heeds no interrupt."""


@pytest.mark.parametrize("sql", UNINTERRUPTED.values(), ids=UNINTERRUPTED)
def test_sql_that_heeds_no_interrupt_is_stopped(sql: str) -> None:
    begun = time.monotonic()
    with pytest.raises(LimitError, match=r"longer than 0\.5 s"):
        Selection(EMPTY, Request(sql=sql, time_limit=0.5)).table()
    assert time.monotonic() - begun < 3 * LATE  # starting a process is no part of the limit


LARGE = {
    "list": "select list(range(100000000))",
    "text": "select repeat('x', 1900000000)",
    "texts": "select repeat('x', 1000000) from range(100000)",
    "joined text": "select string_agg(repeat('x', 100000), '') from range(1000000)",
    "nested": "select [range(1000000) for x in range(1000)]",
    "structure": "select {'a': list(range), 'b': list(range)} from range(100000000)",
    "array": "select array_agg(r) from (select range(100) r from range(10000000))",
    "window": "select list(range) over () from range(100000)",
    "recursive": "with recursive t(n) as (select 'x' union all select n || n from t) select max(n) "
    "from t",
}
"""SQL whose result, or a step towards it, has many times the memory that a query may take."""
MOST = 400_000_000
"""Memory that these may take [B], less than by default: to fill it takes most of the time."""


READ_LARGE = """
import json, resource, sys
from flagdata.lake import sql_process
from flagdata.core.files.bounded import Child, End, EndedError
from flagdata.errors import FlagdataError, LimitError, UsageError
from flagdata.lake import Request, Selection, selection
from flagdata.core.schema import catalog_schema
sql_process.MEMORY = selection.MEMORY = int(sys.argv[1])
for name, sql in json.load(sys.stdin).items():
    largest = 0
    try:
        for batch in Selection(catalog_schema().empty_table(), Request(sql=sql, time_limit=30)).batches():
            largest = max(largest, batch.nbytes)
        outcome = "read"
    except (LimitError, UsageError) as error:
        outcome = error.kind
    sql_process.sql_process().close()
    status = dict(line.split(":", 1) for line in open("/proc/self/status"))
    own = int(status["VmHWM"].split()[0])  # ru_maxrss would count what started this process as well
    peak = max(own, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss) << 10
    print(json.dumps([name, outcome, largest, peak]), flush=True)
"""


@pytest.fixture(scope="module")
def large() -> dict[str, tuple[str, int, int]]:
    """Name → what came of the SQL, its largest batch [B], and most memory of a process until then
    [B]: all in one process, each query in a child of its own."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-c", READ_LARGE, str(MOST)]
    done = subprocess.run(
        command,
        input=json.dumps(LARGE),
        capture_output=True,
        text=True,
        check=False,
        env=environment,
    )
    assert done.returncode == 0, done.stderr
    return {
        name: (outcome, *sizes)
        for name, outcome, *sizes in map(json.loads, done.stdout.splitlines())
    }


@pytest.mark.parametrize("name", LARGE)
def test_sql_takes_no_more_memory_than_it_may(
    name: str, large: dict[str, tuple[str, int, int]]
) -> None:
    outcome, largest, peak = large[name]
    assert outcome in ("read", "usage", "limit")
    assert largest <= 300 << 20
    assert peak < MOST + (400 << 20)  # the limit, and what the process has with its modules


def test_a_row_of_more_values_than_can_be_held_is_refused_and_parts_are_small() -> None:
    with pytest.raises(LimitError, match="one row of the result has more than"):
        list(Selection(EMPTY, Request(sql="select list(range(5000001))")).batches())
    many = Selection(
        EMPTY, Request(sql="select range(10000) r, range i from range(4000)")
    ).batches()
    parts = list(many)
    assert [row for part in parts for row in part["i"].to_pylist()] == list(range(4000))
    assert len(parts) > 1
    assert max(part.nbytes for part in parts) <= PART
    assert {len(row) for row in parts[-1]["r"]} == {10_000}


def test_a_query_after_one_that_was_ended_has_a_process_of_its_own() -> None:
    with pytest.raises(UsageError, match="more memory"):
        Selection(EMPTY, Request(sql="select list(range(200000000))")).table()
    first = Selection(EMPTY, Request(sql="select 1 a"))
    second = Selection(EMPTY, Request(sql="select range a from range(3)"))
    assert first.table()["a"].to_pylist() == [1]
    assert second.table()["a"].to_pylist() == [0, 1, 2]
    assert first.total() == 1


ENDS: dict[str, tuple[Exception, str]] = {
    "memory": (EndedError(End.MEMORY), "needs more memory.*narrow it down"),
    "killed": (EndedError(End.SIGNAL, "SIGKILL"), r"was killed \(SIGKILL\).*do it again"),
    "crashed": (EndedError(End.SIGNAL, "SIGSEGV"), r"crashed \(SIGSEGV\).*another way"),
    "left": (
        EndedError(End.EXIT, "exit code 1: no module"),
        "has ended: exit code 1: no module.*do it again",
    ),
    "closed": (EndedError(End.CLOSED), "it was closed.*do it again"),
    "late": (EndedError(End.LATE), "longer than .*--time-limit"),
    "raised": (RuntimeError("its process raised KeyError: 'x'"), "KeyError.*another way"),
}
"""How the process of a query may end → what is reported."""


@pytest.mark.parametrize("end", ENDS)
def test_each_end_of_the_process_has_its_own_sentence(
    end: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    raised, reported = ENDS[end]
    asked = Selection(EMPTY, Request(sql="select 1 a"))

    def fail(*_: object, **__: object) -> None:
        raise raised

    monkeypatch.setattr(Child, "ask", fail)
    with pytest.raises(FlagdataError, match=reported) as refused:
        asked.total()
    assert ("memory" in refused.value.what) == (end in ("memory", "killed"))


def test_a_filter_without_an_end_is_stopped() -> None:
    rows = pa.concat_tables([EMPTY, pa.Table.from_pylist([{"kind": "clip"}], schema=EMPTY.schema)])
    where = "(select count(*) from range(1000000000000) a, range(1000000000000) b) > 0"
    with pytest.raises(LimitError, match=r"longer than 0\.2 s"):
        Selection(rows, Request(where=where, time_limit=0.2)).table()


def test_the_time_is_that_of_all_that_is_asked_of_a_selection() -> None:
    selection = Selection(
        EMPTY, Request(sql="select range a from range(1000000000000)", limit=1, time_limit=1.5)
    )
    assert selection.table().num_rows == 1
    for _ in range(2):  # the second has no time left at all
        with pytest.raises(LimitError, match=r"longer than 1\.5 s"):
            selection.total()


@pytest.mark.parametrize(
    ("name", "limit", "sql"),
    [
        ("CELL_LIMIT", 1000, "select range a from range(1001)"),
        ("BYTE_LIMIT", 1 << 20, "select repeat('a', 1024) from range(1025)"),
    ],
)
def test_sql_that_gives_more_than_can_be_held_is_refused(
    name: str, limit: int, sql: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(selection, name, limit)
    with pytest.raises(LimitError, match=r"gives more than .* --csv and --arrow"):
        as_document(Selection(EMPTY, Request(sql=sql)), at=None, version=0)
    assert Selection(EMPTY, Request(sql=sql, limit=1000)).table().num_rows == 1000
    assert sum(batch.num_rows for batch in Selection(EMPTY, Request(sql=sql)).batches()) > 1000


def test_what_fails_while_rows_are_read_is_the_users_error() -> None:
    sql = "select cast(case when range < 200000 then '1' else 'x' end as int) from range(200001)"
    with pytest.raises(UsageError, match="DuckDB cannot run it"):
        Selection(EMPTY, Request(sql=sql)).table()


def test_a_time_limit_is_a_length_of_time() -> None:
    cases = [0.0, -1.0, float("nan"), float("inf")]
    assert (
        unrefused(
            lambda seconds: Request(sql="select 1", time_limit=seconds),
            zip(cases),
            UsageError,
            "time limit",
        )
        == []
    )


def test_no_length_of_time_is_too_long() -> None:
    assert Selection(EMPTY, Request(sql="select 1 a", time_limit=1e300)).table()[
        "a"
    ].to_pylist() == [1]


def test_the_commands_default_is_the_librarys() -> None:
    (option,) = [parameter for parameter in command.params if parameter.name == "time_limit"]
    assert option.default == selection.TIME_LIMIT
