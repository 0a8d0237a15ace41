"""`flagdata close-loop`: recordings in; a verdict, its report and the models out."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from flagdata.commands.confirm_recipe import on_command_line
from flagdata.core.console import LocalPath, document, echo, say
from flagdata.errors import UnknownNameError, UsageError
from flagdata.verbs.option_types import POSITIVE, STATED
from flagdata.verbs.shared_options import BOTH_STATED, TEST, WRITTEN, NamedLake, OnBranch
from flagdata.verbs.verb_options import AsJson, argument, command, option, options, typed_names
from measure.closing.null_options import nulls_given, refuse, stage_bars
from measure.closing.verdict_findings import with_warnings
from measure.cloth.film_options import JudgingFilms, refuse_of_others

if TYPE_CHECKING:
    from flagdata.core.stated import Stated
    from flagdata.lake import Lake
    from measure.closing.verdict_artifacts import ClosedLoop
    from measure.closing.verdict_sources import SourceOptions
    from measure.trajectories import Hold, Setup, Up
    from measure.trajectories.experiment_recipe import ExperimentRecipe
    from sim.cloth.material import Material

MARKERS, WIND = "Markers and meshes", "The wind beside markers"
_RECIPE = ".toml"
_OF_SOURCES = (
    "winds",
    "axis",
    "north",
    "clock_offset",
    "sensor",
    "zone",
    "accept",
    "rate",
    "unit",
    "noise",
    "up",
)
"""Options that say how sources of the command line are read."""


@options
class CloseLoopCommand(AsJson, JudgingFilms, NamedLake, OnBranch):
    """How recordings of one cloth are read and judged, and what is written."""

    sources: tuple[str, ...] = argument(
        "Recordings of one cloth.", "SOURCE...", default=(), was=("--recipe",)
    )
    verbose: bool = option(
        "Print all that was weighed, the errors before and after, and what was assumed; by default "
        "the conclusion "
        "alone.",
        default=False,
        section=WRITTEN,
    )
    draft: Path | None = option(
        "Write a recipe of the cloth and the recordings as the command line states them, to be "
        "completed, and judge "
        "nothing.",
        default=None,
        section=MARKERS,
        type=LocalPath(dir_okay=False),
        metavar="FILE.toml",
    )
    density_uncertainty: float | None = option(
        "Relative standard uncertainty of the material's area weight.",
        default=None,
        section=MARKERS,
        now=BOTH_STATED,
        type=click.FloatRange(0, 1, min_open=True),
    )
    rate: float | None = option(
        "Frames per second, if the source does not state them.",
        default=None,
        section=MARKERS,
        type=click.FloatRange(min=0, min_open=True),
    )
    unit: str = option("Unit of the positions.", default="m", section=MARKERS)
    up: str = option(
        "Axis of the recordings that points up: z, y, x, -z, -y or -x.",
        default="z",
        section=MARKERS,
    )
    noise: float | None = option(
        "Standard deviation of a marker's coordinate [m]; by default it is estimated.",
        default=None,
        section=MARKERS,
        type=click.FloatRange(min=0),
    )
    winds: tuple[str, ...] = option(
        "Wind beside the recordings: one for all of them, or one for each.",
        "--wind",
        default=(),
        section=WIND,
        metavar="M/S|LOG|ID",
    )
    axis: str = option(
        "Direction towards which a wind given as a speed blows.",
        default="1,0,0",
        section=WIND,
        metavar="X,Y,Z",
    )
    north: float | None = option(
        "Where north lies, as an angle from +x towards +y, for a log that has directions.",
        default=None,
        section=WIND,
        metavar="DEG",
    )
    clock_offset: Stated | None = option(
        "Seconds added to the clock of the recordings to reach the log's: of markers one number, "
        "counted from the "
        "first sample of the log; of tables as in 0.3±0.1, by default estimated.",
        default=None,
        section=WIND,
        was=("--offset",),
        type=STATED,
        metavar="S±SIGMA",
    )
    sensor: str | None = option(
        "Recipe that says how to read a log that does not say so itself.",
        default=None,
        section=WIND,
        metavar="NAME|FILE.toml",
    )
    zone: str | None = option(
        "Time zone of the stamps of a log: +02:00, or an IANA name.", default=None, section=WIND
    )
    accept: str | None = option(
        "Confirms how a log without a recipe is read, by the hash of its refusal.",
        default=None,
        section=WIND,
        metavar="HASH",
    )
    most_nulls: int = option(
        "Number up to which more are simulated where p is within a factor of two of the level.",
        default=320,
        section=TEST,
        type=POSITIVE,
    )
    name: str | None = option(
        "Name of the measurement and its models; by default that of the first source.", default=None
    )
    out: Path = option(
        "Folder that report.html, verdict.json and the models are written to.",
        default=Path("out/close-loop"),
        type=LocalPath(),
    )

    @property
    def recipe(self) -> Path | None:
        """The recipe among the sources.

        Raises:
            UsageError: there are several.
        """
        recipes = [source for source in self.sources if source.lower().endswith(_RECIPE)]
        if len(recipes) > 1:
            raise UsageError(
                f"the sources name {len(recipes)} recipes", where=recipes[1], fix="name one"
            )
        return Path(recipes[0]) if recipes else None

    @property
    def recordings(self) -> tuple[str, ...]:
        """The other sources."""
        return tuple(source for source in self.sources if not source.lower().endswith(_RECIPE))


@command(CloseLoopCommand)
def close_loop(chosen: CloseLoopCommand) -> None:
    """Find what the model of a cloth lacks, name it, and say what adding it changes on unseen data.

    SOURCE is the output folder of an ArcSim run, a table of tracked markers (CSV or Parquet with
    the columns frame or time, marker, u, v, x, y, z, and recording if there are several), or a mesh
    sequence or markers of --lake by id. Several are recordings of one cloth, best in different
    winds. With --lake the verdict and both models become artifacts; `flagdata simulate` runs a
    model by its name.

    Or SOURCE is a film with its log, a recording of --lake by its name or id, or a table of
    observables as `flagdata
    calibrate` takes it: then what a flag shows in windows of 2.5 s is compared, and --flag-size is
    needed; the options of flag, camera, film and tables are about these. Films beside markers of
    the same cloth are judged together: each kind at half of the level, with one joint answer;
    --flag-size, --attachment and --clock-offset are about the films then, and a recipe states those
    of the markers.

    A SOURCE that ends in .toml is a recipe of cloth, pins, wind and test, which may name the
    recordings of markers and meshes as well; --draft writes one.

    \b
      flagdata close-loop run-4ms/ run-8ms/ --wind 4 --wind 8
      flagdata close-loop tracks.csv --wind anemometer.csv --material camel-ponte-roma \\
          --attachment corners
      flagdata close-loop run-4ms/ run-8ms/ --wind 4 --wind 8 --draft flag.toml
      flagdata close-loop flag.toml --lake lake
      flagdata close-loop monday tuesday --lake lake --flag-size 1.5x1.0 --azimuth 70±7
    """
    from flagdata.core.files.outputs import check_files
    from flagdata.dataset.lake_source import lake_of
    from measure.closing.answer_by_both import KINDS
    from measure.closing.close import close_loop as close
    from measure.closing.model_recipes import models
    from measure.closing.verdict_artifacts import answer_of
    from measure.closing.verdict_output import FILES, JOINT, Delivery, deliver, deliver_joint
    from measure.closing.verdict_sources import read
    from measure.cloth.flag_recordings import films_among
    from measure.forecasting.strengths import Suspicion, on_markers
    from measure.loop.run import LoopOptions
    from measure.nulls.null_workload import of_recordings
    from measure.trajectories import Setup, observe
    from measure.trajectories import experiment_recipe as recipes

    recipe = None if chosen.recipe is None else recipes.parse(chosen.recipe)
    in_recipe = recipe is not None and bool(recipe.recordings)
    if not in_recipe and not chosen.recordings:
        raise UsageError(
            "no recordings are given", where="SOURCE", fix="name them, or a recipe that does"
        )
    check_files(chosen.out, *dict.fromkeys((*FILES, *JOINT)), command="close-loop")
    lake, branch, name, out = lake_of(chosen.lake), chosen.branch, chosen.name, chosen.out
    if lake is not None:
        lake.check_writable()
    films = films_among(
        chosen.recordings,
        lake=lake,
        at=branch,
        sized=chosen.flag_size is not None,
        tracked=in_recipe,
    )
    tracked = tuple(source for source in chosen.recordings if source not in films)
    if in_recipe:
        _refuse_beside(chosen, tracked, films=bool(films))
    two_kinds = bool(films) and (in_recipe or bool(tracked))
    names = {kind: name if name is None or not two_kinds else f"{name}-{kind}" for kind in KINDS}
    if two_kinds:
        for kind in KINDS:
            check_files(out / kind, *FILES, command="close-loop")
        if chosen.nulls is not None:
            raise UsageError(
                "films count kinds of numerics, and markers recordings",
                where="--nulls",
                fix="leave it out: 40 kinds are simulated for markers and 20 for films",
            )
    else:
        refuse_of_others(chosen, films=bool(films))
        if films and recipe is not None:
            raise UsageError(
                "the sources are films and tables of observables",
                where=str(chosen.recipe),
                fix="leave it out: it is about markers and meshes",
            )
    if chosen.draft is not None:
        _draft(chosen, tracked, lake)
        return

    delivery = Delivery(
        out=out, lake=lake, branch=branch, as_json=chosen.as_json, verbose=chosen.verbose
    )

    suspected = (
        None
        if chosen.suspect is None or (films and not two_kinds)
        else Suspicion.parse(chosen.suspect, on_markers())
    )

    def of_markers(level: float | None) -> tuple[ClosedLoop, Material]:
        """Returns the answer by markers, and the cloth's nominal material."""
        null_options = nulls_given(recipe, chosen, level=level)
        options = LoopOptions(
            seed=chosen.seed,
            bank=chosen.bank,
            most_nulls=chosen.most_nulls,
            workers=chosen.processes,
            scheduler=chosen.scheduler,
            suspected=suspected,
            **null_options,
        )
        setup = _setup(Setup() if recipe is None else recipe.setup, chosen, joint=two_kinds)
        if recipe is not None and in_recipe:
            observed = recipes.read(replace(recipe, setup=setup), lake)
        else:
            reading = _reading(chosen, recipe, joint=two_kinds)
            observed = observe(read(tracked, chosen.winds, reading, lake), setup)
        refuse(observed.findings)
        recordings, cloth = observed.experiment.recordings, observed.experiment.specimen
        say(of_recordings(recordings, cloth.mesh.vertex_count, options, workers=options.workers))
        verdict = close(observed.experiment, options, stage=stage_bars())
        verdict = with_warnings(verdict, observed.findings)
        called = names["markers"] or _name(observed.experiment.recordings[0].name, tracked, recipe)
        answer = answer_of(
            verdict,
            observed.experiment,
            options,
            name=called,
            findings=observed.findings,
            models=models(verdict, observed.experiment, name=called, seed=chosen.seed),
        )
        return answer, cloth.material

    def of_films(level: float | None) -> ClosedLoop:
        from measure.cloth.close_films import close_films

        return close_films(
            films, chosen, lake=lake, branch=branch, name=names["films"], level=level
        )

    if not two_kinds:
        answer = of_films(chosen.level) if films else of_markers(chosen.level)[0]
        deliver(answer, delivery)
        return
    from measure.closing.joint_verdict import join_verdicts
    from measure.cloth.flag_simulation import mean_bending
    from measure.verdict.criteria import CRITERIA

    level_of_both = chosen.level or (None if recipe is None else recipe.level) or CRITERIA.level
    by_films = of_films(level_of_both / 2)
    by_markers, nominal = of_markers(level_of_both / 2)
    joint = join_verdicts(
        by_markers.verdict,
        by_films.verdict,
        level=level_of_both,
        nominal={"area_weight": nominal.area_weight, "bending": mean_bending(nominal)},
    )
    deliver_joint(joint, (by_markers, by_films), delivery)


