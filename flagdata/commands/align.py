"""`flagdata align` and `flagdata realign`: a camera and an anemometer, or two anemometers, on one
clock."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flagdata.api.recording_verbs import Aligning, ByClock, Realigning
from flagdata.core.console import LocalPath, document, echo, progress, say, say_finding
from flagdata.core.json_values import json_values
from flagdata.core.printable import SHORT
from flagdata.timebase import NANOSECONDS
from flagdata.verbs.verb_options import AsJson, command, option, options

if TYPE_CHECKING:
    from flagdata.align.film_recording import Pair, RecordingResult
    from flagdata.align.logs import LogClock
    from flagdata.align.methods import ClockOptions, Outcome
    from flagdata.lake import Artifact, Lake
    from flagdata.lake.remaking import Remade


@dataclass(frozen=True, kw_only=True)
class Report:
    """What was aligned.

    Attributes:
        tag: of the JSON document.
        content: JSON values.
        lines: for people.
        superseded: the recording that was written anew; empty where there was none.
    """

    tag: str
    content: Mapping[str, Any]
    lines: tuple[str, ...]
    superseded: str = ""

    def shown(self, *, as_json: bool) -> None:
        """Prints it."""
        if as_json:
            document(self.tag, self.content)
        else:
            for line in self.lines:
                echo(line)


@options
class Plotting(AsJson):
    """What the commands draw and print."""

    plot: Path | None = option(
        "Picture of motion, wind and the search (--by estimate), drawn even when it is refused.",
        default=None,
        type=LocalPath(dir_okay=False),
        metavar="FILE",
    )


@options
class AlignCommand(Plotting, Aligning):
    """The same on the command line."""


@options
class RealignCommand(Plotting, Realigning):
    """The same on the command line."""


@command(AlignCommand)
def align(chosen: AlignCommand) -> None:
    """Put the artifacts CAMERA and WIND on one clock: a recording and its clips, in one commit.

    Of two wind artifacts, REFERENCE and SENSOR, the second is written anew on the first one's
    clock; offset, drift and gain are reported. An estimate that is not certain is refused (exit 3)
    and nothing is committed.
    """
    align_pair(chosen, plot=chosen.plot).shown(as_json=chosen.as_json)


@command(RealignCommand)
def realign(chosen: RealignCommand) -> None:
    """Write RECORDING anew with another clock model, from the same camera and wind artifacts.

    The window of the ground truth stays what it was unless --window says otherwise. The old
    recording and its clips stay until `flagdata withdraw` takes them off the branch; tags keep
    them.
    """
    report = realign_recording(chosen, plot=chosen.plot)
    report.shown(as_json=chosen.as_json)
    if not chosen.dry_run:
        old = f"the recording {report.superseded[:SHORT]} it supersedes is still on {chosen.branch}"
        say(f"{old}; flagdata withdraw takes it off")


def realign_recording(chosen: Realigning, *, plot: Path | None = None) -> Report:
    """Writes a recording anew.

    Args:
        plot: file of a picture of the search; None for none.

    Raises:
        FlagdataError: see `flagdata.realign`.
    """
    from flagdata.align.film_recording import Pair, parents_of, truth_recipe, truth_window

    lake, clock = _open_lake(chosen, plot)
    old, parents = parents_of(lake, chosen.recording, at=chosen.branch)
    pair = Pair.of(lake, *parents, at=chosen.branch)
    window = truth_window(old.recipe) if chosen.window is None else chosen.window
    recipe = {**clock.recipe(), **truth_recipe(window), "supersedes": old.id}
    names = {"name": chosen.name or old.name, "session": chosen.session or old.session}
    report = _of_film(chosen, lake, pair, clock, recipe=recipe, plot=plot, **names)
    return replace(report, superseded=old.id)


def align_pair(chosen: Aligning, *, plot: Path | None = None) -> Report:
    """Puts two artifacts on one clock.

    Args:
        plot: file of a picture of the search; None for none.

    Raises:
        FlagdataError: see `flagdata.align`.
    """
    from flagdata.align.film_recording import Pair, truth_recipe
    from flagdata.core.schema import TRUTH_WINDOW, Kind

    lake, clock = _open_lake(chosen, plot)
    devices = (Kind.CAMERA, Kind.WIND)
    kinds = {
        lake.artifact(one, at=chosen.branch, kinds=devices).kind
        for one in (chosen.first, chosen.second)
    }
    if kinds == {Kind.WIND}:
        unused = {
            "--window": chosen.window,
            "--response": chosen.response,
            "--response-sigma": chosen.response_sigma,
            "--plot": plot,
        }
        return _of_logs(
            chosen, lake, clock, unused=tuple(o for o, value in unused.items() if value is not None)
        )
    pair = Pair.of(lake, chosen.first, chosen.second, at=chosen.branch)
    window = TRUTH_WINDOW if chosen.window is None else chosen.window
    recipe = {**clock.recipe(), **truth_recipe(window)}
    return _of_film(
        chosen,
        lake,
        pair,
        clock,
        recipe=recipe,
        plot=plot,
        name=chosen.name,
        session=chosen.session,
    )


def _open_lake(chosen: ByClock, plot: Path | None) -> tuple[Lake, ClockOptions]:
    """Opens the lake, which can be written unless nothing is to be; with how to come by the clock
    model."""
    clock = chosen.clock()
    _check_plot(plot, clock)
    lake = chosen.opened()
    if not chosen.dry_run:
        lake.check_writable()
    return lake, clock


def _of_logs(
    chosen: Aligning, lake: Lake, clock: ClockOptions, *, unused: tuple[str, ...]
) -> Report:
    """Estimates the sensor's clock and gain, and writes its log on the reference's clock.

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
    from flagdata.core.rng import stream
    from flagdata.errors import UsageError
    from flagdata.lake.remaking import ABSENT

    if clock.by is not Method.ESTIMATE:
        raise UsageError(
            f"two logs aligned by {clock.by}", where="--by", fix="leave --by out: they are compared"
        )
    if unused:
        raise UsageError(
            f"two logs have no use for {', '.join(unused)}", where=unused[0], fix="leave it out"
        )
    search = clock.search or LagSearch()
    recipe: dict[str, Any] = {
        "align": {
            "by": "logs",
            "centre": search.centre,
            "window": search.window,
            "sigma": search.sigma,
        }
    }
    names = {"name": chosen.name, "session": chosen.session, "branch": chosen.branch}
    pair = WindPair.of(lake, chosen.first, chosen.second, at=chosen.branch)
    there = ABSENT if chosen.dry_run else find_aligned(lake, pair, recipe, **names)
    if there.whole is not None:
        say("this log is aligned already; nothing was written")
        return _logs_report(there.whole, None, created=False, healed=None)
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
    if chosen.dry_run:
        return _logs_report(None, found, created=False, healed=None)
    made, healed = make_aligned(lake, pair, found, recipe=recipe, code=there.code, **names)
    return _logs_report(made, found, created=there.artifact is None, healed=healed)


