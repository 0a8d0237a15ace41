"""Mesh files of other formats than Wavefront OBJ: named as what they are, with the way to a folder
that is read."""

from __future__ import annotations

from pathlib import PurePath

_NAMES = {
    ".3ds": "3D Studio",
    ".3mf": "3MF",
    ".abc": "Alembic",
    ".bgeo": "Houdini",
    ".blend": "Blender",
    ".c4d": "Cinema 4D",
    ".dae": "COLLADA",
    ".e57": "E57",
    ".fbx": "FBX",
    ".glb": "glTF",
    ".gltf": "glTF",
    ".ma": "Maya",
    ".mb": "Maya",
    ".mdd": "MDD point cache",
    ".off": "OFF",
    ".pc2": "PC2 point cache",
    ".pcd": "PCD point cloud",
    ".ply": "PLY",
    ".stl": "STL",
    ".usd": "USD",
    ".usda": "USD",
    ".usdc": "USD",
    ".usdz": "USD",
    ".vtk": "VTK",
    ".vtp": "VTK",
    ".vtu": "VTK",
    ".wrl": "VRML",
    ".x3d": "X3D",
}
_HEADS = {
    b"glTF": "glTF",
    b"Ogawa": "Alembic",
    b"ply\n": "PLY",
    b"ply\r": "PLY",
    b"Kaydara FBX": "FBX",
}
_HEADS |= {
    b"BLENDER": "Blender",
    b"PXR-USDC": "USD",
    b"#usda": "USD",
    b"# vtk DataFile": "VTK",
    b"POINTCACHE2": "PC2",
}

FIX = (
    "meshes are read as Wavefront OBJ: export one .obj a frame, with texture coordinates in "
    "metres, into a folder, and "
    "ingest that folder"
)


def format_of(name: str, head: bytes = b"") -> str | None:
    """Return the format of a mesh file that is not OBJ, by its name or its first bytes; None of any
    other file."""
    by_name = _NAMES.get(PurePath(name).suffix.lower())
    return by_name or next(
        (format_name for begin, format_name in _HEADS.items() if head.startswith(begin)), None
    )
