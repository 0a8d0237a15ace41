"""What SOURCE names: a video file or folder of images, an artifact of a lake, or the clips of a query."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from flagdata.addresses import local_path
from flagdata.errors import InputError, NotFoundError, UnknownNameError, UsageError
from flagdata.examples import Example, example_of
from flagdata.film import RecordFilm
from flagdata.ingest.camera import CropBox, parse_crop
from flagdata.lake import Artifact, Lake
from flagdata.lake.matching import matching
from flagdata.lake.naming import OF_RESULTS, meant
from flagdata.provenance import digest, file_hash
from flagdata.record import Record
from flagdata.schema import Kind
from flagdata.sources import film_at, frames_have_instants, stored_film
from measure.anemometer.reading import ReadingModel
from measure.anemometer.storage import read as read_reading_model
from measure.estimate.checked import CheckedGate
from measure.estimate.conditioned import ConditionedFilm, WholeFilm
from measure.estimate.gate import Gate, gate_of
from measure.estimate.similarity import FlagSize
from measure.gate import storage
from models import estimator
from models.estimator import Estimator
from models.storage import CARD, WEIGHTS

CALIBRATED = "anemometer"
"""Key of the recipes of reading models (`measure.anemometer`)."""


@dataclass(frozen=True, kw_only=True)
class Reading:
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

    def conditioned(self, film: WholeFilm) -> ConditionedFilm:
        """A film, made fit."""
        return ConditionedFilm(film, crop=self.crop, flag=self.flag, aspect=self.aspect)

    def recipe(self) -> dict[str, Any]:
        """JSON values."""
        crop = None if self.crop is None else str(self.crop)
        return {"crop": crop, "flag": self.flag, "true_fps": self.true_fps, "sequence_fps": self.sequence_fps}


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

    def content_hash(self) -> str | None:
        """SHA-256 of a plain file, or of the names and hashes of a folder's files; None of an artifact."""
        if self.path is None:
            return None
        if self.path.is_file():
            return file_hash(self.path)
        total = hashlib.sha256()
        for entry in sorted(entry for entry in self.path.iterdir() if entry.is_file()):
            total.update(f"{entry.name} {file_hash(entry)}\n".encode(errors="surrogateescape"))
        return total.hexdigest()


def size_of(source: str | Path | None, given: FlagSize | None) -> FlagSize | None:
    """The flag's size as it was given, else as an example states it."""
    example = None if given is not None or source is None else example_of(source)
    return given if example is None else FlagSize(length=example.flag_size[0], height=example.flag_size[1])


def box_of(crop: str | None) -> CropBox | None:
    """The region of an option --crop.

    Raises:
        UsageError: it is not x,y,width,height.
    """
    box = None if crop is None else parse_crop(crop)
    if not (box is None or isinstance(box, CropBox)):
        raise UsageError(f"the crop {crop!r} is not a box", where="--crop", fix="give x,y,width,height in pixels")
    return box


def subjects(
    source: str | None, *, query: str | None, lake: Lake | None, at: str | None, reading: Reading
) -> list[Subject]:
    """The films that a source or a query names.

    Args:
        source: a path, or the name, id or beginning of the id of an artifact.
        query: an SQL condition over clips, instead of a source.
        lake: where artifacts are; None if no lake was named.
        at: tag, branch or version to look at.

    Raises:
        UsageError: neither a source nor a query, or both; artifacts without a lake; options of files for artifacts.
        NotFoundError: nothing of that name, or no clip matches.
        FlagdataError: a file that is no film.
    """
    if (source is None) == (query is None):
        raise UsageError("name a film or give a query over clips, one of them", fix="see flagdata measure --help")
    if source is not None:
        film, place = film_at(source, lake=lake, at=at, true_fps=reading.true_fps, sequence_fps=reading.sequence_fps)
        fit = reading.conditioned(film)
        if isinstance(place, Path):
            return [Subject(film=fit, path=place, example=example_of(source))]
        return [Subject(film=fit, artifact=place, record=film.record if isinstance(film, RecordFilm) else None)]
    if lake is None:
        raise NotFoundError("a query needs a lake", fix="name the lake by --lake")
    if reading.true_fps is not None or reading.sequence_fps is not None:
        raise frames_have_instants()
    rows = matching(lake.rows(query, at=at), {"kind": Kind.CLIP})
    if not rows.num_rows:
        raise NotFoundError("no clip matches", where=query, fix="look with flagdata query --where")
    found: list[Subject] = []
    for row in rows.to_pylist():
        artifact = Artifact.from_row(row)
        film = stored_film(lake, artifact)
        found.append(Subject(film=reading.conditioned(film), artifact=artifact, record=film.record))
    return found


