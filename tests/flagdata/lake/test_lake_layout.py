"""Folders that are links, links inside them, files that cannot be opened, lakes that can only be
read."""

from __future__ import annotations

import itertools
import json
import os
import re
import shutil
from collections.abc import Callable
from datetime import timedelta
from pathlib import Path

import pytest

from flagdata.core.findings import Finding, Severity
from flagdata.core.schema import Kind
from flagdata.errors import CorruptError, FlagdataError
from flagdata.lake import (
    Artifact,
    Lake,
    collect,
    doctor,
    garbage,
    object_names,
    verify,
    verify_catalog,
)
from flagdata.lake.lake_layout import FOLDERS, LinkError
from tests.flagdata.lake.conftest import LINKS, put_older_ref, put_text
from tests.program import invoke

pytestmark = pytest.mark.disk(LINKS)
NOW = timedelta(0)


def tree(folder: Path) -> dict[str, tuple[int, bytes]]:
    """Every file of a folder by its path: when it was last written, and its bytes."""
    files = (path for path in folder.rglob("*") if path.is_file())
    return {
        str(path.relative_to(folder)): (path.stat().st_mtime_ns, path.read_bytes())
        for path in files
    }


def brief(findings: tuple[Finding, ...]) -> list[tuple[str, Severity, str | None]]:
    return [(finding.kind, finding.severity, finding.where) for finding in findings]


def put_folder(lake: Lake) -> Path:
    """Commit a row whose object is a folder of two files; where it is."""
    with lake.transaction("a folder") as tx:
        staged = tx.staging(".zarr")
        (staged / "positions").mkdir(parents=True)
        (staged / "zarr.json").write_text("{}")
        (staged / "positions" / "0").write_text("chunk")
        name = tx.put(staged)
        tx.add(Artifact(kind=Kind.MESHES, name="m", object=name, source_hash="0" * 64))
    return lake.object_path(name)


@pytest.fixture
def victim(tmp_path: Path) -> Lake:
    """Another lake, of which a wrong collection would take something in any folder."""
    lake = Lake.create(tmp_path / "victim")
    put_text(lake, "precious")
    put_folder(lake)
    lake.tag("v1")
    lake.branch("try")
    return lake


@pytest.mark.parametrize("name", FOLDERS)
def test_a_folder_that_is_a_link_is_refused_by_all_that_writes_and_named_by_doctor_and_verify(
    lake: Lake, victim: Lake, name: str
) -> None:
    artifact = put_text(lake, "mine")
    with lake.transaction("one more, so that every folder has been made"):
        pass
    folder = lake.path / name
    folder.rename(lake.path.with_name("moved"))
    folder.symlink_to(victim.path / name)
    before = tree(victim.path), tree(lake.path)
    writes: list[Callable[[], object]] = [
        lambda: collect(lake, grace=NOW),
        lambda: garbage(lake, grace=NOW),
        lambda: put_text(lake, "more"),
        lambda: lake.tag("v2"),
        lambda: lake.branch("b"),
        lambda: lake.withdraw([artifact.id], "no"),
        lambda: lake.merge("try", "no"),
    ]
    for write in writes:
        with pytest.raises(LinkError) as refused:
            write()
        assert refused.value.where == str(folder)
    for examined in (doctor(lake, grace=NOW), verify_catalog(lake)):
        assert ("link", Severity.ERROR, str(folder)) in brief(examined)
    assert (tree(victim.path), tree(lake.path)) == before


def test_a_folder_that_is_a_file_is_refused_too(lake: Lake) -> None:
    (lake.path / "zarr").rmdir()
    (lake.path / "zarr").write_text("mine")
    with pytest.raises(LinkError, match="no folder"):
        put_text(lake, "a")
    assert (lake.path / "zarr").read_text() == "mine"


def test_a_linked_object_and_a_linked_chunk_are_findings_and_others_are_checked_all_the_same(
    lake: Lake, tmp_path: Path
) -> None:
    file, damaged = (
        lake.object_path(str(put_text(lake, text).object)) for text in ("linked", "damaged")
    )
    folder = put_folder(lake)
    damaged.chmod(0o644)
    damaged.write_text("demaged")
    for path in (file, folder / "positions" / "0"):
        shutil.move(path, tmp_path / path.name)
        path.symlink_to(tmp_path / path.name)
    links = [("link", Severity.ERROR, str(path)) for path in (file, folder)]
    assert brief(doctor(lake, grace=NOW)) == links
    changed = ("object-changed", Severity.ERROR, str(damaged))
    assert sorted(brief(verify(lake, object_names(lake)))) == sorted([*links, changed])
    assert verify_catalog(lake) == ()
    assert collect(lake, grace=NOW).objects == ()  # rows need them


def test_doctor_and_verify_name_a_link_once_each(lake: Lake) -> None:
    path = lake.object_path(str(put_text(lake, "linked").object))
    path.rename(lake.path / "elsewhere")
    path.symlink_to(lake.path / "elsewhere")
    for command in (["doctor"], ["doctor", "--deep"], ["verify"]):
        code, said, _ = invoke(*command, "--lake", lake.path)
        assert code == 3
        assert said.count("error: ") == said.count("error: link:") == 1, said


