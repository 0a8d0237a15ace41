"""Data sets' recipes as TOML. Parsed here and nowhere else; unknown keys are refused, the nearest
is named.

All values are SI. A *quantity* is a number, or `{ low = …, high = …, scale = "linear" | "log" }`,
from which each recording draws its own value.

    title, licence, seed
    [simulation]  scene: a recipe of `flagdata simulate`, by name or path (.toml)
    [render]      renderer; prior: a name of catalogs/renders; photos: a folder of backgrounds; and
                  in place of the prior's own width, height [px], raster-samples, cycles-samples
    [sides.NAME]  sequences, renders; sessions, where sequences are dealt to set-ups
    [sessions]    spread: of the winds of one session about its mean, as a share
    [groups]      what each batch of the scene draws: height [m], a quantity; of the lists rates
                  [Hz] and attachments one entry
    [camera]      coding = "jpeg" | "h264"; jpeg-quality or rate-factor, read-noise, shot-noise:
                  quantities; frame-slot [B]
    [anemometer]  truth = "stated" | "measured"; rate [Hz], before [s], noise (a quantity),
                  resolution, accuracy [m/s]
    [anemometer.effects.NAME]  parameters of a sensor effect: quantities; effects follow one another
                               as in the file
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, TypeAlias

from msgspec import Meta

from flagdata.core.files.addresses import local_path
from flagdata.core.schema import TRUTH_WINDOW
from flagdata.errors import InputError, LimitError, UnknownNameError, UsageError
from flagdata.recipes.shelves import Shelf, parse_recipe
from flagdata.recipes.typed_tables import (
    Count,
    Named,
    PositiveQuantity,
    Quantity,
    Seed,
    entries,
    read,
    value,
    within,
)
from flagdata.record.writer import Coding
from sim.datasets.dataset_recipe import (
    AnemometerSpec,
    CameraSpec,
    DatasetRecipe,
    GroupSpec,
    SessionSpec,
    Side,
    Truth,
)
from sim.effects import EFFECTS, SENSOR_EFFECTS
from sim.effects.effect import FlowEffect, WindEffect
from sim.effects.sensor import AnemometerEffect
from sim.render import RENDERERS
from sim.render import render_prior as priors
from sim.run import Recipe as Simulation
from sim.run import load as load_simulation
from sim.run.simulation_recipe import Attachment, Shape

DATASETS = Shelf(folder="datasets", noun="data set", group="flagdata.datasets")
SIDES = ("train", "validation", "test")
_SIZE_LIMIT = 16_384
"""Most pixels of a side, and samples of a pixel."""
_RATE_LIMIT = 1000.0
"""Most frames a second that a group's films have."""
SAMPLES_LIMIT = 10_000_000
"""Most samples of a recording's anemometer."""
_SIZES = ("width", "height", "raster_samples", "cycles_samples")
_Size: TypeAlias = Annotated[int, Meta(ge=1, le=_SIZE_LIMIT)]
_GROUPS = {
    "height": PositiveQuantity,
    "rates": tuple[float, ...],
    "attachments": tuple[Attachment, ...],
}


@dataclass(frozen=True, kw_only=True)
class _DatasetTables:
    """The tables of a data set's recipe; those that depend on others are read after them."""

    title: str = ""
    licence: str = ""
    seed: Seed = 0
    simulation: _Scene
    render: _Render
    sides: Mapping[Annotated[str, Named("side", SIDES)], Mapping[str, Any]]
    sessions: SessionSpec | None = None
    groups: Mapping[str, Any] | None = None
    camera: Mapping[str, Any]
    anemometer: Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class _Scene:
    scene: str


@dataclass(frozen=True, kw_only=True)
class _Render:
    prior: str
    renderer: Annotated[str, Named("renderer", RENDERERS)] = "raster"
    photos: str | None = None
    width: _Size | None = None
    height: _Size | None = None
    raster_samples: _Size | None = None
    cycles_samples: _Size | None = None


@dataclass(frozen=True, kw_only=True)
class _Side:
    sequences: Count
    renders: Count | None = None


@dataclass(frozen=True, kw_only=True)
class _SessionsSide(_Side):
    sessions: Count


def load(source: str) -> DatasetRecipe:
    """Reads the recipe of that name in the catalog, or of a `.toml` file.

    Raises:
        NotFoundError: no such file.
        UnknownNameError: no such recipe; a key, name or option that is not known.
        InputError, UsageError: a value that does not fit.
    """
    file = DATASETS.find(source)
    return parse(file.text, name=file.name, folder=file.folder, where=file.where)


def parse(text: str, *, name: str, folder: Path, where: str) -> DatasetRecipe:
    """Reads a recipe from its text.

    Args:
        folder: that a scene's path is relative to.

    Raises:
        UnknownNameError, InputError, UsageError: as `load`.
    """
    form = read(_DatasetTables, parse_recipe(text, where=where), where=where)
    if form.sessions is not None and form.groups is not None:
        raise UsageError(
            "both sessions and groups are given", where=where, fix="keep one of the tables"
        )
    scene = form.simulation.scene
    simulation = load_simulation(
        str(folder / local_path(scene)) if scene.endswith(".toml") else scene
    )
    render, source = form.render, f"{where} [render]"
    sizes = {key: float(size) for key in _SIZES if (size := getattr(render, key)) is not None}
    recipe = DatasetRecipe(
        name=name,
        title=form.title or name,
        licence=form.licence,
        seed=form.seed,
        renderer=render.renderer,
        simulation=simulation,
        prior=priors.named_prior(render.prior).with_quantities(sizes, source=source),
        sessions=form.sessions,
        groups=None
        if form.groups is None
        else _groups(form.groups, simulation, where=f"{where} [groups]"),
        photos=None if render.photos is None else folder / local_path(render.photos),
        sides=_sides(form.sides, form.sessions, where=f"{where} [sides]"),
        camera=_camera(form.camera, where=f"{where} [camera]"),
        anemometer=_anemometer(form.anemometer, where=f"{where} [anemometer]"),
    )
    _check(recipe, where=where)
    return recipe


