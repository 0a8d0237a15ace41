"""Hostile recipes, models, inputs and lakes, drawn from one seed, are read or refused in bounded
time and memory."""

from __future__ import annotations

import os
from typing import Any

import pytest

from tests.studies.hostile import KINDS
from tests.studies.hostile.campaign import MEMORY, campaign

COUNT = int(os.environ.get("FLAGDATA_HOSTILE", "60"))
"""Examples of all classes together."""


@pytest.fixture(scope="module")
def outcomes() -> dict[str, dict[str, Any]]:
    return campaign({kind: COUNT // len(KINDS) for kind in KINDS}, start=1)


@pytest.mark.timeout(10 * COUNT)
@pytest.mark.parametrize("kind", KINDS)
def test_what_is_hostile_is_read_or_refused_by_an_error_of_flagdata(
    kind: str, outcomes: dict[str, dict[str, Any]]
) -> None:
    outcome = outcomes[kind]
    assert outcome["failures"] == []
    assert all(outcome["examples"].values())
    assert outcome["refused"]
    assert outcome["peak"] < MEMORY
