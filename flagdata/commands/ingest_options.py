"""What the user gives `flagdata ingest`: the options of each kind of source, and which mean nothing
for a source."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flagdata.api.recording_verbs import (
    Clocked,
    FromAnemometer,
    FromCamera,
    FromFrames,
    Recorded,
    Scaled,
)
from flagdata.errors import TimeError, UsageError
from flagdata.verbs.option_types import written_seconds
from flagdata.verbs.verb_options import described_fields, typed_names

if TYPE_CHECKING:
    from datetime import tzinfo

    from flagdata.ingest.anemometer.log_confirmation import Confirm
    from flagdata.ingest.artifacts_present import Labels
    from flagdata.ingest.markers import MarkerOptions
    from flagdata.ingest.meshes.mesh_artifacts import MeshIngest
    from flagdata.ingest.source_artifacts import CameraIngest, WindIngest

KINDS: dict[str, tuple[str, type]] = {
    "camera": ("a camera file", FromCamera),
    "anemometer": ("an anemometer log", FromAnemometer),
    "meshes": ("a mesh sequence", FromFrames),
    "markers": ("a marker table", FromFrames),
    "record": ("a record of flagdata", Recorded),
}
"""What each kind of source is called, and the options that mean something for it."""
_OF_ALL = frozenset({"format", "sniff", "as_json"})
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
"""Options that name or time one source."""


@dataclass(frozen=True, kw_only=True)
class IngestRequest:
    """The options of an ingest, read.

    Attributes:
        chosen: the options.
        sources: what is ingested; of chapters that are joined the first.
        format: that of all sources; None to recognise each by its content.
        kind: that all sources are to be; None for any.
        camera, wind, meshes, markers: how each kind of source is read.
        labels: what the artifacts are called.
        confirm: asks whether drafted readings are right.
    """

    chosen: Recorded
    sources: tuple[Path, ...]
    format: str | None
    kind: str | None
    camera: CameraIngest
    wind: WindIngest
    meshes: MeshIngest
    markers: MarkerOptions
    labels: Labels
    confirm: Confirm

    @classmethod
    def of(cls, chosen: Recorded, *, kind: str | None = None, confirm: Confirm) -> IngestRequest:
        """Reads the options.

        Args:
            kind: that all sources are to be; None for any.

        Raises:
            UsageError: a value that cannot be read, or options that contradict each other.
        """
        from flagdata.ingest.artifacts_present import Labels
        from flagdata.ingest.markers import MarkerOptions
        from flagdata.ingest.meshes.mesh_artifacts import MeshIngest
        from flagdata.ingest.source_artifacts import CameraIngest, WindIngest

        several = chosen.sources
        sources = (Path(several),) if isinstance(several, Path | str) else tuple(map(Path, several))
        chapters: tuple[Path, ...] = ()
        if isinstance(chosen, FromCamera):
            _check_picture(chosen)
            if chosen.join:
                from flagdata.ingest.camera.joined import in_order

                first, *later = in_order(sources)
                sources, chapters = (first,), tuple(later)
        unit = chosen.unit if isinstance(chosen, Scaled) else None
        rate = chosen.rate if isinstance(chosen, Clocked | FromFrames) else None
        return cls(
            chosen=chosen,
            sources=sources,
            format=getattr(chosen, "format", kind),
            kind=kind,
            camera=camera_options(chosen, chapters)
            if isinstance(chosen, FromCamera)
            else CameraIngest(),
            wind=wind_options(chosen) if isinstance(chosen, FromAnemometer) else WindIngest(),
            meshes=MeshIngest(rate=frame_rate(rate), unit=_length_unit(unit)),
            markers=MarkerOptions(rate=frame_rate(rate), unit=_length_unit(unit)),
            labels=Labels(name=chosen.name, session=chosen.session),
            confirm=confirm,
        )


def _check_picture(chosen: FromCamera) -> None:
    from flagdata.core.files.outputs import check_file

    if chosen.crop_picture is None:
        return
    if chosen.crop.strip().lower() != "auto":
        raise UsageError(
            "--crop-picture needs --crop auto",
            where=str(chosen.crop_picture),
            fix="add --crop auto",
        )
    check_file(Path(chosen.crop_picture), command="ingest")


def camera_options(chosen: FromCamera, chapters: tuple[Path, ...] = ()) -> CameraIngest:
    """Returns how a camera's file is read.

    Args:
        chapters: files that the first continues in.

    Raises:
        UsageError: a start, zone, rate or crop that cannot be read.
    """
    from flagdata import timebase
    from flagdata.ingest.camera import CameraOptions, parse_crop
    from flagdata.ingest.camera.recording_start import UNKNOWN
    from flagdata.ingest.source_artifacts import CameraIngest
    from flagdata.record import Coding

    start, zone, rate = chosen.start, chosen.zone, chosen.rate or "25"
    try:
        place = timebase.zone(zone, where="--zone") if zone is not None else None
        instant = UNKNOWN if _unknown(start) else _instant(start, place)
    except TimeError as error:
        raise UsageError(error.what, where=error.where, fix=error.fix) from None
    options = CameraOptions(
        start=instant,
        zone=None if start is not None and timebase.names_zone(start) else zone,
        true_fps=chosen.true_fps,
        sequence_fps=chosen.sequence_fps,
        rate="native"
        if rate.strip().lower() == "native"
        else _rate(rate, "frames a second, or native"),
        crop=parse_crop(chosen.crop),
        exposure=chosen.exposure,
        topic=chosen.topic,
        episode=chosen.episode,
        stream=chosen.stream,
        chapters=chapters,
    )
    return CameraIngest(camera=options, coding=Coding(chosen.archive))


def _unknown(start: str | None) -> bool:
    """Whether a film's start is stated not to be known; what a log's stamps then count from is not
    stated either."""
    return start is not None and start.strip().lower() == "unknown"


def _instant(start: str | None, place: tzinfo | None) -> int | None:
    from flagdata import timebase

    return None if start is None else timebase.parse(start, default=place, where="--start")


def wind_options(chosen: FromAnemometer) -> WindIngest:
    """Returns how an anemometer's log is read. A unit is heeded where it is one of speed, since
    meshes have units, too.

    Raises:
        UsageError: a date, start or zero offset that cannot be read.
    """
    import datetime as dt

    from flagdata import timebase
    from flagdata.core.units import unit as unit_of
    from flagdata.ingest.anemometer import WindOptions
    from flagdata.ingest.source_artifacts import WindIngest

    start, date, unit, rate = chosen.start, chosen.date, chosen.unit, chosen.rate
    try:
        place = timebase.zone(chosen.zone, where="--zone") if chosen.zone is not None else None
        instant = None if _unknown(start) else _instant(start, place)
    except TimeError as error:
        raise UsageError(error.what, where=error.where, fix=error.fix) from None
    try:
        day = dt.date.fromisoformat(date) if date is not None else None
    except ValueError:
        raise UsageError(
            f"{date!r} is not a date", where="--date", fix="write it as 2026-05-01"
        ) from None
    offset: Any = chosen.zero_offset
    if offset is not None and offset not in ("report", "estimate"):
        offset = _number(offset, "--zero-offset", "a speed in m/s, report or estimate")
    name = getattr(chosen, "format", None)
    words: dict[str, Any] = {key: getattr(chosen, key) for key in _WORDS}
    return WindIngest(
        wind=WindOptions(
            format=None if name in ("camera", "meshes", "markers") else name,
            recipe=chosen.sensor,
            date=day,
            azimuth=float(unit_of("deg").to_si(chosen.azimuth))
            if chosen.azimuth is not None
            else None,
            zero_offset=offset,
            unit=unit if unit is not None and unit_of(unit, where="--unit").si == "m/s" else None,
            start=instant,
            rate=None
            if rate in (None, "native")
            else _rate(rate, "readings a second, or the time between two: 10min"),
            **words,
        )
    )


_WORDS = (
    "zone",
    "encoding",
    "date_order",
    "platform",
    "talker",
    "clock",
    "wind",
    "columns",
    "missing",
    "expect",
    "topic",
)
"""Options that the reader of logs takes as they are."""


def frame_rate(rate: str | None) -> float | None:
    """Returns the rate of a mesh sequence or a table of markers [Hz]; None for the source's own."""
    if rate is None or rate.strip().lower() == "native":
        return None
    return _rate(rate, "frames a second, or the time between two, e.g. 40ms")


