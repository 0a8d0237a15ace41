"""`flagdata observe`: what a film shows in numbers with units, window by window."""

from __future__ import annotations

from pathlib import Path

import click

from flagdata.commands.durations import DURATION
from flagdata.commands.sections import LongCommand
from flagdata.console import LakePlace, LocalPath, document, echo, json_option, progress, say
from flagdata.errors import RefusedError, UsageError
from flagdata.printable import SHORT
from flagdata.storage import Place
from measure.film_options import film_options


@click.command(cls=LongCommand)
@click.argument("source", metavar="SOURCE")
@click.option(
    "--flag-size",
    metavar="LxH",
    required=True,
    help="Length along the wind and height along the pole [m], as in 1.5x1.0; the height gives the scale.",
)
@click.option("--window", "seconds", type=DURATION, default="2.5s", show_default=True, help="Length of a window.")
@film_options
@click.option("--parquet", "parquet_path", type=LocalPath(), metavar="FILE.parquet", help="Write the table as Parquet.")
@click.option("--zarr", "zarr_path", type=LocalPath(), metavar="FOLDER", help="Write the table as a Zarr data set.")
@click.option(
    "--picture",
    "picture_path",
    type=LocalPath(),
    metavar="FILE.png",
    help="Draw each observable against time, and against the log's wind where the recording has one.",
)
@click.option(
    "--lake",
    "lake_path",
    type=LakePlace(),
    envvar="FLAGDATA_LAKE",
    help="Where recordings are, and where tables go; also FLAGDATA_LAKE.",
)
@click.option(
    "--at", metavar="REF", help="Tag, branch or version of the lake to look at; by default the branch's head."
)
@click.option("--branch", default="main", show_default=True, help="Branch of the lake to commit on.")
@click.option("--read-only", is_flag=True, help="Read the lake, commit nothing.")
@json_option
def observe(
    source: str,
    flag_size: str,
    seconds: float,
    crop: str | None,
    flag: int | None,
    first: float | None,
    last: float | None,
    true_fps: float | None,
    sequence_fps: float | None,
    parquet_path: Path | None,
    zarr_path: Path | None,
    picture_path: Path | None,
    lake_path: Place | None,
    at: str | None,
    branch: str,
    read_only: bool,
    as_json: bool,
) -> None:
    """Read observables off a film: droop, extension, speeds, frequency, amplitudes, wave, area.

    SOURCE is a video file, a folder of images, or a recording, clip or camera of --lake by its name or id. Each window
    gives a value with its unit, or the reason why it shows none. With --lake the table becomes an artifact.
    docs/method/films.md defines each observable and states its error.

    \b
      flagdata observe clip.mp4 --flag-size 1.5x1.0 --parquet clip.parquet --picture clip.png
      flagdata observe recording-7 --lake lake --flag-size 1.5x1.0 --json
    """
    from flagdata.lake import Lake
    from flagdata.outputs import check_file, check_folder, fresh_folder, write_file
    from flagdata.pages.pictures import png
    from measure.film.similarity import parse_size
    from measure.film.source import Reading, box_of, subjects
    from measure.observables.artifact import keep
    from measure.observables.picture import picture
    from measure.observables.table import table_of
    from measure.observables.watching import count_of, watched

    if parquet_path is not None:
        check_file(parquet_path)
    if picture_path is not None:
        check_file(picture_path, command="observe")
    if zarr_path is not None:
        check_folder(zarr_path)
    if seconds < 1.0:
        raise UsageError(f"windows of {seconds:g} s", where="--window", fix="give 1s or more: a flutter's period")
    box = box_of(crop)
    size = parse_size(flag_size)
    lake = None if lake_path is None else Lake.open(lake_path)
    if lake is not None and not read_only:
        lake.check_writable()
    reading = Reading(crop=box, flag=flag, aspect=size.aspect, true_fps=true_fps, sequence_fps=sequence_fps)
    (subject,) = subjects(source, query=None, lake=lake, at=at if at is not None else branch, reading=reading)
    count = count_of(subject.film, first=first, last=last, seconds=seconds)
    with progress(count, label="observe", unit="window") as advance:
        windows = watched(subject.film, size, first=first, last=last, seconds=seconds, advance=advance)
    table = table_of(
        windows,
        film=subject.film.name,
        length=size.length,
        height=size.height,
        start=subject.film.start,
        wind=None if subject.record is None else subject.record.wind(),
    )
    for sentence in subject.film.sentences:
        say(f"  {sentence}")
    if table.empty:
        raise RefusedError(
            f"none of {len(table.time)} windows shows the cloth: its outline or its hoist was not found",
            where=subject.film.name,
            fix="give --crop around one whole flag on its pole, or another film",
        )
    identity = None
    if lake is not None and not read_only:
        place = keep(lake, table, subject, {**reading.recipe(), "part": [first, last]}, branch=branch)
        identity = place.artifact.id
        say(f"{identity[:SHORT]}  measurement, {place.sentence}")
    if parquet_path is not None:
        write_file(parquet_path, table.parquet())
    if zarr_path is not None:
        with fresh_folder(zarr_path) as scratch:
            table.write_zarr(scratch)
    if picture_path is not None:
        write_file(picture_path, png(picture(table)), command="observe")
    if as_json:
        document("observe", {**table.as_dict(), "artifact": identity})
    else:
        for line in table.lines():
            echo(line)
