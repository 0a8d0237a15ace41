"""`flagdata calibrate`: a filmed flag, with the log of the wind beside it, is weighed and made an anemometer."""

from __future__ import annotations

import os
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.core import ParameterSource

from flagdata.commands.durations import DURATION
from flagdata.commands.sections import LongCommand
from flagdata.commands.statements import STATED
from flagdata.console import LakePlace, LocalPath, document, echo, following, json_option, progress, say, say_finding
from flagdata.errors import InputError, RefusedError, UsageError
from flagdata.findings import Severity
from flagdata.printable import SHORT
from flagdata.stated import Stated
from flagdata.storage import Place

if TYPE_CHECKING:
    from flagdata.lake import Lake
    from measure.anemometer.making import Made
    from measure.calibrate.calibrate import Calibration
    from measure.estimate.page import Section
    from measure.film.similarity import FlagSize
    from measure.film.source import Reading


@click.command(cls=LongCommand)
@click.argument("sources", nargs=-1, required=True, metavar="RECORDING...")
@click.option(
    "--only",
    type=click.Choice(["weight", "anemometer"]),
    help="Do only one: weigh the cloth, in minutes "
    "of simulation, or calibrate the flag as an anemometer, as fast as its film is read.",
)
@click.option(
    "--name",
    metavar="NAME",
    help="Of the reading model, by which flagdata measure --model finds it; by "
    "default the first recording's with -anemometer.",
)
@click.option(
    "--model", metavar="NAME|FOLDER|ID", help="Network whose summary the reading model uses; by default flow-outdoor."
)
@click.option("--flag-size", metavar="LxH", help="Length along the wind and height along the pole [m], as in 1.5x1.0.")
@click.option(
    "--attachment",
    type=click.Choice(["corners", "hoist"]),
    default="corners",
    show_default=True,
    help="How the flag is held: at both ends of its hoist, or along all of it.",
)
@click.option(
    "--azimuth",
    type=STATED,
    metavar="DEGREES",
    help="Of the camera's axis to the wind, 90 from the side, as in 70±7; by default 30:150.",
)
@click.option("--elevation", type=STATED, metavar="DEGREES", help="Of the camera's axis, upwards; by default 0±5.")
@click.option(
    "--distance",
    type=click.FloatRange(min=1.0),
    default=15.0,
    show_default=True,
    metavar="M",
    help="From the camera to the flag [m].",
)
@click.option(
    "--material",
    metavar="NAME",
    help="What the flag is made of, as in woven-polyester, knit or camel-ponte-roma; by default any fabric.",
)
@click.option(
    "--crop", metavar="X,Y,W,H", help="Region of films in which the flag is [px]; by default the whole picture."
)
@click.option(
    "--flag", type=click.IntRange(min=1), metavar="N", help="Which moving cloth; by default the one that moves most."
)
@click.option(
    "--log",
    metavar="ARTIFACT",
    help="Log of the wind beside tables that have no wind column: a wind of --lake, by its id.",
)
@click.option(
    "--offset",
    type=STATED,
    metavar="S±SIGMA",
    help="Seconds added to the tables' clock to reach the log's, as in 0.3±0.1; by default estimated.",
)
@click.option("--start", "first", type=DURATION, default="0s", metavar="TIME", help="Where to begin, as in 12s.")
@click.option("--end", "last", type=DURATION, metavar="TIME", help="Where to end; weighing uses two minutes at most.")
@click.option(
    "--simulations",
    type=click.IntRange(min=64),
    default=128,
    show_default=True,
    help="Simulated flags for each recording.",
)
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    default=lambda: os.cpu_count() or 1,
    show_default="all cores",
    help="Number of processes that simulate.",
)
@click.option(
    "--cache",
    type=LocalPath(),
    metavar="FOLDER",
    help="Where simulations are kept, so that an interrupted calibration goes on; by default the user's cache folder.",
)
@click.option(
    "--level",
    type=click.FloatRange(0, 1, min_open=True, max_open=True),
    default=0.9,
    show_default=True,
    help="Level of the intervals.",
)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Seed of all draws.")
@click.option("--report", type=LocalPath(), metavar="FILE.html", help="Write a page that needs no other.")
@click.option(
    "--lake",
    "lake_path",
    type=LakePlace(),
    envvar="FLAGDATA_LAKE",
    help="Where recordings are, and where calibrations go; also FLAGDATA_LAKE.",
)
@click.option("--branch", default="main", show_default=True, help="Branch of the lake to read and commit on.")
@click.option("--read-only", is_flag=True, help="Read the lake, commit nothing.")
@json_option
def calibrate(
    sources: tuple[str, ...],
    only: str | None,
    name: str | None,
    model: str | None,
    flag_size: str | None,
    attachment: str,
    azimuth: Stated | None,
    elevation: Stated | None,
    distance: float,
    material: str | None,
    crop: str | None,
    flag: int | None,
    log: str | None,
    offset: Stated | None,
    first: float,
    last: float | None,
    simulations: int,
    workers: int,
    cache: Path | None,
    level: float,
    seed: int,
    report: Path | None,
    lake_path: Place | None,
    branch: str,
    read_only: bool,
    as_json: bool,
) -> None:
    """Weigh the cloth of a flag from its motion and the log of the wind beside it: area weight, bending and damping,
    with intervals. And make the flag an anemometer: a reading model of this flag from this place, which flagdata
    measure --model takes for other films of it.

    RECORDING is a film with its log, a recording of --lake by its name or id. Or it is a table of observables,
    Parquet or text, as flagdata observe --parquet, another tracker or a paper gives it: rows against `time` [s], with
    `wind`, the logged mean over the row [m/s], or with a --log of the lake; or rows against `wind` alone, each with
    its `duration` [s]. Its other columns are observables by their names (droop, extension, middle-speed, frequency,
    bandwidth, amplitude-up, amplitude-across, area), each perhaps with a unit, as in `droop [deg]`, and with
    NAME-sigma, what it is off by. Several recordings are of one flag; one that cannot be used is
    left out, with a warning. Where no weight is given, neither a value nor a bound, the exit code is 3.

    \b
      flagdata calibrate recording-7 --lake lake --flag-size 1.5x1.0 --azimuth 70±7 --report page.html
      flagdata calibrate monday.csv tuesday.csv --flag-size 1.5x1.0 --lake lake --json
      flagdata calibrate tracked.csv --log 3f2a9c --offset 0.3±0.1 --lake lake --flag-size 0.9x0.6
      flagdata calibrate recording-7 --lake lake --flag-size 1.5x1.0 --only anemometer --name garden
    """
    _check_only(only)
    if flag_size is None:
        raise UsageError(
            "the flag's size is missing: windows are as long as its size requires",
            where="--flag-size",
            fix="give length x height in metres, as in 1.5x1.0",
        )
    from flagdata.caches import user_cache
    from flagdata.lake import Lake
    from flagdata.lake.results import placed
    from flagdata.outputs import check_file, write_file
    from measure.calibrate.artifact import artifact, keep
    from measure.calibrate.calibrate import Options
    from measure.calibrate.calibrate import calibrate as calibrated
    from measure.calibrate.fabric import fabric
    from measure.calibrate.filmed import Sources
    from measure.calibrate.known import known
    from measure.calibrate.numerics import FLAGS, effort
    from measure.calibrate.page import page
    from measure.calibrate.prior import AZIMUTH, ELEVATION
    from measure.calibrate.simulation import Flag
    from measure.calibrate.workload import announced
    from measure.film.similarity import parse_size
    from measure.film.source import Reading, box_of

    if report is not None:
        check_file(report, command="calibrate")
    lake = None if lake_path is None else Lake.open(lake_path)
    if lake is not None and not read_only:
        lake.check_writable()
    size = parse_size(flag_size)
    reading = Reading(crop=box_of(crop), flag=flag, aspect=size.aspect)
    made_of = None if material is None else fabric(material, where="--material")
    weighable = None
    if only != "anemometer":
        weighable = Sources.open(
            sources, size, reading, lake=lake, at=branch, first=first, last=last, log=log, offset=offset
        )
    anemometer = None
    if only != "weight":
        anemometer = _anemometer(
            sources,
            size,
            reading,
            only=only,
            name=name,
            model=model,
            lake=lake,
            branch=branch,
            commit=not read_only,
            first=first,
            last=last,
            level=level,
        )
    if weighable is None:
        if anemometer is not None:
            _report(anemometer, report, as_json=as_json)
        return
    options = Options(
        flag=Flag(length=size.length, height=size.height, attachment=attachment),
        azimuth=AZIMUTH if azimuth is None else known(AZIMUTH, azimuth, where="--azimuth"),
        elevation=ELEVATION if elevation is None else known(ELEVATION, elevation, where="--elevation"),
        distance=distance,
        simulations=simulations,
        level=level,
        seed=seed,
        material=made_of,
    )
    with progress(None, label="observe", unit="window") as advance:
        gathered = weighable.read(size, advance=advance)
    observed, parents = gathered.recordings, gathered.parents
    work = sum(simulations * one.duration + effort(one.duration) for one in observed)
    say(announced(work, workers=workers))
    with progress((simulations + FLAGS) * len(observed), label="calibrate", unit="flag") as advance:
        found = calibrated(
            observed,
            options,
            folder=(cache or user_cache() / "calibrate"),
            workers=workers,
            left_out=gathered.left_out,
            advance=advance,
        )
    wanted = None
    if lake is not None and not read_only:
        wanted = placed(lake, artifact(found, reading, parents), branch=branch).artifact.id
    text = None if report is None else page(found, _provenance(found, wanted), sections=_sections(anemometer))
    place = None
    if lake is not None and wanted is not None:
        place = keep(lake, found, reading, parents, branch=branch)
        say(f"{wanted[:SHORT]}  measurement, {place.sentence}")
    if report is not None and text is not None:
        new = place is not None and place.new
        with following(f"the calibration {wanted}", "writing its report") if new else nullcontext():
            write_file(report, text, command="calibrate")
            say(f"report: {report}")
    if as_json:
        own = None if anemometer is None else anemometer.as_dict()
        document("calibrate", {**found.as_dict(), "artifact": wanted, "anemometer": own})
    else:
        _print(found)
    if not found.weighs:
        raise click.exceptions.Exit(RefusedError.exit_code)


