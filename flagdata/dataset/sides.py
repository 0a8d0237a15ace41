"""On which side of a split each clip is. Every door that takes a split asks `divide`; nothing else
decides.

A data set states its sides in the catalog's columns `dataset` and `side`: the side that a row
states is its side. Rows that state none are divided by a `HashedSplit`, or by the filters of an
`ExplicitSplit`. A selection of both kinds is refused, and so are relatives on two sides.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import pyarrow as pa
import pyarrow.compute as pc

from flagdata.core.json_values import json_values
from flagdata.core.schema import Kind
from flagdata.dataset.clip_lineage import origins_of
from flagdata.dataset.splits import (
    DEFAULT_FRACTIONS,
    ExplicitSplit,
    HashedSplit,
    Origin,
    groups,
    refuse_leaks,
)
from flagdata.errors import RefusedError, UnknownNameError
from flagdata.lake.matching import Where, condition
from flagdata.lake.rowfiles import Scan
from flagdata.lake.selection import Request, Selection

_LOG = logging.getLogger("flagdata")
COLUMNS = ("artifact", "kind", "recording", "session", "seed", "day", "dataset", "side")
"""Columns of the catalog that decide on which side a row is."""
_LINEAGE = ("artifact", "kind", "parents", "created", "source_hash", "object", "session", "side")
_STATES = pc.field("side").is_valid()
_DIVIDED = (Kind.CLIP, Kind.RECORDING)

Catalog: TypeAlias = pa.Table | Scan
"""All rows of a version."""
SplitBy: TypeAlias = HashedSplit | ExplicitSplit


@dataclass(frozen=True, kw_only=True)
class SideSize:
    """How much one side of a split holds: clips, recordings, and independent groups of
    recordings."""

    clips: int
    recordings: int
    groups: int


@dataclass(frozen=True, kw_only=True)
class Division:
    """How the rows of a selection are divided.

    Attributes:
        rule: the sides are "stated" by data sets, "hashed", or of "explicit" filters.
        about: the data sets; the salt and the fractions; or the filters.
        artifacts: side → identities of the rows on it.
        sizes: side → how much of the selection it holds.
        grouping: what there is to divide, in words.
        is_whole: whether all clips of the catalog belong together, so that a hash gives one side
            all of them.
    """

    rule: Literal["stated", "hashed", "explicit"]
    about: Mapping[str, Any]
    artifacts: Mapping[str, frozenset[str]]
    sizes: Mapping[str, SideSize]
    grouping: str
    is_whole: bool = False

    def on(self, side: str) -> frozenset[str]:
        """Returns the identities of the rows on a side.

        Raises:
            UnknownNameError: no such side.
        """
        if side not in self.artifacts:
            raise UnknownNameError.of("split", side, self.artifacts)
        return self.artifacts[side]

    def warn_whole(self) -> None:
        """Warns where one side of a hashed split has all clips of the catalog."""
        if self.is_whole:
            _LOG.warning("warning: %s: the others are empty", self.grouping)

    @property
    def statement(self) -> dict[str, Any]:
        """What manifests, cards and tags state of a split, as JSON."""
        return {"rule": self.rule, **self.about, "sides": json_values(self.sizes)}


def divide(
    catalog: Catalog, rows: pa.Table, split_by: SplitBy | None = None, *, hashed: HashedSplit
) -> Division:
    """Decides on which side each row of a selection is.

    All clips of the catalog, or of the data sets that the selection is of, take part, so that two
    filters never put relatives on two sides.

    Args:
        rows: of the selection: clips, or what `select_columns` returns.
        split_by: the split that the user gives; `None` is the one that data sets state, else
            `hashed`.
        hashed: the hashed split of this version, see `flagdata.dataset.tagged.hashed_split`.

    Raises:
        RefusedError: relatives are on two sides; some of the rows state a side and others none; or
            `split_by` takes rows to another side than they state.
    """
    if isinstance(split_by, ExplicitSplit):
        return _explicit(catalog, rows, split_by)
    stating = rows.filter(_STATES)
    if not stating.num_rows:
        decided = _Hashed.of(catalog, split_by or hashed)
        decided.refuse_stating_relatives(rows)
        return decided.division(rows)
    datasets = _texts(stating, "dataset")
    if stating.num_rows < rows.num_rows:
        raise RefusedError(
            f"{stating.num_rows} of {rows.num_rows} rows state a side, of "
            f"{_listed_names(datasets)}, and the others none",
            where=f"artifact {rows.filter(~_STATES)['artifact'][0].as_py()}",
            fix="add side is not null to the filter for those of data sets, or side is null for "
            "the others",
        )
    if split_by is not None:
        raise RefusedError(
            f"{_listed_names(datasets)} {_state(datasets)} the side of each row, and a hashed "
            "split is given beside it",
            where=f"salt {split_by.salt!r}, fractions {dict(split_by.fractions)}",
            fix="leave out --salt and split_by: the side that a row states is its side",
        )
    origins = _stated_origins(catalog, datasets)
    refuse_leaks(origins, fix="take what they share off all sides but one by flagdata withdraw")
    return _stated_division(rows, origins)


def stated_sides(catalog: Catalog, rows: pa.Table) -> Division | None:
    """Describes the sides that rows state, whether or not relatives are on two of them; None where
    none states one."""
    stating = rows.filter(_STATES & condition({"kind": _DIVIDED}))
    return (
        _stated_division(stating, _stated_origins(catalog, _texts(stating, "dataset")))
        if stating.num_rows
        else None
    )


def hashed_sides(catalog: Catalog, rows: pa.Table, split_by: HashedSplit) -> Division:
    """Describes the sides that a hash gives rows that state none, whether or not relatives of
    theirs state others."""
    return _Hashed.of(catalog, split_by).division(rows)


def select_columns(rows: pa.Table) -> pa.Table:
    """Returns `COLUMNS` of rows of any kind; a recording is of itself."""
    own = pc.coalesce(rows["recording"], rows["artifact"])  # type: ignore[attr-defined]
    return rows.select(list(COLUMNS)).set_column(COLUMNS.index("recording"), "recording", own)


def clips_of(catalog: Catalog, where: Where | None, columns: Sequence[str] = COLUMNS) -> pa.Table:
    """Selects columns of the clips that a filter finds.

    Raises:
        UnknownNameError, UsageError: see `flagdata.lake.selection`.
    """
    of_clips = condition({"kind": Kind.CLIP})  # not a part of the filter, which could undo it
    clips = catalog.matching(of_clips) if isinstance(catalog, Scan) else catalog.filter(of_clips)
    if where is None:
        return clips.table(columns) if isinstance(clips, Scan) else clips.select(list(columns))
    return Selection(clips, Request(where=where, columns=tuple(columns))).table()


def lineage_of(catalog: Catalog) -> pa.Table:
    """Selects the columns that state where clips come from."""
    return catalog.table(_LINEAGE) if isinstance(catalog, Scan) else catalog


def explicit_sides(catalog: Catalog, split_by: ExplicitSplit) -> dict[str, pa.Table]:
    """Maps each side to its clips, `COLUMNS` of them. All sides are resolved and compared,
    whichever is wanted.

    Raises:
        RefusedError: two of them share a recording, a film, a mesh sequence, a seed, a session or a
            day.
    """
    taken = {side: clips_of(catalog, where) for side, where in split_by.where.items()}
    lineage = lineage_of(catalog)
    refuse_leaks({side: origins_of(lineage, clips) for side, clips in taken.items()})
    return taken


def _explicit(catalog: Catalog, rows: pa.Table, split_by: ExplicitSplit) -> Division:
    taken = explicit_sides(catalog, split_by)
    for side, clips in taken.items():
        others = clips.filter(_STATES & (pc.field("side") != side))
        if others.num_rows:
            first = others.slice(0, 1).to_pylist()[0]
            raise RefusedError(
                f"the explicit split takes {others.num_rows} clips to {side!r} that state another "
                "side",
                where=f"artifact {first['artifact']}, side {first['side']!r} of "
                f"{first['dataset']!r}",
                fix="select the clips of a side by the side that they state: side = 'train' in its "
                "filter",
            )
    of_selection = condition({"artifact": rows["artifact"].to_pylist()})
    by_side = {side: clips.filter(of_selection) for side, clips in taken.items()}
    origins = origins_of(lineage_of(catalog), clips_of(catalog, None))
    where = {
        side: filter_ if isinstance(filter_, str) else _as_json(filter_)
        for side, filter_ in split_by.where.items()
    }
    return Division(
        rule="explicit",
        about={"where": where},
        artifacts=_artifacts(by_side),
        sizes=_sizes(by_side, origins),
        grouping=f"the catalog has {len(set(groups(origins).tolist()))} independent groups",
    )


def _as_json(values: Mapping[str, Any]) -> dict[str, Any]:
    return {
        name: list(value) if isinstance(value, tuple | set | frozenset) else value
        for name, value in values.items()
    }


def _stated_division(rows: pa.Table, origins: Mapping[str, Sequence[Origin]]) -> Division:
    datasets = _texts(rows, "dataset")
    by_side = {side: rows.filter(pc.field("side") == side) for side in origins}
    sizes = _sizes(by_side, [origin for of_side in origins.values() for origin in of_side])
    counts = ", ".join(f"{size.clips} clips on {side!r}" for side, size in sizes.items())
    return Division(
        rule="stated",
        about={"datasets": datasets},
        artifacts=_artifacts(by_side),
        sizes=sizes,
        grouping=f"{_listed_names(datasets)} {_state(datasets)} {counts}",
    )


def _stated_origins(catalog: Catalog, datasets: Sequence[str]) -> dict[str, list[Origin]]:
    """Finds the origins of all rows of data sets, by the side that they state."""
    of_sets = condition({"dataset": datasets, "kind": _DIVIDED})
    if isinstance(catalog, Scan):
        rows = select_columns(catalog.matching(of_sets).table(COLUMNS))
    else:
        rows = select_columns(catalog.filter(of_sets))
    lineage = lineage_of(catalog)
    return {
        side: origins_of(lineage, rows.filter(pc.field("side") == side))
        for side in sorted(_texts(rows, "side"), key=_place)
    }


@dataclass(frozen=True, kw_only=True)
class _Hashed:
    """What a hash decides. Every clip of the catalog takes part, so that two filters never disagree
    about a group.

    Attributes:
        clips: all clips of the catalog.
        origins: of their recordings.
        sides: recording → side.
    """

    split_by: HashedSplit
    clips: pa.Table
    origins: Sequence[Origin]
    sides: Mapping[str, str]

    @classmethod
    def of(cls, catalog: Catalog, split_by: HashedSplit) -> _Hashed:
        clips = clips_of(catalog, None)
        origins = origins_of(lineage_of(catalog), clips)
        sides = dict(
            zip([origin.recording for origin in origins], split_by.assign(origins), strict=True)
        )
        return cls(split_by=split_by, clips=clips, origins=origins, sides=sides)

    def division(self, rows: pa.Table) -> Division:
        """Divides rows that state no side."""
        by_side = {
            side: rows.filter(
                condition({"recording": [name for name, own in self.sides.items() if own == side]})
            )
            for side in self.split_by.sides
        }
        count = len(set(groups(self.origins).tolist()))
        grouping = f"the catalog has {count} independent groups"
        if count == 1:
            grouping = (
                f"all {self.clips.num_rows} clips belong together "
                f"({_shared_origins(self.origins)}), and are on the side "
                f"{next(iter(self.sides.values()))!r}"
            )
        return Division(
            rule="hashed",
            about={"salt": self.split_by.salt, "fractions": dict(self.split_by.fractions)},
            artifacts=_artifacts(by_side),
            sizes=_sizes(by_side, self.origins),
            grouping=grouping,
            is_whole=count == 1,
        )

    def refuse_stating_relatives(self, rows: pa.Table) -> None:
        """Refuses rows of which relatives state another side than the hash's.

        Raises:
            RefusedError: there are some.
        """
        stating = self.clips.filter(_STATES)
        if not stating.num_rows:
            return
        stated = dict(
            zip(stating["recording"].to_pylist(), stating["side"].to_pylist(), strict=True)
        )
        chosen = set(rows["recording"].to_pylist())
        by_group: dict[int, list[Origin]] = {}
        for label, origin in zip(groups(self.origins).tolist(), self.origins, strict=True):
            by_group.setdefault(label, []).append(origin)
        compared: dict[str, list[Origin]] = {}
        for group in by_group.values():
            recordings = {origin.recording for origin in group}
            if recordings & chosen and recordings & stated.keys():
                for origin in group:
                    side = stated.get(origin.recording, self.sides[origin.recording])
                    compared.setdefault(side, []).append(origin)
        refuse_leaks(
            compared,
            fix="leave those that share it out by the filter, or take them off by flagdata "
            "withdraw",
        )


def _artifacts(by_side: Mapping[str, pa.Table]) -> dict[str, frozenset[str]]:
    return {side: frozenset(rows["artifact"].to_pylist()) for side, rows in by_side.items()}


def _sizes(by_side: Mapping[str, pa.Table], origins: Sequence[Origin]) -> dict[str, SideSize]:
    """Counts what each side holds, and the groups of all `origins` that its recordings are in."""
    labels = dict(
        zip([origin.recording for origin in origins], groups(origins).tolist(), strict=True)
    )
    sizes: dict[str, SideSize] = {}
    for side, rows in by_side.items():
        recordings = set(rows["recording"].to_pylist())
        sizes[side] = SideSize(
            clips=rows.filter(condition({"kind": Kind.CLIP})).num_rows,
            recordings=len(recordings),
            groups=len({labels[recording] for recording in recordings}),
        )
    return sizes


def _shared_origins(origins: Sequence[Origin]) -> str:
    """Says what connects recordings, in words."""
    common = set.intersection(*(set(origin.ties) for origin in origins))
    words = ("session", "day", "seed")
    named = sorted(
        (tie for tie in common if tie.startswith(words)),
        key=lambda tie: words.index(tie.partition(" ")[0]),
    )
    return named[0] if named else "by session, day or source"


def _place(side: str) -> tuple[int, str]:
    """Orders sides as they are used: train, validation, test, then others."""
    known = list(DEFAULT_FRACTIONS)
    return (known.index(side) if side in known else len(known), side)


def _texts(rows: pa.Table, column: str) -> list[str]:
    return sorted(set(rows[column].drop_null().to_pylist()))


def _listed_names(datasets: Iterable[str]) -> str:
    return ", ".join(map(repr, datasets))


def _state(datasets: Sequence[str]) -> str:
    return "states" if len(datasets) == 1 else "state"
