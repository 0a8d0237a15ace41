"""Wavefront OBJ as cloth simulators write it: positions, material coordinates, triangles, velocities.

Beside `v`, `vt` and `f`, ArcSim writes `nv` (velocity of the vertex before it) and `ny` (its plastic rest position).
Quads and polygons are split into fans. Normals, groups, materials and comments are passed over, as in any OBJ reader;
lines of an unknown keyword are refused.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import InputError, LimitError, NotFoundError

SIZE_LIMIT = 1 << 30
"""Largest file that is read [B]."""

# Keywords of the format (and of ArcSim's dialect) that carry nothing this reader keeps.
_PASSED_OVER = frozenset({"vn", "vp", "g", "o", "s", "l", "e", "usemtl", "mtllib", "ny", "ms", "tm", "tl", "te", "tf"})


@dataclass(frozen=True, kw_only=True)
class Obj:
    """A triangle mesh in space.

    Attributes:
        positions: (vertex, 3) [m].
        faces: (face, 3) indices.
        rest: (vertex, 2) material coordinates [m].
        velocities: (vertex, 3) [m/s], or None where the file has none.
        textured: whether `rest` was given (`vt`), and not taken from x and y.
    """

    positions: NDArray[np.float64]
    faces: NDArray[np.int64]
    rest: NDArray[np.float64]
    velocities: NDArray[np.float64] | None = None
    textured: bool = True


def read_obj(path: Path) -> Obj:
    """Read a mesh. Without `vt`, x and y of the positions are the material coordinates, as in ArcSim.

    Raises:
        NotFoundError: no such file.
        LimitError: larger than `SIZE_LIMIT`.
        InputError: a malformed line, indices that do not exist, no faces, or a vertex with two material coordinates (a
            seam), each with its line.
    """
    if not path.is_file():
        raise NotFoundError("no such mesh file", where=str(path), fix="check the path")
    if path.stat().st_size > SIZE_LIMIT:
        raise LimitError(
            f"a mesh file of {path.stat().st_size} bytes", where=str(path), fix=f"at most {SIZE_LIMIT} are read"
        )
    positions: list[list[float]] = []
    texture: list[list[float]] = []
    velocities: dict[int, list[float]] = {}
    corners: list[tuple[int, int]] = []
    corner_lines: list[int] = []
    with path.open(encoding="utf-8", errors="replace") as lines:
        for number, line in enumerate(lines, start=1):
            words = line.split("#", 1)[0].split()
            if not words:
                continue
            keyword, values = words[0], words[1:]
            where = f"{path}, line {number}"
            if keyword == "v":
                positions.append(_numbers(values, 3, where))
            elif keyword == "vt":
                texture.append(_numbers(values, 2, where))
            elif keyword == "nv":
                if not positions:
                    raise InputError("a velocity before any vertex", where=where, fix="write nv after its v")
                velocities[len(positions) - 1] = _numbers(values, 3, where)
            elif keyword == "f":
                polygon = [_corner(word, where) for word in values]
                if len(polygon) < 3:
                    raise InputError("a face of fewer than three corners", where=where, fix="give at least three")
                for i in range(1, len(polygon) - 1):
                    corners += [polygon[0], polygon[i], polygon[i + 1]]
                    corner_lines.append(number)
            elif keyword not in _PASSED_OVER:
                raise InputError(f"unknown keyword {keyword!r}", where=where, fix="is this a Wavefront OBJ file?")
    return _assembled(path, positions, texture, velocities, corners, corner_lines)


def _numbers(values: list[str], count: int, where: str) -> list[float]:
    try:
        numbers = [float(value) for value in values[:count]]
    except ValueError:
        numbers = []
    if len(numbers) != count or not np.isfinite(numbers).all():
        raise InputError(f"{' '.join(values)!r} is not {count} finite numbers", where=where, fix="correct the line")
    return numbers


def _corner(word: str, where: str) -> tuple[int, int]:
    """Vertex and texture index of a face's corner, from 1; 0 where there is no texture index."""
    parts = word.split("/")
    try:
        vertex = int(parts[0])
        texture = int(parts[1]) if len(parts) > 1 and parts[1] else 0
    except ValueError:
        raise InputError(f"{word!r} is not a corner", where=where, fix="write v, v/vt or v/vt/vn") from None
    return vertex, texture


def _assembled(
    path: Path,
    positions: list[list[float]],
    texture: list[list[float]],
    velocities: dict[int, list[float]],
    corners: list[tuple[int, int]],
    corner_lines: list[int],
) -> Obj:
    if not corners:
        raise InputError("a mesh without faces", where=str(path), fix="export triangles")
    pairs = np.array(corners, dtype=np.int64)
    counts = np.array([len(positions), len(texture)])
    pairs = np.where(pairs < 0, counts + 1 + pairs, pairs)  # negative indices count from the end
    wrong = (pairs[:, 0] < 1) | (pairs > counts).any(axis=1) | (pairs[:, 1] < 0)
    if wrong.any():
        line = corner_lines[int(np.flatnonzero(wrong)[0]) // 3]
        raise InputError("a corner names what is not there", where=f"{path}, line {line}", fix="correct the face")
    vertex, uv = pairs[:, 0] - 1, pairs[:, 1] - 1
    if (uv >= 0).all():
        rest = np.full((len(positions), 2), np.nan)
        rest[vertex[::-1]] = np.array(texture)[uv[::-1]]  # the first mention counts, so that a seam is told where it is
        seam = (np.array(texture)[uv] != rest[vertex]).any(axis=1)
        if seam.any():
            line = corner_lines[int(np.flatnonzero(seam)[0]) // 3]
            raise InputError(
                "a vertex has two material coordinates: a seam, which is not supported",
                where=f"{path}, line {line}", fix="split the vertices along the seam, or export one panel",
            )  # fmt: skip
        unused = np.isnan(rest).any(axis=1)
        rest[unused] = 0.0
    elif (uv < 0).all():
        rest = np.array(positions)[:, :2]
    else:
        raise InputError("some corners have material coordinates, others not", where=str(path), fix="give all or none")
    speed = None
    if velocities:
        speed = np.zeros((len(positions), 3))
        speed[list(velocities)] = list(velocities.values())
    return Obj(
        positions=np.array(positions), faces=vertex.reshape(-1, 3), rest=rest, velocities=speed,
        textured=bool((uv >= 0).all()),
    )  # fmt: skip


def write_obj(path: Path, mesh: Obj) -> None:
    """Write a mesh as ArcSim does: all `vt`, each `v` with its `nv` where there are velocities, `f` as v/vt.

    Nine significant digits: float32 values come back exactly.
    """
    lines = [f"vt {u:.9g} {v:.9g}" for u, v in mesh.rest]
    for index, (x, y, z) in enumerate(mesh.positions):
        lines.append(f"v {x:.9g} {y:.9g} {z:.9g}")
        if mesh.velocities is not None:
            vx, vy, vz = mesh.velocities[index]
            lines.append(f"nv {vx:.9g} {vy:.9g} {vz:.9g}")
    lines += [f"f {a}/{a} {b}/{b} {c}/{c}" for a, b, c in mesh.faces + 1]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
