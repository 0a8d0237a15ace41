"""Reading ArcSim 0.2.1's scenes and materials. What the simulator does not do is refused by name.

A scene file names one cloth with one material, its handles, gravity and wind. ArcSim's step has
stages, which all act unless the scene disables them, strain limiting and plasticity only where a
material has settings for them, separation and the pop filter only after remeshing. Of these,
*proximity* becomes `Scene.contact` (`magic.repulsion_thickness`, 1 mm; `magic.collision_stiffness`,
1e9 N/m³; `friction`, 0.6), *strainlimiting* `Scene.limits`, and *remeshing*, where the cloth has
settings for it, `Scene.remeshing`. The others are not simulated: they are an error unless the scene
disables them or the caller accepts to leave them out.

Two deviations: ArcSim reads `duration` only beside `timestep` and runs without end beside
`frame_time`, here it ends the run in both; ArcSim meets strain limits by an optimisation, here the
faces are corrected in sweeps.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from flagdata.core.arrays import FloatArray
from flagdata.errors import InputError, UnknownNameError
from flagdata.ingest.meshes import read_obj
from flagdata.ingest.meshes.folder import read_json
from sim.cloth.air import QuadraticNormal
from sim.cloth.contact import Contact
from sim.cloth.handles import ARCSIM_STIFFNESS, Handles
from sim.cloth.limits import StrainLimits
from sim.cloth.material import Material
from sim.cloth.mesh import Mesh
from sim.cloth.scene import Scene
from sim.cloth.sizing import Remeshing

STAGES = (
    "strainlimiting",
    "remeshing",
    "proximity",
    "collision",
    "separation",
    "popfilter",
    "plasticity",
)
"""Stages of ArcSim's step that a scene may disable."""
SIMULATED = ("strainlimiting", "remeshing", "proximity")
"""Those of them that are simulated here."""
SWEEPS = 50
"""Corrections a step for strain limits, as ArcSim's steps of 5 ms want them."""
REMESHED_SWEEPS = 500
"""The same with remeshing (`sim.cloth.limits.RADIUS_AMONG_SLIVERS`)."""
THICKNESS, STIFFNESS, FRICTION = 1e-3, 1e9, 0.6
"""ArcSim's defaults of proximity: repulsion thickness [m], collision stiffness [N/m³], friction of
cloth on cloth."""

# What of a scene file is read: key → None for a value, a mapping for a table, a list of one for a
# list of tables.
_KEYS: Mapping[str, Any] = {
    **dict.fromkeys(
        (
            "frame_time",
            "frame_steps",
            "end_time",
            "end_frame",
            "duration",
            "gravity",
            "disable",
            "friction",
        )
    ),
    "cloths": [
        {
            "mesh": None,
            "transform": dict.fromkeys(("translate", "scale", "rotate")),
            "materials": [
                dict.fromkeys(
                    (
                        "data",
                        "thicken",
                        "density_mult",
                        "stretching_mult",
                        "bending_mult",
                        "damping",
                        "strain_limits",
                        "yield_curv",
                        "weakening",
                    )
                )
            ],
            "remeshing": dict.fromkeys(
                ("refine_angle", "refine_compression", "refine_velocity", "size", "aspect_min")
            ),
        }
    ],
    "handles": [dict.fromkeys(("nodes", "type"))],
    "wind": dict.fromkeys(("velocity", "density", "drag")),
    "magic": dict.fromkeys(
        (
            "handle_stiffness",
            "repulsion_thickness",
            "collision_stiffness",
            "projection_thickness",
            "edge_flip_threshold",
            "rib_stiffening",
            "combine_tensors",
        )
    ),
    **dict.fromkeys(("motions", "obstacles", "morphs", "obs_friction")),
}
# `projection_thickness` to `combine_tensors`, `weakening` and `obs_friction` belong to stages that
# are not simulated and to obstacles: they say nothing once those are left out.
_EMPTY = ("motions", "obstacles", "morphs")  # known, and only supported empty


