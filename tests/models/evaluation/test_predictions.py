"""Predictions refuse what no score can be made of."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from flagdata.errors import InputError
from models.evaluation import Predictions
from tests.models.evaluation.made import posterior
from tests.refusals import unrefused


@pytest.fixture
def whole() -> Predictions:
    made = posterior(clips=6, draws=4, wide=1, shift=0, targets=2, seed=1, group=2)
    return dataclasses.replace(made, embedding=np.ones((6, 3), dtype=np.float32), note="30 × 224²")


def test_predictions_that_do_not_fit_are_refused(whole: Predictions) -> None:
    cases = [
        ({"mean": np.zeros((5, 2))}, r"mean is float64 \(5, 2\), not float64 \(6, 2\)"),
        ({"mean": np.full((6, 2), np.nan)}, "not finite"),
        ({"truth": np.zeros((6, 2), dtype=np.float32)}, "truth is float32"),
        ({"group": np.zeros(6)}, "group is float64"),
        ({"samples": np.zeros((6, 1, 2), dtype=np.float32)}, "1 sample a clip"),
        ({"samples": np.zeros((6, 4), dtype=np.float32)}, r"samples is float32 \(6, 4\)"),
        ({"embedding": np.zeros((6, 0), dtype=np.float32)}, "no dimension"),
        ({"targets": ("wind_speed", "wind_speed")}, "targets are"),
        ({"label": " "}, "no name"),
        ({"milliseconds": float("nan")}, "nan ms"),
    ]
    assert not unrefused(lambda change: dataclasses.replace(whole, **change), cases, InputError)