def _rate(text: str, wanted: str) -> float:
    """A rate [Hz] from a number, with Hz behind it or not, or from the time between two: 10min is
    1/600 Hz."""
    if (step := written_seconds(text)) is not None:
        if step <= 0:
            raise UsageError(
                f"the time between two must be above 0, not {text!r}",
                where="--rate",
                fix=f"give {wanted}",
            )
        return 1 / step
    return _number(re.sub(r"(?i)\s*hz$", "", text.strip()), "--rate", wanted)


def _number(text: str, option: str, wanted: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise UsageError(f"{text!r} is not a number", where=option, fix=f"give {wanted}") from None


def _check_unit(kinds: Sequence[str | None], name: str | None) -> None:
    """Refuse a unit that is one of no source's: of speed for a log, of length for meshes and
    markers."""
    from flagdata.core.units import unit

    wanted = {"anemometer": "m/s", "meshes": "m", "markers": "m"}
    needed = {wanted[kind] for kind in kinds if kind in wanted}
    if name is None or not needed or unit(name, where="--unit").si in needed:
        return
    if "m" in needed:
        raise UsageError(
            f"{name!r} is no unit of length", where="--unit", fix="give mm, cm, m or ft"
        )
    raise UsageError(
        f"{name!r} is no unit of speed", where="--unit", fix="give m/s, km/h, mph, kn or ft/s"
    )


def _length_unit(name: str | None) -> str:
    """Returns the unit of positions: metres where none is given, or one of speed for a log
    beside."""
    from flagdata.core.units import unit

    return "m" if name is None or unit(name, where="--unit").si == "m/s" else name


def check_applies(kinds: Sequence[str | None], given: IngestRequest) -> None:
    """Refuses options that mean nothing for any source, or that time or name more than one, before
    anything is written.

    Args:
        kinds: of the sources; one that is not recognised may be any.
    """
    from flagdata.timebase import names_zone

    chosen = given.chosen
    names, rows = typed_names(chosen), described_fields(type(chosen))
    ignored = {
        kind: names - _OF_ALL - described_fields(form).keys() for kind, (_, form) in KINDS.items()
    }
    called = {kind: name for kind, (name, _) in KINDS.items()}
    if isinstance(chosen, FromCamera) and chosen.start is not None and names_zone(chosen.start):
        called["camera"] += " whose --start names its zone"
        ignored["camera"] |= names & {"zone"}
    if "camera" in kinds:
        # Of a camera and a log together, start and rate are the camera's.
        ignored["anemometer"] |= names & {"start", "rate"}
    if given.wind.wind.rate is None:
        ignored["anemometer"] |= names & {"rate"}
    _check_unit(kinds, chosen.unit if isinstance(chosen, Scaled) else None)
    for name in sorted(names):
        foreign = [kind is not None and name in ignored.get(kind, ()) for kind in kinds]
        spelled = rows[name][1].spelling_of(name)
        if all(foreign):
            whose = " or ".join(sorted({called[kind] for kind in kinds if kind is not None}))
            raise UsageError(f"{spelled} means nothing for {whose}", fix="leave it out")
        if name in ONE_SOURCE and foreign.count(False) > 1:
            raise UsageError(
                f"{spelled} with {foreign.count(False)} sources",
                fix="ingest the source it belongs to by itself",
            )
