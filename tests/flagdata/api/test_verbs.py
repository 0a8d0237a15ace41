"""Verbs as calls on a lake: what they make is what the commands of their names make."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import flagdata
from flagdata.errors import ConflictError, RefusedError, UsageError
from flagdata.lake import Lake
from tests.program import Run, invoke


@pytest.fixture
def run(lake: Lake) -> Run:
    return lambda *arguments: invoke(*arguments, "--lake", lake.path)


def test_a_recording_is_brought_in_aligned_tagged_and_exported(
    lake: Lake, video: Path, wind_log: Path, tmp_path: Path, run: Run
) -> None:
    film, wind = flagdata.ingest([video, wind_log], lake=lake, session="field")
    assert (film.created, film.artifact.kind, wind.artifact.kind) == (True, "camera", "wind")
    for result, source in ((film, video), (wind, wind_log)):
        there = run("ingest", source, "--session", "field", "--json").document["results"]
        assert [(one["artifact"], one["created"]) for one in there] == [(result.artifact.id, False)]
    (again,) = flagdata.ingest(str(video), lake=str(lake.path), session="field")
    assert not again.created
    names = (film.artifact.id, wind.artifact.id)
    found = flagdata.align(
        *names, lake=lake, by="given", clock_offset=0, offset_sigma=0.1, window=1.0
    )
    same = run(
        "align",
        *names,
        *[
            "--by",
            "given",
            "--clock-offset",
            "0",
            "--offset-sigma",
            "0.1",
            "--window",
            "1s",
            "--json",
        ],
    ).document
    assert (found["recording"], found["created"], same["created"]) == (
        same["recording"],
        True,
        False,
    )
    (v1,) = flagdata.tag("v1", lake=lake)
    assert [one.name for one in flagdata.tag(lake=lake)] == [v1.name] == ["v1"]
    with pytest.raises(ConflictError):
        flagdata.tag("v1", lake=lake)
    manifest = flagdata.export(
        "csv", lake=lake, to=tmp_path / "winds", where="kind = 'wind'", at="v1"
    )
    assert manifest["artifacts"] == 1
    assert (tmp_path / "winds" / "manifest.json").is_file()
    assert flagdata.tag("v1", lake=lake, delete=True, message="no more") == ()
    assert flagdata.tag(lake=lake) == ()


def test_a_verb_of_a_lake_returns_what_its_command_prints_as_json(
    lake: Lake, video: Path, run: Run
) -> None:
    flagdata.ingest(video, lake=lake, name="film", start="2026-05-01T12:00:00Z")
    made = flagdata.declare("film", speed=4, sigma=0.2, name="tunnel", lake=lake)
    assert (
        run("ls", "--kind", "recording", "--json").document["artifacts"][0]["artifact"]
        == made["recording"]
    )
    labelled = flagdata.label(["tunnel", "usable=true"], lake=lake)
    assert (made["recording"] in labelled["artifacts"], labelled["labels"]) == (
        True,
        {"usable": True},
    )
    for found, words in (
        (flagdata.ls(lake=lake, kind="clip"), ("ls", "--kind", "clip")),
        (flagdata.show("film", lake=lake), ("show", "film")),
        (flagdata.lineage("film", lake=lake), ("lineage", "film")),
        (flagdata.log(lake=lake, limit=2), ("log", "--limit", 2)),
        (flagdata.diff("0", lake=lake), ("diff", 0)),
        (flagdata.verify(lake=lake, sample=1), ("verify", "--sample", 1)),
        (flagdata.gc(lake=lake, grace=0, dry_run=True), ("gc", "--older-than", "0s", "--dry-run")),
        (flagdata.expire(lake=lake, keep=1, dry_run=True), ("expire", "--keep", 1, "--dry-run")),
    ):
        printed = run(*words, "--json").document
        assert {key: value for key, value in printed.items() if key != "schema"} == json.loads(
            json.dumps(found)
        )
        assert found


def test_options_that_contradict_each_other_are_refused_in_calls_as_in_commands(
    lake: Lake, wind_log: Path
) -> None:
    with pytest.raises(UsageError, match="without a NAME"):
        flagdata.tag(lake=lake, at="main")
    with pytest.raises(UsageError, match="--salt needs --split"):
        flagdata.export("csv", lake=lake, to="out", salt="x")
    with pytest.raises(UsageError, match="--crop means nothing for an anemometer log"):
        flagdata.ingest(wind_log, lake=lake, crop="auto")
    with pytest.raises(UsageError, match="give a list"):
        flagdata.withdraw("film", message="why", lake=lake)  # type: ignore[arg-type]
    with pytest.raises(UsageError, match="which versions expire"):
        flagdata.expire(lake=lake)
    assert lake.rows().num_rows == 0


def test_a_table_that_nobody_confirmed_is_refused_in_a_call(lake: Lake, tmp_path: Path) -> None:
    path = tmp_path / "wind.csv"
    path.write_text(
        "time,wind\n"
        + "".join(f"2026-05-13T12:00:{k:02d}Z,{4 + k % 7 / 10:.1f}\n" for k in range(30))
    )
    with pytest.raises(RefusedError):
        flagdata.ingest(path, lake=lake)


def test_a_kind_that_is_named_takes_its_own_sources_and_options_alone(
    run: Run,
    lake: Lake,
    video: Path,
    wind_log: Path,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    assert (
        run("ingest", "wind", video, "--json").document["what"]
        == "this is a camera file, not an anemometer log"
    )
    assert run("ingest", "film", video, "--unit", "km/h").code == 2
    assert run("ingest", "film", wind_log).code == 1
    assert run("ingest", "meshes").code == 2
    assert lake.rows().num_rows == 0
    assert run("ingest", "wind", wind_log).code == 0
    assert run("--json", "ingest", "film", video).document["results"][0]["kind"] == "camera"
    monkeypatch.chdir(tmp_path)
    (tmp_path / "film").write_bytes(wind_log.read_bytes())
    assert "already in the lake" in run("ingest", "film").out  # which is the file here
    assert run("ingest", "film", video).code == 0
