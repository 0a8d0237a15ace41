"""Hostile recipes, models, inputs and lakes, drawn from one seed, are read or refused in bounded time and memory."""

from __future__ import annotations

import os

import pytest

from tests.studies.hostile import KINDS
from tests.studies.hostile.campaign import MEMORY, campaign

COUNT = int(os.environ.get("FLAGDATA_HOSTILE", "60"))
"""Examples of all classes together."""


@pytest.mark.timeout(10 * COUNT)
@pytest.mark.parametrize("kind", KINDS)
def test_what_is_hostile_is_read_or_refused_by_an_error_of_flagdata(kind: str) -> None:
    outcome = campaign(kind, count=COUNT // len(KINDS), start=1)
    assert outcome["failures"] == []
    assert all(outcome["examples"].values())
    assert outcome["refused"]
    assert outcome["peak"] < MEMORY
