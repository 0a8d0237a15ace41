"""Recipes as TOML. Parsed here and nowhere else; unknown keys are refused, the nearest is named.

All values are SI, angles radians. A *quantity* is a number, or `{ low = …, high = …, scale = "linear" | "log" }`, from
which each member draws its own value.

    title, seed, count, batch, precision
    [scene]      shape = "flag" | "hanging-cloth" | "arcsim" | "mesh"; width, height, columns, attachment;
                 start-noise; file, root, accept (of an ArcSim scene); rest = [[u, v], …], faces, held, anchors =
                 [[x, y, z], …] (of a mesh); stiffness (of the handles), or rigid = true; evaluation = "arcsim" |
                 "corrected"; gravity
    [material]   name (of catalogs/materials), names (of which each member draws one), file (TOML, or ArcSim JSON) or
                 table (what such a TOML file holds); density, density-factor, stretching-factor,
                 bending-factor, damping: quantities; bending-factors: a quantity drawn for each of the 15 coefficients
    [wind]       speed [m/s], toward (where the air goes to, from +x towards +y) [rad], or toward-deg in degrees:
                 quantities; vertical [m/s]. In place of a steady wind: samples = [[time, x, y, z], …], in s since the
                 first frame that is kept and m/s; or log (a wind or recording of the lake), log-start (the first
                 frame that is kept, since the log's first sample [s]), toward (of the log's vector mean, an angle);
                 beyond = "refuse" | "hold" (what a run longer than the samples gets). With each of them:
                 force = "quadratic-normal" | "stokes"; density, drag | viscosity
    [contact]    thickness, stiffness, friction; without the table, layers pass through each other
    [limits]     low, high, sweeps; without the table, strain has no limits
    [integrator] name = "symplectic" | "implicit"; step; air-shape (of the implicit); backend = "auto" | "torch" |
                 "kernel" | "warp"
    [time]       settle, frames, rate
    [effects.NAME]  parameters of an effect (quantities, or "prior" for its prior range)

Without [material], [wind], [contact] or [limits] an ArcSim scene's own are taken. `count`, `batch` and `title` do not
change what a member is; everything else does.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from flagdata.addresses import local_path
from flagdata.errors import InputError, UnknownNameError, UsageError
from flagdata.provenance import canonical, digest
from flagdata.recipes import Shelf, parsed, read_recipe
from flagdata.tables import COUNT, NOT_NEGATIVE, POSITIVE, SEED_LIMIT, Quantity, Range, Table
from sim import material
from sim.air import AIR_FORCES, AirForce, QuadraticNormal, Stokes
from sim.arcsim import SWEEPS, ArcsimScene, read_material, read_scene
from sim.contact import Contact
from sim.effects import EFFECTS
from sim.handles import ARCSIM_STIFFNESS
from sim.integrate import INTEGRATORS
from sim.integrate.backend import Backend
from sim.integrate.implicit import AirShape
from sim.limits import StrainLimits
from sim.material import Material
from sim.run import blowing
from sim.run.blowing import Logs
from sim.run.recipe import (
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
from sim.scene import GRAVITY
from sim.tables import Evaluation

_GUST_LENGTH = 60.0  # m, integral length scale near the ground; see sim.wind.spectral


SCENES = Shelf(folder="scenes", noun="recipe")


def load(source: str, *, logs: Logs | None = None) -> Recipe:
    """The recipe of that name in the catalog, of a `.toml` file, or of an ArcSim scene `.json`.

    Args:
        logs: gives the logs of a lake that recipes name.

    Raises:
        NotFoundError: no such file.
        UnknownNameError: no such recipe; a key, name or option that is not known.
        InputError: a value that does not fit, or a scene that cannot be simulated.
    """
    if source.endswith(".json"):
        return _of_scene_file(local_path(source))
    found = SCENES.find(source)
    content = parsed(found.text, where=found.where)
    return of_content(content, name=found.name, folder=found.folder, where=found.where, logs=logs)


def parse(text: str, *, name: str, folder: Path, where: str) -> Recipe:
    """A recipe from its text.

    Args:
        folder: that the files it names are relative to.

    Raises:
        UnknownNameError, InputError: as `load`.
    """
    return of_content(parsed(text, where=where), name=name, folder=folder, where=where)


def of_content(content: Mapping[str, Any], *, name: str, folder: Path, where: str, logs: Logs | None = None) -> Recipe:
    """A recipe from what its TOML holds.

    Args:
        folder: that the files it names are relative to.
        logs: gives the logs of a lake that it names.

    Raises:
        UnknownNameError, InputError: as `load`.
    """
    top = Table(content, where=where)
    scene = _scene(top.table("scene"), folder)
    integrator = _integrator(top.table("integrator"))
    given = None if scene.arcsim is None else scene.arcsim.scene
    contact = given and given.contact
    if "contact" in top:
        contact = top.table("contact").record(Contact, thickness=POSITIVE, stiffness=POSITIVE, friction=NOT_NEGATIVE)
    bounds = given and given.limits
    limits = _limits(top.table("limits"), bounds, integrator) if bounds is not None or "limits" in top else None
    time = top.table("time").record(TimeSpec, settle=NOT_NEGATIVE, frames=COUNT, rate=POSITIVE)
    recipe = Recipe(
        name=name,
        title=top.text("title", name) or name,
        seed=top.whole("seed", 0, least=0, most=SEED_LIMIT),
        count=top.whole("count", 1, least=1),
        batch=top.whole("batch", 16, least=1),
        precision=top.named("precision", "float32", DTYPES, noun="precision"),
        scene=scene,
        material=_material(top.table("material"), folder, scene),
        wind=_wind(top.table("wind"), scene, time, logs),
        contact=contact,
        limits=limits,
        integrator=integrator,
        time=time,
        effects=_effects(top.table("effects")),
    )
    top.done()
    return recipe


def _scene(table: Table, folder: Path) -> SceneSpec:
    shape = table.choice("shape", Shape.FLAG)
    evaluation = table.choice("evaluation", Evaluation.ARCSIM)
    noise = table.number("start-noise", 0.0, least=0.0)
    if shape is Shape.ARCSIM:
        file, root = table.text("file", None), table.text("root", None)
        accept = table.texts("accept")
        table.done()
        if file is None:
            raise InputError("no file is named", where=table.where, fix='add file = "scene.json"')
        content = read_scene(
            folder / local_path(file), root=None if root is None else folder / local_path(root), accept=accept
        )
        return _arcsim(content, noise=noise, evaluation=evaluation)
    stiffness = _stiffness(table)
    if shape is Shape.MESH:
        return _given(table, noise=noise, evaluation=evaluation, stiffness=stiffness)
    square = shape is Shape.HANGING_CLOTH
    width = table.number("width", 1.0 if square else 1.5, above=0.0)
    height = table.number("height", width if square else width * 2 / 3, above=0.0)
    columns = table.whole("columns", 20 if square else 30, least=1)
    attachment = table.choice("attachment", Attachment.CORNERS)
    gravity = table.number("gravity", -GRAVITY[2])
    table.done()
    if square and attachment is Attachment.HOIST:
        raise UsageError("a hanging cloth has no hoist", where=table.where, fix='take attachment = "corners"')
    return SceneSpec(
        shape=shape,
        width=width,
        height=height,
        columns=columns,
        attachment=attachment,
        start_noise=noise,
        evaluation=evaluation,
        gravity=gravity,
        stiffness=stiffness,
    )


def _stiffness(table: Table) -> float:
    """Stiffness of the handles [N/m]."""
    rigid, given = table.flag("rigid"), "stiffness" in table
    if rigid and given:
        raise UsageError("both rigid and a stiffness are given", where=table.where, fix="keep one of them")
    return math.inf if rigid else table.number("stiffness", ARCSIM_STIFFNESS, above=0.0)


def _given(table: Table, *, noise: float, evaluation: Evaluation, stiffness: float) -> SceneSpec:
    cloth = GivenCloth(
        rest=tuple((u, v) for u, v in table.points("rest")),
        faces=tuple((a, b, c) for a, b, c in table.indices("faces", 3)),
        held=tuple(vertex for (vertex,) in table.indices("held", 1)),
        anchors=tuple((x, y, z) for x, y, z in table.points("anchors", 3)),
    )
    gravity = table.number("gravity", -GRAVITY[2])
    table.done()
    used = [vertex for face in cloth.faces for vertex in face]
    if not cloth.rest or not cloth.faces or not cloth.held or len(cloth.held) != len(cloth.anchors):
        raise InputError(
            f"a mesh of {len(cloth.rest)} vertices and {len(cloth.faces)} faces, {len(cloth.held)} of them held at "
            f"{len(cloth.anchors)} anchors",
            where=table.where,
            fix="give rest, faces, held, an anchor for each held",
        )
    if max(*used, *cloth.held) >= len(cloth.rest):
        raise InputError(
            f"a vertex {max(*used, *cloth.held)} of {len(cloth.rest)}", where=table.where, fix="number them from 0"
        )
    width, height = (max(axis) - min(axis) for axis in zip(*cloth.rest, strict=True))
    return SceneSpec(
        shape=Shape.MESH,
        width=width,
        height=height,
        columns=0,
        attachment=Attachment.CORNERS,
        start_noise=noise,
        evaluation=evaluation,
        gravity=gravity,
        stiffness=stiffness,
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


def _material(table: Table, folder: Path, scene: SceneSpec) -> MaterialSpec:
    bases = _bases(table, folder, scene)
    spec = MaterialSpec(
        bases=bases,
        density=table.quantity("density", bases[0].density, above=0.0) if "density" in table else None,
        density_factor=table.quantity("density-factor", 1.0, above=0.0),
        stretching=table.quantity("stretching-factor", 1.0, above=0.0),
        bending=table.quantity("bending-factor", 1.0, least=0.0),
        bending_each=table.quantity("bending-factors", 1.0, least=0.0),
        damping=table.quantity("damping", bases[0].damping, least=0.0) if "damping" in table else None,
    )
    table.done()
    return spec


def _bases(table: Table, folder: Path, scene: SceneSpec) -> tuple[Material, ...]:
    name, names_, file = table.text("name", None), table.texts("names"), table.text("file", None)
    inline = table.mapping("table")
    if sum(bool(given) for given in (name, names_, file, inline)) > 1:
        raise UsageError(
            "more than one of name, names, file and table is given", where=table.where, fix="keep one of them"
        )
    if inline:
        return (Material.from_mapping(inline, name=str(inline.get("title", "material"))),)
    chosen = (name,) if name is not None else names_
    if chosen:
        return tuple(material.named(each, where=table.where) for each in chosen)
    if file is not None:
        return (material_file(folder / local_path(file)),)
    if scene.arcsim is not None:
        return (scene.arcsim.scene.material,)
    raise InputError("no material is named", where=table.where, fix='add name = "camel-ponte-roma", or a file')


def material_file(path: Path) -> Material:
    """The material of a file, TOML or ArcSim's JSON.

    Raises:
        NotFoundError: no such file.
        InputError: one that is no material.
    """
    if path.suffix == ".json":
        return read_material(path)
    return Material.from_mapping(parsed(read_recipe(path).text, where=str(path)), name=path.stem)


def _wind(table: Table, scene: SceneSpec, time: TimeSpec, logs: Logs | None = None) -> WindSpec:
    if scene.arcsim is not None and not table.names():
        x, y, z = scene.arcsim.scene.wind
        return WindSpec(speed=math.hypot(x, y), toward=math.atan2(y, x), vertical=z, force=scene.arcsim.scene.air)
    name = table.named("force", "quadratic-normal", AIR_FORCES, noun="wind force")
    force: AirForce
    if name == "stokes":
        force = Stokes(viscosity=table.number("viscosity", Stokes().viscosity, least=0.0))
    else:
        base = QuadraticNormal()
        force = QuadraticNormal(
            density=table.number("density", base.density, least=0.0), drag=table.number("drag", base.drag, least=0.0)
        )
    samples = blowing.read(table, before=time.first, duration=(time.frames - 1) / time.rate, logs=logs)
    if samples is not None:
        table.done()
        x, y, z = samples.mean(time.frames, time.rate).tolist()
        return WindSpec(speed=math.hypot(x, y), toward=math.atan2(y, x), vertical=z, force=force, samples=samples)
    spec = WindSpec(
        speed=table.quantity("speed", 0.0, least=0.0, most=100.0),
        toward=table.angle("toward", 0.0),
        vertical=table.number("vertical", 0.0),
        force=force,
    )
    table.done()
    if "speed" not in table:
        raise InputError(
            "no wind speed is given", where=table.where, fix="add speed = 4.0 (m/s), or a range; a log or samples"
        )
    return spec


def _limits(table: Table, given: StrainLimits | None, integrator: IntegratorSpec) -> StrainLimits:
    """Those of the table, in what it leaves out those of an ArcSim scene; small steps need one sweep."""
    base = replace(given or StrainLimits(), sweeps=SWEEPS if integrator.name == "implicit" else 1)
    limits = StrainLimits(
        low=table.number("low", base.low),
        high=table.number("high", base.high),
        sweeps=table.whole("sweeps", base.sweeps, least=1),
    )
    table.done()
    return limits


def _integrator(table: Table) -> IntegratorSpec:
    name = table.named("name", "symplectic", INTEGRATORS, noun="integrator")
    step = table.number("step", 0.0, above=0.0) if "step" in table else None
    air_shape = AirShape.CURRENT
    if name == "implicit":
        step = 5e-3 if step is None else step
        air_shape = table.choice("air-shape", AirShape.CURRENT)
    backend = table.choice("backend", Backend.AUTO)
    if name == "implicit" and backend is Backend.WARP:
        raise UsageError(
            "the Warp kernel has only leapfrog steps, no implicit integration",
            where=table.where,
            fix='name = "symplectic", or another backend',
        )
    table.done()
    return IntegratorSpec(name=name, step=step, air_shape=air_shape, backend=backend)


def _effects(table: Table) -> dict[str, EffectSpec]:
    specs: dict[str, EffectSpec] = {}
    for name in table.names():
        if name not in EFFECTS:
            raise UnknownNameError.of("effect", name, EFFECTS, where=table.where)
        if name == "logged-gusts":
            raise UsageError(
                "logged gusts need a log, which an effect of a recipe cannot name",
                where=table.where,
                fix='name the log in [wind], as log = "NAME"',
            )
        inner = table.table(name)
        length = inner.number("length", _GUST_LENGTH, above=0.0) if name == "gusts" else None
        parameters: dict[str, Quantity] = {}
        for key, described in EFFECTS[name].parameters().items():
            spelled = key.replace("_", "-")
            if spelled not in inner:
                parameters[key] = described.null
                continue
            least, most = described.admissible
            if inner.says(spelled, "prior"):
                parameters[key] = Range(low=described.prior[0], high=described.prior[1])
            else:
                parameters[key] = inner.quantity(spelled, described.null, least=least, most=most)
        inner.done()
        specs[name] = EffectSpec(parameters=parameters, length=length)
    table.done()
    return specs


def _of_scene_file(path: Path) -> Recipe:
    """An ArcSim scene as it is: its own steps and duration, from its first frame on."""
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
        material=_material(Table({}, where=where), path.parent, scene),
        wind=_wind(Table({}, where=where), scene, time),
        contact=file.scene.contact,
        limits=file.scene.limits,
        integrator=IntegratorSpec(name="implicit", step=file.step, air_shape=AirShape.PREVIOUS),
        time=time,
        effects={},
    )
