"""The walks of CONTRIBUTING.md: what they name exists, each is one page, and that of the effect is walked."""

from __future__ import annotations

import inspect
import re
import sys
import textwrap
from collections.abc import Callable, Iterator
from importlib.util import find_spec, module_from_spec, spec_from_file_location
from pathlib import Path

import pytest

from docs.generate_effects import reference
from sim.effects import EFFECTS
from tests.contract import test_effects
from tests.contract.test_effect_parameters import lacking

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
WALKS = ("An effect", "A log format", "A verb", "A network", "A renderer")
LINES = 60
"""Of a page."""


def walk(title: str) -> str:
    """The section of that title."""
    return PAGE.split(f"\n## {title}\n")[1].partition("\n## ")[0]


def block(title: str) -> str:
    """The code of that title."""
    found = re.search(rf'^ +```python title="{re.escape(title)}"\n(.*?)^ +```', PAGE, flags=re.DOTALL | re.MULTILINE)
    assert found, title
    return textwrap.dedent(found[1])


@pytest.mark.parametrize("title", WALKS)
def test_a_walk_is_one_page_and_names_files_that_exist_and_a_test(title: str) -> None:
    text = walk(title)
    assert len(text.splitlines()) <= LINES
    prose = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
    named = [word for word in re.findall(r"`([^`\s]+)`", prose) if "/" in word]
    assert len(named) >= 5
    assert [word for word in named if not (ROOT / word).exists()] == []
    assert any(word.startswith("tests/") for word in named)


def test_the_names_that_the_walks_give_are_in_the_files_that_they_give() -> None:
    pairs = [pair for title in WALKS for pair in re.findall(r"`(\w+)` (?:in|of)\s+`([\w/]+\.py)`", walk(title))]
    assert len(pairs) >= 8
    assert [(name, path) for name, path in pairs if name not in (ROOT / path).read_text(encoding="utf-8")] == []
    modules = re.findall(r"`python -m ([\w.]+)`", PAGE)
    assert modules
    assert [name for name in modules if find_spec(name) is None] == []


@pytest.fixture
def fringe(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """The effect of the walk, as if its file were written and its line added; its name."""
    file, module = tmp_path / "fringe.py", "sim.effects.fringe"
    file.write_text(block("sim/effects/fringe.py"), encoding="utf-8")
    spec = spec_from_file_location(module, file)
    assert spec is not None
    assert spec.loader is not None
    made = module_from_spec(spec)
    monkeypatch.setitem(sys.modules, module, made)
    spec.loader.exec_module(made)
    found = re.fullmatch(r'"([\w-]+)": "([\w.:]+)",\n', block("a line of EFFECTS"))
    assert found
    monkeypatch.setitem(EFFECTS._own, found[1], found[2])
    yield found[1]
    test_effects.plain_outcome.cache_clear()


def laws() -> list[Callable[[str], None]]:
    """The contract's tests that take the name of an effect and nothing else."""
    named = [test for name, test in vars(test_effects).items() if name.startswith("test_")]
    return [test for test in named if list(inspect.signature(test).parameters) == ["name"]]


def test_the_effect_of_the_walk_keeps_the_contract(fringe: str) -> None:
    assert len(laws()) >= 5
    for law in laws():
        law(fringe)
    assert list(lacking(EFFECTS[fringe])) == []
    assert "### fringe\n\nDrag of a fringe of threads on the cloth.\n" in reference()
