"""Which of the rows that a filter finds are exported: one side of a split, one alignment of a pair of files."""

from __future__ import annotations

from collections import Counter

import pyarrow as pa
import pyarrow.compute as pc

from flagdata.dataset.lineage import superseded
from flagdata.dataset.resolve import clips_on_side
from flagdata.dataset.splits import HashedSplit
from flagdata.errors import UsageError
from flagdata.schema import Kind


def on_side(catalog: pa.Table, rows: pa.Table, split: str, *, salt: str) -> pa.Table:
    """The rows on one side: clips, and recordings by their clips. Sides are decided over all clips of the version, so
    that two exports of one version never put a session, day, seed or camera file on two sides.

    Raises:
        UnknownNameError: no such side.
        UsageError: rows of another kind, which are on no side.
    """
    check_kinds(rows, "a split", frozenset({Kind.CLIP, Kind.RECORDING}))
    clips = clips_on_side(catalog, split, HashedSplit(salt=salt))
    of_clips = catalog.filter(_is_one_of(clips))["recording"].drop_null().to_pylist()
    return rows.filter(_is_one_of({*clips, *of_clips}))


def current(catalog: pa.Table, rows: pa.Table) -> tuple[pa.Table, dict[str, str]]:
    """The rows without recordings that another among them replaces, and without the clips of those: two alignments of
    one camera and wind log would hold every picture twice. Also: recording left out → the later one."""
    recordings = rows.filter(pc.field("kind") == Kind.RECORDING.value)["artifact"].to_pylist()
    replaced = superseded(catalog, {*recordings, *rows["recording"].drop_null().to_pylist()})
    if not replaced:
        return rows, {}
    old = set(replaced)
    kept = ~_is_one_of(old) & (pc.field("recording").is_null() | ~_is_one_of(old, column="recording"))
    return rows.filter(kept), dict(sorted(replaced.items()))


def _is_one_of(artifacts: set[str], *, column: str = "artifact") -> pc.Expression:
    return pc.field(column).isin(pa.array(sorted(artifacts), pa.string()))


def check_kinds(rows: pa.Table, name: str, kinds: frozenset[Kind]) -> None:
    """Raises:
    UsageError: rows of a kind that is not among `kinds`.
    """
    others = Counter(kind for kind in rows["kind"].to_pylist() if kind not in kinds)
    if others:
        found = ", ".join(f"{count} of kind {kind}" for kind, count in sorted(others.items()))
        held = ", ".join(f"'{kind}'" for kind in sorted(kinds))
        fix = f'choose what it holds: --where "kind in ({held})", with your filter'
        raise UsageError(f"{name} cannot hold {found}", where="--where", fix=fix)
