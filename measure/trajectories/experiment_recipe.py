"""Experiments as TOML. Parsed here and nowhere else; unknown keys are refused, the nearest is
named.

    title, up           "z", "-y", …: the axis of the recordings that points up; all other entries
                        use z up
    [test]              level of the global test, nulls: how many null recordings
    [cloth]             width, height, or mesh (an OBJ with texture coordinates in metres); vertices
                        of the model mesh
    [material]          name (of catalogs/materials) or file (TOML, or ArcSim JSON); mass-unknown,
                        or area-weight: a number, or '0.155±0.003' of a cloth that was weighed;
                        thicken, damping, stretching-factor, bending-factor
    [attachment]        at = "hoist-corners" | "top-corners" | "hoist", or points = [[u, v], …];
                        stiffness, or rigid = true
    [air]               gravity, density, drag (of the quadratic normal force)
    [[recording]]       source: an artifact's id, a folder of meshes, or a marker table; take (a
                        recording of a table that holds several), name, rate, unit, rest-unit, noise
    [recording.wind]    velocity = [x, y, z], where the air goes to; or speed and toward (from +x
                        towards +y); or log (an artifact's id or an anemometer's file) with axis or
                        north (where it lies, from +x towards +y), and clock-offset [s], added to
                        the recording's clock to reach the log's, both counted from their first
                        samples, or start (ISO 8601); sensor (a recipe of catalogs/sensors or a
                        file) and zone, where the log does not state them; accept (the hash that
                        confirms a drafted reading, as a refusal shows it)

All values are SI and radians; toward-deg, north-deg and direction-sigma-deg are in degrees. What a
recording's own description says may be left out. Paths are relative to the file.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, TypeAlias, cast

from msgspec import Meta

from flagdata import timebase
from flagdata.core.console import say
from flagdata.core.files.addresses import local_path
from flagdata.core.findings import Finding
from flagdata.core.schema import Kind
from flagdata.core.stated import Stated
from flagdata.errors import InputError, NotFoundError, UnknownNameError, UsageError
from flagdata.ingest.anemometer import WindOptions
from flagdata.ingest.anemometer.log_confirmation import UNASKED, Accepting, Confirm
from flagdata.ingest.markers import MarkerOptions
from flagdata.ingest.meshes import read_obj
from flagdata.lake import Lake
from flagdata.recipes import typed_tables
from flagdata.recipes.retired_names import OF_LOGS, TABLES, with_present_keys
from flagdata.recipes.shelves import parse_recipe, read_recipe
from flagdata.recipes.typed_tables import WHOLE_LIMIT, Angle, Count, NotNegative, Positive
from flagdata.verbs.shared_options import BOTH_STATED
from measure.trajectories import markers, mesh_observations, wind_tracks
from measure.trajectories.cloth_mesh import VERTICES, Points, outline
from measure.trajectories.experiment import Observed, observe
from measure.trajectories.observation import Observation, Up
from measure.trajectories.setup import Hold, Setup, sheet
from measure.trajectories.trajectory import AREA_WEIGHT_UNCERTAINTY, WindTrack
from measure.trajectories.wind_tracks import LogPlacement
from sim.cloth.air import QuadraticNormal
from sim.cloth.material import Material, named_material
from sim.run.simulation_toml import material_file

Triple: TypeAlias = tuple[float, float, float]
"""(x, y, z), z up."""


@dataclass(frozen=True, kw_only=True)
class WindSource:
    """A constant velocity [m/s], or a log, how it is read if it is a file, and how it lies beside
    the recording.

    Attributes:
        confirm: of a file, asks whether a drafted reading is right.
        gain, direction, clock: standard deviations of what it may be off by, see `WindTrack`; None
            for the usual ones.
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
        """Adds the stated uncertainty to the track."""
        uncertainties = {"gain": self.gain, "direction": self.direction, "clock": self.clock}
        return replace(
            track, **{name: value for name, value in uncertainties.items() if value is not None}
        )


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
    rate: Positive | None = None
    unit: str = "m"
    rest_unit: str | None = None
    noise: NotNegative | None = None
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
    """Loads the recipe in a file, of a whole experiment.

    Raises:
        InputError: it names no recording.
        FlagdataError: as `parse`.
    """
    recipe = parse(path)
    if not recipe.recordings:
        raise InputError("no recording is named", where=str(path), fix="add a table [[recording]]")
    return recipe


