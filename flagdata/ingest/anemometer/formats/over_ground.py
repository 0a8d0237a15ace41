"""Which winds of a network are wind over ground, by the motion of its platform."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from flagdata.errors import InputError, UsageError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.options import WindOptions
from flagdata.ingest.anemometer.samples.platform import MOVING
from flagdata.signals import Series


def settled(
    channels: Mapping[str, Series], options: WindOptions, *, speeds: list[float], source: str, where: str
) -> tuple[dict[str, Series], Finding]:
    """The channels with wind over ground among them where the platform is fixed, and its findings.

    Args:
        channels: apparent, theoretical and true wind.
        speeds: of the platform over ground, as the network states them [kn].
        source: the messages that wind over ground was read from.

    Raises:
        InputError: a platform that was given as fixed moves.
        UsageError: an azimuth that nothing can be turned by.
    """
    speed = float(np.median(speeds)) if speeds else None
    moving = speed is not None and speed > MOVING
    if options.platform == "fixed":
        if moving:
            what = f"the platform was given as fixed, but moves at {speed:.1f} kn over ground in the median"
            raise InputError(what, where=where, fix="leave out --platform")
        return _fixed(channels, options, source, where)
    if options.azimuth is not None:
        fix = "add --platform fixed, or leave it out"
        raise UsageError("an azimuth belongs to a fixed platform", where=where, fix=fix)
    fix = None
    if moving:
        known = f"a platform that moves at {speed:.1f} kn"
    elif options.platform in ("moving", "corrected"):
        known = "a moving platform, as given"
    else:
        known, fix = "a platform of unknown motion", "if the sensor is on a mast, give --platform fixed"
    if "wind_speed" not in channels:
        what = f"wind relative to {known}: no ground truth"
        kind = "apparent-wind-only"
        return dict(channels), Finding(kind=kind, severity=Severity.WARNING, value=speed, what=what, fix=fix)
    what = f"wind over ground ({source}) was computed by the instrument from heading and speed of {known}"
    if fix is not None:
        what = f"wind over ground ({source}): if its platform moves, the instrument computed it from that platform's "
        what += "heading and speed"
    return dict(channels), Finding.of("computed-true-wind", what, fix=fix)


def _fixed(
    channels: Mapping[str, Series], options: WindOptions, source: str, where: str
) -> tuple[dict[str, Series], Finding]:
    kind = "apparent" if "apparent_wind_speed" in channels else "theoretical"
    speed, angle = f"{kind}_wind_speed", f"{kind}_wind_direction"
    out = dict(channels)
    stated = "wind_speed" in out
    if not stated and speed in out:
        out["wind_speed"] = out.pop(speed)
    if options.azimuth is not None:
        if stated or angle not in out:
            what = "the stream states wind over ground itself" if stated else "the stream has no directions"
            raise UsageError(f"an azimuth was given, but {what}", where=where, fix="leave out --azimuth")
        out["wind_direction"] = np.mod(out.pop(angle) + options.azimuth, 2 * np.pi)
    what = f"the wind over ground is that of {source}" if stated else f"{kind} wind is wind over ground"
    return out, Finding.of("fixed-platform", f"fixed platform, as given: {what}")
