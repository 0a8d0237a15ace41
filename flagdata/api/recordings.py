"""A recording from Python: its wind, its frames, how much they move, and simulated or tracked
meshes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from flagdata.answer.film_series import Motion, Wind
from flagdata.core.arguments import check_arguments
from flagdata.core.arrays import UInt8Array
from flagdata.core.files.addresses import local_path
from flagdata.core.findings import Finding
from flagdata.core.schema import UNUSABLE, Kind
from flagdata.dataset.lake_source import AnyLake, open_source
from flagdata.errors import InputError, NotFoundError
from flagdata.examples import example_of
from flagdata.ingest.films.film import Film
from flagdata.ingest.films.film_array import Frames, collect_frames
from flagdata.ingest.films.named_films import film_at, find_artifact
from flagdata.lake import Lake
from flagdata.lake.mesh_sequences import MeshSequence, RaggedMeshSequence, read_meshes
from flagdata.record.signals import WindSeries
from flagdata.timebase import NANOSECONDS

_BLOWN = (Kind.RECORDING, Kind.WIND)
"""Kinds of artifacts that have a wind."""


@check_arguments
def wind(
    source: Path | str,
    *,
    lake: AnyLake | None = None,
    at: str | None = None,
    sensor: Path | str | None = None,
    zone: str | None = None,
    accept: str | None = None,
) -> Wind:
    """The wind of a log, of an example, or of a recording of a lake.

    ```python
    blown = flagdata.wind("anemometer.csv")
    blown.time, blown.speed  # (n,) s, (n,) m/s
    ```

    Args:
        source: an anemometer's file of any format that `flagdata ingest` reads, `example:NAME`, or
            a recording or log of the lake by its name or id.
        lake: in which the recording is; None for a file.
        at: tag, branch or version of the lake.
        sensor: of a file, a recipe of the catalog by name, or the path of a TOML file, that says
            how it is read.
        zone: of a file's wall-clock stamps, as "+02:00" or "Europe/Berlin".
        accept: hash that confirms how a file without a recipe is read, as the refusal states it.

    Raises:
        NotFoundError: no such file, lake or recording.
        InputError: a file that cannot be read, or a log without wind over ground.
        UnconfirmedError: nobody confirmed how a file without a recipe is read.
        ZoneMissingError: wall-clock stamps whose zone nobody gave.
    """
    from flagdata.core.provenance import file_hash
    from flagdata.ingest.anemometer import WindOptions, read_log
    from flagdata.ingest.anemometer.log_confirmation import Accepting, confirm_readings
    from flagdata.record import Record

    example = example_of(source)
    path = local_path(source) if example is None else example.log
    if path.exists():
        options = WindOptions(recipe=None if sensor is None else str(sensor), zone=zone)
        log = read_log(path, options)
        confirm_readings(path, file_hash(path), [(log, options)], Accepting(accept=accept))
        return _wind(log.series, name=path.name, findings=log.findings)
    held = _lake(source, lake)
    artifact = find_artifact(
        held, str(source), at, kinds=_BLOWN, noun="file, recording or log of the lake"
    )
    series = (
        None if artifact.object is None else Record.open(held.record_place(artifact.object)).wind()
    )
    if series is None:
        raise InputError(
            f"the {artifact.kind} holds no wind",
            where=artifact.name,
            fix="name a recording or a log",
        )
    return _wind(series, name=artifact.name)


@check_arguments
def frames(
    source: Path | str,
    *,
    start: float = 0.0,
    end: float | None = None,
    lake: AnyLake | None = None,
    at: str | None = None,
    true_fps: float | None = None,
    sequence_fps: float | None = None,
) -> Frames:
    """Frames of a film as an array, gray, each with its time.

    ```python
    film = flagdata.frames("flag.mp4", end=2.0)
    film.images, film.time  # (n, height, width) uint8, (n,) s
    ```

    Args:
        source: a video file, a folder of images, `example:NAME`, or a recording, clip or camera of
            the lake.
        start, end: part of the film [s]; None is its end.
        lake: in which the recording is; None for a file.
        at: tag, branch or version of the lake.
        true_fps: rate at which a high-speed camera really ran [Hz].
        sequence_fps: rate of a folder of images [Hz].

    Raises:
        NotFoundError: no such film or lake.
        InputError: a file that is no film, or a part without frames.
        LimitError: more than 4 GiB of frames.
    """
    film = _film(source, lake=lake, at=at, true_fps=true_fps, sequence_fps=sequence_fps)
    return collect_frames(film, first=start, last=end)


@check_arguments
def motion(
    source: Path | str | Frames,
    *,
    start: float = 0.0,
    end: float | None = None,
    lake: AnyLake | None = None,
    at: str | None = None,
) -> Motion:
    """How much a film moves, frame by frame: one number that rises with the wind. Frames are read
    one at a time.

    ```python
    moving = flagdata.motion("flag.mp4")
    moving.time, moving.energy  # (n,) s, (n,) gray levels/s
    ```

    Args:
        source: as for `frames`, or what that returned.
        start, end: part of the film [s]; None is its end.
        lake: in which the recording is; None for a file.
        at: tag, branch or version of the lake.

    Raises:
        NotFoundError: no such film or lake.
        InputError: a file that is no film, or fewer than two frames.
    """
    from flagdata.align.film_motion import motion_energy

    film = source if isinstance(source, Frames) else _film(source, lake=lake, at=at)

    def timed_pictures() -> Iterator[tuple[int, UInt8Array]]:
        for time, image in film.frames(start, film.duration if end is None else end):
            yield round(time * NANOSECONDS), image

    found = motion_energy(timed_pictures())
    return Motion(
        name=film.name,
        time=found.time / NANOSECONDS,
        start=film.start,
        energy=found.energy,
        findings=found.findings,
    )


@check_arguments
def meshes(
    source: Path | str,
    *,
    lake: AnyLake | None = None,
    at: str | None = None,
    rate: float | None = None,
) -> MeshSequence | RaggedMeshSequence:
    """A moving mesh as arrays, of a lake or of a folder of OBJ files.

    ```python
    flag = flagdata.meshes("flag-00000", lake="sim.lake")
    flag.positions, flag.rest  # (frame, vertex, 3) m with z up, (vertex, 2) m
    ```

    Args:
        source: a mesh sequence of the lake by its name or id, or a folder as ArcSim or `flagdata
            export` writes it.
        lake: in which it is; None for a folder.
        at: tag, branch or version of the lake.
        rate: of a folder that does not state its own [Hz].

    Raises:
        NotFoundError: no such folder, lake or sequence.
        InputError: an artifact of another kind, or a folder that holds no meshes.
        CorruptError: its object is damaged.
    """
    path = local_path(source)
    if path.is_dir() and lake is None:
        from flagdata.ingest.meshes import read_folder

        return read_folder(path, rate=rate)
    held = _lake(source, lake)
    artifact = find_artifact(
        held, str(source), at, kinds=(Kind.MESHES,), noun="mesh sequence of the lake"
    )
    return read_meshes(held.whole_object(str(artifact.object)))


def _film(
    source: Path | str,
    *,
    lake: AnyLake | None,
    at: str | None,
    true_fps: float | None = None,
    sequence_fps: float | None = None,
) -> Film:
    held = None if lake is None else open_source(lake).lake
    film, _ = film_at(source, lake=held, at=at, true_fps=true_fps, sequence_fps=sequence_fps)
    return film


def _lake(source: Path | str, lake: AnyLake | None) -> Lake:
    if lake is None:
        raise NotFoundError(
            f"there is no file {str(source)!r}, and no lake was named",
            fix="correct the path, or give lake=",
        )
    return open_source(lake).lake


def _wind(series: WindSeries, *, name: str, findings: tuple[Finding, ...] = ()) -> Wind:
    from flagdata.dataset.truth import over_ground

    speed = over_ground(series)
    if speed is None:
        raise InputError(
            "the log has no wind over ground",
            where=name,
            fix=f"it has {', '.join(series.channels)}; look at them with flagdata ingest --sniff",
        )
    start = int(series.time[0])
    usable = (series.flags & UNUSABLE) == 0
    direction = series.channels.get("wind_direction", np.full(len(series), np.nan))
    return Wind(
        name=name,
        time=(series.time - start) / NANOSECONDS,
        start=start,
        speed=np.where(usable, speed, np.nan),
        direction=np.where(usable, direction, np.nan),
        flags=series.flags,
        channels=series.channels,
        sensor=series.sensor,
        findings=findings,
    )
