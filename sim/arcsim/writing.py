"""Writing scenes as ArcSim 0.2.1 reads them. What ArcSim's format cannot express is refused by
name.

All stages that are not simulated here are disabled in what is written, and those that are where the
scene does without them, so that ArcSim runs what the scene says. The sweeps of strain limits are
not written: ArcSim meets its limits by an optimisation.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from flagdata.core.files.outputs import write_files
from flagdata.errors import InputError
from flagdata.ingest.meshes import Obj, obj_text
from sim.arcsim.arcsim_reading import SIMULATED, STAGES, ArcsimScene
from sim.cloth.air import QuadraticNormal
from sim.cloth.material import Material
from sim.cloth.scene import Scene
from sim.cloth.sizing import Remeshing
from sim.cloth.stiffness_tables import Evaluation


def write_scene(file: ArcsimScene, folder: Path, *, name: str = "scene") -> Path:
    """Writes `name`.json with its mesh `name`.obj and its material, by which
    `sim.arcsim.read_scene` gives it back.

    ArcSim looks for the mesh and the material from where it is run: run it in the folder. Positions
    have nine significant digits, all else is exact.

    Returns:
        The scene file.

    Raises:
        InputError: handles that move or are rigid, a wind force other than the quadratic one, the
            corrected evaluation of the tables, or strain limits without an upper one, all of them
            listed.
        ConflictError: one of the files is there already.
    """
    scene = file.scene
    air = _expressible(scene)
    content, mesh, material = f"{name}.json", f"{name}.obj", f"{scene.material.name}.json"
    if content == material:
        raise InputError(
            f"scene and material are both named {name}",
            where=str(folder),
            fix="give the scene another name",
        )
    write_files(
        folder,
        {
            mesh: obj_text(
                Obj(positions=scene.position, faces=scene.mesh.faces, rest=scene.mesh.rest)
            ),
            material: _json(_material(scene.material)),
            content: _json(_content(file, air, mesh=mesh, material=material)),
        },
    )
    return folder / content


def _expressible(scene: Scene) -> QuadraticNormal:
    """Returns the scene's wind force, where ArcSim's format can express it and all else."""
    refused: list[str] = []
    if len(scene.handles.times) > 1 or any(any(offset) for offset in scene.handles.offsets):
        refused.append("moving handles")
    if scene.handles.rigid:
        refused.append("rigid handles")
    air = scene.air if isinstance(scene.air, QuadraticNormal) else None
    if air is None:
        refused.append(f"the wind force {type(scene.air).__name__}")
    if scene.evaluation is not Evaluation.ARCSIM:
        refused.append(f"the {scene.evaluation.value} evaluation of the tables")
    if scene.limits is not None and math.isinf(scene.limits.high):
        refused.append("strain limits without an upper one")
    if refused or air is None:
        raise InputError(
            f"ArcSim does not know: {', '.join(refused)}",
            where="ArcSim scene",
            fix="write a scene without them",
        )
    return air


def _content(
    file: ArcsimScene, air: QuadraticNormal, *, mesh: str, material: str
) -> dict[str, Any]:
    scene = file.scene
    entry: dict[str, Any] = {"data": material, "damping": scene.material.damping}
    magic: dict[str, Any] = {"handle_stiffness": scene.handles.stiffness}
    content: dict[str, Any] = {
        "frame_time": file.frame_time,
        "frame_steps": file.frame_steps,
        "end_frame": file.frames,
        "cloths": [{"mesh": mesh, "materials": [entry]}],
        "handles": [{"nodes": list(scene.handles.vertices)}],
        "gravity": list(scene.gravity),
        "wind": {"velocity": list(scene.wind), "density": air.density, "drag": air.drag},
        "magic": magic,
    }
    simulated = set(SIMULATED)
    if scene.contact is None:
        simulated.remove("proximity")
    else:
        magic["repulsion_thickness"] = scene.contact.thickness
        magic["collision_stiffness"] = scene.contact.stiffness
        content["friction"] = scene.contact.friction
    if scene.limits is None:
        simulated.remove("strainlimiting")
    else:
        entry["strain_limits"] = [scene.limits.low, scene.limits.high]
    if scene.remeshing is None:
        simulated.remove("remeshing")
    else:
        content["cloths"][0]["remeshing"] = _remeshing(scene.remeshing)
    content["disable"] = [stage for stage in STAGES if stage not in simulated]
    return content


def _remeshing(criteria: Remeshing) -> dict[str, Any]:
    entries: dict[str, Any] = {
        name: value
        for name in ("refine_angle", "refine_compression", "refine_velocity", "aspect_min")
        if math.isfinite(value := getattr(criteria, name))
    }
    return {**entries, "size": [criteria.size_min, criteria.size_max]}


def _material(material: Material) -> dict[str, Any]:
    return {
        "density": material.area_weight,
        "stretching": material.stretching.tolist(),
        "bending": material.bending.tolist(),
    }


def _json(content: dict[str, Any]) -> str:
    return json.dumps(content, indent=1, allow_nan=False) + "\n"