def _refuse_beside(chosen: CloseLoopCommand, sources: tuple[str, ...], *, films: bool) -> None:
    """Options that would be ignored beside a recipe that names its recordings."""
    if sources:
        raise UsageError(
            "the recipe names its recordings",
            where="SOURCE",
            fix="leave SOURCE or [[recording]] out",
        )
    for name in _OF_SOURCES:
        if name in typed_names(chosen) and not (films and name == "clock_offset"):
            spelled = "wind" if name == "winds" else name.replace("_", "-")
            raise UsageError(
                "the recipe says how its recordings are read",
                where=f"--{spelled}",
                fix="write it into the recipe",
            )


def _reading(
    chosen: CloseLoopCommand, recipe: ExperimentRecipe | None, *, joint: bool = False
) -> SourceOptions:
    """Returns how sources of the command line are read."""
    from measure.closing.verdict_sources import SourceOptions

    return SourceOptions(
        rate=chosen.rate,
        unit=chosen.unit,
        noise=chosen.noise,
        offset=None if joint else _seconds(chosen.clock_offset),
        up=_up(chosen, recipe),
        sensor=chosen.sensor,
        zone=chosen.zone,
        axis=_axis(chosen),
        confirm=on_command_line(chosen.accept, as_json=chosen.as_json),
        north=None if chosen.north is None else math.radians(chosen.north),
    )


