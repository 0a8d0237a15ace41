"""A query becomes pairs, in the parent process: rows, side of the split, ground truth of the window, tolerance."""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from flagdata.arrays import FloatArray
from flagdata.dataset.clips import TRUTH_SPEED, clip_truth, truth_series
from flagdata.dataset.lineage import origins_of, superseded
from flagdata.dataset.splits import ExplicitSplit, HashedSplit, Origin, check_side, groups, refuse_leaks
from flagdata.dataset.table import COLUMNS, PairTable
from flagdata.dataset.tolerance import Refusal, Tolerance, judge
from flagdata.documents import column_json
from flagdata.errors import NotFoundError, RefusedError, UsageError
from flagdata.lake import Lake
from flagdata.lake.lineage import labels_of
from flagdata.lake.matching import Where
from flagdata.lake.rowfiles import Scan
from flagdata.lake.selection import Request, Selection
from flagdata.record import Record
from flagdata.schema import TRUTH_WINDOW, Kind

_LOG = logging.getLogger("flagdata")
_ORIGIN = ("artifact", "recording", "session", "seed", "day")
_LINEAGE = ("artifact", "kind", "parents", "created", "source_hash", "object", "session")


@dataclass(frozen=True, kw_only=True)
class Resolved:
    """The pairs of a query and those it refused."""

    table: PairTable
    refused: tuple[Refusal, ...]


@dataclass(frozen=True, kw_only=True)
class SideSize:
    """How much one side of a split holds: clips, recordings, and independent groups of recordings."""

    clips: int
    recordings: int
    groups: int


def side_sizes(
    lake: Lake, *, where: str | None, at: str | None, split_by: HashedSplit | ExplicitSplit
) -> dict[str, SideSize]:
    """Sizes of all sides; arguments as in `Source.sides`, which see for what it raises."""
    catalog = lake.scan(lake.view(at))
    everything = _clips(catalog, None, _ORIGIN)
    origins = origins_of(_lineage(catalog), everything)
    labels = dict(zip([origin.recording for origin in origins], groups(origins).tolist(), strict=True))
    chosen = _clips(catalog, where, _ORIGIN)
    recording_of = dict(zip(chosen["artifact"].to_pylist(), chosen["recording"].to_pylist(), strict=True))
    sizes: dict[str, SideSize] = {}
    for side in split_by.sides:
        clips_of_side = clips_on_side(catalog, side, split_by) & recording_of.keys()
        recordings = {recording_of[clip] for clip in clips_of_side}
        sizes[side] = SideSize(
            clips=len(clips_of_side),
            recordings=len(recordings),
            groups=len({labels[recording] for recording in recordings}),
        )
    return sizes


def resolve(
    lake: Lake,
    *,
    where: str | None,
    at: str | None,
    split: str | None,
    split_by: HashedSplit | ExplicitSplit,
    window: float | None,
    tolerance: Tolerance,
) -> Resolved:
    """Pairs of `lake` at one version; arguments as in `Source.pairs`, which see for what it raises."""
    if window is not None and not (math.isfinite(window) and window > 0):
        raise UsageError(f"the window of {window} s is not a positive length", fix="give a length above zero")
    catalog = lake.scan(lake.view(at))
    clips = _clips(catalog, where, COLUMNS)
    if not clips.num_rows:
        raise NotFoundError(
            "no clips match", where=where, fix="align recordings first, or widen the filter; flagdata query shows rows"
        )
    table = PairTable.of(clips, labels={} if isinstance(catalog, Scan) else labels_of(catalog))
    if split is not None:
        wanted = clips_on_side(catalog, split, split_by)
        table = table.take(np.isin(table.artifact, np.array(sorted(wanted), dtype=np.str_)))
        if len(table) in (0, clips.num_rows):
            check_divided(catalog, split, split_by, empty=not len(table), where=where)
    windows = _windows(clips, table)
    table = _with_window(lake, table, windows, _common(windows) if window is None else window)
    refused = judge(table, tolerance, superseded=superseded(_lineage(catalog), set(table.recording.tolist())))
    is_usable = np.array([k not in refused for k in range(len(table))], dtype=np.bool_)
    if not is_usable.any():
        first = next(iter(refused.values()))
        raise RefusedError(
            f"all {len(table)} pairs are outside the tolerance; the first: {'; '.join(first.reasons)}",
            where=f"clip {first.artifact}",
            fix="give a wider Tolerance, or improve the recording's wind log or clock",
        )
    return Resolved(table=table.take(is_usable), refused=tuple(refused.values()))


def _lineage(catalog: pa.Table | Scan) -> pa.Table:
    """Selects the columns that state where clips come from."""
    return catalog.table(_LINEAGE) if isinstance(catalog, Scan) else catalog


def _clips(catalog: pa.Table | Scan, where: Where | None, columns: tuple[str, ...]) -> pa.Table:
    of_clips = pc.field("kind") == Kind.CLIP.value  # not a part of the filter, which could undo it
    clips = catalog.matching(of_clips) if isinstance(catalog, Scan) else catalog.filter(of_clips)
    return Selection(clips, Request(where=where, columns=columns)).table()


def clips_on_side(catalog: pa.Table | Scan, split: str, split_by: HashedSplit | ExplicitSplit) -> set[str]:
    """Artifacts of all clips of a catalog that are on one side of the split.

    Raises:
        UnknownNameError: no such side.
        RefusedError: an explicit split that leaks.
    """
    check_side(split, split_by)
    if isinstance(split_by, ExplicitSplit):
        return set(explicit_sides(catalog, split_by)[split]["artifact"].to_pylist())
    return _hashed_side(catalog, split_by, split)