@dataclass(frozen=True, kw_only=True)
class ArcsimScene:
    """A scene file.

    Attributes:
        scene: what is simulated.
        frame_time: seconds between frames.
        frame_steps: ArcSim's backward Euler steps a frame.
        frames: frames after the first.
        left_out: stages that ArcSim would run and that the caller accepted to leave out.

    Raises:
        InputError: a frame time that is not positive, or no steps or frames.
    """

    scene: Scene
    frame_time: float
    frame_steps: int
    frames: int
    left_out: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not (
            math.isfinite(self.frame_time)
            and self.frame_time > 0
            and self.frame_steps >= 1
            and self.frames >= 1
        ):
            raise InputError(
                f"the run has {self.frames} frames of {self.frame_time!r} s, each in "
                f"{self.frame_steps} steps",
                where="ArcSim scene",
                fix="let it last at least one frame of at least one step",
            )

    @property
    def step(self) -> float:
        """ArcSim's time step [s]."""
        return self.frame_time / self.frame_steps


def read_material(path: Path) -> Material:
    """Reads a material file: density, stretching (6 × 4) and bending (3 × 5). Its damping is 0, as
    ArcSim's.

    Raises:
        NotFoundError: no such file.
        InputError: missing or unknown keys, impossible values.
    """
    content = read_json(path)
    _check_keys(content, {"density", "stretching", "bending"}, f"material {path}")
    missing = sorted({"density", "stretching", "bending"} - set(content))
    if missing:
        raise InputError(
            f"these keys are missing: {', '.join(missing)}",
            where=f"material {path}",
            fix="add them",
        )
    tables = {
        "area-weight": content["density"],
        "stretching": content["stretching"],
        "bending": content["bending"],
    }
    return Material.from_mapping(
        {**tables, "source": f"ArcSim material file {path.name}", "damping": 0.0}, name=path.stem
    )


def read_scene(
    path: Path, *, root: Path | None = None, accept: Collection[str] = ()
) -> ArcsimScene:
    """Reads a scene file with its mesh and material.

    Args:
        root: folder that the mesh and material paths are relative to; the scene file's own if None.
        accept: stages (of `STAGES`) that are left out although the scene has them act, those of
            `SIMULATED` too.

    Raises:
        NotFoundError: a file that is not there.
        InputError: keys or stages that are not supported, all of them listed; several cloths or
            materials; impossible values.
        UnknownNameError: an accepted or disabled stage that does not exist.
    """
    content = read_json(path)
    where = f"scene {path}"
    folder = path.parent if root is None else root
    for stage in (*accept, *_list(content, "disable", where)):
        if stage not in STAGES:
            raise UnknownNameError.of("ArcSim stage", str(stage), STAGES, where=where)
    left_out = _supported_stages(content, where, frozenset(accept))
    cloth = _single(content, "cloths", where)
    entry = _single(cloth, "materials", where)

    shape = read_obj(folder / _text(cloth, "mesh", where))
    transform = cloth.get("transform", {})
    # A scale acts on the material coordinates too: a larger cloth, not a stretched one.
    mesh = Mesh(rest=shape.rest * _number(transform, "scale", 1.0, where), faces=shape.faces)
    wind, magic = content.get("wind", {}), content.get("magic", {})
    simulated = _acting(content, where) - set(left_out)
    sweeps = REMESHED_SWEEPS if "remeshing" in simulated else SWEEPS
    nodes: list[int] = []
    for handle in _list(content, "handles", where):
        if handle.get("type", "node") != "node":
            raise InputError(
                f"the handle's type is {handle['type']!r}",
                where=where,
                fix="only node handles are supported",
            )
        nodes += [int(node) for node in handle.get("nodes", [])]
    scene = Scene(
        mesh=mesh,
        position=_place_positions(shape.positions, transform, where),
        material=_scale_material(read_material(folder / _text(entry, "data", where)), entry, where),
        handles=Handles(
            vertices=tuple(nodes),
            stiffness=_number(magic, "handle_stiffness", ARCSIM_STIFFNESS, f"{where}, magic"),
        ),
        wind=_vector(wind, "velocity", (0.0, 0.0, 0.0), f"{where}, wind"),
        gravity=_vector(content, "gravity", (0.0, 0.0, 0.0), where),
        air=QuadraticNormal(
            density=_number(wind, "density", 1.0, f"{where}, wind"),
            drag=_number(wind, "drag", 0.0, f"{where}, wind"),
        ),
        contact=_contact(content, magic, where) if "proximity" in simulated else None,
        limits=_limits(entry, sweeps, where) if "strainlimiting" in simulated else None,
        remeshing=_remeshing(cloth["remeshing"], f"{where}, remeshing")
        if "remeshing" in simulated
        else None,
    )
    frame_time = _number(content, "frame_time", math.nan, where)
    frame_steps = _number(content, "frame_steps", math.nan, where)
    if not (frame_time > 0 and frame_steps >= 1 and frame_steps == int(frame_steps)):
        raise InputError(
            "frame_time or frame_steps are missing or impossible", where=where, fix="give both"
        )
    return ArcsimScene(
        scene=scene,
        frame_time=frame_time,
        frame_steps=int(frame_steps),
        frames=_frames(content, frame_time, where),
        left_out=left_out,
    )


