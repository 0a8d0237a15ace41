"""`flagdata propose` as it is called; the search itself is replaced."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from flagdata.errors import InputError
from measure.commands import propose as command
from measure.nulls import NullOptions, of_recordings
from measure.observe import Experiment
from measure.observe import recipe as recipes
from measure.propose import propose
from tests.program import invoke


def test_how_long_it_takes_is_stated_before_it_begins(
    pushed: Experiment, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def begun(*_: Any, **__: Any) -> None:
        raise InputError("the search began", fix="none")

    monkeypatch.setattr(recipes, "load", lambda _: None)
    monkeypatch.setattr(recipes, "read", lambda *_: SimpleNamespace(experiment=pushed, findings=()))
    monkeypatch.setattr(command, "nulls_given", lambda *_, **__: {"nulls": 160})
    monkeypatch.setattr(propose, "propose", begun)
    ended = invoke("propose", tmp_path / "flag.toml", "--out", tmp_path, "--workers", 2)
    first, second = ended.err.splitlines()[:2]
    vertices = pushed.specimen.mesh.vertex_count
    assert first == of_recordings(pushed.recordings, vertices, NullOptions(nulls=160), workers=2)
    assert "minutes in all takes" in first
    assert "the search began" in second
