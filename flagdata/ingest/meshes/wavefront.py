"""Wavefront OBJ as cloth simulators write it: positions, material coordinates, triangles,
velocities.

Beside `v`, `vt` and `f`, ArcSim writes `nv` (velocity of the vertex before it) and `ny` (its
plastic rest position). Quads and polygons are split into triangles. Normals, groups, materials and
comments are passed over, as in any OBJ reader; lines of an unknown keyword are refused.

Polygons split into triangles: convex ones as fans, others by clipping ears (Meisters, 1975), in
their own plane.
"""

from __future__ import annotations

from array import array
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flagdata.core.arrays import BoolArray, FloatArray, IntArray
from flagdata.core.files.regular_files import check_input
from flagdata.errors import InputError

FACE_CORNERS = 10_000
"""Most corners of a face that is read: what describes a cloth has four or fewer."""
CORNERS = 256
"""Most corners of a polygon that is not convex: the time that it takes grows with their cube."""
_FLAT = 1e-9
"""Twice an area over the squared extent of the polygon below which three corners are in a line."""

Points = FloatArray
Triples = IntArray


def fans(sizes: IntArray) -> tuple[Triples, IntArray]:
    """Polygons of so many corners, whose corners lie one polygon after another, as fans around
    their first corners.

    Returns:
        (triangle, 3) places of corners, and (triangle,) the polygon of each.
    """
    first = np.concatenate([[0], np.cumsum(sizes)[:-1]])
    polygon = np.repeat(np.arange(len(sizes)), sizes - 2)
    begins = np.cumsum(sizes - 2) - (sizes - 2)
    step = np.arange(len(polygon)) - begins[polygon]
    base = first[polygon]
    return np.stack([base, base + step + 1, base + step + 2], axis=1), polygon


def convex(points: Points) -> BoolArray:
    """Checks (polygon,) which of some polygons of equally many corners, (polygon, corner, 2), are
    strictly convex."""
    ahead = np.roll(points, -1, axis=1) - points
    after = np.roll(ahead, -1, axis=1)
    turn = _cross(ahead, after)
    flat = turn * np.sign(turn[:, :1]) <= _FLAT * _extent(points)[:, None]
    # A star turns one way as well, more than once around.
    angle = np.arctan2(turn, (ahead * after).sum(axis=2)).sum(axis=1)
    return ~flat.any(axis=1) & (np.abs(angle) < 3 * np.pi)


def in_plane(points: Points) -> Points:
    """Projects the corners of a polygon in space, (corner, 3), on the plane of its vector area,
    (corner, 2)."""
    spokes = points - points.mean(axis=0)
    normal = np.cross(spokes, np.roll(spokes, -1, axis=0)).sum(axis=0)
    length = float(np.linalg.norm(normal))
    if length == 0:
        return spokes[:, :2] * 0.0
    normal /= length
    u = np.cross(normal, np.eye(3)[int(np.abs(normal).argmin())])
    u /= np.linalg.norm(u)
    return spokes @ np.stack([u, np.cross(normal, u)], axis=1)


def ears(points: Points) -> Triples:
    """Cuts a simple polygon, (corner, 2), into (corner − 2, 3) triangles with its orientation, of
    all its corners.

    Raises:
        ValueError: more corners than `CORNERS`, no area, or edges that cross or touch each other;
            the text says which.
    """
    count = len(points)
    if count > CORNERS:
        raise ValueError(f"it is not convex and has more than {CORNERS} corners")
    doubled = float(_cross(points, np.roll(points, -1, axis=0)).sum())
    flat = _FLAT * float(_extent(points[None])[0])
    if abs(doubled) <= flat:
        raise ValueError("it has no area")
    if _crosses(points):
        raise ValueError("its edges cross or touch each other")
    sign = np.sign(doubled)
    rest, triangles, at = list(range(count)), [], 1
    while len(rest) > 3:
        for step in range(len(rest)):
            corner = (at + step) % len(rest)
            corners = [rest[corner - 1], rest[corner], rest[(corner + 1) % len(rest)]]
            if _is_ear(points, corners, rest, sign=sign, flat=flat):
                break
        else:
            raise ValueError("its corners are too close to a line")
        triangles.append(corners)
        rest.pop(corner)
        at = corner
    return np.array([*triangles, rest], dtype=np.int64)


