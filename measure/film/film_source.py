"""What SOURCE names: a video file or folder of images, an artifact of a lake, or the clips of a
query."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flagdata.answer.circumstances import Circumstances
from flagdata.core.provenance import file_hash
from flagdata.core.schema import Kind
from flagdata.errors import NotFoundError, UsageError
from flagdata.examples import Example, example_of
from flagdata.ingest.camera import CropBox, parse_crop
from flagdata.ingest.films.film import RecordFilm
from flagdata.ingest.films.named_films import film_at, frames_have_instants, stored_film
from flagdata.lake import Artifact, Lake
from flagdata.lake.matching import matching
from flagdata.record import Record
from flagdata.verbs.shared_options import OfCloth, OfFilm
from measure.film.conditioned_film import ConditionedFilm, WholeFilm
from measure.film.similarity import FlagSize


@dataclass(frozen=True, kw_only=True)
class FilmReading:
    """How a source is read.

    Attributes:
        crop: region in which the flag is; None for the whole picture.
        flag: its number among the moving cloths, from 1; None for the first.
        aspect: length over height of the flag as it was given, which its outline is compared with.
        true_fps: rate at which a high-speed camera really ran [Hz]; of files only.
        sequence_fps: rate of images without stamps [Hz]; of files only.
    """

    crop: CropBox | None = None
    flag: int | None = None
    aspect: float | None = None
    true_fps: float | None = None
    sequence_fps: float | None = None

    @classmethod
    def of(cls, chosen: OfCloth, size: FlagSize | None) -> FilmReading:
        """Returns what the options of a verb say of a film, whose flag is of such a size.

        Raises:
            UsageError: a region that is not x,y,width,height.
        """
        rates = (
            {"true_fps": chosen.true_fps, "sequence_fps": chosen.sequence_fps}
            if isinstance(chosen, OfFilm)
            else {}
        )
        return cls(
            crop=box_of(chosen.crop),
            flag=chosen.flag,
            aspect=None if size is None else size.aspect,
            **rates,
        )

    def conditioned(self, film: WholeFilm) -> ConditionedFilm:
        """Makes a film fit."""
        return ConditionedFilm(film, crop=self.crop, flag=self.flag, aspect=self.aspect)

    def recipe(self) -> dict[str, Any]:
        """Returns JSON values."""
        crop = None if self.crop is None else str(self.crop)
        return {
            "crop": crop,
            "flag": self.flag,
            "true_fps": self.true_fps,
            "sequence_fps": self.sequence_fps,
        }


@dataclass(frozen=True, kw_only=True, eq=False)
class Subject:
    """A film and where it is from.

    Attributes:
        film: its frames, made fit.
        artifact: of the lake; None of a plain file.
        path: of the plain file or folder; None of an artifact.
        record: the artifact's record, which may hold wind and truth.
        example: that the film belongs to; None of any other.
    """

    film: ConditionedFilm
    artifact: Artifact | None = None
    path: Path | None = None
    record: Record | None = None
    example: Example | None = None

    @property
    def recording(self) -> str | None:
        """Id of the recording that the film is, or is a part of; None of a plain file."""
        return None if self.artifact is None else self.artifact.recording or self.artifact.id

    @property
    def known(self) -> Mapping[str, float] | None:
        """What a simulated record or an example states of itself."""
        if self.example is not None:
            return self.example.truth
        return None if self.record is None else self.record.truth

    @property
    def identity(self) -> str:
        """Id of the artifact, or the content hash of a plain file."""
        return str(self.content_hash()) if self.artifact is None else self.artifact.id

    def circumstances(self, lake: Lake | None) -> Circumstances:
        """Returns when, where and with what it was recorded.

        Args:
            lake: of its artifact, whose parents state the zone of their clocks; None for none.
        """
        wind = None if self.record is None else self.record.wind()
        row = self.artifact
        return Circumstances(
            start=self.film.start,
            seconds=self.film.duration,
            zone=None if lake is None else self._zone_name(lake),
            session=None if row is None else row.session,
            sensor="" if wind is None else wind.sensor.words,
            clock=None if row is None else row.clock_sigma,
            clock_method=None if row is None else row.clock_method,
        )

    def _zone_name(self, lake: Lake) -> str | None:
        """Finds the zone in which a recording's camera or log was ingested; None where none was
        given."""
        if self.recording is None:
            return None
        for parent in lake.artifact(self.recording).parents:
            recipe = lake.artifact(parent).recipe
            for part in ("camera", "wind"):
                if name := recipe.get(part, {}).get("zone"):
                    return str(name)
        return None

    def content_hash(self) -> str | None:
        """Hashes a plain file, or the names and hashes of a folder's files (SHA-256); None of an
        artifact."""
        if self.path is None:
            return None
        if self.path.is_file():
            return file_hash(self.path)
        total = hashlib.sha256()
        for entry in sorted(entry for entry in self.path.iterdir() if entry.is_file()):
            total.update(f"{entry.name} {file_hash(entry)}\n".encode(errors="surrogateescape"))
        return total.hexdigest()


def size_of(source: object, stated_size: tuple[float, float] | str | None) -> FlagSize | None:
    """Returns the flag's size as it was given, else as an example states it."""
    example = example_of(source) if stated_size is None and isinstance(source, str | Path) else None
    sides = stated_size if example is None else example.flag_size
    return None if sides is None else FlagSize.of(sides)


