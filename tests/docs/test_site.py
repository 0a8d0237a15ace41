"""The site builds without a warning, which covers its links, its anchors and its navigation."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from urllib.parse import unquote

import pytest

import flagdata

ROOT = Path(__file__).resolve().parents[2]
BROWSER = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    needed = ("latex2mathml", "material", "mkdocstrings", "mkdocs_jupyter")
    if missing := [name for name in needed if find_spec(name) is None]:
        pytest.skip(f"not installed: {', '.join(missing)} (extra docs)")
    folder = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(folder)],
        cwd=ROOT,
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "WARNING" not in done.stderr
    return folder


def dumped(address: str, profile: Path) -> str:
    """A page's elements after its scripts ran."""
    options = (
        "--headless",
        "--no-sandbox",
        f"--user-data-dir={profile}",
        "--virtual-time-budget=8000",
        "--dump-dom",
    )
    return subprocess.run(
        [str(BROWSER), *options, address], capture_output=True, text=True, check=False
    ).stdout


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


def test_every_link_and_picture_of_the_site_leads_to_a_file_of_it(site: Path) -> None:
    """MkDocs does not warn of a link to what its configuration leaves out."""
    broken = [
        f"{page.relative_to(site)}: {target}"
        for page in site.rglob("*.html")
        if page.name != "404.html"  # its links are from the root
        for target in re.findall(
            r'(?:href|src)="([^"#?:]+)(?:[#?][^"]*)?"', page.read_text(encoding="utf-8")
        )
        if not (page.parent / unquote(target)).exists()
    ]
    assert broken == []


def formulas(page: Path) -> list[str]:
    """The TeX of a page's source, between dollar signs outside code."""
    text = re.sub(
        r"^```.*?^```|`[^`\n]+`",
        "",
        page.read_text(encoding="utf-8"),
        flags=re.DOTALL | re.MULTILINE,
    )
    return [
        one or other for one, other in re.findall(r"\$\$(.+?)\$\$|\$(.+?)\$", text, flags=re.DOTALL)
    ]


def test_every_formula_is_set_and_a_page_without_one_carries_nothing_for_it(site: Path) -> None:
    sources = {page: formulas(page) for page in sorted((ROOT / "docs").rglob("*.md"))}
    assert sum(map(bool, sources.values())) >= 7
    for page, tex in sources.items():
        built = site / page.relative_to(ROOT / "docs").with_suffix(".html")
        if not built.is_file():  # the README of a folder
            built = built.with_stem("index")
        text = built.read_text(encoding="utf-8")
        shown = re.findall(r"<math .*?</math>", text, flags=re.DOTALL)
        assert len(shown) == len(tex), page
        assert not [one for one in shown if "\\" in one or "merror" in one]
        assert text.count('class="formula"') == sum(one.startswith("\n") for one in tex)
        assert "arithmatex" not in text
        assert "mathjax" not in text.lower()
        assert "katex" not in text.lower()


def test_a_formula_that_cannot_be_set_ends_the_build_and_is_named() -> None:
    pytest.importorskip("latex2mathml")
    from mkdocs.exceptions import PluginError

    from docs.formulas import formulas_set

    assert "<mfrac>" in formulas_set(
        '<span class="arithmatex">\\(\\frac{a}{b}\\)</span>', "method/films.md"
    )
    with pytest.raises(PluginError, match=r"method/films\.md: \\frob in the formula a \\frob b "):
        formulas_set('<span class="arithmatex">\\(a \\frob b\\)</span>', "method/films.md")


def test_the_reference_shows_each_call_with_its_arguments_and_its_source(site: Path) -> None:
    text = (site / "api.html").read_text(encoding="utf-8")
    assert ":::" not in text
    for name in flagdata.__all__:
        assert f'id="{name}"' in text
    assert "Source code in" in text
    assert "flag_size" in text.split('id="measure"')[1].split('id="wind"')[0]


def test_the_notebooks_are_pages_with_their_pictures(site: Path) -> None:
    for path in sorted((ROOT / "docs" / "notebooks").glob("*.ipynb")):
        text = (site / "notebooks" / f"{path.stem}.html").read_text(encoding="utf-8")
        assert "data:image/png;base64," in text
        assert 'src="http' not in text


def test_the_results_and_cases_stay_reachable(site: Path) -> None:
    assert (site / "results" / "validate-datasets.json").is_file()
    assert (site / "cases" / "paper-flag.html").is_file()


@pytest.mark.skipif(BROWSER is None, reason="no Chromium on the path")
def test_the_search_works_in_pages_that_are_opened_as_files(site: Path, tmp_path: Path) -> None:
    shown = dumped(f"{(site / 'index.html').as_uri()}?q=replicates", tmp_path)
    assert re.search(r"[1-9]\d* matching documents?<", shown)
    assert "glossary.html" in shown


@pytest.mark.skipif(BROWSER is None, reason="no Chromium on the path")
def test_the_copy_button_copies_the_command_without_prompt_and_output(
    site: Path, tmp_path: Path
) -> None:
    """As the theme does it: the block is marked while its visible text is taken."""
    page = (site / "versions-and-recovery.html").read_text(encoding="utf-8")
    probe = """<script>addEventListener("load", () => {
      const block = document.querySelector(".gp").closest("code");
      block.setAttribute("data-md-copying", "");
      const copied = document.createElement("pre");
      copied.id = "copied"; copied.textContent = block.innerText;
      document.body.append(copied);
    });</script>"""
    probed = site / "probed.html"
    probed.write_text(page.replace("</body>", f"{probe}</body>"), encoding="utf-8")
    shown = dumped(probed.as_uri(), tmp_path)
    copied = re.findall(r'<pre id="copied">(.*?)</pre>', shown, flags=re.DOTALL)
    assert copied
    assert copied[0].strip().startswith("flagdata ")
    assert "$" not in copied[0].split()[0]


def test_decisions_are_reachable_and_not_in_the_navigation(site: Path) -> None:
    text = (site / "gallery.html").read_text(encoding="utf-8")
    assert "decisions/" not in text
    assert 'href="decisions/index.html"' in (site / "index.html").read_text(encoding="utf-8")
