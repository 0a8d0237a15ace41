"""The model that measures: a network that comes with the package, lies in a folder or in a lake, or
a reading model."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from flagdata.core.files.addresses import local_path
from flagdata.core.provenance import digest, file_hash
from flagdata.core.schema import Kind
from flagdata.errors import InputError, UnknownNameError, UsageError
from flagdata.lake import Artifact, Lake
from flagdata.lake.naming import OF_RESULTS, meant
from measure.estimate.gusty_series import SERIES_KEY
from measure.gate import gate_file
from measure.gate.window import CheckedGate, WindowGate, gate_of
from measure.measuring_model.reading_model import ReadingModel
from measure.measuring_model.reading_model_folder import read as read_reading_model
from models.trained import estimator
from models.trained.estimator import Estimator
from models.trained.model_folder import CARD, WEIGHTS, card_bytes, read_card

CALIBRATED = "anemometer"
"""Key of the recipes of reading models (`measure.anemometer`)."""


def gate_beside(model: Network, *, false_alarm: float) -> WindowGate:
    """Opens the gate of a network: the calibrated one in the model's folder, else the distance of
    summaries.

    Raises:
        CorruptError: the calibrated one is damaged, or another network's.
        InputError: the model has neither.
    """
    if not (model.folder / gate_file.GATE).is_file():
        return gate_of(model.estimator)
    calibrated = gate_file.read(model.folder, model.estimator)
    return CheckedGate(model=model.estimator, calibrated=calibrated, false_alarm=false_alarm)


@dataclass(frozen=True, kw_only=True, eq=False)
class Network:
    """The model that measures, and which one it is.

    Attributes:
        estimator: at work.
        identity: SHA-256 of its card, without how it errs in a series, and its weights; of a
            reading model the id of its artifact.
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
            return (
                f"reading model {self.artifact.name}, {self.identity}, on the network "
                f"{self.estimator.name}"
            )
        return f"{self.estimator.name}, SHA-256 {self.identity}"


def network(name: str | None, *, lake: Lake | None, at: str | None) -> Network:
    """Opens the model of a name.

    Args:
        name: of a model that comes with the package, a folder, or a network or reading model of the
            lake by its name or id; None is the package's default.

    Raises:
        UnknownNameError: none of these.
        UsageError: several models of the lake.
        CorruptError: the model is damaged.
        InputError: a reading model whose network is another one now.
    """
    shipped = {path.name for path in estimator.SHIPPED.iterdir() if (path / CARD).is_file()}
    chosen = name if name is not None else estimator.DEFAULT
    if (local_path(chosen) / CARD).is_file():
        return _load_network(Path(chosen), None)
    if chosen in shipped:
        return _load_network(estimator.SHIPPED / chosen, None)
    rows = [] if lake is None else _models(lake, at)
    same = meant(rows, chosen)
    if not same or lake is None:
        raise UnknownNameError.of(
            "model", chosen, shipped | {str(row["name"]) for row in rows}, where="--model"
        )
    if len(same) > 1:
        raise UsageError(
            f"{len(same)} models are called {chosen!r}", where="--model", fix="give the id of one"
        )
    artifact = lake.artifact(same[0]["artifact"], at=at)
    folder = lake.object_path(str(artifact.object))
    return (
        _load_network(folder, artifact)
        if artifact.kind is Kind.NETWORK
        else _calibrated_network(folder, artifact, lake, at)
    )


def _models(lake: Lake, at: str | None) -> list[dict[str, Any]]:
    """Networks and reading models of a lake."""
    rows = lake.rows(
        {"kind": (Kind.NETWORK, Kind.MEASUREMENT)}, at=at, columns=OF_RESULTS
    ).to_pylist()
    return [
        row
        for row in rows
        if row["kind"] == Kind.NETWORK or CALIBRATED in json.loads(row["recipe"] or "{}")
    ]


def _calibrated_network(folder: Path, artifact: Artifact, lake: Lake, at: str | None) -> Network:
    reading = read_reading_model(folder)
    base = network(reading.network, lake=lake, at=at)
    if base.identity != reading.identity:
        raise InputError(
            f"the network {reading.network!r} is another one than when the flag was calibrated",
            where=artifact.name,
            fix="calibrate the flag again",
        )
    return replace(base, identity=artifact.id, artifact=artifact, reading=reading)


def _load_network(folder: Path, artifact: Artifact | None) -> Network:
    return Network(
        estimator=estimator.load(folder),
        identity=_identity(folder),
        artifact=artifact,
        folder=folder,
    )


def _identity(folder: Path) -> str:
    """Hashes the card and the weights of a network. How it errs in a series of windows is no part
    of what it is: where its card states that later, a reading model that was made before is still
    one of the same network."""
    card = read_card(folder)
    hashed = file_hash(folder / CARD)
    if SERIES_KEY in card:
        hashed = digest(
            card_bytes(
                {key: card[key] for key in card if key not in ("format", SERIES_KEY)}
            ).decode()
        )
    return digest(f"{hashed} {file_hash(folder / WEIGHTS)}")
