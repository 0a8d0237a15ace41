"""Experiments as TOML. Parsed here and nowhere else; unknown keys are refused, the nearest is named.

    title, up           "z", "-y", …: the axis of the recordings that points up; all other entries use z up
    [test]              level of the global test, nulls: how many null recordings
    [cloth]             width, height, or mesh (an OBJ with texture coordinates in metres); vertices of the model mesh
    [material]          name (of catalogs/materials) or file (TOML, or ArcSim JSON); thicken, density, damping,
                        stretching-factor, bending-factor
    [pins]              at = "hoist-corners" | "top-corners" | "hoist", or points = [[u, v], …]; stiffness, or
                        rigid = true
    [air]               gravity, density, drag (of the quadratic normal force)
    [[recording]]       source: an artifact's id, a folder of meshes, or a marker table; take (a recording of a table
                        that holds several), name, rate, unit, rest-unit, noise
    [recording.wind]    velocity = [x, y, z], where the air goes to; or speed and toward (from +x towards +y); or log
                        (an artifact's id or an anemometer's file) with axis or north (where it lies, from +x towards
                        +y), and offset or start (ISO 8601);
                        sensor (a recipe of catalogs/sensors or a file) and zone, where the log does not state them;
                        accept (the hash that confirms a drafted reading, as a refusal shows it)

All values are SI and radians; toward-deg, north-deg and direction-sigma-deg are in degrees. What a recording's own
description says may be left out. Paths are relative to the file.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

from flagdata import timebase
from flagdata.addresses import local_path
from flagdata.errors import InputError, NotFoundError, UnknownNameError, UsageError
from flagdata.findings import Finding
from flagdata.ingest.anemometer import WindOptions
from flagdata.ingest.anemometer.confirm import UNASKED, Accepting, Confirm
from flagdata.ingest.markers import MarkerOptions
from flagdata.ingest.meshes import read_obj
from flagdata.lake import Lake
from flagdata.recipes import parsed, read_recipe
from flagdata.schema import Kind
from flagdata.tables import DEGREES, NOT_NEGATIVE, POSITIVE, Table
from measure.observe import markers, meshes, wind
from measure.observe.cloth import VERTICES, outline
from measure.observe.experiment import Observed, observe
from measure.observe.observation import Observation, Up
from measure.observe.setup import Hold, Setup, sheet
from measure.observe.trajectory import DENSITY_UNCERTAINTY, WindTrack
from measure.observe.wind import LogPlacement
from sim.air import QuadraticNormal
from sim.material import MATERIALS, Material, named
from sim.run.reading import material_file


@dataclass(frozen=True, kw_only=True)
class WindSource:
    """A constant velocity [m/s], or a log, how it is read if it is a file, and how it lies beside the recording.

    Attributes:
        confirm: of a file, asks whether a drafted reading is right.
        gain, direction, clock: standard deviations of what it may be off by, see `WindTrack`; None for the usual ones.
    """

    velocity: tuple[float, float, float] | None = None
    log: str = ""
    placement: LogPlacement | None = None
    options: WindOptions | None = None
    confirm: Confirm = UNASKED
    gain: float | None = None
    direction: float | None = None
    clock: float | None = None

    def certain(self, track: WindTrack) -> WindTrack:
        """The track with its stated uncertainty."""
        said = {"gain": self.gain, "direction": self.direction, "clock": self.clock}
        return replace(track, **{name: value for name, value in said.items() if value is not None})


@dataclass(frozen=True, kw_only=True)
class RecordingSource:
    """One recording of an experiment.

    Attributes:
        source: an artifact's id, or a path.
        take: the recording of a marker table that holds several; empty for the only one.
        name: what reports call it; empty for its own.
        rate: frames a second [Hz]; None for what the source says.
        unit, rest_unit: of positions and, in a marker table, of u and v.
        noise: standard deviation of a coordinate [m]; None to estimate it.
        wind: beside it; None for what the source says.
    """

    source: str
    take: str = ""
    name: str = ""
    rate: float | None = None
    unit: str = "m"
    rest_unit: str | None = None
    noise: float | None = None
    wind: WindSource | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class ExperimentRecipe:
    """What to read, and what is known beside it.

    Attributes:
        title: of the report.
        up: axis of the recordings that points up.
        setup: of the cloth.
        recordings: that it names; none where they are given beside it.
        folder: that paths are relative to.
        level: of the global test; None for the usual one.
        nulls: how many null recordings; None for as many as usual.
    """

    title: str
    up: Up
    setup: Setup
    recordings: tuple[RecordingSource, ...]
    folder: Path
    level: float | None = None
    nulls: int | None = None


def load(path: Path) -> ExperimentRecipe:
    """The recipe in a file, of a whole experiment.

    Raises:
        InputError: it names no recording.
        FlagdataError: as `parse`.
    """
    recipe = parse(path)
    if not recipe.recordings:
        raise InputError("no recording is named", where=str(path), fix="add a table [[recording]]")
    return recipe


def parse(path: Path) -> ExperimentRecipe:
    """The recipe in a file, which may leave the recordings out.

    Raises:
        NotFoundError: no such file, or one that it names.
        UnknownNameError: a key or name that is not known.
        InputError: a value that does not fit.
        UsageError: values that do not fit together.
    """
    top = Table(parsed(read_recipe(path).text, where=str(path)), where=str(path))
    folder = path.parent
    test = top.table("test")
    recipe = ExperimentRecipe(
        title=top.text("title", path.stem) or path.stem,
        up=top.choice("up", Up.Z),
        folder=folder,
        setup=_setup(top, folder),
        recordings=tuple(_recording(table, folder) for table in top.tables("recording")),
        level=test.number("level", 0.0, above=0.0) if "level" in test else None,
        nulls=test.whole("nulls", 0, least=1) if "nulls" in test else None,
    )
    test.done()
    top.done()
    return recipe


def read(recipe: ExperimentRecipe, lake: Lake | None = None) -> Observed:
    """The experiment of a recipe, checked.

    Args:
        lake: that artifacts are looked up in.

    Raises:
        NotFoundError: a source that is neither a path nor an artifact.
        FlagdataError: a source that cannot be read or used.
    """
    return observe([_observation(source, recipe, lake) for source in recipe.recordings], recipe.setup)


def _setup(top: Table, folder: Path) -> Setup:
    flat = top.table("cloth")
    width, height, mesh = (
        flat.number("width", 0.0, above=0.0) if "width" in flat else None,
        flat.number("height", 0.0, above=0.0) if "height" in flat else None,
        flat.text("mesh", None),
    )
    if (width is None) != (height is None) or (mesh is not None and width is not None):
        raise UsageError("a cloth of half a size, or of two", where=flat.where, fix="give width and height, or a mesh")
    corners = None
    if width is not None and height is not None:
        corners = sheet(width, height)
    elif mesh is not None:
        shape = read_obj(folder / local_path(mesh))
        corners = outline(shape.rest, shape.faces, where=str(folder / mesh))
    vertices = flat.whole("vertices", VERTICES, least=16)
    flat.done()
    pins, stiffness, carried = _pins(top.table("pins"))
    stuff = top.table("material")
    mass_known, uncertainty = _weighed(stuff)
    air = top.table("air")
    gravity = air.number("gravity", 0.0, least=0.0) if "gravity" in air else None
    force = None
    if "density" in air or "drag" in air:
        base = QuadraticNormal()
        force = QuadraticNormal(
            density=air.number("density", base.density, least=0.0), drag=air.number("drag", base.drag, least=0.0)
        )
    air.done()
    return Setup(
        material=_material(stuff, folder),
        mass_known=mass_known,
        density_uncertainty=uncertainty,
        outline=corners,
        pins=pins,
        carried=carried,
        stiffness=stiffness,
        gravity=gravity,
        air=force,
        vertices=vertices,
    )


def _weighed(stuff: Table) -> tuple[bool, float]:
    """Whether the cloth's mass is known, and the relative standard uncertainty of its density."""
    unknown = stuff.flag("mass-unknown")
    if "density-uncertainty" not in stuff:
        return not unknown, DENSITY_UNCERTAINTY
    if unknown:
        raise UsageError(
            "both mass-unknown and a density-uncertainty are given",
            where=stuff.where,
            fix="keep mass-unknown for a cloth that nobody weighed, density-uncertainty for one whose density is known",
        )
    return True, stuff.number("density-uncertainty", DENSITY_UNCERTAINTY, above=0.0)


