"""`flagdata align REFERENCE SENSOR`: two logs of one wind on one clock."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from flagdata.console import document, echo, progress, say, say_finding

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
        _report(there.whole, None, created=False, healed=None, as_json=as_json)
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
        _report(None, found, created=False, healed=None, as_json=as_json)
        return
    made, healed = make_aligned(
        lake, pair, found, recipe=recipe, name=name, session=session, branch=branch, code=there.code
    )
    _report(made, found, created=there.artifact is None, healed=healed, as_json=as_json)


def _report(
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
