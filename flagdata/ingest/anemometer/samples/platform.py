"""What the anemometer is mounted on: on a mast the air past it is the wind, on a boat or vehicle it
is not.

Formats that know nothing of platforms deliver `wind_speed` for whatever the sensor read. Where the
user says that the platform moves, or its own speed or position says so, that becomes
`apparent_wind_speed`, which is no ground truth, unless the user says that the platform's motion was
taken out before the wind was logged ("corrected"). Of the winds of a network, `settle_platform`
says which are wind over ground.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.core.findings import Finding, Severity
from flagdata.core.units import UNITS
from flagdata.errors import InputError, UsageError
from flagdata.ingest.anemometer.log_reading import Reading
from flagdata.ingest.anemometer.wind_options import WindOptions
from flagdata.record.signals import Series

Platform: TypeAlias = Literal["fixed", "moving", "corrected"]
MOVING = 0.5
"""Speed over ground that a moored or fixed receiver does not report in the median [kn]."""
RANGE = 100.0
"""Extent of the positions of a fixed receiver, which its errors alone explain, from the 5th to the
95th percentile [m]."""
POSITION = ("latitude", "longitude")
EARTH = 6_371_000.0
"""Mean radius [m]."""
_COLUMN = r"(?:gps|pos|position)?[\s_.-]*(?:{name})(?:[\s_.-]*\W?(?:deg|degrees|°|dd|decimal)\W?)?"
_LATITUDE = re.compile(_COLUMN.format(name="lat|latitude"), re.IGNORECASE)
_LONGITUDE = re.compile(_COLUMN.format(name="lon|lng|long|longitude"), re.IGNORECASE)
_RENAMED = {"wind_speed": "apparent_wind_speed", "wind_direction": "apparent_wind_direction"}


@dataclass(frozen=True, kw_only=True)
class PlatformMotion:
    """What a log says of its platform's motion.

    Attributes:
        text: in words.
        speed: median over ground [m/s], `None` where only the extent of the positions is known.
    """

    text: str
    speed: float | None


def position_columns(header: Sequence[str]) -> tuple[str, str] | None:
    """Finds the columns of latitude and longitude that a header names, each once; `None` where it
    does not."""
    columns = [
        [name for name in header if pattern.fullmatch(name.strip()[:40])]
        for pattern in (_LATITUDE, _LONGITUDE)
    ]
    return (columns[0][0], columns[1][0]) if all(len(names) == 1 for names in columns) else None


def extent(latitude: FloatArray, longitude: FloatArray) -> float:
    """Computes how far positions [deg] reach, without the farthest twentieth on each side [m]; 0
    where there are none."""
    valid = (
        (np.abs(latitude) <= 90) & (np.abs(longitude) <= 180) & ((latitude != 0) | (longitude != 0))
    )
    if int(valid.sum()) < 2:
        return 0.0
    north, east = np.radians(latitude[valid]), np.radians(longitude[valid])
    east = np.unwrap(east) * float(np.cos(np.median(north)))
    low, high = np.quantile(np.stack([north, east]), [0.05, 0.95], axis=1)
    return float(np.hypot(*(high - low))) * EARTH


def motion(reading: Reading, positions: Mapping[str, FloatArray]) -> PlatformMotion | None:
    """Finds the motion that a log shows; `None` where it shows none.

    Args:
        positions: (n,) "latitude" and "longitude" [deg] of the rows, where the file has them.
    """
    speed = reading.channels.get("platform_speed")
    if speed is not None and np.isfinite(speed).any():
        median = float(np.nanmedian(speed))
        if median > MOVING * UNITS["kn"].scale:
            return PlatformMotion(
                text=f"moves at {median:.2g} m/s over ground in the median", speed=median
            )
    if {"latitude", "longitude"} <= set(positions):
        reach = extent(positions["latitude"], positions["longitude"])
        if reach > RANGE:
            return PlatformMotion(text=f"moves: its positions reach over {reach:.0f} m", speed=None)
    return None


def settle(
    reading: Reading,
    given_platform: Platform | None,
    *,
    positions: Mapping[str, FloatArray] | None = None,
    where: str,
) -> Reading:
    """Puts a reading's wind in the channels that the platform allows.

    Args:
        given_platform: by the user.
        positions: see `motion`.

    Raises:
        InputError: a platform said to be fixed that moves.
    """
    motion_shown = motion(reading, positions or {})
    if given_platform == "fixed" and motion_shown is not None:
        raise InputError(
            f"the platform was given as fixed, but {motion_shown.text}",
            where=where,
            fix="say --platform moving: its wind is then apparent wind; where the log's wind is "
            "over ground, "
            "computed from a moving platform: --platform corrected",
        )
    has = set(reading.channels)
    if given_platform == "fixed":
        text, names = "fixed platform, as given", {}
        if "wind_speed" not in has and "apparent_wind_speed" in has:
            text += (
                ": apparent wind is wind over ground, its direction still from the sensor's own "
                "mark"
            )
            names = {"apparent_wind_speed": "wind_speed"}
        return _rename(reading, names, "fixed-platform", text, severity=Severity.NOTE)
    if given_platform == "corrected":
        text, names = (
            (
                "wind over ground was computed from a moving platform's motion before it was "
                "logged, as given"
            ),
            {},
        )
        if "wind_speed" not in has and "theoretical_wind_speed" in has:
            text += "; what the file calls true wind is kept as wind_speed"
            names = {"theoretical_wind_speed": "wind_speed"}
        return _rename(reading, names, "computed-true-wind", text)
    if given_platform is None and motion_shown is None:
        return _of_unknown(reading)
    if {"wind_speed", "apparent_wind_speed"} <= has:
        text = (
            "wind over ground was computed by the instrument from a moving platform's heading and "
            "speed"
        )
        return _rename(reading, {}, "computed-true-wind", text)
    names = {
        name: renamed for name, renamed in _RENAMED.items() if name in has and renamed not in has
    }
    platform = (
        "a moving platform, as given"
        if motion_shown is None
        else f"a platform that {motion_shown.text}"
    )
    text = f"wind relative to {platform}: no ground truth"
    text += (
        "; what the file calls wind speed is kept as apparent_wind_speed"
        if "wind_speed" in names
        else ""
    )
    text += ", its direction as one from the bow" if "wind_direction" in names else ""
    fix = (
        None
        if given_platform
        else "if the log's wind is over ground all the same, give --platform corrected"
    )
    return _rename(
        reading,
        names,
        "apparent-wind-only",
        text,
        value=motion_shown.speed if motion_shown else None,
        fix=fix,
    )


def _rename(
    reading: Reading,
    names: Mapping[str, str],
    kind: str,
    text: str,
    *,
    severity: Severity = Severity.WARNING,
    value: float | None = None,
    fix: str | None = None,
) -> Reading:
    """Renames channels of a reading and reports it."""
    finding = Finding(kind=kind, severity=severity, what=text, value=value, fix=fix)
    channels = {names.get(name, name): values for name, values in reading.channels.items()}
    return replace(reading, channels=channels).with_findings((finding,))


def check_corrected(reading: Reading, given_platform: Platform | None, *, where: str) -> None:
    """Raises InputError where the platform's motion is stated to have been removed, and no wind is
    over ground."""
    if (
        given_platform != "corrected"
        or "wind_speed" in reading.channels
        or {"wind_x", "wind_y"} <= set(reading.channels)
    ):
        return
    raise InputError(
        "no wind over ground in the log, which was given as corrected for its platform's motion",
        where=where,
        fix="say --platform moving: its wind is then apparent wind",
    )


def _of_unknown(reading: Reading) -> Reading:
    has = set(reading.channels)
    if "wind_speed" in has or has.isdisjoint({"theoretical_wind_speed", "apparent_wind_speed"}):
        return reading
    text = "wind relative to a platform of unknown motion"
    fix = "if the sensor is on a mast, give --platform fixed"
    if "theoretical_wind_speed" in has:
        text = "wind that is computed as if its platform did not move (true wind, TWS)"
        fix = (
            "if it is wind over ground, computed with the platform's speed and heading, give "
            "--platform corrected"
        )
    return _rename(reading, {}, "apparent-wind-only", f"{text}: no ground truth", fix=fix)


def settle_platform(
    channels: Mapping[str, Series],
    options: WindOptions,
    *,
    speeds: list[float],
    source: str,
    where: str,
) -> tuple[dict[str, Series], Finding]:
    """Adds wind over ground to the channels where the platform is fixed, with a finding.

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
            message = (
                f"the platform was given as fixed, but moves at {speed:.1f} kn over ground in the "
                "median"
            )
            raise InputError(message, where=where, fix="leave out --platform")
        return _fixed_platform(channels, options, source, where)
    if options.azimuth is not None:
        fix = "add --platform fixed, or leave it out"
        raise UsageError("an azimuth belongs to a fixed platform", where=where, fix=fix)
    fix = None
    if moving:
        platform = f"a platform that moves at {speed:.1f} kn"
    elif options.platform in ("moving", "corrected"):
        platform = "a moving platform, as given"
    else:
        platform, fix = (
            "a platform of unknown motion",
            "if the sensor is on a mast, give --platform fixed",
        )
    if "wind_speed" not in channels:
        message = f"wind relative to {platform}: no ground truth"
        kind = "apparent-wind-only"
        return dict(channels), Finding(
            kind=kind, severity=Severity.WARNING, value=speed, what=message, fix=fix
        )
    message = (
        f"wind over ground ({source}) was computed by the instrument from heading and speed of "
        f"{platform}"
    )
    if fix is not None:
        message = (
            f"wind over ground ({source}): if its platform moves, the instrument computed it from "
            "that platform's "
        )
        message += "heading and speed"
    return dict(channels), Finding.of("computed-true-wind", message, fix=fix)


def _fixed_platform(
    channels: Mapping[str, Series], options: WindOptions, source: str, where: str
) -> tuple[dict[str, Series], Finding]:
    kind = "apparent" if "apparent_wind_speed" in channels else "theoretical"
    speed, angle = f"{kind}_wind_speed", f"{kind}_wind_direction"
    out = dict(channels)
    states_ground = "wind_speed" in out
    if not states_ground and speed in out:
        out["wind_speed"] = out.pop(speed)
    if options.azimuth is not None:
        if states_ground or angle not in out:
            message = (
                "the stream states wind over ground itself"
                if states_ground
                else "the stream has no directions"
            )
            raise UsageError(
                f"an azimuth was given, but {message}", where=where, fix="leave out --azimuth"
            )
        out["wind_direction"] = np.mod(out.pop(angle) + options.azimuth, 2 * np.pi)
    message = (
        f"the wind over ground is that of {source}"
        if states_ground
        else f"{kind} wind is wind over ground"
    )
    return out, Finding.of("fixed-platform", f"fixed platform, as given: {message}")
