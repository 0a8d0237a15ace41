"""The registered weighing runs from simulations to its sheet, here on flags whose law is known."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flagdata.core.arrays import FloatArray, IntArray
from measure.cloth import OBSERVED, Design, cloth_posterior
from measure.observables import WINDOW
from tests.measure.cloth.calibration.conftest import readings
from tests.studies.validation import weighed


def _winds(design: Design) -> FloatArray:
    starts = np.arange(round(design.duration / WINDOW)) * WINDOW
    return design.log.mean_speed(starts, starts + WINDOW)


def _geometry(truth: Mapping[str, Any], at: Path) -> FloatArray:
    del at
    values = {
        name: np.array([truth[name]]) for name in ("area_weight", "gain", "damping", "azimuth")
    }
    return readings(values, _winds(weighed.design()), seed=truth["seed"])[0]


def _finer(design: Design) -> tuple[FloatArray, IntArray]:
    places = np.arange(16)
    values = {name: own[places] for name, own in design.values().items()}
    return readings(values, _winds(design), seed=2) + 0.01, places


def test_flags_are_weighed_and_their_sheet_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        weighed, "simulations", lambda at: readings(dict(own.values()), _winds(own), seed=1)
    )
    monkeypatch.setattr(weighed, "geometry", _geometry)
    monkeypatch.setattr(weighed, "film", lambda truth, at: _geometry(truth, at))
    monkeypatch.setattr(weighed, "finer", _finer)
    monkeypatch.setattr(weighed, "TRUTHS", 2)
    monkeypatch.setattr(cloth_posterior, "WALKERS", 64)
    monkeypatch.setattr(cloth_posterior, "CHECK", (32, 60))
    own = weighed.design()
    sheet = weighed.run(seed=1, out=tmp_path)
    given = [row for row in sheet["geometry"]["flags"] if row["value"] is not None]
    assert len(sheet["geometry"]["flags"]) == 2
    assert len(sheet["films"]["flags"]) == 1  # of the two truths the one that is filmed
    # By the gain of 3 % and what numerics add the weight is known to 7 %: within three times that.
    assert all(abs(row["value"] / row["truth"] - 1) < 0.21 for row in given)
    assert len(given) == 2
    bias = np.array(sheet["mesh"]["bias"])
    assert bias.shape == (2, len(OBSERVED))
    page = (tmp_path / "validate-weighed.md").read_text(encoding="utf-8")
    assert "120 s each." in page
    assert page.count("| truth-") == 3


def test_half_of_the_registered_flags_are_of_another_simulator() -> None:
    truths = weighed.truths()
    assert [one["code"] for one in truths].count("mujoco") == len(truths) // 2
    low, high = weighed.WEIGHTS
    assert all(low <= one["area_weight"] <= high for one in truths)