def parse(path: Path) -> ExperimentRecipe:
    """Parses the recipe in a file, which may leave the recordings out.

    Raises:
        NotFoundError: no such file, or one that it names.
        UnknownNameError: a key or name that is not known.
        InputError: a value that does not fit.
        UsageError: values that do not fit together.
    """
    where, folder = str(path), path.parent
    form = typed_tables.read(
        _ExperimentTables, parse_recipe(read_recipe(path).text, where=where), where=where
    )
    return ExperimentRecipe(
        title=form.title or path.stem,
        up=form.up,
        folder=folder,
        setup=_setup(form, folder, where=where),
        recordings=tuple(
            _recording(content, folder, where=f"{where} [[recording]] {number}")
            for number, content in enumerate(form.recording, start=1)
        ),
        level=form.test.level,
        nulls=form.test.nulls,
    )


@dataclass(frozen=True, kw_only=True)
class _ExperimentTables:
    """The tables of an experiment; those that depend on others are read after them."""

    WAS: ClassVar = TABLES
    title: str = ""
    up: Up = Up.Z
    test: _Test
    cloth: _Cloth
    material: Mapping[str, Any]
    attachment: _Pins
    air: Mapping[str, Any]
    recording: tuple[Mapping[str, Any], ...] = ()


@dataclass(frozen=True, kw_only=True)
class _Test:
    level: Positive | None = None
    nulls: Count | None = None


@dataclass(frozen=True, kw_only=True)
class _Cloth:
    width: Positive | None = None
    height: Positive | None = None
    mesh: str | None = None
    vertices: Annotated[int, Meta(ge=16, le=WHOLE_LIMIT)] = VERTICES


@dataclass(frozen=True, kw_only=True)
class _Pins:
    at: Hold | None = None
    points: tuple[tuple[float, float], ...] = ()
    rigid: bool = False
    stiffness: Positive | None = None
    carried: bool = False


@dataclass(frozen=True, kw_only=True)
class _Wind:
    """[recording.wind], the keys of every wind."""

    gain_sigma: NotNegative | None = None
    direction_sigma: Angle | None = None
    clock_sigma: NotNegative | None = None


@dataclass(frozen=True, kw_only=True)
class _Velocity(_Wind):
    velocity: Triple


@dataclass(frozen=True, kw_only=True)
class _Speed(_Wind):
    speed: NotNegative
    toward: Angle = 0.0


@dataclass(frozen=True, kw_only=True)
class _Log(_Wind):
    WAS: ClassVar = OF_LOGS
    log: str
    axis: Triple | None = None
    north: Angle | None = None
    clock_offset: float | None = None
    start: str | None = None
    sensor: str | None = None
    zone: str | None = None
    accept: str | None = None


_AIR = {"gravity": NotNegative, "density": NotNegative, "drag": NotNegative}
_UNCERTAINTY = "density-uncertainty"
"""Key of the last version; `area-weight` states both."""
_MATERIAL = {
    "name": str,
    "file": str,
    "mass-unknown": bool,
    "area-weight": float | str,
    _UNCERTAINTY: Positive,
}
_CHANGES = {
    "thicken": Positive,
    "stretching-factor": Positive,
    "bending-factor": NotNegative,
    "damping": NotNegative,
}
"""Keys of [material] that need a name or a file."""
_WINDS: Mapping[str, type[_Wind]] = {"velocity": _Velocity, "speed": _Speed, "log": _Log}


def read(recipe: ExperimentRecipe, lake: Lake | None = None) -> Observed:
    """Reads and checks the experiment of a recipe.

    Args:
        lake: that artifacts are looked up in.

    Raises:
        NotFoundError: a source that is neither a path nor an artifact.
        FlagdataError: a source that cannot be read or used.
    """
    return observe(
        [_observation(source, recipe, lake) for source in recipe.recordings], recipe.setup
    )


def _setup(form: _ExperimentTables, folder: Path, *, where: str) -> Setup:
    cloth, pins, inside = form.cloth, form.attachment, f"{where} [material]"
    from_catalog = "name" in form.material or "file" in form.material
    table = with_present_keys(form.material, where=inside)
    material = typed_tables.entries(
        _MATERIAL | (_CHANGES if from_catalog else {}), table, where=inside
    )
    air = typed_tables.entries(_AIR, form.air, where=f"{where} [air]")
    gravity = air.pop("gravity", None)
    weight = _weight(material, where=inside)
    relative = material.get(_UNCERTAINTY, AREA_WEIGHT_UNCERTAINTY)
    setup = Setup(
        material=_material(material, folder, where=inside),
        area_weight=weight if weight is not None and weight.exact else None,
        area_weight_uncertainty=None if material.get("mass-unknown") else relative,
        outline=_outline(cloth, folder, where=f"{where} [cloth]"),
        pins=pins.at or pins.points or None,
        carried=pins.carried,
        stiffness=_stiffness(pins, where=f"{where} [attachment]"),
        gravity=gravity,
        air=QuadraticNormal(**air) if air else None,
        vertices=cloth.vertices,
    )
    return setup if weight is None or weight.exact else setup.state_weight(weight)


