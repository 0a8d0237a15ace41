"""From a folder of meshes to an artifact of the lake: read, checked, written as one Zarr sequence,
published.

Checked are errors that the numbers of a sequence show: units, scale, faces turned over, and

- T-joints: a vertex on an edge of a face that does not have it as a corner. Where one side of a
  line was subdivided and the other was not, the cloth looks whole and is open: the two sides share
  no edge, so that no force crosses it and it opens as soon as it is simulated.
- whether frames are of one cloth in motion: vertices that change places, jumps, a topology that
  changes. Programs that export each frame by itself may number vertices anew. Then one row of the
  positions is two points of the cloth, and whatever is measured along time is of neither.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from flagdata.core.arrays import FloatArray, IntArray
from flagdata.core.files.durable import disk_errors
from flagdata.core.findings import Finding, Severity, quality_flags
from flagdata.core.json_values import json_values
from flagdata.core.provenance import canonical
from flagdata.core.schema import Kind
from flagdata.core.units import unit
from flagdata.errors import InputError, UsageError
from flagdata.ingest.artifacts_present import IngestResult, Labels, find, kept, result_of
from flagdata.ingest.ingest_report import REPORT_SCHEMA
from flagdata.ingest.meshes.folder import read_folder
from flagdata.ingest.meshes.pieces import in_pieces, slits, weld_vertices
from flagdata.ingest.source_file import Source
from flagdata.lake import Artifact, Lake
from flagdata.lake.mesh_sequences import Mesh, MeshSequence, RaggedMeshSequence, write_meshes
from flagdata.timebase import NANOSECONDS


@dataclass(frozen=True, kw_only=True)
class MeshIngest:
    """All that shapes a mesh artifact.

    Attributes:
        rate: frames a second [Hz]; None for that of conf.json.
        unit: of the positions, a length; texture coordinates are metres.

    Raises:
        UsageError: an impossible rate, or a unit that is no length.
    """

    rate: float | None = None
    unit: str = "m"

    def __post_init__(self) -> None:
        if self.rate is not None and not (math.isfinite(self.rate) and 0 < self.rate <= 1e6):
            raise UsageError(
                f"the frame rate {self.rate!r} Hz is out of range",
                where="--rate",
                fix="give frames a second",
            )
        if unit(self.unit).si != "m":
            raise UsageError(
                f"{self.unit!r} is no unit of length", where="--unit", fix="give mm, cm, m or ft"
            )

    def recipe(self) -> dict[str, Any]:
        return {"ingest": "meshes", "rate": self.rate, "unit": self.unit}


def ingest_meshes(
    lake: Lake,
    path: Path,
    options: MeshIngest | None = None,
    *,
    labels: Labels | None = None,
    branch: str = "main",
    reasons: Sequence[str] = (),
    progress: Callable[[int], object] | None = None,
) -> IngestResult:
    """Ingest a folder of OBJ meshes, one a frame; ArcSim's output folders with the scene that made
    them.

    Vertices that are the same in the texture and in every frame are merged, see `welded`; other
    pieces are reported.

    Args:
        reasons: why the folder is taken to be meshes, for the report.
        progress: called with 1 for each frame read.

    Raises:
        FlagdataError: as `read_folder` and `check_units`; the lake is unchanged.
        ConflictError: a file changed while the folder was read, or the folder is in the lake under
            other labels.
    """
    options, labels = options or MeshIngest(), labels or Labels()
    source = Source.of(path)
    recipe = options.recipe()
    artifact_in_lake = find(lake, Kind.MESHES, source, recipe, labels, branch=branch).whole
    if artifact_in_lake is not None:
        return kept(artifact_in_lake)
    metre = float(unit(options.unit).to_si(1.0))
    sequence = read_folder(path, rate=options.rate, metre=metre, progress=progress)
    check_units(sequence, where=str(path))
    sequence, merged = weld_vertices(sequence)
    all_findings = (*merged, *findings(sequence))
    source.check_unchanged()
    parameters = scene_wind(sequence.attributes.get("scene"))
    report = _report(sequence, all_findings, reasons)
    with lake.transaction(f"ingest meshes {source.name}", branch=branch) as transaction:
        staged = transaction.staging(".zarr")
        with disk_errors("writing meshes", staged):
            write_meshes(staged, sequence)
        artifact = Artifact(
            kind=Kind.MESHES,
            name=labels.name or source.name,
            object=transaction.put(staged),
            source_hash=source.hash,
            source_name=source.name,
            recipe=recipe,
            session=labels.session,
            frame_count=len(sequence),
            rate=report["rate"],
            wind=math.hypot(parameters["wind_x"], parameters["wind_y"]) if parameters else None,
            parameters=canonical(parameters) if parameters else None,
            quality=quality_flags(all_findings),
            report=json.dumps(report, allow_nan=False, ensure_ascii=False),
        )
        transaction.add(artifact)
    return result_of(transaction, artifact, report, labels)


def scene_wind(scene: Any) -> dict[str, float] | None:
    """Reads the wind of an ArcSim scene, where the air goes to [m/s]; None where the scene gives
    none that can be read."""
    wind = scene.get("wind") if isinstance(scene, Mapping) else None
    velocity = wind.get("velocity") if isinstance(wind, Mapping) else None
    if not isinstance(velocity, list) or len(velocity) != 3:
        return None
    if not all(
        isinstance(v, int | float) and not isinstance(v, bool) and math.isfinite(v)
        for v in velocity
    ):
        return None
    return dict(zip(("wind_x", "wind_y", "wind_z"), map(float, velocity), strict=True))


def _report(
    sequence: MeshSequence | RaggedMeshSequence,
    all_findings: Sequence[Finding],
    reasons: Sequence[str],
) -> dict[str, Any]:
    """Counts, times since the start of the simulation, and findings."""
    if isinstance(sequence, MeshSequence):
        vertices, faces = np.array([sequence.positions.shape[1]]), np.array([len(sequence.faces)])
    else:
        vertices, faces = np.diff(sequence.vertex_offset), np.diff(sequence.face_offset)
    span = (int(sequence.time[-1]) - int(sequence.time[0])) / NANOSECONDS
    return {
        "schema": REPORT_SCHEMA,
        "kind": Kind.MESHES.value,
        "format": str(sequence.attributes["source"]),
        "reasons": list(reasons),
        "frames": len(sequence),
        "first": int(sequence.time[0]) / NANOSECONDS,
        "span": span,
        "rate": (len(sequence) - 1) / span if span else None,
        "topology": "fixed" if isinstance(sequence, MeshSequence) else "remeshed",
        "vertices": [int(vertices.min()), int(vertices.max())],
        "faces": [int(faces.min()), int(faces.max())],
        "findings": json_values(all_findings),
    }


_STRETCHED = 1.5
"""Ratio of an edge's length in space to its length at rest above which it is not cloth: knits tear
at 1.3 to 1.5, and a vertex that takes its neighbour's place doubles an edge."""
_SUDDEN = 10.0
"""A frame has jumped if its vertices move more than this many times their usual way between frames,
and more than `_FAR` of the cloth's size: both must hold."""
_FAR = 0.2
"""Share of the cloth's size, see `_SUDDEN`."""


