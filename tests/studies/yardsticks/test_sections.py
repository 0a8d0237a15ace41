"""Yardsticks beside an evaluation: its page, its words and its document."""

from __future__ import annotations

import json

import pytest
from markdown import markdown as render

from flagdata.errors import InputError
from models.evaluation.evaluation import evaluate
from tests.golden_answers import KEPT, changes
from tests.models.evaluation.made import GROUP, WIND, compared, generator, run, score
from tests.studies.yardsticks import paper
from tests.studies.yardsticks.linear import Readout, bouman
from tests.studies.yardsticks.readouts import FramesPoint, Read
from tests.studies.yardsticks.sections import Yardsticks, answer_beside


def readout(**more: int) -> Readout:
    weights = {"area_weight": WIND + 1}
    return bouman(WIND[:, None] + 1, weights, group=GROUP, generator=generator(1), **more)


SHOWN = Yardsticks(
    frames=[FramesPoint(label="SDN", frames=n, score=score(0.9, 0.88, 0.93)) for n in (10, 30)],
    reads=[Read(label="SDN", data="hanging cloth", readout=readout(components=1))],
)


def test_the_document_and_each_line_of_the_words_are_what_they_were() -> None:
    answer, words = answer_beside(compared(), SHOWN)
    assert changes("evaluate", answer.document, relative=1e-5) == []
    kept = json.loads((KEPT / "evaluate-words.json").read_text(encoding="utf-8"))
    lines = words.splitlines()
    assert [line for line in kept.values() if line and line not in lines] == []


def test_the_page_shows_what_was_computed_and_what_the_paper_printed() -> None:
    answer, _ = answer_beside(compared(), SHOWN)
    assert answer.page.count("<svg ") == 5
    assert answer.page.count("breaks the bound") == 4
    assert "Linear readout of the embedding" in answer.page
    bare, words = answer_beside(compared(), Yardsticks())
    assert "Linear readout" not in bare.page + words
    assert "## What the paper printed" in words


def test_a_warning_of_a_readout_says_of_which_model_and_data_it_is() -> None:
    evaluation = evaluate([run("SDN", 1, 1)], data="made", seed=0, draws=10)
    read = Read(label="SDN", data="cloth", readout=readout())
    _, words = answer_beside(evaluation, Yardsticks(reads=[read]))
    assert "**Warning:** SDN on cloth: 1 principal components are kept, not 50" in words


def test_names_are_text_in_markdown_and_on_the_page() -> None:
    bad = "<img src=x onerror=alert(1)> [a](http://b) | `c`"
    read = Read(label=bad, data=bad, readout=readout())
    answer, words = answer_beside(compared(), Yardsticks(reads=[read]))
    for html in (render(words, extensions=["tables"]), answer.page):
        assert "onerror" in html
        assert not any(tag in html for tag in ("<img src=x", 'href="http://b"', "<code>c</code>"))


def test_a_triplet_accuracy_in_per_cent_is_refused() -> None:
    with pytest.raises(InputError, match="not per cent"):
        FramesPoint(label="a", frames=10, score=score(96.3, 95.0, 97.0))


def test_four_rows_of_the_papers_table_break_the_bound() -> None:
    """By hand: 0.5 √0.42 = 0.324, 0.5 √0.225 = 0.237, 0.5 √0.187 = 0.216, 0.5 √0.162 = 0.201, all
    above the RMSE."""
    broken = [
        (row.model, row.rmse, round(row.bound, 3)) for row in paper.FLAGSIM if row.breaks_bound
    ]
    assert broken == [
        ("Cardona et al.", 0.271, 0.324),
        ("ResNet-18", 0.207, 0.237),
        ("SDN", 0.183, 0.216),
        ("SDN", 0.180, 0.201),
    ]
