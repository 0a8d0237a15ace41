"""Recipes as TOML. Parsed here and nowhere else; unknown keys are refused, the nearest is named.

All values are SI, angles radians. A *quantity* is a number, or `{ low = …, high = …, scale =
"linear" | "log" }`, from which each member draws its own value.

    title, seed, count, batch, precision
    [scene]      shape = "flag" | "hanging-cloth" | "arcsim" | "mesh"; width, height, columns,
                 attachment; start-noise; file, root, accept (of an ArcSim scene); rest = [[u, v],
                 …], faces, held, anchors = [[x, y, z], …] (of a mesh); stiffness (of the handles),
                 or rigid = true; evaluation = "arcsim" | "corrected"; gravity
    [material]   name (of catalogs/materials), names (of which each member draws one), file (TOML,
                 or ArcSim JSON) or table (what such a TOML file holds); area-weight,
                 area-weight-factor, stretching-factor, bending-factor, damping: quantities;
                 bending-factors: a quantity drawn for each of the 15 coefficients
    [wind]       speed [m/s], toward (where the air goes to, from +x towards +y) [rad], or
                 toward-deg in degrees: quantities; vertical [m/s]. In place of a steady wind:
                 samples = [[time, x, y, z], …], in s since the first frame that is kept and m/s; or
                 log (a wind or recording of the lake), log-start (the first frame that is kept,
                 since the log's first sample [s]), toward (of the log's vector mean, an angle);
                 beyond = "refuse" | "hold" (what a run longer than the samples gets). With each of
                 them: force = "quadratic-normal" | "stokes"; density, drag | viscosity
    [contact]    thickness, stiffness, friction; without the table, layers pass through each other
    [limits]     low, high, sweeps; without the table, strain has no limits
    [remeshing]  refine-angle, refine-compression, refine-velocity, size-min, size-max, aspect-min;
                 without the table, the mesh stays as it is; with it, [integrator] is implicit and
                 members are simulated one by one
    [integrator] name = "symplectic" | "implicit"; step; air-shape (of the implicit); backend =
                 "auto" | "torch" | "kernel" | "warp"
    [time]       settle, frames, rate
    [effects.NAME]  parameters of an effect (quantities, or "prior" for its prior range)

Without [material], [wind], [contact], [limits] or [remeshing] an ArcSim scene's own are taken.
`count`, `batch` and `title` do not change what a member is; everything else does.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from msgspec import Meta

from flagdata.core.files.addresses import local_path
from flagdata.core.provenance import canonical, digest
from flagdata.errors import InputError, UnknownNameError, UsageError
from flagdata.recipes.retired_names import KEYS
from flagdata.recipes.shelves import Shelf, parse_recipe, read_recipe
from flagdata.recipes.typed_tables import (
    AngleQuantity,
    Count,
    Index,
    Named,
    NotNegative,
    NotNegativeQuantity,
    Positive,
    PositiveQuantity,
    Quantity,
    Range,
    Seed,
    entries,
    read,
    value,
    within,
)
from sim.arcsim import REMESHED_SWEEPS, SWEEPS, ArcsimScene, read_material, read_scene
from sim.cloth import material
from sim.cloth.air import AIR_FORCES, AirForce
from sim.cloth.contact import Contact
from sim.cloth.handles import ARCSIM_STIFFNESS
from sim.cloth.limits import StrainLimits
from sim.cloth.material import Material
from sim.cloth.scene import GRAVITY
from sim.cloth.sizing import Remeshing
from sim.cloth.stiffness_tables import Evaluation
from sim.effects import EFFECTS
from sim.integrate.backend import Backend
from sim.integrate.implicit import AirShape
from sim.run import blowing
from sim.run.blowing import Logs, WindSamples
from sim.run.simulation_recipe import (
    DTYPES,
    Attachment,
    EffectSpec,
    GivenCloth,
    IntegratorSpec,
    MaterialSpec,
    Recipe,
    SceneSpec,
    Shape,
    TimeSpec,
    WindSpec,
)

_GUST_LENGTH = 60.0  # m, integral length scale near the ground; see sim.wind.spectral_wind


SCENES = Shelf(folder="scenes", noun="recipe")


def load(source: str, *, logs: Logs | None = None) -> Recipe:
    """Reads the recipe of that name in the catalog, of a `.toml` file, or of an ArcSim scene
    `.json`.

    Args:
        logs: gives the logs of a lake that recipes name.

    Raises:
        NotFoundError: no such file.
        UnknownNameError: no such recipe; a key, name or option that is not known.
        InputError: a value that does not fit, or a scene that cannot be simulated.
    """
    if source.endswith(".json"):
        return _of_scene_file(local_path(source))
    file = SCENES.find(source)
    content = parse_recipe(file.text, where=file.where)
    return of_content(content, name=file.name, folder=file.folder, where=file.where, logs=logs)


def parse(text: str, *, name: str, folder: Path, where: str) -> Recipe:
    """Reads a recipe from its text.

    Args:
        folder: that the files it names are relative to.

    Raises:
        UnknownNameError, InputError: as `load`.
    """
    return of_content(parse_recipe(text, where=where), name=name, folder=folder, where=where)


@dataclass(frozen=True, kw_only=True)
class _SimulationTables:
    """The tables of a recipe; those that depend on others are read after them."""

    title: str = ""
    seed: Seed = 0
    count: Count = 1
    batch: Count | None = None
    precision: Annotated[str, Named("precision", DTYPES)] = "float32"
    scene: Mapping[str, Any]
    material: _Cloth
    wind: Mapping[str, Any]
    contact: Contact | None = None
    limits: Mapping[str, Any] | None = None
    remeshing: Remeshing | None = None
    integrator: IntegratorSpec
    time: TimeSpec
    effects: Mapping[Annotated[str, Named("effect", EFFECTS)], Mapping[str, Any]]


@dataclass(frozen=True, kw_only=True)
class _Cloth:
    """[material]."""

    WAS: ClassVar = KEYS
    name: str | None = None
    names: tuple[str, ...] = ()
    file: str | None = None
    table: Mapping[str, Any]
    area_weight: PositiveQuantity | None = None
    area_weight_factor: PositiveQuantity = 1.0
    stretching_factor: PositiveQuantity = 1.0
    bending_factor: NotNegativeQuantity = 1.0
    bending_factors: NotNegativeQuantity = 1.0
    damping: NotNegativeQuantity | None = None


@dataclass(frozen=True, kw_only=True)
class _Scene:
    """[scene], the keys of every shape."""

    shape: Shape = Shape.FLAG
    evaluation: Evaluation = Evaluation.ARCSIM
    start_noise: NotNegative = 0.0


@dataclass(frozen=True, kw_only=True)
class _SceneFile(_Scene):
    file: str
    root: str | None = None
    accept: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class _HandledScene(_Scene):
    rigid: bool = False
    stiffness: Positive | None = None
    gravity: float = -GRAVITY[2]


@dataclass(frozen=True, kw_only=True)
class _Sheet(_HandledScene):
    width: Positive | None = None
    height: Positive | None = None
    columns: Count | None = None
    attachment: Attachment = Attachment.CORNERS


@dataclass(frozen=True, kw_only=True)
class _Mesh(_HandledScene):
    rest: tuple[tuple[float, float], ...] = ()
    faces: tuple[tuple[Index, Index, Index], ...] = ()
    held: tuple[Index, ...] = ()
    anchors: tuple[tuple[float, float, float], ...] = ()


_FORCES: Mapping[str, Mapping[str, Any]] = {
    "quadratic-normal": {"density": NotNegative, "drag": NotNegative},
    "stokes": {"viscosity": NotNegative},
}
"""Force of the air → its keys in [wind]."""
_FORCE = "quadratic-normal"
"""The force where a recipe names none."""
_STEADY: Mapping[str, Any] = {
    "speed": Annotated[Quantity, Meta(ge=0.0, le=100.0)],
    "toward": AngleQuantity,
    "vertical": float,
}
"""Keys of a steady wind."""
_BATCH = 16
"""Members a batch where a recipe does not say."""
_LIMITS = {"low": float, "high": float, "sweeps": Count}


def of_content(
    content: Mapping[str, Any], *, name: str, folder: Path, where: str, logs: Logs | None = None
) -> Recipe:
    """Builds a recipe from the content of its TOML.

    Args:
        folder: that the files it names are relative to.
        logs: gives the logs of a lake that it names.

    Raises:
        UnknownNameError, InputError: as `load`.
    """
    form = read(_SimulationTables, content, where=where)
    scene = _scene(form.scene, folder, where=f"{where} [scene]")
    arcsim = None if scene.arcsim is None else scene.arcsim.scene
    remeshing = form.remeshing or (arcsim and arcsim.remeshing)
    limits = arcsim and arcsim.limits
    if form.limits is not None or limits is not None:
        sweeps = 1  # of small steps
        if form.integrator.name == "implicit":
            sweeps = SWEEPS if remeshing is None else REMESHED_SWEEPS
        base = replace(limits or StrainLimits(), sweeps=sweeps)
        limits = replace(base, **entries(_LIMITS, form.limits or {}, where=f"{where} [limits]"))
    return Recipe(
        name=name,
        title=form.title or name,
        seed=form.seed,
        count=form.count,
        batch=form.batch or (_BATCH if remeshing is None else 1),
        precision=form.precision,
        scene=scene,
        material=_material(form.material, folder, scene, where=f"{where} [material]"),
        wind=_wind(form.wind, scene, form.time, logs, where=f"{where} [wind]"),
        contact=form.contact or (arcsim and arcsim.contact),
        limits=limits,
        remeshing=remeshing,
        integrator=_integrator(
            form.integrator, content.get("integrator", {}), where=f"{where} [integrator]"
        ),
        time=form.time,
        effects={
            key: _effect(key, effect, where=f"{where} [effects] [{key}]")
            for key, effect in form.effects.items()
        },
    )


def _scene(content: Mapping[str, Any], folder: Path, *, where: str) -> SceneSpec:
    shape = value(Shape, content.get("shape", Shape.FLAG.value), key="shape", where=where)
    if shape is Shape.ARCSIM:
        arcsim = read(_SceneFile, content, where=where)
        root = None if arcsim.root is None else folder / local_path(arcsim.root)
        file = read_scene(folder / local_path(arcsim.file), root=root, accept=arcsim.accept)
        return _arcsim(file, noise=arcsim.start_noise, evaluation=arcsim.evaluation)
    if shape is Shape.MESH:
        return _given_mesh(read(_Mesh, content, where=where), where=where)
    sheet, square = read(_Sheet, content, where=where), shape is Shape.HANGING_CLOTH
    width = sheet.width or (1.0 if square else 1.5)
    if square and sheet.attachment is Attachment.HOIST:
        raise UsageError(
            "a hanging cloth has no hoist", where=where, fix='take attachment = "corners"'
        )
    return SceneSpec(
        shape=shape,
        width=width,
        height=sheet.height or (width if square else width * 2 / 3),
        columns=sheet.columns or (20 if square else 30),
        attachment=sheet.attachment,
        start_noise=sheet.start_noise,
        evaluation=sheet.evaluation,
        gravity=sheet.gravity,
        stiffness=_stiffness(sheet, where=where),
    )


def _stiffness(scene: _HandledScene, *, where: str) -> float:
    """Stiffness of the handles [N/m]."""
    if scene.rigid and scene.stiffness:
        raise UsageError(
            "both rigid and a stiffness are given", where=where, fix="keep one of them"
        )
    return math.inf if scene.rigid else scene.stiffness or ARCSIM_STIFFNESS


def _given_mesh(mesh: _Mesh, *, where: str) -> SceneSpec:
    cloth = GivenCloth(rest=mesh.rest, faces=mesh.faces, held=mesh.held, anchors=mesh.anchors)
    used = [vertex for face in cloth.faces for vertex in face]
    if not cloth.rest or not cloth.faces or not cloth.held or len(cloth.held) != len(cloth.anchors):
        raise InputError(
            f"a mesh of {len(cloth.rest)} vertices and {len(cloth.faces)} faces, {len(cloth.held)} "
            "of them held at "
            f"{len(cloth.anchors)} anchors",
            where=where,
            fix="give rest, faces, held, an anchor for each held",
        )
    if max(*used, *cloth.held) >= len(cloth.rest):
        raise InputError(
            f"vertex {max(*used, *cloth.held)} is beyond the {len(cloth.rest)} of the cloth",
            where=where,
            fix="number them from 0",
        )
    width, height = (max(axis) - min(axis) for axis in zip(*cloth.rest, strict=True))
    return SceneSpec(
        shape=Shape.MESH,
        width=width,
        height=height,
        columns=0,
        attachment=Attachment.CORNERS,
        start_noise=mesh.start_noise,
        evaluation=mesh.evaluation,
        gravity=mesh.gravity,
        stiffness=_stiffness(mesh, where=where),
        given=cloth,
        content=digest(canonical(vars(cloth).copy())),
    )


def _arcsim(scene: ArcsimScene, *, noise: float, evaluation: Evaluation) -> SceneSpec:
    rest, gravity = scene.scene.mesh.rest, scene.scene.gravity
    width, height = (float(side) for side in rest.max(axis=0) - rest.min(axis=0))
    content = {
        "positions": scene.scene.position.tolist(),
        "rest": rest.tolist(),
        "faces": scene.scene.mesh.faces.tolist(),
        "handles": list(scene.scene.handles.vertices),
        "stiffness": scene.scene.handles.stiffness,
        "gravity": list(gravity),
    }
    return SceneSpec(
        shape=Shape.ARCSIM,
        width=width,
        height=height,
        columns=0,
        attachment=Attachment.CORNERS,
        start_noise=noise,
        evaluation=evaluation,
        gravity=-gravity[2],
        arcsim=scene,
        content=digest(canonical(content)),
    )


def _material(cloth: _Cloth, folder: Path, scene: SceneSpec, *, where: str) -> MaterialSpec:
    return MaterialSpec(
        bases=_bases(cloth, folder, scene, where=where),
        area_weight=cloth.area_weight,
        area_weight_factor=cloth.area_weight_factor,
        stretching=cloth.stretching_factor,
        bending=cloth.bending_factor,
        bending_each=cloth.bending_factors,
        damping=cloth.damping,
    )


def _bases(cloth: _Cloth, folder: Path, scene: SceneSpec, *, where: str) -> tuple[Material, ...]:
    if sum(map(bool, (cloth.name, cloth.names, cloth.file, cloth.table))) > 1:
        raise UsageError(
            "more than one of name, names, file and table is given",
            where=where,
            fix="keep one of them",
        )
    if cloth.table:
        return (Material.from_mapping(cloth.table, name=str(cloth.table.get("title", "material"))),)
    chosen = (cloth.name,) if cloth.name is not None else cloth.names
    if chosen:
        return tuple(material.named_material(name, where=where) for name in chosen)
    if cloth.file is not None:
        return (material_file(folder / local_path(cloth.file)),)
    if scene.arcsim is not None:
        return (scene.arcsim.scene.material,)
    raise InputError(
        "no material is named", where=where, fix='add name = "camel-ponte-roma", or a file'
    )


def material_file(path: Path) -> Material:
    """Reads the material of a file, TOML or ArcSim's JSON.

    Raises:
        NotFoundError: no such file.
        InputError: one that is no material.
    """
    if path.suffix == ".json":
        return read_material(path)
    return Material.from_mapping(
        parse_recipe(read_recipe(path).text, where=str(path)), name=path.stem
    )


def _wind(
    content: Mapping[str, Any],
    scene: SceneSpec,
    time: TimeSpec,
    logs: Logs | None = None,
    *,
    where: str,
) -> WindSpec:
    if scene.arcsim is not None and not content:
        return _mean_wind(scene.arcsim.scene.wind, force=scene.arcsim.scene.air)
    force_types = _FORCES.get(str(content.get("force")), _FORCES[_FORCE])
    source = blowing.source(content, where=where)
    types = {"force": Annotated[str, Named("wind force", AIR_FORCES)], **force_types}
    values = entries(
        {**types, **(blowing.TYPES[source] if source else _STEADY)}, content, where=where
    )
    force: AirForce = AIR_FORCES[values.get("force", _FORCE)](
        **{key: values[key] for key in force_types if key in values}
    )
    if source:
        samples = blowing.read(
            values,
            before=time.first,
            duration=(time.frames - 1) / time.rate,
            logs=logs,
            where=where,
        )
        return _mean_wind(
            samples.mean(time.frames, time.rate).tolist(), force=force, samples=samples
        )
    if "speed" not in values:
        raise InputError(
            "no wind speed is given",
            where=where,
            fix="add speed = 4.0 (m/s), or a range; a log or samples",
        )
    return WindSpec(force=force, **{key: values[key] for key in _STEADY if key in values})


def _mean_wind(
    velocity: Sequence[float], *, force: AirForce, samples: WindSamples | None = None
) -> WindSpec:
    """Returns the wind whose mean is a velocity (3,) of the air [m/s]."""
    x, y, z = velocity
    return WindSpec(
        speed=math.hypot(x, y), toward=math.atan2(y, x), vertical=z, force=force, samples=samples
    )


def _integrator(spec: IntegratorSpec, content: Mapping[str, Any], *, where: str) -> IntegratorSpec:
    if spec.name != "implicit":
        if "air-shape" in content:
            raise UnknownNameError.of("key", "air-shape", ("name", "step", "backend"), where=where)
        return spec
    if spec.backend is Backend.WARP:
        raise UsageError(
            "the Warp kernel has only leapfrog steps, no implicit integration",
            where=where,
            fix='name = "symplectic", or another backend',
        )
    return replace(spec, step=5e-3 if spec.step is None else spec.step)


def _effect(name: str, content: Mapping[str, Any], *, where: str) -> EffectSpec:
    if name == "logged-gusts":
        raise UsageError(
            "logged gusts need a log, which an effect of a recipe cannot name",
            where=where,
            fix='name the log in [wind], as log = "NAME"',
        )
    described = EFFECTS[name].parameters()
    keys = {key: key.replace("_", "-") for key in described}
    types: dict[str, Any] = {
        keys[key]: Literal["prior"]
        if content.get(keys[key]) == "prior"
        else within(Quantity, *entry.admissible)
        for key, entry in described.items()
    }
    if name == "gusts":
        types["length"] = Positive
    values = entries(types, content, where=where)
    length = values.pop("length", _GUST_LENGTH) if name == "gusts" else None
    parameters: dict[str, Quantity] = {}
    for key, entry in described.items():
        drawn = values.get(keys[key], entry.null)
        parameters[key] = (
            Range(low=entry.prior[0], high=entry.prior[1]) if drawn == "prior" else drawn
        )
    return EffectSpec(parameters=parameters, length=length)


def _of_scene_file(path: Path) -> Recipe:
    """Reads an ArcSim scene as it is: its own steps and duration, from its first frame on."""
    file = read_scene(path)
    scene = _arcsim(file, noise=0.0, evaluation=Evaluation.ARCSIM)
    where = f"scene {path}"
    time = TimeSpec(settle=0.0, frames=file.frames + 1, rate=1 / file.frame_time)
    return Recipe(
        name=path.stem,
        title=path.name,
        seed=0,
        count=1,
        batch=1,
        precision="float64",
        scene=scene,
        material=_material(_Cloth(table={}), path.parent, scene, where=where),
        wind=_wind({}, scene, time, where=where),
        contact=file.scene.contact,
        limits=file.scene.limits,
        remeshing=file.scene.remeshing,
        integrator=IntegratorSpec(name="implicit", step=file.step, air_shape=AirShape.PREVIOUS),
        time=time,
        effects={},
    )
