"""The history of challenges: a row for each, graded once; the newest row's criteria beside
today's."""

from __future__ import annotations

from pathlib import Path

import pytest

from flagdata.errors import ConflictError, CorruptError
from measure.verdict import CRITERIA
from tests.studies.challenge import history

RESULTS = Path(__file__).resolve().parents[3] / "docs" / "results"
SHARES = {
    "top-1": {"hits": 3, "count": 4, "low": 0.249, "high": 0.987},
    "of none": {"hits": 0, "count": 0},
}
SHEET = {
    "title": "made",
    "code_version": "1+abc",
    "criteria": ["f00"],
    "sets": {"null": 2, "one": 4},
    "shares": SHARES,
}


def test_rows_come_back_as_they_were_written_and_other_shares_get_columns_of_their_own(
    tmp_path: Path,
) -> None:
    path = tmp_path / "kept" / "history.csv"
    first = history.row("one", SHEET)
    second = history.row("two", SHEET | {"shares": {"another": SHARES["top-1"]}})
    history.write(path, [first, second])
    read = history.rows(path)
    assert read[0] == first | {"another": ""}
    assert read[1]["another"] == read[0]["top-1"] == "3/4 [0.249, 0.987]"
    assert (read[1]["top-1"], read[0]["of none"], read[0]["sets"], read[0]["criteria"]) == (
        "",
        "",
        "6",
        "f00",
    )


def test_a_challenge_is_in_the_history_once(tmp_path: Path) -> None:
    path = tmp_path / "history.csv"
    assert history.without(path, "one") == []
    history.write(path, [history.row("one", SHEET)])
    assert len(history.without(path, "two")) == 1
    with pytest.raises(ConflictError, match="one is in the history"):
        history.without(path, "one")


def test_another_table_is_no_history(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("a,b\n1,2\n")
    with pytest.raises(CorruptError, match="not a history"):
        history.rows(path)


def test_the_results_say_whether_the_newest_challenge_was_judged_by_todays_criteria() -> None:
    newest = history.rows(RESULTS / "challenge-history.csv")[-1]
    text = (RESULTS / "README.md").read_text(encoding="utf-8")
    today = newest["criteria"] == CRITERIA.hash
    assert ("The newest challenge was judged by today's criteria." in text) is today
    assert ("The newest challenge was judged by other criteria than today's." in text) is not today


def test_the_sheets_that_are_kept_are_the_first_and_the_newest_of_markers_and_of_films_of_each_length() -> (
    None
):
    rows = history.rows(RESULTS / "challenge-history.csv")
    newest = {
        (row["title"].split(" of ")[0], "three minutes" in row["title"]): row["challenge"]
        for row in rows
    }
    assert set(newest) == {("Tracked markers", False), ("Films", False), ("Films", True)}
    kept = {
        path.name
        for path in RESULTS.iterdir()
        if path.is_dir() and path.name.startswith("challenge-")
    }
    assert kept == {rows[0]["challenge"], *newest.values()}
