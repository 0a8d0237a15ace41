"""`flagdata calibrate`: a filmed flag, with the log of the wind beside it, is weighed and made an
anemometer."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from flagdata.api.measuring_verbs import LENGTHS, Calibrating
from flagdata.core.console import LocalPath, document, echo, say, say_finding
from flagdata.core.shell import command_line
from flagdata.errors import RefusedError
from flagdata.verbs.shared_options import FLAG, WRITTEN, Shared
from flagdata.verbs.verb_options import (
    AsJson,
    argument,
    command,
    option,
    options,
)

if TYPE_CHECKING:
    from flagdata.answer.calibrated import Calibrated
    from measure.cloth.calibration_result import Calibration


@options
class CalibrateCommand(  # pyright: ignore[reportIncompatibleVariableOverride]  all cores
    AsJson, Shared, Calibrating
):
    """The same on the command line, and what is written."""

    recordings: tuple[str, ...] = argument(
        "Recordings of one flag; see `flagdata.calibrate`.", "RECORDING..."
    )
    flag_size: str | None = option(  # pyright: ignore[reportIncompatibleVariableOverride]
        f"{LENGTHS}.", default=None, section=FLAG, metavar="LxH"
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
    from flagdata.core.files.outputs import check_file, write_file
    from measure.commands.calibrate_recordings import calibrate_flag, check_options

    if chosen.report is not None:
        check_file(chosen.report, command="calibrate")
    check_options(chosen)
    done = calibrate_flag(chosen, workers=chosen.processes)
    answer = done.answer
    page = "" if chosen.report is None else answer.page
    with done.keep():
        if chosen.report is not None:
            write_file(chosen.report, page, command="calibrate")
            say(f"report: {chosen.report}")
    calibration = None if done.weighing is None else done.weighing.calibration
    if chosen.as_json:
        document("calibrate", answer.document)
    elif chosen.only == "anemometer":
        echo(answer.document["anemometer"]["sentence"])
    else:
        shown = calibration if chosen.verbose else None
        _print(answer, verbose=() if shown is None else _fit_lines(shown))
    if calibration is not None and not calibration.weighs:
        raise click.exceptions.Exit(RefusedError.exit_code)


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
