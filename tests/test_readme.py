"""The README does what it says: every command in it runs, in order, on what the demonstration makes."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest

import flagdata
from flagdata.outputs import check_folder
from measure.demo.command import SCHEMA
from measure.demo.recording import RecordingRecipe
from tests.docs.pages import Shell

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", README, flags=re.DOTALL | re.MULTILINE)


def commands() -> list[str]:
    return [line[2:] for block in blocks("console") for line in block.splitlines() if line.startswith("$ ")]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The shortest demonstration, on a coarse mesh, in small pictures."""
    out = tmp_path_factory.mktemp("readme") / "out" / "demo"
    with pytest.MonkeyPatch.context() as patch:
        small = partial(RecordingRecipe, rate=25, columns=10, step=4e-3, width=240, rows=180, samples=1)
        patch.setattr("measure.demo.story.RecordingRecipe", small)
        Shell(patch=patch).run(f"flagdata demo --out {out}")
    return out


def test_the_readme_shows_the_two_commands_that_set_everything_up() -> None:
    assert {"make demo", "make test"} <= set(commands())


@pytest.mark.parametrize("target", sorted({c.split()[1] for c in commands() if c.startswith("make ")}))
def test_every_make_target_of_the_readme_exists(target: str) -> None:
    subprocess.run(["make", "--dry-run", target], cwd=ROOT, check=True, capture_output=True)


def test_the_demonstration_ends_in_pages_that_need_no_other_folder(folder: Path) -> None:
    """The first page links to one a step, and all pictures are in the pages."""
    index = (folder / "index.html").read_text(encoding="utf-8")
    assert index.count('<section class="card">') == 5
    links = re.findall(r"(?:src|href)=\"(?!data:)([^\"]*)", index)
    assert links == ["recording.html", "measured.html"]
    for name in links:
        page = (folder / name).read_text(encoding="utf-8")
        assert not re.findall(r"(?:src|href)=\"(?!data:|#)", page)
        assert ".partial" not in page
    assert (folder / "recording.html").read_text(encoding="utf-8").count("data:image/webp;base64,") == 6


def test_the_demonstration_recovers_the_offset_it_hid(folder: Path) -> None:
    """As the table of its first page has it: the interval at 90 % is asked to hold for this one seed."""
    index = (folder / "index.html").read_text(encoding="utf-8")
    (row,) = re.findall(r"<tr><td>the log&#39;s clock minus the camera&#39;s</td>.*</tr>", index)
    true, found, low, high = (float(number) for number in re.findall(r"[+-]\d+\.\d+", row))
    assert abs(found - true) < 1.0
    assert low <= true <= high
    assert "<td>right</td>" in row


def test_every_command_of_the_readme_runs(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Bash takes them as they are. They run in this process: a start of the program takes longer than its work."""
    given = [command for command in commands() if not command.startswith("make ")]
    subprocess.run(["bash", "-n", "-c", "\n".join(given)], check=True)
    monkeypatch.chdir(folder.parents[1])
    shell = Shell(patch=monkeypatch)
    printed = [shell.run(command) for command in given]
    assert "healthy" in "".join(printed)
    assert (folder.with_name("field") / "shards" / "manifest.json").exists()


def test_a_user_who_followed_the_readme_can_run_the_demonstration_again(folder: Path) -> None:
    """After the commands: none of them has left anything in its folder, which may therefore be replaced."""
    check_folder(folder, schema=SCHEMA)


def test_the_python_of_the_readme_runs(folder: Path) -> None:
    """After the commands: it opens the lake that they made."""
    (program,) = blocks("python")
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=folder.with_name("field"), env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("torch.Size([16, 1, 30, 300, 300])")
    pairs = flagdata.open(folder.with_name("field") / "field.lake").pairs(at="v1")
    assert f"{len(pairs)} pairs; {len(pairs.refused)} refused" in done.stdout


def test_pictures_and_pages_that_the_readme_links_to_exist() -> None:
    links = [link for link in re.findall(r"\]\(([^)#]+)\)", README) if "://" not in link]
    assert links
    assert [link for link in links if not (ROOT / link).exists()] == []