def _seconds(offset: Stated | None) -> float | None:
    """Returns the seconds from the first sample of a log to the first frame.

    Raises:
        UsageError: they are uncertain.
    """
    if offset is None:
        return None
    if not offset.exact:
        raise UsageError(
            f"the clock offset {offset.text} s of markers is not one number",
            where="--clock-offset",
            fix="give 2.5",
        )
    return offset.low


def _draft(chosen: CloseLoopCommand, sources: tuple[str, ...], lake: Lake | None) -> None:
    """Writes the recipe of what the command line states.

    Raises:
        UsageError: there is a recipe already, or there are no markers or meshes.
    """
    from flagdata.core.files.outputs import write_file
    from flagdata.recipes.documents import to_toml
    from measure.closing.verdict_sources import draft_recordings, filled_entries
    from measure.trajectories import Setup

    if chosen.recipe is not None or chosen.draft is None or not sources:
        raise UsageError(
            "a draft is made of recordings of markers and meshes",
            where="--draft",
            fix="name these and no recipe",
        )
    setup = _setup(Setup(), chosen)
    size = () if setup.outline is None else setup.outline.max(axis=0).tolist()
    pins = (
        {}
        if setup.pins is None
        else {"points" if isinstance(setup.pins, tuple) else "at": setup.pins}
    )
    content = {
        "title": chosen.name or chosen.draft.stem,
        "test": {"level": chosen.level, "nulls": chosen.nulls},
        "cloth": dict(zip(("width", "height"), size, strict=False)),
        "material": {"name": chosen.material, "area_weight": _weight(setup, chosen)},
        "attachment": pins,
        **draft_recordings(
            sources,
            chosen.winds,
            _reading(chosen, None),
            lake,
            folder=chosen.draft.resolve().parent,
        ),
    }
    write_file(chosen.draft, to_toml(filled_entries(content)))
    if chosen.as_json:
        document("close-loop-draft", {"recipe": str(chosen.draft)})
    else:
        echo(chosen.draft)


