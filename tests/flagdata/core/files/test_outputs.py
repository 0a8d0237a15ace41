"""What a user names is written whole or not at all, and never on top of what is not flagdata's
own."""

from __future__ import annotations

import hashlib
import io
import json
import os
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from flagdata.core.files.durable import DENIED, LACKS
from flagdata.core.files.manifest import MANIFEST
from flagdata.core.files.outputs import (
    check_file,
    check_files,
    check_folder,
    check_rewrite,
    fresh_file,
    fresh_folder,
    is_signed,
    rewrite,
    sign_output,
    write_file,
    write_files,
)
from flagdata.errors import ConflictError, FlagdataError, InputError

SCHEMA = "made.demo/1"


def picture() -> bytes:
    stream = io.BytesIO()
    Image.fromarray(np.arange(64, dtype=np.uint8).reshape(8, 8)).save(stream, format="PNG")
    return stream.getvalue()


CONTENTS: dict[str, bytes] = {
    "page.html": b"<!doctype html>\n<p>a page</p>\n",
    "table.md": b"# A table\n",
    "curve.svg": b'<svg xmlns="http://www.w3.org/2000/svg"></svg>\n',
    "model.toml": b'name = "a"\n',
    "effect.py": b"x = 1\n",
    "verdict.json": b'{\n "a": 1\n}\n',
    "plot.png": picture(),
    "plot.pdf": b"%PDF-1.4\n%%EOF\n",
}