def _weight(material: Mapping[str, Any], *, where: str) -> Stated | None:
    """Reads what [material] states of the area weight; None where that is its own.

    Raises:
        UsageError: no weight, one that is not above 0, or an uncertainty of one that is unknown or
            stated twice.
    """
    weight = Stated.of(material["area-weight"]) if "area-weight" in material else None
    if weight is not None and not weight.low > 0:
        raise UsageError(
            f"the area weight {weight.text} kg/m² is not above 0",
            where=where,
            fix="give kg/m², as in '0.155±0.003'",
        )
    uncertain = weight is not None and not weight.exact
    if _UNCERTAINTY in material:
        say(f"{_UNCERTAINTY} is of the last version: give {BOTH_STATED}", mark="warning")
        if uncertain:
            raise UsageError(
                "the uncertainty of the weight is given twice",
                where=where,
                fix=f"leave {_UNCERTAINTY} out",
            )
    if material.get("mass-unknown") and (uncertain or _UNCERTAINTY in material):
        raise UsageError(
            "both mass-unknown and an uncertainty of the area weight are given",
            where=where,
            fix="keep mass-unknown for a cloth that nobody weighed, the uncertainty for one whose "
            "weight is known",
        )
    return weight


def _outline(cloth: _Cloth, folder: Path, *, where: str) -> Points | None:
    if (cloth.width is None) != (cloth.height is None) or (
        cloth.mesh is not None and cloth.width is not None
    ):
        raise UsageError(
            "a cloth of half a size, or of two, is given",
            where=where,
            fix="give width and height, or a mesh",
        )
    if cloth.width is not None and cloth.height is not None:
        return sheet(cloth.width, cloth.height)
    if cloth.mesh is None:
        return None
    shape = read_obj(folder / local_path(cloth.mesh))
    return outline(shape.rest, shape.faces, where=str(folder / cloth.mesh))


def _stiffness(pins: _Pins, *, where: str) -> float | None:
    """Stiffness of the pins [N/m]; None for the usual one."""
    if pins.points and pins.at is not None:
        raise UsageError("both at and points are given", where=where, fix="keep one of them")
    if pins.rigid and pins.stiffness is not None:
        raise UsageError(
            "both rigid and a stiffness are given", where=where, fix="keep one of them"
        )
    if pins.carried and pins.stiffness is not None:
        raise UsageError(
            "pins that are carried hold rigidly", where=where, fix="leave the stiffness out"
        )
    return math.inf if pins.rigid else pins.stiffness


def _material(form: Mapping[str, Any], folder: Path, *, where: str) -> Material | None:
    name, file = form.get("name"), form.get("file")
    if name is None and file is None:
        return None
    if name is not None and file is not None:
        raise UsageError("both name and file are given", where=where, fix="keep one of them")
    base = (
        named_material(name, where=where)
        if name is not None
        else material_file(folder / local_path(file or ""))
    )
    thicken = form.get("thicken", 1.0)
    material = base.scaled(
        area_weight=thicken,
        stretching=thicken * form.get("stretching-factor", 1.0),
        bending=thicken * form.get("bending-factor", 1.0),
    )
    return replace(material, damping=form["damping"]) if "damping" in form else material


def _recording(content: Mapping[str, Any], folder: Path, *, where: str) -> RecordingSource:
    blows = _wind(content["wind"], folder, where=f"{where} [wind]") if "wind" in content else None
    return typed_tables.read(RecordingSource, content, where=where, wind=blows)


def _wind(content: Any, folder: Path, *, where: str) -> WindSource:
    typed_tables.check_keys(content, content if isinstance(content, Mapping) else (), where=where)
    kinds = [key for key in _WINDS if content.get(key) not in (None, "", [])]
    if len(kinds) != 1:
        raise UsageError(
            f"{len(kinds)} winds are given", where=where, fix="give one of velocity, speed and log"
        )
    form = typed_tables.read(_WINDS[kinds[0]], content, where=where)
    if form.direction_sigma is not None and form.direction_sigma < 0:
        raise InputError(
            f"direction-sigma is {form.direction_sigma:g}",
            where=where,
            fix="give a number of at least 0",
        )
    source = WindSource(
        gain=form.gain_sigma, direction=form.direction_sigma, clock=form.clock_sigma
    )
    if isinstance(form, _Log):
        start = form.start
        placement = LogPlacement(
            axis=form.axis,
            north=form.north,
            offset=form.clock_offset,
            start=timebase.parse(start, where=f"{where} start") if start is not None else None,
        )
        sensor = form.sensor
        if sensor is not None and (folder / local_path(sensor)).is_file():
            sensor = str(folder / sensor)
        options, confirm = WindOptions(recipe=sensor, zone=form.zone), Accepting(form.accept)
        return replace(source, log=form.log, placement=placement, options=options, confirm=confirm)
    if isinstance(form, _Speed):
        x, y = form.speed * math.cos(form.toward), form.speed * math.sin(form.toward)
        return replace(source, velocity=(x, y, 0.0))
    return replace(source, velocity=cast("_Velocity", form).velocity)


