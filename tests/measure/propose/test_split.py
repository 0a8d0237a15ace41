"""What a proposal sees and what tests it share no segment; entries of the proposal log are only
added."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import CorruptError, InputError
from measure.forecasting import Segments
from measure.propose import Decision, ProposalOutcome, proposal_log
from measure.propose.proposal_split import data_hash, split
from measure.trajectories import Trajectory, WindTrack
from tests.golden_answers import changes

MARKERS = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])


def recording(name: str, speed: float, *, seconds: float = 8.6) -> Trajectory:
    rng = np.random.default_rng(len(name))
    return Trajectory(
        name=name,
        markers=MARKERS,
        positions=rng.normal(size=(round(25 * seconds), 3, 3)),
        rate=25.0,
        wind=WindTrack.constant((speed, 0.0, 0.0)),
    )


def of(*speeds: float, seconds: float = 8.6) -> tuple[Segments, np.ndarray]:
    recordings = [
        recording("r" * (i + 1), speed, seconds=seconds) for i, speed in enumerate(speeds)
    ]
    return Segments.of(recordings), np.array(speeds)


def test_of_three_winds_the_middle_one_is_not_seen_at_all_nor_the_ends_of_the_others() -> None:
    """Recordings of 8.6 s have four segments of 2 s."""
    segments, speeds = of(7.0, 3.0, 5.0)
    parts = split(segments, speeds)
    assert parts.used.tolist() == [True, True, True, False] * 2 + [False] * 4
    assert "5.0 m/s" in parts.words


def test_of_two_winds_the_ends_are_not_seen() -> None:
    segments, speeds = of(3.0, 7.0, seconds=14.6)
    parts = split(segments, speeds)
    assert parts.used.tolist() == ([True] * 5 + [False] * 2) * 2


def test_too_few_segments_are_refused() -> None:
    with pytest.raises(InputError, match="record for longer"):
        split(*of(4.0, seconds=4.7))


def test_the_hash_is_of_positions_and_wind() -> None:
    segments, _ = of(3.0)
    stronger, _ = of(3.5)
    moved = replace(
        segments, items=tuple(replace(s, positions=s.positions + 1e-9) for s in segments.items)
    )
    assert data_hash(segments) == data_hash(of(3.0)[0])
    assert len({data_hash(s) for s in (segments, stronger, moved, segments.select([0]))}) == 4


def outcome(seed: int) -> ProposalOutcome:
    return ProposalOutcome(
        decision=Decision.REJECTED,
        reason="nulls show as much",
        steps=(),
        tried=6,
        ranking=(),
        strengths=(),
        retest=None,
        level=0.03,
        nulls="none",
        proposed_from="ab",
        tested_on="cd",
        known=(),
        seed=seed,
    )


def test_the_proposal_log_keeps_earlier_entries(tmp_path: Path) -> None:
    path = tmp_path / "proposal" / "proposals.json"
    proposal_log.add(path, outcome(1), effect="")
    proposal_log.add(path, outcome(2), effect="file.py:X")
    kept = proposal_log.entries(path)
    assert [entry["seed"] for entry in kept] == [1, 2]
    assert kept[1]["effect"] == "file.py:X"
    assert changes("proposals", kept, relative=0.0) == []
    assert kept[0]["decision"] == "rejected"
    assert json.loads(path.read_text(encoding="utf-8"))["schema"] == proposal_log.SCHEMA


@pytest.mark.parametrize("content", ["not JSON", "[]", '{"schema": "other"}'])
def test_another_file_is_not_overwritten_by_the_proposal_log(content: str, tmp_path: Path) -> None:
    path = tmp_path / "proposals.json"
    path.write_text(content)
    with pytest.raises(CorruptError):
        proposal_log.add(path, outcome(1), effect="")
    assert path.read_text() == content
