"""The gate that lies beside a model is the one that is asked."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

from measure.gate import CheckedGate, FamiliarityGate, write
from measure.measuring_model import gate_beside, network
from tests.measure.gate.made import learned


def test_the_gate_in_a_models_folder_is_taken_and_else_the_distance(
    model_folder: Path, tmp_path: Path
) -> None:
    found = network(str(model_folder), lake=None, at=None)
    assert isinstance(gate_beside(found, false_alarm=0.05), FamiliarityGate)
    folder = tmp_path / "model"
    shutil.copytree(model_folder, folder)
    write(folder, learned(1), found.estimator)
    assert isinstance(gate_beside(replace(found, folder=folder), false_alarm=0.05), CheckedGate)
