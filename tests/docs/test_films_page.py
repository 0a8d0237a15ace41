"""The page of the method on films states what the code does: each observable's unit, bias, sigma and blindness."""

from __future__ import annotations

from pathlib import Path

import pytest

from measure.observables import OBSERVABLES, Observable

PAGE = Path(__file__).parents[2] / "docs" / "method" / "films.md"


@pytest.mark.parametrize("name", list(OBSERVABLES))
def test_every_observable_is_on_the_page(name: str) -> None:
    found: Observable = OBSERVABLES[name]
    row = f"| {name} | {found.unit} | {found.meaning} | {found.bias:+.3f} | {found.sigma:.3f} | {found.blind} |"
    assert row in PAGE.read_text(encoding="utf-8").splitlines()
