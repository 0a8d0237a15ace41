"""`flagdata calibrate`: a filmed flag, with the log of the wind beside it, is weighed and made an
anemometer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

import click

from flagdata.api.measuring_verbs import LENGTHS, Calibrating
from flagdata.core.console import LocalPath, document, echo, following, progress, say, say_finding
from flagdata.core.findings import Severity
from flagdata.core.printable import SHORT
from flagdata.core.shell import command_line
from flagdata.errors import InputError, RefusedError, UsageError
from flagdata.examples import check_without_lake
from flagdata.timebase import iso
from flagdata.verbs.shared_options import FLAG, HOW, WRITTEN, Keeping, Shared
from flagdata.verbs.verb_options import (
    AsJson,
    argument,
    command,
    described_fields,
    option,
    options,
    typed_names,
)

if TYPE_CHECKING:
    from flagdata.answer import Section
    from flagdata.answer.calibrated import Calibrated
    from flagdata.lake import Lake
    from measure.anemometer.making import Made
    from measure.cloth.cloth_calibration import Calibration
    from measure.film.film_source import FilmReading
    from measure.film.similarity import FlagSize


@options
class CalibrateCommand(  # pyright: ignore[reportIncompatibleVariableOverride]  all cores
    AsJson, Shared, Calibrating, Keeping
):
    """The same on the command line, the reading model that is made beside, and what is written."""

    recordings: tuple[str, ...] = argument(
        "Recordings of one flag; see `flagdata.calibrate`.", "RECORDING..."
    )
    flag_size: str | None = option(  # pyright: ignore[reportIncompatibleVariableOverride]
        f"{LENGTHS}.", default=None, section=FLAG, metavar="LxH"
    )
    only: str | None = option(
        "Do only one: weigh the cloth, in minutes of simulation, or calibrate the flag as an "
        "anemometer, as fast as "
        "its film is read.",
        default=None,
        section=HOW,
        type=click.Choice(["weight", "anemometer"]),
    )
    name: str | None = option(
        "Of the reading model, by which flagdata measure --model finds it; by default the first "
        "recording's with "
        "-anemometer.",
        default=None,
        section=HOW,
        metavar="NAME",
    )
    model: str | None = option(
        "Network whose summary the reading model uses; by default flow-outdoor.",
        default=None,
        section=HOW,
        metavar="NAME|FOLDER|ID",
    )
    verbose: bool = option(
        "Print the camera's place that was fitted to each recording too, and how simulations left "
        "out were weighed; by "
        "default the cloth alone.",
        default=False,
        section=WRITTEN,
    )
    report: Path | None = option(
        "Write a page that needs no other.",
        default=None,
        section=WRITTEN,
        type=LocalPath(),
        metavar="FILE.html",
    )


@command(CalibrateCommand)
def calibrate(chosen: CalibrateCommand) -> None:
    """Weigh the cloth of a flag from its motion and the log of the wind beside it: area weight,
    bending and damping, with intervals. And make the flag an anemometer: a reading model of this
    flag from this place, which flagdata measure --model takes for other films of it.

    RECORDING is a film with its log, a recording of --lake by its name or id. Or it is a table of
    observables, Parquet or text, as flagdata observe --parquet, another tracker or a paper gives
    it: rows against `time` [s], with `wind`, the logged mean over the row [m/s], or with a --log of
    the lake; or rows against `wind` alone, each with its `duration` [s]. Its other columns are
    observables by their names (droop, extension, middle-speed, frequency, bandwidth, amplitude-up,
    amplitude-across, area), each perhaps with a unit, as in `droop [deg]`, and with NAME-sigma,
    what it is off by. Several recordings are of one flag; one that cannot be used is left out, with
    a warning. Where no weight is given, neither a value nor a bound, the exit code is 3.

    Or, with --area-weight, RECORDING is a folder of drapes: scans (.obj, z upwards, in metres,
    texture coordinates of the flat disc) of pieces of one cloth, discs of 0.3 m over a pedestal of
    0.18 m. They show its bending; a second folder is of drapes with the other face up.

    \b
      flagdata calibrate recording-7 --lake lake --flag-size 1.5x1.0 --azimuth 70±7 \\
          --report page.html
      flagdata calibrate monday.csv tuesday.csv --flag-size 1.5x1.0 --lake lake --json
      flagdata calibrate tracked.csv --log 3f2a9c --clock-offset 0.3±0.1 --lake lake \\
          --flag-size 0.9x0.6
      flagdata calibrate recording-7 --lake lake --flag-size 1.5x1.0 --only anemometer \\
          --name garden
      flagdata calibrate drapes/up drapes/down --area-weight 0.192±0.004
    """
    _check_only(chosen)
    if chosen.report is not None:
        from flagdata.core.files.outputs import check_file

        check_file(chosen.report, command="calibrate")
    if chosen.area_weight is not None:
        _drapes(chosen)
        return
    if chosen.flag_size is None:
        raise UsageError(
            "the flag's size is missing: windows are as long as its size requires",
            where="--flag-size",
            fix="give length x height in metres, as in 1.5x1.0",
        )
    if chosen.lake is None:
        check_without_lake(*chosen.recordings)
    from flagdata.lake.results import place_result
    from measure.cloth.calibrate_call import folder_of, options_of, sources_of
    from measure.cloth.calibration_answer import answer_of_calibration
    from measure.cloth.calibration_artifact import artifact, keep
    from measure.cloth.cloth_calibration import calibrate as calibrated
    from measure.cloth.design import announce_simulations
    from measure.cloth.numerics import FLAGS, effort
    from measure.film.film_source import FilmReading
    from measure.film.similarity import FlagSize

    lake = chosen.opened()
    size = FlagSize.of(chosen.flag_size)
    reading = FilmReading.of(chosen, size)
    drawn = {"simulations": chosen.simulations, "level": chosen.level, "seed": chosen.seed}
    options = options_of(chosen, size, **drawn)
    weighable = anemometer = None
    if chosen.only != "anemometer":
        weighable = sources_of(chosen.recordings, chosen, size, lake, at=chosen.version)
    if chosen.only != "weight":
        anemometer = _anemometer(chosen, size, reading, lake)
    if weighable is None:
        if anemometer is not None:
            _answer_by_reading(chosen, anemometer)
        return
    workers = chosen.processes
    with progress(None, label="observe", unit="window") as advance:
        gathered = weighable.read(size, advance=advance)
    observed, parents = gathered.recordings, gathered.parents
    work = sum(
        options.simulations * recording.duration + effort(recording.duration)
        for recording in observed
    )
    say(announce_simulations(work, workers=workers))
    with progress(
        (options.simulations + FLAGS) * len(observed), label="calibrate", unit="flag"
    ) as advance:
        calibration = calibrated(
            observed,
            options,
            folder=folder_of(chosen),
            workers=workers,
            left_out=gathered.left_out,
            advance=advance,
        )
    wanted = None
    if lake is not None and not chosen.read_only:
        wanted = place_result(
            lake, artifact(calibration, reading, parents), branch=chosen.branch
        ).artifact.id
    answer = answer_of_calibration(
        calibration,
        artifact=wanted,
        recorded=_dates(lake, parents, at=chosen.version),
        others=_sections(anemometer),
        further={
            "artifact": wanted,
            "anemometer": None if anemometer is None else anemometer.document,
        },
    )
    text = None if chosen.report is None else answer.page
    published = None
    if lake is not None and wanted is not None:
        placed_row = keep(lake, calibration, reading, parents, branch=chosen.branch)
        say(f"{wanted[:SHORT]}  measurement, {placed_row.sentence}")
        published = f"the calibration {wanted}" if placed_row.new else None
    _write_report(chosen, text, published)
    if chosen.as_json:
        document("calibrate", answer.document)
    else:
        _print(answer, verbose=_fit_lines(calibration) if chosen.verbose else ())
    if not calibration.weighs:
        raise click.exceptions.Exit(RefusedError.exit_code)


_OF_WEIGHT = {
    "attachment",
    "azimuth_deg",
    "elevation_deg",
    "distance",
    "material",
    "log",
    "clock_offset",
    "simulations",
    "workers",
    "cache",
    "seed",
}


_OF_DRAPES = {
    "recordings",
    "area_weight",
    "simulations",
    "level",
    "seed",
    "workers",
    "cache",
    "as_json",
    "report",
}


def _check_only(chosen: CalibrateCommand) -> None:
    """Raises:
    UsageError: an option of what is not to be done.
    """
    ignored = {"weight": {"name", "model"}, "anemometer": _OF_WEIGHT}.get(chosen.only or "", set())
    if chosen.area_weight is not None:
        ignored = set(described_fields(CalibrateCommand)) - _OF_DRAPES
    other = (
        "--area-weight" if chosen.area_weight is not None else command_line("--only", chosen.only)
    )
    for name in sorted(ignored & typed_names(chosen)):
        spelled = described_fields(CalibrateCommand)[name][1].spelling_of(name)
        raise UsageError(
            f"{spelled} cannot be combined with {other}", where=spelled, fix=f"leave {spelled} out"
        )


def _drapes(chosen: CalibrateCommand) -> None:
    """Finds and reports the cloth of drapes."""
    from measure.drape.drape_answer import answer_of_drapes, read_drapes

    with progress(chosen.simulations, label="drape", unit="drape") as advance:
        answer = answer_of_drapes(read_drapes(chosen, workers=chosen.processes, advance=advance))
    _write_report(chosen, None if chosen.report is None else answer.page, None)
    if chosen.as_json:
        document("calibrate", {**answer.document, "artifact": None, "anemometer": None})
        return
    _print(answer)


def _anemometer(
    chosen: CalibrateCommand, size: FlagSize, reading: FilmReading, lake: Lake | None
) -> Made | None:
    """Makes the reading model; returns None with the reason on stderr where none can be made and
    the weight was asked for as well."""
    from measure.anemometer.making import made
    from measure.cloth.flag_recordings import is_table

    if any(is_table(source) for source in chosen.recordings):
        if chosen.only is None and chosen.name is None and chosen.model is None:
            return None
        raise UsageError(
            "a table of observables has no pictures, which a reading model takes",
            where="RECORDING",
            fix="name recordings of a lake, or give --only weight",
        )
    try:
        with progress(None, label="read", unit="window") as advance:
            done = made(
                chosen.recordings,
                size,
                reading,
                name=chosen.name,
                model=chosen.model,
                lake=lake,
                at=chosen.version,
                branch=None if chosen.read_only else chosen.branch,
                first=chosen.start or 0.0,
                last=chosen.end,
                level=chosen.level,
                advance=advance,
            )
    except (InputError, RefusedError) as error:
        if chosen.only is not None:
            raise
        say(f"no reading model: {error.what}" + (f"; {error.fix}" if error.fix else ""))
        return None
    say(f"the flag as an anemometer {done.result.sentence}")
    for finding in done.result.findings:
        if finding.severity is not Severity.NOTE:
            say_finding(finding)
    if done.placed is not None:
        say(f"{done.placed.artifact.id[:SHORT]}  reading model, {done.placed.sentence}")
        say(f"for flagdata measure: {command_line('--model', done.name)}")
    return done


def _sections(anemometer: Made | None) -> tuple[Section, ...]:
    if anemometer is None:
        return ()
    from measure.anemometer.reading_answer import reading_section

    return (reading_section(anemometer.result),)


def _answer_by_reading(chosen: CalibrateCommand, anemometer: Made) -> None:
    """Reports a reading model that was made alone."""
    from measure.anemometer.reading_answer import answer_of_reading

    answer = answer_of_reading(anemometer)
    text = None if chosen.report is None else answer.page
    _write_report(chosen, text, f"the reading model {anemometer.artifact}")
    if chosen.as_json:
        document("calibrate", answer.document)
    else:
        echo(anemometer.result.sentence)


def _dates(lake: Lake | None, parents: Sequence[str], *, at: str) -> Mapping[str, str]:
    """Returns when the recordings of a lake were made."""
    if lake is None:
        return {}
    starts = [lake.artifact(parent, at=at).start for parent in parents]
    dates = [f"{iso(start)[:16].replace('T', ' ')} UTC" for start in starts if start is not None]
    return {"recorded": ", ".join(dates)} if dates else {}


def _write_report(chosen: CalibrateCommand, text: str | None, published: str | None) -> None:
    """Writes the page, if one is wanted.

    Args:
        published: what stays published where the page cannot be written.
    """
    if chosen.report is None or text is None:
        return
    from flagdata.core.files.outputs import write_file

    with nullcontext() if published is None else following(published, "writing its report"):
        write_file(chosen.report, text, command="calibrate")
        say(f"report: {chosen.report}")


def _print(answer: Calibrated, *, verbose: Sequence[str] = ()) -> None:
    """Prints the answer's line, and a line for each quantity that it does not state."""
    line = answer.document["sentence"]
    echo(line)
    for name, one in answer.quantities.items():
        title = name.replace("_", " ")
        if line.startswith(title):
            continue
        value = one.text_with_level if one.constrained else "not determined"
        echo(f"{title}: {value} (assumed: {one.assumed_text})")
    for text in verbose:
        say(f"  {text}")
    for finding in answer.findings:
        say_finding(finding)
    if answer.document.get("close_loop") is not None and answer.stated is not None:
        say(f"for flagdata measure: {command_line('--area-weight', answer.stated)}")


def _fit_lines(calibration: Calibration) -> list[str]:
    """Describes the places that were fitted, and how simulations left out were weighed."""
    lines = [
        f"{recording.observed.name}: "
        + ", ".join(f"{name} {one.text}" for name, one in recording.place.items())
        for recording in calibration.recordings
    ]
    check = calibration.check
    return [
        *lines,
        (
            f"intervals of {check.held} of {check.count} simulations left out contain their "
            "weight, "
            f"median error {check.median_error:.1%}"
        ),
    ]
