"""Folders of OBJ files as ArcSim writes them, made by hand."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

SQUARE = (
    "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nv 0 0 {z}\nv 0 1 {z}\nv 0 1 {top}\nv 0 0 {top}\nf 1/1 2/2 "
    "3/3\nf 1/1 3/3 4/4\n"
)
MakeFolder = Callable[..., Path]


def square(*, lift: float = 0.0) -> str:
    """A square of 1 m, upright, lifted by some metres."""
    return SQUARE.format(z=lift, top=lift + 1)


@pytest.fixture
def make_folder(tmp_path: Path) -> MakeFolder:
    """A folder of frames with a conf.json; `frames` maps file names to text."""

    def make(
        frames: dict[str, str] | None = None,
        *,
        conf: dict | None = None,
        name: str = "run",
        configured: str = "yes",
    ) -> Path:
        folder = tmp_path / name
        folder.mkdir()
        for file, text in (
            frames or {f"{i:04d}_00.obj": square(lift=0.01 * i) for i in range(3)}
        ).items():
            (folder / file).write_text(text)
        if configured == "yes":
            content = (
                {"frame_time": 0.04, "wind": {"velocity": [3, 4, 0]}} if conf is None else conf
            )
            (folder / "conf.json").write_text(json.dumps(content))
        return folder

    return make
