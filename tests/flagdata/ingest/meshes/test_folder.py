"""Folders of meshes: a frame for each number, the frame time from the scene or the user."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import ConflictError, InputError, LimitError, NotFoundError
from flagdata.ingest import findings, frame_files, read_folder, write_folder
from flagdata.ingest.meshes import folder as folders
from flagdata.ingest.meshes.mesh_artifacts import check_units
from flagdata.lake import MeshSequence, RaggedMeshSequence
from tests.refusals import unrefused

SQUARE = (
    "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nv 0 0 0\nv 0 {w} 0\nv 0 {w} {w}\nv 0 0 {w}\nf 1/1 2/2 3/3\nf "
    "1/1 3/3 4/4\n"
)
LARGE, MILLIMETRES = SQUARE.format(w=3), SQUARE.format(w=1000)
UNIT = SQUARE.format(w=1)


def test_one_topology_is_a_plain_sequence_on_the_scenes_clock(
    make_folder: Callable[..., Path],
) -> None:
    sequence = read_folder(make_folder())
    assert isinstance(sequence, MeshSequence)
    assert sequence.time.tolist() == [0, 40_000_000, 80_000_000]
    np.testing.assert_array_equal(sequence.positions[:, 0, 2], np.float32([0, 0.01, 0.02]))
    np.testing.assert_array_equal(sequence.rest, [[0, 0], [1, 0], [1, 1], [0, 1]])
    assert sequence.attributes["source"] == "arcsim"
    assert sequence.attributes["scene"]["frame_time"] == 0.04


def test_frames_that_begin_later_keep_their_time(make_folder: Callable[..., Path]) -> None:
    sequence = read_folder(make_folder({"0010_00.obj": UNIT, "0011_00.obj": UNIT}))
    assert sequence.time.tolist() == [400_000_000, 440_000_000]


def test_remeshed_frames_are_a_ragged_sequence(make_folder: Callable[..., Path]) -> None:
    triangle = "vt 0 0\nvt 1 0\nvt 0 1\nv 0 0 0\nv 0 1 0\nv 0 0 1\nf 1/1 2/2 3/3\n"
    sequence = read_folder(make_folder({"0000_00.obj": UNIT, "0001_00.obj": triangle}))
    assert isinstance(sequence, RaggedMeshSequence)
    assert sequence.vertex_offset.tolist() == [0, 4, 7]
    assert sequence.face_offset.tolist() == [0, 2, 3]
    np.testing.assert_array_equal(sequence.frame(1).faces, [[0, 1, 2]])


def test_moved_material_coordinates_are_another_topology(make_folder: Callable[..., Path]) -> None:
    moved = UNIT.replace("vt 1 1", "vt 1 1.1")
    assert isinstance(
        read_folder(make_folder({"0000_00.obj": UNIT, "0001_00.obj": moved})), RaggedMeshSequence
    )


def test_frames_of_other_programs_need_a_rate(make_folder: Callable[..., Path]) -> None:
    path = make_folder(
        {"flag_8.obj": UNIT, "flag_9.obj": UNIT, "flag_10.obj": UNIT}, configured="no"
    )
    assert [n for n, _ in frame_files(path)] == [8, 9, 10]
    sequence = read_folder(path, rate=50.0)
    assert sequence.time.tolist() == [160_000_000, 180_000_000, 200_000_000]
    assert sequence.attributes["source"] == "obj"
    with pytest.raises(NotFoundError, match=r"conf\.json") as caught:
        read_folder(path)
    assert "--rate" in caught.value.fix


def test_a_rate_goes_before_the_scenes(make_folder: Callable[..., Path]) -> None:
    assert read_folder(make_folder(), rate=100.0).time.tolist() == [0, 10_000_000, 20_000_000]


def test_what_is_wrong_is_refused(make_folder: Callable[..., Path]) -> None:
    cases = [
        (
            {"0000_00.obj": UNIT, "0002_00.obj": UNIT, "0005_00.obj": UNIT},
            None,
            InputError,
            "3 frames are missing",
        ),
        (
            {"0.obj": UNIT, f"{10**12}.obj": UNIT},
            None,
            InputError,
            f"{10**12 - 1} frames are missing, the first after",
        ),
        (
            {"0.obj": UNIT, f"{10**200}.obj": UNIT},
            None,
            InputError,
            "frames are missing, the first after frame 0000",
        ),
        ({f"{10**15}.obj": UNIT}, None, LimitError, "s after the first"),
        ({f"{10**200}.obj": UNIT}, None, LimitError, "the last frame is numbered 1000"),
        ({f"0000_{10**30}.obj": UNIT}, None, InputError, "1 cloths"),
        ({"0000_00.obj": UNIT, "0000_01.obj": UNIT}, None, InputError, "2 cloths"),
        ({"a_1.obj": UNIT, "b_2.obj": UNIT}, None, InputError, "no sequence: a_1.obj and b_2.obj"),
        (
            {"a_1.obj": UNIT, "flag.obj": UNIT},
            None,
            InputError,
            "no sequence: a_1.obj and flag.obj",
        ),
        ({"a_1.obj": UNIT, "a_01.obj": UNIT}, None, InputError, "two files for one frame"),
        ({"notes.txt": "none"}, None, NotFoundError, r"no \.obj"),
        ({"0000_00.obj": UNIT}, {}, InputError, "frame_time is None"),
        ({"0000_00.obj": UNIT}, {"frame_time": True}, InputError, "frame_time is True"),
        ({"0000_00.obj": UNIT}, {"frame_time": -0.04}, InputError, "frame_time is -0.04"),
        (
            {"0000_00.obj": "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"},
            None,
            InputError,
            "no texture coordinates",
        ),
        ({"0000_00.obj": UNIT.replace("v 0 1 0", "v 0 nan 0")}, None, InputError, "finite"),
        (
            {"0000_00.obj": UNIT.replace("f 1/1 2/2 3/3", "f 1/1 2/2 9/3")},
            None,
            InputError,
            "not there",
        ),
        ({"0000_00.obj": ""}, None, InputError, "is empty"),
    ]
    names = map(str, count())
    assert not unrefused(
        lambda frames, conf: read_folder(make_folder(frames, conf=conf, name=next(names))), cases
    )


def test_a_file_in_place_of_a_folder_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(NotFoundError, match="no such folder"):
        read_folder(tmp_path / "none")


def test_too_many_frames_are_refused_before_they_are_read(
    make_folder: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(folders, "FRAME_LIMIT", 2)
    with pytest.raises(LimitError, match="3 frames"):
        read_folder(make_folder())


@pytest.mark.parametrize(
    ("frames", "word", "frame"),
    [
        ([MILLIMETRES, MILLIMETRES], r"1000 times .*: mm and m mixed\?", 0),
        ([SQUARE.format(w=100)], r"cm and m mixed\?", 0),
        ([SQUARE.format(w=0.001)], r"mm and m mixed\?", 0),
        ([LARGE], "3 times as long", 0),
        ([UNIT, UNIT, MILLIMETRES], r"mm and m mixed\?", 2),
    ],
)
def test_lengths_of_two_units_are_suspected(
    make_folder: Callable[..., Path], frames: list[str], word: str, frame: int
) -> None:
    sequence = read_folder(make_folder({f"{i:04d}_00.obj": text for i, text in enumerate(frames)}))
    with pytest.raises(InputError, match=word) as caught:
        check_units(sequence, where="run")
    assert caught.value.where == f"run, frame {frame}"


def test_a_named_unit_makes_them_metres(make_folder: Callable[..., Path]) -> None:
    sequence = read_folder(make_folder({"0000_00.obj": MILLIMETRES}), metre=1e-3)
    check_units(sequence, where="run")
    np.testing.assert_allclose(sequence.positions.max(), 1.0)


def test_a_cloth_of_a_kilometre_is_suspected(make_folder: Callable[..., Path]) -> None:
    text = MILLIMETRES.replace("vt 1 ", "vt 1000 ").replace(" 1\n", " 1000\n")
    with pytest.raises(InputError, match="a cloth of 1000 m"):
        check_units(read_folder(make_folder({"0000_00.obj": text})), where="run")


def test_what_is_odd_is_found_and_kept(make_folder: Callable[..., Path]) -> None:
    odd = UNIT.replace("f 1/1 3/3 4/4", "f 1/1 4/4 3/3") + "v 5 5 5\n"
    more = "f 1/1 2/2 3/3\n" * 3 + "f 1/1 2/2 2/2\n"
    found = {
        f.kind: f.count for f in findings(read_folder(make_folder({"0000_00.obj": odd + more})))
    }
    assert found == {"faces-turned-over": 1, "faces-without-area": 1, "loose-vertices": 1}
    assert findings(read_folder(make_folder(name="clean"))) == ()


def test_a_written_folder_is_read_as_it_was(
    make_folder: Callable[..., Path], tmp_path: Path
) -> None:
    sequence = read_folder(make_folder())
    write_folder(tmp_path / "out", sequence, scene=sequence.attributes["scene"])
    back = read_folder(tmp_path / "out")
    assert isinstance(back, MeshSequence)
    np.testing.assert_array_equal(back.positions, sequence.positions)
    np.testing.assert_array_equal(back.faces, sequence.faces)
    assert back.attributes == sequence.attributes
    with pytest.raises(ConflictError):
        write_folder(tmp_path / "out", sequence, scene=sequence.attributes["scene"])
    with pytest.raises(InputError, match="s apart"):
        write_folder(tmp_path / "late", sequence, scene={"frame_time": 0.05})


@pytest.mark.reference
@pytest.mark.parametrize("name", ["raw_fixed_mesh", "raw_remeshed"])
def test_arcsims_own_folders_come_back_from_a_written_one(
    name: str, reference_data: Path, tmp_path: Path
) -> None:
    sequence = read_folder(reference_data / "arcsim" / name)
    check_units(sequence, where=name)
    assert {one.kind for one in findings(sequence)} == (
        {"topology-changes"} if "remeshed" in name else set()
    )
    write_folder(tmp_path / name, sequence, scene=sequence.attributes["scene"])
    back = read_folder(tmp_path / name)
    for index in range(len(sequence)):
        one, other = sequence.frame(index), back.frame(index)
        for part in ("positions", "faces", "rest", "time"):
            np.testing.assert_array_equal(getattr(one, part), getattr(other, part))


def test_notes_of_an_operating_system_are_no_frames(make_folder: Callable[..., Path]) -> None:
    names = {
        "flag_0.obj": UNIT,
        "flag_1.obj": UNIT,
        "._flag_0.obj": "\0\5",
        "._flag_1.obj": "\0\5",
        ".DS_Store": "1",
    }
    assert [entry.name for _, entry in frame_files(make_folder(names, configured="no"))] == [
        "flag_0.obj",
        "flag_1.obj",
    ]
