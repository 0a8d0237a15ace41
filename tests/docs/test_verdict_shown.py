"""The verdict that the pages show is what the program says of the stored one."""

from __future__ import annotations

import json
import re

import pytest

from measure.report import by_draw, from_document, lead
from measure.report.verdict_words import words
from measure.verdict import Verdict
from tests.docs.pages import DOCS


@pytest.fixture(scope="module")
def stored() -> Verdict:
    return from_document(
        json.loads((DOCS / "results" / "tracked-lift.json").read_text(encoding="utf-8"))
    )


def test_the_stored_verdict_is_worded_as_the_program_words_it_now(stored: Verdict) -> None:
    assert stored.words == " ".join([lead(stored), *by_draw(stored.test)])


@pytest.mark.parametrize("page", ["loop-markers.md", "notebooks/close-the-loop.ipynb"])
def test_a_verdict_on_a_page_is_the_stored_one_line_by_line(page: str, stored: Verdict) -> None:
    text = (DOCS / page).read_text(encoding="utf-8")
    if page.endswith(".ipynb"):
        text = "\n".join("".join(cell["source"]) for cell in json.loads(text)["cells"])
    (shown,) = re.findall(
        r"^```text\n(The base model lacked .*?)\n```", text, flags=re.DOTALL | re.MULTILINE
    )
    said = words(stored).splitlines()
    place = 0
    for line in shown.splitlines():
        assert line in said[place:]
        place = said.index(line, place) + 1
    assert place > 8