def _observation(
    source: RecordingSource, recipe: ExperimentRecipe, lake: Lake | None
) -> Observation:
    observation = _take(open_recordings(source, recipe.folder, lake), source)
    return blown(
        replace(observation.turned(recipe.up), name=source.name or observation.name),
        source.wind,
        recipe.folder,
        lake,
    )


def blown(
    observation: Observation, source: WindSource | None, folder: Path, lake: Lake | None
) -> Observation:
    """Adds the wind to a recording, if there is a source of it, and what was found on reading that.

    Raises:
        NotFoundError: a log that is neither a path nor an artifact.
        FlagdataError: as its reader.
    """
    if source is None:
        return observation
    track, findings = _track(source, folder, lake)
    return replace(
        observation, wind=source.certain(track), findings=(*observation.findings, *findings)
    )


def open_recordings(
    source: RecordingSource, folder: Path, lake: Lake | None
) -> tuple[Observation, ...]:
    """Opens all recordings of a source, as they are: neither turned, nor with the wind beside them.

    Raises:
        NotFoundError: neither a path nor an artifact.
        UsageError: options that say nothing of such a source.
        FlagdataError: as its reader.
    """
    return tuple(
        replace(observation, noise=source.noise) for observation in _read(source, folder, lake)
    )


def _read(source: RecordingSource, folder: Path, lake: Lake | None) -> tuple[Observation, ...]:
    path = folder / local_path(source.source)
    if path.is_dir():
        _refuse(source, ("take", "rest_unit"), "a folder of meshes")
        return (mesh_observations.from_folder(path, rate=source.rate, unit=source.unit),)
    if path.is_file():
        options = MarkerOptions(rate=source.rate, unit=source.unit, rest_unit=source.rest_unit)
        return markers.from_table(path, options)
    if lake is None:
        raise NotFoundError(
            "the file or folder does not exist",
            where=source.source,
            fix="check the path, or open a lake for ids",
        )
    _refuse(source, ("take", "rate", "rest_unit"), "an artifact")
    if source.unit != "m":
        raise UsageError("an artifact is in metres", where=source.source, fix="leave the unit out")
    artifact = lake.artifact(source.source, kinds=(Kind.MARKERS, Kind.MESHES))
    if artifact.kind is Kind.MARKERS:
        return (markers.from_artifact(lake, artifact),)
    return (mesh_observations.from_artifact(lake, artifact),)


def _refuse(source: RecordingSource, keys: tuple[str, ...], kind_of_source: str) -> None:
    options = {
        "take": bool(source.take),
        "rate": source.rate is not None,
        "rest_unit": source.rest_unit is not None,
    }
    for key in keys:
        if options[key]:
            fix = f"leave {key.replace('_', '-')} out"
            raise UsageError(
                f"{key.replace('_', '-')} means nothing for {kind_of_source}",
                where=source.source,
                fix=fix,
            )


def _take(observations: tuple[Observation, ...], source: RecordingSource) -> Observation:
    if not source.take and len(observations) > 1:
        raise UsageError(
            f"the table holds {len(observations)} recordings",
            where=source.source,
            fix=f"add take, one of {', '.join(observation.name for observation in observations)}",
        )
    for observation in observations:
        if observation.name == source.take or not source.take:
            return observation
    raise UnknownNameError.of(
        "recording",
        source.take,
        [observation.name for observation in observations],
        where=source.source,
    )


def _track(
    source: WindSource, folder: Path, lake: Lake | None
) -> tuple[WindTrack, tuple[Finding, ...]]:
    if source.velocity is not None:
        return WindTrack.constant(source.velocity), ()
    placement = source.placement or LogPlacement()
    path = folder / local_path(source.log)
    if path.is_file():
        return wind_tracks.from_log(path, placement, source.options, confirm=source.confirm)
    if source.options not in (None, WindOptions()):
        raise UsageError(
            "an artifact's wind was read before",
            where=source.log,
            fix="leave the sensor and the zone out",
        )
    if lake is None:
        raise NotFoundError(
            "the wind is neither a number nor a log that exists",
            where=source.log,
            fix="give a speed in m/s as a number alone, or correct the path; an id needs its lake",
        )
    return wind_tracks.from_artifact(lake, lake.artifact(source.log, kinds=(Kind.WIND,)), placement)
