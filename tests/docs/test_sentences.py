"""The sentences of the pages are short: 18 words on average, 35 at most."""

from __future__ import annotations

import re

import pytest

from tests.docs.pages import DOCS

MEAN = 18
MOST = 35
LONGER = {"card-flag.md", "cli.md", "effects.md"}
"""Pages of longer sentences: one reports a study, two are generated from docstrings and help, as
those in folders are."""
PAGES = sorted(path.name for path in DOCS.glob("*.md") if path.name not in LONGER)
_CODE = re.compile(r"^( *)```.*?^\1```$|^\$\$.*?^\$\$$", re.DOTALL | re.MULTILINE)
_PARAGRAPH = re.compile(r"\n\s*\n|\n(?=\s*(?:[-*] |\d+\. |: ))")
_NO_PROSE = re.compile(r"#|\||!\[|\*[^*]+\*$")
"""A heading, a table, a picture; a line all in italics, which repeats a message of the program."""
_END = re.compile(
    r"(?<!et al)[.!?][)\"*]*\s+(?=[\"(*\[`$]*(?:[A-Z0-9`$]|flagdata|p ))|:\s*$|[.!?][)\"*]*$"
)


def prose(text: str) -> list[str]:
    """Returns the paragraphs and list items of a page, without code, tables, headings, pictures and
    quoted messages."""
    lines = [line for line in _CODE.sub("", text).splitlines() if not _NO_PROSE.match(line.strip())]
    return [" ".join(part.split()) for part in _PARAGRAPH.split("\n".join(lines)) if part.strip()]


def sentences(text: str) -> list[str]:
    """Returns the sentences of a page; a link counts as its text, code and a formula as one
    word."""
    parts: list[str] = []
    for paragraph in prose(text):
        plain = re.sub(r"\[([^\]]+)\]\([^)]+\)", r"\1", paragraph)
        plain = re.sub(r"`[^`]+`|\$[^$]+\$", "X", plain)
        plain = re.sub(r"^(?:[-*]|\d+\.|:) ", "", plain)
        parts += [part.strip() for part in _END.split(plain) if part.strip()]
    return parts


def words(sentence: str) -> int:
    """Returns how many parts between blanks hold a letter or a digit."""
    return sum(bool(re.search(r"\w", part)) for part in sentence.split())


@pytest.mark.parametrize("page", PAGES)
def test_sentences_of_a_page_are_short(page: str) -> None:
    counts = {
        sentence: words(sentence)
        for sentence in sentences((DOCS / page).read_text(encoding="utf-8"))
    }
    assert counts
    assert [sentence for sentence, count in counts.items() if count > MOST] == []
    assert sum(counts.values()) / len(counts) <= MEAN


def test_code_tables_and_headings_are_no_sentences_and_a_link_counts_as_its_text() -> None:
    above = "# Head\n\nOne [two three](x.md) `four five`. Six\nseven:\n\n"
    page = f"{above}```sh\neight\n```\n\n| nine |\n\n- Ten. Eleven 1.5 m.\n"
    assert [words(sentence) for sentence in sentences(page)] == [4, 2, 1, 3]
