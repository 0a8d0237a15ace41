"""`flagdata close-loop`: recordings in; a verdict, its report and the models out."""

from __future__ import annotations

import math
import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.core import ParameterSource

from flagdata.commands.confirm import on_command_line
from flagdata.commands.sections import LongCommand
from flagdata.console import LakePlace, LocalPath, json_option, say
from flagdata.errors import UnknownNameError, UsageError
from flagdata.storage import Place
from measure.closing.command_line import null_options, nulls_given, refuse, stage_bars
from measure.closing.findings import with_warnings
from measure.films.command_line import Given, film_options, refuse_of_others

if TYPE_CHECKING:
    from measure.closing.artifacts import Answer
    from measure.observe import Setup, Up
    from measure.observe.recipe import ExperimentRecipe
    from sim.material import Material

_OF_SOURCES = ("winds", "axis", "north", "offset", "sensor", "zone", "accept", "rate", "unit", "noise", "up")
"""Options that say how sources of the command line are read."""


@click.command("close-loop", cls=LongCommand)
@click.argument("sources", metavar="SOURCE...", nargs=-1)
@click.option(
    "--recipe",
    "recipe_path",
    type=LocalPath(),
    metavar="FILE.toml",
    help="Recipe of the cloth, pins, wind and test; it may name the recordings as well.",
)
@click.option(
    "--wind",
    "winds",
    multiple=True,
    metavar="M/S|LOG|ID",
    help="Wind beside the recordings: one for all of them, or one for each.",
)
@click.option(
    "--axis",
    default="1,0,0",
    show_default=True,
    metavar="X,Y,Z",
    help="Direction towards which a wind given as a speed blows.",
)
@click.option(
    "--north",
    type=float,
    metavar="DEG",
    help="Where north lies, as an angle from +x towards +y, for a log that has directions.",
)
@click.option("--offset", type=float, help="Time from the first sample of the log to the first frame [s].")
@click.option(
    "--sensor", metavar="NAME|FILE.toml", help="Recipe that says how to read a log that does not say so itself."
)
@click.option("--zone", help="Time zone of the stamps of a log: +02:00, or an IANA name.")
@click.option(
    "--accept", metavar="HASH", help="Confirms how a log without a recipe is read, by the hash of its refusal."
)
@click.option(
    "--material",
    help="Nominal material, a name of the catalog; by default the one that the source states. Of films: what the flag "
    "is made of, as in woven-polyester, knit or camel-ponte-roma; by default any fabric.",
)
@click.option(
    "--density-uncertainty",
    type=click.FloatRange(0, 1, min_open=True),
    help="Relative standard uncertainty of the material's area weight: 0.02 for a cloth that was weighed to 2 %; "
    "by default 0.3.",
)
@click.option("--size", metavar="WxH", help="Size of the flat cloth [m]; by default the outline of the markers.")
@click.option(
    "--pins",
    help="Where it is held: hoist-corners, top-corners, hoist, or u,v;u,v;… [m]; by default as the source states.",
)
@click.option(
    "--rate", type=click.FloatRange(min=0, min_open=True), help="Frames per second, if the source does not state them."
)
@click.option("--unit", default="m", show_default=True, help="Unit of the positions.")
@click.option(
    "--up", default="z", show_default=True, help="Axis of the recordings that points up: z, y, x, -z, -y or -x."
)
@click.option(
    "--noise",
    type=click.FloatRange(min=0),
    help="Standard deviation of a marker's coordinate [m]; by default it is estimated.",
)
@film_options
@null_options(level="Significance level of the global test; 0.05 by default.")
@click.option(
    "--suspect",
    metavar="EFFECT[+|-]",
    help="An effect that was suspected before the recordings were looked at, as in lift or vertical-wind-; it alone "
    "is tested for, in that direction, and seen where it is weaker.",
)
@click.option(
    "--most-nulls",
    type=click.IntRange(min=1),
    default=320,
    show_default=True,
    help="Number up to which more are simulated where p is within a factor of two of the level.",
)
@click.option(
    "--lake",
    "lake_path",
    type=LakePlace(),
    envvar="FLAGDATA_LAKE",
    help="Lake that artifacts are read from and results are written to; also FLAGDATA_LAKE.",
)
@click.option("--branch", default="main", show_default=True, help="Branch of the lake to commit on.")
@click.option("--name", help="Name of the measurement and its models; by default that of the first source.")
@click.option(
    "--out",
    type=LocalPath(),
    default=Path("out/close-loop"),
    show_default=True,
    help="Folder that report.html, verdict.json and the models are written to.",
)
@json_option
@click.pass_context
def close_loop(
    context: click.Context,
    film: Given,
    sources: tuple[str, ...],
    recipe_path: Path | None,
    winds: tuple[str, ...],
    axis: str,
    north: float | None,
    offset: float | None,
    sensor: str | None,
    zone: str | None,
    accept: str | None,
    material: str | None,
    density_uncertainty: float | None,
    size: str | None,
    pins: str | None,
    rate: float | None,
    unit: str,
    up: str,
    noise: float | None,
    nulls: int | None,
    suspect: str | None,
    most_nulls: int,
    bank: Path | None,
    level: float | None,
    seed: int,
    workers: int | None,
    lake_path: Place | None,
    branch: str,
    name: str | None,
    out: Path,
    as_json: bool,
) -> None:
    """Find what the model of a cloth lacks, name it, and say what adding it changes on unseen data.

    SOURCE is the output folder of an ArcSim run, a table of tracked markers (CSV or Parquet with the columns frame or
    time, marker, u, v, x, y, z, and recording if there are several), or a mesh sequence or markers of --lake by id.
    Several are recordings of one cloth, best in different winds. With --lake the verdict and both models become
    artifacts; `flagdata simulate` runs a model by its name.

    Or SOURCE is a film with its log, a recording of --lake by its name or id, or a table of observables as `flagdata
    calibrate` takes it: then what a flag shows in windows of 2.5 s is compared, and --flag-size is needed. Films beside
    markers of the same cloth are judged together: each kind at half of the level, with one joint answer.

    \b
      flagdata close-loop run-4ms/ run-8ms/ --wind 4 --wind 8
      flagdata close-loop tracks.csv --wind anemometer.csv --material camel-ponte-roma --pins hoist-corners
      flagdata close-loop --recipe flag.toml --lake lake
      flagdata close-loop monday tuesday --lake lake --flag-size 1.5x1.0 --azimuth 70±7
    """
    from flagdata.lake import Lake
    from flagdata.outputs import check_files
    from measure.closing.artifacts import answer_of
    from measure.closing.close import close_loop as close
    from measure.closing.models import models
    from measure.closing.output import FILES, JOINT, KINDS, deliver, deliver_joint
    from measure.closing.sources import Reading, read
    from measure.films.sources import films_among
    from measure.forecasting.strengths import Suspicion, on_markers
    from measure.loop.run import Options
    from measure.nulls.workload import of_recordings
    from measure.observe import Setup, observe
    from measure.observe import recipe as recipes

    recipe = None if recipe_path is None else recipes.parse(recipe_path)
    in_recipe = recipe is not None and bool(recipe.recordings)
    if not in_recipe and not sources:
        raise UsageError("no recordings", where="SOURCE", fix="name them, or a recipe that does")
    check_files(out, *dict.fromkeys((*FILES, *JOINT)), command="close-loop")
    lake = None if lake_path is None else Lake.open(lake_path)
    if lake is not None:
        lake.check_writable()
    films = films_among(sources, lake=lake, at=branch, sized=film.flag_size is not None, tracked=in_recipe)
    tracked = tuple(source for source in sources if source not in films)
    if in_recipe:
        _refuse_beside(context, tracked)
    both = bool(films) and (in_recipe or bool(tracked))
    names = {kind: name if name is None or not both else f"{name}-{kind}" for kind in KINDS}
    if both:
        for kind in KINDS:
            check_files(out / kind, *FILES, command="close-loop")
        if nulls is not None:
            raise UsageError(
                "films count kinds of numerics, and markers recordings",
                where="--nulls",
                fix="leave it out: 40 kinds are simulated for markers and 20 for films",
            )
    else:
        refuse_of_others(context, films=bool(films))

    def of_markers(level: float | None) -> tuple[Answer, Material]:
        """The answer by markers, and the cloth's nominal material."""
        said = nulls_given(recipe, level=level, nulls=nulls, bank=bank)
        options = Options(
            seed=seed,
            bank=bank,
            most_nulls=most_nulls,
            workers=workers or len(os.sched_getaffinity(0)),
            suspected=None if suspect is None else Suspicion.parse(suspect, on_markers()),
            **said,
        )
        setup = _setup(Setup() if recipe is None else recipe.setup, material, density_uncertainty, size, pins)
        if recipe is not None and in_recipe:
            observed = recipes.read(replace(recipe, setup=setup), lake)
        else:
            reading = Reading(
                rate=rate,
                unit=unit,
                noise=noise,
                offset=offset,
                up=_up(context, up, recipe),
                sensor=sensor,
                zone=zone,
                axis=_axis(context, axis, north),
                confirm=on_command_line(accept, as_json=as_json),
                north=None if north is None else math.radians(north),
            )
            observed = observe(read(tracked, winds, reading, lake), setup)
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
            models=models(verdict, observed.experiment, name=called, seed=seed),
        )
        return answer, cloth.material

    def of_films(level: float | None) -> Answer:
        from measure.films.command import close_films

        return close_films(
            films,
            film,
            lake=lake,
            branch=branch,
            name=names["films"],
            material=material,
            level=level,
            nulls=nulls,
            suspect=suspect,
            seed=seed,
            workers=workers,
        )

    if not both:
        answer = of_films(level) if films else of_markers(level)[0]
        deliver(answer, out=out, lake=lake, branch=branch, as_json=as_json)
        return
    from measure.calibrate.simulation import mean_bending
    from measure.closing.joint import joined
    from measure.verdict.criteria import CRITERIA

    whole = level or (None if recipe is None else recipe.level) or CRITERIA.level
    by_films = of_films(whole / 2)
    by_markers, nominal = of_markers(whole / 2)
    joint = joined(
        by_markers.verdict,
        by_films.verdict,
        level=whole,
        nominal={"area_weight": nominal.density, "bending": mean_bending(nominal)},
    )
    deliver_joint(joint, (by_markers, by_films), out=out, lake=lake, branch=branch, as_json=as_json)


