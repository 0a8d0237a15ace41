"""`flagdata propose` as it is called, from a shell and from Python; the search itself is
replaced."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import flagdata
from flagdata.errors import InputError
from measure.nulls import NullOptions, of_recordings
from measure.propose import Decision, ProposalOutcome, term_search
from measure.trajectories import Experiment
from measure.trajectories import experiment_recipe as recipes
from tests.program import invoke


@pytest.fixture
def search(
    pushed: Experiment, monkeypatch: pytest.MonkeyPatch
) -> Callable[[Callable[..., ProposalOutcome]], None]:
    """Lets any recipe name the recordings of `pushed`, 160 nulls to be simulated, and replaces the
    search."""

    def replaced(seek: Callable[..., ProposalOutcome]) -> None:
        monkeypatch.setattr(recipes, "load", lambda _: SimpleNamespace(level=0.1, nulls=160))
        monkeypatch.setattr(
            recipes, "read", lambda *_: SimpleNamespace(experiment=pushed, findings=())
        )
        monkeypatch.setattr(term_search, "propose", seek)

    return replaced


def test_how_long_it_takes_is_stated_before_it_begins(
    search: Any, pushed: Experiment, tmp_path: Path
) -> None:
    def begun(*_: Any, **__: Any) -> None:
        raise InputError("the search began", fix="none")

    search(begun)
    ended = invoke("propose", tmp_path / "flag.toml", "--out", tmp_path, "--workers", 2)
    first, second = ended.err.splitlines()[:2]
    vertices = pushed.specimen.mesh.vertex_count
    assert first == of_recordings(pushed.recordings, vertices, NullOptions(nulls=160), workers=2)
    assert "minutes in all takes" in first
    assert "the search began" in second


def test_the_call_searches_as_the_command_does_and_adds_to_the_same_log(
    search: Any, tmp_path: Path
) -> None:
    searches: list[tuple[tuple[str, ...], NullOptions]] = []

    def seek(*_: Any, acting_columns: Any, options: NullOptions, **__: Any) -> ProposalOutcome:
        searches.append((tuple(column.name for column in acting_columns), options))
        return ProposalOutcome(
            decision=Decision.REJECTED,
            reason="no term passed the search",
            steps=(),
            tried=3,
            ranking=(),
            strengths=(),
            retest=None,
            level=options.level,
            nulls="none",
            proposed_from="a",
            tested_on="b",
            known=searches[-1][0],
            seed=options.seed,
        )

    search(seek)
    recipe, known, seed = tmp_path / "flag.toml", "lift.coefficient", 4
    called = flagdata.propose(recipe, known=(known,), seed=seed, workers=2, out=tmp_path)
    typed = invoke(
        "propose",
        recipe,
        "--known",
        known,
        "--seed",
        seed,
        "--workers",
        2,
        "--out",
        tmp_path,
        "--json",
    )
    assert (
        searches[0]
        == searches[1]
        == ((known,), NullOptions(nulls=160, level=0.1, seed=seed, workers=2))
    )
    printed = json.loads(typed.out)
    said = json.loads(json.dumps(called.document))
    assert {key: printed[key] for key in said} == said
    assert (called.decision, called.effect, said["seed"]) == ("rejected", "", seed)
    assert called.sentence == "No effect is proposed: none of 3 terms explains what is missing."
    assert called.words in called.page
    assert len(json.loads((tmp_path / "proposal" / "proposals.json").read_text())["entries"]) == 2
