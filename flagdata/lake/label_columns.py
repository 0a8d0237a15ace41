"""Labels as columns: which names and values go together, and the column that each name becomes.

Queries see the label `note` as the column `label_note`. SQL takes capitals for small letters, and a
column has one type; so no commit brings together two names that differ by capitals only, or values
of two types under one name. Lakes
of earlier versions may have such labels: then the second name has a number behind it, and values of
several types are texts.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TypeAlias

import pyarrow as pa

from flagdata.core.shell import command_line
from flagdata.errors import ConflictError
from flagdata.lake.lineage import labels_of
from flagdata.lake.refs import MAIN

Value: TypeAlias = bool | int | float | str
Labels: TypeAlias = Mapping[str, Mapping[str, Value]]
"""Artifact → name → value."""
PREFIX = "label_"
_NAMED = 4
"""Artifacts at most whose ids a remedy names."""


@dataclass(frozen=True, kw_only=True)
class Clash:
    """Labels that are no columns together.

    Attributes:
        names: that SQL takes for one, or the one name whose values are of two types; sorted.
        what: the clash, as a sentence.
        ways: label → artifacts that it may be taken off, sorted, each of which ends the clash; the
            best first.
        advice: what is to be achieved.
    """

    names: tuple[str, ...]
    what: str
    ways: tuple[tuple[str, tuple[str, ...]], ...]
    advice: str

    def fix(self, homes: Mapping[str, Labels]) -> str:
        """Explains how the label is taken off.

        Args:
            homes: branch → the labels of its artifacts, in the order in which branches are to be
                changed.
        """
        for name, holders in self.ways:
            commands, rest = [], [*holders]
            for branch, labels in homes.items():
                here = [artifact for artifact in rest if name in labels.get(artifact, {})]
                rest = [artifact for artifact in rest if artifact not in here]
                where = () if branch == MAIN else ("--branch", branch)
                if here:
                    commands.append(
                        command_line("flagdata", "label", *here[:_NAMED], f"{name}=", *where)
                    )
            more = (
                f"; then repeat this, for the rest of the {len(holders)}"
                if len(holders) > _NAMED
                else ""
            )
            if commands:
                return f"{self.advice}; {' and '.join(commands)} takes the other off{more}"
        return self.advice


def clashes(labels: Labels) -> Iterator[Clash]:
    """Finds the labels that are no columns together."""
    holders: dict[str, list[str]] = {}
    for artifact, values in labels.items():
        for name in values:
            holders.setdefault(name, []).append(artifact)
    spellings: dict[str, list[str]] = {}
    for name in sorted(holders):
        spellings.setdefault(name.lower(), []).append(name)
    for first, *others in spellings.values():
        for other in others:
            yield Clash(
                names=(first, other),
                what=f"the labels {other} and {first} are one column in SQL, which takes capitals "
                "for small letters",
                ways=tuple((name, tuple(sorted(holders[name]))) for name in (other, first)),
                advice="keep one of the two names",
            )
    for name in sorted(holders):
        kinds: dict[str, list[str]] = {}
        for artifact in holders[name]:
            kinds.setdefault(kind(labels[artifact][name]), []).append(artifact)
        if len(kinds) > 1:
            (one, ones), (other, others) = sorted(
                kinds.items(), key=lambda item: len(item[1]), reverse=True
            )[:2]
            first, second = (repr(labels[holding[0]][name]) for holding in (ones, others))
            yield Clash(
                names=(name,),
                what=f"{name} is a {one} on some artifacts, as {first}, and a {other} on others, "
                f"as {second}",
                ways=((name, tuple(sorted(others))), (name, tuple(sorted(ones)))),
                advice="give all of them values of one type",
            )


def check_labels(before: Labels, after: Labels, *, homes: Mapping[str, Labels]) -> None:
    """Checks whether labels are columns together; those that were not before are passed over.

    Args:
        homes: as of `Clash.fix`.

    Raises:
        ConflictError: they are not.
    """
    present = {clash.names for clash in clashes(before)}
    for clash in clashes(after):
        if clash.names not in present:
            raise ConflictError(clash.what, where=clash.ways[0][1][0], fix=clash.fix(homes))


def kind(value: Value) -> str:
    """Names the type of a label's value in words."""
    return (
        "truth value" if isinstance(value, bool) else "text" if isinstance(value, str) else "number"
    )


def shown_labels(catalog: pa.Table) -> dict[str, dict[str, Value]]:
    """Returns the labels of the artifacts that a table of rows has."""
    labels = labels_of(catalog)
    return {
        artifact: labels[artifact]
        for artifact in catalog["artifact"].to_pylist()
        if artifact in labels
    }


def columns(catalog: pa.Table) -> dict[str, pa.Array]:
    """Name of a column → the values of the rows of a table, null where a row has no such label."""
    labels = shown_labels(catalog)
    ids = catalog["artifact"].to_pylist()
    names = sorted({name for values in labels.values() for name in values})
    taken: dict[str, pa.Array] = {}
    spelled: set[str] = set()
    for name in names:
        number, column = 1, name
        while column.lower() in spelled:
            number += 1
            column = f"{name}_{number}"
        spelled.add(column.lower())
        taken[PREFIX + column] = _column([labels.get(artifact, {}).get(name) for artifact in ids])
    return taken


def _column(values: list[Value | None]) -> pa.Array:
    kinds = {kind(value) for value in values if value is not None}
    if kinds == {"truth value"}:
        return pa.array(values, pa.bool_())
    if kinds == {"number"}:
        return pa.array([None if value is None else float(value) for value in values], pa.float64())
    return pa.array([None if value is None else str(value) for value in values], pa.string())