def _refuse_beside(context: click.Context, sources: tuple[str, ...]) -> None:
    """Options that would be ignored beside a recipe that names its recordings."""
    if sources:
        raise UsageError("the recipe names its recordings", where="SOURCE", fix="leave SOURCE or [[recording]] out")
    for option in _OF_SOURCES:
        if context.get_parameter_source(option) is ParameterSource.COMMANDLINE:
            spelled = "wind" if option == "winds" else option
            raise UsageError(
                "the recipe says how its recordings are read", where=f"--{spelled}", fix="write it into the recipe"
            )


def _name(recording: str, sources: tuple[str, ...], recipe: ExperimentRecipe | None) -> str:
    """The name of the first source that is a file, of the recipe, or of the first recording."""
    if sources and Path(sources[0]).exists():
        return Path(sources[0]).resolve().stem
    return recording if recipe is None or sources else recipe.title


def _axis(context: click.Context, text: str, north: float | None) -> tuple[float, float, float] | None:
    """Where the air goes; None where north is given."""
    if north is not None:
        if context.get_parameter_source("axis") is ParameterSource.COMMANDLINE:
            raise UsageError("both --axis and --north are given", where="--north", fix="keep one of them")
        return None
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError as error:
        raise UsageError(f"{text!r} is not three numbers", where="--axis", fix="give x,y,z") from error
    if not 0 < math.hypot(x, y, z) < math.inf:
        raise UsageError(f"{text!r} has no direction", where="--axis", fix="give x,y,z, not all of them 0")
    return x, y, z