def _pins(table: Table) -> tuple[Hold | tuple[tuple[float, float], ...] | None, float | None, bool]:
    """Where they are, their stiffness, and whether they move."""
    points = tuple((u, v) for u, v in table.points("points"))
    at = table.choice("at", Hold.HOIST_CORNERS) if "at" in table else None
    if points and at is not None:
        raise UsageError("both at and points are given", where=table.where, fix="keep one of them")
    rigid = table.flag("rigid")
    stiffness = table.number("stiffness", 0.0, above=0.0) if "stiffness" in table else None
    if rigid and stiffness is not None:
        raise UsageError("both rigid and a stiffness are given", where=table.where, fix="keep one of them")
    carried = table.flag("carried")
    if carried and stiffness is not None:
        raise UsageError("pins that are carried hold rigidly", where=table.where, fix="leave the stiffness out")
    table.done()
    return at or points or None, math.inf if rigid else stiffness, carried


def _material(table: Table, folder: Path) -> Material | None:
    name, file = table.text("name", None), table.text("file", None)
    if name is None and file is None:
        table.done()
        return None
    if name is not None and file is not None:
        raise UsageError("both name and file are given", where=table.where, fix="keep one of them")
    if name is not None and name not in MATERIALS.names():
        raise UnknownNameError.of("material", name, MATERIALS.names(), where=table.where)
    base = named(name) if name is not None else material_file(folder / local_path(file or ""))
    thicken = table.number("thicken", 1.0, above=0.0)
    made = base.scaled(
        density=thicken,
        stretching=thicken * table.number("stretching-factor", 1.0, above=0.0),
        bending=thicken * table.number("bending-factor", 1.0, least=0.0),
    )
    made = replace(
        made,
        density=table.number("density", made.density, above=0.0),
        damping=table.number("damping", made.damping, least=0.0),
    )
    table.done()
    return made


