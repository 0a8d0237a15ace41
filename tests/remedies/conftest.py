"""A user in a folder with films, logs and a lake."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.remedies.scene import make_scene
from tests.remedies.user import User


@pytest.fixture(scope="session")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Made once; each user works on a copy."""
    return make_scene(tmp_path_factory.mktemp("remedies"))


@pytest.fixture
def user(scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[User]:
    """A user in a copy of the scene, who does what each remedy says that he meets."""
    user = User.at(scene, tmp_path / "scene", monkeypatch)
    yield user
    assert user.unfollowed() == []
