"""The verbs: made, judged and graded from the command line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import torch
from click.testing import CliRunner

from flagdata import outputs
from measure.challenge import history
from measure.challenge.command import challenge
from measure.challenge.folder import ChallengeFolder
from measure.challenge.run import IN_THIS_PROCESS, run
from measure.verdict.record import Conclusion
from tests.measure.challenge import cases


@pytest.fixture
def invoke():
    def run_command(*arguments: str):
        return CliRunner().invoke(challenge, arguments, catch_exceptions=False)

    return run_command


def test_what_is_made_can_be_judged_and_graded(invoke, tmp_path: Path) -> None:
    torch.set_num_threads(1)
    recipe, folder = tmp_path / "tiny.toml", tmp_path / "made"
    recipe.write_text(cases.TINY)
    made = invoke("make", str(folder), "--recipe", str(recipe), "--seed", "3", "--sets", "2", "--json")
    assert made.exit_code == 0
    assert set(json.loads(made.stdout)["sets"]) == {"set-001", "set-002"}
    run(ChallengeFolder(folder), lambda e, s: cases.verdict(Conclusion.SUFFICIENT), seed=1, workers=IN_THIS_PROCESS)
    # All are judged: nothing is left to do, and no fitter is asked.
    again = invoke("run", str(folder), "--json")
    assert json.loads(again.stdout)["filed"] == []
    kept = tmp_path / "history.csv"
    graded = invoke("score", str(folder), "--json", "--out", str(tmp_path / "sheet"), "--history", str(kept))
    # Who finds nothing does not meet the gates.
    assert graded.exit_code == 3
    assert json.loads(graded.stdout)["schema"] == "flagdata.score/1"
    assert sorted(p.suffix for p in (tmp_path / "sheet").iterdir()) == [".json", ".md", ".png"]
    assert [(row["challenge"], row["sets"]) for row in history.rows(kept)] == [("made", "2")]


def test_the_page_on_stdout_is_the_one_that_is_written(invoke, tiny: ChallengeFolder, tmp_path: Path) -> None:
    run(tiny, lambda e, s: cases.verdict(Conclusion.SUFFICIENT), seed=1, workers=IN_THIS_PROCESS)
    shown = invoke("score", str(tiny.path), "--out", str(tmp_path)).stdout
    page = tmp_path / "challenge-score.md"
    assert outputs.is_signed(page, command="challenge score")
    written, _, _ = page.read_text().partition("<!-- written by flagdata challenge score;")
    assert shown == written.replace("\n![Power curves](challenge-score.png)\n", "", 1)