def _logs_report(
    made: Artifact | None, found: LogClock | None, *, created: bool, healed: Remade | None
) -> Report:
    from flagdata.align.windpair import summary
    from flagdata.lake.remaking import said

    content: dict[str, Any] = {"wind": made.id if made is not None else None, "created": created}
    content["healed"] = None if healed is None else asdict(healed)
    lines = []
    if found is not None:
        content["clock"] = summary(found)
        lines.append(sentence(found))
    if made is not None:
        lines.append(f"wind {made.id}, on the clock of {made.parents[0]}")
        if healed is not None:
            lines.append(said(made.id, healed))
    return Report(tag="align-logs", content=content, lines=tuple(lines))


def sentence(found: LogClock) -> str:
    """Offset and drift of the sensor's clock, and its gain, each with its 90 % interval or σ."""
    from flagdata.core.clock_model import NINETY

    (segment,), gain = found.model.segments, found.gain
    half = NINETY * segment.sigma_offset
    low, high = segment.offset - half, segment.offset + half
    digits = max(2, 1 - math.floor(math.log10(segment.sigma_offset)))
    parts = len(found.line.parts)
    return (
        f"offset {segment.offset:+.{digits}f} s [{low:.{digits}f}, {high:.{digits}f}] 90 %"
        f", drift {1e6 * segment.drift:+.2f} ± {1e6 * segment.sigma_drift:.2f} ppm"
        f"{f', n = {parts} parts of ten minutes' if parts else ' (not measured: too few parts)'}; "
        f"gain {gain.gain:.4f} ± {gain.sigma:.4f}, zero {gain.zero:+.3f} ± {gain.sigma_zero:.3f} "
        "m/s, "
        f"n = {gain.count} minutes"
    )


