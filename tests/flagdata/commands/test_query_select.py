"""`flagdata.lake.selection` over a hand-written catalog: every expected value is worked out from
the rows below."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import pyarrow as pa
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flagdata.commands.query import VIEWS
from flagdata.core.schema import CATALOG, Kind, catalog_schema
from flagdata.errors import UnknownNameError, UsageError
from flagdata.lake import Request, Selection, Slice, View, select, selection
from flagdata.lake.selection import COLUMNS
from tests.refusals import unrefused

NOON = 1_777_636_800_000_000_000  # 2026-05-01T12:00:00Z: date -u -d @1777636800
SECOND = 1_000_000_000


def row(number: int, **values: object) -> dict[str, object]:
    blank: dict[str, object] = dict.fromkeys(CATALOG)
    return (
        blank
        | {
            "artifact": f"{number:032x}",
            "kind": "clip",
            "name": f"clip {number}",
            "branch": "main",
            "parents": [],
            "recipe_hash": "0" * 64,
            "code_version": "0.1.0",
            "format_version": 1,
            "created": datetime(2026, 5, 2, tzinfo=UTC),
            "quality": [],
        }
        | values
    )


CATALOG_ROWS = [
    row(1, kind="camera", start=NOON, end=NOON + 600 * SECOND),
    row(2, wind=2.0, start=NOON, end=NOON + SECOND, session="pier"),
    row(
        3,
        wind=4.5,
        start=NOON + 60 * SECOND + 123_456_789,
        end=NOON + 61 * SECOND,
        session="pier",
        quality=["stale"],
    ),
    row(
        4,
        wind=6.0,
        start=NOON + 120 * SECOND,
        end=NOON + 121 * SECOND,
        session="dune",
        parameters='{"density":0.2}',
    ),
    row(5, wind=None, start=None, end=None),
]


class HandWritten:
    def view(self, at: str | None) -> View:
        return (Slice(branch="main", version=3),)

    def scan(self, view: View) -> pa.Table:
        return TABLE


TABLE = pa.Table.from_pylist(CATALOG_ROWS, schema=catalog_schema())


def numbers(table: pa.Table) -> list[int]:
    return [int(artifact, 16) for artifact in table["artifact"].to_pylist()]


def test_a_filter_keeps_exactly_the_rows_it_holds_for() -> None:
    assert numbers(select(HandWritten(), "kind = 'clip' and wind between 3 and 6")) == [3, 4]
    assert numbers(select(HandWritten(), "list_contains(quality, 'stale')")) == [3]
    assert numbers(select(HandWritten(), "(parameters->>'area_weight')::double < 0.3")) == [4]


@given(
    winds=st.lists(st.one_of(st.none(), st.floats(allow_infinity=False, width=32)), max_size=8),
    low=st.floats(-20, 20),
    width=st.floats(0, 20),
)
@settings(max_examples=40, deadline=None)
def test_a_range_holds_for_exactly_the_known_numbers_in_it(
    winds: list[float | None], low: float, width: float
) -> None:
    catalog = pa.Table.from_pylist(
        [row(n, wind=wind) for n, wind in enumerate(winds)], schema=catalog_schema()
    )
    high = low + width
    found = Selection(
        catalog,
        Request(where=f"wind between {low!r}::double and {high!r}::double", order="artifact"),
    )
    wanted = [n for n, wind in enumerate(winds) if wind is not None and low <= wind <= high]
    assert numbers(found.table()) == wanted


def test_a_query_too_large_for_memory_is_an_error_and_leaves_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(selection, "MEMORY", 50_000_000)
    with pytest.raises(UsageError, match="more memory"):
        select(HandWritten(), sql="select count(distinct hash(range)) from range(20_000_000)")
    assert list(tmp_path.iterdir()) == []


def test_an_unknown_number_is_not_above_any_threshold() -> None:
    nameless = row(6, wind=float("nan"), start=NOON, end=NOON)
    catalog = pa.Table.from_pylist([*CATALOG_ROWS, nameless], schema=catalog_schema())
    assert numbers(Selection(catalog, Request(where="wind > 5")).table()) == [4]
    assert numbers(Selection(catalog, Request(where="kind = 'clip' and wind is null")).table()) == [
        6,
        5,
    ]


def test_without_an_order_rows_come_by_kind_start_and_identity_with_unknown_starts_last() -> None:
    assert numbers(select(HandWritten())) == [1, 2, 3, 4, 5]
    assert numbers(select(HandWritten(), order="wind desc nulls last")) == [4, 3, 2, 1, 5]


def test_order_may_use_a_column_that_is_not_shown() -> None:
    table = select(HandWritten(), "wind is not null", columns=["name"], order="wind desc")
    assert table.to_pylist() == [{"name": "clip 4"}, {"name": "clip 3"}, {"name": "clip 2"}]


def test_nanoseconds_stay_exact_and_times_are_cut_to_microseconds() -> None:
    table = select(
        HandWritten(), "wind = 4.5", columns=["start", "start_time", "end_time", "duration"]
    )
    start, start_time, end_time, duration = table.to_pylist()[0].values()
    assert start == NOON + 60 * SECOND + 123_456_789
    assert start_time == datetime(2026, 5, 1, 12, 1, 0, 123_456, tzinfo=UTC)
    assert end_time == datetime(2026, 5, 1, 12, 1, 1, tzinfo=UTC)
    assert duration == pytest.approx(
        0.876_543_211, abs=1e-12
    )  # 1 s - 123,456,789 ns; float64 of a second


def test_times_in_text_are_utc_unless_they_name_a_zone() -> None:
    cases = ["2026-05-01 12:01:30", "2026-05-01 14:01:30+02:00", "2026-05-01T12:01:30Z"]
    assert [numbers(select(HandWritten(), f"start_time > '{moment}'")) for moment in cases] == [
        [4] for moment in cases
    ]


def test_columns_of_the_catalog_carry_their_unit_and_free_sql_does_not() -> None:
    schema = select(HandWritten(), columns=["wind", "duration"]).schema
    assert (schema.field("wind").metadata or {})[b"unit"] == b"m/s"
    assert (schema.field("duration").metadata or {})[b"unit"] == b"s"
    assert (
        select(HandWritten(), sql="select wind * 3.6 as wind from catalog")
        .schema.field("wind")
        .metadata
        is None
    )


def test_a_result_with_all_columns_has_the_catalog_s_own_schema() -> None:
    assert select(HandWritten()).schema.equals(catalog_schema(), check_metadata=True)


def test_sql_groups_and_counts() -> None:
    table = select(
        HandWritten(),
        sql="select session, count(*) n, avg(wind) mean from catalog where session is not null "
        "group by 1 order by 1",
    )
    assert table.to_pylist() == [
        {"session": "dune", "n": 1, "mean": 6.0},
        {"session": "pier", "n": 2, "mean": 3.25},  # (2.0 + 4.5) / 2
    ]


def test_the_limit_cuts_rows_and_the_total_does_not_count_it() -> None:
    selection = Selection(TABLE, Request(where="kind = 'clip'", limit=2))
    assert numbers(selection.table()) == [2, 3]
    assert selection.total() == 4


def test_sql_that_is_not_one_read_of_the_catalog_is_refused() -> None:
    cases = [
        "create table x (a int)",
        "drop view catalog",
        "insert into stored select * from stored",
        "select 1; select 2",
        "set threads = 1",
        "copy catalog to 'out.csv'",
        "attach 'other.db'",
        "install httpfs",
        "select * from read_csv('/etc/passwd')",
        "select * from read_text('pyproject.toml')",
        "select * from glob('*')",
        "select * from 'pyproject.toml'",
        "export database 'out'",
        "",
    ]
    assert not unrefused(lambda sql: select(HandWritten(), sql=sql), zip(cases), UsageError)


def test_a_filter_cannot_be_more_than_a_condition() -> None:
    cases = [
        "1 = 1; drop view catalog",
        "1 = 1) or (1 = 1",
        "(select count(*) from read_csv('/etc/passwd')) > 0",
        "",
        ";",
    ]
    assert not unrefused(lambda where: select(HandWritten(), where), zip(cases), UsageError)


def test_python_variables_are_not_tables() -> None:
    secret = pa.table({"a": [1]})
    with pytest.raises(UsageError, match="no table 'secret'"):
        select(HandWritten(), sql="select * from secret")
    assert secret.num_rows == 1


@pytest.mark.parametrize(
    ("where", "fix"),
    [
        ("winds > 3", "did you mean 'wind'?"),
        ("catalog.wnd > 3", "did you mean 'wind'?"),
        ("kind = clip", "'clip' in single quotes"),
        ("end > 3", '"end"'),
        ("start > '2026-05-01 12:00'", "start_time or end_time"),
        ("wind > 'much'", "--describe"),
    ],
)
def test_mistakes_are_answered_with_what_to_write(where: str, fix: str) -> None:
    with pytest.raises(UsageError) as caught:
        select(HandWritten(), where)
    assert fix in caught.value.fix
    assert caught.value.where == where


def test_requests_that_contradict_themselves_are_refused() -> None:
    with pytest.raises(UsageError, match="leaves no room"):
        Request(sql="select 1", where="wind > 3")
    with pytest.raises(UsageError, match="limit"):
        Request(limit=-1)
    with pytest.raises(UnknownNameError, match="did you mean 'wind'"):
        Request(columns=("wnid",))


def test_every_column_says_what_it_is() -> None:
    assert all(field.about for field in COLUMNS.values())
    assert set(CATALOG) < set(COLUMNS)


def test_rows_of_any_kind_have_columns_for_people() -> None:
    assert VIEWS.keys() == {*Kind, None}
    assert all(COLUMNS.keys() >= set(columns) for columns in VIEWS.values())
