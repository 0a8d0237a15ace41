"""From a folder of meshes to an artifact of the lake: read, checked, written as one Zarr sequence, published."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flagdata.errors import UsageError
from flagdata.findings import Finding, quality_flags
from flagdata.ingest.meshes.checks import check_units, findings
from flagdata.ingest.meshes.folder import read_folder
from flagdata.ingest.meshes.pieces import welded
from flagdata.ingest.report import REPORT_SCHEMA
from flagdata.ingest.source import Source
from flagdata.ingest.store import IngestResult, Labels, find, kept, result_of
from flagdata.lake import Artifact, Lake
from flagdata.lake.durable import disk_errors
from flagdata.lake.meshes import MeshSequence, RaggedMeshSequence, write_meshes
from flagdata.provenance import canonical
from flagdata.schema import Kind
from flagdata.timebase import NANOSECONDS
from flagdata.units import unit


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
                f"the frame rate {self.rate!r} Hz is out of range", where="--rate", fix="give frames a second"
            )
        if unit(self.unit).si != "m":
            raise UsageError(f"{self.unit!r} is no unit of length", where="--unit", fix="give mm, cm, m or ft")

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
    """Ingest a folder of OBJ meshes, one a frame; ArcSim's output folders with the scene that made them.

    Vertices that are the same in the texture and in every frame are merged, see `welded`; other pieces are reported.

    Args:
        reasons: why the folder is taken to be meshes, for the report.
        progress: called with 1 for each frame read.

    Raises:
        FlagdataError: as `read_folder` and `check_units`; the lake is unchanged.
        ConflictError: a file changed while the folder was read, or the folder is in the lake under other labels.
    """
    options, labels = options or MeshIngest(), labels or Labels()
    source = Source.of(path)
    recipe = options.recipe()
    there = find(lake, Kind.MESHES, source, recipe, labels, branch=branch).whole
    if there is not None:
        return kept(there)
    metre = float(unit(options.unit).to_si(1.0))
    sequence = read_folder(path, rate=options.rate, metre=metre, progress=progress)
    check_units(sequence, where=str(path))
    sequence, merged = welded(sequence)
    found = (*merged, *findings(sequence))
    source.check_unchanged()
    parameters = scene_wind(sequence.attributes.get("scene"))
    report = _report(sequence, found, reasons)
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
            quality=quality_flags(found),
            report=json.dumps(report, allow_nan=False, ensure_ascii=False),
        )
        transaction.add(artifact)
    return result_of(transaction, artifact, report, labels)


def scene_wind(scene: Any) -> dict[str, float] | None:
    """The wind of an ArcSim scene, where the air goes to [m/s]; None where the scene gives none that can be read."""
    wind = scene.get("wind") if isinstance(scene, Mapping) else None
    velocity = wind.get("velocity") if isinstance(wind, Mapping) else None
    if not isinstance(velocity, list) or len(velocity) != 3:
        return None
    if not all(isinstance(v, int | float) and not isinstance(v, bool) and math.isfinite(v) for v in velocity):
        return None
    return dict(zip(("wind_x", "wind_y", "wind_z"), map(float, velocity), strict=True))


def _report(
    sequence: MeshSequence | RaggedMeshSequence, found: Sequence[Finding], reasons: Sequence[str]
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
        "findings": [finding.as_dict() for finding in found],
    }
