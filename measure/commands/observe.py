"""`flagdata observe`: what a film shows in numbers with units, window by window."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from flagdata.api.measuring_verbs import Observing
from flagdata.core.console import LocalPath, document, echo, progress, say
from flagdata.core.json_values import json_values
from flagdata.core.printable import SHORT
from flagdata.core.workload import one_thread
from flagdata.errors import RefusedError, UsageError
from flagdata.examples import check_without_lake
from flagdata.verbs.shared_options import WRITTEN, Keeping
from flagdata.verbs.verb_options import AsJson, command, option, options

if TYPE_CHECKING:
    from flagdata.lake import Lake
    from flagdata.lake.catalog_rows import Rows
    from measure.film.film_source import FilmReading, Subject
    from measure.observables.observables_table import ObservableTable


@options
class ObserveCommand(AsJson, Observing, Keeping):
    """The same on the command line, and what is written."""

    parquet: Path | None = option(
        "Write the table as Parquet.",
        default=None,
        section=WRITTEN,
        type=LocalPath(),
        metavar="FILE.parquet",
    )
    zarr: Path | None = option(
        "Write the table as a Zarr data set.",
        default=None,
        section=WRITTEN,
        type=LocalPath(),
        metavar="FOLDER",
    )
    picture: Path | None = option(
        "Draw each observable against time, and against the log's wind where the recording has "
        "one.",
        default=None,
        section=WRITTEN,
        type=LocalPath(),
        metavar="FILE.png",
    )


@command(ObserveCommand)
def observe(chosen: ObserveCommand) -> None:
    """Read observables off a film: droop, extension, speeds, frequency, amplitudes, wave, area.

    SOURCE is a video file, a folder of images, or a recording, clip or camera of --lake by its name
    or id. Each window gives a value with its unit, or the reason why it shows none. With --lake the
    table becomes an artifact. docs/method/films.md defines each observable and states its error.

    \b
      flagdata observe clip.mp4 --flag-size 1.5x1.0 --parquet clip.parquet --picture clip.png
      flagdata observe recording-7 --lake lake --flag-size 1.5x1.0 --json
    """
    from flagdata.core.files.outputs import check_file, check_folder, fresh_folder, write_file

    if chosen.parquet is not None:
        check_file(chosen.parquet)
    if chosen.picture is not None:
        check_file(chosen.picture, command="observe")
        from flagdata.pages.chart_drawing import check_format

        check_format(chosen.picture)
    if chosen.zarr is not None:
        check_folder(chosen.zarr)
    if chosen.lake is None:
        check_without_lake(str(chosen.source))
    from measure.observables.observables_artifact import keep
    from measure.observables.observables_picture import chart_of_table

    lake = chosen.opened()
    table, subject, reading = _table(chosen, lake, at=chosen.version)
    for sentence in subject.film.sentences:
        say(f"  {sentence}")
    _check_shown(table, subject)
    identity = None
    if lake is not None and not chosen.read_only:
        part = [chosen.start, chosen.end]
        placed = keep(
            lake, table, subject, {**reading.recipe(), "part": part}, branch=chosen.branch
        )
        identity = placed.artifact.id
        say(f"{identity[:SHORT]}  measurement, {placed.sentence}")
    if chosen.parquet is not None:
        write_file(chosen.parquet, table.parquet())
    if chosen.zarr is not None:
        with fresh_folder(chosen.zarr) as scratch:
            table.write_zarr(scratch)
    if chosen.picture is not None:
        from flagdata.pages.chart_drawing import encode

        write_file(chosen.picture, encode(chart_of_table(table), chosen.picture), command="observe")
    if chosen.as_json:
        document("observe", {**json_values(table), "artifact": identity})
    else:
        for line in table.lines():
            echo(line)


def observe_film(chosen: Observing) -> Rows:
    """Observes a film from Python; see `flagdata.observe`.

    Raises:
        FlagdataError: see `flagdata.observe`.
    """
    from flagdata.dataset.lake_source import lake_of
    from flagdata.lake.catalog_rows import Rows

    table, subject, _ = _table(chosen, lake_of(chosen.lake), at=chosen.at)
    _check_shown(table, subject)
    return Rows(table.arrow())


@one_thread()
def _table(
    chosen: Observing, lake: Lake | None, *, at: str | None
) -> tuple[ObservableTable, Subject, FilmReading]:
    """Returns the observables of a film, with where it is from and how it was read."""
    from measure.film.film_source import FilmReading, subjects
    from measure.film.similarity import FlagSize
    from measure.observables.observables_table import table_of
    from measure.observables.watching import count_of, watch_film

    if chosen.window < 1.0:
        raise UsageError(
            f"windows of {chosen.window:g} s",
            where="--window",
            fix="give 1s or more: a flutter's period",
        )
    size = FlagSize.of(chosen.flag_size)
    reading = FilmReading.of(chosen, size)
    (subject,) = subjects(str(chosen.source), query=None, lake=lake, at=at, reading=reading)
    part = {"first": chosen.start, "last": chosen.end, "seconds": chosen.window}
    with progress(count_of(subject.film, **part), label="observe", unit="window") as advance:
        windows = watch_film(subject.film, size, **part, advance=advance)
    table = table_of(
        windows,
        film=subject.film.name,
        length=size.length,
        height=size.height,
        start=subject.film.start,
        wind=None if subject.record is None else subject.record.wind(),
    )
    return table, subject, reading


def _check_shown(table: ObservableTable, subject: Subject) -> None:
    """Raises:
    RefusedError: no window shows the cloth.
    """
    if table.empty:
        raise RefusedError(
            f"none of {len(table.time)} windows shows the cloth: its outline or its hoist was not "
            "found",
            where=subject.film.name,
            fix="give --crop around one whole flag on its pole, or another film",
        )