_OF_WEIGHT = (
    "attachment",
    "azimuth",
    "elevation",
    "distance",
    "material",
    "log",
    "offset",
    "simulations",
    "workers",
    "cache",
    "seed",
)
_OF_ANEMOMETER = ("name", "model")


def _check_only(only: str | None) -> None:
    """Raises:
    UsageError: an option of what is not to be done.
    """
    context = click.get_current_context()
    for option in {"weight": _OF_ANEMOMETER, "anemometer": _OF_WEIGHT}.get(only or "", ()):
        if context.get_parameter_source(option) is ParameterSource.COMMANDLINE:
            raise UsageError(f"--{option} with --only {only}", where=f"--{option}", fix=f"leave --{option} out")


def _anemometer(
    sources: tuple[str, ...],
    size: FlagSize,
    reading: Reading,
    *,
    only: str | None,
    name: str | None,
    model: str | None,
    lake: Lake | None,
    branch: str,
    commit: bool,
    first: float,
    last: float | None,
    level: float,
) -> Made | None:
    """The reading model; None with the reason on stderr where none can be made and the weight was asked for as well."""
    from measure.anemometer.making import made
    from measure.calibrate.filmed import is_table

    if any(is_table(source) for source in sources):
        if only is None and name is None and model is None:
            return None
        raise UsageError(
            "a table of observables has no pictures, which a reading model takes",
            where="RECORDING",
            fix="name recordings of a lake, or give --only weight",
        )
    try:
        with progress(None, label="read", unit="window") as advance:
            done = made(
                sources,
                size,
                reading,
                name=name,
                model=model,
                lake=lake,
                branch=branch,
                commit=commit,
                first=first,
                last=last,
                level=level,
                advance=advance,
            )
    except (InputError, RefusedError) as error:
        if only is not None:
            raise
        say(f"no reading model: {error.what}" + (f"; {error.fix}" if error.fix else ""))
        return None
    say(f"the flag as an anemometer {done.found.sentence}")
    for finding in done.found.findings:
        if finding.severity is not Severity.NOTE:
            say_finding(finding)
    if done.place is not None:
        say(f"{done.place.artifact.id[:SHORT]}  reading model, {done.place.sentence}")
        say(f"for flagdata measure: --model {done.name}")
    return done