def continuity(sequence: MeshSequence | RaggedMeshSequence) -> tuple[Finding, ...]:
    """Return what speaks against one cloth in motion: `edges-stretched`, `cloth-jumps`,
    `topology-changes`."""
    return (*_stretched_findings(sequence), *_jumps(sequence), *_changes(sequence))


def _stretched_findings(sequence: MeshSequence | RaggedMeshSequence) -> Iterator[Finding]:
    counts = np.array([_long_edges(sequence.frame(index)) for index in range(len(sequence))])
    worst = int(counts.argmax())
    if not counts[worst]:
        return
    where = np.flatnonzero(counts)
    frames = (
        f"frame {where[0]}"
        if len(where) == 1
        else f"{len(where)} frames, the first frame {where[0]}"
    )
    yield Finding.of(
        "edges-stretched",
        f"{counts[worst]} edges are more than {_STRETCHED:g} times as long as in the material "
        f"({frames}): "
        "vertices that change places, a tear, or texture coordinates that are not the cloth's own "
        "lengths",
        count=int(counts[worst]),
        where=f"frame {worst}",
        fix="export all frames with the vertices in one order, and texture coordinates in metres",
    )


def _long_edges(mesh: Mesh) -> int:
    edges = np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]])
    edges = np.unique(np.sort(edges, axis=1), axis=0)
    space, rest = (
        np.linalg.norm(np.diff(points[edges].astype(np.float64), axis=1)[:, 0], axis=1)
        for points in (mesh.positions, mesh.rest)
    )
    return int((space > _STRETCHED * rest)[rest > 0].sum())


