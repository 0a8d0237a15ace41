"""`flagdata align` and `flagdata realign`: a camera and an anemometer, or two anemometers, on one clock.

`flagdata align REFERENCE SENSOR`: two logs of one wind on one clock.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from flagdata.commands.durations import DURATION
from flagdata.commands.sections import LongCommand
from flagdata.console import LocalPath, document, echo, json_option, lake_option, progress, say, say_finding
from flagdata.printable import SHORT
from flagdata.timebase import NANOSECONDS

if TYPE_CHECKING:
    from flagdata.align.methods import ClockOptions, Outcome
    from flagdata.align.recording import Pair, RecordingResult
    from flagdata.lake import Lake
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flagdata.align.logs import LogClock
    from flagdata.align.methods import ClockOptions
    from flagdata.lake import Artifact, Lake
    from flagdata.lake.healing import Healing


def align_logs(
    lake: Lake,
    reference: str,
    sensor: str,
    options: ClockOptions,
    *,
    unused: tuple[str, ...],
    name: str | None,
    session: str | None,
    branch: str,
    dry_run: bool,
    as_json: bool,
) -> None:
    """Estimate the sensor's clock and gain, and write its log on the reference's clock.

    Args:
        unused: options given that two logs have no use for.

    Raises:
        UsageError: there are such options, or another method than an estimate.
        RefusedError: the logs give no estimate, with the reasons.
    """
    from flagdata.align.apart import by_spans
    from flagdata.align.lag import LagSearch
    from flagdata.align.logs import log_clock
    from flagdata.align.methods import Method
    from flagdata.align.windpair import WindPair, find_aligned, make_aligned
    from flagdata.errors import UsageError
    from flagdata.lake.healing import ABSENT
    from flagdata.rng import stream
    from flagdata.timebase import NANOSECONDS

    if options.by is not Method.ESTIMATE:
        raise UsageError(f"two logs aligned by {options.by}", where="--by", fix="leave --by out: they are compared")
    if unused:
        raise UsageError(f"two logs have no use for {', '.join(unused)}", where=unused[0], fix="leave it out")
    search = options.search or LagSearch()
    recipe: dict[str, Any] = {
        "align": {"by": "logs", "centre": search.centre, "window": search.window, "sigma": search.sigma}
    }
    pair = WindPair.of(lake, reference, sensor, at=branch)
    there = ABSENT if dry_run else find_aligned(lake, pair, recipe, name=name, session=session, branch=branch)
    if there.whole is not None:
        say("this log is aligned already; nothing was written")
        _logs_report(there.whole, None, created=False, healed=None, as_json=as_json)
        return
    shift = round(search.centre * NANOSECONDS)
    own, other = pair.sensor_series.time, pair.reference_series.time
    apart = by_spans(
        (int(own[0]) + shift, int(own[-1]) + shift),
        (int(other[0]), int(other[-1])),
        names=(pair.sensor.name, pair.reference.name),
    )
    if apart is not None:
        say_finding(apart)
    with progress(None, label="comparing", unit="part") as advance:
        found = log_clock(
            pair.reference_series,
            pair.sensor_series,
            names=pair.names,
            search=search,
            generator=stream(0, "align", pair.reference.id, pair.sensor.id),
            progress=advance,
        )
    if dry_run:
        _logs_report(None, found, created=False, healed=None, as_json=as_json)
        return
    made, healed = make_aligned(
        lake, pair, found, recipe=recipe, name=name, session=session, branch=branch, code=there.code
    )
    _logs_report(made, found, created=there.artifact is None, healed=healed, as_json=as_json)


def _logs_report(
    made: Artifact | None, found: LogClock | None, *, created: bool, healed: Healing | None, as_json: bool
) -> None:
    from dataclasses import asdict

    from flagdata.align.windpair import summary
    from flagdata.lake.healing import said

    if as_json:
        content: dict[str, Any] = {"wind": made.id if made is not None else None, "created": created}
        content["healed"] = None if healed is None else asdict(healed)
        if found is not None:
            content["clock"] = summary(found)
        document("align-logs", content)
        return
    if found is not None:
        echo(sentence(found))
    if made is not None:
        echo(f"wind {made.id}, on the clock of {made.parents[0]}")
        if healed is not None:
            echo(said(made.id, healed))


def sentence(found: LogClock) -> str:
    """Offset and drift of the sensor's clock, and its gain, each with its 90 % interval or σ."""
    from flagdata.clock import NINETY

    (segment,), gain = found.model.segments, found.gain
    half = NINETY * segment.sigma_offset
    low, high = segment.offset - half, segment.offset + half
    digits = max(2, 1 - math.floor(math.log10(segment.sigma_offset)))
    parts = len(found.line.parts)
    return (
        f"offset {segment.offset:+.{digits}f} s [{low:.{digits}f}, {high:.{digits}f}] 90 %"
        f", drift {1e6 * segment.drift:+.2f} ± {1e6 * segment.sigma_drift:.2f} ppm"
        f"{f', n = {parts} parts of ten minutes' if parts else ' (not measured: too few parts)'}; "
        f"gain {gain.gain:.4f} ± {gain.sigma:.4f}, zero {gain.zero:+.3f} ± {gain.sigma_zero:.3f} m/s, "
        f"n = {gain.count} minutes"
    )


