"""Data sets' recipes as TOML. Parsed here and nowhere else; unknown keys are refused, the nearest is named.

All values are SI. A *quantity* is a number, or `{ low = …, high = …, scale = "linear" | "log" }`, from which each
recording draws its own value.

    title, licence, seed
    [simulation]  scene: a recipe of `flagdata simulate`, by name or path (.toml)
    [render]      renderer; prior: a name of catalogs/renders; photos: a folder of backgrounds; and in place of the
                  prior's own width, height [px], raster-samples, cycles-samples
    [sides.NAME]  sequences, renders; sessions, where sequences are dealt to set-ups
    [sessions]    spread: of the winds of one session about its mean, as a share
    [groups]      what each batch of the scene draws: height [m], a quantity; of the lists rates [Hz] and attachments
                  one entry
    [camera]      coding = "jpeg" | "h264"; jpeg-quality or rate-factor, read-noise, shot-noise: quantities;
                  frame-slot [B]
    [anemometer]  truth = "stated" | "measured"; rate [Hz], before [s], noise (a quantity), resolution, accuracy [m/s]
    [anemometer.effects.NAME]  parameters of a sensor effect: quantities; effects follow one another as in the file
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from flagdata.addresses import local_path
from flagdata.errors import InputError, LimitError, UnknownNameError, UsageError
from flagdata.recipes import Shelf, parsed
from flagdata.record.writer import Coding
from flagdata.schema import TRUTH_WINDOW
from flagdata.tables import COUNT, NOT_NEGATIVE, POSITIVE, SEED_LIMIT, Bounds, Quantity, Table
from sim.datasets.recipe import AnemometerSpec, CameraSpec, DatasetRecipe, GroupSpec, SessionSpec, Side, Truth
from sim.effects import EFFECTS, SENSOR_EFFECTS
from sim.effects.effect import FlowEffect, WindEffect
from sim.effects.sensor import AnemometerEffect
from sim.render import RENDERERS
from sim.render import prior as priors
from sim.render.prior import RenderPrior
from sim.run import Recipe as Simulation
from sim.run import load as load_simulation
from sim.run.recipe import Attachment, Shape

DATASETS = Shelf(folder="datasets", noun="data set")
SIDES = ("train", "validation", "test")
_SIZE_LIMIT = 16_384
"""Most pixels of a side, and samples of a pixel."""
_RATE_LIMIT = 1000.0
"""Most frames a second that a group's films have."""
SAMPLES_LIMIT = 10_000_000
"""Most samples of a recording's anemometer."""
_SIZES = ("width", "height", "raster_samples", "cycles_samples")


def load(source: str) -> DatasetRecipe:
    """The recipe of that name in the catalog, or of a `.toml` file.

    Raises:
        NotFoundError: no such file.
        UnknownNameError: no such recipe; a key, name or option that is not known.
        InputError, UsageError: a value that does not fit.
    """
    found = DATASETS.find(source)
    return parse(found.text, name=found.name, folder=found.folder, where=found.where)


def parse(text: str, *, name: str, folder: Path, where: str) -> DatasetRecipe:
    """A recipe from its text.

    Args:
        folder: that a scene's path is relative to.

    Raises:
        UnknownNameError, InputError, UsageError: as `load`.
    """
    top = Table(parsed(text, where=where), where=where)
    if "sessions" in top and "groups" in top:
        raise UsageError("both sessions and groups", where=where, fix="keep one of the tables")
    render = top.table("render")
    renderer = render.named("renderer", "raster", RENDERERS, noun="renderer")
    photos = render.text("photos", None)
    sessions = top.table("sessions").record(SessionSpec, spread=NOT_NEGATIVE) if "sessions" in top else None
    simulation = _simulation(top.table("simulation"), folder)
    groups = _groups(top.table("groups"), simulation) if "groups" in top else None
    recipe = DatasetRecipe(
        name=name,
        title=top.text("title", name) or name,
        licence=top.text("licence", None) or "",
        seed=top.whole("seed", 0, least=0, most=SEED_LIMIT),
        renderer=renderer,
        simulation=simulation,
        prior=_prior(render),
        sessions=sessions,
        groups=groups,
        photos=None if photos is None else folder / local_path(photos),
        sides=_sides(top.table("sides"), sessions),
        camera=_camera(top.table("camera")),
        anemometer=_anemometer(top.table("anemometer")),
    )
    top.done()
    _check(recipe, where=where)
    return recipe


def with_renderer(recipe: DatasetRecipe, renderer: str) -> DatasetRecipe:
    """The recipe with another renderer, which is another data set and has another name.

    Raises:
        UnknownNameError: no renderer of that name.
    """
    if renderer not in RENDERERS:
        raise UnknownNameError.of("renderer", renderer, RENDERERS, where="--renderer")
    if renderer == recipe.renderer:
        return recipe
    return replace(recipe, renderer=renderer, name=f"{recipe.name}-{renderer}")


def _simulation(table: Table, folder: Path) -> Simulation:
    scene = table.text("scene", None)
    table.done()
    if scene is None:
        raise InputError("no scene is named", where=table.where, fix='add scene = "flag-search-space", or a .toml file')
    return load_simulation(str(folder / local_path(scene)) if scene.endswith(".toml") else scene)


