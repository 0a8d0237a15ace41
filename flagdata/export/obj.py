"""Mesh sequences as folders of Wavefront OBJ files, one a frame, with the conf.json that ArcSim's
tools look for."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from flagdata.core.schema import FRAME_RATE, Kind
from flagdata.errors import CorruptError
from flagdata.export.export_source import ExportRows
from flagdata.ingest.meshes import write_folder
from flagdata.lake.mesh_sequences import MeshSequence, RaggedMeshSequence, read_meshes
from flagdata.recipes.documents import column_json
from flagdata.timebase import NANOSECONDS


@dataclass(frozen=True, kw_only=True)
class ObjFolders:
    """Folders <artifact>/NNNN_00.obj with v [m], vt [m] and f, numbered from 0, and conf.json.

    An ingested ArcSim run has its own scene in conf.json; a simulated one `frame_time`, its wind,
    and under `flagdata` its parameters and the time of its first frame.
    """

    kinds: ClassVar[frozenset[Kind]] = frozenset({Kind.MESHES})

    def write(
        self, source: ExportRows, folder: Path, advance: Callable[[int], None]
    ) -> Mapping[str, Any]:
        frames = 0
        for row in source.rows.to_pylist():
            if row["object"] is None:
                raise CorruptError(
                    "a row has no object", where=row["artifact"], fix="run flagdata doctor"
                )
            sequence = read_meshes(source.lake.whole_object(row["object"]))
            write_folder(folder / row["artifact"], sequence, scene=_scene(sequence, row))
            frames += len(sequence)
            advance(1)
        return {
            "sequences": len(source),
            "frames": frames,
            "units": {"v": "m", "vt": "m", "frame_time": "s"},
        }


def _scene(sequence: MeshSequence | RaggedMeshSequence, row: Mapping[str, Any]) -> dict[str, Any]:
    frame_time = 1 / (row["rate"] or FRAME_RATE)
    stored_scene = sequence.attributes.get("scene")
    if isinstance(stored_scene, Mapping):
        return {**stored_scene, "frame_time": frame_time}
    parameters: dict[str, Any] = column_json(
        row["parameters"] or "{}", "parameters", artifact=row["artifact"]
    )
    scene: dict[str, Any] = {
        "frame_time": frame_time,
        "flagdata": {
            "first": int(sequence.time[0]) / NANOSECONDS,
            "seed": row["seed"],
            "parameters": parameters,
        },
    }
    if "wind_speed" in parameters:
        speed, toward = parameters["wind_speed"], parameters["wind_toward"]
        velocity = [speed * math.cos(toward), speed * math.sin(toward), parameters["wind_vertical"]]
        scene["wind"] = {"velocity": velocity}
    return scene
