"""What a lake takes: each byte counted once, shared apart from own, and what gc would free as gc
then does."""

from __future__ import annotations

import shutil
from datetime import timedelta
from pathlib import Path

from flagdata.core.schema import Kind
from flagdata.lake import Artifact, Lake, collect, usage
from flagdata.lake.collection import CATALOG, OTHER, UNSHOWN, Usage, files_of
from tests.flagdata.lake.conftest import put_text
from tests.program import Run, invoke

AT_ONCE = timedelta(0)


def shown(found: Usage, name: str) -> tuple[int, int, int]:
    """Size, own bytes and lost objects of a version."""
    (version,) = (version for version in found.versions if version.name == name)
    return version.share.size, version.own, version.lost


def test_every_file_counts_once_also_where_rows_of_two_kinds_share_it(lake: Lake) -> None:
    film = put_text(lake, "film")
    with lake.transaction("a clip of it") as tx:
        tx.add(
            Artifact(
                kind=Kind.CLIP, name="clip", object=film.object, parents=(film.id,), frame_first=0
            )
        )
        tx.add(Artifact(kind=Kind.MEASUREMENT, name="number"))
    found = usage(lake, grace=AT_ONCE)
    assert {name: (share.artifacts, share.objects) for name, share in found.kinds.items()} == {
        "wind": (1, 1),
        "measurement": (1, 0),
        "clip": (1, 0),
        UNSHOWN: (0, 0),
        CATALOG: (0, 0),
        OTHER: (0, 0),
    }
    assert found.kinds["wind"].size == len("film")
    assert found.total == sum(share.size for share in found.kinds.values())
    if isinstance(lake.path, Path):
        assert found.total == sum(
            path.stat().st_size for path in lake.path.rglob("*") if path.is_file()
        )


def test_what_two_versions_show_is_shared_and_the_rest_their_own(lake: Lake) -> None:
    both = put_text(lake, "both")
    put_text(lake, "in-v1")
    lake.tag("v1")
    lake.branch("b")
    put_text(lake, "on-branch", branch="b")
    lake.withdraw([both.id], "not on main")
    put_text(lake, "on-main!")
    found = usage(lake, at="1", grace=AT_ONCE)
    assert shown(found, "v1") == (9, 0, 0)
    assert shown(found, "b") == (18, 9, 0)
    assert shown(found, "main") == (13, 8, 0)
    assert shown(found, "1") == (4, 0, 0)
    assert found.kinds.keys() == {"wind"}
    assert found.kinds["wind"].size == 4


def test_what_gc_would_free_is_what_it_frees(lake: Lake) -> None:
    gone = put_text(lake, "gone")
    put_text(lake, "stays")
    version = str(lake.catalog.head())
    lake.withdraw([gone.id], "blurred")
    assert usage(lake, grace=timedelta(days=1)).freed == 0
    before = usage(lake, at=version, grace=AT_ONCE)
    assert (before.freed, usage(lake, grace=AT_ONCE).kinds[UNSHOWN].size) == (4, 4)
    assert shown(before, version) == (9, 4, 0)
    assert collect(lake, grace=AT_ONCE).size == before.freed
    after = usage(lake, at=version, grace=AT_ONCE)
    assert (after.freed, after.total) == (0, before.total - 4)
    assert shown(after, version) == (5, 0, 1)


def test_a_copy_without_empty_folders_and_one_with_links_is_counted(
    lake: Lake, tmp_path: Path
) -> None:
    if not isinstance(lake.path, Path):
        return
    film = put_text(lake, "film")
    copy = tmp_path / "copy"
    shutil.copytree(lake.path, copy)
    shutil.rmtree(copy / "staging")
    stored = lake.object_path(str(film.object))
    link = copy / "mcap" / stored.name
    link.unlink()
    link.symlink_to(stored)
    sizes = dict(files_of(copy))
    assert sizes[f"mcap/{link.name}"] == link.lstat().st_size
    assert usage(Lake.open(copy), grace=AT_ONCE).kinds["wind"].objects == 1


def test_a_lake_in_a_bucket_is_counted_alike(remote_lake: Lake) -> None:
    gone = put_text(remote_lake, "gone")
    put_text(remote_lake, "stays")
    remote_lake.tag("v1")
    remote_lake.withdraw([gone.id], "blurred")
    found = usage(remote_lake, grace=AT_ONCE)
    assert shown(found, "v1") == (9, 4, 0)
    assert found.total == sum(status.st_size for _, status in remote_lake.path.names())  # type: ignore[union-attr]
    assert sum(share.size for share in found.kinds.values()) == found.total


def test_du_prints_a_table_of_kinds_one_of_versions_and_a_document(lake: Lake) -> None:
    put_text(lake, "film")
    lake.tag("v1")
    run: Run = lambda *arguments: invoke(*arguments, "--lake", lake.path)  # noqa: E731
    ended = run("du")
    assert ended.out.splitlines()[1].split() == ["wind", "1", "1", "4", "B"]
    assert ended.out.splitlines()[-1].split() == ["v1", "tag", "1", "4", "B", "0", "B", "4", "B"]
    assert "gc would free 0 B" in ended.err
    document = run("du", "--json").document
    assert document["gc_frees"] == 0
    assert [(v["name"], v["own"], v["shared"]) for v in document["versions"]] == [
        ("main", 0, 4),
        ("v1", 0, 4),
    ]
    assert run("du", "--at", "nothing").code == 1
