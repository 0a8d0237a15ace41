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
from flagdata.lake import Lake
from flagdata.outputs import check_folder
from measure.demo.command import SCHEMA, SHORTEST
from measure.demo.field import FieldRecipe, film
from measure.demo.page import recovered
from tests.docs.pages import Shell

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", README, flags=re.DOTALL | re.MULTILINE)


def commands() -> list[str]:
    return [line[2:] for block in blocks("console") for line in block.splitlines() if line.startswith("$ ")]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The shortest demonstration, of half as many frames a second."""
    out = tmp_path_factory.mktemp("readme") / "out" / "demo"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("measure.demo.field.FieldRecipe", partial(FieldRecipe, frame_rate=30))
        Shell(patch=patch).run(f"flagdata demo --out {out} --minutes {SHORTEST} --part field")
    return out


def test_the_readme_shows_the_two_commands_that_set_everything_up() -> None:
    assert {"make demo", "make test"} <= set(commands())


@pytest.mark.parametrize("target", sorted({c.split()[1] for c in commands() if c.startswith("make ")}))
def test_every_make_target_of_the_readme_exists(target: str) -> None:
    subprocess.run(["make", "--dry-run", target], cwd=ROOT, check=True, capture_output=True)


def test_the_demonstration_ends_in_a_page_that_needs_no_other_file(folder: Path) -> None:
    page = (folder / "index.html").read_text(encoding="utf-8")
    assert "A field recording, end to end" in page
    assert page.count("data:image/webp;base64,") == 6
    assert not re.findall(r"(?:src|href)=\"(?!data:)", page)
    assert ".partial" not in page


def test_the_demonstration_recovers_the_offset_it_hid(folder: Path) -> None:
    """The hidden offset follows from the seed; the interval is stated at 90 %, so for this one seed twice its width is
    asked of it (a Gaussian is outside with probability 0.001)."""
    offset = film(FieldRecipe(seed=2026, duration=SHORTEST * 60))[2]
    (row,) = Lake.open(folder / "lake").rows("kind = 'recording'").to_pylist()
    found = recovered(row, offset)
    assert abs(found.offset - offset) < 0.5
    assert abs(found.offset - offset) < found.high - found.low


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
