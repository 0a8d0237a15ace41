"""Artifacts that were made before from the bytes of a log: read alike, read otherwise, or never
confirmed.

The identity of a log's artifact holds the options that shaped it and what was understood of its
file, so that a file that was ingested in a wrong zone and then in the right one is in the lake
twice, and the wrong one would go on being taken for the truth unless somebody says so.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from flagdata.core.findings import Finding
from flagdata.core.printable import SHORT
from flagdata.core.schema import Kind
from flagdata.core.shell import command_line
from flagdata.errors import FlagdataError
from flagdata.lake import Artifact, Lake
from flagdata.record import Record
from flagdata.record.signals import WindSeries

_CHOOSES = ("wind", "talker", "session")
"""What makes another log of the same file and no other reading of it: one of several anemometers, a
second session."""


def other_readings(
    artifacts: Sequence[Artifact], source_hash: str, recipe: Mapping[str, Any]
) -> tuple[Finding, ...]:
    """Notes each of some artifacts that was read from the same bytes otherwise.

    Args:
        artifacts: artifacts of the same kind that are in the lake.
        source_hash: of the file's bytes.
        recipe: all that shapes the result now.
    """
    now = _options(recipe)
    findings: list[Finding] = []
    for artifact in artifacts:
        before = _options(artifact.recipe)
        if artifact.source_hash != source_hash or any(
            before.get(name) != now.get(name) for name in _CHOOSES
        ):
            continue
        names = sorted(
            name for name in before.keys() | now.keys() if before.get(name) != now.get(name)
        )
        changed = ", ".join(f"{name} {before.get(name)!s}, now {now.get(name)!s}" for name in names)
        if changed:
            message = (
                f"the same file is in the lake by other options as {artifact.id[:SHORT]} "
                f"({changed}); both stay"
            )
        elif artifact.recipe.get("plan") != recipe.get("plan"):
            mean = json.loads(artifact.report or "{}").get("mean_speed")
            mean_speed = "" if mean is None else f", mean speed {mean:.4g} m/s"
            message = (
                "the same file was understood otherwise before, as "
                f"{artifact.id[:SHORT]}{mean_speed}; both stay"
            )
        else:
            continue
        withdraw = command_line("flagdata", "withdraw", artifact.id[:SHORT], "-m", "read otherwise")
        fix = f"if that one is wrong, take it off: {withdraw}"
        findings.append(Finding.of("ingested-before", message, fix=fix))
    return tuple(findings)


def earlier(
    lake: Lake,
    artifacts: Sequence[Artifact],
    source_hash: str,
    recipe: Mapping[str, Any],
    series: WindSeries,
) -> Artifact | None:
    """Finds the artifact that an older version made of the same bytes and options, and whose wind
    is the same to the bit.

    Args:
        lake: that holds the artifacts.
        artifacts: artifacts of the same kind that are in the lake.
        source_hash: of the file's bytes.
        recipe: all that shapes the result now.
        series: as it is read now, by no draft.
    """
    for artifact in artifacts:
        if artifact.source_hash == source_hash and _options(artifact.recipe) == _options(recipe):
            try:
                before = Record.open(lake.record_place(str(artifact.object))).wind()
            except FlagdataError:
                # damage of another artifact is found by verify; it does not keep this log out
                continue
            if before is not None and _same(before, series):
                return artifact
    return None


def unconfirmed_findings(artifacts: Iterable[Artifact]) -> tuple[Finding, ...]:
    """Warns of each artifact of a log that an older version read by a draft of its own, which
    nobody confirmed."""
    return tuple(
        Finding.of(
            "draft-unconfirmed",
            "an older version drafted how to read this log, and nobody confirmed it",
            where=f"artifact {artifact.id} {artifact.name!r}",
            fix="ingest the file again, confirm what is shown, and withdraw this artifact",
        )
        for artifact in artifacts
        if _was_drafted(artifact)
    )


def _was_drafted(artifact: Artifact) -> bool:
    """Checks whether a table was read by no recipe of the user's, before plans were a part of the
    identity."""
    wind = artifact.recipe.get("wind")
    if artifact.kind is not Kind.WIND or not isinstance(wind, Mapping) or "plan" in artifact.recipe:
        return False
    return (
        wind.get("recipe") is None
        and json.loads(artifact.report or "{}").get("format") == "delimited"
    )


def _same(first: WindSeries, second: WindSeries) -> bool:
    names = first.channels.keys()
    return (
        names == second.channels.keys()
        and np.array_equal(first.time, second.time)
        and np.array_equal(first.flags, second.flags)
        and all(
            np.array_equal(first.channels[name], second.channels[name], equal_nan=True)
            for name in names
        )
    )


def _options(recipe: Mapping[str, Any]) -> dict[str, Any]:
    """Selects the options of a recipe, those of the anemometer's own among them; what was
    understood of the file is none."""
    flat: dict[str, Any] = {}
    for name, value in recipe.items():
        if name != "plan":
            flat |= _options(value) if isinstance(value, Mapping) else {name: value}
    return flat