def with_renderer(recipe: DatasetRecipe, renderer: str) -> DatasetRecipe:
    """Returns the recipe with another renderer, which is another data set and has another name.

    Raises:
        UnknownNameError: no renderer of that name.
    """
    if renderer not in RENDERERS:
        raise UnknownNameError.of("renderer", renderer, RENDERERS, where="--renderer")
    if renderer == recipe.renderer:
        return recipe
    return replace(recipe, renderer=renderer, name=f"{recipe.name}-{renderer}")


def _groups(content: Mapping[str, Any], simulation: Simulation, *, where: str) -> GroupSpec:
    scene = simulation.scene
    if scene.shape is not Shape.FLAG:
        raise UsageError(
            f"groups of a {scene.shape.value} are given",
            where=where,
            fix="give them to a flag's scene",
        )
    values = {"height": scene.height, **entries(_GROUPS, content, where=where)}
    rates, attachments = (
        values.get("rates") or (simulation.time.rate,),
        values.get("attachments") or (scene.attachment,),
    )
    wrong = next((rate for rate in rates if not 1.0 <= rate <= _RATE_LIMIT), None)
    if wrong is not None:
        raise InputError(
            f"a rate of {wrong:g} Hz is too low or too high",
            where=where,
            fix=f"give rates of 1 to {_RATE_LIMIT:g} Hz",
        )
    return GroupSpec(height=values["height"], rates=rates, attachments=attachments)


def _sides(
    sides: Mapping[str, Any], sessions: SessionSpec | None, *, where: str
) -> tuple[Side, ...]:
    specs: list[Side] = []
    for name, content in sides.items():
        inside = f"{where} [{name}]"
        side = read(_Side if sessions is None else _SessionsSide, content, where=inside)
        renders, dealt = side.renders or side.sequences, getattr(side, "sessions", 0)
        if renders < side.sequences:
            raise InputError(
                f"renders is {renders}, of {side.sequences} sequences",
                where=inside,
                fix="give at least one of each",
            )
        if dealt > side.sequences:
            raise InputError(
                f"sessions is {dealt}, of {side.sequences} sequences",
                where=inside,
                fix="have fewer sessions",
            )
        specs.append(Side(name=name, sequences=side.sequences, renders=renders, sessions=dealt))
    if not specs:
        raise InputError(
            "no sides are given", where=where, fix="add [sides.train] with sequences and renders"
        )
    return tuple(specs)


def _camera(content: Mapping[str, Any], *, where: str) -> CameraSpec:
    camera = read(CameraSpec, content, where=where)
    idle = "jpeg-quality" if camera.coding is Coding.H264 else "rate-factor"
    if idle in content:
        raise InputError(
            f"{idle} has no effect on {camera.coding.value}", where=where, fix="leave it out"
        )
    return camera


def _anemometer(content: Mapping[str, Any], *, where: str) -> AnemometerSpec:
    effects: dict[str, dict[str, Quantity]] = {}
    offered = [
        name for name in SENSOR_EFFECTS if issubclass(SENSOR_EFFECTS[name], AnemometerEffect)
    ]
    chosen = value(
        Mapping[Annotated[str, Named("effect of an anemometer", offered)], Mapping[str, Any]],
        content.get("effects", {}),
        key="effects",
        where=where,
    )
    for name, stated_values in chosen.items():
        schema = SENSOR_EFFECTS[name].parameters()
        types = {
            key.replace("_", "-"): within(Quantity, *entry.admissible)
            for key, entry in schema.items()
        }
        values = entries(types, stated_values, where=f"{where} [effects] [{name}]")
        effects[name] = {
            key: values.get(key.replace("_", "-"), entry.null) for key, entry in schema.items()
        }
    return read(AnemometerSpec, content, where=where, effects=effects)


def _check(recipe: DatasetRecipe, *, where: str) -> None:
    if not recipe.licence:
        raise InputError(
            "the recipe states no licence",
            where=where,
            fix='say how the data may be used: licence = "CC-BY-4.0"',
        )
    time, anemometer = recipe.simulation.time, recipe.anemometer
    samples = anemometer.rate * (anemometer.before + time.settle + time.frames / time.rate)
    if samples > SAMPLES_LIMIT:
        raise LimitError(
            f"the anemometer takes {samples:.3g} samples a recording",
            where=where,
            fix=f"have at most {SAMPLES_LIMIT}: lower its rate, or `before`",
        )
    wind_before = time.settle if changing(recipe.simulation) else anemometer.before
    if anemometer.truth is Truth.MEASURED and wind_before < TRUTH_WINDOW:
        raise UsageError(
            f"the anemometer has {wind_before:g} s of wind before the first frame, ground truth is "
            "the mean of the "
            f"{TRUTH_WINDOW:g} s before a clip's end",
            where=where,
            fix=f"let the scene settle for {TRUTH_WINDOW:g} s"
            if changing(recipe.simulation)
            else "raise before",
        )


def changing(simulation: Simulation) -> bool:
    """Returns whether the wind of a scene changes with time or place: then it is known only while
    it is simulated."""
    return any(issubclass(EFFECTS[name], (WindEffect, FlowEffect)) for name in simulation.effects)
