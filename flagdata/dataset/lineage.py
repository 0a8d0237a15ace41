"""What clips descend from, read off the catalog: what connects recordings, and which of them replace others."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import replace

import pyarrow as pa
import pyarrow.compute as pc

from flagdata.dataset.splits import Origin
from flagdata.schema import Kind

_SOURCES = (Kind.CAMERA, Kind.MESHES)


def origins_of(catalog: pa.Table, clips: pa.Table) -> list[Origin]:
    """One origin a recording, with the days of `clips` only."""
    parents = dict(zip(catalog["artifact"].to_pylist(), catalog["parents"].to_pylist(), strict=True))
    kinds = catalog.filter(pc.field("kind").isin([kind.value for kind in _SOURCES]))
    sources = {
        artifact: f"{kind} {source or artifact}"
        for artifact, kind, source in zip(
            kinds["artifact"].to_pylist(), kinds["kind"].to_pylist(), kinds["source_hash"].to_pylist(), strict=True
        )
    }
    days: dict[str, set[str]] = defaultdict(set)
    known: dict[str, Origin] = {}
    for row in clips.group_by(["recording", "session", "seed", "day"]).aggregate([]).to_pylist():
        recording = row["recording"]
        if row["day"]:
            days[recording].add(row["day"])
        if recording not in known:
            ancestry = _ancestors(recording, parents)
            known[recording] = Origin(
                recording=recording,
                session=row["session"],
                seed=row["seed"],
                sources=tuple(sorted({sources[a] for a in ancestry if a in sources})),
            )
    return [replace(known[recording], days=tuple(sorted(days[recording]))) for recording in sorted(known)]


def _ancestors(artifact: str, parents: Mapping[str, list[str]]) -> set[str]:
    found: set[str] = set()
    open_ = [artifact]
    while open_:
        for parent in parents.get(open_.pop(), ()):
            if parent not in found:
                found.add(parent)
                open_.append(parent)
    return found


def superseded(catalog: pa.Table, recordings: set[str]) -> dict[str, str]:
    """Recordings that another of `recordings` replaces → that one, a later alignment of the same camera and wind."""
    rows = catalog.filter(pc.field("artifact").isin(pa.array(sorted(recordings), pa.string())))
    cameras = set(catalog.filter(pc.field("kind") == Kind.CAMERA.value)["artifact"].to_pylist())
    alignments: dict[tuple[str, ...], list[tuple[object, str]]] = defaultdict(list)
    for artifact, parents, created in zip(
        rows["artifact"].to_pylist(), rows["parents"].to_pylist(), rows["created"].to_pylist(), strict=True
    ):
        if cameras.intersection(parents):
            alignments[tuple(parents)].append((created, artifact))
    return {
        artifact: max(group)[1] for group in alignments.values() for _, artifact in group if artifact != max(group)[1]
    }
