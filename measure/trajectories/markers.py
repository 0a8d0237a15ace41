"""Tracked markers as observations: from a table of a file, or from the lake."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from flagdata.core.schema import Kind
from flagdata.errors import InputError
from flagdata.ingest.markers import MarkerOptions, read_table
from flagdata.lake import Artifact, Lake
from flagdata.lake.marker_sequences import MarkerSequence, read_markers
from flagdata.timebase import NANOSECONDS
from measure.trajectories.observation import Observation


def from_table(path: Path, options: MarkerOptions | None = None) -> tuple[Observation, ...]:
    """Reads the recordings of a marker table; one that holds a single, unnamed recording calls it
    after the file.

    Raises:
        FlagdataError: as `read_table`.
    """
    return tuple(
        _observation(sequence, name=name or path.stem)
        for name, sequence in read_table(path, options).items()
    )


def from_artifact(lake: Lake, artifact: Artifact, *, name: str | None = None) -> Observation:
    """Reads a marker artifact of a lake.

    Raises:
        InputError: an artifact of another kind, or without an object.
        CorruptError: its object is damaged.
    """
    if artifact.kind is not Kind.MARKERS or artifact.object is None:
        raise InputError(
            f"the artifact is a {artifact.kind.value}, not markers",
            where=f"artifact {artifact.id}",
            fix="name a marker artifact; flagdata ls lists them",
        )
    sequence = read_markers(lake.whole_object(artifact.object))  # damage must not be measured
    observation = _observation(sequence, name=name or artifact.name, source=artifact.id)
    return replace(observation, session=artifact.session)


def _observation(sequence: MarkerSequence, *, name: str, source: str = "") -> Observation:
    return Observation(
        name=name,
        markers=sequence.rest,
        positions=sequence.positions,
        source=source,
        times=(sequence.time - sequence.time[0]).astype(np.float64) / NANOSECONDS,
    )