def box_of(crop: tuple[int, int, int, int] | str | None) -> CropBox | None:
    """Returns the region of an option --crop.

    Raises:
        UsageError: it is not x,y,width,height.
    """
    if isinstance(crop, tuple):
        return CropBox(x=crop[0], y=crop[1], width=crop[2], height=crop[3])
    box = None if crop is None else parse_crop(crop)
    if not (box is None or isinstance(box, CropBox)):
        raise UsageError(
            f"the crop {crop!r} is not a box", where="--crop", fix="give x,y,width,height in pixels"
        )
    return box


def subjects(
    source: str | None,
    *,
    query: str | None,
    lake: Lake | None,
    at: str | None,
    reading: FilmReading,
) -> list[Subject]:
    """Opens the films that a source or a query names.

    Args:
        source: a path, or the name, id or beginning of the id of an artifact.
        query: an SQL condition over clips, instead of a source.
        lake: where artifacts are; None if no lake was named.
        at: tag, branch or version to look at.

    Raises:
        UsageError: neither a source nor a query, or both; artifacts without a lake; options of
            files for artifacts.
        NotFoundError: nothing of that name, or no clip matches.
        FlagdataError: a file that is no film.
    """
    if (source is None) == (query is None):
        raise UsageError(
            "name a film or give a query over clips, one of them", fix="see flagdata measure --help"
        )
    if source is not None:
        film, location = film_at(
            source, lake=lake, at=at, true_fps=reading.true_fps, sequence_fps=reading.sequence_fps
        )
        fit = reading.conditioned(film)
        if isinstance(location, Path):
            return [Subject(film=fit, path=location, example=example_of(source))]
        return [
            Subject(
                film=fit,
                artifact=location,
                record=film.record if isinstance(film, RecordFilm) else None,
            )
        ]
    if lake is None:
        raise NotFoundError("a query needs a lake", fix="name the lake by --lake")
    if reading.true_fps is not None or reading.sequence_fps is not None:
        raise frames_have_instants()
    rows = matching(lake.rows(query, at=at), {"kind": Kind.CLIP})
    if not rows.num_rows:
        raise NotFoundError("no clip matches", where=query, fix="look with flagdata query --where")
    clips: list[Subject] = []
    for row in rows.to_pylist():
        artifact = Artifact.from_row(row)
        film = stored_film(lake, artifact)
        clips.append(Subject(film=reading.conditioned(film), artifact=artifact, record=film.record))
    return clips
