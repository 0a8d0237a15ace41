"""A result that other code infers from the same inputs is another version of it; both are kept, the
newest is meant."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest

from flagdata.core.schema import Kind
from flagdata.lake import Artifact, Lake, Placed, Request, Selection, keep, place_result, versions
from flagdata.lake.ancestry import ancestry
from tests.flagdata.lake.conftest import put_text
from tests.program import Run, invoke

OLD, NEW, NEWEST = "0.1.0+aaaaaaa", "0.1.0+bbbbbbb", "0.1.0+ccccccc"


def verdict(recording: Artifact, code: str, *, says: str = "none", level: float = 0.05) -> Artifact:
    return Artifact(
        kind=Kind.MEASUREMENT,
        name="flag",
        parents=[recording.id],
        recipe={"level": level},
        seed=3,
        code_version=code,
        report=f'{{"words": "{says}"}}',
    )


def kept(lake: Lake, row: Artifact, *, branch: str = "main") -> Placed:
    return keep(
        lake,
        row,
        lambda staged: (staged.mkdir(), (staged / "x").write_text(str(row.report))),
        "infer",
        branch=branch,
        derived=lambda one: [
            replace(one, kind=Kind.MODEL, name="flag-base", object=None, parents=[one.id])
        ],
    )


@pytest.fixture
def recording(lake: Lake) -> Artifact:
    return put_text(lake, "recording")


def test_what_newer_code_infers_is_kept_beside_the_older_result_and_found_by_the_name(
    lake: Lake, recording: Artifact
) -> None:
    first = kept(lake, verdict(recording, OLD))
    second = kept(lake, verdict(recording, NEW, says="lift"))
    assert (first.new, first.version, second.new, second.version) == (True, 1, True, 2)
    assert lake.artifact("flag").report == '{"words": "lift"}'
    assert lake.artifact(first.artifact.id).report == '{"words": "none"}'
    assert [one.code_version for one in versions(lake, lake.artifact("flag"))] == [OLD, NEW]
    made = ancestry(lake.rows(), recording.id).relatives.values()
    assert {one.code_version for one in made if one.kind == Kind.MEASUREMENT} == {OLD, NEW}
    assert (
        second.sentence
        == f"committed as version 2 of 'flag'; version 1, {first.artifact.id[:12]}, is by code "
        f"{OLD}"
    )


def test_the_first_version_has_the_identity_of_what_went_in_as_in_every_lake_before(
    lake: Lake, recording: Artifact
) -> None:
    assert kept(lake, verdict(recording, OLD)).artifact.id == verdict(recording, NEW).id


def test_the_same_code_again_adds_nothing(lake: Lake, recording: Artifact) -> None:
    first, second = (kept(lake, verdict(recording, code)) for code in (OLD, NEW))
    head = lake.resolve(None)
    again = [kept(lake, verdict(recording, code)) for code in (OLD, NEW)]
    assert [(one.new, one.version, one.artifact.id) for one in again] == [
        (False, 1, first.artifact.id),
        (False, 2, second.artifact.id),
    ]
    assert lake.resolve(None) == head
    assert [one.sentence for one in again] == [
        (
            f"there already as version 1 of 'flag'; version 2, {second.artifact.id[:12]}, is by code "
            f"{NEW}"
        ),
        "there already",
    ]


def test_other_options_are_another_result_and_no_version(lake: Lake, recording: Artifact) -> None:
    kept(lake, verdict(recording, OLD))
    assert kept(lake, verdict(recording, NEW, level=0.01)).version == 1


def test_a_model_by_its_name_is_that_of_the_newest_verdict(lake: Lake, recording: Artifact) -> None:
    for code in (OLD, NEW, NEWEST):
        newest = kept(lake, verdict(recording, code))
        assert lake.artifact("flag-base").parents == (newest.artifact.id,)


def test_branches_that_run_the_same_code_have_the_same_version_once_they_are_merged(
    lake: Lake, recording: Artifact
) -> None:
    kept(lake, verdict(recording, OLD))
    lake.branch("other")
    here, there = (
        kept(lake, verdict(recording, NEW), branch=branch) for branch in ("main", "other")
    )
    assert here.artifact.id == there.artifact.id
    kept(lake, verdict(recording, NEWEST), branch="other")
    lake.merge("other", "take in")
    assert [one.code_version for one in versions(lake, here.artifact)] == [OLD, NEW, NEWEST]


def test_a_version_stays_one_where_the_first_was_withdrawn(lake: Lake, recording: Artifact) -> None:
    first, second = (kept(lake, verdict(recording, code)).artifact for code in (OLD, NEW))
    lake.withdraw(sorted({first.id, *lake.descendants([first.id])}), "it was wrong")
    assert lake.artifact("flag").id == second.id
    assert place_result(lake, verdict(recording, NEW)).artifact.id == second.id


def test_ls_and_show_say_which_version_is_superseded(
    lake: Lake, recording: Artifact, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FLAGDATA_LAKE", str(lake.path))
    run: Run = lambda *arguments: invoke(*arguments)  # noqa: E731
    first, second = (kept(lake, verdict(recording, code)).artifact for code in (OLD, NEW))
    listed = {row["artifact"]: row for row in run("ls", "--json").document["artifacts"]}
    assert (listed[first.id]["superseded"], listed[second.id]["superseded"]) == (True, False)
    models = {
        row["parents"][0]: row["superseded"] for row in listed.values() if row["kind"] == "model"
    }
    assert models == {first.id: True, second.id: False}
    shown = run("show", "flag", "--json").document
    assert shown["artifact"]["artifact"] == second.id
    assert shown["versions"] == [
        {"version": 1, "artifact": first.id, "code_version": OLD},
        {"version": 2, "artifact": second.id, "code_version": NEW},
    ]
    assert f"version 1       {first.id[:12]} by code {OLD}\n" in run("show", "flag").out


def test_the_sql_of_the_docs_chooses_the_newest_versions(lake: Lake, recording: Artifact) -> None:
    page = Path(__file__).resolve().parents[3] / "docs" / "versions-and-recovery.md"
    (sql,) = re.findall(
        r"^```sql\n(.*?)^```", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE
    )
    for code in (OLD, NEW, NEWEST):
        kept(lake, verdict(recording, code))
    other = kept(lake, verdict(recording, OLD, level=0.01))
    found = Selection(lake.scan(lake.view(None)), Request(sql=sql)).table()
    assert set(found["artifact"].to_pylist()) == {
        versions(lake, verdict(recording, OLD))[-1].id,
        other.artifact.id,
    }
