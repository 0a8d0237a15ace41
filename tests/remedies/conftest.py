"""A user in a folder with a lake: a film, a log, the recording of both, a branch, a tag, and what a crash leaves."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.failing.commands import Scene, made_scene
from tests.remedies.user import User


@pytest.fixture(scope="session")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    """Made once; each user works on a copy."""
    return made_scene(tmp_path_factory.mktemp("remedies"))


@pytest.fixture
def user(
    scene: Scene, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> Iterator[User]:
    """A user in a copy of the scene, who does what each remedy says that he meets."""
    user = User.at(scene.folder, tmp_path / "scene", dict(scene.ids), capsys, monkeypatch)
    yield user
    assert user.unfollowed() == []