def _up(context: click.Context, text: str, recipe: ExperimentRecipe | None) -> Up:
    from measure.observe import Up

    if recipe is not None and context.get_parameter_source("up") is not ParameterSource.COMMANDLINE:
        return recipe.up
    if text not in list(Up):
        raise UnknownNameError.of("axis", text, list(Up), where="--up")
    return Up(text)


def _setup(
    setup: Setup, material: str | None, density_uncertainty: float | None, size: str | None, pins: str | None
) -> Setup:
    """A setup with what the command line says instead."""
    from measure.observe import Hold, sheet
    from sim.material import MATERIALS, named

    if material is not None:
        if material not in MATERIALS.names():
            raise UnknownNameError.of("material", material, MATERIALS.names(), where="--material")
        setup = replace(setup, material=named(material))
    if density_uncertainty is not None:
        setup = replace(setup, mass_known=True, density_uncertainty=density_uncertainty)
    if size is not None:
        try:
            width, height = (float(part) for part in size.lower().split("x"))
        except ValueError as error:
            raise UsageError(f"{size!r} is not a size", where="--size", fix="give 1.5x1.0, in metres") from error
        setup = replace(setup, outline=sheet(width, height))
    if pins is not None:
        held: Hold | tuple[tuple[float, float], ...]
        held = Hold(pins) if pins in {h.value for h in Hold} else _places(pins)
        setup = replace(setup, pins=held)
    return setup


def _places(text: str) -> tuple[tuple[float, float], ...]:
    places: list[tuple[float, float]] = []
    for part in text.split(";"):
        try:
            u, v = (float(value) for value in part.split(","))
        except ValueError as error:
            raise UsageError(
                f"{part!r} is no place on the cloth", where="--pins", fix="give hoist-corners, or u,v;u,v in metres"
            ) from error
        places.append((u, v))
    return tuple(places)