def test_ingesting_again_replaces_a_link_by_the_object_and_leaves_what_it_leads_to(
    lake: Lake, tmp_path: Path
) -> None:
    put_text(lake, "file")
    for path in (lake.object_path(str(put_text(lake, "file").object)), put_folder(lake)):
        elsewhere = tmp_path / path.name
        path.rename(elsewhere)
        for target in (elsewhere, tmp_path / "nowhere"):
            path.unlink(missing_ok=True) if path.is_symlink() or path.is_file() else shutil.rmtree(
                path, True
            )
            path.symlink_to(target)
            put_text(lake, "file")
            put_folder(lake)
            assert not path.is_symlink()
            assert elsewhere.exists()
            assert doctor(lake, grace=NOW) == ()
    assert verify(lake, object_names(lake)) == ()


def test_an_orphan_that_is_a_link_is_deleted_and_what_it_leads_to_is_not(
    lake: Lake, victim: Lake, tmp_path: Path
) -> None:
    folder = put_folder(victim)
    orphans = [lake.path / "zarr" / folder.name, lake.path / "zarr" / f"{'0' * 64}.zarr"]
    orphans[0].symlink_to(folder)
    orphans[1].mkdir()
    (orphans[1] / "inner").symlink_to(folder)
    dangling = lake.path / "mcap" / f"{'0' * 64}.mcap"
    dangling.symlink_to(tmp_path / "nowhere")
    before = tree(victim.path)
    assert sorted(collect(lake, grace=NOW).objects) == sorted(
        [*(f"zarr/{path.stem}" for path in orphans), f"mcap/{dangling.stem}"]
    )
    assert tree(victim.path) == before
    assert doctor(lake, grace=NOW) == ()


def test_a_lock_that_is_a_link_is_refused_and_makes_no_file_elsewhere(
    lake: Lake, tmp_path: Path
) -> None:
    for name in (".collect", ".turn"):
        (lake.staging / name).unlink(missing_ok=True)
        (lake.staging / name).symlink_to(tmp_path / "made")
        with pytest.raises(LinkError, match="lock"):
            put_text(lake, "a")
        with pytest.raises(LinkError, match="lock"):
            collect(lake, grace=NOW)
        (lake.staging / name).unlink()
    assert not (tmp_path / "made").exists()


def test_a_lease_that_is_no_file_proves_nothing_and_ends_nothing(
    lake: Lake, tmp_path: Path
) -> None:
    for name, make in (
        ("link", lambda path: path.symlink_to(tmp_path / "lease")),
        ("folder", lambda path: path.mkdir()),
    ):
        (lake.staging / name).mkdir()
        make(lake.staging / name / "lease")
    (tmp_path / "lease").write_text("{}\n")
    assert {f.kind for f in doctor(lake, grace=NOW)} == {"staging-unleased"}
    assert len(collect(lake, grace=NOW).leftovers) == 2
    assert (tmp_path / "lease").read_text() == "{}\n"


def test_what_is_left_of_the_shared_locks_is_nobodys_leftover(lake: Lake) -> None:
    """In a bucket their folder is listed, and gone with the last of them before anything about it
    can be asked."""
    (lake.staging / "shared").write_text("")
    assert not doctor(lake, grace=NOW)
    assert collect(lake, grace=NOW).leftovers == ()


_MAKE: dict[str, Callable[[Path], object]] = {
    "folder": Path.mkdir,
    "pipe": os.mkfifo,
    "link to nothing": lambda path: path.symlink_to("/nonexistent"),
    "no UTF-8": lambda path: path.write_bytes(b"\xff\xfe"),
}


@pytest.mark.parametrize(
    ("part", "kind"),
    [
        *itertools.product(("entry", "rows", "tag"), _MAKE),
        ("mark", "folder"),
        ("mark", "pipe"),
        ("mark", "no UTF-8"),
    ],
)
def test_a_file_of_the_catalog_or_refs_that_cannot_be_opened_is_a_finding_and_a_clear_error(
    lake: Lake, part: str, kind: str
) -> None:
    put_text(lake, "a")
    put_older_ref(lake, "tags", "v1")
    paths = {
        "entry": lake.path / "catalog" / "_delta_log" / f"{1:020d}.json",
        "rows": next((lake.path / "catalog").glob("*.parquet")),
        "tag": lake.path / "refs" / "tags" / "v1.json",
        "mark": lake.path / "refs" / "newest" / "1",
    }
    path = paths[part]
    path.unlink()
    _MAKE[kind](path)
    fresh = Lake.open(lake.path)
    named = {"tag": "v1", "mark": "1"}.get(
        part, path.name
    )  # a damaged mark says that the entry of its name changed
    damage = [
        f.where
        for f in (*doctor(fresh, grace=NOW), *verify_catalog(fresh))
        if f.severity is Severity.ERROR
    ]
    assert any(named in Path(str(where)).name for where in damage), damage
    if part != "mark":  # of which only the name says something to readers
        with pytest.raises(CorruptError):
            fresh.rows(at="v1")
    with pytest.raises(CorruptError):
        collect(fresh, grace=NOW)


