"""`flagdata ingest`: camera files, anemometer logs, meshes and markers into the lake, or a look at what a file is."""

from __future__ import annotations

from pathlib import Path

import click
from click.core import ParameterSource

from flagdata.commands.confirm import on_command_line
from flagdata.commands.ingest_options import (
    SNIFF,
    Given,
    camera_options,
    labels,
    length_unit,
    marker_options,
    mesh_options,
    option,
    wind_options,
)
from flagdata.commands.ingest_sources import ingest_sources, sniff_sources
from flagdata.commands.sections import LongCommand
from flagdata.console import LocalPath, json_option, lake_option
from flagdata.errors import UsageError


@click.command(cls=LongCommand)
@click.argument("sources", nargs=-1, required=True, type=LocalPath(), metavar="SOURCE...")
@click.option("--sniff", is_flag=True, help="Only say what each source seems to be, and why; the lake is not touched.")
@click.option(
    "--as",
    "--format",
    "format_name",
    metavar="FORMAT",
    help="camera, meshes, markers, or an anemometer format; by content if not given.",
)
@click.option(
    "--session", metavar="NAME", help="One set-up at one place; its clips are always on the same side of a split."
)
@click.option("--name", help="What people call the artifact; the file's name by default.")
@click.option(
    "--topic",
    metavar="NAME",
    help="MCAP of other programs: the topic of pictures or numbers to read. LeRobot: the camera.",
)
@click.option("--episode", type=click.IntRange(min=0), metavar="N", help="LeRobot: the episode to read.")
@click.option(
    "--join", is_flag=True, help="Camera: the SOURCEs are the chapters of one recording, which become one artifact."
)
@click.option(
    "--stream",
    type=click.IntRange(min=0),
    metavar="N",
    help="Camera: number of the video stream in its file; the first by default.",
)
@click.option("--zone", metavar="ZONE", help="Zone of a clock that does not say: Europe/Amsterdam, +02:00, UTC.")
@click.option("--branch", default="main", show_default=True, help="The line of work to commit on.")
@click.option(
    "--start",
    metavar="TIME",
    help="Camera: instant of the first frame, ISO 8601. Wind: of the first row, where stamps count from a start.",
)
@click.option("--true-fps", type=float, metavar="HZ", help="Camera: rate at which a high-speed camera really ran.")
@click.option("--sequence-fps", type=float, metavar="HZ", help="Camera: rate of pictures that carry no time stamps.")
@click.option(
    "--rate",
    default="25",
    show_default=True,
    metavar="HZ|STEP|native",
    help="Camera: frames per second to keep; native keeps all. Meshes, markers: frames per second of a source that "
    "does not state them. Wind: readings per second of a log without timestamps, counted from --start. Also the time "
    "from one to the next, as in 10min.",
)
@click.option(
    "--crop",
    default="whole",
    show_default=True,
    metavar="BOX",
    help="Camera: x,y,width,height in px of the upright image; whole, square, or auto (where the motion is).",
)
@click.option(
    "--crop-picture",
    type=LocalPath(dir_okay=False),
    metavar="PATH",
    help="Camera: write the picture that shows --crop auto.",
)
@click.option("--exposure", type=float, metavar="S", help="Camera: exposure time, to stamp mid-exposure.")
@click.option(
    "--archive",
    type=click.Choice(["jpeg", "h264"]),
    default="jpeg",
    show_default=True,
    help="Camera: how frames are stored; h264 is smaller and slower to reach.",
)
@click.option(
    "--sensor", "--recipe", "sensor", metavar="RECIPE", help="Wind: a recipe of catalogs/sensors, or a TOML file."
)
@click.option(
    "--date", metavar="YYYY-MM-DD", help="Wind: day of the first sample, where the log has times of day only."
)
@click.option("--date-order", type=click.Choice(["dmy", "mdy", "ymd"]), help="Wind: order in dates of numbers only.")
@click.option(
    "--platform",
    type=click.Choice(["fixed", "moving", "corrected"]),
    help="Wind: fixed, as on a mast; moving, as on a boat; corrected, if a moving one logs the wind over ground.",
)
@click.option("--talker", metavar="ID", help="Wind: NMEA 0183 talker to read, where several share a stream.")
@click.option(
    "--azimuth", type=float, metavar="DEG", help="Wind: bearing of the sensor's north or bow, clockwise from north."
)
@click.option(
    "--clock",
    type=click.Choice(["first", "last", "sort"]),
    help="Wind: the clock was changed during the log: first = the time before the change is right, last = the time "
    "after it; sort = the clock is right, only sort the rows.",
)
@click.option("--zero-offset", metavar="M/S", help="Wind: speed to subtract; report, or estimate from idle stretches.")
@click.option("--encoding", metavar="CODEC", help="Wind: encoding of the text, where the file does not show it.")
@click.option(
    "--unit",
    metavar="UNIT",
    help="Wind: unit of a speed whose heading has none (m/s, km/h, mph, kn). Meshes, markers: of positions, else m.",
)
@click.option(
    "--wind",
    metavar="LABEL",
    help="Wind: the one anemometer to read of a table that holds several, or the column of its speed.",
)
@click.option(
    "--columns",
    metavar="LIST",
    help="Wind: what the columns of a table are, in their order or by heading or number, such as "
    "'date,time,wind_speed[km/h],,wind_direction[deg]' or '1=time,7=wind_speed[kn]'. Names: time, date, year, month, "
    "day, day_of_year, hour, minute, second, wind_speed, wind_direction, wind_direction_to, wind_x, wind_y, wind_z, "
    "apparent_wind_speed, apparent_wind_direction, air_temperature, relative_humidity, air_pressure, site. What is "
    "measured has its unit in brackets. A name that is not known is refused with the list of all.",
)
@click.option(
    "--missing", multiple=True, metavar="TEXT", help="Wind: a cell that means no value, such as -99.9; repeatable."
)
@click.option(
    "--expect",
    multiple=True,
    metavar="KEY",
    help="Wind: a check of a draft that you have answered with yes, by the key that the refusal names; repeatable.",
)
@click.option(
    "--accept",
    metavar="HASH",
    help="Wind: confirms what was drafted from a table that no recipe describes, by the hash that the refusal shows.",
)
@json_option
@lake_option
@click.pass_context
def ingest(
    context: click.Context,
    sources: tuple[Path, ...],
    sniff: bool,
    format_name: str | None,
    session: str | None,
    name: str | None,
    topic: str | None,
    episode: int | None,
    join: bool,
    stream: int | None,
    zone: str | None,
    branch: str,
    start: str | None,
    true_fps: float | None,
    sequence_fps: float | None,
    rate: str,
    crop: str,
    crop_picture: Path | None,
    exposure: float | None,
    archive: str,
    sensor: str | None,
    date: str | None,
    date_order: str | None,
    platform: str | None,
    talker: str | None,
    azimuth: float | None,
    clock: str | None,
    zero_offset: str | None,
    encoding: str | None,
    unit: str | None,
    wind: str | None,
    columns: str | None,
    missing: tuple[str, ...],
    expect: tuple[str, ...],
    accept: str | None,
    as_json: bool,
    lake_path: str,
) -> None:
    """Bring camera files, anemometer logs, mesh sequences and marker tables in.

    Whether a SOURCE is a camera's, an anemometer's, a folder of meshes, a table of markers or a record that flagdata
    exported is decided by its content, and an option goes to the sources of its kind. Each is one commit: what fails
    leaves the lake as it was, and the others go on. How a table without a recipe is to be read is drafted from its own
    text; such a draft is shown, and enters only when it is confirmed at the terminal or by --accept.

    \b
      flagdata ingest --sniff DSC_0001.MP4 TOA5_1234.dat
      flagdata ingest DSC_0001.MP4 --start 2026-05-01T12:00:00+02:00 --crop auto --crop-picture crop.png
      flagdata ingest GH010042.MP4 GH020042.MP4 --join
      flagdata ingest mast.csv --sensor generic-csv --zone +01:00 --session field-1
      flagdata ingest station.csv --unit km/h --zone Europe/Amsterdam
      flagdata ingest arcsim-output --name reference-4ms
      flagdata ingest drive.mcap --topic /camera/front
      flagdata ingest pusht --episode 3 --start 2026-05-01T12:00:00Z
      flagdata ingest drive.mcap --topic /mast --columns 'time=time,speed=wind_speed[m/s]'
    """
    from flagdata.outputs import check_file
    from flagdata.timebase import names_zone

    given = frozenset(
        parameter
        for parameter in context.params
        if context.get_parameter_source(parameter) is ParameterSource.COMMANDLINE
    )
    if crop_picture is not None and crop.strip().lower() != "auto":
        raise UsageError("--crop-picture without --crop auto", where=str(crop_picture), fix="add --crop auto")
    if crop_picture is not None:
        check_file(crop_picture, command="ingest")
    chapters: tuple[Path, ...] = ()
    if join:
        from flagdata.ingest.camera.joined import in_order

        first, *later = in_order(sources)
        sources, chapters = (first,), tuple(later)
    options = Given(
        camera=camera_options(
            start=start,
            zone_name=zone,
            true_fps=true_fps,
            sequence_fps=sequence_fps,
            rate=rate,
            crop=crop,
            exposure=exposure,
            archive=archive,
            topic=topic,
            episode=episode,
            stream=stream,
            chapters=chapters,
        ),
        wind=wind_options(
            format_name=None if format_name in ("camera", "meshes", "markers") else format_name,
            sensor=sensor,
            zone_name=zone,
            date=date,
            date_order=date_order,
            platform=platform,
            talker=talker,
            azimuth=azimuth,
            clock=clock,
            zero_offset=zero_offset,
            encoding=encoding,
            unit=unit,
            start=start,
            wind=wind,
            columns=columns,
            rate=rate if "rate" in given else None,
            missing=missing,
            expect=expect,
            topic=topic,
        ),
        meshes=mesh_options(rate=rate if "rate" in given else None, length=length_unit(unit)),
        markers=marker_options(rate=rate if "rate" in given else None, length=length_unit(unit)),
        labels=labels(name, session),
        branch=branch,
        crop_picture=crop_picture,
        zoned_start=start is not None and names_zone(start),
        unit=unit,
        confirm=on_command_line(accept, as_json=as_json),
    )
    if sniff:
        for parameter in sorted(given - {*SNIFF, "as_json", "lake_path"}):
            raise UsageError(f"{option(parameter)} means nothing to --sniff", fix="leave it out")
        sniff_sources(sources, options, given=given, as_json=as_json)
        return
    from flagdata.lake import Lake

    lake = Lake.open(lake_path)
    lake.check_writable()
    ingest_sources(lake, sources, options, given=given, format_name=format_name, as_json=as_json)
