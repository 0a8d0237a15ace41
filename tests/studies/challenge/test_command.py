"""The verbs: made, judged and graded from the command line."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import torch
from click.testing import CliRunner

from flagdata.cli import main
from flagdata.core.files import outputs
from measure.verdict import Conclusion
from tests.studies.__main__ import studies
from tests.studies.challenge import cases, history
from tests.studies.challenge.command import challenge
from tests.studies.challenge.folder import ChallengeFolder
from tests.studies.challenge.run import IN_THIS_PROCESS, run


@pytest.fixture
def invoke():
    def run_command(*arguments: str):
        return CliRunner().invoke(challenge, arguments, catch_exceptions=False)

    return run_command


def test_what_is_made_can_be_judged_and_graded(invoke, tmp_path: Path) -> None:
    torch.set_num_threads(1)
    recipe, folder = tmp_path / "tiny.toml", tmp_path / "made"
    recipe.write_text(cases.TINY)
    made = invoke(
        "make", str(folder), "--recipe", str(recipe), "--seed", "3", "--sets", "2", "--json"
    )
    assert made.exit_code == 0
    assert set(json.loads(made.stdout)["sets"]) == {"set-001", "set-002"}
    run(
        ChallengeFolder(folder),
        lambda e, s: cases.verdict(Conclusion.SUFFICIENT),
        seed=1,
        workers=IN_THIS_PROCESS,
    )
    # All are judged: nothing is left to do, and no fitter is asked.
    again = invoke("run", str(folder), "--json")
    assert json.loads(again.stdout)["filed"] == []
    kept = tmp_path / "history.csv"
    graded = invoke(
        "score", str(folder), "--json", "--out", str(tmp_path / "sheet"), "--history", str(kept)
    )
    # Who finds nothing does not meet the gates.
    assert graded.exit_code == 3
    assert json.loads(graded.stdout)["schema"] == "flagdata.score/1"
    assert sorted(p.suffix for p in (tmp_path / "sheet").iterdir()) == [".json", ".md", ".png"]
    assert [(row["challenge"], row["sets"]) for row in history.rows(kept)] == [("made", "2")]


def test_the_page_on_stdout_is_the_one_that_is_written(
    invoke, tiny: ChallengeFolder, tmp_path: Path
) -> None:
    run(tiny, lambda e, s: cases.verdict(Conclusion.SUFFICIENT), seed=1, workers=IN_THIS_PROCESS)
    shown = invoke("score", str(tiny.path), "--out", str(tmp_path)).stdout
    page = tmp_path / "challenge-score.md"
    assert outputs.is_signed(page, command="challenge score")
    written, _, _ = page.read_text().partition("<!-- written by flagdata challenge score;")
    assert shown == written.replace("\n![Power curves](challenge-score.png)\n", "", 1)


def test_each_refusal_names_the_command_that_comes_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A folder that is not there is made, and sets are judged before they are graded."""

    def judged(folder: ChallengeFolder, fitter: object, **options: Any) -> Any:
        kept = {**options, "workers": IN_THIS_PROCESS}
        return run(folder, lambda experiment, seed: cases.verdict(Conclusion.SUFFICIENT), **kept)

    def ends(*words: str) -> tuple[object, str]:
        with pytest.raises(SystemExit) as ended:
            main(["challenge", *words], command=studies, name="studies")
        return ended.value.code, capsys.readouterr().err

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("tests.studies.challenge.run.run", judged)
    Path("tiny.toml").write_text(cases.TINY)
    code, said = ends("run", "sets")
    assert (code, "make one: `python -m tests.studies challenge make`" in said) == (1, True)
    assert ends("make", "sets", "--recipe", "tiny.toml", "--seed", "3", "--sets", "2")[0] == 0
    code, said = ends("score", "sets")
    assert (code, "run `python -m tests.studies challenge run` first" in said) == (3, True)
    assert ends("run", "sets")[0] == 0
    code, said = ends("score", "sets")
    assert (code, "fix:" in said) == (3, False)  # it finds nothing, and misses what is there


TAKEN = {
    "make": (("make", "{out}", "--seed", "1"), "mine", "conflict"),
    "score --out": (("score", "nowhere", "--out", "{out}"), "challenge-score.png", "conflict"),
    "score --history": (("score", "nowhere", "--history", "{out}/a.csv"), "a.csv", "corrupt"),
}


@pytest.mark.parametrize("case", TAKEN)
def test_a_taken_output_is_refused_first_and_kept(
    case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments, taken, kind = TAKEN[case]
    out = tmp_path / "out"
    out.mkdir()
    (out / taken).write_text("mine")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        main(
            ["challenge", *(word.format(out=out) for word in arguments), "--json"],
            command=studies,
            name="studies",
        )
    error = json.loads(capsys.readouterr().out)
    assert (ended.value.code, error["kind"]) == (1, kind)
    assert str(out) in f"{error['what']} {error['where']}"
    assert error["fix"]
    assert [path.read_text() for path in tmp_path.rglob("*") if path.is_file()] == ["mine"]
