"""When a recording began: from the user, or from metadata, corrected for known habits of cameras;
never guessed."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import tzinfo

from flagdata.core.findings import Finding
from flagdata.errors import TimeError
from flagdata.ingest.camera.chapters import Chapter
from flagdata.timebase import NANOSECONDS, iso, parse, zone


@dataclass(frozen=True, kw_only=True)
class Start:
    """Instant of the first frame on the camera's clock.

    Attributes:
        instant: [UTC ns].
        source: "option", "unknown", "telemetry: GPS", or "metadata: <key>".
        sigma: standard uncertainty of reading it off the file [s], the camera's clock error not
            included; `None` for the user's own figure.
    """

    instant: int
    source: str
    sigma: float | None
    findings: tuple[Finding, ...] = ()

    @property
    def text(self) -> str:
        """The instant in ISO 8601."""
        return iso(self.instant)


UNKNOWN = 946_684_800 * NANOSECONDS
"""2000-01-01T00:00:00Z: the start of a recording whose start time is unknown, given by --start
unknown."""
_RECORDED = "recording time in the video"
_WHOLE_SECOND = 1 / 12**0.5  # σ of an instant cut to whole seconds
_EARLIEST = (
    315_532_800 * NANOSECONDS
)  # 1980: before it a stamp is an unset clock's (epochs of 1904, 1970 and 1980)


def find_start(
    option: int | None,
    metadata: Mapping[str, str],
    *,
    recorded: str | None,
    zone_name: str | None,
    duration: float,
    where: str,
    chapter: Chapter | None = None,
    stamped: int | None = None,
    gps: tuple[int, float] | None = None,
) -> Start:
    """Finds the start of a recording.

    In order: `option`; `stamped`; `gps`; `com.apple.quicktime.creationdate`, which names its zone
    and means the start; the wall-clock time that AVCHD cameras write into the video itself, with
    their zone or `zone_name`; `creation_time`, which should be UTC (ISO/IEC 14496-12, 8.2.2) and
    the start, but some cameras write local time and some phones the recording's end, and cameras
    that split a recording into chapters stamp them all with its creation time. Neither the file's
    name nor its modification time is used.

    Args:
        recorded: ISO 8601 wall-clock time from within the video stream, with a zone or without.
        zone_name: zone of the camera's clock, for times without one.
        duration: of the file [s].
        stamped: instant of the first frame, where the frames' own stamps state the day and the time
            [UTC ns].
        gps: instant of the first frame by the GPS in the camera's telemetry [UTC ns], and its
            standard uncertainty [s].
        chapter: where the file begins within the recording whose creation time it states; None
            where it is the whole.

    Raises:
        TimeError: nothing usable was found.
    """
    if option == UNKNOWN:
        finding = Finding.of(
            "start-unknown",
            f"nobody knows when the recording began; it is stamped from {iso(UNKNOWN)} on",
            fix="declare its wind (flagdata declare), or give the clock's offset (flagdata align "
            "--by given)",
        )
        return Start(instant=UNKNOWN, source="unknown", sigma=None, findings=(finding,))
    if option is not None:
        return Start(instant=option, source="option", sigma=None)
    if stamped is not None:
        try:
            return _check_start(stamped, "stamps of the frames", 0.0)
        except TimeError as error:
            raise TimeError(
                f"the frames' stamps begin at {error.what}", where=where, fix=error.fix
            ) from None
    default = zone(zone_name, where="zone") if zone_name else None
    if gps is not None:
        return _from_gps(*gps, created=metadata.get("creation_time"), default=default)
    passed_over: list[Finding] = []
    for key, text in (
        ("com.apple.quicktime.creationdate", metadata.get("com.apple.quicktime.creationdate")),
        (_RECORDED, recorded),
        ("creation_time", metadata.get("creation_time")),
    ):
        if not text:
            continue
        try:
            if key == "creation_time":
                start = _from_creation_time(
                    text, default=default, duration=duration, where=where, chapter=chapter
                )
            else:
                start = _check_start(parse(text, default=default, where=where), key, _WHOLE_SECOND)
        except TimeError as error:
            message = f"{key} {text!r} is unusable ({error.what})"
            passed_over.append(Finding.of("start-passed-over", message))
            continue
        return replace(start, findings=(*passed_over, *start.findings))
    tried = "; ".join(finding.what for finding in passed_over) or "its metadata name none"
    raise TimeError(
        f"nothing says when the recording began: {tried}",
        where=where,
        fix="give --start with a zone, e.g. --start 2026-05-01T12:00:00+02:00"
        + (", or --zone, the zone of the camera's clock" if recorded and zone_name is None else ""),
    )


def _from_gps(instant: int, sigma: float, *, created: str | None, default: tzinfo | None) -> Start:
    message = "the start is by the GPS time in the camera's telemetry"
    if created:
        with suppress(TimeError):  # it is not used
            difference = (parse(created, default=default) - instant) / NANOSECONDS
            message += (
                f"; the camera's own clock, creation_time {created}, is {abs(difference):.1f} s "
            )
            message += "ahead" if difference > 0 else "behind"
    finding = Finding.of("start-by-gps", message, value=sigma)
    return Start(instant=instant, source="telemetry: GPS", sigma=sigma, findings=(finding,))


def _from_creation_time(
    text: str, *, default: tzinfo | None, duration: float, where: str, chapter: Chapter | None
) -> Start:
    created = _check_start(parse(text, default=default, where=where), "creation_time", None)
    before = chapter.before if chapter is not None else 0.0
    duration += before
    # Uniform from start to end of the recording, as far as it is known, and over the second it is
    # cut to.
    sigma = (1 / 12 + duration**2 / 12) ** 0.5
    finding = Finding.of(
        "start-unsure",
        f"the start is by creation_time {text}, taken as the start of the recording in the zone it "
        "names; some "
        f"cameras write their local time as UTC, and some write the end (then it is {duration:.1f} "
        "s late)",
        value=sigma,
        fix="give --start with a zone, or align the recording by its contents",
    )
    findings = (finding,) if chapter is None else (finding, chapter.finding)
    return replace(
        created,
        instant=created.instant + round(before * NANOSECONDS),
        sigma=sigma,
        findings=findings,
    )


def _check_start(instant: int, key: str, sigma: float | None) -> Start:
    if instant < _EARLIEST:
        raise TimeError(f"{iso(instant)} looks like a clock that was never set", fix="give --start")
    return Start(instant=instant, source=f"metadata: {key}", sigma=sigma)
