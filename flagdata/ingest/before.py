"""Whether a file is in the lake already, by other options than those it is ingested by now.

The identity of an artifact holds the options that shaped it, so that a file that was ingested in a wrong zone and then
in the right one is in the lake twice, and the wrong one would go on being taken for the truth unless somebody says so.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from flagdata.findings import Finding, Severity
from flagdata.lake import Artifact

_CHOOSES = ("wind", "talker")
"""Options that choose one of several anemometers of a file: another choice is another log, no other reading of it."""
_ID = 12
"""Letters of an artifact's identity that are told."""


def by_other_options(
    others: Sequence[Artifact], source_hash: str, recipe: Mapping[str, Any]
) -> tuple[Finding, ...]:  # fmt: skip
    """A note for each of some artifacts that was read from the same bytes otherwise.

    Args:
        others: artifacts of the same kind that are in the lake.
        source_hash: of the file's bytes.
        recipe: all options that shape the result now.
    """
    now = _options(recipe)
    found: list[Finding] = []
    for artifact in others:
        before = _options(artifact.recipe)
        if artifact.source_hash != source_hash or any(before.get(name) != now.get(name) for name in _CHOOSES):
            continue
        names = sorted(name for name in before.keys() | now.keys() if before.get(name) != now.get(name))
        changed = ", ".join(f"{name} {before.get(name)!s}, now {now.get(name)!s}" for name in names)
        if changed:
            found.append(
                Finding(
                    kind="ingested-before", severity=Severity.NOTE,
                    what=f"the same file is in the lake by other options as {artifact.id[:_ID]} ({changed}); both stay",
                    fix=f"if that one is wrong, take it off: flagdata withdraw {artifact.id[:_ID]}",
                )
            )  # fmt: skip
    return tuple(found)


def _options(recipe: Mapping[str, Any]) -> dict[str, Any]:
    """The options of a recipe, those of the anemometer's own among them."""
    flat: dict[str, Any] = {}
    for name, value in recipe.items():
        flat |= _options(value) if isinstance(value, Mapping) else {name: value}
    return flat
