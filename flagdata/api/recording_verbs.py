"""What brings recordings into a lake, in Python: files ingested, clocks aligned.

The options of each call are stated in a class, from which the command of the same name inherits.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from flagdata.core.console import LocalPath
from flagdata.core.parts import call
from flagdata.verbs.option_types import DURATION
from flagdata.verbs.shared_options import RECORDING, NamedRecording, OnBranch, OnLake, Rehearsed
from flagdata.verbs.verb_options import argument, make_call, option, options

if TYPE_CHECKING:
    from flagdata.align.methods import ClockOptions
    from flagdata.ingest.artifacts_present import IngestResult

CLOCK = "The clock"


@options
class ByClock(NamedRecording, Rehearsed, OnBranch, OnLake):
    """How a clock model is found, and what the recording that it makes is called."""

    by: str = option(
        "Trust the stamps, take --clock-offset, or estimate it from the flag's motion.",
        default="estimate",
        section=CLOCK,
        type=click.Choice(["stamps", "given", "estimate"]),
    )
    clock_offset: float | None = option(
        "Seconds added to the camera's clock (--by given).",
        default=None,
        section=CLOCK,
        was=("--offset",),
        metavar="S",
    )
    offset_sigma: float | None = option(
        "Its standard uncertainty [s]; by stamps: how well the clocks are known to agree.",
        default=None,
        section=CLOCK,
        metavar="S",
    )
    centre: float | None = option(
        "Offset around which to search [s]; 0 if the stamps are near.",
        default=None,
        section=CLOCK,
        metavar="S",
    )
    search: float | None = option(
        "Search this far either side of it [s]; 120 by default.",
        default=None,
        section=CLOCK,
        metavar="S",
    )
    response: float | None = option(
        "By how much the flag's motion follows the wind at the anemometer [s]; by default 3 m over "
        "the mean wind, "
        "0.3 to 1 s.",
        default=None,
        section=CLOCK,
        metavar="S",
    )
    response_sigma: float | None = option(
        "Its uncertainty [s]; by default half of it, 0.3 at most, or 0.15 beside --response.",
        default=None,
        section=CLOCK,
        metavar="S",
    )
    max_sigma: float | None = option(
        "Refuse an offset with a larger standard uncertainty [s]; 0.5 by default.",
        default=None,
        section=CLOCK,
        metavar="S",
    )
    window: float | None = option(
        "Average the wind over this long before a clip's end for its ground truth [s], e.g. 10s or "
        "2min; 60s by "
        "default.",
        default=None,
        section=RECORDING,
        type=DURATION,
        metavar="TIME",
    )

    def clock(self) -> ClockOptions:
        """Returns how to come by the clock model.

        Raises:
            UsageError: what the method needs is missing, or something it has no use for was given.
        """
        from flagdata.align.lag import LagSearch
        from flagdata.align.methods import ClockOptions, Method

        usual = LagSearch()
        search = LagSearch(
            centre=usual.centre if self.centre is None else self.centre,
            window=usual.window if self.search is None else self.search,
            sigma=usual.sigma if self.max_sigma is None else self.max_sigma,
        )
        return ClockOptions(
            by=Method(self.by),
            offset=self.clock_offset,
            offset_sigma=self.offset_sigma,
            search=None if search == usual else search,
            response=self.response,
            response_sigma=self.response_sigma,
        )


@options
class Aligning(ByClock):
    """Which camera and wind, or which two logs, are put on one clock."""

    first: str = argument(
        "A camera of the lake by its name or id, or the wind on whose clock both are put.",
        "CAMERA|REFERENCE",
    )
    second: str = argument("A wind of the lake by its name or id.", "WIND|SENSOR")


@make_call(Aligning)
def align(chosen: Aligning) -> Mapping[str, Any]:
    """Puts a camera and an anemometer of a lake, or two anemometers, on one clock, as `flagdata
    align` does.

    ```python
    aligned = flagdata.align(
        "flag", "anemometer", lake="field.lake", by="given", clock_offset=-0.4, offset_sigma=0.1
    )
    aligned["recording"], aligned["clock"]["offset"]  # id, s
    ```

    Returns:
        What `flagdata align --json` prints: of a film `recording`, `clips`, `created` and `clock`,
            of two logs `wind`
        in place of the former two.

    Raises:
        InputError: no wind while the film was taken.
        NotFoundError: no such lake.
        RefusedError: an estimate that is not certain; nothing is committed.
        UnknownNameError: no such camera or wind.
        UsageError: options that contradict each other.
    """
    return call("flagdata.commands.align:align_pair", chosen).content


@options
class Realigning(ByClock):
    """Which recording is written anew."""

    recording: str = argument("A recording of the lake by its name or id.", "RECORDING")


@make_call(Realigning)
def realign(chosen: Realigning) -> Mapping[str, Any]:
    """Writes a recording anew with another clock model, from the same artifacts, as `flagdata
    realign` does.

    ```python
    flagdata.realign("flag", lake="field.lake", by="given", clock_offset=-0.35, offset_sigma=0.05)
    ```

    Returns:
        What `flagdata realign --json` prints.

    Raises:
        NotFoundError: no such lake.
        RefusedError: an estimate that is not certain; nothing is committed.
        UnknownNameError: no such recording.
        UsageError: options that contradict each other.
    """
    return call("flagdata.commands.align:realign_recording", chosen).content


SOURCE, CAMERA, ANEMOMETER = "What the source is", "Camera", "Anemometer"


@options
class Recorded(OnBranch, OnLake):
    """What is brought into a lake, and what it is called."""

    sources: Path | str | Sequence[Path | str] = argument(
        "Files or folders, one or several: a camera's, an anemometer's, meshes, markers, or "
        "records of flagdata.",
        "SOURCE...",
    )
    session: str | None = option(
        "One set-up at one place; its clips are always on the same side of a split.",
        default=None,
        section=SOURCE,
        metavar="NAME",
    )
    name: str | None = option(
        "What people call the artifact; the file's name by default.", default=None, section=SOURCE
    )


@options
class Clocked(Recorded):
    """What a camera's file and an anemometer's do not say of themselves."""

    topic: str | None = option(
        "MCAP of other programs: the topic of pictures or numbers to read. LeRobot: the camera.",
        default=None,
        section=SOURCE,
        metavar="NAME",
    )
    start: str | None = option(
        "Camera: instant of the first frame, ISO 8601. Wind: of the first row, where stamps count "
        "from a start.",
        default=None,
        section=SOURCE,
        metavar="TIME",
    )
    zone: str | None = option(
        "Zone of a clock that does not say: Europe/Amsterdam, +02:00, UTC.",
        default=None,
        section=SOURCE,
        metavar="ZONE",
    )
    rate: str | None = option(
        "Camera: frames per second to keep, 25 by default; native keeps all. Meshes, markers: "
        "frames per second of a "
        "source that does not state them. Wind: readings per second of a log without timestamps, "
        "counted from --start. "
        "Also the time from one to the next, as in 10min.",
        default=None,
        section=SOURCE,
        metavar="HZ|STEP|native",
    )


@options
class FromCamera(Clocked):
    """How a camera's file is read."""

    episode: int | None = option(
        "LeRobot: the episode to read.",
        default=None,
        section=CAMERA,
        type=click.IntRange(min=0),
        metavar="N",
    )
    join: bool = option(
        "The SOURCEs are the chapters of one recording, which become one artifact.",
        default=False,
        section=CAMERA,
    )
    stream: int | None = option(
        "Number of the video stream in its file; the first by default.",
        default=None,
        section=CAMERA,
        type=click.IntRange(min=0),
        metavar="N",
    )
    true_fps: float | None = option(
        "Rate at which a high-speed camera really ran [Hz].",
        default=None,
        section=CAMERA,
        metavar="HZ",
    )
    sequence_fps: float | None = option(
        "Rate of pictures that carry no time stamps [Hz].",
        default=None,
        section=CAMERA,
        metavar="HZ",
    )
    crop: str = option(
        "x,y,width,height in px of the upright image; whole, square, or auto (where the motion "
        "is).",
        default="whole",
        section=CAMERA,
        metavar="BOX",
    )
    crop_picture: Path | None = option(
        "Write the picture that shows --crop auto.",
        default=None,
        section=CAMERA,
        type=LocalPath(dir_okay=False),
        metavar="PATH",
    )
    exposure: float | None = option(
        "Exposure time [s], to stamp mid-exposure.", default=None, section=CAMERA, metavar="S"
    )
    archive: str = option(
        "How frames are stored; h264 is smaller and slower to reach.",
        default="jpeg",
        section=CAMERA,
        type=click.Choice(["jpeg", "h264"]),
    )


