"""What the user gives `flagdata ingest`: the options of each kind of source, and which mean nothing for a source."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flagdata.commands.durations import written_seconds
from flagdata.errors import TimeError, UsageError

if TYPE_CHECKING:
    from datetime import tzinfo

    from flagdata.commands.confirm import OnCommandLine
    from flagdata.ingest.markers import MarkerOptions
    from flagdata.ingest.meshes.store import MeshIngest
    from flagdata.ingest.store import CameraIngest, Labels, WindIngest

# Parameters that mean something for one kind of source only, those of --sniff, and those that name or time one source.
CAMERA_ONLY = ("episode", "join", "stream", "true_fps", "sequence_fps", "crop", "crop_picture", "exposure", "archive")
WIND_ONLY = (
    "sensor",
    "date",
    "date_order",
    "platform",
    "talker",
    "azimuth",
    "clock",
    "zero_offset",
    "encoding",
    "wind",
    "columns",
    "missing",
    "expect",
    "accept",
)
LENGTHS = ("unit",)
"""Options that meshes and markers share with the wind's speed."""
FOREIGN = {
    "camera": ("a camera file", (*WIND_ONLY, *LENGTHS)),
    "anemometer": ("an anemometer log", CAMERA_ONLY),
    "meshes": ("a mesh sequence", (*CAMERA_ONLY, *WIND_ONLY, "zone", "start")),
    "markers": ("a marker table", (*CAMERA_ONLY, *WIND_ONLY, "zone", "start")),
    "record": ("a record of flagdata", (*CAMERA_ONLY, *WIND_ONLY, *LENGTHS, "zone", "start", "rate")),
}
"""What each kind of source is called, and the options that mean nothing for it."""
SNIFF = (
    "sources",
    "sniff",
    "start",
    "zone",
    "true_fps",
    "sequence_fps",
    "crop",
    "crop_picture",
    "unit",
    "wind",
    "date_order",
    "columns",
    "topic",
    "episode",
    "join",
    "stream",
    "encoding",
)
ONE_SOURCE = ("start", "date", "name", "crop_picture", "accept")


@dataclass(frozen=True, kw_only=True)
class Given:
    """The command line, read."""

    camera: CameraIngest
    wind: WindIngest
    meshes: MeshIngest
    markers: MarkerOptions
    labels: Labels
    branch: str
    crop_picture: Path | None
    zoned_start: bool
    confirm: OnCommandLine
    unit: str | None = None


def option(parameter: str) -> str:
    """How a parameter is spelled on the command line."""
    return "--as" if parameter == "format_name" else f"--{parameter.replace('_', '-')}"


def camera_options(
    *,
    start: str | None,
    zone_name: str | None,
    true_fps: float | None,
    sequence_fps: float | None,
    rate: str,
    crop: str,
    exposure: float | None,
    archive: str,
    topic: str | None = None,
    episode: int | None = None,
    stream: int | None = None,
    chapters: tuple[Path, ...] = (),
) -> CameraIngest:
    """Those of a camera.

    Raises:
        UsageError: a start, zone, rate or crop that cannot be read.
    """
    from flagdata import timebase
    from flagdata.ingest.camera import CameraOptions, parse_crop
    from flagdata.ingest.camera.start import UNKNOWN
    from flagdata.ingest.store import CameraIngest
    from flagdata.record import Coding

    try:
        place = timebase.zone(zone_name, where="--zone") if zone_name is not None else None
        instant = UNKNOWN if _unknown(start) else _instant(start, place)
    except TimeError as error:
        raise UsageError(error.what, where=error.where, fix=error.fix) from None
    options = CameraOptions(
        start=instant,
        zone=None if start is not None and timebase.names_zone(start) else zone_name,
        true_fps=true_fps,
        sequence_fps=sequence_fps,
        rate="native" if rate.strip().lower() == "native" else _rate(rate, "frames a second, or native"),
        crop=parse_crop(crop),
        exposure=exposure,
        topic=topic,
        episode=episode,
        stream=stream,
        chapters=chapters,
    )
    return CameraIngest(camera=options, coding=Coding(archive))


def _unknown(start: str | None) -> bool:
    """Whether a film's start is stated not to be known; what a log's stamps then count from is not stated either."""
    return start is not None and start.strip().lower() == "unknown"


def _instant(start: str | None, place: tzinfo | None) -> int | None:
    from flagdata import timebase

    return None if start is None else timebase.parse(start, default=place, where="--start")


