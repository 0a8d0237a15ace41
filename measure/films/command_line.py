"""Options of `flagdata close-loop` that are about films, and which options belong to one kind of source alone."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from flagdata.commands.durations import DURATION
from flagdata.commands.statements import STATED
from flagdata.console import LocalPath
from flagdata.errors import UsageError
from flagdata.stated import Stated

_Command = Callable[..., Any]
OF_FILMS = (
    "flag_size",
    "attachment",
    "azimuth",
    "elevation",
    "distance",
    "area_weight",
    "crop",
    "flag",
    "first",
    "last",
    "simulations",
    "cache",
    "log",
    "clock_offset",
)
OF_MARKERS = (
    "recipe_path",
    "winds",
    "axis",
    "north",
    "offset",
    "sensor",
    "zone",
    "accept",
    "density_uncertainty",
    "size",
    "pins",
    "rate",
    "unit",
    "up",
    "noise",
    "bank",
    "most_nulls",
)


@dataclass(frozen=True, kw_only=True)
class Given:
    """What the command line says of films; see `flagdata calibrate` for all but `area_weight`."""

    flag_size: str | None
    attachment: str
    azimuth: Stated | None
    elevation: Stated | None
    distance: float
    area_weight: Stated | None
    crop: str | None
    flag: int | None
    first: float
    last: float | None
    simulations: int | None
    cache: Path | None
    log: str | None
    clock_offset: Stated | None


def film_options(command: _Command) -> _Command:
    """Adds the options, and gives the command what they say as `film`."""
    options = (
        click.option(
            "--flag-size",
            metavar="LxH",
            help="Of films: length along the wind and height along the pole [m], as in 1.5x1.0.",
        ),
        click.option(
            "--attachment",
            type=click.Choice(["corners", "hoist"]),
            default="corners",
            show_default=True,
            help="Of films: how the flag is held, at both ends of its hoist or along all of it.",
        ),
        click.option(
            "--azimuth",
            type=STATED,
            metavar="DEGREES",
            help="Of films: the camera's axis to the wind, 90 from the side, as in 70±7; by default 30:150.",
        ),
        click.option(
            "--elevation", type=STATED, metavar="DEGREES", help="Of films: the camera's axis upwards; by default 0±5."
        ),
        click.option(
            "--distance",
            type=click.FloatRange(min=1.0),
            default=15.0,
            show_default=True,
            metavar="M",
            help="Of films: from the camera to the flag [m].",
        ),
        click.option(
            "--area-weight",
            type=STATED,
            metavar="KG/M2",
            help="Of films: a cloth that was weighed, as in 0.155±0.005; by default that of any flag.",
        ),
        click.option("--crop", metavar="X,Y,W,H", help="Of films: the region in which the flag is [px]."),
        click.option(
            "--flag",
            type=click.IntRange(min=1),
            metavar="N",
            help="Of films: which moving cloth; by default the one that moves most.",
        ),
        click.option(
            "--log",
            metavar="ARTIFACT",
            help="Of tables of observables without a wind: a wind of --lake beside them, by its id.",
        ),
        click.option(
            "--clock-offset",
            type=STATED,
            metavar="S±SIGMA",
            help="Of such tables: seconds to add to their clock to reach the log's; by default estimated.",
        ),
        click.option(
            "--start", "first", type=DURATION, default="0s", metavar="TIME", help="Of films: where to begin, as in 12s."
        ),
        click.option(
            "--end", "last", type=DURATION, metavar="TIME", help="Of films: where to end; two minutes are used at most."
        ),
        click.option(
            "--simulations",
            type=click.IntRange(min=64),
            show_default="64, from three recordings on 128",
            help="Of films: simulated flags of the base model for each recording.",
        ),
        click.option(
            "--cache",
            type=LocalPath(),
            metavar="FOLDER",
            help="Of films: where simulations are kept; by default the user's cache folder.",
        ),
    )

    @functools.wraps(command)
    def collected(*args: Any, **named: Any) -> Any:
        return command(*args, film=Given(**{name: named.pop(name) for name in OF_FILMS}), **named)

    for option in reversed(options):
        collected = option(collected)
    return collected


def refuse_of_others(context: click.Context, *, films: bool) -> None:
    """Options that would be ignored.

    Args:
        films: whether the sources are films or tables of observables.

    Raises:
        UsageError: one of them is on the command line.
    """
    spelled = {parameter.name: parameter.opts[-1] for parameter in context.command.params}
    for name in OF_MARKERS if films else OF_FILMS:
        if context.get_parameter_source(name) is ParameterSource.COMMANDLINE:
            what = "films and tables of observables" if films else "markers and meshes"
            other = "markers and meshes" if films else "films and tables of observables"
            raise UsageError(f"the sources are {what}", where=spelled[name], fix=f"leave it out: it is about {other}")
