"""A bit that flips in what flagdata keeps gives no other value without an error;
`studies.hostile.flips` draws more."""

from __future__ import annotations

import os

import pytest

from tests.studies.hostile.flips import campaign

COUNT = int(os.environ.get("FLAGDATA_FLIPS", "8"))
"""Flips of each kind of file."""


@pytest.mark.timeout(60 * COUNT)
def test_a_bit_that_flips_is_refused_or_changes_nothing() -> None:
    found = campaign(count=COUNT, seed=1)
    assert [(kind, one["failures"]) for kind, one in found.items() if one["failures"]] == []
    assert all(one["refused"] + one["same"] == COUNT for one in found.values())
    for kind in (
        "log entries",
        "files of rows",
        "tags and branches",
        "banks of nulls",
        "kept simulations",
    ):
        assert found[kind]["refused"], f"none of {kind} was refused"
