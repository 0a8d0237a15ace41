"""Closing the loop on arrays: the experiment is that of the arrays, and the answer that of the
verdict."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import flagdata
from flagdata.core.arrays import FloatArray
from flagdata.errors import UnknownNameError, UsageError
from flagdata.lake import MeshSequence
from measure.closing import close_loop_call
from measure.loop import LoopOptions
from measure.trajectories import Experiment
from measure.verdict import Conclusion, Verdict
from tests.measure.report.verdicts import verdict

RATE = 25.0
RNG = np.random.default_rng(4)
REST = np.stack(np.meshgrid(np.linspace(0, 0.9, 7), np.linspace(0, 0.6, 5)), axis=-1).reshape(-1, 2)


def swaying(frames: int = 80) -> FloatArray:
    """(frame, marker, 3): a sheet held at its hoist whose fly turns from side to side about the
    pole, by up to 0.2."""
    angle = 0.2 * np.sin(4 * np.pi * np.arange(frames) / RATE)[:, None] * REST[:, 0]
    plane = np.broadcast_to(REST[:, 0], angle.shape)
    height = np.broadcast_to(REST[:, 1], angle.shape)
    exact = np.stack([plane * np.cos(angle), plane * np.sin(angle), height], axis=-1)
    return exact + 5e-4 * RNG.standard_normal(exact.shape)


@pytest.fixture
def judged(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Experiment, LoopOptions]]:
    """The experiments that a verdict was asked of, each answered by one that names lift."""
    asked: list[tuple[Experiment, LoopOptions]] = []

    def close(experiment: Experiment, options: LoopOptions) -> Verdict:
        asked.append((experiment, options))
        return verdict(Conclusion.EFFECT)

    monkeypatch.setattr(close_loop_call, "close_loop", close)
    return asked


def test_arrays_become_an_experiment_and_a_verdict_its_answer(
    judged: list[tuple[Experiment, LoopOptions]], tmp_path: Path
) -> None:
    positions = swaying()
    found = flagdata.close_loop(
        [positions, positions],
        rest=REST,
        rate=RATE,
        wind=[1.0, (1.5, 0.0, 0.0)],
        noise=5e-4,
        seed=3,
    )
    ((experiment, options),) = judged
    assert options.seed == 3
    assert [one.wind.velocity.tolist() for one in experiment.recordings if one.wind] == [
        [[1, 0, 0]],
        [[1.5, 0, 0]],
    ]
    np.testing.assert_allclose(experiment.recordings[0].positions, positions, atol=0.02)
    expected = verdict(Conclusion.EFFECT)
    assert (found.conclusion, found.named) == ("effect", expected.named)
    assert set(found.strengths) == set(expected.named)
    assert found.p_value == expected.test.p_value.point
    assert found.sentence in repr(found)
    assert found.save(tmp_path / "page.html").read_text(encoding="utf-8").startswith(found.page)
    assert found.named[0] in found._repr_html_()


def test_a_mesh_sequence_states_its_own_rate_and_rest_coordinates(
    judged: list[tuple[Experiment, LoopOptions]],
) -> None:
    positions = swaying().astype(np.float32)
    corner = np.arange(35).reshape(5, 7)
    squares = np.stack(
        [corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]], axis=-1
    ).reshape(-1, 4)
    faces = np.concatenate([squares[:, [0, 1, 2]], squares[:, [0, 2, 3]]]).astype(np.int32)
    time = (np.arange(len(positions)) * 40_000_000).astype(np.int64)
    sequence = MeshSequence(
        time=time, positions=positions, faces=faces, rest=REST.astype(np.float32)
    )
    flagdata.close_loop(
        sequence, wind=(np.array([0.0, 4.0]), np.array([[1.0, 0, 0], [1.5, 0, 0]])), noise=5e-4
    )
    ((experiment, _),) = judged
    np.testing.assert_allclose(np.diff(experiment.recordings[0].times), 1 / RATE)
    assert experiment.recordings[0].wind is not None
    np.testing.assert_allclose(experiment.recordings[0].wind.velocity[:, 0], [1.0, 1.5])


@pytest.mark.parametrize(
    ("change", "error", "match"),
    [
        ({"material": "camel-ponte-romo"}, UnknownNameError, "camel-ponte-roma"),
        ({"pins": "hoist-corner"}, UnknownNameError, "hoist-corners"),
        ({"wind": [1.0, 1.5]}, UsageError, "2 winds for 1 recordings"),
        ({"nulls": 8}, UsageError, "8 nulls"),
    ],
)
def test_what_cannot_be_judged_is_refused_before_any_work(
    judged: list[tuple[Experiment, LoopOptions]], change: dict, error: type[Exception], match: str
) -> None:
    given = {"rest": REST, "rate": RATE, "wind": 1.0} | change
    with pytest.raises(error, match=match):
        flagdata.close_loop(swaying(), **given)
    assert not judged
