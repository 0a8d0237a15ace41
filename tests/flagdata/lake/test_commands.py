"""The verbs on a lake: what they print, one JSON document each, and their exit codes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flagdata.core.files.addresses import lake_place
from flagdata.lake import Artifact, Lake
from flagdata.record import RecordWriter
from tests.flagdata.lake.conftest import overwrite, put_text
from tests.program import Run, invoke


@pytest.fixture
def run(lake: Lake, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Runs `flagdata ...` on the lake, named by its environment variable."""
    monkeypatch.setenv("FLAGDATA_LAKE", str(lake.path))
    return lambda *arguments: invoke(*arguments)


def test_init_makes_a_lake_that_the_others_open(run: Run, tmp_path: Path) -> None:
    made = run("init", tmp_path / "new")
    assert (made.code, made.out) == (0, f"{tmp_path / 'new'}\n")
    assert run("ls", "--lake", tmp_path / "new", "--json").document["artifacts"] == []
    assert run("init", tmp_path / "new").code == 1
    assert run("init", "--lake", tmp_path / "flagged").code == 0
    assert run("init", tmp_path / "a", "--lake", tmp_path / "b").code == 2
    assert not (tmp_path / "a").exists()


def test_a_missing_lake_is_reported_in_three_lines_with_a_fix(run: Run, tmp_path: Path) -> None:
    ended = run("ls", "--lake", tmp_path)
    assert ended.code == 1
    assert ended.out == ""
    assert ended.err.splitlines() == [
        "flagdata: there is no lake here",
        f"  where: {tmp_path}",
        "  fix:   make one with flagdata init, or name one by --lake",
    ]
    assert run("ls", "--lake", tmp_path, "--json").document["kind"] == "not-found"


def test_ls_and_show_find_an_artifact_by_the_beginning_of_its_id(run: Run, lake: Lake) -> None:
    parent = put_text(lake, "parent")
    child = put_text(lake, "child", parents=(parent.id,))
    listed = run("ls")
    assert listed.code == 0
    assert [line.split()[:3] for line in listed.out.splitlines()[1:]] == [
        [parent.id[:12], "wind", "parent"],
        [child.id[:12], "wind", "child"],
    ]
    shown = run("show", child.id[:8], "--json").document
    assert shown["artifact"]["artifact"] == child.id
    assert [relative["name"] for relative in shown["parents"]] == ["parent"]
    assert lake_place(shown["path"]).read_bytes() == b"child"
    assert f"made into       {child.id[:12]} wind child" in run("show", parent.id).out.splitlines()
    assert "object_bytes    5 B" in run("show", child.id).out.splitlines()
    assert run("show", "nothing").code == 1
    assert run("ls", "--kind", "clip", "--json").document["artifacts"] == []
    misspelt = run("ls", "--kind", "widn")
    assert misspelt.code == 2
    assert "did you mean 'wind'?" in misspelt.err


def test_show_finds_an_artifact_by_its_name_where_only_one_has_it(run: Run, lake: Lake) -> None:
    first, second = put_text(lake, "cup"), put_text(lake, "sonic")
    assert run("show", "sonic", "--json").document["artifact"]["artifact"] == second.id
    with lake.transaction("another of that name") as tx:
        tx.add(Artifact(kind="wind", name="cup", object=second.object))
    listed = run("ls", "--json").document["artifacts"]
    of_one_name = [
        f"{row['kind']} {row['artifact'][:12]}" for row in listed if row["name"] == "cup"
    ]
    ended = run("show", "cup")
    assert ended.code == 1
    assert (
        ended.err.splitlines()[0]
        == f"flagdata: 'cup' may mean 2 artifacts: {', '.join(of_one_name)}"
    )
    assert "give the id of one" in ended.err
    assert run("show", first.id, "--json").document["artifact"]["name"] == "cup"


