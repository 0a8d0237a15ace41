"""What clips descend from, read off the catalog: what connects recordings, and which of them
replace others."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import replace

import pyarrow as pa
import pyarrow.compute as pc

from flagdata.core.schema import Kind
from flagdata.dataset.splits import Origin
from flagdata.lake.matching import matching

_TIED = (Kind.CAMERA, Kind.MESHES, Kind.RECORDING)
_TIES = ["artifact", "kind", "source_hash", "object", "session", "side"]


def origins_of(catalog: pa.Table, clips: pa.Table) -> list[Origin]:
    """Finds one origin a recording, with the days of `clips` only."""
    parents = dict(
        zip(catalog["artifact"].to_pylist(), catalog["parents"].to_pylist(), strict=True)
    )
    ties = {
        row["artifact"]: _ties(row)
        for row in matching(catalog, {"kind": _TIED}).select(_TIES).to_pylist()
    }
    days: dict[str, set[str]] = defaultdict(set)
    origins: dict[str, Origin] = {}
    for row in clips.group_by(["recording", "session", "seed", "day"]).aggregate([]).to_pylist():
        recording = row["recording"]
        if row["day"]:
            days[recording].add(row["day"])
        if recording not in origins:
            lineage = {recording, *_ancestors(recording, parents)}
            origins[recording] = Origin(
                recording=recording,
                session=row["session"],
                seed=row["seed"],
                sources=tuple(
                    sorted({tie for artifact in lineage for tie in ties.get(artifact, ())})
                ),
            )
    return [
        replace(origins[recording], days=tuple(sorted(days[recording])))
        for recording in sorted(origins)
    ]


def _ties(row: Mapping[str, str | None]) -> list[str]:
    """Lists in words what must not be on two sides because of one artifact of a recording's
    lineage. A camera that states a side is one film of many in a data set, whose hash they share:
    those of one side are tied."""
    source = f"{row['kind']} {row['source_hash'] or row['artifact']}"
    own = source if row["side"] is None else f"{source}, {row['side']}"
    ties = [] if row["kind"] == Kind.RECORDING else [own]
    ties += [f"{column} {row[column]}" for column in ("object", "session") if row[column]]
    return ties


def _ancestors(artifact: str, parents: Mapping[str, list[str]]) -> set[str]:
    ancestors: set[str] = set()
    open_ = [artifact]
    while open_:
        for parent in parents.get(open_.pop(), ()):
            if parent not in ancestors:
                ancestors.add(parent)
                open_.append(parent)
    return ancestors


def superseded_recordings(catalog: pa.Table, recordings: set[str]) -> dict[str, str]:
    """Recordings that another of `recordings` replaces → that one, a later alignment of the same
    camera and wind."""
    rows = catalog.select(["artifact", "parents", "created"]).filter(
        pc.field("artifact").isin(pa.array(sorted(recordings), pa.string()))
    )
    of_cameras = catalog.select(["artifact", "kind"]).filter(pc.field("kind") == Kind.CAMERA.value)
    cameras = set(of_cameras["artifact"].to_pylist())
    alignments: dict[tuple[str, ...], list[tuple[object, str]]] = defaultdict(list)
    for artifact, parents, created in zip(
        rows["artifact"].to_pylist(),
        rows["parents"].to_pylist(),
        rows["created"].to_pylist(),
        strict=True,
    ):
        if cameras.intersection(parents):
            alignments[tuple(parents)].append((created, artifact))
    return {
        artifact: max(group)[1]
        for group in alignments.values()
        for _, artifact in group
        if artifact != max(group)[1]
    }
