"""The demonstration's folder: replaced when the demonstration runs again, and never with anything of a user's in it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from flagdata.cli import main
from measure.demo import story
from measure.demo.command import SHORTEST
from measure.demo.transcript import Transcript


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """A demonstration whose steps only write a file each; the lengths of the films asked for [s]."""
    lengths: list[float] = []

    def init(shell: Transcript, *arguments: str) -> str:
        (shell.folder / arguments[1]).mkdir()
        (shell.folder / arguments[1] / "lake.json").write_text("{}")
        return ""

    def part(name: str) -> Any:
        def write(shell: Transcript, seed: int, *others: Any) -> None:
            lengths.extend(length for length in others if isinstance(length, float))
            (shell.folder / name).write_text(f"seed {seed}")

        return write

    monkeypatch.setattr(Transcript, "show", init)
    monkeypatch.setattr(story, "field_steps", part("recording.html"))
    monkeypatch.setattr(story, "weighing_step", lambda *given: None)
    monkeypatch.setattr(story, "loop_step", part("report.html"))
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
    assert f"Open {out}/index.html" in capsys.readouterr().err
    assert demo(out, "--part", "field", "--seed", "7") == 0
    assert names(out) == ["index.html", "lake/lake.json", "manifest.json", "recording.html"]
    assert (out / "recording.html").read_text() == "seed 7"
    listed = [entry["path"] for entry in json.loads((out / "manifest.json").read_text())["files"]]
    assert listed == ["index.html", "lake/lake.json", "recording.html"]
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

    def interrupted(*given: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(story, "loop_step", interrupted)
    assert demo(out) == 1
    assert names(tmp_path) == [
        f"demo/{name}" for name in ("index.html", "lake/lake.json", "manifest.json", "recording.html", "report.html")
    ]


def test_a_film_too_short_to_align_is_a_usage_error(quick: list[float], tmp_path: Path) -> None:
    assert demo(tmp_path / "demo", "--minutes", "2") == 2
    assert demo(tmp_path / "demo", "--part", "field", "--minutes", str(SHORTEST)) == 0
    assert quick == [60 * SHORTEST]
