"""A challenge small enough to simulate in a second."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
import torch

from tests.measure.conftest import forecaster, own_recording, specimen  # noqa: F401  fixtures, by their import
from tests.studies.challenge.cases import TINY
from tests.studies.challenge.folder import ChallengeFolder
from tests.studies.challenge.make import make
from tests.studies.challenge.recipe import parse


def _made(path: Path, *, seed: int = 3) -> ChallengeFolder:
    torch.set_num_threads(1)
    return make(path, parse(TINY, where="tiny"), seed=seed, count=4)


@pytest.fixture
def make_tiny() -> Callable[..., ChallengeFolder]:
    """Makes the same four sets of two recordings in any folder."""
    return _made


@pytest.fixture(scope="session")
def tiny_source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return _made(tmp_path_factory.mktemp("challenge") / "tiny").path


@pytest.fixture
def tiny(tiny_source: Path, tmp_path: Path) -> ChallengeFolder:
    """A copy that a test may change."""
    shutil.copytree(tiny_source, tmp_path / "tiny")
    return ChallengeFolder(tmp_path / "tiny")