def test_ls_counts_clips_and_lists_them_on_request(run: Run, lake: Lake) -> None:
    recording = put_text(lake, "recording")
    with lake.transaction("clips") as tx:
        for first in (0, 30):
            clip = Artifact(
                kind="clip",
                name="clip",
                object=recording.object,
                parents=(recording.id,),
                frame_first=first,
                frame_count=30,
            )
            tx.add(clip)
    listed = run("ls")
    assert [line.split()[2] for line in listed.out.splitlines()[1:]] == ["recording"]
    assert "1 artifact and 2 clips (--kind clip lists them)" in listed.err
    assert run("ls", "--json").document["clips_not_listed"] == 2
    assert len(run("ls", "--kind", "clip", "--json").document["artifacts"]) == 2
    # the recording's nine bytes ("recording") are its own, and no clip's
    assert " 9 B" in listed.out
    assert " 9 B" not in run("ls", "--kind", "clip").out


def test_log_lists_each_commit_and_a_commit_names_a_version(run: Run, lake: Lake) -> None:
    put_text(lake, "a")
    put_text(lake, "b")
    commits = run("log", "--json").document["commits"]
    assert [(c["version"], c["added"], c["message"]) for c in commits] == [
        (2, 1, "ingest b"),
        (1, 1, "ingest a"),
        (0, 0, "create the lake"),
    ]
    at_first = run("ls", "--at", commits[1]["commit"], "--json").document["artifacts"]
    assert [artifact["name"] for artifact in at_first] == ["a"]
    assert len(run("log", "--limit", 1).out.splitlines()) == 2


def test_tags_and_branches_are_made_and_listed(run: Run, lake: Lake) -> None:
    put_text(lake, "a")
    assert run("tag", "v1").code == 0
    put_text(lake, "b")
    assert run("branch", "try", "--at", "v1").code == 0
    assert run("tag", "--json").document["tags"][0]["view"] == [{"branch": "main", "version": 1}]
    assert run("branch", "--json").document["branches"][0]["name"] == "try"
    assert [a["name"] for a in run("ls", "--at", "try", "--json").document["artifacts"]] == ["a"]
    assert run("tag", "v1").code == 1
    assert run("tag", "../v2").code == 2
    assert run("tag", "--at", "v1").code == 2


def test_merge_brings_a_branch_to_main(run: Run, lake: Lake) -> None:
    run("branch", "try")
    put_text(lake, "a", branch="try")
    assert run("merge", "try").out == "version 3: 1 added, 0 were there\n"
    assert run("merge", "try", "--json").document["added"] == []
    assert [a["name"] for a in run("ls", "--json").document["artifacts"]] == ["a"]
    assert run("merge", "v1").code == 1


def test_diff_prints_what_came_and_what_went(run: Run, lake: Lake) -> None:
    gone = put_text(lake, "gone")
    run("tag", "v1")
    came = put_text(lake, "came")
    assert run("withdraw", gone.id[:10], "-m", "wrong camera").code == 0
    assert run("diff", "v1").out.splitlines() == [
        f"+ wind        {came.id[:12]} came",
        f"+ object      {came.object}",
        f"- wind        {gone.id[:12]} gone",
        f"- object      {gone.object}",
    ]
    document = run("diff", "v1", "main", "--json").document
    assert document["schema"] == "flagdata.diff/1"
    assert [row["artifact"] for row in document["removed"]] == [gone.id]
    assert run("diff", "v2").code == 1


def test_withdraw_says_what_went_along(run: Run, lake: Lake) -> None:
    recording = put_text(lake, "recording")
    with lake.transaction("a clip") as tx:
        clip = Artifact(kind="clip", name="clip", object=recording.object, parents=(recording.id,))
        tx.add(clip)
    measured = put_text(lake, "measured", parents=(clip.id,))
    refused = run("withdraw", recording.id[:10], "-m", "wrong")
    assert refused.code == 1
    assert "--with-descendants" in refused.err
    done = run(
        "withdraw", recording.id[:10], "-m", "wrong", "--with-descendants", "--json"
    ).document
    assert (done["withdrawn"], done["descendants"]) == (
        [recording.id],
        sorted([clip.id, measured.id]),
    )
    assert run("ls", "--json").document["artifacts"] == []


def test_withdraw_takes_a_recordings_clips_without_an_option(run: Run, lake: Lake) -> None:
    recording = put_text(lake, "recording")
    with lake.transaction("clips") as tx:
        for i in range(200):
            tx.add(
                Artifact(
                    kind="clip",
                    name="c",
                    object=recording.object,
                    parents=(recording.id,),
                    frame_first=i,
                )
            )
    done = run("withdraw", recording.id, "-m", "wrong")
    assert (done.code, done.out) == (0, "version 3: 1 withdrawn from main, 200 clips went along\n")


