"""The gate over windows and sizes: the stated rate holds, and reasons come in words."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ndtr

from flagdata.errors import InputError
from flagdata.rng import stream
from measure.estimate.gate import FamiliarityGate, Reason, verdict
from models.outliers import Familiarity


def reason(p: float) -> list[Reason]:
    return [Reason(kind="unlike-training", what=f"p = {p:.3f}", p=p)]


@pytest.mark.parametrize("windows", [2, 7])
@pytest.mark.parametrize("correlation", [0.0, 0.5, 1.0])
def test_familiar_recordings_are_refused_at_most_at_the_stated_rate(correlation: float, windows: int) -> None:
    rng = stream(1, "gate")
    refused = 0
    for _ in range(2000):
        score = np.sqrt(correlation) * rng.normal() + np.sqrt(1 - correlation) * rng.normal(size=windows)
        refused += verdict([[reason(float(p))] for p in ndtr(score)], false_alarm=0.1).refused
    assert refused / 2000 <= 0.1 + 0.015  # two binomial standard errors


def test_one_window_keeps_its_p_value() -> None:
    assert verdict([[reason(0.04)]], false_alarm=0.05).p == 0.04
    assert verdict([[reason(0.04)]], false_alarm=0.05).refused
    assert not verdict([[reason(0.06)]], false_alarm=0.05).refused


def test_a_gate_of_few_clips_may_ask_for_a_smaller_p() -> None:
    assert not verdict([[reason(0.04)]], false_alarm=0.05, level=0.03).refused
    assert verdict([[reason(0.02)]], false_alarm=0.05, level=0.03).refused


def test_a_film_that_is_familiar_as_that_of_one_size_is_not_refused() -> None:
    found = verdict([[reason(0.001), reason(0.4)]], false_alarm=0.05)
    assert found.p == 0.4
    assert not found.refused


def test_a_recording_of_which_most_windows_are_strange_is_refused_with_the_reason_of_a_usual_one() -> None:
    found = verdict([[reason(p)] for p in (0.001, 0.002, 0.003, 0.6, 0.004)], false_alarm=0.05)
    assert found.refused
    assert found.strange.tolist() == [True, True, True, False, True]
    assert "p = 0.003" in found.sentence
    assert "5%" in found.sentence


def test_a_summary_far_from_the_training_clips_has_a_small_p() -> None:
    rng = stream(2, "cloud")
    gate = FamiliarityGate(cloud=Familiarity.of(rng.normal(size=(300, 3)), rng.normal(size=(199, 3))))
    frames = np.zeros((4, 8, 8), dtype=np.uint8)
    assert gate.judge(frames, np.full(3, 30.0))[0].p == pytest.approx(1 / 200)
    assert gate.judge(frames, np.zeros(3))[0].p > 0.9


def test_a_gate_that_says_nothing_is_no_gate() -> None:
    with pytest.raises(InputError, match="without a reason"):
        verdict([[[]]], false_alarm=0.05)
    with pytest.raises(InputError, match="false-alarm"):
        verdict([[reason(0.5)]], false_alarm=0.0)
