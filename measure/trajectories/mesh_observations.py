"""Mesh sequences as observations: the vertices of a mesh that keeps its topology, else fixed points
of the cloth.

Material points of a moving mesh whose topology may change: where they are in each frame.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flagdata.core.arrays import Float32Array, FloatArray
from flagdata.core.findings import Finding
from flagdata.core.schema import Kind
from flagdata.core.units import unit as length_unit
from flagdata.errors import InputError
from flagdata.ingest.meshes import read_folder
from flagdata.lake import Artifact, Lake
from flagdata.lake.mesh_sequences import MeshSequence, RaggedMeshSequence, read_meshes
from flagdata.timebase import NANOSECONDS
from measure.trajectories.cloth_mesh import VERTICES, model_mesh, outline
from measure.trajectories.describing import of_arcsim, of_simulation
from measure.trajectories.observation import Known, Observation
from sim.cloth.material_points import Location, locate


def sample(sequence: MeshSequence | RaggedMeshSequence, points: FloatArray) -> FloatArray:
    """Interpolates where points of the flat cloth (point, 2) are in each frame, (frame, point, 3)
    [m], linear in each face.

    Raises:
        InputError: a point that is not on the cloth in every frame.
    """
    positions = np.empty((len(sequence), len(points), 3))
    last: tuple[Float32Array, NDArray[np.int32]] | None = None
    location: Location | None = None
    for index in range(len(sequence)):
        mesh = sequence.frame(index)
        same = (
            last is not None
            and np.array_equal(last[0], mesh.rest)
            and np.array_equal(last[1], mesh.faces)
        )
        if location is None or not same:
            rest, faces = mesh.rest.astype(np.float64), mesh.faces.astype(np.int64)
            location = locate(rest, faces, points, where=f"frame {index}")
            last = (mesh.rest, mesh.faces)
        positions[index] = location.of(mesh.positions.astype(np.float64))
    return positions


MARKERS = 1000
"""A mesh of more vertices is sampled at fixed points instead: neighbours would say the same
twice."""
_SAME_RATE = 1e-3


def from_folder(
    path: Path,
    *,
    name: str | None = None,
    rate: float | None = None,
    unit: str = "m",
    markers: int = VERTICES,
) -> Observation:
    """Reads an ArcSim output folder, or any folder of OBJ meshes with texture coordinates in
    metres.

    Args:
        name: what reports call it; the folder's if None.
        rate: frames a second [Hz]; None for that of conf.json.
        unit: of the positions.
        markers: about how many points are followed where the mesh itself cannot be.

    Raises:
        FlagdataError: as `read_folder` and `from_sequence`.
    """
    sequence = read_folder(
        path, rate=rate, metre=float(length_unit(unit, where=str(path)).to_si(1.0))
    )
    observation = from_sequence(sequence, name=name or path.name, markers=markers)
    scene = sequence.attributes.get("scene")
    frame_time = scene.get("frame_time") if isinstance(scene, Mapping) else None
    if (
        rate is None
        or not isinstance(frame_time, int | float)
        or abs(rate * frame_time - 1) < _SAME_RATE
    ):
        return observation
    finding = Finding.of(
        "rate-not-as-described",
        f"frames are taken at {rate:.6g} Hz, conf.json says {1 / frame_time:.6g} Hz",
        where=f"recording {observation.name!r}",
        value=1 / frame_time,
        fix="leave the rate out, if conf.json is right",
    )
    return replace(observation, findings=(*observation.findings, finding))


def from_artifact(
    lake: Lake, artifact: Artifact, *, name: str | None = None, markers: int = VERTICES
) -> Observation:
    """Reads a mesh sequence of a lake.

    Raises:
        InputError: an artifact of another kind, or without an object.
        FlagdataError: as `from_sequence` and `read_meshes`.
    """
    if artifact.kind is not Kind.MESHES or artifact.object is None:
        raise InputError(
            f"the artifact is a {artifact.kind.value}, not a mesh sequence",
            where=f"artifact {artifact.id}",
            fix="name a mesh sequence; flagdata ls lists them",
        )
    sequence = read_meshes(lake.whole_object(artifact.object))  # damage must not be measured
    observation = from_sequence(sequence, name=name or artifact.name, markers=markers)
    first = sequence.frame(0).rest.astype(np.float64)
    description = (
        observation.known if observation.known.pins is not None else of_simulation(artifact, first)
    )
    return replace(observation, source=artifact.id, known=description, session=artifact.session)


def from_sequence(
    sequence: MeshSequence | RaggedMeshSequence, *, name: str, markers: int = VERTICES
) -> Observation:
    """Makes an observation of a moving mesh; one that is remeshed, or has more than `MARKERS`
    vertices, is followed at fixed points of the cloth.

    The points are those of a model mesh over the first frame's outline, found in each frame through
    the rest coordinates and linear within its faces.

    Raises:
        InputError: a cloth with holes, whose outline changes, or a scene that cannot be read.
    """
    where = f"recording {name!r}"
    first = sequence.frame(0)
    rest, faces = first.rest.astype(np.float64), first.faces.astype(np.int64)
    corners = outline(rest, faces, where=where)
    description, findings = _described_mesh(sequence.attributes, rest, where)
    fixed = isinstance(sequence, MeshSequence)
    if isinstance(sequence, MeshSequence) and len(rest) <= MARKERS:
        used = np.unique(faces)  # vertices that no face uses are no part of the cloth
        seats, positions = rest[used], sequence.positions[:, used].astype(np.float64)
    else:
        mesh = model_mesh(corners, vertices=markers)
        seats, positions = mesh.rest, sample(sequence, mesh.rest)
        findings = (*findings, _resampled_finding(len(seats), remeshed=not fixed, where=where))
    return Observation(
        name=name,
        markers=seats,
        positions=positions,
        times=(sequence.time - sequence.time[0]) / NANOSECONDS,
        outline=corners,
        known=description,
        findings=findings,
    )


def _described_mesh(
    attributes: Mapping[str, Any], rest: Any, where: str
) -> tuple[Known, tuple[Finding, ...]]:
    scene = attributes.get("scene")
    if attributes.get("source") != "arcsim" or not isinstance(scene, Mapping):
        return Known(), ()
    return of_arcsim(scene, rest, where=f"{where}, conf.json")


def _resampled_finding(count: int, *, remeshed: bool, where: str) -> Finding:
    why = "its topology changes" if remeshed else f"it has more than {MARKERS} vertices"
    return Finding.of(
        "mesh-resampled",
        f"the mesh is followed at {count} fixed points of the cloth, since {why}",
        where=where,
        count=count,
    )
