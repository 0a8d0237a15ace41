"""The calibrated gate as the measuring asks it."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from measure.estimate.checked import CheckedGate
from measure.estimate.gate import FamiliarityGate, verdict
from measure.estimate.source import gate_beside, network
from measure.gate.gate import Gate
from measure.gate.prepare import calibrated
from measure.gate.storage import write
from models.estimator import Estimator
from tests.measure.gate.made import film, small_model


def clip(seed: int, frames: int = 16) -> np.ndarray:
    x, y = np.random.default_rng(seed).uniform(0.45, 0.55, 2)
    return film(seed=seed, at=(float(x), float(y)), frames=frames)


@pytest.fixture(scope="module")
def model() -> Estimator:
    return small_model()


@pytest.fixture(scope="module")
def gate(model: Estimator) -> Gate:
    training, validation = [clip(seed) for seed in range(64)], [clip(1000 + seed) for seed in range(50)]
    return calibrated(model, training, validation, seed=1, advance=lambda _: None, plain=60, distorted=4)


def test_a_still_film_is_refused_with_the_checks_own_reason_and_fix(model: Estimator, gate: Gate) -> None:
    asked = CheckedGate(model=model, calibrated=gate, false_alarm=0.05)
    still = np.repeat(clip(42)[:1], 12, axis=0)
    reasons = asked.judge(still, model.summaries(model.inputs(still[None]))[0].numpy())
    found = verdict([[reasons]], false_alarm=0.05, level=asked.level)
    assert found.refused
    assert found.reasons[0].kind == "no-motion"
    assert "crop" in found.reasons[0].fix
    known = clip(1005)[:12]  # one that it was calibrated by
    usual = asked.judge(known, model.summaries(model.inputs(known[None]))[0].numpy())
    assert usual[0].p > asked.level(0.05)


def test_the_level_leaves_room_for_few_calibration_clips(model: Estimator, gate: Gate) -> None:
    assert 0 < CheckedGate(model=model, calibrated=gate, false_alarm=0.05).level(0.05) < 0.05


def test_the_gate_in_a_models_folder_is_taken_and_else_the_distance(
    model_folder: Path, gate: Gate, tmp_path: Path
) -> None:
    found = network(str(model_folder), lake=None, at=None)
    assert isinstance(gate_beside(found, false_alarm=0.05), FamiliarityGate)
    folder = tmp_path / "model"
    shutil.copytree(model_folder, folder)
    write(folder, gate, found.estimator)
    assert isinstance(gate_beside(replace(found, folder=folder), false_alarm=0.05), CheckedGate)