def _frames(content: Mapping[str, Any], frame_time: float, where: str) -> int:
    ends = [key for key in ("end_time", "duration", "end_frame") if key in content]
    if len(ends) != 1:
        raise InputError(
            f"its end is given {len(ends)} times",
            where=where,
            fix="give end_time, duration or end_frame",
        )
    value = _number(content, ends[0], math.nan, where)
    frames = value if ends[0] == "end_frame" else value / frame_time
    if not (math.isfinite(frames) and frames >= 1):
        raise InputError(
            f"{ends[0]} is {value!r}", where=where, fix="let it last at least one frame"
        )
    return math.floor(frames + 1e-9)


def _supported_stages(
    content: Mapping[str, Any], where: str, accept: frozenset[str]
) -> tuple[str, ...]:
    """Lists the stages that act and are left out.

    Raises:
        InputError: keys, contents or stages that are not supported, all of them in one.
    """
    keys = _strange(content, _KEYS, "", where)
    filled = [key for key in _EMPTY if content.get(key)]
    acting = tuple(stage for stage in STAGES if stage in _acting(content, where))
    left_out = tuple(stage for stage in acting if stage in accept)
    set_up = all("remeshing" in cloth for cloth in _cloths(content, where))
    simulated = SIMULATED if set_up else tuple(stage for stage in SIMULATED if stage != "remeshing")
    refused = [stage for stage in acting if stage not in (*accept, *simulated)]
    reasons = [
        f"{kind} {', '.join(names)}"
        for kind, names in (
            ("the keys", keys),
            ("the contents of", filled),
            ("the stages", refused),
        )
        if names
    ]
    if reasons:
        fixes = ["remove what is not supported"] if keys or filled else []
        fixes += (
            ['add the stages to the scene\'s "disable", or accept to leave them out']
            if refused
            else []
        )
        raise InputError(
            f"these are not supported: {'; '.join(reasons)}", where=where, fix="; ".join(fixes)
        )
    return left_out


def _acting(content: Mapping[str, Any], where: str) -> set[str]:
    """Stages that act in a scene."""
    acting: set[str] = {*STAGES} - set(_list(content, "disable", where))
    entries = [
        entry
        for c in _cloths(content, where)
        for entry in _list(c, "materials", where)
        if isinstance(entry, Mapping)
    ]
    for stage, key in (("strainlimiting", "strain_limits"), ("plasticity", "yield_curv")):
        if not any(key in entry for entry in entries):
            acting.discard(stage)
    return acting if "remeshing" in acting else acting - {"separation", "popfilter"}


def _cloths(content: Mapping[str, Any], where: str) -> list[Mapping[str, Any]]:
    return [cloth for cloth in _list(content, "cloths", where) if isinstance(cloth, Mapping)]


def _contact(content: Mapping[str, Any], magic: Mapping[str, Any], where: str) -> Contact:
    return Contact(
        thickness=_number(magic, "repulsion_thickness", THICKNESS, f"{where}, magic"),
        stiffness=_number(magic, "collision_stiffness", STIFFNESS, f"{where}, magic"),
        friction=_number(content, "friction", FRICTION, where),
    )


def _limits(entry: Mapping[str, Any], sweeps: int, where: str) -> StrainLimits:
    limits = entry["strain_limits"]
    if not isinstance(limits, list) or len(limits) != 2:
        raise InputError(f"strain_limits is {limits!r}", where=where, fix="give [low, high]")
    low, high = (_number({"strain_limits": value}, "strain_limits", 0.0, where) for value in limits)
    return StrainLimits(low=low, high=high, sweeps=sweeps)


