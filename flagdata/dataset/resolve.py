"""A query becomes pairs, in the parent process: rows, side of the split, ground truth of the
window, tolerance."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from flagdata.core.arrays import FloatArray
from flagdata.core.schema import TRUTH_WINDOW
from flagdata.dataset.clip_lineage import superseded_recordings
from flagdata.dataset.clips import TRUTH_SPEED, clip_truth, truth_series
from flagdata.dataset.pair_table import COLUMNS, PairTable
from flagdata.dataset.sides import SideSize, SplitBy, clips_of, divide, lineage_of
from flagdata.dataset.tagged import hashed_split
from flagdata.dataset.tolerance import Refusal, Tolerance, judge
from flagdata.errors import NotFoundError, RefusedError, UsageError
from flagdata.lake import Lake
from flagdata.lake.lineage import labels_of
from flagdata.lake.matching import Where
from flagdata.lake.rowfiles import Scan
from flagdata.recipes.documents import column_json
from flagdata.record import Record


@dataclass(frozen=True, kw_only=True)
class Resolved:
    """The pairs of a query and those it refused.

    Attributes:
        split_by: how sides were decided, see `Division.statement`; `None` where none was asked for.
    """

    table: PairTable
    refused: tuple[Refusal, ...]
    split_by: Mapping[str, Any] | None


def side_sizes(
    lake: Lake, *, where: Where | None, at: str | None, split_by: SplitBy | None
) -> Mapping[str, SideSize]:
    """Sizes of all sides; arguments as in `Source.sides`, which see for what it raises."""
    catalog = lake.scan(lake.view(at))
    return divide(catalog, clips_of(catalog, where), split_by, hashed=hashed_split(lake, at)).sizes


def resolve(
    lake: Lake,
    *,
    where: Where | None,
    at: str | None,
    split: str | None,
    split_by: SplitBy | None,
    window: float | None,
    tolerance: Tolerance,
) -> Resolved:
    """Pairs of `lake` at one version; arguments as in `Source.pairs`, which see for what it
    raises."""
    if window is not None and not (math.isfinite(window) and window > 0):
        raise UsageError(
            f"the window of {window} s is not a positive length", fix="give a length above zero"
        )
    catalog = lake.scan(lake.view(at))
    clips = clips_of(catalog, where, (*COLUMNS, "kind", "dataset", "side"))
    if not clips.num_rows:
        raise NotFoundError(
            "no clips match",
            where=_words(where),
            fix="align recordings first, or widen the filter; flagdata query shows rows",
        )
    table = PairTable.of(clips, labels={} if isinstance(catalog, Scan) else labels_of(catalog))
    statement = None
    if split is not None:
        division = divide(catalog, clips, split_by, hashed=hashed_split(lake, at))
        wanted = division.on(split)
        if not wanted:
            raise RefusedError(
                f"split {split!r} holds none of the clips; {division.grouping}",
                where=_words(where),
                fix="choose another side, record more days and sessions, or give an ExplicitSplit",
            )
        if len(wanted) == clips.num_rows:
            division.warn_whole()
        table = table.take(np.isin(table.artifact, np.array(sorted(wanted), dtype=np.str_)))
        statement = division.statement
    windows = _windows(clips, table)
    table = _with_window(lake, table, windows, _common(windows) if window is None else window)
    refused = judge(
        table,
        tolerance,
        superseded=superseded_recordings(lineage_of(catalog), set(table.recording.tolist())),
    )
    is_usable = np.array([k not in refused for k in range(len(table))], dtype=np.bool_)
    if not is_usable.any():
        first = next(iter(refused.values()))
        raise RefusedError(
            f"all {len(table)} pairs are outside the tolerance; the first: "
            f"{'; '.join(first.reasons)}",
            where=f"clip {first.artifact}",
            fix="give a wider Tolerance, or improve the recording's wind log or clock",
        )
    return Resolved(
        table=table.take(is_usable), refused=tuple(refused.values()), split_by=statement
    )


def _words(where: Where | None) -> str | None:
    """Says what was filtered by."""
    return where if where is None or isinstance(where, str) else str(dict(where))


def _windows(clips: pa.Table, table: PairTable) -> FloatArray:
    """Reads the window (n,) of the catalog's ground truth of each pair [s], NaN where its recipe
    has none."""
    recipe = clips["recipe"].combine_chunks().dictionary_encode()
    first = np.unique(
        recipe.indices.fill_null(-1).to_numpy(zero_copy_only=False), return_index=True
    )
    owner = {
        int(number): clips["artifact"][int(row)].as_py() for number, row in zip(*first, strict=True)
    }
    windows_of_recipes = [
        column_json(text, "recipe", artifact=owner[number]).get("window", math.nan)
        if text
        else math.nan
        for number, text in enumerate(recipe.dictionary.to_pylist())
    ]
    windows = np.array([*windows_of_recipes, math.nan], dtype=np.float64)[
        recipe.indices.fill_null(-1).to_numpy()
    ]
    row_of_pair = pc.index_in(  # type: ignore[attr-defined]
        pa.array(table.artifact), value_set=clips["artifact"]
    )
    return windows[row_of_pair.to_numpy()]


def _common(windows: FloatArray) -> float:
    """Finds the one window of all pairs [s]; the usual one where no recipe states any.

    Raises:
        UsageError: several.
    """
    distinct = np.unique(windows[np.isfinite(windows)])
    if len(distinct) > 1:
        raise UsageError(
            f"the clips have ground truths over {', '.join(f'{window:g}' for window in distinct)} "
            "s",
            where="window",
            fix="name one: window=SECONDS; the others are then computed anew from the records' "
            "wind",
        )
    return float(distinct[0]) if len(distinct) else TRUTH_WINDOW


def _with_window(lake: Lake, table: PairTable, windows: FloatArray, window: float) -> PairTable:
    """Returns the table with ground truths over `window`; those of another window are computed anew
    from the record's wind."""
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
            wind[k], sigma[k], coverage[k], staleness[k] = (
                truth.wind,
                truth.sigma,
                truth.coverage,
                truth.staleness,
            )
    return replace(table, wind=wind, wind_sigma=sigma, coverage=coverage, staleness=staleness)