def test_doctor_reports_a_log_entry_that_cannot_be_opened_as_its_finding(lake: Lake) -> None:
    put_text(lake, "a")
    entry = lake.path / "catalog" / "_delta_log" / f"{1:020d}.json"
    entry.unlink()
    entry.mkdir()
    for verb, code in (("doctor", 3), ("verify", 3), ("ls", 1)):
        ended = invoke(verb, "--lake", lake.path)
        assert ended.code == code
        assert ended.out.count("error: log-damaged: ") == (verb != "ls")
        assert f"where: {entry}" in (ended.err if verb == "ls" else ended.out)


@pytest.mark.parametrize(
    "stated",
    [
        {"view": [{"branch": ["main"], "version": 1}]},
        {"view": [{"branch": "../main", "version": 1}]},
        {"view": [{"branch": "main", "version": "1"}]},
        {"view": [{"branch": "main", "version": 1.5}]},
        {"view": [{"branch": "main", "version": -1}]},
        {"view": []},
        {"name": ["v1"]},
        {"created": 3},
    ],
)
def test_a_ref_whose_values_are_of_another_type_is_a_finding_and_a_clear_error(
    stated: dict[str, object], lake: Lake
) -> None:
    put_text(lake, "a")
    path = put_older_ref(lake, "tags", "v1")
    path.write_text(json.dumps({**json.loads(path.read_text()), **stated}))
    with pytest.raises(CorruptError, match="the ref cannot be read") as caught:
        lake.rows(at="v1")
    assert caught.value.where == str(path)
    assert str(path) in [finding.where for finding in doctor(lake)]


def test_a_marker_that_is_a_pipe_is_refused_at_once(lake: Lake) -> None:
    (lake.path / "lake.json").unlink()
    os.mkfifo(lake.path / "lake.json")
    with pytest.raises(FlagdataError, match="not a regular file"):
        Lake.open(lake.path)


@pytest.mark.parametrize("version", ["-1", "0", "1e999", "true", "2.5", '"1"', "null", "9" * 5000])
def test_a_marker_without_a_version_of_the_format_is_refused(lake: Lake, version: str) -> None:
    marker = lake.path / "lake.json"
    marker.write_text(
        re.sub(r'("format_version": )\d+', lambda match: match[1] + version, marker.read_text())
    )
    with pytest.raises(CorruptError, match="marker cannot be read"):
        Lake.open(lake.path)


VERBS = [
    ["ingest", "no-such-film.mp4"],
    ["align", "camera", "wind"],
    ["realign", "recording"],
    ["declare", "camera", "--speed", "5", "--sigma", "0.1"],
    ["declare-cloths", "no-such-table.csv"],
    ["simulate", "flag-search-space", "--count", "1"],
    ["build", "flagsim-small"],
    ["train", "sdn"],
    ["measure", "no-such-film.mp4"],
    ["close-loop", "no-such-tracks.csv"],
    ["tag", "v1"],
    ["branch", "try"],
    ["merge", "try"],
    ["gc"],
]


def test_each_verb_that_writes_refuses_a_lake_that_can_only_be_read_before_it_works(
    lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Their input does not exist: a verb that looks at its input first reports that instead."""
    monkeypatch.setattr(
        os,
        "access",
        lambda path, mode: not (mode & os.W_OK and str(path).startswith(str(lake.path))),
    )
    refused = (1, "flagdata: this lake can be read, but not written", True)
    offenders = {}
    for arguments in VERBS:
        code, _, err = invoke(*arguments, "--lake", lake.path)
        if (code, err.splitlines()[0], "write permission" in err) != refused:
            offenders[arguments[0]] = (code, err)
    assert offenders == {}


def test_doctor_makes_no_file_in_a_copy_that_came_without_its_empty_folders(lake: Lake) -> None:
    for empty in ("staging", "mcap", "zarr", "model"):
        for file in (lake.path / empty).iterdir():
            file.unlink()
        (lake.path / empty).rmdir()
    before = sorted(lake.path.rglob("*"))
    assert doctor(lake, grace=NOW) == ()
    assert sorted(lake.path.rglob("*")) == before


def test_what_only_looks_opens_a_lake_that_can_only_be_read(
    lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    put_text(lake, "a")
    monkeypatch.setattr(
        os,
        "access",
        lambda path, mode: not (mode & os.W_OK and str(path).startswith(str(lake.path))),
    )
    looking = (["ls"], ["tag"], ["branch"], ["log"], ["doctor"], ["verify"], ["gc", "--dry-run"])
    for arguments in looking:
        ended = invoke(*arguments, "--lake", lake.path)
        assert ended.code == 0, ended.err
    for arguments in (["measure", "x", "--read-only"], ["align", "x", "y", "--dry-run"]):
        assert "can be read" not in invoke(*arguments, "--lake", lake.path).err