def _jumps(sequence: MeshSequence | RaggedMeshSequence) -> Iterator[Finding]:
    if isinstance(sequence, RaggedMeshSequence) or len(sequence) < 4:
        return
    used = np.unique(sequence.faces)
    places = sequence.positions[:, used].astype(np.float64)
    ways = np.median(np.linalg.norm(np.diff(places, axis=0), axis=2), axis=1)
    size = float(np.linalg.norm(np.ptp(sequence.rest[used].astype(np.float64), axis=0)))
    usual = float(np.median(ways))
    sudden: IntArray = np.flatnonzero((ways > _SUDDEN * usual) & (ways > _FAR * size))
    if len(sudden):
        first = int(sudden[0])
        yield Finding.of(
            "cloth-jumps",
            f"half of the vertices move {ways[first]:.3g} m or more from frame {first} to frame "
            f"{first + 1}, and "
            f"{usual:.2g} m between others: vertices that are numbered anew, or frames of another "
            "run",
            count=len(sudden),
            where=f"frame {first + 1}",
            value=float(ways[first]),
            fix="export all frames of one run, with the vertices in one order",
        )


def _changes(sequence: MeshSequence | RaggedMeshSequence) -> Iterator[Finding]:
    if isinstance(sequence, MeshSequence):
        return
    vertices, faces = np.diff(sequence.vertex_offset), np.diff(sequence.face_offset)
    frames = [sequence.frame(index) for index in range(len(sequence))]
    changed = [
        index
        for index in range(1, len(frames))
        if not (
            np.array_equal(frames[index].faces, frames[index - 1].faces)
            and np.array_equal(frames[index].rest, frames[index - 1].rest)
        )
    ]
    yield Finding.of(
        "topology-changes",
        f"the mesh changes at {len(changed)} of {len(frames) - 1} frames: {vertices.min()} to "
        f"{vertices.max()} "
        f"vertices, {faces.min()} to {faces.max()} faces",
        count=len(changed),
        where=f"frame {changed[0]}",
        fix="none needed, if the simulator remeshes; else export all frames with one mesh",
    )


# distance from the edge in the material, in edge lengths; exporters keep four digits or more
_ON_THE_LINE = 1e-3
# the same in space, along the edge too: cloth stretches, and bends away from an edge's middle
_NEAR = 0.1
_WITHIN = 1e-2  # from an edge's ends, in edge lengths


def t_joints(sequence: MeshSequence | RaggedMeshSequence) -> tuple[Finding, ...]:
    """Reports vertices that lie on open edges of other faces, of the frame with most of them."""
    frames = range(1) if isinstance(sequence, MeshSequence) else range(len(sequence))
    joints = [_joints(sequence.frame(index)) for index in frames]
    worst = max(frames, key=lambda index: len(joints[index]), default=0)
    if not joints or not len(joints[worst]):
        return ()
    first = int(joints[worst][0])
    return (
        Finding.of(
            "t-joints",
            f"{len(joints[worst])} vertices lie on an edge of a face that they are no corner of "
            "(the first is "
            f"vertex {first}): the cloth is open there",
            count=len(joints[worst]),
            where=f"frame {worst}",
            fix="split those faces at the vertex, or subdivide both sides alike, and export it "
            "anew",
        ),
    )


def _joints(mesh: Mesh) -> IntArray:
    """Numbers of the vertices on the inside of an edge that only one face has, in the material and
    in space."""
    edges = np.sort(
        np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]]),
        axis=1,
    )
    edges, counts = np.unique(edges, axis=0, return_counts=True)
    border = edges[counts == 1]
    corners = np.unique(border).astype(np.int64)
    if not len(corners):
        return corners
    rest, space = mesh.rest.astype(np.float64), mesh.positions.astype(np.float64)
    ends = rest[border]
    half = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) / 2
    neighbours = KDTree(rest[corners]).query_ball_point(ends.mean(axis=1), half)
    number = np.repeat(np.arange(len(border)), [len(of_edge) for of_edge in neighbours])
    vertex = corners[
        np.concatenate([np.asarray(of_edge, dtype=np.int64) for of_edge in neighbours])
    ]
    first, last = border[number].astype(np.int64).T
    along, off = _along(rest, vertex, first, last)
    along_in_space, off_in_space = _along(space, vertex, first, last)
    inside = (
        (off < _ON_THE_LINE) & (off_in_space < _NEAR) & (np.abs(along_in_space - along) < _NEAR)
    )
    for share in (along, along_in_space):
        inside &= (share > _WITHIN) & (share < 1 - _WITHIN)
    return np.unique(vertex[inside])