F = TypeVar("F", bound=Callable[..., Any])


def _clock_options(command: F) -> F:
    """The options that both commands share."""
    for option in reversed(
        (
            click.option(
                "--by",
                type=click.Choice(["stamps", "given", "estimate"]),
                default="estimate",
                show_default=True,
                help="Trust the stamps, take --offset, or estimate it from the flag's motion.",
            ),
            click.option("--offset", type=float, metavar="S", help="Seconds added to the camera's clock (--by given)."),
            click.option(
                "--offset-sigma",
                type=float,
                metavar="S",
                help="Its standard uncertainty; by stamps: how well the clocks are known to agree.",
            ),
            click.option(
                "--centre", type=float, metavar="S", help="Offset around which to search; 0 if the stamps are near."
            ),
            click.option(
                "--search", type=float, metavar="S", help="Search this far either side of it; 120 by default."
            ),
            click.option(
                "--window",
                type=DURATION,
                metavar="TIME",
                help="Average the wind over this long before a clip's end for its ground truth, e.g. 10s or 2min; "
                "60s by default.",
            ),
            click.option(
                "--response",
                type=float,
                metavar="S",
                help="By how much the flag's motion follows the wind at the anemometer; by default 3 m over the mean "
                "wind, 0.3 to 1 s.",
            ),
            click.option(
                "--response-sigma",
                type=float,
                metavar="S",
                help="Its uncertainty; by default half of it, 0.3 at most, or 0.15 beside --response.",
            ),
            click.option(
                "--max-sigma",
                type=float,
                metavar="S",
                help="Refuse an offset with a larger standard uncertainty [s]; 0.5 by default.",
            ),
            click.option("--name", help="What to call the recording; the camera's name by default."),
            click.option("--session", help="One set-up at one place, for splits; the parents' by default."),
            click.option("--branch", default="main", show_default=True, help="Branch to commit on."),
            click.option("--dry-run", is_flag=True, help="Find the clock model, commit nothing."),
            click.option(
                "--plot",
                metavar="FILE",
                type=LocalPath(dir_okay=False),
                help="Picture of motion, wind and the search (--by estimate), drawn even when it is refused.",
            ),
            json_option,
            lake_option,
        )
    ):
        command = option(command)
    return command


