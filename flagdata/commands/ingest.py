"""`flagdata ingest`: camera files, anemometer logs, meshes and markers into the lake, or a look at what a file is."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self, TypeVar

import click
from click.core import ParameterSource

from flagdata.commands.ingest_report import print_results, print_sniffed
from flagdata.console import document, fail, json_option, lake_option, progress, say
from flagdata.errors import FlagdataError, InputError, TimeError, UsageError

if TYPE_CHECKING:
    from flagdata.ingest.anemometer import Guess
    from flagdata.ingest.markers import MarkerOptions
    from flagdata.ingest.meshes.store import MeshIngest
    from flagdata.ingest.store import CameraIngest, IngestResult, Labels, WindIngest
    from flagdata.lake import Lake

Told = TypeVar("Told")
Done = TypeVar("Done")

# Parameters that mean something for one kind of source only, those of --sniff, and those that name or time one source.
CAMERA_ONLY = ("start", "true_fps", "sequence_fps", "crop", "crop_picture", "exposure", "archive")
WIND_ONLY = ("sensor", "date", "date_order", "platform", "talker", "azimuth", "zero_offset", "encoding")
LENGTHS = ("unit",)
"""Of meshes and markers."""
FOREIGN = {
    "camera": ("a camera file", (*WIND_ONLY, *LENGTHS)),
    "anemometer": ("an anemometer log", (*CAMERA_ONLY, *LENGTHS, "rate")),
    "meshes": ("a mesh sequence", (*CAMERA_ONLY, *WIND_ONLY, "zone")),
    "markers": ("a marker table", (*CAMERA_ONLY, *WIND_ONLY, "zone")),
}
"""What each kind of source is called, and the options that mean nothing for it."""
SNIFF = ("sources", "sniff", "start", "zone", "true_fps", "sequence_fps", "crop", "crop_picture")
ONE_SOURCE = ("start", "date", "name", "crop_picture")


@dataclass(frozen=True, kw_only=True)
class _Given:
    """The command line, read."""

    camera: CameraIngest
    wind: WindIngest
    meshes: MeshIngest
    markers: MarkerOptions
    labels: Labels
    branch: str
    crop_picture: Path | None
    zoned_start: bool


@click.command()
@click.argument("sources", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="SOURCE...")
@click.option("--sniff", is_flag=True, help="Only say what each source seems to be, and why; the lake is not touched.")
@click.option(
    "--as",
    "--format",
    "format_name",
    metavar="FORMAT",
    help="camera, meshes, markers, or an anemometer format; by content if not given.",
)
@click.option("--session", metavar="NAME", help="One set-up at one place; splits never cut through it.")
@click.option("--name", help="What people call the artifact; the file's name by default.")
@click.option("--zone", metavar="ZONE", help="Zone of a clock that does not say: Europe/Amsterdam, +02:00, UTC.")
@click.option("--branch", default="main", show_default=True, help="The line of work to commit on.")
@click.option("--start", metavar="TIME", help="Camera: instant of the first frame, ISO 8601.")
@click.option("--true-fps", type=float, metavar="HZ", help="Camera: rate at which a high-speed camera really ran.")
@click.option("--sequence-fps", type=float, metavar="HZ", help="Camera: rate of pictures that carry no time stamps.")
@click.option(
    "--rate", default="25", show_default=True, metavar="HZ|native",
    help="Camera: frames a second to keep. Meshes, markers: frames a second there are, by default as the source says.",
)  # fmt: skip
@click.option(
    "--crop", default="whole", show_default=True, metavar="BOX",
    help="Camera: x,y,width,height in px of the upright image; whole, square, or auto (where the motion is).",
)  # fmt: skip
@click.option(
    "--crop-picture", type=click.Path(path_type=Path, dir_okay=False), metavar="PATH",
    help="Camera: write the picture that shows --crop auto.",
)  # fmt: skip
@click.option("--exposure", type=float, metavar="S", help="Camera: exposure time, to stamp mid-exposure.")
@click.option(
    "--archive", type=click.Choice(["jpeg", "h264"]), default="jpeg", show_default=True,
    help="Camera: how frames are stored; h264 is smaller and slower to reach.",
)  # fmt: skip
@click.option(
    "--sensor", "--recipe", "sensor", metavar="RECIPE", help="Wind: a recipe of catalogs/sensors, or a TOML file."
)
@click.option(
    "--date", metavar="YYYY-MM-DD", help="Wind: day of the first sample, where the log has times of day only."
)
@click.option("--date-order", type=click.Choice(["dmy", "mdy"]), help="Wind: of dates written with numbers only.")
@click.option("--platform", type=click.Choice(["fixed", "moving"]), help="Wind: a mast, or a boat or vehicle.")
@click.option("--talker", metavar="ID", help="Wind: of NMEA 0183, where several instruments share a stream.")
@click.option(
    "--azimuth", type=float, metavar="DEG", help="Wind: of the sensor's north or bow, clockwise from true north."
)
@click.option("--zero-offset", metavar="M/S", help="Wind: speed to subtract; report, or estimate from idle stretches.")
@click.option("--encoding", metavar="CODEC", help="Wind: of the text, where it cannot be told.")
@click.option("--unit", default="m", show_default=True, metavar="UNIT", help="Meshes, markers: of positions in space.")
@json_option
@lake_option
@click.pass_context
def ingest(
    context: click.Context,
    sources: tuple[Path, ...],
    sniff: bool,
    format_name: str | None,
    session: str | None,
    name: str | None,
    zone: str | None,
    branch: str,
    start: str | None,
    true_fps: float | None,
    sequence_fps: float | None,
    rate: str,
    crop: str,
    crop_picture: Path | None,
    exposure: float | None,
    archive: str,
    sensor: str | None,
    date: str | None,
    date_order: str | None,
    platform: str | None,
    talker: str | None,
    azimuth: float | None,
    zero_offset: str | None,
    encoding: str | None,
    unit: str,
    as_json: bool,
    lake_path: str,
) -> None:
    """Bring camera files, anemometer logs, mesh sequences and marker tables in.

    Whether a SOURCE is a camera's, an anemometer's, a folder of meshes or a table of markers is decided by its content,
    and an option goes to the sources of its kind. Each is one commit: what fails leaves the lake as it was, and the
    others go on.

    \b
      flagdata ingest --sniff DSC_0001.MP4 TOA5_1234.dat
      flagdata ingest DSC_0001.MP4 --start 2026-05-01T12:00:00+02:00 --crop auto --crop-picture crop.png
      flagdata ingest mast.csv --sensor generic-csv --zone +01:00 --session field-1
      flagdata ingest arcsim-output --name reference-4ms
    """
    from flagdata.timebase import names_zone

    given = frozenset(
        parameter for parameter in context.params
        if context.get_parameter_source(parameter) is ParameterSource.COMMANDLINE
    )  # fmt: skip
    if crop_picture is not None and crop.strip().lower() != "auto":
        raise UsageError("--crop-picture without --crop auto", where=str(crop_picture), fix="add --crop auto")
    if crop_picture is not None and crop_picture.exists():
        raise UsageError("the crop picture exists", where=str(crop_picture), fix="choose another path")
    options = _Given(
        camera=_camera_options(
            start=start, zone_name=zone, true_fps=true_fps, sequence_fps=sequence_fps, rate=rate, crop=crop,
            exposure=exposure, archive=archive,
        ),
        wind=_wind_options(
            format_name=None if format_name in ("camera", "meshes", "markers") else format_name, sensor=sensor,
            zone_name=zone, date=date, date_order=date_order, platform=platform, talker=talker, azimuth=azimuth,
            zero_offset=zero_offset, encoding=encoding,
        ),
        meshes=_mesh_options(rate=rate if "rate" in given else None, length=unit),
        markers=_marker_options(rate=rate if "rate" in given else None, length=unit),
        labels=_labels(name, session),
        branch=branch,
        crop_picture=crop_picture,
        zoned_start=start is not None and names_zone(start),
    )  # fmt: skip
    if sniff:
        for parameter in sorted(given - {*SNIFF, "as_json", "lake_path"}):
            raise UsageError(f"{_option(parameter)} means nothing to --sniff", fix="leave it out")
        _sniff(sources, options, given=given, as_json=as_json)
        return
    from flagdata.lake import Lake

    _ingest(Lake.open(lake_path), sources, options, given=given, format_name=format_name, as_json=as_json)


def _option(parameter: str) -> str:
    return "--as" if parameter == "format_name" else f"--{parameter.replace('_', '-')}"


def _camera_options(
    *,
    start: str | None,
    zone_name: str | None,
    true_fps: float | None,
    sequence_fps: float | None,
    rate: str,
    crop: str,
    exposure: float | None,
    archive: str,
) -> CameraIngest:
    from flagdata import timebase
    from flagdata.ingest.camera import CameraOptions, parse_crop
    from flagdata.ingest.store import CameraIngest
    from flagdata.record import Coding

    try:
        place = timebase.zone(zone_name, where="--zone") if zone_name is not None else None
        instant = timebase.parse(start, default=place, where="--start") if start is not None else None
    except TimeError as error:
        raise UsageError(error.what, where=error.where, fix=error.fix) from None
    options = CameraOptions(
        start=instant,
        zone=None if start is not None and timebase.names_zone(start) else zone_name,
        true_fps=true_fps,
        sequence_fps=sequence_fps,
        rate="native" if rate.strip().lower() == "native" else _number(rate, "--rate", "a rate in Hz, or native"),
        crop=parse_crop(crop),
        exposure=exposure,
    )
    return CameraIngest(camera=options, coding=Coding(archive))


def _wind_options(
    *,
    format_name: str | None,
    sensor: str | None,
    zone_name: str | None,
    date: str | None,
    date_order: Any,
    platform: Any,
    talker: str | None,
    azimuth: float | None,
    zero_offset: str | None,
    encoding: str | None,
) -> WindIngest:
    import datetime as dt

    from flagdata.ingest.anemometer import WindOptions
    from flagdata.ingest.store import WindIngest
    from flagdata.units import unit

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
            azimuth=float(unit("deg").to_si(azimuth)) if azimuth is not None else None,
            zero_offset=offset,
        )
    )


def _mesh_options(*, rate: str | None, length: str) -> MeshIngest:
    from flagdata.ingest.meshes.store import MeshIngest

    if rate is None or rate.strip().lower() == "native":
        return MeshIngest(unit=length)
    return MeshIngest(rate=_number(rate, "--rate", "frames a second"), unit=length)


def _marker_options(*, rate: str | None, length: str) -> MarkerOptions:
    from flagdata.ingest.markers import MarkerOptions

    if rate is None or rate.strip().lower() == "native":
        return MarkerOptions(unit=length)
    return MarkerOptions(rate=_number(rate, "--rate", "frames a second"), unit=length)


def _number(text: str, option: str, wanted: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise UsageError(f"{text!r} is not a number", where=option, fix=f"give {wanted}") from None


def _labels(name: str | None, session: str | None) -> Labels:
    from flagdata.ingest.store import Labels

    return Labels(name=name, session=session)


def _ingest(
    lake: Lake,
    sources: Sequence[Path],
    options: _Given,
    *,
    given: frozenset[str],
    format_name: str | None,
    as_json: bool,
) -> None:
    from flagdata.ingest.classify import classify

    recipe = options.wind.wind.recipe
    kinds = _told(sources, lambda source: classify(source, format_name=format_name, recipe=recipe))
    _check_applies([None if isinstance(kind, FlagdataError) else kind.kind for kind in kinds], options, given=given)
    results, failures = _each(
        sources, kinds, lambda source, kind: _one(lake, source, kind, options), print_results, as_json=as_json
    )
    if as_json:
        document(
            "ingest",
            {
                "lake": str(lake.path),
                "results": [result.as_dict() for of_source in results for result in of_source],
                "failures": _failures(failures),
            },
        )
    _exit_on(failures, sources)


def _told(sources: Sequence[Path], tell: Callable[[Path], Told]) -> list[Told | FlagdataError]:
    """What each source is, or why that cannot be told."""

    def told(source: Path) -> Told | FlagdataError:
        try:
            return tell(source)
        except FlagdataError as error:
            return error

    return [told(source) for source in sources]


def _each(
    sources: Sequence[Path],
    told: Sequence[Told | FlagdataError],
    act: Callable[[Path, Told], Done],
    show: Callable[[Done], None],
    *,
    as_json: bool,
) -> tuple[list[Done], list[tuple[Path, FlagdataError]]]:
    """Act on every source in turn and show it; one that fails leaves the others to go on, unless it is the only one."""
    results: list[Done] = []
    failures: list[tuple[Path, FlagdataError]] = []
    for source, found in zip(sources, told, strict=True):
        try:
            if isinstance(found, FlagdataError):
                raise found
            result = act(source, found)
        except FlagdataError as error:
            if len(sources) == 1:
                raise
            failures.append((source, error))
            if not as_json:
                fail(error, as_json=False)
            continue
        results.append(result)
        if not as_json:
            show(result)
    return results, failures


def _failures(failures: Sequence[tuple[Path, FlagdataError]]) -> list[dict[str, str | None]]:
    return [{"source": str(source), **error.as_dict()} for source, error in failures]


def _exit_on(failures: Sequence[tuple[Path, FlagdataError]], sources: Sequence[Path]) -> None:
    """Exit with 1, naming what failed, if anything did."""
    if failures:
        say(f"flagdata: {len(failures)} of {len(sources)} sources failed: {', '.join(str(s) for s, _ in failures)}")
        sys.exit(1)


def _check_applies(kinds: Sequence[str | None], options: _Given, *, given: frozenset[str]) -> None:
    """Refuse options that mean nothing for any source, or that time or name more than one, before anything is written.

    Args:
        kinds: of the sources; one that could not be told may be any.
    """
    foreign = dict(FOREIGN)
    if options.zoned_start:
        what, parameters = foreign["camera"]
        foreign["camera"] = (f"{what} whose --start names its zone", (*parameters, "zone"))
    for parameter in sorted(given):
        strange = [kind in foreign and parameter in foreign[kind][1] for kind in kinds]
        if all(strange):
            whose = " or ".join(sorted({foreign[kind][0] for kind in kinds if kind is not None}))
            raise UsageError(f"{_option(parameter)} means nothing for {whose}", fix="leave it out")
        if parameter in ONE_SOURCE and strange.count(False) > 1:
            raise UsageError(
                f"{_option(parameter)} with {strange.count(False)} sources",
                fix="ingest the source it belongs to by itself",
            )


def _one(lake: Lake, source: Path, kind: Guess, options: _Given) -> tuple[IngestResult, ...]:
    """Artifacts of a source: of a table of markers one a recording, of any other one."""
    from flagdata.ingest.markers.store import ingest_markers
    from flagdata.ingest.store import ingest_camera, ingest_wind

    if kind.kind == "markers":
        return ingest_markers(
            lake, source, options.markers, labels=options.labels, branch=options.branch, reasons=kind.reasons
        )
    if kind.kind == "meshes":
        return (_meshes(lake, source, kind, options),)
    if kind.kind != "camera":
        return (ingest_wind(lake, source, options.wind, labels=options.labels, branch=options.branch),)
    with progress(None, label=source.name, unit="frame") as advance, _CropPicture(options.crop_picture) as picture:
        result = ingest_camera(
            lake, source, options.camera, labels=options.labels, branch=options.branch, reasons=kind.reasons,
            progress=advance, crop_picture=picture.write if options.crop_picture else None,
        )  # fmt: skip
    return (result,)


def _meshes(lake: Lake, source: Path, kind: Guess, options: _Given) -> IngestResult:
    from flagdata.ingest.meshes.store import ingest_meshes

    with progress(None, label=source.name, unit="mesh") as advance:
        return ingest_meshes(
            lake, source, options.meshes, labels=options.labels, branch=options.branch, reasons=kind.reasons,
            progress=advance,
        )  # fmt: skip


class _CropPicture:
    """The file of --crop-picture; one that was written is removed when the block fails.

    Args:
        path: nothing is there yet; `None` where no picture was asked for.
    """

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self._written = False

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is not None and self._written and self._path is not None:
            self._path.unlink(missing_ok=True)

    def write(self, data: bytes) -> None:
        """Write the picture.

        Raises:
            InputError: the disk refuses it.
        """
        if self._path is None:
            return
        try:
            with self._path.open("xb") as stream:
                self._written = True
                stream.write(data)
        except OSError as error:
            raise InputError(
                f"the crop picture cannot be written: {error.strerror}", where=str(self._path),
                fix="choose another path",
            ) from None  # fmt: skip


def _sniff(sources: Sequence[Path], options: _Given, *, given: frozenset[str], as_json: bool) -> None:
    from flagdata.ingest.classify import guesses

    ranked = _told(sources, guesses)
    _check_applies([None if isinstance(r, FlagdataError) else r[0].kind for r in ranked], options, given=given)
    entries, failures = _each(
        sources, ranked, lambda source, found: _look(source, found, options), print_sniffed, as_json=as_json
    )
    if as_json:
        document("sniff", {"sources": entries, "failures": _failures(failures)})
    _exit_on(failures, sources)


def _look(source: Path, ranked: Sequence[Guess], options: _Given) -> dict[str, Any]:
    """Guesses at a source; of a camera file, what its headers say and the crop if one was asked for."""
    from flagdata.ingest.camera import probe, propose_crop

    entry: dict[str, Any] = {"source": str(source), "guesses": [_guess(guess) for guess in ranked]}
    if ranked[0].kind != "camera":
        return entry
    try:
        entry["camera"] = probe(source, options.camera.camera).as_dict()
    except FlagdataError as error:
        entry["problem"] = error.as_dict()
        return entry
    if options.camera.camera.crop == "auto":
        proposal = propose_crop(source, options.camera.camera)
        entry["crop"] = {"box": list(proposal.box.as_tuple()), "share": proposal.share}
        with _CropPicture(options.crop_picture) as picture:
            picture.write(proposal.picture)
    return entry


def _guess(guess: Guess) -> dict[str, Any]:
    return {
        "kind": guess.kind,
        "format": guess.format,
        "recipe": guess.recipe,
        "score": guess.score,
        "reasons": list(guess.reasons),
        "fix": guess.fix,
        "draft": guess.draft,
    }
