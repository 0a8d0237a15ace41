"""The site builds without a warning, which covers its links, its anchors and its navigation."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if importlib.util.find_spec("material") is None:
        pytest.skip("mkdocs-material is not installed (extra docs)")
    folder = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(folder)],
        cwd=ROOT, env={**os.environ, "NO_MKDOCS_2_WARNING": "1"}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "WARNING" not in done.stderr
    return folder


def test_every_page_is_built_and_the_search_knows_it(site: Path) -> None:
    pages = sorted((ROOT / "docs").glob("*.md"))
    assert pages
    index = (site / "search" / "search_index.json").read_text(encoding="utf-8")
    for page in pages:
        assert (site / f"{page.stem}.html").is_file()
        assert f'"{page.stem}.html"' in index


def test_a_page_loads_nothing_from_elsewhere(site: Path) -> None:
    text = (site / "simulator.html").read_text(encoding="utf-8")
    assert 'src="http' not in text
    assert 'rel="stylesheet" href="http' not in text


def test_the_results_and_cases_stay_reachable(site: Path) -> None:
    assert (site / "results" / "validate-datasets.json").is_file()
    assert (site / "cases" / "paper-flag.html").is_file()
