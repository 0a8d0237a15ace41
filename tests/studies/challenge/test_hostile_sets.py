"""Sets of a challenge whose files do not fit are refused before memory is taken, and name no file
elsewhere."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flagdata.errors import CorruptError, FlagdataError, InputError
from tests.damage import changed
from tests.studies.challenge.filing import opened
from tests.studies.challenge.folder import ChallengeFolder, read_set
from tests.studies.hostile.inputs import ABOUT, write_small_set


def test_the_set_is_whole(tmp_path: Path) -> None:
    write_small_set(tmp_path / "set")
    assert [recording.positions.shape for recording in read_set(tmp_path / "set").recordings] == [
        (10, 6, 3)
    ]


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("flag",), 3),
        (("flag",), [1]),
        (("flag", "width"), [1.5, 1.5]),
        (("flag", "width"), 10**400),
        (("flag", "pins"), "x"),
        (("flag", "gravity"), 3),
        (("recordings",), {"a": 1}),
        (("recordings",), ["a"]),
        (("rate",), "fast"),
        (("recordings", 0, "wind", "times"), [[0.0], [0.4, 1.0]]),
        (("recordings", 0, "name"), "../elsewhere"),
        (("recordings", 0, "name"), "b"),
    ],
)
def test_values_that_do_not_fit_are_refused(
    tmp_path: Path, path: tuple[Any, ...], value: Any
) -> None:
    write_small_set(tmp_path / "set")
    np.save(tmp_path / "elsewhere.npy", np.zeros((10, 6, 3)))
    (tmp_path / "set" / "set.json").write_text(json.dumps(changed(ABOUT, path, value)))
    with pytest.raises(FlagdataError):
        read_set(tmp_path / "set")


@pytest.mark.parametrize(
    "shape", ["(1000000000000,)", "(10, 6, 3000000)", "(4611686018427387904, 6, 3)"]
)
@pytest.mark.parametrize("kind", ["<f4", "|O"])
def test_a_header_that_states_more_than_the_file_holds_is_refused(
    tmp_path: Path, shape: str, kind: str
) -> None:
    write_small_set(tmp_path / "set")
    text = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}".ljust(117) + "\n"
    (tmp_path / "set" / "a.npy").write_bytes(b"\x93NUMPY\x01\x00v\x00" + text.encode() + bytes(720))
    with pytest.raises(InputError):
        read_set(tmp_path / "set")


@pytest.mark.parametrize(
    "content",
    [
        {},
        {"title": "t"},
        {"title": "t", "sets": []},
        {"title": "t", "sets": {"set-001": {"data": "x"}}},
        {"title": "t", "sets": {"../x": {"data": "x", "commitment": "y"}}},
        {"title": "t", "sets": {"\0": {"data": "x", "commitment": "y"}}},
    ],
)
def test_a_challenge_that_does_not_state_its_sets_is_refused(
    tmp_path: Path, content: dict[str, Any]
) -> None:
    (tmp_path / "challenge.json").write_text(json.dumps(content))
    with pytest.raises(CorruptError, match="title and its sets"):
        ChallengeFolder(tmp_path).names()


@pytest.mark.parametrize("content", ["{}", '{"verdicts": 3}', '{"verdicts": []}'])
def test_a_record_of_openings_without_verdicts_is_refused(tmp_path: Path, content: str) -> None:
    (tmp_path / "opened.json").write_text(content)
    with pytest.raises(CorruptError, match="openings"):
        opened(ChallengeFolder(tmp_path))


def test_a_set_whose_folder_is_gone_is_refused(tmp_path: Path) -> None:
    sets = {"set-001": {"data": "x", "commitment": "y"}}
    (tmp_path / "challenge.json").write_text(json.dumps({"title": "t", "sets": sets}))
    with pytest.raises(CorruptError, match="cannot be read"):
        ChallengeFolder(tmp_path).experiment("set-001")
