"""What an artifact was made from and what was made from it, over all generations, in the rows that
a ref shows."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

import pyarrow as pa
import pyarrow.compute as pc

_COLUMNS = ("artifact", "kind", "name", "recipe_hash", "code_version", "seed", "parents")


@dataclass(frozen=True, kw_only=True)
class Relative:
    """One artifact of a lineage.

    Attributes:
        generation: 0 for the artifact asked for, −1 and less for what it was made from, 1 and more
            for what was made from it: the number of steps of the longest way.
        kind, name, recipe_hash, code_version: of its row; `None` where the ref does not show it.
        seed: root seed of a simulated artifact.
    """

    artifact: str
    generation: int
    kind: str | None = None
    name: str | None = None
    recipe_hash: str | None = None
    code_version: str | None = None
    seed: int | None = None


@dataclass(frozen=True, kw_only=True)
class Ancestry:
    """The lineage of one artifact.

    Attributes:
        artifact: full id.
        relatives: by id, the artifact itself among them, in the order of generations.
        edges: (parent, child) ids; of each relative only those that lead towards the artifact.
    """

    artifact: str
    relatives: Mapping[str, Relative]
    edges: tuple[tuple[str, str], ...]

    def nearer(self, *, up: bool) -> dict[str, list[str]]:
        """Maps each id to the ids it was made from (`up`), or of what was made from it, in the
        order of the relatives."""
        ids: dict[str, list[str]] = {}
        for parent, child in self.edges:
            ids.setdefault(child if up else parent, []).append(parent if up else child)
        return ids


def ancestry(rows_of_ref: pa.Table, artifact: str) -> Ancestry:
    """Builds the lineage of an artifact.

    Args:
        rows_of_ref: rows of a ref, with the columns of the catalog.
        artifact: full id of one of them.
    """
    rows = rows_of_ref.select(_COLUMNS).combine_chunks()
    of_child = pc.list_parent_indices(rows["parents"])  # type: ignore[attr-defined]
    parents = pc.list_flatten(rows["parents"])  # type: ignore[attr-defined]
    pairs = pa.table({"child": pc.take(rows["artifact"], of_child), "parent": parents})
    above = _reached_steps(pairs, artifact, along=("child", "parent"))
    below = _reached_steps(pairs, artifact, along=("parent", "child"))
    generations = {relative: -steps for relative, steps in _steps(artifact, above).items()}
    generations |= {
        relative: steps
        for relative, steps in _steps(artifact, below).items()
        if relative not in generations
    }
    rows_by_id = {
        row["artifact"]: row
        for row in rows.filter(_among(rows["artifact"], generations)).to_pylist()
    }
    relatives = {
        relative: Relative(
            artifact=relative,
            generation=generation,
            **{name: rows_by_id[relative][name] for name in _COLUMNS[1:-1]}
            if relative in rows_by_id
            else {},
        )
        for relative, generation in sorted(generations.items(), key=lambda item: item[1])
    }
    edges = dict.fromkeys([*((parent, child) for child, parent in above), *below])
    return Ancestry(artifact=artifact, relatives=relatives, edges=tuple(edges))


def _reached_steps(
    pairs: pa.Table, artifact: str, *, along: tuple[str, str]
) -> list[tuple[str, str]]:
    """Lists (from, to) of all steps that lead away from an artifact, each once."""
    reached, fresh, steps = {artifact}, {artifact}, []
    while fresh:
        onward = pairs.filter(_among(pairs[along[0]], fresh))
        taken = list(zip(onward[along[0]].to_pylist(), onward[along[1]].to_pylist(), strict=True))
        steps += taken
        fresh = {to for _, to in taken} - reached
        reached |= fresh
    return steps


def _among(column: pa.ChunkedArray, wanted: Collection[str]) -> pa.ChunkedArray:
    names = pa.array(sorted(wanted), pa.string())
    return pc.is_in(column, value_set=names)  # type: ignore[attr-defined]


def _steps(artifact: str, steps: Sequence[tuple[str, str]]) -> dict[str, int]:
    """Computes id → length of the longest way to it. Of ids in a circle, which only a damaged
    catalog has, some way's."""
    onwards: dict[str, list[str]] = {}
    awaited: dict[str, int] = {artifact: 0}
    for begin, end in dict.fromkeys(steps):
        onwards.setdefault(begin, []).append(end)
        awaited[end] = awaited.get(end, 0) + 1
    longest, ready = {artifact: 0}, deque([artifact])
    while ready:
        current = ready.popleft()
        for end in onwards.get(current, ()):
            longest[end] = max(longest.get(end, 0), longest[current] + 1)
            awaited[end] -= 1
            if awaited[end] == 0:
                ready.append(end)
    return {current: longest.get(current, 1) for current in awaited}


@dataclass(frozen=True, kw_only=True)
class Line:
    """One line of a tree.

    Attributes:
        ends: for each level from the outermost in, whether its branch ends with this line's.
        relatives: the artifacts it stands for: one, or several of a kind that are counted only.
        repeated: it stands above already, with what belongs to it.
    """

    ends: tuple[bool, ...]
    relatives: tuple[Relative, ...]
    repeated: bool = False


def tree(lineage: Ancestry, *, up: bool, most: int | None) -> Iterator[Line]:
    """Yields the lines of what an artifact was made from (`up`), or of what was made from it.

    Args:
        most: more relatives of one kind at one place are counted on one line; `None` lists all.
    """
    nearer = lineage.nearer(up=up)
    above: set[str] = set()
    waiting: list[tuple[tuple[bool, ...], tuple[Relative, ...]]] = []

    def descend(artifacts: Sequence[str], ends: tuple[bool, ...]) -> None:
        next_ones = dict.fromkeys(one for artifact in artifacts for one in nearer.get(artifact, ()))
        groups = group_relatives([lineage.relatives[one] for one in next_ones], most=most)
        last = len(groups) - 1
        waiting.extend(
            ((*ends, position == last), group)
            for position, group in reversed(list(enumerate(groups)))
        )

    descend([lineage.artifact], ())
    while waiting:
        ends, group = waiting.pop()
        artifacts = [relative.artifact for relative in group]
        repeated = above.issuperset(artifacts)
        yield Line(ends=ends, relatives=group, repeated=repeated)
        if not repeated:
            above.update(artifacts)
            descend(artifacts, ends)


def group_relatives(
    relatives: Sequence[Relative], *, most: int | None
) -> list[tuple[Relative, ...]]:
    """Groups relatives one by one, but those of a kind of which there are more than `most`
    together."""
    kinds: dict[str | None, list[Relative]] = {}
    for relative in relatives:
        kinds.setdefault(relative.kind, []).append(relative)
    return [
        group
        for members in kinds.values()
        for group in (
            [tuple(members)]
            if most is not None and len(members) > most
            else [(member,) for member in members]
        )
    ]
