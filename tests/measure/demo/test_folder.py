"""The demonstration's folder: replaced when the demonstration runs again, and never with anything of a user's in it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from flagdata.cli import main
from measure.demo import command
from measure.demo.command import SHORTEST, Transcript


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """A demonstration whose parts only write a file each; the lengths of the films asked for."""
    lengths: list[float] = []

    def init(shell: Transcript, *arguments: str) -> str:
        (shell.folder / arguments[1]).mkdir()
        (shell.folder / arguments[1] / "lake.json").write_text("{}")
        return ""

    def part(name: str) -> Any:
        def write(shell: Transcript, seed: int, minutes: float = 0.0) -> Path:
            lengths.append(minutes)
            (shell.folder / name).write_text(f"seed {seed}")
            return shell.folder / name

        return write

    monkeypatch.setattr(Transcript, "show", init)
    monkeypatch.setattr(command, "_field", part("index.html"))
    monkeypatch.setattr(command, "_loop", part("report.html"))
    return lengths


def demo(out: Path, *arguments: str) -> int:
    with pytest.raises(SystemExit) as ended:
        main(["demo", "--out", str(out), *arguments])
    assert isinstance(ended.value.code, int)
    return ended.value.code


def names(folder: Path) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())


def test_it_replaces_what_it_wrote_and_lists_it(
    quick: list[float], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out" / "demo"
    assert demo(out) == 0
    assert f"Open {out}/index.html and {out}/report.html" in capsys.readouterr().err
    assert demo(out, "--part", "field", "--seed", "7") == 0
    assert names(out) == ["index.html", "lake/lake.json", "manifest.json"]
    assert (out / "index.html").read_text() == "seed 7"
    assert [entry["path"] for entry in json.loads((out / "manifest.json").read_text())["files"]] == names(out)[:2]
    assert [entry.name for entry in (tmp_path / "out").iterdir()] == ["demo"]


def test_a_lake_that_a_user_made_in_it_is_named_and_kept(
    quick: list[float], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "demo"
    assert demo(out) == 0
    (out / "field.lake").mkdir()
    (out / "field.lake" / "lake.json").write_text("mine")
    before = names(out)
    assert demo(out) == 1
    assert "field.lake/lake.json" in capsys.readouterr().err
    assert names(out) == before
    assert (out / "field.lake" / "lake.json").read_text() == "mine"


def test_a_lake_of_the_demonstration_that_a_user_went_on_with_is_kept(quick: list[float], tmp_path: Path) -> None:
    out = tmp_path / "demo"
    assert demo(out) == 0
    (out / "lake" / "mcap").mkdir()
    (out / "lake" / "mcap" / "film.mcap").write_text("mine")
    assert demo(out) == 1
    assert (out / "lake" / "mcap" / "film.mcap").read_text() == "mine"


def test_a_demonstration_without_a_list_is_kept(quick: list[float], tmp_path: Path) -> None:
    """As versions before left it: a mark, and no list of what is theirs."""
    (tmp_path / ".flagdata-demo").touch()
    (tmp_path / "mine").write_text("mine")
    assert demo(tmp_path) == 1
    assert names(tmp_path) == [".flagdata-demo", "mine"]


def test_one_that_fails_leaves_the_earlier_one(
    quick: list[float], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "demo"
    assert demo(out) == 0

    def interrupted(shell: Transcript, seed: int) -> Path:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(command, "_loop", interrupted)
    assert demo(out) == 1
    assert names(tmp_path) == [
        f"demo/{name}" for name in ("index.html", "lake/lake.json", "manifest.json", "report.html")
    ]


def test_a_film_too_short_to_align_is_a_usage_error(quick: list[float], tmp_path: Path) -> None:
    assert demo(tmp_path / "demo", "--minutes", "2") == 2
    assert demo(tmp_path / "demo", "--part", "field", "--minutes", str(SHORTEST)) == 0
    assert quick == [SHORTEST]
