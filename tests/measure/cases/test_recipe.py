"""The case in the catalog, and what its form refuses; intermediate results."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import InputError, LimitError, UnknownNameError
from measure.cases.cached import cached
from measure.cases.recipe import Group, load_case, parse_case

TEXT = """
name = "small"
[sheet]
length = 0.1
mass = 0.08
rigidity = 1e-4
[air]
density = 1.1
[camera]
true-rate = 1000.0
column-scale = 1e-4
row-scale = 1e-4
whole = ["b"]
[clips]
fit = { a = 7.0 }
held-out = { b = 8.0 }
[thresholds]
fit-lengths = [0.1]
held-out-lengths = [0.2]
[declared]
reactive-share = 0.5
shear-factor = 0.5
[simulation]
"""


def test_the_paper_flag_keeps_what_is_fitted_apart_from_what_is_held_out() -> None:
    case = load_case("paper-flag")
    assert not {c.name for c in case.of(Group.FIT)} & {c.name for c in case.of(Group.HELD_OUT)}
    assert not set(case.fit_lengths) & set(case.held_out_lengths)
    assert [c.speed for c in case.of(Group.HELD_OUT)] == sorted(c.speed for c in case.of(Group.HELD_OUT))
    assert any(clip.whole for clip in case.of(Group.HELD_OUT))
    assert case.row_scale / case.column_scale == pytest.approx(9 / 16)


def test_a_case_that_is_not_there_and_a_key_that_is_not_known_are_named() -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'paper-flag'"):
        load_case("paper-flga")
    with pytest.raises(UnknownNameError, match="did you mean 'density'"):
        parse_case(TEXT.replace("[air]", "[air]\ndensty = 1.0"), where="small")
    with pytest.raises(UnknownNameError, match="clip 'c'"):
        parse_case(TEXT.replace('["b"]', '["b", "c"]'), where="small")


@pytest.mark.parametrize(
    ("before", "after", "what"),
    [
        ("[0.2]", "[0.1]", "both fitted and held out"),
        ("{ b = 8.0 }", "{ a = 8.0 }", "two groups"),
        ("mass = 0.08", "mass = -1", "above 0"),
        ("[air]", "[air", "not TOML"),
        ('["b"]', '["a"]', "no clip that is held out shows the whole sheet"),
        ("[simulation]", "[simulation]\nduration = 1e9", "frames"),
        ("[simulation]", "[simulation]\ncolumns = 1000000000", "columns is 1000000000"),
    ],
)
def test_a_case_that_contradicts_itself_is_refused(before: str, after: str, what: str) -> None:
    assert parse_case(TEXT, where="small").name == "small"
    with pytest.raises((InputError, LimitError), match=what):
        parse_case(TEXT.replace(before, after), where="small")


def test_what_was_computed_is_computed_once_for_the_same_inputs(tmp_path: Path) -> None:
    made = []

    def make() -> dict[str, np.ndarray]:
        made.append(1)
        return {"x": np.array([1.0, np.nan])}

    method = (sys.modules["measure.cases.cached"],)
    for inputs in ({"a": 1}, {"a": 1}, {"a": 2}):
        assert np.array_equal(cached(tmp_path, inputs, method, make)["x"], [1.0, np.nan], equal_nan=True)
    assert len(made) == 2
    assert len(list(tmp_path.iterdir())) == 2  # and nothing unfinished
    cached(None, {"a": 1}, method, make)
    assert len(made) == 3


def test_an_intermediate_result_that_is_damaged_is_computed_anew_with_a_warning(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    method = (sys.modules["measure.cases.cached"],)
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