@click.command(cls=LongCommand)
@click.argument("first", metavar="CAMERA|REFERENCE")
@click.argument("second", metavar="WIND|SENSOR")
@_clock_options
def align(
    first: str,
    second: str,
    by: str,
    offset: float | None,
    offset_sigma: float | None,
    centre: float | None,
    search: float | None,
    window: float | None,
    response: float | None,
    response_sigma: float | None,
    max_sigma: float | None,
    name: str | None,
    session: str | None,
    branch: str,
    dry_run: bool,
    plot: Path | None,
    as_json: bool,
    lake_path: str,
) -> None:
    """Put the artifacts CAMERA and WIND on one clock: a recording and its clips, in one commit.

    Of two wind artifacts, REFERENCE and SENSOR, the second is written anew on the first one's clock; offset, drift and
    gain are reported. An estimate that is not certain is refused (exit 3) and nothing is committed.
    """
    from flagdata.align.recording import Pair, truth_recipe
    from flagdata.lake import Lake
    from flagdata.schema import TRUTH_WINDOW, Kind

    options = _options(by, offset, offset_sigma, centre, search, response, response_sigma, max_sigma)
    _check_plot(plot, options)
    lake = Lake.open(lake_path)
    if not dry_run:
        lake.check_writable()
    devices = (Kind.CAMERA, Kind.WIND)
    if {lake.artifact(which, at=branch, kinds=devices).kind for which in (first, second)} == {Kind.WIND}:
        # FOLD

        unused = {"--window": window, "--response": response, "--response-sigma": response_sigma, "--plot": plot}
        align_logs(
            lake,
            first,
            second,
            options,
            unused=tuple(o for o, value in unused.items() if value is not None),
            name=name,
            session=session,
            branch=branch,
            dry_run=dry_run,
            as_json=as_json,
        )
        return
    pair = Pair.of(lake, first, second, at=branch)
    recipe = {**options.recipe(), **truth_recipe(TRUTH_WINDOW if window is None else window)}
    _run(
        lake,
        pair,
        options,
        recipe=recipe,
        name=name,
        session=session,
        branch=branch,
        dry_run=dry_run,
        plot=plot,
        as_json=as_json,
    )


@click.command(cls=LongCommand)
@click.argument("recording")
@_clock_options
def realign(
    recording: str,
    by: str,
    offset: float | None,
    offset_sigma: float | None,
    centre: float | None,
    search: float | None,
    window: float | None,
    response: float | None,
    response_sigma: float | None,
    max_sigma: float | None,
    name: str | None,
    session: str | None,
    branch: str,
    dry_run: bool,
    plot: Path | None,
    as_json: bool,
    lake_path: str,
) -> None:
    """Write RECORDING anew with another clock model, from the same camera and wind artifacts.

    The window of the ground truth stays what it was unless --window says otherwise. The old recording and its clips
    stay until `flagdata withdraw` takes them off the branch; tags keep them.
    """
    from flagdata.align.recording import Pair, parents_of, truth_recipe, truth_window
    from flagdata.lake import Lake

    options = _options(by, offset, offset_sigma, centre, search, response, response_sigma, max_sigma)
    _check_plot(plot, options)
    lake = Lake.open(lake_path)
    if not dry_run:
        lake.check_writable()
    old, parents = parents_of(lake, recording, at=branch)
    pair = Pair.of(lake, *parents, at=branch)
    kept = truth_window(old.recipe) if window is None else window
    recipe = {**options.recipe(), **truth_recipe(kept), "supersedes": old.id}
    _run(
        lake,
        pair,
        options,
        recipe=recipe,
        name=name or old.name,
        session=session or old.session,
        branch=branch,
        dry_run=dry_run,
        plot=plot,
        as_json=as_json,
    )
    if not dry_run:
        say(f"the recording {old.id[:SHORT]} it supersedes is still on {branch}; flagdata withdraw takes it off")


def _check_plot(plot: Path | None, options: ClockOptions) -> None:
    """Refuse a --plot that would not be drawn or cannot be written."""
    from flagdata.align.methods import Method
    from flagdata.errors import UsageError

    if plot is None:
        return
    if options.by is not Method.ESTIMATE:
        raise UsageError(f"alignment by {options.by} has no search to draw", where="--plot", fix="leave it out")
    from flagdata.align.plot import check

    check(plot)


def _options(
    by: str,
    offset: float | None,
    offset_sigma: float | None,
    centre: float | None,
    window: float | None,
    response: float | None,
    response_sigma: float | None,
    max_sigma: float | None,
) -> ClockOptions:
    from flagdata.align.lag import LagSearch
    from flagdata.align.methods import ClockOptions, Method

    usual = LagSearch()
    search = LagSearch(
        centre=usual.centre if centre is None else centre,
        window=usual.window if window is None else window,
        sigma=usual.sigma if max_sigma is None else max_sigma,
    )
    return ClockOptions(
        by=Method(by),
        offset=offset,
        offset_sigma=offset_sigma,
        search=None if search == usual else search,
        response=response,
        response_sigma=response_sigma,
    )