def test_missing_refs_are_not_found_and_errors_of_names_say_branch_or_tag(run: Run) -> None:
    for ref in ("999", "nope", "c" + "0" * 16):
        ended = run("ls", "--at", ref, "--json")
        assert (ended.code, ended.document["kind"]) == (1, "not-found")
    assert "cannot name a branch" in run("branch", "a/b").err.splitlines()[0]
    assert "cannot name a branche" not in run("branch", "a/b").err
    run("tag", "v1")
    assert "a tag never moves" in run("tag", "v1").err
    assert "move" not in run("branch", "v1").err


def test_verify_counts_only_what_it_could_read(run: Run, lake: Lake) -> None:
    for text in "abc":
        put_text(lake, text)
    artifact = put_text(lake, "d")
    assert artifact.object is not None
    lake.objects.path(artifact.object).unlink()
    assert "3 of 4 objects re-hashed" in run("verify").err


def test_verify_and_doctor_exit_with_3_when_the_lake_is_damaged(run: Run, lake: Lake) -> None:
    artifact = put_text(lake, "a")
    assert [run(verb).code for verb in ("verify", "doctor")] == [0, 0]
    assert run("verify", "--sample", 1, "--json").document["healthy"] is True
    assert artifact.object is not None
    path = lake.objects.path(artifact.object)
    overwrite(path, b"b")
    assert [run(*verb).code for verb in (("verify",), ("doctor",), ("doctor", "--deep"))] == [
        3,
        0,
        3,
    ]
    document = run("verify", "--json").document
    assert (document["schema"], document["healthy"]) == ("flagdata.verify/1", False)
    assert document["findings"][0]["kind"] == "object-changed"
    assert document["findings"][0]["fix"]
    path.unlink()
    assert "error: dangling-row" in run("doctor").out


def test_verify_and_a_deep_doctor_find_a_flipped_bit_in_the_catalog(run: Run, lake: Lake) -> None:
    put_text(lake, "a")
    path = next((lake.path / "catalog").glob("*.parquet"))
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    for verb in (("verify",), ("doctor", "--deep")):
        ended = run(*verb, "--json")
        assert ended.code == 3
        assert "catalog-file-changed" in {finding["kind"] for finding in ended.document["findings"]}


def test_gc_says_what_it_deletes_and_a_dry_run_deletes_nothing(run: Run, lake: Lake) -> None:
    with lake.transaction("no row") as tx:
        path = tx.staging(".mcap")
        path.write_text("orphan")
        name = tx.put(path)
    assert run("gc").out == ""
    assert run("gc", "--older-than", "0s", "--dry-run").out == f"{name}\n"
    assert lake.object_path(name).exists()
    document = run("gc", "--older-than", "0s", "--json").document
    assert (document["deleted"], document["objects"], document["bytes"]) == (True, [name], 6)
    assert not lake.objects.path(name).exists()
    assert run("gc", "--older-than", "soon").code == 2
    assert run("gc", "--older-than", "99999999d").code == 2


def test_recover_salvages_a_record_that_was_cut_off(run: Run, tmp_path: Path) -> None:
    whole = tmp_path / "whole.mcap"
    with RecordWriter(whole, metadata={}) as writer:
        for i in range(200):
            image = np.full((300, 300), i, dtype=np.uint8)
            writer.frame(
                log_time=i * 40_000_000, publish_time=i, timestamp=i * 40_000_000, image=image
            )
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    ended = run("recover", cut, tmp_path / "saved.mcap", "--json")
    assert ended.code == 0
    assert {"cut-off", "recovered"} <= {finding["kind"] for finding in ended.document["findings"]}
    assert (tmp_path / "saved.mcap").stat().st_size > 0
    assert run("recover", cut, tmp_path / "saved.mcap").code == 1
    assert run("recover", tmp_path / "absent.mcap", tmp_path / "new.mcap").code == 1
    assert run("recover", "mcap/" + "0" * 64, tmp_path / "new.mcap").code == 1