def _is_ear(
    points: Points, corners: list[int], rest: list[int], *, sign: float, flat: float
) -> bool:
    a, b, c = points[corners]
    if sign * float(_cross(b - a, c - a)) <= flat:
        return False
    other_points = points[[corner for corner in rest if corner not in corners]]
    sides = [
        sign * _cross(end - start, other_points - start) for start, end in ((a, b), (b, c), (c, a))
    ]
    return not (np.stack(sides) >= -flat).all(axis=0).any()


def _crosses(points: Points) -> bool:
    """Checks whether two edges of a polygon have a point in common, beside the corner that
    neighbours share."""
    count = len(points)
    start, end = points, np.roll(points, -1, axis=0)
    along = end - start
    flat = _FLAT * float(_extent(points[None])[0])
    for i in range(count - 1):
        j = np.arange(i + 1, count)
        # Neighbours share a corner; they overlap where the other corner of one lies on the other.
        following, preceding = j == i + 1, (i == 0) & (j == count - 1)
        a, b = _cross(along[i], start[j] - start[i]), _cross(along[i], end[j] - start[i])
        c, d = _cross(along[j], start[i] - start[j]), _cross(along[j], end[i] - start[j])
        proper = (a * b < 0) & (c * d < 0) & ~following & ~preceding
        touching = np.zeros(len(j), dtype=bool)
        for side, point, first, second, shared in (
            (a, start[j], start[i], end[i], following),
            (b, end[j], start[i], end[i], preceding),
            (c, start[i], start[j], end[j], preceding),
            (d, end[i], start[j], end[j], following),
        ):
            between = ((point - first) * (point - second)).sum(axis=-1) <= 0
            touching |= (np.abs(side) <= flat) & between & ~shared
        if (proper | touching).any():
            return True
    return False


def _cross(a: Points, b: Points) -> Points:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _extent(points: Points) -> Points:
    """Computes (polygon,) the squared diagonal of the box around each."""
    return (np.ptp(points, axis=1) ** 2).sum(axis=-1)


SIZE_LIMIT = 1 << 30
"""Largest file that is read [B]."""

_NOWHERE = 1 << 40
"""An index beyond those of any file that is read."""

# Keywords of the format (and of ArcSim's dialect) that carry nothing this reader keeps.
_PASSED_OVER = frozenset(
    {"vn", "vp", "g", "o", "s", "l", "e", "usemtl", "mtllib", "ny", "ms", "tm", "tl", "te", "tf"}
)


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

    positions: FloatArray
    faces: IntArray
    rest: FloatArray
    velocities: FloatArray | None = None
    textured: bool = True


