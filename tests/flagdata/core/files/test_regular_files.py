"""What is no file with an end is refused before it is opened, wherever a user names a file."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from flagdata.core.files.regular_files import check_input
from flagdata.errors import InputError, LimitError, NotFoundError
from flagdata.ingest import guesses, open_camera, read_cloths, read_json, read_obj, read_table
from flagdata.ingest.anemometer.text.text_file import first_bytes
from flagdata.ingest.source_file import Source
from flagdata.recipes.shelves import read_recipe

# Neither waits for a writer nor goes on for ever, so that a reader that opens them fails here and
# does not hang.
DEVICE, KERNEL = Path("/dev/null"), Path("/proc/version")


def test_a_file_is_checked_before_it_is_opened(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_bytes(b"1234")
    check_input(path, limit=4)
    with pytest.raises(LimitError, match="the table has 4 bytes"):
        check_input(path, noun="table", limit=3)
    with pytest.raises(InputError, match="a folder, not a table"):
        check_input(tmp_path, noun="table")
    path.write_bytes(b"")
    with pytest.raises(InputError, match="the table is empty"):
        check_input(path, noun="table")
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="a pipe or device, not a table"):
        check_input(tmp_path / "pipe", noun="table")
    for nowhere in (tmp_path / "none", tmp_path / ("x" * 5000), Path("a\0b")):
        with pytest.raises(NotFoundError, match="no such table"):
            check_input(nowhere, noun="table")


def film_of_a_table(film: Path, folder: Path) -> object:
    table = folder / "cloths.csv"
    table.write_text(f"film,fabric,area_weight\n{film},felt,0.2\n")
    return read_cloths(table)


READERS: dict[str, Callable[[Path, Path], object]] = {
    "source": lambda path, _: Source.of(path),
    "classify": lambda path, _: guesses(path),
    "camera": lambda path, _: open_camera(path),
    "log": lambda path, _: first_bytes(path),
    "cloths": lambda path, _: read_cloths(path),
    "film of cloths": film_of_a_table,
    "markers": lambda path, _: read_table(path),
    "mesh": lambda path, _: read_obj(path),
    "scene": lambda path, _: read_json(path),
    "recipe": lambda path, _: read_recipe(path),
}


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize(("path", "what"), [(DEVICE, "a pipe or device"), (KERNEL, "is empty")])
def test_every_reader_of_inputs_refuses_devices_and_files_of_the_kernel(
    reader: str, path: Path, what: str, tmp_path: Path
) -> None:
    if not path.exists():
        pytest.skip(f"this system has no {path}")
    with pytest.raises(InputError, match=what):
        READERS[reader](path, tmp_path)


def test_files_that_an_operating_system_puts_beside_a_users_are_no_part_of_a_folder(
    tmp_path: Path,
) -> None:
    (tmp_path / "f_0.png").write_bytes(b"1")
    alone = Source.of(tmp_path)
    for name in (
        "._f_0.png",
        ".DS_Store",
        "Thumbs.db",
        "thumbs.db",
        "Desktop.ini",
        "desktop.ini",
        "ehthumbs.db",
    ):
        (tmp_path / name).write_bytes(b"2")
    assert Source.of(tmp_path) == alone
    (tmp_path / "._f_0.png").write_bytes(b"3")  # macOS writes it anew when the file is tagged
    alone.check_unchanged()
    (tmp_path / "f_1.png").write_bytes(b"1")
    assert Source.of(tmp_path).hash != alone.hash


def test_a_note_of_macos_in_place_of_a_file_is_named_as_one(tmp_path: Path) -> None:
    note = tmp_path / "._a.mp4"
    note.write_bytes(b"\0\5\x16\7\0\2\0\0Mac OS X        " + bytes(4000))
    (guess, *_) = guesses(note)
    assert (guess.kind, guess.fix) == ("other", "give that file: the name without ._")