def gate_beside(found: Network, *, false_alarm: float) -> Gate:
    """The gate of a network: the calibrated one where it lies in the model's folder, else the distance of summaries.

    Raises:
        CorruptError: the calibrated one is damaged, or another network's.
        InputError: the model has neither.
    """
    if not (found.folder / storage.GATE).is_file():
        return gate_of(found.estimator)
    calibrated = storage.read(found.folder, found.estimator)
    return CheckedGate(model=found.estimator, calibrated=calibrated, false_alarm=false_alarm)


@dataclass(frozen=True, kw_only=True, eq=False)
class Network:
    """The model that measures, and which one it is.

    Attributes:
        estimator: at work.
        identity: SHA-256 of its card and weights; of a reading model the id of its artifact.
        artifact: of the lake; None of a folder or of a model that comes with the package.
        folder: of its files, where what belongs to it may lie beside them.
        reading: the reading model that uses its summary; None where the network itself measures.
    """

    estimator: Estimator
    identity: str
    artifact: Artifact | None
    folder: Path
    reading: ReadingModel | None = None

    @property
    def described(self) -> str:
        """Which one it is, for people."""
        if self.reading is not None and self.artifact is not None:
            return f"reading model {self.artifact.name}, {self.identity}, on the network {self.estimator.name}"
        return f"{self.estimator.name}, SHA-256 {self.identity}"


def network(name: str | None, *, lake: Lake | None, at: str | None) -> Network:
    """The model of a name.

    Args:
        name: of a model that comes with the package, a folder, or a network or reading model of the lake by its name or
            id; None is the package's default.

    Raises:
        UnknownNameError: none of these.
        UsageError: several models of the lake.
        CorruptError: the model is damaged.
        InputError: a reading model whose network is another one now.
    """
    shipped = {path.name for path in estimator.SHIPPED.iterdir() if (path / CARD).is_file()}
    chosen = name if name is not None else estimator.DEFAULT
    if (local_path(chosen) / CARD).is_file():
        return _loaded(Path(chosen), None)
    if chosen in shipped:
        return _loaded(estimator.SHIPPED / chosen, None)
    rows = [] if lake is None else _models(lake, at)
    same = meant(rows, chosen)
    if not same or lake is None:
        raise UnknownNameError.of("model", chosen, shipped | {str(row["name"]) for row in rows}, where="--model")
    if len(same) > 1:
        raise UsageError(f"{len(same)} models are called {chosen!r}", where="--model", fix="give the id of one")
    artifact = lake.artifact(same[0]["artifact"], at=at)
    folder = lake.object_path(str(artifact.object))
    return _loaded(folder, artifact) if artifact.kind is Kind.NETWORK else _calibrated(folder, artifact, lake, at)


def _models(lake: Lake, at: str | None) -> list[dict[str, Any]]:
    """Networks and reading models of a lake."""
    rows = lake.rows({"kind": (Kind.NETWORK, Kind.MEASUREMENT)}, at=at, columns=OF_RESULTS).to_pylist()
    return [row for row in rows if row["kind"] == Kind.NETWORK or CALIBRATED in json.loads(row["recipe"] or "{}")]


def _calibrated(folder: Path, artifact: Artifact, lake: Lake, at: str | None) -> Network:
    reading = read_reading_model(folder)
    own = network(reading.network, lake=lake, at=at)
    if own.identity != reading.identity:
        raise InputError(
            f"the network {reading.network!r} is another one than when the flag was calibrated",
            where=artifact.name,
            fix="calibrate the flag again",
        )
    return replace(own, identity=artifact.id, artifact=artifact, reading=reading)


def _loaded(folder: Path, artifact: Artifact | None) -> Network:
    loaded = estimator.load(folder)
    return Network(
        estimator=loaded,
        identity=digest(f"{file_hash(folder / CARD)} {file_hash(folder / WEIGHTS)}"),
        artifact=artifact,
        folder=folder,
    )
