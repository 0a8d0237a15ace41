"""From frames to a verdict in words, with a small network that was never trained."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flagdata.core.arrays import UInt8Array
from flagdata.core.files.checksums import write_sums
from flagdata.errors import CorruptError, InputError, NotFoundError
from measure.gate import DISTORTIONS, REASONS, CheckedGate, Gate, judge, read, write
from measure.gate.gate_verdict import verdict
from models.trained.estimator import Estimator
from tests.measure.gate.made import film, small_model
from tests.studies.gate import calibrated

PLAIN, DISTORTED, VALIDATION = 60, 4, 50


def clip(seed: int, frames: int = 16) -> UInt8Array:
    """A film like those that the small gate is calibrated by: one patch near the middle."""
    x, y = np.random.default_rng(seed).uniform(0.45, 0.55, 2)
    return film(seed=seed, at=(float(x), float(y)), frames=frames)


@pytest.fixture(scope="module")
def model() -> Estimator:
    return small_model()


@pytest.fixture(scope="module")
def gate(model: Estimator) -> Gate:
    training = [clip(seed) for seed in range(PLAIN + DISTORTED)]
    validation = [clip(1000 + seed) for seed in range(VALIDATION)]
    return calibrated(
        model,
        training,
        validation,
        seed=1,
        advance=lambda _: None,
        plain=PLAIN,
        distorted=DISTORTED,
    )


def test_most_films_like_the_calibration_clips_are_familiar(model: Estimator, gate: Gate) -> None:
    """At a level that lets 5 % be refused at most, with 90 %, of 20 films four refusals have p =
    0.02."""
    judged = [judge(clip(5000 + seed)[:12], model, gate) for seed in range(20)]
    assert sum(not one.familiar for one in judged) <= 3
    assert all(
        one.familiar == (one.p > one.level) and one.familiar == (not one.reasons) for one in judged
    )


@pytest.mark.parametrize(
    ("fault", "kind"),
    [
        ("still", "no-motion"),
        ("held", "low-frame-rate"),
        ("dark", "too-dark"),
        ("pair", "several-flags"),
    ],
)
def test_a_fault_is_refused_and_named(model: Estimator, gate: Gate, fault: str, kind: str) -> None:
    plain = clip(42)
    rng = np.random.default_rng(5)
    frames = {
        "still": np.repeat(plain[:1], 12, axis=0),
        "held": plain[(np.floor(np.arange(12) / 2.5) * 2.5).astype(int)],
        "dark": np.clip(plain[:12] * 0.08 + rng.normal(0, 2, plain[:12].shape), 0, 255).astype(
            np.uint8
        ),
        "pair": np.concatenate(
            [
                film(seed=42, at=(0.25, 0.5))[:12, :, :56],
                film(seed=43, at=(0.75, 0.5))[:12, :, 56:],
            ],
            axis=2,
        ),
    }[fault]
    judged = judge(frames, model, gate)
    assert not judged.familiar
    assert kind in {one.kind for one in judged.reasons}
    assert len({one.kind for one in judged.reasons}) == len(judged.reasons)
    assert all(one.p is not None and one.p <= judged.level for one in judged.reasons)
    assert not next(one for one in judged.reasons if one.kind == kind).check.startswith("like-")
    assert all(
        one.fix and one.figure in one.what and one.value is not None for one in judged.reasons
    )


def test_kinds_that_are_left_out_refuse_nothing_and_make_no_other_kind_more_suspicious(
    model: Estimator, gate: Gate
) -> None:
    held = clip(42)[(np.floor(np.arange(12) / 2.5) * 2.5).astype(int)]
    whole = judge(held, model, gate)
    part = judge(held, model, gate, without={"low-frame-rate", "repeated-frames"})
    assert {"low-frame-rate"} <= {one.kind for one in whole.reasons}
    assert not {"low-frame-rate", "repeated-frames"} & {one.kind for one in part.reasons}
    assert part.p >= whole.p
    assert judge(held, model, gate, without=REASONS).familiar


def test_where_nothing_moves_no_reason_is_about_what_moves(model: Estimator, gate: Gate) -> None:
    """A still picture with the noise of a camera: "height 0" would be the size of nothing."""
    noise = np.random.default_rng(7).normal(0, 6, (12, 112, 112))
    still = np.clip(clip(42)[:1] + noise, 0, 255).astype(np.uint8)
    kinds = [one.kind for one in judge(still, model, gate).reasons]
    assert "no-motion" in kinds
    assert not {"scale", "cut-off", "several-flags", "unlike-cloth"} & set(kinds)
    without = judge(np.repeat(still[:1], 12, axis=0), model, gate)
    assert [one.kind for one in without.reasons] == ["no-motion"]
    assert "no motion is found in the picture" in without.reasons[0].what
    assert without.reasons[0].blank


def test_too_few_frames_and_a_black_film_are_refused_before_anything_is_measured(
    model: Estimator, gate: Gate
) -> None:
    short = judge(clip(1)[:10], model, gate)
    assert [one.kind for one in short.reasons] == ["too-few-frames"]
    assert "10 instead of 12" in short.reasons[0].what
    black = judge(np.zeros((12, 64, 64), dtype=np.uint8), model, gate)
    assert [one.kind for one in black.reasons] == ["too-dark"]
    assert black.p == pytest.approx(1 / (VALIDATION + 1))


def test_measuring_refuses_a_still_film_with_the_checks_own_reason_and_fix(
    model: Estimator, gate: Gate
) -> None:
    asked = CheckedGate(model=model, calibrated=gate, false_alarm=0.05)
    still = np.repeat(clip(42)[:1], 12, axis=0)
    reasons = asked.judge(still, model.summaries(model.inputs(still[None]))[0].numpy())
    found = verdict([[reasons]], false_alarm=0.05, level=asked.level)
    assert found.refused
    assert found.reasons[0].kind == "no-motion"
    assert "crop" in found.reasons[0].fix
    known = clip(1005)[:12]  # one that it was calibrated by
    usual = asked.judge(known, model.summaries(model.inputs(known[None]))[0].numpy())
    assert (usual[0].p or 0.0) > asked.level(0.05)


def test_the_level_leaves_room_for_few_calibration_clips(model: Estimator, gate: Gate) -> None:
    assert 0 < CheckedGate(model=model, calibrated=gate, false_alarm=0.05).level(0.05) < 0.05


def test_frames_that_are_no_window_are_an_error(model: Estimator, gate: Gate) -> None:
    with pytest.raises(InputError, match="one window of the film"):
        judge(clip(1, frames=20), model, gate)
    with pytest.raises(InputError, match="calibration clips are too few"):
        judge(clip(1)[:12], model, gate, false_alarm=0.01)


def test_a_gate_is_the_same_after_storing_and_fits_its_own_network_alone(
    model: Estimator, gate: Gate, tmp_path: Path
) -> None:
    with pytest.raises(NotFoundError):
        read(tmp_path, model)
    write_sums(tmp_path)
    write(tmp_path, gate, model)
    again = read(tmp_path, model)
    for seed in range(3):
        one, other = (judge(clip(seed)[:12], model, which) for which in (gate, again))
        assert (one.p, one.reasons) == (other.p, other.reasons)
    with pytest.raises(CorruptError, match="another network"):
        read(tmp_path, small_model(seed=1))


@pytest.mark.parametrize("name", DISTORTIONS)
def test_a_distortion_is_the_same_from_the_same_seed_and_of_the_length_wanted(name: str) -> None:
    make = DISTORTIONS[name].apply
    one, other, again = (
        make(clip(1), clip(2), np.random.default_rng(seed), 12) for seed in (3, 4, 3)
    )
    np.testing.assert_array_equal(one, again)
    assert (len(one), one.dtype, one.ndim) == (12, np.uint8, 3)
    assert one.shape != other.shape or (one != other).any()