def _check_plot(plot: Path | None, options: ClockOptions) -> None:
    """Refuse a --plot that would not be drawn or cannot be written."""
    from flagdata.align.methods import Method
    from flagdata.errors import UsageError

    if plot is None:
        return
    if options.by is not Method.ESTIMATE:
        raise UsageError(
            f"alignment by {options.by} has no search to draw", where="--plot", fix="leave it out"
        )
    from flagdata.align.plot import check

    check(plot)


def _of_film(
    chosen: ByClock,
    lake: Lake,
    pair: Pair,
    clock: ClockOptions,
    *,
    recipe: dict[str, Any],
    plot: Path | None,
    name: str | None,
    session: str | None,
) -> Report:
    """Makes the recording of a film and a wind, unless it is there."""
    from flagdata.align.film_recording import find_recording, make_recording, session_of

    session_of(pair, session_given=session)  # refused before the long part
    _warn_of_clocks(pair, clock)
    names = {"name": name, "session": session, "branch": chosen.branch}
    present = None if chosen.dry_run or plot else find_recording(lake, pair, recipe, **names)
    if present is not None:
        say("this recording is there already; nothing was written")
        return _report(present, None)
    outcome = _outcome(pair, clock, recipe=recipe, plot=plot)
    if chosen.dry_run:
        return _report(None, outcome)
    with progress(pair.camera_record.frame_count, label="copying", unit="frame") as advance:
        made = make_recording(lake, pair, outcome.alignment, progress=advance, **names)
    return _report(made, outcome)


def _warn_of_clocks(pair: Pair, options: ClockOptions) -> None:
    """Say so where film and log are stamped hours apart."""
    from flagdata.align.apart import by_spans

    if pair.wind.start is None or pair.wind.end is None:
        return
    centre = options.search.centre if options.search is not None else 0.0
    shift = round((options.offset or centre) * NANOSECONDS)
    start, end = pair.span
    found = by_spans(
        (start + shift, end + shift),
        (pair.wind.start, pair.wind.end),
        names=(pair.camera.name, pair.wind.name),
    )
    if found is not None:
        say_finding(found)


def _outcome(
    pair: Pair, options: ClockOptions, *, recipe: dict[str, Any], plot: Path | None
) -> Outcome:
    from flagdata.align.methods import Method, declared_clock, estimated_clock, evidence

    if options.by is not Method.ESTIMATE:
        return declared_clock(pair, options, recipe=recipe)
    with progress(pair.camera_record.frame_count, label="motion", unit="frame") as advance:
        found = evidence(pair, options, progress=advance)
    if plot is not None:
        from flagdata.align.plot import draw

        draw(found, plot, title=f"{pair.camera.name} and {pair.wind.name}")
        say(f"plot: {plot}")
    return estimated_clock(pair, found, recipe=recipe)


def _report(made: RecordingResult | None, outcome: Outcome | None) -> Report:
    """The clock model, and the recording if one was made or found."""
    content: dict[str, Any] = {"recording": None, "clips": [], "created": False}
    lines = []
    if made is not None:
        content = json_values(made)
    if outcome is not None:
        content["clock"] = dict(outcome.alignment.details)
        lines.append(_sentence(outcome))
    if made is not None:
        lines.append(made.line)
    return Report(tag="align", content=content, lines=tuple(lines))


def _sentence(outcome: Outcome) -> str:
    """`offset +12.31 s [12.02, 12.60] 90 %, confidence 0.99, n = 596 bins of 1 s`."""
    from flagdata.core.clock_model import NINETY

    (segment,) = outcome.alignment.clock.segments
    half = NINETY * segment.sigma_offset
    digits = max(2, 1 - math.floor(math.log10(segment.sigma_offset)))
    low, high = segment.offset - half, segment.offset + half
    text = f"offset {segment.offset:+.{digits}f} s [{low:.{digits}f}, {high:.{digits}f}] 90 %"
    if outcome.evidence is None or outcome.evidence.line is None:
        return f"{text}, {outcome.alignment.clock.method}"
    estimate, line = outcome.evidence.estimate, outcome.evidence.line
    text += (
        f", confidence {estimate.confidence:.2f}, n = {estimate.bins} bins of "
        f"{outcome.evidence.wind.period:g} s"
    )
    if line.parts:
        text += (
            f"; drift {1e6 * line.drift:+.0f} ± {1e6 * line.sigma_drift:.0f} ppm, n = "
            f"{len(line.parts)} parts"
        )
    return text
