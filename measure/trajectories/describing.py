"""What descriptions that travel with a recording say of the cloth: ArcSim's conf.json, and our
simulations' rows."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import PurePosixPath
from typing import Any

import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.core.findings import Finding
from flagdata.errors import InputError
from flagdata.ingest.meshes.mesh_artifacts import scene_wind
from flagdata.lake import Artifact
from flagdata.recipes.retired_names import present_names
from measure.trajectories.observation import Known
from measure.trajectories.trajectory import WindTrack
from sim.arcsim import STAGES
from sim.cloth import handles
from sim.cloth.air import AIR_FORCES, AirForce, QuadraticNormal
from sim.cloth.handles import ARCSIM_STIFFNESS
from sim.cloth.material import BENDING_SHAPE, MATERIALS, STRETCHING_SHAPE, Material, named_material


def of_arcsim(
    scene: Mapping[str, Any], rest: FloatArray, *, where: str
) -> tuple[Known, tuple[Finding, ...]]:
    """Reads what an ArcSim scene says, and what it ran with that no model here has.

    The material is looked up in the catalog under its file's name: output folders name the file,
    but do not hold it. Its damping stays the catalog's, since ArcSim's own 0 says nothing about
    what its steps damp.

    Args:
        rest: (vertex, 2) of the first frame, whose first vertices are the scene's [m].

    Raises:
        InputError: values of the wrong type, or handles that name vertices which are not there.
    """
    entry = _table(_first(_first(scene, "cloths", where), "materials", where), where)
    wind, magic = _table(scene.get("wind", {}), where), _table(scene.get("magic", {}), where)
    velocity = scene_wind(scene)
    description = Known(
        material=_arcsim_material(entry, where),
        pins=_arcsim_pins(scene, rest, where),
        stiffness=_number(magic, "handle_stiffness", ARCSIM_STIFFNESS, where),
        gravity=_vector(scene.get("gravity", [0, 0, 0]), where),
        air=QuadraticNormal(
            density=_number(wind, "density", 1.0, where), drag=_number(wind, "drag", 0.0, where)
        ),
        wind=None
        if velocity is None
        else WindTrack.constant((velocity["wind_x"], velocity["wind_y"], velocity["wind_z"])),
    )
    return description, _arcsim_findings(scene, entry, where)


def of_simulation(artifact: Artifact, rest: FloatArray) -> Known:
    """Reads what the row of a mesh sequence says that was simulated here; silent for any other.

    Its effects are left aside: the search for missing effects must not know them.

    Args:
        rest: (vertex, 2) of its mesh [m].

    Raises:
        InputError: a row that cannot be read.
    """
    recipe = artifact.recipe
    if "simulate" not in recipe or artifact.parameters is None:
        return Known()
    where = f"artifact {artifact.id}"
    drawn: Mapping[str, Any] = present_names(json.loads(artifact.parameters))
    try:
        scene = recipe["scene"]
        material = Material(
            name=str(drawn["material"]),
            source=where,
            area_weight=float(drawn["area_weight"]),
            damping=float(drawn["damping"]),
            stretching=np.reshape(drawn["stretching"], STRETCHING_SHAPE),
            bending=np.reshape(drawn["bending"], BENDING_SHAPE),
        )
        speed, toward = float(drawn["wind_speed"]), float(drawn["wind_toward"])
        wind = (speed * math.cos(toward), speed * math.sin(toward), float(drawn["wind_vertical"]))
        return Known(
            material=material,
            pins=_simulated_pins(scene, rest),
            stiffness=ARCSIM_STIFFNESS,
            gravity=(0.0, 0.0, -float(scene["gravity"])),
            air=_force(recipe["wind"]["force"]),
            wind=WindTrack.constant(wind),
        )
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(
            f"its parameters cannot be read: {error!r}",
            where=where,
            fix="simulate it again with this version",
        ) from None


def _simulated_pins(scene: Mapping[str, Any], rest: FloatArray) -> FloatArray | None:
    """Locates the pins of the recipe's shape; None for an ArcSim scene, whose handles are not in
    the row."""
    if scene["shape"] == "flag":
        vertices = (
            handles.full_hoist(rest) if scene["attachment"] == "hoist" else handles.corners(rest)
        )
    elif scene["shape"] == "hanging-cloth":
        vertices = handles.top_corners(rest)
    else:
        return None
    return rest[list(vertices)]


def _force(spec: Mapping[str, Any]) -> AirForce:
    return AIR_FORCES[spec["name"]](**{key: value for key, value in spec.items() if key != "name"})


def _arcsim_material(entry: Mapping[str, Any], where: str) -> Material | None:
    data = entry.get("data")
    name = PurePosixPath(data).stem if isinstance(data, str) else ""
    if name not in MATERIALS.names():
        return None
    thicken = _number(entry, "thicken", 1.0, where)
    return named_material(name).scaled(
        area_weight=thicken * _number(entry, "density_mult", 1.0, where),
        stretching=thicken * _number(entry, "stretching_mult", 1.0, where),
        bending=thicken * _number(entry, "bending_mult", 1.0, where),
    )


def _arcsim_pins(scene: Mapping[str, Any], rest: FloatArray, where: str) -> FloatArray | None:
    nodes: list[int] = []
    for handle in scene.get("handles", []):
        listed = _table(handle, where).get("nodes", [])
        if not isinstance(listed, list) or not all(
            isinstance(n, int) and 0 <= n < len(rest) for n in listed
        ):
            raise InputError(
                f"the handles {listed!r} are not vertices of a mesh of {len(rest)}",
                where=where,
                fix="name the pins yourself",
            )
        nodes += listed
    return rest[nodes] if nodes else None


def _arcsim_findings(
    scene: Mapping[str, Any], entry: Mapping[str, Any], where: str
) -> tuple[Finding, ...]:
    disabled = scene.get("disable", [])
    acting = [stage for stage in STAGES if stage not in disabled]
    for stage, key in (("strainlimiting", "strain_limits"), ("plasticity", "yield_curv")):
        if key not in entry and stage in acting:
            acting.remove(stage)
    steps, frame = scene.get("frame_steps"), scene.get("frame_time")
    findings: list[Finding] = []
    if isinstance(steps, int) and steps > 0 and isinstance(frame, int | float):
        step = float(frame) / steps
        findings.append(
            Finding.of(
                "simulated-with-numerical-damping",
                f"ArcSim ran with implicit steps of {1e3 * step:.3g} ms, which damp the cloth by "
                f"{5e2 * step:.3g} "
                "ms beside its own damping",
                where=where,
                value=step / 2,
            )
        )
    if acting:
        findings.append(
            Finding.of(
                "simulated-with-other-stages",
                f"ArcSim ran with {', '.join(acting)}, which the base model is without",
                where=where,
                count=len(acting),
            )
        )
    return tuple(findings)


def _first(content: Any, key: str, where: str) -> Any:
    entries = _table(content, where).get(key)
    if not isinstance(entries, list) or len(entries) != 1:
        count = len(entries) if isinstance(entries, list) else "no"
        raise InputError(f"the scene has {count} {key}", where=where, fix="one is supported")
    return entries[0]


def _table(content: Any, where: str) -> Mapping[str, Any]:
    if not isinstance(content, Mapping):
        raise InputError(f"{content!r} is not an object", where=where, fix="correct conf.json")
    return content


def _number(content: Mapping[str, Any], key: str, default: float, where: str) -> float:
    value = content.get(key, default)
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise InputError(f"{key} is {value!r}", where=where, fix="give a finite number")
    return float(value)


def _vector(value: Any, where: str) -> tuple[float, float, float]:
    try:
        x, y, z = (float(part) for part in value)
    except (TypeError, ValueError):
        raise InputError(f"gravity is {value!r}", where=where, fix="give [x, y, z]") from None
    return x, y, z
