"""`flagdata ingest`: camera files, anemometer logs, meshes and markers into the lake, or a look at
what a file is."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, ClassVar

import click

from flagdata.api.recording_verbs import SOURCE, FromAnemometer, FromCamera, FromFrames, Ingesting
from flagdata.commands.confirm_recipe import on_command_line
from flagdata.commands.ingest_options import SNIFF, IngestRequest
from flagdata.commands.ingest_sources import ingest_sources, sniff_sources
from flagdata.core.console import LocalPath
from flagdata.errors import UsageError
from flagdata.verbs.verb_options import (
    AsJson,
    LongCommand,
    argument,
    command,
    described_fields,
    option,
    options,
    typed_names,
)


@options
class Sources(AsJson):
    """The sources on the command line."""

    sources: tuple[Path, ...] = argument("Files or folders.", "SOURCE...", type=LocalPath())


@options
class IngestCommand(Sources, Ingesting):
    """The same on the command line, or a look at what a source is."""

    sniff: bool = option(
        "Only say what each source seems to be, and why; the lake is not touched.",
        default=False,
        section=SOURCE,
    )


@options
class FilmCommand(Sources, FromCamera):
    """How films are read."""

    HELP: ClassVar[Mapping[str, str]] = {
        "topic": "MCAP of other programs: the topic of the pictures. LeRobot: the camera.",
        "start": "Instant of the first frame, ISO 8601.",
        "rate": "Frames per second to keep, 25 by default; native keeps all.",
    }


@options
class WindCommand(Sources, FromAnemometer):
    """How logs are read."""

    HELP: ClassVar[Mapping[str, str]] = {
        "topic": "MCAP of other programs: the topic of the readings.",
        "start": "Instant of the first row, ISO 8601, where stamps count from a start.",
        "rate": "Readings per second of a log without timestamps, counted from --start; or the "
        "time from one to the "
        "next, as in 10min.",
        "unit": "Unit of a speed whose heading has none: m/s, km/h, mph, kn.",
    }

    format: str | None = option(
        "An anemometer format; by content if not given.",
        "--as",
        default=None,
        section=SOURCE,
        metavar="FORMAT",
    )


@options
class FramesCommand(Sources, FromFrames):
    """How meshes or markers are read."""

    HELP: ClassVar[Mapping[str, str]] = {
        "rate": "Frames per second of a source that does not state them.",
        "unit": "Unit of the positions; m by default.",
    }


@command(FilmCommand)
def film(chosen: FilmCommand) -> None:
    """Bring camera files, folders of pictures and videos of other data sets in."""
    _ingest(chosen, kind="camera")


@command(WindCommand)
def wind(chosen: WindCommand) -> None:
    """Bring the logs of anemometers in."""
    _ingest(chosen, kind="anemometer")


@command(FramesCommand)
def meshes(chosen: FramesCommand) -> None:
    """Bring mesh sequences in: folders of OBJ files, as ArcSim or flagdata export writes them."""
    _ingest(chosen, kind="meshes")


@command(FramesCommand)
def markers(chosen: FramesCommand) -> None:
    """Bring tables of tracked markers in."""
    _ingest(chosen, kind="markers")


def _sources_follow(below: LongCommand, words: list[str]) -> bool:
    sources: object = None
    with suppress(click.UsageError):
        sources = below.make_parser(click.Context(below)).parse_args([*words])[0].get("sources")
    return isinstance(sources, tuple) and bool(sources)


class Kinds(LongCommand):
    """A command that does what one of others does where its first word names that. A word that is
    also a file, after which no source follows, is that file.

    Attributes:
        commands: the others, by their names.
    """

    commands = {str(one.name): one for one in (film, wind, meshes, markers)}  # noqa: RUF012

    def make_context(
        self,
        info_name: str | None,
        args: list[str],
        parent: click.Context | None = None,
        **extra: Any,
    ) -> click.Context:
        below = self.commands.get(args[0]) if args else None
        if below is None or (Path(args[0]).exists() and not _sources_follow(below, args[1:])):
            return super().make_context(info_name, args, parent, **extra)
        defaults = None if parent is None else parent.lookup_default(str(info_name))
        return below.make_context(
            f"{info_name} {args[0]}", args[1:], parent, default_map=defaults, **extra
        )


@command(IngestCommand, cls=Kinds)
def ingest(chosen: IngestCommand) -> None:
    """Bring camera files, anemometer logs, mesh sequences and marker tables in.

    Whether a SOURCE is a camera's, an anemometer's, a folder of meshes, a table of markers or a
    record that flagdata exported is decided by its content, and an option goes to the sources of
    its kind. Each is one commit: what fails leaves the lake as it was, and the others go on. How a
    table without a recipe is to be read is drafted from its own text; such a draft is shown, and
    enters only when it is confirmed at the terminal or by --accept.

    \b
      flagdata ingest --sniff DSC_0001.MP4 TOA5_1234.dat
      flagdata ingest DSC_0001.MP4 --start 2026-05-01T12:00:00+02:00 \\
          --crop auto --crop-picture crop.png
      flagdata ingest GH010042.MP4 GH020042.MP4 --join
      flagdata ingest mast.csv --sensor generic-csv --zone +01:00 --session field-1
      flagdata ingest station.csv --unit km/h --zone Europe/Amsterdam
      flagdata ingest arcsim-output --name reference-4ms
      flagdata ingest drive.mcap --topic /camera/front
      flagdata ingest pusht --episode 3 --start 2026-05-01T12:00:00Z
      flagdata ingest drive.mcap --topic /mast --columns 'time=time,speed=wind_speed[m/s]'

    `flagdata ingest film | wind | meshes | markers SOURCE...` takes sources of that kind and its
    options alone.
    """
    if not chosen.sniff:
        _ingest(chosen)
        return
    for name in sorted(typed_names(chosen) - {*SNIFF, "as_json", "lake"}):
        spelled = described_fields(type(chosen))[name][1].spelling_of(name)
        raise UsageError(f"{spelled} means nothing to --sniff", fix="leave it out")
    given = IngestRequest.of(chosen, confirm=on_command_line(chosen.accept, as_json=chosen.as_json))
    sniff_sources(given, as_json=chosen.as_json)


def _ingest(
    chosen: IngestCommand | FilmCommand | WindCommand | FramesCommand, *, kind: str | None = None
) -> None:
    accept = chosen.accept if isinstance(chosen, FromAnemometer) else None
    given = IngestRequest.of(
        chosen, kind=kind, confirm=on_command_line(accept, as_json=chosen.as_json)
    )
    lake = chosen.opened()
    lake.check_writable()
    ingest_sources(lake, given, as_json=chosen.as_json)
