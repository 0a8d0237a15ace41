"""Simulations of a verdict on films are kept by their design: an interrupted one goes on, another
one reuses them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flagdata.core.arrays import FloatArray
from flagdata.core.stated import Stated
from measure.cloth import FlagBatch, close_loop, design, simulations
from measure.report import as_document
from tests.measure.cloth.loop.conftest import options, readings, recording

KINDS = 20


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Flags of each batch that was simulated; a negative first number is after how many batches it
    breaks off."""
    counted: list[int] = []

    def read(self: FlagBatch) -> FloatArray:
        if counted and counted[0] < 0 and len(counted) > -counted[0]:
            raise KeyboardInterrupt
        counted.append(len(self.seeds))
        return readings(self)[:, None]

    monkeypatch.setattr(FlagBatch, "read", read)
    for module in (design, simulations):
        monkeypatch.setattr(module, "TOGETHER", 2)
    return counted


def test_an_interrupted_verdict_goes_on_and_ends_as_one_that_was_not(
    made: list[int], tmp_path: Path
) -> None:
    recordings = [recording(mean=5.0, seed=5)]
    whole = close_loop(recordings, options(kinds=KINDS), folder=tmp_path / "whole")
    assert sum(made) >= 64 + 3 * 16 + 2 * KINDS  # the base model, three effects, nulls
    batches = len(made)
    made[:] = [-40]  # among the nulls
    with pytest.raises(KeyboardInterrupt):
        close_loop(recordings, options(kinds=KINDS), folder=tmp_path / "twice")
    assert len(made) == 41
    made.clear()
    again = close_loop(recordings, options(kinds=KINDS), folder=tmp_path / "twice")
    assert len(made) == batches - 40
    assert str(as_document(replace(again, seconds=0.0))) == str(
        as_document(replace(whole, seconds=0.0))
    )


def test_another_verdict_on_the_same_recordings_simulates_nothing_and_more_kinds_only_these(
    made: list[int], tmp_path: Path
) -> None:
    recordings = [recording(mean=5.0, seed=5)]
    close_loop(recordings, options(kinds=KINDS), folder=tmp_path)
    made.clear()
    close_loop(
        recordings,
        replace(options(kinds=KINDS), level=0.2, area_weight=Stated.of("0.2±0.01")),
        folder=tmp_path,
    )
    assert made == []
    other = replace(recordings[0], readings=recordings[0].readings + np.float64(0.01))
    close_loop([other], options(kinds=KINDS), folder=tmp_path)
    assert made == []
    close_loop(recordings, options(kinds=KINDS + 3), folder=tmp_path)
    assert made == [2, 2, 2]
