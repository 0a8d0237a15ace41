"""The notebooks run from empty namespaces, and are kept with their outputs, small."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.pausing import finding_tests

ROOT = Path(__file__).resolve().parents[2]
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))
LARGEST = 200_000  # bytes; pictures of a screen's width at 70 dots an inch
PROGRAM = """
import json
import sys
from pathlib import Path

from IPython.core.interactiveshell import InteractiveShell

for path in map(Path, sys.argv[1:]):
    InteractiveShell.clear_instance()
    shell = InteractiveShell.instance()
    for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
        if cell["cell_type"] == "code":
            shell.run_cell("".join(cell["source"])).raise_error()
    print(f"ran {path.stem}", flush=True)
"""
"""IPython, of which each notebook has all names to itself: a kernel of its own would load torch
four times."""


@pytest.fixture(scope="module")
def printed(tmp_path_factory: pytest.TempPathFactory) -> str:
    if importlib.util.find_spec("IPython") is None or importlib.util.find_spec("ipykernel") is None:
        pytest.skip("IPython or ipykernel is not installed (extra dev)")
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *map(str, NOTEBOOKS)],
        cwd=tmp_path_factory.mktemp("notebooks"),
        env={**finding_tests(), "MPLBACKEND": "module://matplotlib_inline.backend_inline"},
        capture_output=True,
        text=True,
        check=False,
    )
    return done.stdout + done.stderr


def test_the_four_main_jobs_have_a_notebook() -> None:
    assert [path.stem for path in NOTEBOOKS] == [
        "close-the-loop",
        "field-recording",
        "measure",
        "simulate",
    ]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_kept_with_its_outputs_and_without_errors(path: Path) -> None:
    assert path.stat().st_size < LARGEST
    text = path.read_text(encoding="utf-8")
    cells = [cell for cell in json.loads(text)["cells"] if cell["cell_type"] == "code"]
    assert all(cell["execution_count"] for cell in cells)
    kinds = {output["output_type"] for cell in cells for output in cell["outputs"]}
    assert "display_data" in kinds
    assert "error" not in kinds
    assert '"stderr"' not in text


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(path: Path, printed: str) -> None:
    assert f"ran {path.stem}\n" in printed, printed[-8000:]