def _run(
    lake: Lake,
    pair: Pair,
    options: ClockOptions,
    *,
    recipe: dict[str, Any],
    name: str | None,
    session: str | None,
    branch: str,
    dry_run: bool,
    plot: Path | None,
    as_json: bool,
) -> None:
    from flagdata.align.recording import find_recording, make_recording, session_of

    session_of(pair, named=session)  # refused before the long part
    _warn_of_clocks(pair, options)
    present = None if dry_run or plot else find_recording(lake, pair, recipe, name=name, session=session, branch=branch)
    if present is not None:
        say("this recording is there already; nothing was written")
        _report(present, None, as_json=as_json)
        return
    outcome = _outcome(pair, options, recipe=recipe, plot=plot)
    if dry_run:
        _report(None, outcome, as_json=as_json)
        return
    frames = pair.camera_record.frame_count
    with progress(frames, label="copying", unit="frame") as advance:
        made = make_recording(
            lake, pair, outcome.alignment, name=name, session=session, branch=branch, progress=advance
        )
    _report(made, outcome, as_json=as_json)


def _warn_of_clocks(pair: Pair, options: ClockOptions) -> None:
    """Say so where film and log are stamped hours apart."""
    from flagdata.align.apart import by_spans

    if pair.wind.start is None or pair.wind.end is None:
        return
    centre = options.search.centre if options.search is not None else 0.0
    shift = round((options.offset or centre) * NANOSECONDS)
    start, end = pair.span
    found = by_spans(
        (start + shift, end + shift), (pair.wind.start, pair.wind.end), names=(pair.camera.name, pair.wind.name)
    )
    if found is not None:
        say_finding(found)


def _outcome(pair: Pair, options: ClockOptions, *, recipe: dict[str, Any], plot: Path | None) -> Outcome:
    from flagdata.align.methods import Method, declared, estimated, evidence

    if options.by is not Method.ESTIMATE:
        return declared(pair, options, recipe=recipe)
    with progress(pair.camera_record.frame_count, label="motion", unit="frame") as advance:
        found = evidence(pair, options, progress=advance)
    if plot is not None:
        from flagdata.align.plot import draw

        draw(found, plot, title=f"{pair.camera.name} and {pair.wind.name}")
        say(f"plot: {plot}")
    return estimated(pair, found, recipe=recipe)


def _report(made: RecordingResult | None, outcome: Outcome | None, *, as_json: bool) -> None:
    """The clock model, and the recording if one was made or found."""
    if as_json:
        content: dict[str, Any] = {"recording": None, "clips": [], "created": False}
        if made is not None:
            content = made.as_dict()
        if outcome is not None:
            content["clock"] = dict(outcome.alignment.details)
        document("align", content)
        return
    if outcome is not None:
        echo(_sentence(outcome))
    if made is not None:
        echo(made.line)


def _sentence(outcome: Outcome) -> str:
    """`offset +12.31 s [12.02, 12.60] 90 %, confidence 0.99, n = 596 bins of 1 s`."""
    from flagdata.clock import NINETY

    (segment,) = outcome.alignment.clock.segments
    half = NINETY * segment.sigma_offset
    digits = max(2, 1 - math.floor(math.log10(segment.sigma_offset)))
    low, high = segment.offset - half, segment.offset + half
    text = f"offset {segment.offset:+.{digits}f} s [{low:.{digits}f}, {high:.{digits}f}] 90 %"
    if outcome.evidence is None or outcome.evidence.line is None:
        return f"{text}, {outcome.alignment.clock.method}"
    estimate, line = outcome.evidence.estimate, outcome.evidence.line
    text += f", confidence {estimate.confidence:.2f}, n = {estimate.bins} bins of {outcome.evidence.wind.period:g} s"
    if line.parts:
        text += f"; drift {1e6 * line.drift:+.0f} ± {1e6 * line.sigma_drift:.0f} ppm, n = {len(line.parts)} parts"
    return text
