"""ARCHITECTURE.md is one page, and its list of packages is that of the source."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
WORDS = 900


def listed() -> list[tuple[str, str]]:
    """Top-level folders and the names that are listed under each (folders with a slash, modules
    with their suffix)."""
    block = re.search(r"```\n(.*?)```", PAGE, re.DOTALL)
    assert block, "the list of packages is missing"
    named: list[tuple[str, str]] = []
    top = ""
    for line in block.group(1).splitlines():
        if not line.startswith(" "):
            top = line.split("/")[0]
            named.append((top, ""))
            listed = line.split("/", 1)[1] if top == "tests" else ""
        else:
            listed = line
        named += [
            (top, name) for name in re.findall(r"(?<![\w/:.\"])([a-z_]+(?:/|\.py))(?=\s|$)", listed)
        ]
    return named


def test_the_map_is_one_page() -> None:
    assert len(PAGE.split()) <= WORDS


def test_what_the_map_names_exists() -> None:
    places = [(ROOT / top / name, name.endswith(".py")) for top, name in listed()]
    assert len(places) > 50
    assert [
        place for place, is_file in places if not (place.is_file() if is_file else place.is_dir())
    ] == []


def test_every_package_and_every_subpackage_is_on_the_map() -> None:
    named = set(listed())
    packages = {path.parent.name for path in ROOT.glob("*/__init__.py")}
    assert packages <= {top for top, _ in named}
    subpackages = {
        (path.parts[-3], f"{path.parts[-2]}/")
        for package in ("flagdata", "sim", "models", "measure")
        for path in ROOT.glob(f"{package}/*/__init__.py")
    }
    assert subpackages <= named


def test_every_decision_is_in_the_index() -> None:
    folder = ROOT / "docs" / "decisions"
    linked = set(
        re.findall(r"\((\d{3}-[\w-]+\.md)\)", (folder / "index.md").read_text(encoding="utf-8"))
    )
    assert linked == {path.name for path in folder.glob("[0-9]*.md")}