def _remeshing(settings: Mapping[str, Any], where: str) -> Remeshing:
    size = settings.get("size")
    if not isinstance(size, list) or len(size) != 2:
        raise InputError(f"size is {size!r}", where=where, fix="give [smallest, largest] in metres")
    smallest, largest = (_number({"size": value}, "size", 0.0, where) for value in size)
    # A criterion without a value asks for nothing.
    return Remeshing(
        refine_angle=_number(settings, "refine_angle", math.inf, where),
        refine_compression=_number(settings, "refine_compression", math.inf, where),
        refine_velocity=_number(settings, "refine_velocity", math.inf, where),
        size_min=smallest,
        size_max=largest,
        aspect_min=_number(settings, "aspect_min", 0.0, where),
    )


def _strange(content: Any, schema: Mapping[str, Any], path: str, where: str) -> list[str]:
    """Lists full names of the keys that are not in the schema, at any depth.

    Raises:
        InputError: a value where a table or list belongs.
    """
    if not isinstance(content, Mapping):
        raise InputError(
            f"{path or 'the file'} is {content!r}", where=where, fix="give an object, {…}"
        )
    unknown: list[str] = []
    for key, value in content.items():
        name = f"{path}.{key}" if path else str(key)
        if key not in schema:
            unknown.append(name)
        elif isinstance(schema[key], Mapping):
            unknown += _strange(value, schema[key], name, where)
        elif isinstance(schema[key], list):
            for index, item in enumerate(_list(content, key, where)):
                unknown += _strange(item, schema[key][0], f"{name}[{index}]", where)
    return unknown


def _scale_material(material: Material, entry: Mapping[str, Any], where: str) -> Material:
    thicken = _number(entry, "thicken", 1.0, where)
    scaled = material.scaled(
        area_weight=thicken * _number(entry, "density_mult", 1.0, where),
        stretching=thicken * _number(entry, "stretching_mult", 1.0, where),
        bending=thicken * _number(entry, "bending_mult", 1.0, where),
    )
    return replace(scaled, damping=_number(entry, "damping", 0.0, where))


def _place_positions(positions: FloatArray, transform: Mapping[str, Any], where: str) -> FloatArray:
    """Applies a transform: scaled, turned (angle in degrees about an axis), then moved."""
    placed = positions * _number(transform, "scale", 1.0, where)
    if "rotate" in transform:
        turn = transform["rotate"]
        if not isinstance(turn, list) or len(turn) != 4 or not any(turn[1:]):
            raise InputError(f"rotate is {turn!r}", where=where, fix="give [degrees, x, y, z]")
        axis = np.array(turn[1:], dtype=np.float64)
        placed = Rotation.from_rotvec(math.radians(turn[0]) * axis / np.linalg.norm(axis)).apply(
            placed
        )
    return placed + np.array(_vector(transform, "translate", (0.0, 0.0, 0.0), where))


def _check_keys(content: Any, keys: Collection[str], where: str) -> None:
    if not isinstance(content, Mapping):
        raise InputError(f"{content!r} is not an object", where=where, fix="give {…}")
    unknown = sorted(set(content) - set(keys))
    if unknown:
        raise InputError(
            f"these keys are not supported: {', '.join(unknown)}",
            where=where,
            fix=f"known: {', '.join(sorted(keys))}",
        )


def _list(content: Mapping[str, Any], key: str, where: str) -> list[Any]:
    value = content.get(key, [])
    if not isinstance(value, list):
        raise InputError(f"{key} is {value!r}", where=where, fix="give a list")
    return value


def _single(content: Mapping[str, Any], key: str, where: str) -> Mapping[str, Any]:
    entries = _list(content, key, where)
    if len(entries) != 1:
        raise InputError(f"the scene has {len(entries)} {key}", where=where, fix="one is supported")
    return entries[0]


def _text(content: Mapping[str, Any], key: str, where: str) -> str:
    value = content.get(key)
    if not isinstance(value, str):
        raise InputError(f"{key} is {value!r}", where=where, fix="give a path")
    return value


def _number(content: Mapping[str, Any], key: str, default: float, where: str) -> float:
    value = content.get(key, default)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"{key} is {value!r}", where=where, fix="give a number")
    return float(value)


def _vector(
    content: Mapping[str, Any], key: str, default: tuple[float, float, float], where: str
) -> tuple[float, float, float]:
    value = content.get(key, default)
    try:
        x, y, z = (float(v) for v in value)
    except (TypeError, ValueError):
        raise InputError(f"{key} is {value!r}", where=where, fix="give [x, y, z]") from None
    return x, y, z
