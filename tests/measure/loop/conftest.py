"""A null bank that is drawn, and what judges by it."""

from __future__ import annotations

import pytest

from measure.inference import NullModel
from measure.nulls import NullBank, Reference
from tests.measure.loop.drawn_statistics import made


@pytest.fixture(scope="session")
def bank() -> NullBank:
    return made(seed=1)


@pytest.fixture(scope="session")
def null(bank: NullBank) -> NullModel:
    return bank.model(bank.nulls.design)


@pytest.fixture(scope="session")
def reference(bank: NullBank) -> Reference:
    return bank.reference(12, noise=0.0, seed=1)


@pytest.fixture(scope="session")
def blowing() -> tuple[NullModel, Reference]:
    """What judges by nulls whose wind's course is looked at."""
    bank = made(seed=1, courses=True)
    return bank.model(bank.nulls.design), bank.reference(12, noise=0.0, seed=1)