def _groups(table: Table, simulation: Simulation) -> GroupSpec:
    scene, time = simulation.scene, simulation.time
    if scene.shape is not Shape.FLAG:
        raise UsageError(f"groups of a {scene.shape.value}", where=table.where, fix="give them to a flag's scene")
    rates, attachments = table.numbers("rates") or (time.rate,), table.texts("attachments") or (scene.attachment,)
    wrong = next((rate for rate in rates if not 1.0 <= rate <= _RATE_LIMIT), None)
    if wrong is not None:
        raise InputError(f"a rate of {wrong:g} Hz", where=table.where, fix=f"give rates of 1 to {_RATE_LIMIT:g} Hz")
    known = [attachment.value for attachment in Attachment]
    for name in attachments:
        if name not in known:
            raise UnknownNameError.of("attachment", name, known, where=table.where)
    spec = GroupSpec(
        height=table.quantity("height", scene.height, above=0.0),
        rates=rates,
        attachments=tuple(Attachment(name) for name in attachments),
    )
    table.done()
    return spec


def _prior(table: Table) -> RenderPrior:
    name = table.text("prior", None)
    if name is None:
        known = ", ".join(priors.PRIORS.names())
        raise InputError("no prior of ζ is named", where=table.where, fix=f"add prior, one of {known}")
    changes: dict[str, Quantity] = {}
    for key in _SIZES:
        spelled = key.replace("_", "-")
        if spelled in table:
            changes[key] = float(table.whole(spelled, 1, least=1, most=_SIZE_LIMIT))
    table.done()
    return priors.named(name).with_quantities(changes, source=table.where)


def _sides(table: Table, sessions: SessionSpec | None) -> tuple[Side, ...]:
    found: list[Side] = []
    for name in table.names():
        if name not in SIDES:
            raise UnknownNameError.of("side", name, SIDES, where=table.where)
        inner = table.table(name)
        sequences = inner.whole("sequences", 0, least=1)
        side = Side(
            name=name,
            sequences=sequences,
            renders=inner.whole("renders", sequences, least=sequences),
            sessions=inner.whole("sessions", 0, least=1) if sessions is not None else 0,
        )
        if side.sessions > side.sequences:
            raise InputError(
                f"{side.sessions} sessions of {side.sequences} sequences", where=inner.where, fix="have fewer sessions"
            )
        inner.done()
        found.append(side)
    if not found:
        raise InputError("no sides", where=table.where, fix="add [sides.train] with sequences and renders")
    table.done()
    return tuple(found)


def _camera(table: Table) -> CameraSpec:
    coding = table.choice("coding", Coding.JPEG)
    idle = "jpeg-quality" if coding is Coding.H264 else "rate-factor"
    if idle in table:
        raise InputError(f"{idle} has no effect on {coding.value}", where=table.where, fix="leave it out")
    noise = Bounds(least=0.0, most=128.0)
    return table.record(
        CameraSpec,
        jpeg_quality=Bounds(least=1.0, most=100.0),
        rate_factor=Bounds(least=0.0, most=51.0),
        read_noise=noise,
        shot_noise=noise,
        frame_slot=COUNT,
    )


def _anemometer(table: Table) -> AnemometerSpec:
    effects: dict[str, dict[str, Quantity]] = {}
    chosen = table.table("effects")
    known = [name for name in SENSOR_EFFECTS if issubclass(SENSOR_EFFECTS[name], AnemometerEffect)]
    for name in chosen.names():
        if name not in known:
            raise UnknownNameError.of("effect of an anemometer", name, known, where=chosen.where)
        inner = chosen.table(name)
        effects[name] = {
            key: inner.quantity(key.replace("_", "-"), entry.null, least=entry.admissible[0], most=entry.admissible[1])
            for key, entry in SENSOR_EFFECTS[name].parameters().items()
        }
        inner.done()
    chosen.done()
    return table.record(
        AnemometerSpec,
        {"effects": lambda: effects},
        rate=POSITIVE,
        before=NOT_NEGATIVE,
        noise=NOT_NEGATIVE,
        resolution=POSITIVE,
        accuracy=NOT_NEGATIVE,
    )


def _check(recipe: DatasetRecipe, *, where: str) -> None:
    if not recipe.licence:
        raise InputError("no licence", where=where, fix='say how the data may be used: licence = "CC-BY-4.0"')
    time, anemometer = recipe.simulation.time, recipe.anemometer
    samples = anemometer.rate * (anemometer.before + time.settle + time.frames / time.rate)
    if samples > SAMPLES_LIMIT:
        raise LimitError(
            f"an anemometer of {samples:.3g} samples a recording",
            where=where,
            fix=f"have at most {SAMPLES_LIMIT}: lower its rate, or `before`",
        )
    known = time.settle if changing(recipe.simulation) else anemometer.before
    if anemometer.truth is Truth.MEASURED and known < TRUTH_WINDOW:
        raise UsageError(
            f"the anemometer has {known:g} s of wind before the first frame, ground truth is the mean of the "
            f"{TRUTH_WINDOW:g} s before a clip's end",
            where=where,
            fix=f"let the scene settle for {TRUTH_WINDOW:g} s" if changing(recipe.simulation) else "raise before",
        )


def changing(simulation: Simulation) -> bool:
    """Whether the wind of a scene changes with time or place, so that it is known only while it is simulated."""
    return any(issubclass(EFFECTS[name], (WindEffect, FlowEffect)) for name in simulation.effects)
