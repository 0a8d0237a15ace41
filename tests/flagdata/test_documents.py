"""Texts of TOML and JSON that are too deep, too long or hold no finite numbers are refused at once."""

from __future__ import annotations

import pytest

from flagdata import documents
from flagdata.documents import NESTING_LIMIT, LimitsError, from_json, from_toml

MANY = 200_000


@pytest.mark.parametrize(
    "text",
    [
        "a = " + "[" * MANY + "]" * MANY,
        "a = " + "{a = " * MANY + "1" + "}" * MANY,
        "[" + ".".join(["a"] * MANY) + "]",
        "[[" + " . ".join(["a"] * MANY) + "]]",
        ".".join(["a"] * MANY) + " = 1",
        ".".join(['"a.b"', "'c'"] * MANY) + " = 1",
        "a = {" + ".".join(["a"] * MANY) + " = 1}",
        "a = 1\n" + ".".join(["a"] * (NESTING_LIMIT + 1)) + " = 1",
    ],
)
def test_tables_that_are_nested_too_deep_are_refused_before_they_take_time(text: str) -> None:
    with pytest.raises(LimitsError, match=f"more than {NESTING_LIMIT} deep"):
        from_toml(text)


@pytest.mark.parametrize("text", ["[" * MANY + "]" * MANY, '{"a":' * MANY + "1" + "}" * MANY, "[" * 101 + "]" * 101])
def test_values_that_are_nested_too_deep_are_refused(text: str) -> None:
    with pytest.raises(LimitsError, match=f"more than {NESTING_LIMIT} deep"):
        from_json(text)


def test_what_is_nested_within_the_limit_is_read() -> None:
    inner = NESTING_LIMIT - 1
    assert from_json("[" * inner + "]" * inner)
    assert from_toml(".".join(["a"] * inner) + " = 1")
    assert from_toml('title = "' + ".".join(["a"] * MANY) + '"')  # dots in a text are no tables


@pytest.mark.parametrize("number", ["inf", "-inf", "nan", "1e999", "1" + "0" * 5000])
def test_numbers_that_are_not_finite_or_endless_are_refused(number: str) -> None:
    with pytest.raises(ValueError):
        from_toml(f"a = [1.0, {number}]")


@pytest.mark.parametrize("number", ["Infinity", "NaN", "1e999", "1" + "0" * 5000])
def test_numbers_of_json_that_are_not_finite_or_endless_are_refused(number: str) -> None:
    with pytest.raises(ValueError):
        from_json(f'{{"a": [1.0, {number}]}}')


def test_a_text_beyond_the_limit_is_not_parsed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(documents, "SIZE_LIMIT", 10)
    for read in (from_toml, from_json):
        with pytest.raises(LimitsError, match="11 characters, at most 10"):
            read("a = 1234567")