def _recording(table: Table, folder: Path) -> RecordingSource:
    if not table.text("source", None):
        raise InputError("no source is named", where=table.where, fix="add source, an artifact's id or a path")
    return table.record(
        RecordingSource,
        {"wind": lambda: _wind(table.table("wind"), folder) if "wind" in table else None},
        rate=POSITIVE,
        noise=NOT_NEGATIVE,
    )


def _wind(table: Table, folder: Path) -> WindSource:
    velocity, log = table.numbers("velocity"), table.text("log", "") or ""
    gain, clock = (
        table.number(f"{name}-sigma", 0.0, least=0.0) if f"{name}-sigma" in table else None
        for name in ("gain", "clock")
    )
    direction = table.one_angle("direction-sigma", 0.0) if _stated(table, "direction-sigma") else None
    if direction is not None and direction < 0:
        raise InputError(f"direction-sigma is {direction:g}", where=table.where, fix="give a number of at least 0")
    given = [bool(velocity), "speed" in table, bool(log)]
    if sum(given) != 1:
        raise UsageError(f"{sum(given)} winds", where=table.where, fix="give one of velocity, speed and log")
    if log:
        axis = _triple(table, "axis", table.numbers("axis"))
        start = table.text("start", None)
        placement = LogPlacement(
            axis=axis,
            north=table.one_angle("north", 0.0) if _stated(table, "north") else None,
            offset=table.number("offset", 0.0) if "offset" in table else None,
            start=timebase.parse(start, where=f"{table.where} start") if start is not None else None,
        )
        sensor = table.text("sensor", None)
        if sensor is not None and (folder / local_path(sensor)).is_file():
            sensor = str(folder / sensor)
        options = WindOptions(recipe=sensor, zone=table.text("zone", None))
        confirm = Accepting(table.text("accept", None))
        table.done()
        return WindSource(
            log=log, placement=placement, options=options, confirm=confirm, gain=gain, direction=direction, clock=clock
        )
    if not velocity:
        speed, toward = table.number("speed", 0.0, least=0.0), table.one_angle("toward", 0.0)
        velocity = (speed * math.cos(toward), speed * math.sin(toward), 0.0)
    source = WindSource(velocity=_triple(table, "velocity", velocity), gain=gain, direction=direction, clock=clock)
    table.done()
    return source


def _stated(table: Table, angle: str) -> bool:
    """Whether an angle is given, in radians or degrees."""
    return any(key in table for key in (angle, angle + DEGREES))


