"""Verdicts are filed once, before keys are opened, and nothing filed, published or sealed can be
changed unnoticed."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from flagdata.errors import ConflictError, CorruptError, InputError, RefusedError, UnknownNameError
from measure.trajectories import Experiment
from measure.verdict import Conclusion, Verdict
from tests.pausing import finding_tests
from tests.studies.challenge import cases
from tests.studies.challenge import filing as filings
from tests.studies.challenge import run as running
from tests.studies.challenge.answer_key import AnswerKey
from tests.studies.challenge.filing import Filing, verdict_json
from tests.studies.challenge.fitter import ClosingTheLoopOnFilms
from tests.studies.challenge.folder import ChallengeFolder
from tests.studies.challenge.recipe import Kind
from tests.studies.challenge.run import IN_THIS_PROCESS, run, run_films
from tests.studies.challenge.score import score


@pytest.fixture
def satisfied():
    """A fitter that finds nothing, and counts how often it is asked."""

    class Satisfied:
        def __init__(self) -> None:
            self.seeds: list[int] = []

        def __call__(self, experiment: Experiment, seed: int) -> Verdict:
            assert len(experiment.recordings) == 2
            self.seeds.append(seed)
            return cases.verdict(Conclusion.SUFFICIENT)

    return Satisfied()


def test_every_set_is_judged_once_with_a_seed_of_its_own(tiny: ChallengeFolder, satisfied) -> None:
    first = run(tiny, satisfied, seed=5, only=("set-002",), workers=IN_THIS_PROCESS)
    rest = run(tiny, satisfied, seed=5, workers=IN_THIS_PROCESS)
    assert [f.name for f in first + rest] == ["set-002", "set-001", "set-003", "set-004"]
    assert len(set(satisfied.seeds)) == 4
    assert run(tiny, satisfied, seed=5, workers=IN_THIS_PROCESS) == []


def test_the_first_set_of_films_that_is_answered_has_all_workers_and_others_one(
    tiny: ChallengeFolder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[tuple[str, ...], int, int]] = []

    def judge(folder: ChallengeFolder, fitter: ClosingTheLoopOnFilms, **how: Any) -> list[Filing]:
        asked.append((tuple(how["only"]), how.get("workers", 1), fitter.workers))

        def refusing_first(given: Any, seed: int) -> Verdict:
            if len(asked) == 1:
                raise InputError("no flag is found", where="a film", fix="film one")
            return cases.verdict(Conclusion.SUFFICIENT)

        return run(
            folder,
            refusing_first,
            seed=how["seed"],
            only=how["only"],
            workers=IN_THIS_PROCESS,
            progress=how["progress"],
        )

    monkeypatch.setattr(running, "run", judge)
    fitter = ClosingTheLoopOnFilms(folder=tmp_path, workers=2)
    done = run_films(tiny, fitter, seed=5)
    assert [one.verdict is None for one in done] == [True, False, False, False]
    assert asked == [(("set-001",), 1, 2), (("set-002",), 1, 2), (("set-003", "set-004"), 2, 1)]
    assert run_films(tiny, fitter, seed=5) == []


def test_the_seed_of_a_set_does_not_depend_on_which_others_are_judged(
    tiny: ChallengeFolder, satisfied
) -> None:
    run(tiny, satisfied, seed=5, workers=IN_THIS_PROCESS)
    all_together = satisfied.seeds[2]
    tiny.verdict_hash("set-003").unlink()
    run(tiny, satisfied, seed=5, only=("set-003",), workers=IN_THIS_PROCESS)
    assert satisfied.seeds[-1] == all_together


def test_a_verdict_cut_off_before_its_hash_is_given_again(tiny: ChallengeFolder, satisfied) -> None:
    run(tiny, satisfied, seed=5, workers=IN_THIS_PROCESS)
    tiny.verdict_hash("set-004").unlink()
    assert [f.name for f in run(tiny, satisfied, seed=5, workers=IN_THIS_PROCESS)] == ["set-004"]


def test_a_refusal_is_filed_with_its_reason(tiny: ChallengeFolder) -> None:
    def refuses(experiment: Experiment, seed: int) -> Verdict:
        raise InputError("too short", where="a", fix="record longer")

    (filing,) = run(tiny, refuses, seed=5, only=("set-001",), workers=IN_THIS_PROCESS)
    assert filing.verdict is None
    assert filing.refusal == {
        "kind": "bad-input",
        "what": "too short",
        "where": "a",
        "fix": "record longer",
    }
    assert filings.read(tiny, "set-001") == filing


def test_a_fault_of_the_fitter_is_no_verdict(tiny: ChallengeFolder) -> None:
    def breaks(experiment: Experiment, seed: int) -> Verdict:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        run(tiny, breaks, seed=5, only=("set-001",), workers=IN_THIS_PROCESS)
    assert not filings.filed(tiny, "set-001")


def test_an_unknown_set_is_refused(tiny: ChallengeFolder, satisfied) -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'set-001'"):
        run(tiny, satisfied, seed=5, only=("set-01",), workers=IN_THIS_PROCESS)


def test_keys_stay_sealed_until_the_verdict_is_filed(tiny: ChallengeFolder, satisfied) -> None:
    run(tiny, satisfied, seed=5, only=("set-001",), workers=IN_THIS_PROCESS)
    with pytest.raises(RefusedError, match="3 of 4 sets have no filed verdict") as refused:
        score(tiny)
    assert refused.value.exit_code == 3
    assert not tiny.opened.exists()
    assert len(score(tiny, only=("set-001",)).outcomes) == 1


def test_the_true_models_error_is_computed_where_an_effect_of_the_library_was_named(
    tiny: ChallengeFolder,
) -> None:
    run(
        tiny, lambda e, s: cases.verdict(Conclusion.EFFECT, "lift"), seed=5, workers=IN_THIS_PROCESS
    )
    asked: list[Kind] = []

    def reference(folder: ChallengeFolder, key: AnswerKey) -> dict[str, float]:
        asked.append(key.kind)
        return {"unseen": 1e-3}

    result = score(tiny, reference=reference)
    assert sorted(asked) == [Kind.ONE, Kind.PAIR]
    # From 5 mm to 1 mm, which is the true model's.
    assert result.reductions == pytest.approx([1.0, 1.0])


def test_no_verdict_is_filed_once_the_key_is_open(tiny: ChallengeFolder, satisfied) -> None:
    run(tiny, satisfied, seed=5, workers=IN_THIS_PROCESS)
    score(tiny)
    tiny.verdict_hash("set-001").unlink()
    with pytest.raises(ConflictError, match="key was opened"):
        run(tiny, satisfied, seed=5, workers=IN_THIS_PROCESS)


def test_a_changed_verdict_is_noticed_even_with_its_hash(tiny: ChallengeFolder, satisfied) -> None:
    run(tiny, satisfied, seed=5, workers=IN_THIS_PROCESS)
    score(tiny)
    path = tiny.verdict("set-001")
    path.write_text(path.read_text().replace("no effect needed", "none of the library"))
    with pytest.raises(CorruptError, match="not as it was filed"):
        score(tiny)
    tiny.verdict_hash("set-001").write_text(filings.file_hash(path) + "\n")
    with pytest.raises(CorruptError, match="not as it was filed"):
        score(tiny)


def test_a_verdict_about_other_data_is_not_scored(tiny: ChallengeFolder, satisfied) -> None:
    run(tiny, satisfied, seed=5, workers=IN_THIS_PROCESS)
    tiny.verdict("set-001").write_bytes(tiny.verdict("set-002").read_bytes())
    tiny.verdict_hash("set-001").write_bytes(tiny.verdict_hash("set-002").read_bytes())
    with pytest.raises(CorruptError, match="about other data"):
        score(tiny)


def test_a_changed_key_is_noticed(tiny: ChallengeFolder, satisfied) -> None:
    run(tiny, satisfied, seed=5, workers=IN_THIS_PROCESS)
    content = tiny.seal("set-001")
    content["key"]["kind"] = "null" if content["key"]["kind"] != "null" else "one"
    tiny.sealed("set-001").write_text(json.dumps(content))
    with pytest.raises(CorruptError, match="not the one whose hash was published"):
        score(tiny)


def test_changed_data_are_noticed_before_and_after_they_are_judged(
    tiny: ChallengeFolder, satisfied
) -> None:
    path = tiny.data("set-001") / "set.json"
    before = path.read_text()
    path.write_text(before.replace("1.5", "1.4"))
    with pytest.raises(CorruptError, match="not those that were published"):
        run(tiny, satisfied, seed=5, workers=IN_THIS_PROCESS)
    path.write_text(before)
    run(tiny, satisfied, seed=5, workers=IN_THIS_PROCESS)
    path.write_text(before.replace("1.5", "1.4"))
    with pytest.raises(CorruptError, match="not those that were published"):
        score(tiny)


def test_what_is_not_finite_is_filed_as_null() -> None:
    said = cases.verdict(
        Conclusion.EFFECT, "lift", ranking=(cases.candidate("lift", strength=float("nan")),)
    )
    assert verdict_json(said)["ranking"][0]["strength"]["value"] is None
    json.dumps(verdict_json(said), allow_nan=False)


def test_a_filing_survives_json(tiny: ChallengeFolder) -> None:
    data = tiny.manifest()["sets"]["set-001"]["data"]
    said = verdict_json(cases.verdict(Conclusion.EFFECT, "lift"))
    filing = Filing(name="set-001", data=data, seed=1, verdict=said, refusal=None, seconds=2.0)
    filings.file(tiny, filing)
    assert filings.read(tiny, "set-001").as_dict() == json.loads(json.dumps(filing.as_dict()))


_WORKERS = """
import sys
sys.path.insert(0, {folder!r})
from pathlib import Path
from judge import judge
from tests.studies.challenge.folder import ChallengeFolder
from tests.studies.challenge.answer_key import AnswerKey
from tests.studies.challenge.recipe import Kind
from tests.studies.challenge.run import run
if __name__ == "__main__":
    done = run(ChallengeFolder(Path({path!r})), judge, seed=1, only=("set-001",), workers=1)
    print([filing.refusal["what"] for filing in done])
"""
_JUDGE = """
from flagdata.errors import InputError

def judge(experiment, seed):
    try:
        import tests.studies.challenge.outside.tether
    except ImportError as error:
        raise InputError(f"kept apart: {error}", fix="")
    raise InputError("reached the generator", fix="")
"""


def test_a_worker_cannot_import_what_makes_challenges(
    tiny: ChallengeFolder, tmp_path: Path
) -> None:
    (tmp_path / "judge.py").write_text(_JUDGE)
    script = tmp_path / "script.py"
    script.write_text(_WORKERS.format(folder=str(tmp_path), path=str(tiny.path)))
    done = subprocess.run(
        [sys.executable, str(script)],
        capture_output=True,
        text=True,
        check=True,
        env=finding_tests(),
    )
    assert done.stdout.startswith(
        "['kept apart: tests.studies.challenge.outside is not for fitters"
    )
