"""The page of the method on films states what the code does and what was measured: each
observable's unit, bias, sigma and blindness, and the map of what a minute of film shows."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from measure.cloth import OBSERVED
from measure.cloth import observed_recording as observed
from measure.observables import OBSERVABLES, Observable
from tests.studies.validation.power import reference_table, table

PAGE = Path(__file__).parents[2] / "docs" / "method" / "films.md"


@pytest.mark.parametrize("name", list(OBSERVABLES))
def test_every_observable_is_on_the_page(name: str) -> None:
    found: Observable = OBSERVABLES[name]
    row = (
        f"| {name} | {found.unit} | {found.meaning} | {found.bias:+.3f} | {found.sigma:.3f} | "
        f"{found.blind} |"
    )
    assert row in PAGE.read_text(encoding="utf-8").splitlines()


def test_the_shares_that_last_are_those_that_are_drawn() -> None:
    shares = " | ".join(f"{one:.2f}" for one in observed.LASTING)
    lines = PAGE.read_text(encoding="utf-8").splitlines()
    assert f"| | {' | '.join(OBSERVED)} |" in lines
    assert f"| share of the variance that lasts | {shares} |" in lines


def test_the_maps_of_effects_are_those_of_their_sheet() -> None:
    sheet = json.loads(
        (PAGE.parents[1] / "results" / "validate-power.json").read_text(encoding="utf-8")
    )["result"]
    for lines in (table(sheet), reference_table(sheet)):
        assert len(lines) > 7
        assert "\n".join(lines) in PAGE.read_text(encoding="utf-8")