@options
class Scaled(Recorded):
    """What a log, meshes and markers do not say of their numbers."""

    unit: str | None = option(
        "Wind: unit of a speed whose heading has none (m/s, km/h, mph, kn). Meshes, markers: of "
        "positions, else m.",
        default=None,
        section=SOURCE,
        metavar="UNIT",
    )


@options
class FromAnemometer(Clocked, Scaled):
    """How an anemometer's log is read."""

    sensor: str | None = option(
        "A recipe of catalogs/sensors, or a TOML file.",
        "--sensor",
        "--recipe",
        default=None,
        section=ANEMOMETER,
        metavar="RECIPE",
    )
    columns: str | None = option(
        "What the columns of a table are, in their order or by heading or number, such as "
        "'date,time,wind_speed[km/h],,wind_direction[deg]' or '1=time,7=wind_speed[kn]'. Names: "
        "time, date, year, "
        "month, day, day_of_year, hour, minute, second, wind_speed, wind_direction, "
        "wind_direction_to, wind_x, wind_y, "
        "wind_z, apparent_wind_speed, apparent_wind_direction, air_temperature, relative_humidity, "
        "air_pressure, site. "
        "What is measured has its unit in brackets. A name that is not known is refused with the "
        "list of all.",
        default=None,
        section=ANEMOMETER,
        metavar="LIST",
    )
    wind: str | None = option(
        "The one anemometer to read of a table that holds several, or the column of its speed.",
        default=None,
        section=ANEMOMETER,
        metavar="LABEL",
    )
    missing: tuple[str, ...] = option(
        "A cell that means no value, such as -99.9; repeatable.",
        default=(),
        section=ANEMOMETER,
        metavar="TEXT",
    )
    date: str | None = option(
        "Day of the first sample, where the log has times of day only.",
        default=None,
        section=ANEMOMETER,
        metavar="YYYY-MM-DD",
    )
    date_order: str | None = option(
        "Order in dates of numbers only.",
        default=None,
        section=ANEMOMETER,
        type=click.Choice(["dmy", "mdy", "ymd"]),
    )
    platform: str | None = option(
        "fixed, as on a mast; moving, as on a boat; corrected, if a moving one logs the wind over "
        "ground.",
        default=None,
        section=ANEMOMETER,
        type=click.Choice(["fixed", "moving", "corrected"]),
    )
    talker: str | None = option(
        "NMEA 0183 talker to read, where several share a stream.",
        default=None,
        section=ANEMOMETER,
        metavar="ID",
    )
    azimuth: float | None = option(
        "Bearing of the sensor's north or bow, clockwise from north [°].",
        default=None,
        section=ANEMOMETER,
        metavar="DEG",
    )
    clock: str | None = option(
        "The clock was changed during the log: first = the time before the change is right, last = "
        "the time after it; "
        "sort = the clock is right, only sort the rows.",
        default=None,
        section=ANEMOMETER,
        type=click.Choice(["first", "last", "sort"]),
    )
    zero_offset: str | None = option(
        "Speed to subtract [m/s]; report, or estimate from idle stretches.",
        default=None,
        section=ANEMOMETER,
        metavar="M/S",
    )
    encoding: str | None = option(
        "Encoding of the text, where the file does not show it.",
        default=None,
        section=ANEMOMETER,
        metavar="CODEC",
    )
    expect: tuple[str, ...] = option(
        "A check of a draft that you have answered with yes, by the key that the refusal names; "
        "repeatable.",
        default=(),
        section=ANEMOMETER,
        metavar="KEY",
    )
    accept: str | None = option(
        "Confirms what was drafted from a table that no recipe describes, by the hash that the "
        "refusal shows.",
        default=None,
        section=ANEMOMETER,
        metavar="HASH",
    )


