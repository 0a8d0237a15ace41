"""The recipe of the paper flag; intermediate results."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from tests.studies.validation.paper_flag.cached import cached
from tests.studies.validation.paper_flag.recipe import Group, load_case


def test_the_paper_flag_keeps_what_is_fitted_apart_from_what_is_held_out() -> None:
    case = load_case()
    assert not {c.name for c in case.of(Group.FIT)} & {c.name for c in case.of(Group.HELD_OUT)}
    assert not set(case.fit_lengths) & set(case.held_out_lengths)
    assert [c.speed for c in case.of(Group.HELD_OUT)] == sorted(
        c.speed for c in case.of(Group.HELD_OUT)
    )
    assert any(clip.whole for clip in case.of(Group.HELD_OUT))
    assert len({clip.name for clip in case.clips}) == len(case.clips)
    assert case.row_scale / case.column_scale == pytest.approx(9 / 16)


def test_what_was_computed_is_computed_once_for_the_same_inputs(tmp_path: Path) -> None:
    made = []

    def make() -> dict[str, np.ndarray]:
        made.append(1)
        return {"x": np.array([1.0, np.nan])}

    method = (sys.modules["tests.studies.validation.paper_flag.cached"],)
    for inputs in ({"a": 1}, {"a": 1}, {"a": 2}):
        assert np.array_equal(
            cached(tmp_path, inputs, method, make)["x"], [1.0, np.nan], equal_nan=True
        )
    assert len(made) == 2
    assert len(list(tmp_path.iterdir())) == 2  # and nothing unfinished
    cached(None, {"a": 1}, method, make)
    assert len(made) == 3


def test_an_intermediate_result_that_is_damaged_is_computed_anew_with_a_warning(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    method = (sys.modules["tests.studies.validation.paper_flag.cached"],)
    values = np.arange(50.0)

    def result() -> np.ndarray:
        return cached(tmp_path, {"a": 1}, method, lambda: {"x": values})["x"]

    result()
    (path,) = tmp_path.iterdir()
    whole = path.read_bytes()
    path.write_bytes(whole[:100] + bytes([whole[100] ^ 1]) + whole[101:])
    assert np.array_equal(result(), values)
    assert path.read_bytes() == whole
    assert [str(path) in message for message in caplog.messages] == [True]
