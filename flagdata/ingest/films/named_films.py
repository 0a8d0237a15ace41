"""Films by what names them: a video file, a folder of images, an example, or an artifact of a
lake."""

from __future__ import annotations

from pathlib import Path

from flagdata.core.printable import SHORT
from flagdata.core.schema import Kind
from flagdata.errors import InputError, UnknownNameError, UsageError
from flagdata.examples import check_without_lake, path_of
from flagdata.ingest.films.film import CameraFilm, RecordFilm
from flagdata.lake import Artifact, Lake
from flagdata.lake.naming import COLUMNS, meant

FILMED = (Kind.RECORDING, Kind.CLIP, Kind.CAMERA)
"""Kinds of artifacts that have frames."""


def film_at(
    source: Path | str,
    *,
    lake: Lake | None,
    at: str | None,
    true_fps: float | None,
    sequence_fps: float | None,
) -> tuple[CameraFilm, Path] | tuple[RecordFilm, Artifact]:
    """Opens the film that a source names, with its path or its artifact.

    Args:
        source: a path, `example:NAME`, or the name, id or beginning of the id of an artifact.
        lake: where artifacts are; None if no lake was named.
        at: tag, branch or version to look at.
        true_fps, sequence_fps: of files only, see `CameraFilm`.

    Raises:
        NotFoundError: nothing of that name.
        UsageError: options of files for artifacts.
        FlagdataError: a file that is no film.
    """
    path = path_of(source)
    if lake is None:
        check_without_lake(source)
    if lake is None or path.exists():
        return CameraFilm(path, true_fps=true_fps, sequence_fps=sequence_fps), path
    if true_fps is not None or sequence_fps is not None:
        raise frames_have_instants()
    artifact = find_artifact(lake, str(source), at)
    return stored_film(lake, artifact), artifact


def frames_have_instants() -> UsageError:
    """Returns the error of options of files that are given for films of a lake."""
    return UsageError(
        "the frames of a lake have their instants",
        where="--true-fps, --sequence-fps",
        fix="leave the options out; they belong to ingest",
    )


def find_artifact(
    lake: Lake,
    source: str,
    at: str | None,
    *,
    kinds: tuple[Kind, ...] = FILMED,
    noun: str = "file or film of the lake",
) -> Artifact:
    """Finds the artifact of a name or id; of a recording and what it was aligned from, which has
    its name, the recording.

    Args:
        kinds: that are meant; a clip by its id alone.
        noun: what they are called.

    Raises:
        UnknownNameError: none of that name.
        UsageError: several.
    """
    rows = lake.rows({"kind": kinds}, at=at, columns=COLUMNS).to_pylist()
    rows_meant = meant(rows, source)
    if not rows_meant:
        raise UnknownNameError.of(noun, source, {row["name"] for row in rows})
    if len(rows_meant) > 1:
        several = ", ".join(f"{row['kind']} {row['artifact'][:SHORT]}" for row in rows_meant[:4])
        message = f"{source!r} names {len(rows_meant)} of the lake: {several}"
        raise UsageError(message, where="SOURCE", fix="give the id of one")
    return lake.artifact(rows_meant[0]["artifact"], at=at)


def stored_film(lake: Lake, artifact: Artifact) -> RecordFilm:
    """Opens the frames of an artifact.

    Raises:
        InputError: it has none of its own.
        CorruptError: its object is damaged.
    """
    if artifact.object is None:
        raise InputError(
            f"the {artifact.kind} has no frames of its own",
            where=artifact.name,
            fix="name its recording",
        )
    clip = artifact.kind is Kind.CLIP
    return RecordFilm(
        lake.record_place(artifact.object),
        name=artifact.name,
        first=(artifact.frame_first or 0) if clip else 0,
        count=artifact.frame_count if clip else None,
    )