def check_divided(
    catalog: pa.Table | Scan, split: str, split_by: HashedSplit | ExplicitSplit, *, empty: bool, where: str | None
) -> None:
    """Warns where all clips of a catalog belong together, so that one side of a hashed split has all of them.

    Args:
        empty: whether the side that is wanted has none of the clips that are wanted.

    Raises:
        RefusedError: it has none.
    """
    clips = _clips(catalog, None, _ORIGIN)
    origins = origins_of(_lineage(catalog), clips)
    count = len(set(groups(origins).tolist()))
    if count == 1 and isinstance(split_by, HashedSplit):
        side = split_by.assign(origins)[0]
        grouping = f"all {len(clips)} clips belong together ({_shared(origins)}), and are on the side {side!r}"
        if not empty:
            _LOG.warning("warning: %s: the others are empty", grouping)
    else:
        grouping = f"the catalog has {count} independent groups"
    if empty:
        raise RefusedError(
            f"split {split!r} holds none of the clips; {grouping}",
            where=where,
            fix="record more days and sessions, or give an ExplicitSplit",
        )


def _shared(origins: Sequence[Origin]) -> str:
    """Says what connects recordings, in words."""
    common = set.intersection(*(set(origin.ties) for origin in origins))
    words = ("session", "day", "seed")
    named = sorted((tie for tie in common if tie.startswith(words)), key=lambda tie: words.index(tie.partition(" ")[0]))
    return named[0] if named else "by session, day or source"


def _hashed_side(catalog: pa.Table | Scan, split_by: HashedSplit, split: str) -> set[str]:
    """Clips of the side. Every clip of the catalog takes part, so that two filters never disagree about a group."""
    clips = _clips(catalog, None, _ORIGIN)
    origins = origins_of(_lineage(catalog), clips)
    sides = zip(origins, split_by.assign(origins), strict=True)
    recordings = pa.array([origin.recording for origin, side in sides if side == split], pa.string())
    return set(clips.filter(pc.field("recording").isin(recordings))["artifact"].to_pylist())


def explicit_sides(catalog: pa.Table | Scan, split_by: ExplicitSplit) -> dict[str, pa.Table]:
    """Maps each side to its clips: what `Origin` is made of. All sides are resolved and compared, whichever is wanted.

    Raises:
        RefusedError: two of them share a recording, a film, a mesh sequence, a seed, a session or a day.
    """
    taken = {side: _clips(catalog, where, _ORIGIN) for side, where in split_by.where.items()}
    lineage = _lineage(catalog)
    refuse_leaks({side: origins_of(lineage, clips) for side, clips in taken.items()})
    return taken


def _windows(clips: pa.Table, table: PairTable) -> FloatArray:
    """Reads the window (n,) of the catalog's ground truth of each pair [s], NaN where its recipe has none."""
    recipe = clips["recipe"].combine_chunks().dictionary_encode()
    first = np.unique(recipe.indices.fill_null(-1).to_numpy(zero_copy_only=False), return_index=True)
    owner = {int(number): clips["artifact"][int(row)].as_py() for number, row in zip(*first, strict=True)}
    windows_of_recipes = [
        column_json(text, "recipe", artifact=owner[number]).get("window", math.nan) if text else math.nan
        for number, text in enumerate(recipe.dictionary.to_pylist())
    ]
    windows = np.array([*windows_of_recipes, math.nan], dtype=np.float64)[recipe.indices.fill_null(-1).to_numpy()]
    row_of_pair = pc.index_in(pa.array(table.artifact), value_set=clips["artifact"])  # type: ignore[attr-defined]
    return windows[row_of_pair.to_numpy()]


def _common(windows: FloatArray) -> float:
    """Finds the one window of all pairs [s]; the usual one where no recipe states any.

    Raises:
        UsageError: several.
    """
    distinct = np.unique(windows[np.isfinite(windows)])
    if len(distinct) > 1:
        raise UsageError(
            f"the clips have ground truths over {', '.join(f'{window:g}' for window in distinct)} s",
            where="window",
            fix="name one: window=SECONDS; the others are then computed anew from the records' wind",
        )
    return float(distinct[0]) if len(distinct) else TRUTH_WINDOW


def _with_window(lake: Lake, table: PairTable, windows: FloatArray, window: float) -> PairTable:
    """Returns the table with ground truths over `window`; those of another window are computed anew from the record's
    wind."""
    to_compute = np.nonzero(windows != window)[0]
    if not len(to_compute):
        return table
    wind, sigma, coverage, staleness = (
        values.copy() for values in (table.wind, table.wind_sigma, table.coverage, table.staleness)
    )
    for number in np.unique(table.object[to_compute]):
        record = Record.open(lake.record_place(str(table.objects[number])))
        exact_speed = (record.truth or {}).get(TRUTH_SPEED)
        series = truth_series(record)
        for k in to_compute[table.object[to_compute] == number]:
            clock = float(table.clock_sigma[k])
            truth = clip_truth(
                series,
                int(table.end[k]),
                stated_speed=exact_speed,
                clock_sigma=None if math.isnan(clock) else clock,
                window=window,
            )
            wind[k], sigma[k], coverage[k], staleness[k] = truth.wind, truth.sigma, truth.coverage, truth.staleness
    return replace(table, wind=wind, wind_sigma=sigma, coverage=coverage, staleness=staleness)
