"""Errors of a mesh sequence that its own numbers show: units, scale, faces turned over."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import InputError
from flagdata.findings import Finding, Severity
from flagdata.ingest.meshes.continuity import continuity
from flagdata.ingest.meshes.joints import t_joints
from flagdata.ingest.meshes.pieces import in_pieces, slits
from flagdata.lake.meshes import Mesh, MeshSequence, RaggedMeshSequence

# Median edge length in space over that in the material. Cloth stretches and crumples by some per cent; a factor of two
# is beyond any, and below the steps between units that are mixed up (2.54, 10, 12, 100, 1000).
_MIXED = 2.0
# Sizes of cloth that is filmed or simulated [m].
_SMALLEST, _LARGEST = 0.01, 100.0
_UNITS = {1e3: "mm and m", 1e2: "cm and m", 10.0: "mm and cm", 39.37: "inches and m", 3.281: "feet and m"}


def check_units(sequence: MeshSequence | RaggedMeshSequence, *, where: str) -> None:
    """Refuse lengths that cannot be metres in space and in the material.

    Raises:
        InputError: edges much longer or shorter in space than at rest, in the first frame or from some frame on; or a
            cloth smaller than 1 cm or larger than 100 m.
    """
    for index in range(len(sequence)):
        ratio = _edge_ratio(sequence.frame(index))
        if not 1 / _MIXED < ratio < _MIXED:
            raise InputError(
                f"edges are {ratio:.4g} times as long in space as in the material coordinates{_likely(ratio)}",
                where=f"{where}, frame {index}",
                fix="name the unit of the positions by --unit and let texture coordinates be metres, or export it anew",
            )
    rest = sequence.frame(0).rest
    size = float(np.max(rest.max(axis=0) - rest.min(axis=0)))
    if not _SMALLEST <= size <= _LARGEST:
        raise InputError(
            f"a cloth of {size:.4g} m by its texture coordinates, which are its shape at rest in metres",
            where=where,
            fix="export it with texture coordinates in metres",
        )


def findings(sequence: MeshSequence | RaggedMeshSequence) -> tuple[Finding, ...]:
    """What is odd and was kept: faces turned over or without area in the material, vertices of no face, vertices that
    change places, pieces and slits."""
    flipped = degenerate = loose = 0
    first: dict[str, int] = {}
    frames = range(1) if isinstance(sequence, MeshSequence) else range(len(sequence))
    areas = [_doubled_areas(mesh.rest.astype(np.float64), mesh.faces) for mesh in map(sequence.frame, frames)]
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
            what=f"{count} {what}",
            count=count,
            where=f"frame {first[kind]}",
            fix="look at the export's texture coordinates",
        )
        for kind, count, what in kinds
        if count
    )
    return (*odd, *continuity(sequence), *in_pieces(sequence), *slits(sequence), *t_joints(sequence))


def _edge_ratio(mesh: Mesh) -> float:
    edges = np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]])
    space = np.linalg.norm(np.diff(mesh.positions[edges].astype(np.float64), axis=1)[:, 0], axis=1)
    rest = np.linalg.norm(np.diff(mesh.rest[edges].astype(np.float64), axis=1)[:, 0], axis=1)
    there = rest > 0
    return float(np.median(space[there] / rest[there])) if there.any() else float("inf")


def _likely(ratio: float) -> str:
    for factor, units in _UNITS.items():
        for value in (factor, 1 / factor):
            if 0.8 < ratio / value < 1.25:
                return f": {units} mixed?"
    return ""


def _doubled_areas(rest: NDArray[np.float64], faces: NDArray[np.int32]) -> NDArray[np.float64]:
    a, b, c = (rest[faces[:, i]] for i in range(3))
    return (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