def whole(folder: Path) -> dict[str, bytes]:
    """All files of a folder, hidden ones too."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


@pytest.mark.parametrize("name", CONTENTS)
def test_a_commands_own_file_is_replaced_and_any_other_is_left_alone(
    name: str, tmp_path: Path
) -> None:
    path = tmp_path / name
    write_file(path, CONTENTS[name], command="measure")
    first = path.read_bytes()
    write_file(path, CONTENTS[name], command="measure")
    assert path.read_bytes() == first
    with pytest.raises(ConflictError, match="did not write it"):
        write_file(path, CONTENTS[name], command="align")
    for changed in (first[:-1], first + b"\n", first.replace(b"a", b"b", 1), CONTENTS[name], b""):
        path.write_bytes(changed)
        with pytest.raises(ConflictError, match="exists"):
            check_file(path, command="measure")
        with pytest.raises(ConflictError, match="exists"):
            write_file(path, CONTENTS[name], command="measure")
        assert whole(tmp_path) == {name: changed}


def test_a_seal_leaves_the_content_of_a_file_as_it_was(tmp_path: Path) -> None:
    for name, content in CONTENTS.items():
        write_file(tmp_path / name, content, command="measure")
    assert json.loads((tmp_path / "verdict.json").read_text())["a"] == 1
    np.testing.assert_array_equal(
        np.asarray(Image.open(tmp_path / "plot.png")), np.asarray(Image.open(io.BytesIO(picture())))
    )
    Image.open(tmp_path / "plot.png").verify()
    for name in ("page.html", "table.md", "model.toml", "effect.py", "plot.pdf"):
        assert (tmp_path / name).read_bytes().startswith(CONTENTS[name])


def test_a_format_without_a_place_for_the_seal_is_never_replaced(tmp_path: Path) -> None:
    write_file(tmp_path / "plot.jpg", b"JPEG", command="align")
    assert whole(tmp_path) == {"plot.jpg": b"JPEG"}
    with pytest.raises(ConflictError):
        check_file(tmp_path / "plot.jpg", command="align")


def test_short_files_are_not_taken_for_sealed_ones(tmp_path: Path) -> None:
    for size in (0, 1, 40, 150):
        (tmp_path / "a.html").write_bytes((b"written by flagdata " * 20)[:size])
        assert not is_signed(tmp_path / "a.html", command="x")
    assert sign_output(b"", name="a.html", command="x") != b""


def test_nothing_but_a_file_is_replaced(tmp_path: Path) -> None:
    (tmp_path / "folder.html").mkdir()
    (tmp_path / "link.html").symlink_to(tmp_path / "elsewhere")
    os.mkfifo(tmp_path / "pipe.html")
    before = {path: path.lstat().st_mode for path in tmp_path.iterdir()}
    for path in before:
        for write in (partial(write_file, command="measure"), rewrite):
            with pytest.raises(ConflictError):
                write(path, "a")
    assert {path: path.lstat().st_mode for path in tmp_path.iterdir()} == before


def test_a_new_file_never_takes_a_name_that_was_taken_meanwhile(tmp_path: Path) -> None:
    def raced(path: Path, command: str | None) -> None:
        with fresh_file(path, command=command) as scratch:
            scratch.write_bytes(b"ours")
            path.write_bytes(b"theirs")

    for command in (None, "query"):
        path = tmp_path / f"{command}.html"
        with pytest.raises(ConflictError):
            raced(path, command)
        assert path.read_bytes() == b"theirs"
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.parametrize("number", sorted(LACKS | DENIED))
def test_a_file_system_without_hard_links_is_written_to(
    number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_links(*args: object) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "link", no_links)
    write_file(tmp_path / "a.arrow", b"ours")
    with pytest.raises(ConflictError):
        write_file(tmp_path / "a.arrow", b"again")
    assert whole(tmp_path) == {"a.arrow": b"ours"}


def test_a_write_that_fails_or_is_interrupted_leaves_the_old_file_and_no_other(
    tmp_path: Path,
) -> None:
    write_file(tmp_path / "page.html", "old", command="measure")
    before = whole(tmp_path)

    def failed(failure: BaseException) -> None:
        with fresh_file(tmp_path / "page.html", command="measure") as scratch:
            scratch.write_bytes(b"half")
            raise failure

    for failure in (OSError(28, "No space left on device"), KeyboardInterrupt()):
        with pytest.raises(FlagdataError if isinstance(failure, OSError) else KeyboardInterrupt):
            failed(failure)
        assert whole(tmp_path) == before


def test_names_that_cannot_be_written_are_refused_before_anything_is_done(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="no such folder"):
        check_file(tmp_path / "nowhere" / "a.html")
    for check in (check_folder, check_rewrite, check_files):
        with pytest.raises(ConflictError, match="no folder"):
            check(tmp_path / "file" / "below" / "a")
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    for check in (check_file, check_folder, check_rewrite, check_files):
        with pytest.raises(InputError, match="cannot be written"):
            check(tmp_path / "a")


def test_files_of_a_group_are_written_together_or_not_at_all(tmp_path: Path) -> None:
    out = tmp_path / "made" / "out"
    write_files(out, {"a.html": "a", "b.toml": "b = 1\n", "c.json": None}, command="close-loop")
    assert sorted(whole(out)) == ["a.html", "b.toml"]
    (out / "b.toml").write_text("mine = 1\n")
    before = whole(out)
    with pytest.raises(ConflictError, match=r"b\.toml"):
        check_files(out, "a.html", "b.toml", command="close-loop")
    with pytest.raises(ConflictError, match=r"b\.toml"):
        write_files(out, {"a.html": "new", "b.toml": "b = 2\n"}, command="close-loop")
    assert whole(out) == before


def test_what_an_earlier_run_wrote_and_this_one_does_not_is_removed_unless_it_was_changed(
    tmp_path: Path,
) -> None:
    write_files(tmp_path, {"base.toml": "a = 1\n", "model.toml": "a = 2\n"}, command="close-loop")
    write_files(tmp_path, {"base.toml": "a = 1\n", "model.toml": None}, command="close-loop")
    assert sorted(whole(tmp_path)) == ["base.toml"]
    (tmp_path / "model.toml").write_text("mine = 1\n")
    with pytest.raises(ConflictError):
        write_files(tmp_path, {"base.toml": "a = 1\n", "model.toml": None}, command="close-loop")
    assert (tmp_path / "model.toml").read_text() == "mine = 1\n"


def make(folder: Path, *, last: str = "b") -> None:
    with fresh_folder(folder, schema=SCHEMA) as scratch:
        (scratch / "lake").mkdir()
        (scratch / "lake" / "a").write_text("a")
        (scratch / last).write_text(last)


def test_a_folder_is_replaced_by_its_own_kind_only_where_it_holds_nothing_else(
    tmp_path: Path,
) -> None:
    make(tmp_path / "demo", last="b")
    make(tmp_path / "demo", last="c")
    assert sorted(whole(tmp_path)) == ["demo/c", "demo/lake/a", "demo/manifest.json"]
    (tmp_path / "demo" / "c").unlink()  # what is missing hinders nobody
    make(tmp_path / "demo", last="d")
    assert sorted(whole(tmp_path)) == ["demo/d", "demo/lake/a", "demo/manifest.json"]


def add_a_file(folder: Path) -> str:
    (folder / "field.lake").mkdir()
    (folder / "field.lake" / "lake.json").write_text("{}")
    return "field.lake/lake.json"


def change_a_file(folder: Path) -> str:
    (folder / "b").write_text("c")
    return "b"


def add_a_link(folder: Path) -> str:
    (folder / "theirs").symlink_to(folder.parent)
    return "theirs"


def replace_by_a_link(folder: Path) -> str:
    (folder.parent / "b").write_text("b")
    (folder / "b").unlink()
    (folder / "b").symlink_to(folder.parent / "b")
    return "b"


def lose_the_manifest(folder: Path) -> str:
    (folder / MANIFEST).unlink()
    return "lake/a"


def damage_the_manifest(folder: Path) -> str:
    (folder / MANIFEST).write_text("[1]")
    return MANIFEST


def manifest_of_another_kind(folder: Path) -> str:
    content = json.loads((folder / MANIFEST).read_text())
    (folder / MANIFEST).write_text(json.dumps({**content, "schema": "flagdata.export/1"}))
    return MANIFEST


@pytest.mark.parametrize(
    "disturb",
    [
        add_a_file,
        change_a_file,
        add_a_link,
        replace_by_a_link,
        lose_the_manifest,
        damage_the_manifest,
        manifest_of_another_kind,
    ],
)
def test_a_folder_with_anything_else_in_it_is_refused_by_name_and_left_as_it_is(
    disturb: Callable[[Path], str], tmp_path: Path
) -> None:
    make(tmp_path / "demo")
    named = disturb(tmp_path / "demo")
    before = whole(tmp_path)
    with pytest.raises(ConflictError, match=named) as caught:
        make(tmp_path / "demo")
    assert "name another" in caught.value.fix
    assert whole(tmp_path) == before


def test_what_is_added_while_a_folder_is_made_anew_is_kept(tmp_path: Path) -> None:
    make(tmp_path / "demo")
    with pytest.raises(ConflictError, match="late"), fresh_folder(tmp_path / "demo", schema=SCHEMA):
        (tmp_path / "demo" / "late").write_text("theirs")
    assert (tmp_path / "demo" / "late").read_text() == "theirs"
    assert (tmp_path / "demo" / "b").read_text() == "b"


def test_a_manifest_that_names_files_elsewhere_removes_none_of_them(tmp_path: Path) -> None:
    (tmp_path / "theirs").write_text("theirs")
    make(tmp_path / "demo")
    content = json.loads((tmp_path / "demo" / MANIFEST).read_text())
    digest = hashlib.sha256(b"theirs").hexdigest()
    content["files"].append({"path": "../theirs", "bytes": 6, "sha256": digest})
    (tmp_path / "demo" / MANIFEST).write_text(json.dumps(content))
    make(tmp_path / "demo")
    assert (tmp_path / "theirs").read_text() == "theirs"


def test_an_empty_folder_is_free(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    with fresh_folder(tmp_path / "out") as scratch:
        (scratch / "a").write_text("a")
    assert whole(tmp_path) == {"out/a": b"a"}