def read_obj(path: Path) -> Obj:
    """Read a mesh. Without `vt`, x and y of the positions are the material coordinates, as in
    ArcSim.

    Raises:
        NotFoundError: no such file.
        LimitError: larger than `SIZE_LIMIT`.
        InputError: a malformed line, indices that do not exist, no faces, a vertex with two
            material coordinates (a seam), or a polygon without area or with edges that cross in the
            material, each with its line.
    """
    check_input(path, noun="mesh file", limit=SIZE_LIMIT)
    positions, texture = (
        array("d"),
        array("d"),
    )  # a list of lists takes ten times the memory of the file
    velocities: dict[int, list[float]] = {}
    corners, sizes, face_lines = array("q"), array("q"), array("q")
    with path.open(encoding="utf-8-sig", errors="replace") as lines:
        for number, line in enumerate(lines, start=1):
            words = line.split("#", 1)[0].split()
            if not words:
                continue
            keyword, values = words[0], words[1:]
            where = f"{path}, line {number}"
            if keyword == "v":
                positions.extend(_numbers(values, 3, where))
            elif keyword == "vt":
                texture.extend(_numbers(values, 2, where))
            elif keyword == "nv":
                if not positions:
                    raise InputError(
                        "a velocity comes before any vertex",
                        where=where,
                        fix="write nv after its v",
                    )
                velocities[len(positions) // 3 - 1] = _numbers(values, 3, where)
            elif keyword == "f":
                if len(values) < 3:
                    raise InputError(
                        "a face has fewer than three corners",
                        where=where,
                        fix="give at least three",
                    )
                if len(values) > FACE_CORNERS:
                    raise InputError(
                        f"a face has {len(values):,} corners, more than the {FACE_CORNERS:,} that "
                        "are read",
                        where=where,
                        fix="triangulate the mesh in the program that made it",
                    )
                for word in values:
                    corners.extend(_corner(word, len(positions) // 3, len(texture) // 2, where))
                sizes.append(len(values))
                face_lines.append(number)
            elif keyword not in _PASSED_OVER:
                raise InputError(
                    f"the keyword {keyword!r} is unknown",
                    where=where,
                    fix="is this a Wavefront OBJ file?",
                )
    if not corners:
        raise InputError("the mesh has no faces", where=str(path), fix="export triangles")
    faces = _Faces(
        path=path,
        corners=np.frombuffer(corners, dtype=np.int64).reshape(-1, 2),
        sizes=np.frombuffer(sizes, dtype=np.int64),
        lines=np.frombuffer(face_lines, dtype=np.int64),
    )
    return _assemble_mesh(
        faces, np.array(positions).reshape(-1, 3), np.array(texture).reshape(-1, 2), velocities
    )


def _numbers(values: list[str], count: int, where: str) -> list[float]:
    try:
        numbers = [float(value) for value in values[:count]]
    except ValueError:
        numbers = []
    if len(numbers) != count or not np.isfinite(numbers).all():
        raise InputError(
            f"{' '.join(values)!r} is not {count} finite numbers",
            where=where,
            fix="correct the line",
        )
    return numbers


def _corner(word: str, vertices: int, textures: int, where: str) -> tuple[int, int]:
    """Reads vertex and texture index of a face's corner, from 1; 0 where there is no texture index.

    Indices below zero count back from the last vertex before the line; those that lead nowhere are
    returned as -1.
    """
    parts = word.split("/")
    try:
        vertex = int(parts[0])
        texture = int(parts[1]) if len(parts) > 1 and parts[1] else 0
    except ValueError:
        raise InputError(
            f"{word!r} is not a corner", where=where, fix="write v, v/vt or v/vt/vn"
        ) from None
    if vertex < 0:
        vertex = max(vertices + 1 + vertex, 0) or -1
    if texture < 0:
        texture = max(textures + 1 + texture, 0) or -1
    return min(vertex, _NOWHERE), min(texture, _NOWHERE)


@dataclass(frozen=True, kw_only=True)
class _Faces:
    """Faces of a file as they stand there.

    Attributes:
        corners: (corner, 2) vertex and texture indices, from 1, of one face after another.
        sizes: (face,) how many corners each has.
        lines: (face,) its line in the file.
    """

    path: Path
    corners: IntArray
    sizes: IntArray
    lines: IntArray

    def refuse(self, corners: BoolArray, text: str, *, fix: str) -> None:
        """Refuse the first face that has one of some corners.

        Raises:
            InputError: there is one.
        """
        if corners.any():
            face = int(np.repeat(np.arange(len(self.sizes)), self.sizes)[int(corners.argmax())])
            raise InputError(text, where=f"{self.path}, line {self.lines[face]}", fix=fix)

    def triangles(self, points: FloatArray) -> IntArray:
        """Splits each face in the plane of its corners, (corner, 2) or (corner, 3), into triangles:
        (triangle, 3) places of corners.

        Raises:
            InputError: a face of four corners or more has no area there, or edges that cross.
        """
        places, _ = fans(self.sizes)
        ends = np.cumsum(self.sizes)
        splits = np.cumsum(self.sizes - 2)
        for size in np.unique(self.sizes[self.sizes > 3]):
            faces = np.flatnonzero(self.sizes == size)
            polygons = points[(ends[faces] - size)[:, None] + np.arange(size)]
            flat = (
                polygons
                if points.shape[1] == 2
                else np.stack([in_plane(polygon) for polygon in polygons])
            )
            for index in np.flatnonzero(~convex(flat)):
                face = faces[index]
                try:
                    split = ears(flat[index])
                except ValueError as error:
                    raise InputError(
                        f"a face of {size} corners cannot be split: {error}",
                        where=f"{self.path}, line {self.lines[face]}",
                        fix="triangulate the mesh in the program that made it",
                    ) from None
                places[splits[face] - (size - 2) : splits[face]] = split + (ends[face] - size)
        return places


def _assemble_mesh(
    faces: _Faces, positions: FloatArray, texture: FloatArray, velocities: dict[int, list[float]]
) -> Obj:
    counts = np.array([len(positions), len(texture)])
    wrong = (
        (faces.corners[:, 0] < 1) | (faces.corners > counts).any(axis=1) | (faces.corners[:, 1] < 0)
    )
    faces.refuse(wrong, "a corner names what is not there", fix="correct the face")
    vertex, uv = faces.corners[:, 0] - 1, faces.corners[:, 1] - 1
    textured = bool((uv >= 0).all())
    if textured:
        rest = np.full((len(positions), 2), np.nan)
        rest[vertex[::-1]] = texture[
            uv[::-1]
        ]  # the first mention counts, so that a seam keeps its place
        faces.refuse(
            (texture[uv] != rest[vertex]).any(axis=1),
            "a vertex has two material coordinates: a seam, which is not supported",
            fix="split the vertices along the seam, or export one panel",
        )
        rest[np.isnan(rest).any(axis=1)] = 0.0  # no face uses them
        triangles = faces.triangles(rest[vertex])
    elif (uv < 0).all():
        rest = positions[:, :2]
        triangles = faces.triangles(positions[vertex])
    else:
        raise InputError(
            "some corners have material coordinates, others not",
            where=str(faces.path),
            fix="give all or none",
        )
    speed = None
    if velocities:
        speed = np.zeros((len(positions), 3))
        speed[list(velocities)] = list(velocities.values())
    return Obj(
        positions=positions, faces=vertex[triangles], rest=rest, velocities=speed, textured=textured
    )


def write_obj(path: Path, mesh: Obj) -> None:
    """Write a mesh into a new file, see `obj_text`; raises as
    `flagdata.core.files.outputs.write_file`."""
    from flagdata.core.files.outputs import write_file

    write_file(path, obj_text(mesh))


def obj_text(mesh: Obj) -> str:
    """Writes a mesh as ArcSim does: all `vt`, each `v` with its `nv` where there are velocities,
    `f` as v/vt.

    Nine significant digits: float32 values come back exactly.
    """
    lines = [f"vt {u:.9g} {v:.9g}" for u, v in mesh.rest]
    for index, (x, y, z) in enumerate(mesh.positions):
        lines.append(f"v {x:.9g} {y:.9g} {z:.9g}")
        if mesh.velocities is not None:
            vx, vy, vz = mesh.velocities[index]
            lines.append(f"nv {vx:.9g} {vy:.9g} {vz:.9g}")
    lines += [f"f {a}/{a} {b}/{b} {c}/{c}" for a, b, c in mesh.faces + 1]
    return "\n".join(lines) + "\n"