def _along(
    positions: FloatArray, vertex: IntArray, first: IntArray, last: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Computes where vertices lie along edges, 0 at the first end and 1 at the last, and how far
    beside, in edge lengths."""
    edge, arm = positions[last] - positions[first], positions[vertex] - positions[first]
    square = np.maximum((edge**2).sum(axis=1), np.finfo(np.float64).tiny)
    along = (edge * arm).sum(axis=1) / square
    return along, np.linalg.norm(arm - along[:, None] * edge, axis=1) / np.sqrt(square)


# Median edge length in space over that in the material. Cloth stretches and crumples by some per
# cent; a factor of two is beyond any, and below the steps between units that are mixed up (2.54,
# 10, 12, 100, 1000).
_MIXED = 2.0
# Sizes of cloth that is filmed or simulated [m].
_SMALLEST, _LARGEST = 0.01, 100.0
_UNITS = {
    1e3: "mm and m",
    1e2: "cm and m",
    10.0: "mm and cm",
    39.37: "inches and m",
    3.281: "feet and m",
}


def check_units(sequence: MeshSequence | RaggedMeshSequence, *, where: str) -> None:
    """Refuse lengths that cannot be metres in space and in the material.

    Raises:
        InputError: edges much longer or shorter in space than at rest, in the first frame or from
            some frame on; or a cloth smaller than 1 cm or larger than 100 m.
    """
    for index in range(len(sequence)):
        ratio = _edge_ratio(sequence.frame(index))
        if not 1 / _MIXED < ratio < _MIXED:
            raise InputError(
                f"edges are {ratio:.4g} times as long in space as in the material "
                f"coordinates{_likely(ratio)}",
                where=f"{where}, frame {index}",
                fix="name the unit of the positions by --unit and let texture coordinates be "
                "metres, or export it anew",
            )
    rest = sequence.frame(0).rest
    size = float(np.max(rest.max(axis=0) - rest.min(axis=0)))
    if not _SMALLEST <= size <= _LARGEST:
        raise InputError(
            f"a cloth of {size:.4g} m by its texture coordinates, which are its shape at rest in "
            "metres",
            where=where,
            fix="export it with texture coordinates in metres",
        )


def findings(sequence: MeshSequence | RaggedMeshSequence) -> tuple[Finding, ...]:
    """Reports what is odd and was kept: faces turned over or without area in the material, vertices
    of no face, vertices that change places, pieces, slits and T-joints."""
    flipped = degenerate = loose = 0
    first: dict[str, int] = {}
    frames = range(1) if isinstance(sequence, MeshSequence) else range(len(sequence))
    areas = [
        _doubled_areas(mesh.rest.astype(np.float64), mesh.faces)
        for mesh in map(sequence.frame, frames)
    ]
    main = np.sign(np.median([np.median(doubled) for doubled in areas])) or 1.0
    for index, doubled in zip(frames, areas, strict=True):
        mesh = sequence.frame(index)
        scale = float(np.abs(doubled).mean()) or 1.0
        counts = {
            "faces-turned-over": int((doubled * main < -1e-6 * scale).sum()),
            "faces-without-area": int((np.abs(doubled) <= 1e-6 * scale).sum()),
            "loose-vertices": len(mesh.rest) - len(np.unique(mesh.faces)),
        }
        flipped += counts["faces-turned-over"]
        degenerate += counts["faces-without-area"]
        loose += counts["loose-vertices"]
        for kind, count in counts.items():
            if count:
                first.setdefault(kind, index)
    kinds = (
        ("faces-turned-over", flipped, "faces lie the other way round in the material than most"),
        ("faces-without-area", degenerate, "faces have no area in the material"),
        ("loose-vertices", loose, "vertices belong to no face"),
    )
    odd = tuple(
        Finding(
            kind=kind,
            severity=Severity.WARNING,
            what=f"{count} {message}",
            count=count,
            where=f"frame {first[kind]}",
            fix="look at the export's texture coordinates",
        )
        for kind, count, message in kinds
        if count
    )
    return (
        *odd,
        *continuity(sequence),
        *in_pieces(sequence),
        *slits(sequence),
        *t_joints(sequence),
    )


def _edge_ratio(mesh: Mesh) -> float:
    edges = np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]])
    space = np.linalg.norm(np.diff(mesh.positions[edges].astype(np.float64), axis=1)[:, 0], axis=1)
    rest = np.linalg.norm(np.diff(mesh.rest[edges].astype(np.float64), axis=1)[:, 0], axis=1)
    has_length = rest > 0
    return (
        float(np.median(space[has_length] / rest[has_length])) if has_length.any() else float("inf")
    )


def _likely(ratio: float) -> str:
    for factor, units in _UNITS.items():
        for value in (factor, 1 / factor):
            if 0.8 < ratio / value < 1.25:
                return f": {units} mixed?"
    return ""


def _doubled_areas(rest: FloatArray, faces: NDArray[np.int32]) -> FloatArray:
    a, b, c = (rest[faces[:, i]] for i in range(3))
    return (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
