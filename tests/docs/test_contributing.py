"""The walks of CONTRIBUTING.md: what they name exists, each is one page, and that of the effect is
walked."""

from __future__ import annotations

import inspect
import json
import math
import re
import shutil
import subprocess
import sys
import textwrap
from collections.abc import Callable, Iterator
from importlib.util import find_spec, module_from_spec, spec_from_file_location
from pathlib import Path

import numpy as np
import pytest

from docs.generate_effects import pages
from measure.observables.observable import WindowReading
from measure.observables.observables_table import ObservableTable
from sim.effects import EFFECTS
from tests.contract import test_effects
from tests.contract.test_effect_parameters import lacking

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
WALKS = (
    "An effect",
    "A log format",
    "A verb",
    "A question to a recording",
    "A network",
    "A renderer",
)
LINES = 72
"""Of a page."""


def walk(title: str) -> str:
    """The section of that title."""
    return PAGE.split(f"\n## {title}\n")[1].partition("\n## ")[0]


def block(title: str) -> str:
    """The code of that title."""
    found = re.search(
        rf'^ +```\w+ title="{re.escape(title)}"\n(.*?)^ +```', PAGE, flags=re.DOTALL | re.MULTILINE
    )
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
    pairs = [
        pair
        for title in WALKS
        for pair in re.findall(r"`(\w+)` (?:in|of)\s+`([\w/]+\.py)`", walk(title))
    ]
    assert len(pairs) >= 8
    assert [
        (name, path)
        for name, path in pairs
        if name not in (ROOT / path).read_text(encoding="utf-8")
    ] == []
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
    about = "## fringe\n\nDrag of a fringe of threads on the cloth.\n"
    assert any(about in text for text in pages().values())


def test_the_question_of_the_walk_is_answered_without_a_renderer_of_its_own(
    tmp_path: Path,
) -> None:
    file, name = tmp_path / "flapping_answer.py", "measure/flapping/flapping_answer.py"
    file.write_text(block(name), encoding="utf-8")
    spec = spec_from_file_location("flapping_answer", file)
    assert spec is not None
    assert spec.loader is not None
    made = module_from_spec(spec)
    spec.loader.exec_module(made)
    seen = (1.0, 1.2, 1.1, 1.4, 1.3)
    readings = [WindowReading(value=one) for one in seen]
    readings.append(WindowReading(value=math.nan, reason="no-silhouette"))
    table = ObservableTable(
        film="flag.mp4",
        length=1.5,
        height=1.0,
        seconds=2.5,
        time=np.linspace(0.0, 12.5, len(readings)),
        readings={"frequency": tuple(readings)},
    )
    answer = made.answer_flapping(table)
    assert len(answer.sentence.split()) < 25
    assert answer.sentence.startswith("The flag flaps 1.2 times a second")
    assert json.loads(json.dumps(answer.document))["frequency"]["value"] == 1.2
    assert {answer.sentence, "5 of 6", "1.40"} <= set(re.findall(r">([^<>]+)<", answer.page))
    assert "<svg" in answer.page
    assert answer.sentence in answer._repr_html_()


FORMATS = "flagdata/ingest/anemometer/formats"
CLAIMS = "tests/flagdata/ingest/anemometer/test_format_claims.py"
COPIED = ("flagdata", "catalogs", "pyproject.toml", "tests")
VALUES = """
from tests.flagdata.ingest.anemometer.conftest import read, shows
from tests.flagdata.ingest.anemometer.test_format_claims import SAMPLES


def test_harbour() -> None:
    log = read(SAMPLES["harbour"])
    {line}
"""


@pytest.fixture(scope="module")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of what a log format touches."""
    copy = tmp_path_factory.mktemp("checkout")
    for path in (path for pattern in COPIED for path in ROOT.glob(pattern)):
        target = copy / path.relative_to(ROOT)
        target.parent.mkdir(parents=True, exist_ok=True)
        if path.is_dir():
            shutil.copytree(path, target, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(path, target)
    return copy


def write_line(path: Path, line: str, *, above: str) -> None:
    """Write a line of the walk above the only line that begins so."""
    text = path.read_text(encoding="utf-8")
    (first,) = re.findall(rf"^ *{re.escape(above)}.*$", text, flags=re.MULTILINE)
    path.write_text(text.replace(first, f"{line.rstrip()}\n{first}", 1), encoding="utf-8")


def test_the_log_format_of_the_walk_is_read_once_its_steps_are_done(checkout: Path) -> None:
    described, registry = f"{FORMATS}/described.py", f"{FORMATS}/log_formats.py"
    file = "catalogs/sensors/formats/harbour.toml"
    (checkout / file).write_text(block(file), encoding="utf-8")
    write_line(checkout / described, block(described), above="Zentra = ")
    write_line(checkout / registry, f"    {block(f'FORMATS in {registry}')}", above='"zentra": ')
    write_line(checkout / CLAIMS, f"    {block(f'SAMPLES in {CLAIMS}')}", above='"zentra": ')
    (line,) = re.findall(r"`(shows\(.*?\))`", walk("A log format"))
    (checkout / "tests/flagdata/ingest/anemometer/test_harbour.py").write_text(
        VALUES.format(line=line)
    )
    tests = [f"{CLAIMS}", "tests/flagdata/ingest/anemometer/test_harbour.py"]
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        "-k",
        "harbour or sample",
        *tests,
    ]
    done = subprocess.run(command, cwd=checkout, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr
    passed = re.search(r"(\d+) passed", done.stdout)
    assert passed
    assert int(passed[1]) >= 7