def _weight(setup: Setup, chosen: CloseLoopCommand) -> str | None:
    """Returns the cloth's weight as a recipe states it."""
    if chosen.area_weight is not None:
        return chosen.area_weight.text
    if chosen.density_uncertainty is None or setup.material is None:
        return None
    value = setup.material.area_weight
    return f"{value:g}±{value * chosen.density_uncertainty:g}"


def _name(recording: str, sources: tuple[str, ...], recipe: ExperimentRecipe | None) -> str:
    """Returns the name of the first source that is a file, of the recipe, or of the first
    recording."""
    if sources and Path(sources[0]).exists():
        return Path(sources[0]).resolve().stem
    return recording if recipe is None or sources else recipe.title


def _axis(chosen: CloseLoopCommand) -> tuple[float, float, float] | None:
    """Returns where the air goes; None where north is given."""
    text = chosen.axis
    if chosen.north is not None:
        if "axis" in typed_names(chosen):
            raise UsageError(
                "both --axis and --north are given", where="--north", fix="keep one of them"
            )
        return None
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError as error:
        raise UsageError(
            f"{text!r} is not three numbers", where="--axis", fix="give x,y,z"
        ) from error
    if not 0 < math.hypot(x, y, z) < math.inf:
        raise UsageError(
            f"{text!r} has no direction", where="--axis", fix="give x,y,z, not all of them 0"
        )
    return x, y, z


def _up(chosen: CloseLoopCommand, recipe: ExperimentRecipe | None) -> Up:
    from measure.trajectories import Up

    if recipe is not None and "up" not in typed_names(chosen):
        return recipe.up
    if chosen.up not in list(Up):
        raise UnknownNameError.of("axis", chosen.up, list(Up), where="--up")
    return Up(chosen.up)


def _setup(setup: Setup, chosen: CloseLoopCommand, *, joint: bool = False) -> Setup:
    """Replaces what the command line states in a setup."""
    from measure.trajectories import sheet
    from sim.cloth.material import MATERIALS, named_material

    if chosen.material is not None:
        if chosen.material not in MATERIALS.names():
            raise UnknownNameError.of(
                "material", chosen.material, MATERIALS.names(), where="--material"
            )
        setup = replace(setup, material=named_material(chosen.material))
    setup = setup.state_weight(None if joint else chosen.area_weight, chosen.density_uncertainty)
    if chosen.flag_size is not None and not joint:
        try:
            width, height = (float(part) for part in chosen.flag_size.lower().split("x"))
        except ValueError as error:
            what = f"{chosen.flag_size!r} is not a size"
            raise UsageError(what, where="--flag-size", fix="give 1.5x1.0, in metres") from error
        setup = replace(setup, outline=sheet(width, height))
    if chosen.attachment is not None and not joint:
        setup = replace(setup, pins=_held(chosen.attachment))
    return setup


def _held(text: str) -> Hold | tuple[tuple[float, float], ...]:
    from measure.trajectories import Hold

    try:
        return Hold(text)
    except ValueError:
        return _places(text)


def _places(text: str) -> tuple[tuple[float, float], ...]:
    places: list[tuple[float, float]] = []
    for part in text.split(";"):
        try:
            u, v = (float(value) for value in part.split(","))
        except ValueError as error:
            raise UsageError(
                f"{part!r} is no place on the cloth",
                where="--attachment",
                fix="give corners, or u,v;u,v in metres",
            ) from error
        places.append((u, v))
    return tuple(places)
