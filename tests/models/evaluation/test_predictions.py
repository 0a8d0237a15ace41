"""Predictions keep what they were given, and refuse what no score can be made of."""

from __future__ import annotations

import dataclasses
import pickle
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import InputError, NotFoundError
from models.evaluation import Predictions
from models.evaluation.predictions import load, save
from tests.models.evaluation.made import posterior
from tests.refusals import unrefused


@pytest.fixture
def whole() -> Predictions:
    made = posterior(clips=6, draws=4, wide=1, shift=0, targets=2, seed=1, group=2)
    return dataclasses.replace(made, embedding=np.ones((6, 3), dtype=np.float32), note="30 × 224²")


def test_what_is_loaded_is_what_was_saved(whole: Predictions, tmp_path: Path) -> None:
    save(whole, tmp_path / "a.predictions")
    back = load(tmp_path / "a.predictions")
    for field in dataclasses.fields(Predictions):
        np.testing.assert_array_equal(getattr(back, field.name), getattr(whole, field.name), strict=True)


def test_a_model_without_samples_and_embedding_has_none_after_loading(whole: Predictions, tmp_path: Path) -> None:
    save(dataclasses.replace(whole, samples=None, embedding=None), tmp_path / "a.npz")
    back = load(tmp_path / "a.npz")
    assert back.samples is None
    assert back.embedding is None


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


def test_a_truncated_file_is_refused(whole: Predictions, tmp_path: Path) -> None:
    save(whole, tmp_path / "whole.npz")
    data = (tmp_path / "whole.npz").read_bytes()
    for size in (0, 10, len(data) // 2, len(data) - 1):
        (tmp_path / "cut.npz").write_bytes(data[:size])
        with pytest.raises(InputError, match=r"cut\.npz"):
            load(tmp_path / "cut.npz")


def test_pickled_objects_are_never_loaded(tmp_path: Path) -> None:
    (tmp_path / "pickle.npz").write_bytes(pickle.dumps({"schema": "flagdata.predictions/1"}))
    np.savez(tmp_path / "objects.npz", schema="flagdata.predictions/1", label=np.array([{}], dtype=object))
    for name in ("pickle.npz", "objects.npz"):
        with pytest.raises(InputError, match="cannot be read as predictions"):
            load(tmp_path / name)


def test_other_files_and_missing_ones_are_named(tmp_path: Path) -> None:
    np.savez(tmp_path / "other.npz", a=np.ones(3))
    np.savez(tmp_path / "partial.npz", schema="flagdata.predictions/1", label="a")
    np.save(tmp_path / "array.npy", np.ones(3))
    with pytest.raises(InputError, match="schema is 'none'"):
        load(tmp_path / "other.npz")
    with pytest.raises(InputError, match="'targets' is missing"):
        load(tmp_path / "partial.npz")
    with pytest.raises(InputError, match="cannot be read as predictions"):
        load(tmp_path / "array.npy")
    with pytest.raises(NotFoundError):
        load(tmp_path / "none.npz")
