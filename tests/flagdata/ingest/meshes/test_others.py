"""Meshes of other formats are named as what they are, and what the message asks for is read."""

from __future__ import annotations

import re
import struct
from pathlib import Path

import pytest

from flagdata.errors import FlagdataError
from flagdata.ingest import classify, read_folder
from flagdata.ingest.meshes.others import format_of
from tests.flagdata.ingest.meshes.conftest import square

STL = (
    b"solid flag".ljust(80) + struct.pack("<I", 1) + struct.pack("<12fH", *[0.0] * 12, 0)
)  # binary all the same
FILES = {
    "s.stl": (STL, "STL"),
    "s.STL": (b"solid x\nfacet normal 0 0 1\nendsolid\n", "STL"),
    "s.ply": (b"ply\nformat ascii 1.0\nelement vertex 3\nend_header\n0 0 0\n1 0 0\n0 1 0\n", "PLY"),
    "s.off": (b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "OFF"),
    "s.glb": (b"glTF\2\0\0\0\x14\0\0\0" + bytes(8), "glTF"),
    "s.gltf": (b'{"asset": {"version": "2.0"}}', "glTF"),
    "s.abc": (b"Ogawa\xff\0\1" + bytes(50), "Alembic"),
    "s.fbx": (b"Kaydara FBX Binary  \0" + bytes(50), "FBX"),
    "s.usda": (b"#usda 1.0\n", "USD"),
    "s.vtk": (b"# vtk DataFile Version 3.0\n", "VTK"),
    "s.dae": (b'<?xml version="1.0"?><COLLADA/>', "COLLADA"),
    "renamed.bin": (b"glTF\2\0\0\0\x14\0\0\0" + bytes(8), "glTF"),
}


@pytest.mark.parametrize(
    ("name", "content", "known"), [(name, *rest) for name, rest in FILES.items()]
)
def test_a_file_and_its_folder_are_refused_by_their_format_with_the_way_to_obj(
    tmp_path: Path, name: str, content: bytes, known: str
) -> None:
    folder = tmp_path / "run"
    folder.mkdir()
    for number in range(3):
        (folder / f"{number}{name}").write_bytes(content)
    sources = [folder / f"0{name}"] + ([folder] if format_of(name) else [])
    for source in sources:
        with pytest.raises(FlagdataError) as refused:
            classify(source)
        assert known in refused.value.what
        assert "Wavefront OBJ" in refused.value.fix
        assert "the folder it is in" not in refused.value.fix


def test_what_the_message_asks_for_is_read(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    folder.mkdir()
    for number in range(3):
        (folder / f"flag.{number:03d}.obj").write_text(square(lift=0.01 * number))
    assert classify(folder).kind == "meshes"
    assert len(read_folder(folder, rate=25)) == 3


def test_obj_files_beside_other_meshes_are_read(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / "flag_0.obj").write_text(square())
    (folder / "flag_0.mtl").write_text("newmtl a\n")
    (folder / "flag.blend").write_bytes(b"BLENDER-v300")
    assert classify(folder).kind == "meshes"


def test_a_folder_given_as_meshes_without_obj_files_leads_to_what_is_read(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / "a.stl").write_bytes(STL)
    with pytest.raises(FlagdataError, match=re.escape("no .obj files")) as refused:
        read_folder(folder, rate=25)
    assert "Wavefront OBJ" in refused.value.fix