def _sections(anemometer: Made | None) -> tuple[Section, ...]:
    if anemometer is None:
        return ()
    from measure.anemometer.section import section

    return (section(anemometer.found),)


def _report(anemometer: Made, report: Path | None, *, as_json: bool) -> None:
    """Report a reading model that was made alone."""
    from flagdata.outputs import write_file
    from measure.anemometer.section import page

    if report is not None:
        rows = {one.name: f"recording {one.identity}" for one in anemometer.found.recordings}
        rows |= {"network": f"{anemometer.found.model.network}, SHA-256 {anemometer.found.model.identity}"}
        rows |= {} if anemometer.artifact is None else {"artifact": anemometer.artifact}
        text = page(anemometer.found, anemometer.name, rows)
        with following(f"the reading model {anemometer.artifact}", "writing its report"):
            write_file(report, text, command="calibrate")
            say(f"report: {report}")
    if as_json:
        document("calibrate", {"anemometer": anemometer.as_dict()})
    else:
        echo(anemometer.found.sentence)


def _provenance(found: Calibration, artifact: str | None) -> dict[str, str]:
    rows = {
        f"recording {number}": f"{one.observed.name}, from {one.observed.first:g} s on, {one.observed.source}"
        for number, one in enumerate(found.recordings, start=1)
    }
    rows |= {name.replace("_", " "): str(value) for name, value in found.options.recipe().items()}
    rows |= {about.name: about.degrees for about in (found.options.azimuth, found.options.elevation)}
    return rows if artifact is None else {**rows, "artifact": artifact}


def _print(found: Calibration) -> None:
    from measure.calibrate.page import shown

    echo(found.sentence)
    for one in found.cloth[1:]:
        row = shown(one)
        value = "not determined"
        if row["value"]:
            value = f"{row['value']} {row['interval']} {row['unit']}"
        elif row["bounded"]:
            value = f"{row['interval']} {row['unit']}, {row['level']}"
        echo(f"{row['name']}: {value} (assumed: {row['assumed']})")
    for recording, place in zip(found.recordings, found.places, strict=True):
        fitted = ", ".join(f"{row['name']} {row['interval']} {row['unit']}".strip() for row in map(shown, place))
        say(f"  {recording.observed.name}: {fitted}")
    check = found.check
    say(
        f"  intervals of {check.held} of {check.count} simulations left out contain their weight, median error "
        f"{check.error:.1%}"
    )
    for finding in found.findings:
        say_finding(finding)
    if found.stated is not None:
        say(f"for flagdata measure: --area-weight {found.stated}")
