"""The demonstration's folder: replaced when the demonstration runs again, and never with anything
of a user's in it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from measure.demo import MINUTES, Story, Transcript, story
from tests.program import Ended, invoke


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """A demonstration whose steps only write a file each."""

    def init(shell: Transcript, *arguments: str) -> str:
        (shell.folder / arguments[1]).mkdir()
        (shell.folder / arguments[1] / "lake.json").write_text("{}")
        return ""

    def part(name: str) -> Any:
        def write(shell: Transcript, seed: int, *others: Any) -> None:
            (shell.folder / name).write_text(f"seed {seed}")

        return write

    monkeypatch.setattr(Transcript, "show", init)
    monkeypatch.setattr(story, "field_steps", part("recording.html"))
    for step, name in (
        ("weighing_step", "weighed.html"),
        ("loop_step", "loop.html"),
        ("markers_step", "tracked.html"),
    ):
        monkeypatch.setattr(story, step, part(name))


def demo(out: Path, *arguments: str) -> Ended:
    return invoke("demo", "--out", out, *arguments)


def names(folder: Path) -> list[str]:
    return sorted(
        path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()
    )


def test_it_replaces_what_it_wrote_and_lists_it(quick: None, tmp_path: Path) -> None:
    out = tmp_path / "out" / "demo"
    ended = demo(out, "--full")
    assert ended.code == 0
    assert f"Open {out}/index.html" in ended.err
    assert demo(out, "--seed", "7").code == 0
    assert names(out) == ["index.html", "lake/lake.json", "manifest.json", "recording.html"]
    assert (out / "recording.html").read_text() == "seed 7"
    listed = [entry["path"] for entry in json.loads((out / "manifest.json").read_text())["files"]]
    assert listed == ["index.html", "lake/lake.json", "recording.html"]
    assert [entry.name for entry in (tmp_path / "out").iterdir()] == ["demo"]


def test_a_lake_that_a_user_made_in_it_is_named_and_kept(quick: None, tmp_path: Path) -> None:
    out = tmp_path / "demo"
    assert demo(out).code == 0
    (out / "field.lake").mkdir()
    (out / "field.lake" / "lake.json").write_text("mine")
    before = names(out)
    ended = demo(out)
    assert ended.code == 1
    assert "field.lake/lake.json" in ended.err
    assert names(out) == before
    assert (out / "field.lake" / "lake.json").read_text() == "mine"


def test_a_lake_of_the_demonstration_that_a_user_went_on_with_is_kept(
    quick: None, tmp_path: Path
) -> None:
    out = tmp_path / "demo"
    assert demo(out).code == 0
    (out / "lake" / "mcap").mkdir()
    (out / "lake" / "mcap" / "film.mcap").write_text("mine")
    assert demo(out).code == 1
    assert (out / "lake" / "mcap" / "film.mcap").read_text() == "mine"


def test_a_demonstration_without_a_list_is_kept(quick: None, tmp_path: Path) -> None:
    """As versions before left it: a mark, and no list of what is theirs."""
    (tmp_path / ".flagdata-demo").touch()
    (tmp_path / "mine").write_text("mine")
    assert demo(tmp_path).code == 1
    assert names(tmp_path) == [".flagdata-demo", "mine"]


def test_one_that_fails_leaves_the_earlier_one(
    quick: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "demo"
    assert demo(out, "--full").code == 0

    def interrupted(*given: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(story, "loop_step", interrupted)
    assert demo(out, "--full").code == 1
    assert names(tmp_path) == [
        f"demo/{name}"
        for name in (
            "index.html",
            "lake/lake.json",
            "loop.html",
            "manifest.json",
            "recording.html",
            "weighed.html",
        )
    ]


@pytest.mark.parametrize(
    ("given", "story", "pages"),
    [
        ((), Story.SHORT, ["recording.html"]),
        (("--full",), Story.FULL, ["loop.html", "recording.html", "weighed.html"]),
        (("--markers",), Story.MARKERS, ["tracked.html"]),
    ],
)
def test_each_story_has_its_pages_and_says_beforehand_how_long_it_takes(
    quick: None, tmp_path: Path, given: tuple[str, ...], story: Story, pages: list[str]
) -> None:
    out = tmp_path / "demo"
    ended = demo(out, *given)
    assert ended.code == 0
    assert [name for name in names(out) if name.endswith(".html") and name != "index.html"] == pages
    assert ended.err.startswith(f"This takes up to {MINUTES[story]} minutes on two idle cores.")


def test_the_two_lengths_are_those_that_were_promised() -> None:
    assert (MINUTES[Story.SHORT], MINUTES[Story.FULL]) == (3, 10)