def wind_options(
    *,
    format_name: str | None,
    sensor: str | None,
    zone_name: str | None,
    date: str | None,
    date_order: Any,
    platform: Any,
    talker: str | None,
    azimuth: float | None,
    clock: Any,
    zero_offset: str | None,
    encoding: str | None,
    unit: str | None,
    start: str | None,
    wind: str | None,
    rate: str | None,
    columns: str | None,
    missing: tuple[str, ...] = (),
    expect: tuple[str, ...] = (),
    topic: str | None = None,
) -> WindIngest:
    """Those of an anemometer; `rate` is `None` where none is given.

    `unit` is heeded where it is one of speed, since meshes have units, too.

    Raises:
        UsageError: a date, start or zero offset that cannot be read.
    """
    import datetime as dt

    from flagdata import timebase
    from flagdata.ingest.anemometer import WindOptions
    from flagdata.ingest.store import WindIngest
    from flagdata.units import unit as unit_of

    try:
        place = timebase.zone(zone_name, where="--zone") if zone_name is not None else None
        instant = None if _unknown(start) else _instant(start, place)
    except TimeError as error:
        raise UsageError(error.what, where=error.where, fix=error.fix) from None
    try:
        day = dt.date.fromisoformat(date) if date is not None else None
    except ValueError:
        raise UsageError(f"{date!r} is not a date", where="--date", fix="write it as 2026-05-01") from None
    offset: Any = zero_offset
    if zero_offset is not None and zero_offset not in ("report", "estimate"):
        offset = _number(zero_offset, "--zero-offset", "a speed in m/s, report or estimate")
    return WindIngest(
        wind=WindOptions(
            format=format_name,
            recipe=sensor,
            zone=zone_name,
            encoding=encoding,
            date=day,
            date_order=date_order,
            platform=platform,
            talker=talker,
            azimuth=float(unit_of("deg").to_si(azimuth)) if azimuth is not None else None,
            clock=clock,
            zero_offset=offset,
            unit=unit if unit is not None and unit_of(unit, where="--unit").si == "m/s" else None,
            start=instant,
            rate=None if rate in (None, "native") else _rate(rate, "readings a second, or the time between two: 10min"),
            wind=wind,
            columns=columns,
            missing=missing,
            expect=expect,
            topic=topic,
        )
    )


def mesh_options(*, rate: str | None, length: str) -> MeshIngest:
    """Those of a mesh sequence; `rate` None for the source's own."""
    from flagdata.ingest.meshes.store import MeshIngest

    if rate is None or rate.strip().lower() == "native":
        return MeshIngest(unit=length)
    return MeshIngest(rate=_rate(rate, "frames a second, or the time between two, e.g. 40ms"), unit=length)


def marker_options(*, rate: str | None, length: str) -> MarkerOptions:
    """Those of a table of markers; `rate` None for the source's own."""
    from flagdata.ingest.markers import MarkerOptions

    if rate is None or rate.strip().lower() == "native":
        return MarkerOptions(unit=length)
    return MarkerOptions(rate=_rate(rate, "frames a second, or the time between two, e.g. 40ms"), unit=length)


def _rate(text: str, wanted: str) -> float:
    """A rate [Hz] from a number, with Hz behind it or not, or from the time between two: 10min is 1/600 Hz."""
    if (step := written_seconds(text)) is not None:
        if step <= 0:
            raise UsageError(f"{text!r} is no time between two", where="--rate", fix=f"give {wanted}")
        return 1 / step
    return _number(re.sub(r"(?i)\s*hz$", "", text.strip()), "--rate", wanted)


def _number(text: str, option: str, wanted: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise UsageError(f"{text!r} is not a number", where=option, fix=f"give {wanted}") from None


def labels(name: str | None, session: str | None) -> Labels:
    """What the artifacts are called."""
    from flagdata.ingest.store import Labels

    return Labels(name=name, session=session)


def _check_unit(kinds: Sequence[str | None], name: str | None) -> None:
    """Refuse a unit that is one of no source's: of speed for a log, of length for meshes and markers."""
    from flagdata.units import unit

    wanted = {"anemometer": "m/s", "meshes": "m", "markers": "m"}
    needed = {wanted[kind] for kind in kinds if kind in wanted}
    if name is None or not needed or unit(name, where="--unit").si in needed:
        return
    if "m" in needed:
        raise UsageError(f"{name!r} is no unit of length", where="--unit", fix="give mm, cm, m or ft")
    raise UsageError(f"{name!r} is no unit of speed", where="--unit", fix="give m/s, km/h, mph, kn or ft/s")


def length_unit(name: str | None) -> str:
    """The unit of positions: metres where none is given, or one of speed for a log beside."""
    from flagdata.units import unit

    return "m" if name is None or unit(name, where="--unit").si == "m/s" else name


def check_applies(kinds: Sequence[str | None], options: Given, *, given: frozenset[str]) -> None:
    """Refuse options that mean nothing for any source, or that time or name more than one, before anything is written.

    Args:
        kinds: of the sources; one that is not recognised may be any.
    """
    foreign = dict(FOREIGN)
    if options.zoned_start:
        what, parameters = foreign["camera"]
        foreign["camera"] = (f"{what} whose --start names its zone", (*parameters, "zone"))
    if "camera" in kinds:
        # Of a camera and a log together, start and rate are the camera's.
        what, parameters = foreign["anemometer"]
        foreign["anemometer"] = (what, (*parameters, "start", "rate"))
    if options.wind.wind.rate is None:
        what, parameters = foreign["anemometer"]
        foreign["anemometer"] = (what, (*parameters, "rate"))
    _check_unit(kinds, options.unit)
    for parameter in sorted(given):
        strange = [kind in foreign and parameter in foreign[kind][1] for kind in kinds]
        if all(strange):
            whose = " or ".join(sorted({foreign[kind][0] for kind in kinds if kind is not None}))
            raise UsageError(f"{option(parameter)} means nothing for {whose}", fix="leave it out")
        if parameter in ONE_SOURCE and strange.count(False) > 1:
            raise UsageError(
                f"{option(parameter)} with {strange.count(False)} sources",
                fix="ingest the source it belongs to by itself",
            )
