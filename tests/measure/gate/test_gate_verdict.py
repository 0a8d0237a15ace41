"""The gate over windows and sizes: the stated rate holds, and reasons come in words."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ndtr

from flagdata.core.findings import Finding, Severity
from flagdata.core.json_values import json_values
from flagdata.core.rng import stream
from flagdata.errors import InputError
from measure.gate import FamiliarityGate, Reason, Verdict
from measure.gate.gate_verdict import verdict
from models.trained.outliers import Familiarity
from tests.measure.estimate.conftest import pictures


def reason(p: float) -> list[Reason]:
    return [Reason(kind="unlike-training", what=f"p = {p:.3f}", p=p)]


def exact(rate: float) -> float:
    """The level of p-values that are exact."""
    return rate


@pytest.mark.parametrize("windows", [2, 7])
@pytest.mark.parametrize("correlation", [0.0, 0.5, 1.0])
def test_familiar_recordings_are_refused_at_most_at_the_stated_rate(
    correlation: float, windows: int
) -> None:
    rng = stream(1, "gate")
    refused = 0
    for _ in range(2000):
        score = np.sqrt(correlation) * rng.normal() + np.sqrt(1 - correlation) * rng.normal(
            size=windows
        )
        refused += verdict(
            [[reason(float(p))] for p in ndtr(score)], false_alarm=0.1, level=exact
        ).refused
    assert refused / 2000 <= 0.1 + 0.015  # two binomial standard errors


def test_one_window_keeps_its_p_value() -> None:
    assert verdict([[reason(0.04)]], false_alarm=0.05, level=exact).p == 0.04
    assert verdict([[reason(0.04)]], false_alarm=0.05, level=exact).refused
    assert not verdict([[reason(0.06)]], false_alarm=0.05, level=exact).refused


def test_a_gate_of_few_clips_may_ask_for_a_smaller_p() -> None:
    assert not verdict([[reason(0.04)]], false_alarm=0.05, level=lambda rate: 0.6 * rate).refused
    assert verdict([[reason(0.02)]], false_alarm=0.05, level=lambda rate: 0.6 * rate).refused


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("scene-cut", "the picture changes at once"),
        ("moving-camera", "the camera may move"),
        (
            "cut-off",
            "motion reaches the picture's edge, so that a part of what moves may lie outside",
        ),
    ],
)
def test_a_fault_of_the_film_is_stated_in_a_few_words(kind: str, words: str) -> None:
    fault = Finding(kind=kind, severity=Severity.ERROR, what="a sentence, as in a report: 3 px")
    found = verdict([[reason(0.4)]], false_alarm=0.05, level=exact, faults=[fault])
    assert (found.refused, found.refusal) == (True, words)


def test_a_film_that_is_familiar_at_one_size_alone_is_refused_until_its_size_is_given() -> None:
    """So leaving the size out lets no film pass that is refused with one of the sizes
    considered."""
    found = verdict([[reason(0.001), reason(0.4)]], false_alarm=0.05, level=exact)
    assert (found.p, found.sizes, found.size) == (0.4, (1,), 1)
    assert found.refused
    assert not found.unlike
    assert [one.kind for one in found.reasons] == ["size-needed"]
    assert "at 1 of 2 sizes of the flag it is" in found.sentence
    assert found.reasons[0].fix.startswith("give --flag-size")
    assert not verdict([[reason(0.3), reason(0.4)]], false_alarm=0.05, level=exact).refused


def test_a_film_that_is_refused_at_every_size_is_refused_however_its_windows_pass_at_different_sizes() -> (
    None
):
    """Of two sizes each is strange in half of the windows, always in the other half: a flag has one
    size, not a new one for each window."""
    windows = [[reason(0.001), reason(0.5)], [reason(0.5), reason(0.001)]] * 10
    found = verdict(windows, false_alarm=0.05, level=exact)
    assert found.refused
    assert found.sizes == (0, 1)
    for size in (0, 1):
        assert verdict([[sizes[size]] for sizes in windows], false_alarm=0.05, level=exact).refused


def test_of_a_hundred_windows_48_that_are_strange_refuse_and_few_do_not() -> None:
    def judged(strange: int) -> Verdict:
        return verdict(
            [[reason(0.01)]] * strange + [[reason(0.5)]] * (100 - strange),
            false_alarm=0.05,
            level=exact,
        )

    assert judged(48).refused
    assert judged(26).refused
    assert not judged(25).refused
    assert "25 of 100 windows look unfamiliar (refused from 26 on)" in judged(25).sentence
    assert json_values(judged(25))["level"] == judged(25).level
    assert (json_values(judged(25))["strange"], json_values(judged(25))["refusing"]) == (25, 26)


def test_a_recording_of_which_most_windows_are_strange_is_refused_with_the_reason_of_a_usual_one() -> (
    None
):
    found = verdict(
        [[reason(p)] for p in (0.001, 0.002, 0.003, 0.6, 0.004)], false_alarm=0.05, level=exact
    )
    assert found.refused
    assert found.strange.tolist() == [True, True, True, False, True]
    assert "p = 0.003" in found.sentence
    assert "5%" in found.sentence


def test_a_summary_far_from_the_training_clips_has_a_small_p() -> None:
    rng = stream(2, "cloud")
    gate = FamiliarityGate(
        cloud=Familiarity.of(rng.normal(size=(300, 3)), rng.normal(size=(199, 3)))
    )
    frames = pictures(4)
    assert gate.judge(frames, np.full(3, 30.0))[0].p == pytest.approx(1 / 200)
    assert (gate.judge(frames, np.zeros(3))[0].p or 0.0) > 0.9


@pytest.mark.parametrize(
    ("frames", "kind"),
    [(np.zeros((4, 32, 32), dtype=np.uint8), "too-dark"), (pictures(1).repeat(4, 0), "no-motion")],
)
def test_a_blank_or_still_film_has_nothing_to_measure(frames: np.ndarray, kind: str) -> None:
    rng = stream(2, "cloud")
    gate = FamiliarityGate(
        cloud=Familiarity.of(rng.normal(size=(300, 3)), rng.normal(size=(199, 3)))
    )
    (found,) = gate.judge(frames, np.zeros(3))
    assert (found.kind, found.p, found.blank) == (kind, pytest.approx(1 / 200), True)
    judged = verdict([[[found]], [reason(0.5)]], false_alarm=0.05, level=exact)
    assert (judged.blank, judged.measurable) == ((True, False), True)
    assert not verdict([[[found]]], false_alarm=0.05, level=exact).measurable


def test_a_gate_of_too_few_clips_for_the_rate_is_refused_and_lets_nothing_pass() -> None:
    """Of 15 clips the smallest p is 1/16, above any level of a rate of 5 %."""
    rng = stream(2, "cloud")
    gate = FamiliarityGate(
        cloud=Familiarity.of(rng.normal(size=(300, 3)), rng.normal(size=(15, 3)))
    )
    with pytest.raises(InputError, match="15 validation clips are too few"):
        verdict([[reason(0.5)]], false_alarm=0.05, level=gate.level)


def test_a_verdict_without_reasons_or_a_false_alarm_rate_is_an_error() -> None:
    with pytest.raises(InputError, match="has no reason"):
        verdict([[[]]], false_alarm=0.05, level=exact)
    with pytest.raises(InputError, match="false-alarm"):
        verdict([[reason(0.5)]], false_alarm=0.0, level=exact)