def _triple(table: Table, key: str, values: tuple[float, ...]) -> tuple[float, float, float] | None:
    if not values:
        return None
    if len(values) != 3:
        raise InputError(f"{key} has {len(values)} numbers", where=table.where, fix="give [x, y, z]")
    return values[0], values[1], values[2]


def _observation(source: RecordingSource, recipe: ExperimentRecipe, lake: Lake | None) -> Observation:
    seen = _take(opened(source, recipe.folder, lake), source)
    return blown(replace(seen.turned(recipe.up), name=source.name or seen.name), source.wind, recipe.folder, lake)


def blown(seen: Observation, source: WindSource | None, folder: Path, lake: Lake | None) -> Observation:
    """A recording with its wind, if there is a source of it, and what was found on reading that.

    Raises:
        NotFoundError: a log that is neither a path nor an artifact.
        FlagdataError: as its reader.
    """
    if source is None:
        return seen
    track, found = _track(source, folder, lake)
    return replace(seen, wind=source.certain(track), findings=(*seen.findings, *found))


def opened(source: RecordingSource, folder: Path, lake: Lake | None) -> tuple[Observation, ...]:
    """All recordings of a source, as they are: neither turned, nor with the wind beside them.

    Raises:
        NotFoundError: neither a path nor an artifact.
        UsageError: options that say nothing of such a source.
        FlagdataError: as its reader.
    """
    return tuple(replace(seen, noise=source.noise) for seen in _read(source, folder, lake))


def _read(source: RecordingSource, folder: Path, lake: Lake | None) -> tuple[Observation, ...]:
    path = folder / local_path(source.source)
    if path.is_dir():
        _refuse(source, ("take", "rest_unit"), "a folder of meshes")
        return (meshes.from_folder(path, rate=source.rate, unit=source.unit),)
    if path.is_file():
        options = MarkerOptions(rate=source.rate, unit=source.unit, rest_unit=source.rest_unit)
        return markers.from_table(path, options)
    if lake is None:
        raise NotFoundError("no such file or folder", where=source.source, fix="check the path, or open a lake for ids")
    _refuse(source, ("take", "rate", "rest_unit"), "an artifact")
    if source.unit != "m":
        raise UsageError("an artifact is in metres", where=source.source, fix="leave the unit out")
    artifact = lake.artifact(source.source, kinds=(Kind.MARKERS, Kind.MESHES))
    if artifact.kind is Kind.MARKERS:
        return (markers.from_artifact(lake, artifact),)
    return (meshes.from_artifact(lake, artifact),)


def _refuse(source: RecordingSource, keys: tuple[str, ...], what: str) -> None:
    given = {"take": bool(source.take), "rate": source.rate is not None, "rest_unit": source.rest_unit is not None}
    for key in keys:
        if given[key]:
            fix = f"leave {key.replace('_', '-')} out"
            raise UsageError(f"{key.replace('_', '-')} means nothing for {what}", where=source.source, fix=fix)


def _take(found: tuple[Observation, ...], source: RecordingSource) -> Observation:
    if not source.take and len(found) > 1:
        raise UsageError(
            f"the table holds {len(found)} recordings",
            where=source.source,
            fix=f"add take, one of {', '.join(seen.name for seen in found)}",
        )
    for seen in found:
        if seen.name == source.take or not source.take:
            return seen
    raise UnknownNameError.of("recording", source.take, [seen.name for seen in found], where=source.source)


def _track(source: WindSource, folder: Path, lake: Lake | None) -> tuple[WindTrack, tuple[Finding, ...]]:
    if source.velocity is not None:
        return WindTrack.constant(source.velocity), ()
    placement = source.placement or LogPlacement()
    path = folder / local_path(source.log)
    if path.is_file():
        return wind.from_log(path, placement, source.options, confirm=source.confirm)
    if source.options not in (None, WindOptions()):
        raise UsageError(
            "an artifact's wind was read before", where=source.log, fix="leave the sensor and the zone out"
        )
    if lake is None:
        raise NotFoundError("no such log", where=source.log, fix="check the path, or open a lake for ids")
    return wind.from_artifact(lake, lake.artifact(source.log, kinds=(Kind.WIND,)), placement)