@options
class FromFrames(Scaled):
    """How meshes and tables of markers are read."""

    rate: str | None = option(
        "Frames per second of a source that does not state them, or the time from one to the next, "
        "as in 40ms.",
        default=None,
        section=SOURCE,
        metavar="HZ|STEP",
    )


@options
class Ingesting(FromCamera, FromAnemometer):
    """How sources of any kind are read."""

    format: str | None = option(
        "camera, meshes, markers, or an anemometer format; by content if not given.",
        "--as",
        "--format",
        default=None,
        section=SOURCE,
        metavar="FORMAT",
    )


@make_call(Ingesting)
def ingest(chosen: Ingesting) -> tuple[IngestResult, ...]:
    """Brings camera files, anemometer logs, mesh sequences and marker tables into a lake, as
    `flagdata ingest` does.

    ```python
    film, wind = flagdata.ingest(
        ["flag.mp4", "anemometer.csv"], lake="field.lake", session="monday"
    )
    film.artifact.id, wind.report["samples"]
    ```

    Returns:
        For each artifact what it is, whether it was new, and the report. A source that fails ends
            it; those before it
        are in the lake.

    Raises:
        ConflictError: a file changed while it was read, or is in the lake under other names.
        InputError: a file that cannot be read, with what to do.
        NotFoundError: no such file or lake.
        UnconfirmedError: nobody confirmed how a table without a recipe is read.
        UsageError: an option that means nothing for any of the sources.
        ZoneMissingError: wall-clock stamps whose zone nobody gave.
    """
    return call("flagdata.commands.ingest_sources:ingest_from_python", chosen)
