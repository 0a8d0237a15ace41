"""`flagdata query` as people and programs run it, on a lake with three clips whose rows are written
here."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import pyarrow as pa
import pytest

from flagdata.core.schema import CATALOG, Kind
from flagdata.lake import Artifact, Lake
from tests.program import Run, invoke

NOON = 1_777_636_800_000_000_000  # 2026-05-01T12:00:00Z
SECOND = 1_000_000_000


@pytest.fixture(scope="module")
def lake(tmp_path_factory: pytest.TempPathFactory) -> Lake:
    made = Lake.create(tmp_path_factory.mktemp("query") / "lake")
    with made.transaction("a recording with two clips") as tx:
        recording = Artifact(
            kind=Kind.RECORDING, name="pier", start=NOON, end=NOON + 60 * SECOND, frame_count=1500
        )
        tx.add(recording)
        for number in range(2):
            tx.add(clip(recording.id, number, wind=4.25 + number))
    made.tag("two")
    with made.transaction("another clip, of unknown wind") as tx:
        tx.add(clip(recording.id, 2, wind=None))
    return made


def clip(recording: str, number: int, *, wind: float | None) -> Artifact:
    start = NOON + number * SECOND
    return Artifact(
        kind=Kind.CLIP,
        name=f"pier {number}",
        recording=recording,
        parents=(recording,),
        start=start,
        end=start + SECOND,
        frame_first=30 * number,
        frame_count=30,
        wind=wind,
        wind_sigma=0.125,
        quality=("wind-stale", "wind-missing") if wind is None else (),
    )


@pytest.fixture
def run(lake: Lake) -> Run:
    return lambda *arguments: invoke("query", "--lake", lake.path, *arguments)


def test_people_see_a_table_with_units_and_the_columns_of_that_kind(run: Run) -> None:
    code, out, _ = run("--where", "kind = 'clip' and wind is not null")
    header, *rows = out.splitlines()
    assert code == 0
    assert header.split("  ")[0] == "artifact"
    assert "wind [m/s]" in header
    assert "wind_sigma [m/s]" in header
    assert "duration" not in header  # a clip's length is its frames
    assert len(rows) == 2
    assert "4.25" in rows[0]
    assert "2026-05-01T12:00:00.000Z" in rows[0]


def test_a_cut_table_says_how_much_there_is(run: Run) -> None:
    _, out, err = run("--limit", "2")
    assert len(out.splitlines()) == 1 + 2
    assert "2 of 4 rows; more by --limit" in err


def test_json_is_one_strict_document_with_units_and_the_version(run: Run, lake: Lake) -> None:
    code, out, _ = run(
        "--where", "kind = 'clip'", "--columns", "name,wind,start,start_time,quality", "--json"
    )
    found = json.loads(out, parse_constant=pytest.fail)
    assert code == 0
    assert found["schema"] == "flagdata.query/1"
    assert found["version"] == lake.resolve(None)
    assert [(column["name"], column["unit"]) for column in found["columns"]][1] == ("wind", "m/s")
    assert found["rows"][2] == {
        "name": "pier 2",
        "wind": None,
        "start": NOON + 2 * SECOND,
        "start_time": "2026-05-01T12:00:02Z",
        "quality": ["wind-stale", "wind-missing"],
    }
    assert (found["count"], found["total"]) == (3, 3)


def test_numbers_that_json_cannot_hold_are_null_and_counted(run: Run) -> None:
    _, out, _ = run(
        "--sql", "select 'nan'::double as a, 'inf'::double as b, 1.5::double as c", "--json"
    )
    found = json.loads(out, parse_constant=pytest.fail)
    assert found["rows"] == [{"a": None, "b": None, "c": 1.5}]
    assert found["not_finite"] == {"a": 1, "b": 1}


def test_every_kind_of_value_has_its_form_in_json(run: Run) -> None:
    sql = (
        "select date '2026-05-01' as d, time '12:30:00' as t, 1.5::decimal(4,2) as x, sum(n) as "
        "big,"
        " {'a': 1, 'b': [true, null]} as s from (values (9223372036854775807), (1)) as v(n)"
    )
    _, out, _ = run("--sql", sql, "--json")
    assert json.loads(out)["rows"] == [
        {
            "d": "2026-05-01",
            "t": "12:30:00",
            "x": 1.5,
            "big": 2**63,
            "s": {"a": 1, "b": [True, None]},
        }
    ]
    code, _, err = run("--sql", "select 'ab'::blob as b", "--json")
    assert code == 2
    assert "cast it in the SQL" in err


def test_two_columns_of_one_name_are_not_merged_in_json(run: Run) -> None:
    code, out, _ = run("--sql", "select 1 as a, 2 as a", "--json")
    assert code == 2
    assert json.loads(out)["schema"] == "flagdata.error/1"


def test_a_tag_shows_what_there_was(run: Run) -> None:
    _, out, _ = run("--at", "two", "--where", "kind = 'clip'", "--columns", "name", "--json")
    assert [row["name"] for row in json.loads(out)["rows"]] == ["pier 0", "pier 1"]


def test_csv_reads_back_with_lists_by_semicolon_and_unknown_empty(run: Run) -> None:
    _, out, _ = run("--where", "kind = 'clip'", "--columns", "name,wind,quality", "--csv")
    rows = list(csv.DictReader(io.StringIO(out)))
    assert rows[0] == {"name": "pier 0", "wind": "4.25", "quality": ""}
    assert rows[2] == {"name": "pier 2", "wind": "", "quality": "wind-stale;wind-missing"}


def test_an_arrow_file_has_the_rows_and_the_units(run: Run, tmp_path: Path) -> None:
    code, out, err = run("--where", "kind = 'clip'", "--arrow", str(tmp_path / "clips.arrow"))
    with pa.OSFile(str(tmp_path / "clips.arrow")) as file:
        table = pa.ipc.open_file(file).read_all()
    assert (code, out) == (0, "")
    assert "3 rows" in err
    assert table["wind"].to_pylist() == [4.25, 5.25, None]
    assert (table.schema.field("wind").metadata or {})[b"unit"] == b"m/s"
    assert [path.name for path in tmp_path.iterdir()] == ["clips.arrow"]


def test_an_arrow_file_that_is_there_is_not_overwritten(run: Run, tmp_path: Path) -> None:
    (tmp_path / "mine").write_text("mine")
    code, _, err = run("--arrow", str(tmp_path / "mine"))
    assert code == 1
    assert "exists" in err
    assert (tmp_path / "mine").read_text() == "mine"


def test_a_query_that_fails_leaves_no_arrow_file(run: Run, tmp_path: Path) -> None:
    code, _, _ = run(
        "--sql", "select error('late') from catalog", "--arrow", str(tmp_path / "out.arrow")
    )
    assert code == 2
    assert list(tmp_path.iterdir()) == []


def test_an_empty_result_is_reported_and_is_no_failure(run: Run) -> None:
    code, out, err = run("--where", "wind > 100")
    assert (code, out) == (0, "")
    assert "no rows of 4 match" in err
    _, _, err = run("--where", "kind = 'clpi'")
    assert "no rows of 4 match: no row has kind 'clpi'; did you mean 'clip'?" in err


def test_free_sql_is_shown_as_it_is(run: Run) -> None:
    _, out, _ = run(
        "--sql", "select count(*) as n, max(wind) as top from catalog where kind = 'clip'"
    )
    assert [line.split() for line in out.splitlines()] == [["n", "top"], ["3", "5.25"]]


def test_a_misspelt_column_costs_exit_two_and_names_the_right_one(run: Run) -> None:
    code, out, err = run("--where", "wnd > 3", "--json")
    assert code == 2
    assert json.loads(out)["kind"] == "unknown-name"
    assert "did you mean 'wind'?" in err


def test_two_forms_of_output_are_refused(run: Run) -> None:
    assert run("--json", "--csv")[0] == 2


def test_every_stored_column_is_described_with_its_unit(run: Run) -> None:
    _, out, _ = run("--describe", "--json")
    columns = {column["name"]: column for column in json.loads(out)["columns"]}
    assert set(CATALOG) <= set(columns)
    assert columns["clock_drift"]["unit"] == "s/s"


def test_people_read_clips_by_their_names_and_instants_as_times(run: Run) -> None:
    _, out, _ = run("--where", "kind = 'clip'")
    header, first, *_ = out.splitlines()
    assert header.split()[:3] == ["artifact", "name", "start_time"]
    assert "pier 0" in first
    _, out, _ = run("--where", "name = 'pier'", "--columns", "name,start,end,frame_count")
    assert [line.split() for line in out.splitlines()] == [
        ["name", "start", "end", "frame_count"],
        ["pier", "2026-05-01T12:00:00Z", "2026-05-01T12:01:00Z", "1500"],
    ]
    _, out, _ = run("--where", "name = 'pier'", "--columns", "start", "--csv")
    assert out.splitlines() == ["start", str(NOON)]  # for programs
