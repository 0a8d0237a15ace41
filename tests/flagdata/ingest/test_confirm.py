"""Drafted readings of logs enter only when somebody confirmed them, and what was understood is part
of the identity."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from textwrap import indent

import numpy as np
import pytest

from flagdata.commands import confirm_recipe as commands
from flagdata.errors import ConflictError
from flagdata.ingest import (
    Accepting,
    Drafted,
    OpenFactsError,
    UnconfirmedError,
    WindIngest,
    WindOptions,
    ingest_wind,
    read_log,
    source_artifacts,
)
from flagdata.lake import Lake
from flagdata.record import Record
from flagdata.record.signals import WindLog
from measure.trajectories import LogPlacement, from_log
from tests.confirming import CONFIRMED
from tests.program import Run, invoke

ROWS = [f"14.05.2026;11:30:{k:02d};{18 + k % 7},4;{200 + k}" for k in range(30)]
TABLE = "\n".join(["Date;Time;Speed [km/h];Dir [deg]", *ROWS]) + "\n"
STATED = "time,wind_speed (m/s)\n" + "".join(
    f"2026-05-01T12:00:{k:02d}Z,{5 + k % 3}.5\n" for k in range(30)
)
ZONED = WindIngest(wind=WindOptions(zone="+02:00"))


@pytest.fixture
def table(tmp_path: Path) -> Path:
    path = tmp_path / "mast.csv"
    path.write_text(TABLE)
    return path


@pytest.fixture
def run(lake: Lake) -> Run:
    return lambda *arguments: invoke(*arguments, "--lake", lake.path)


@pytest.fixture
def types(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    """Somebody at the terminal, who types these lines."""

    def types(text: str) -> None:
        monkeypatch.setattr(commands, "at_terminal", lambda: True)
        monkeypatch.setattr("sys.stdin", io.StringIO(text))

    return types


def test_without_a_terminal_a_draft_ends_with_3_and_both_ways_out_and_nothing_is_written(
    run: Run, lake: Lake, table: Path
) -> None:
    code, _, err = run("ingest", table, "--zone", "+02:00")
    assert code == 3
    assert "--accept " in err
    assert "--sensor FILE.toml" in err
    assert lake.rows().num_rows == 0
    # 18.4 km/h is 5.11 m/s, and 11:30 at +02:00 is 09:30 UTC.
    assert "14.05.2026;11:30:00;18,4;200  →  2026-05-14T09:30:00Z  5.11 m/s from 200°" in err


def test_the_hash_that_the_refusal_shows_confirms_the_draft_and_no_other(
    run: Run, lake: Lake, table: Path
) -> None:
    refused = json.loads(run("ingest", table, "--zone", "+02:00", "--json")[1])
    assert (refused["kind"], "5.11 m/s" in refused["preview"]) == ("unconfirmed", True)
    accept = ("--accept", refused["accept"])
    assert run("ingest", table, "--zone", "+01:00", *accept)[0] == 3
    table.write_text(TABLE.replace("18,4", "19,4"))
    assert run("ingest", table, "--zone", "+02:00", *accept)[0] == 3
    assert lake.rows().num_rows == 0
    table.write_text(TABLE)
    code, out, err = run("ingest", table, "--zone", "+02:00", *accept, "--json")
    assert code == 0, err
    assert (
        json.loads(out)["results"][0]["report"]["confirmed"] == f"accepted as {refused['accept']}"
    )


def test_a_draft_that_was_confirmed_is_found_again_without_a_question(
    lake: Lake, table: Path
) -> None:
    first = ingest_wind(lake, table, ZONED, confirm=CONFIRMED)
    again = ingest_wind(lake, table, ZONED)
    assert (again.created, again.artifact.id) == (False, first.artifact.id)


def test_at_a_terminal_the_zone_is_typed_and_a_row_confirmed(
    run: Run, lake: Lake, table: Path, types
) -> None:
    types("Mars\n+02:00\ny\nyes\n")
    code, _, err = run("ingest", table)
    assert code == 0, err
    assert '"On 2026-05-14 at 09:30:00 UTC the wind was 5.11 m/s from 200°." Is that right?' in err
    assert "type yes or no" in err
    (row,) = lake.rows().to_pylist()
    assert json.loads(row["recipe"])["wind"]["zone"] == "+02:00"
    assert json.loads(row["report"])["confirmed"] == "at a terminal"


def test_a_no_at_the_terminal_writes_nothing(run: Run, lake: Lake, table: Path, types) -> None:
    types("no\n")
    assert run("ingest", table, "--zone", "+02:00")[0] == 3
    assert lake.rows().num_rows == 0


def test_a_table_that_states_all_of_itself_needs_no_question(lake: Lake, tmp_path: Path) -> None:
    path = tmp_path / "mast.csv"
    path.write_text(STATED)
    assert ingest_wind(lake, path).created
    assert read_log(path).stated


@pytest.mark.parametrize(
    ("heading", "rows"),
    [
        ("time,wind_speed", "2026-05-01T12:00:{k:02d}Z,{v}.5"),
        ("time,wind_speed (m/s),gust (m/s)", "2026-05-01T12:00:{k:02d}Z,{v}.5,9"),
        ("time,speed (m/s)", "2026-05-01T12:00:{k:02d}Z,{v}.5"),
        ("time,wind_speed (m/s)", "2026-05-14 12:00:{k:02d},{v}.5"),
        ("time,wind_speed (m/s)", "14/05/2026 12:00:{k:02d},{v}.5"),
        ("logged 2026\ntime,wind_speed (m/s)", "2026-05-01T12:00:{k:02d}Z,{v}.5"),
    ],
)
def test_what_one_thing_of_is_inferred_is_a_draft(tmp_path: Path, heading: str, rows: str) -> None:
    path = tmp_path / "mast.csv"
    path.write_text(
        heading + "\n" + "".join(rows.format(k=k, v=4 + k % 3) + "\n" for k in range(30))
    )
    zone = None if "Z" in rows else "UTC"
    log = read_log(
        path, WindOptions(zone=zone, unit="m/s" if heading == "time,wind_speed" else None)
    )
    known = {"time,wind_speed", "time,wind_speed (m/s),gust (m/s)", "time,wind_speed (m/s)"}
    assert log.stated == (heading in known and "/2026" not in rows)


def test_a_stated_table_invents_no_codes_for_no_value(tmp_path: Path) -> None:
    path = tmp_path / "mast.csv"
    path.write_text(STATED)
    assert "missing = []" in read_log(path).drafted


def test_close_loop_reads_no_draft_that_nobody_confirmed(table: Path) -> None:
    options, placement = WindOptions(zone="+02:00"), LogPlacement(axis=(1.0, 0.0, 0.0))
    with pytest.raises(UnconfirmedError, match="--accept") as refused:
        from_log(table, placement, options)
    wind, _ = from_log(table, placement, options, confirm=Accepting(refused.value.accept))
    np.testing.assert_allclose(wind.velocity[0], [18.4 / 3.6, 0, 0])


def test_close_loop_asks_at_a_terminal_what_a_log_leaves_open_as_ingest_does(
    table: Path, types, monkeypatch: pytest.MonkeyPatch
) -> None:
    placement = LogPlacement(axis=(1.0, 0.0, 0.0))
    with pytest.raises(OpenFactsError, match="zone"):
        from_log(table, placement, confirm=commands.on_command_line(None, as_json=False))
    types("+02:00\nyes\n")
    wind, found = from_log(table, placement, confirm=commands.on_command_line(None, as_json=False))
    np.testing.assert_allclose(wind.velocity[0], [18.4 / 3.6, 0, 0])
    assert [one.what for one in found if one.kind == "answers-given"] == [
        "given at the terminal: zone +02:00"
    ]


def test_an_exact_format_that_lacks_its_zone_alone_asks_for_it_with_both_ways_out(
    run: Run, tmp_path: Path
) -> None:
    path = tmp_path / "kestrel.csv"
    rows = "".join(
        f"2026-05-14 11:30:{k:02d},21.3,48.2,{5 + k % 3}.2,{220 + k}\n" for k in range(30)
    )
    path.write_text(
        "Device Name,KESTREL - 2412345\nDevice Model,5500\nSerial Number,2412345\n"
        "FORMATTED DATE_TIME,Temperature,Relative Humidity,Wind Speed,Direction - True\n"
        f"YYYY-MM-DD HH:MM:SS,°C,%,m/s,Deg\n{rows}"
    )
    code, _, err = run("ingest", path)
    assert code == 3
    assert "--zone Europe/Amsterdam" in err
    assert "[time] zone: --sensor FILE.toml" in err


def test_a_table_of_several_sites_is_refused_with_the_lines_of_the_recipe_that_reads_one(
    run: Run, lake: Lake, tmp_path: Path
) -> None:
    path = tmp_path / "masts.csv"
    rows = [
        f"2026-05-01T12:00:{k:02d}Z,{mast},{v + k % 3}.5"
        for k in range(30)
        for mast, v in (("A", 4), ("B", 9))
    ]
    path.write_text("\n".join(["time,site,wind_speed (m/s)", *rows]) + "\n")
    code, _, err = run("ingest", path)
    assert code == 3
    lines = '[rows]\ncolumn = "site"\nvalue = "A"\n'
    assert indent(lines, "  ") in err
    recipe = tmp_path / "mast-a.toml"
    drafted = json.loads(run("ingest", "--sniff", path, "--json")[1])["sources"][0]["guesses"][0][
        "draft"
    ]
    recipe.write_text(f"{drafted}\n{lines}")
    assert run("ingest", path, "--sensor", recipe)[0] == 0
    (row,) = lake.rows().to_pylist()
    assert json.loads(row["report"])["samples"] == 30
    assert json.loads(row["report"])["mean_speed"] == pytest.approx(
        5.5
    )  # of mast A; of mast B it is 10.5


def test_the_preview_shows_what_was_lost(tmp_path: Path) -> None:
    path = tmp_path / "mast.csv"
    path.write_text(TABLE.replace("20,4;202", "?!;202", 1) + "14.05.2026;nonsense;18,4;200\n")
    options = WindOptions(zone="+02:00", expect=("lines",))
    log = read_log(path, options)
    preview = Drafted(path=path, source_hash="", readings=((log, options),)).preview()
    assert "error: 1 rows whose stamp is not" in preview
    assert "error: 1 unreadable values of wind_speed" in preview


def _understood(log: WindLog, **changes: object) -> WindLog:
    """A reading as another version of the readers made it."""
    factor = float(str(changes.get("factor", 1.0)))
    channels = {**log.series.channels, "wind_speed": log.series.channels["wind_speed"] * factor}
    return replace(
        log,
        series=replace(log.series, channels=channels),
        drafted=str(changes["drafted"]),
        plan={"format": "delimited", "recipe": changes["drafted"], "reader": 0},
    )


def test_two_drafts_that_differ_are_two_artifacts_and_the_second_names_the_first(
    lake: Lake, table: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    right = read_log(table, ZONED.wind)
    monkeypatch.setattr(
        source_artifacts,
        "read_log",
        lambda path, options: _understood(right, factor=3.6, drafted="as m/s"),
    )
    wrong = ingest_wind(lake, table, ZONED, confirm=CONFIRMED)
    monkeypatch.undo()
    mended = ingest_wind(lake, table, ZONED, confirm=CONFIRMED)
    assert mended.created
    assert mended.artifact.id != wrong.artifact.id
    (found,) = [f for f in mended.report["findings"] if f["kind"] == "ingested-before"]
    assert wrong.artifact.id[:12] in found["what"]
    assert f"mean speed {3.6 * mended.report['mean_speed']:.4g} m/s" in found["what"]


def _of_an_older_version(lake: Lake, path: Path, options: WindIngest) -> str:
    """Put the artifact that a version made which had no plans; its id."""
    made = ingest_wind(lake, path, options, confirm=CONFIRMED).artifact
    lake.withdraw([made.id], "as an older version made it")
    with lake.transaction("older") as transaction:
        older = replace(made, recipe=options.recipe())
        transaction.add(older)
    return older.id


def test_a_log_that_an_older_version_read_alike_is_in_the_lake_already(
    lake: Lake, table: Path, tmp_path: Path
) -> None:
    recipe = tmp_path / "mast.toml"
    recipe.write_text(read_log(table, ZONED.wind).drafted)
    options = WindIngest(wind=WindOptions(recipe=str(recipe), zone="+02:00"))
    older = _of_an_older_version(lake, table, options)
    again = ingest_wind(lake, table, options)
    assert (again.created, again.artifact.id) == (False, older)
    with pytest.raises(ConflictError):
        ingest_wind(lake, table, options, labels=source_artifacts.Labels(session="other"))


def test_an_artifact_of_an_older_draft_is_reported_and_a_confirmed_one_is_made_beside_it(
    run: Run, lake: Lake, table: Path
) -> None:
    older = _of_an_older_version(lake, table, ZONED)
    code, out, _ = run("doctor")
    assert (code, "draft-unconfirmed" in out, older in out) == (3, True, True)
    assert "draft-unconfirmed" in run("show", older)[1]
    assert json.loads(run("show", older, "--json")[1])["findings"][0]["kind"] == "draft-unconfirmed"
    mended = ingest_wind(lake, table, ZONED, confirm=CONFIRMED)
    assert mended.created
    assert older[:12] in json.dumps(mended.report["findings"])
    lake.withdraw([older], "confirmed anew")
    assert "draft-unconfirmed" not in run("doctor")[1]
    assert "draft-unconfirmed" not in run("show", mended.artifact.id)[1]


def test_the_older_versions_wind_is_compared_to_the_bit(lake: Lake, table: Path) -> None:
    made = ingest_wind(lake, table, ZONED, confirm=CONFIRMED).artifact
    stored = Record.open(lake.object_path(str(made.object))).wind()
    series = read_log(table, ZONED.wind).series
    assert stored is not None
    np.testing.assert_array_equal(stored.channels["wind_speed"], series.channels["wind_speed"])
