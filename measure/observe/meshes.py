"""Mesh sequences as observations: the vertices of a mesh that keeps its topology, else fixed points of the cloth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from flagdata.errors import InputError
from flagdata.findings import Finding, Severity
from flagdata.ingest.meshes import read_folder
from flagdata.lake import Artifact, Lake
from flagdata.lake.meshes import MeshSequence, RaggedMeshSequence, read_meshes
from flagdata.schema import Kind
from flagdata.timebase import NANOSECONDS
from flagdata.units import unit as length_unit
from measure.observe.cloth import VERTICES, model_mesh, outline
from measure.observe.describing import of_arcsim, of_simulation
from measure.observe.observation import Known, Observation
from measure.observe.sampling import sample

MARKERS = 1000
"""A mesh of more vertices is sampled at fixed points instead: neighbours would say the same twice."""
_SAME_RATE = 1e-3


def from_folder(
    path: Path, *, name: str | None = None, rate: float | None = None, unit: str = "m", markers: int = VERTICES
) -> Observation:
    """An ArcSim output folder, or any folder of OBJ meshes with texture coordinates in metres.

    Args:
        name: what reports call it; the folder's if None.
        rate: frames a second [Hz]; None for that of conf.json.
        unit: of the positions.
        markers: about how many points are followed where the mesh itself cannot be.

    Raises:
        FlagdataError: as `read_folder` and `from_sequence`.
    """
    sequence = read_folder(path, rate=rate, metre=float(length_unit(unit, where=str(path)).to_si(1.0)))
    seen = from_sequence(sequence, name=name or path.name, markers=markers)
    scene = sequence.attributes.get("scene")
    stated = scene.get("frame_time") if isinstance(scene, Mapping) else None
    if rate is None or not isinstance(stated, int | float) or abs(rate * stated - 1) < _SAME_RATE:
        return seen
    found = Finding(
        kind="rate-not-as-described",
        severity=Severity.WARNING,
        where=f"recording {seen.name!r}",
        value=1 / stated,
        what=f"frames are taken at {rate:.6g} Hz, conf.json says {1 / stated:.6g} Hz",
        fix="leave the rate out, if conf.json is right",
    )
    return replace(seen, findings=(*seen.findings, found))


def from_artifact(lake: Lake, artifact: Artifact, *, name: str | None = None, markers: int = VERTICES) -> Observation:
    """A mesh sequence of a lake.

    Raises:
        InputError: an artifact of another kind, or without an object.
        FlagdataError: as `from_sequence` and `read_meshes`.
    """
    if artifact.kind is not Kind.MESHES or artifact.object is None:
        raise InputError(
            f"a {artifact.kind.value}, not a mesh sequence",
            where=f"artifact {artifact.id}",
            fix="name a mesh sequence; flagdata ls lists them",
        )
    sequence = read_meshes(lake.whole_object(artifact.object))  # damage must not be measured
    seen = from_sequence(sequence, name=name or artifact.name, markers=markers)
    first = sequence.frame(0).rest.astype(np.float64)
    known = seen.known if seen.known.pins is not None else of_simulation(artifact, first)
    return replace(seen, source=artifact.id, known=known)


def from_sequence(sequence: MeshSequence | RaggedMeshSequence, *, name: str, markers: int = VERTICES) -> Observation:
    """A moving mesh; one that is remeshed, or has more than `MARKERS` vertices, at fixed points of the cloth.

    The points are those of a model mesh over the first frame's outline, found in each frame through the rest
    coordinates and linear within its faces.

    Raises:
        InputError: a cloth with holes, whose outline changes, or a scene that cannot be read.
    """
    where = f"recording {name!r}"
    first = sequence.frame(0)
    rest, faces = first.rest.astype(np.float64), first.faces.astype(np.int64)
    corners = outline(rest, faces, where=where)
    known, found = _described(sequence.attributes, rest, where)
    fixed = isinstance(sequence, MeshSequence)
    if isinstance(sequence, MeshSequence) and len(rest) <= MARKERS:
        used = np.unique(faces)  # vertices that no face uses are no part of the cloth
        seats, positions = rest[used], sequence.positions[:, used].astype(np.float64)
    else:
        mesh = model_mesh(corners, vertices=markers)
        seats, positions = mesh.rest, sample(sequence, mesh.rest)
        found = (*found, _resampled(len(seats), remeshed=not fixed, where=where))
    return Observation(
        name=name,
        markers=seats,
        positions=positions,
        times=(sequence.time - sequence.time[0]) / NANOSECONDS,
        outline=corners,
        known=known,
        findings=found,
    )


def _described(attributes: Mapping[str, Any], rest: Any, where: str) -> tuple[Known, tuple[Finding, ...]]:
    scene = attributes.get("scene")
    if attributes.get("source") != "arcsim" or not isinstance(scene, Mapping):
        return Known(), ()
    return of_arcsim(scene, rest, where=f"{where}, conf.json")


def _resampled(count: int, *, remeshed: bool, where: str) -> Finding:
    why = "its topology changes" if remeshed else f"it has more than {MARKERS} vertices"
    return Finding(
        kind="mesh-resampled",
        severity=Severity.NOTE,
        where=where,
        count=count,
        what=f"the mesh is followed at {count} fixed points of the cloth, since {why}",
    )
