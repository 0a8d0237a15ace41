"""A lake as a source of training data: what `flagdata.open` returns."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

from flagdata.core.arguments import check_arguments
from flagdata.core.extras import explaining_missing
from flagdata.core.html import table
from flagdata.lake import Lake
from flagdata.lake.catalog_rows import Rows
from flagdata.storage import Place

if TYPE_CHECKING:
    from flagdata.dataset.cache import DecodedCache
    from flagdata.dataset.pairs import Pairs
    from flagdata.dataset.sides import SideSize
    from flagdata.dataset.splits import ExplicitSplit, HashedSplit
    from flagdata.dataset.tolerance import Tolerance


class Source:
    """A lake as a source of rows and typed pairs.

    Attributes:
        lake: the lake itself, for rows, artifacts and refs.
    """

    def __init__(self, lake: Lake) -> None:
        self.lake = lake

    @classmethod
    @check_arguments
    def open(cls, path: Place | str) -> Source:
        """Opens the lake in the folder `path`, or at `s3://bucket/prefix`.

        Raises:
            NotFoundError: no lake there.
        """
        return cls(Lake.open(path))

    @check_arguments
    def query(
        self,
        where: str | Mapping[str, Any] | None = None,
        *,
        sql: str | None = None,
        columns: Sequence[str] | None = None,
        order: str | None = None,
        limit: int | None = None,
        at: str | None = None,
    ) -> Rows:
        """Rows of the catalog; arguments and errors as of `flagdata.query`."""
        from flagdata.lake.selection import select

        return Rows(
            select(self.lake, where, at=at, columns=columns, order=order, sql=sql, limit=limit)
        )

    @check_arguments
    def pairs(
        self,
        where: str | Mapping[str, Any] | None = None,
        *,
        at: str | None = None,
        split: str | None = None,
        split_by: HashedSplit | ExplicitSplit | None = None,
        window: float | None = None,
        tolerance: Tolerance | None = None,
        seed: int = 0,
        cache: DecodedCache | None = None,
    ) -> Pairs:
        """Clips with their ground truth, resolved now and for good: later commits change nothing in
        them.

        Args:
            where: a filter over the catalog's columns, as in `flagdata query --where`, or values
                that columns must have; `None` is every clip.
            at: tag, branch, version number or commit; `None` is the head of main.
            split: side of the split; `None` is all sides. The side that a data set states for a
                clip is its side.
            split_by: how clips that state no side are divided; `None` is `HashedSplit()`. Sides are
                decided over all clips of the version, before `where`, so that two filters never put
                one session, day or seed on two sides.
            window: length of the mean that is the ground truth [s]; other than the catalog's it is
                computed anew from the records' wind. `None` is the catalog's, which must then be
                one for all clips.
            tolerance: bounds beyond which a pair is refused; `None` is `Tolerance()`.
            seed: of the shuffled order.
            cache: where decoded clips are kept; `None` decodes each time.

        Raises:
            MissingExtraError: torch is not installed.
            NotFoundError: no such ref, or no clip matches.
            RefusedError: relatives are on two sides, some clips state a side and others none,
                `split_by` takes clips to another side than they state, the side is empty, or no
                pair is within the tolerance.
            UnknownNameError: no such column or side.
            UsageError: a filter that is not SQL, a window that is no length of time, clips of
                several windows where none is named, or a seed that is no whole number.
        """
        with explaining_missing():
            from flagdata.dataset.pairs import Pairs
        from flagdata.dataset.resolve import resolve
        from flagdata.dataset.tolerance import Tolerance

        resolved = resolve(
            self.lake,
            where=where,
            at=at,
            split=split,
            split_by=split_by,
            window=window,
            tolerance=tolerance or Tolerance(),
        )
        openers = self.lake.openers([str(name) for name in resolved.table.objects])
        return Pairs(
            resolved.table,
            openers=openers,
            refused=resolved.refused,
            at=at,
            seed=seed,
            cache=cache,
            split=split,
            split_by=resolved.split_by,
        )

    @check_arguments
    def sides(
        self,
        where: str | Mapping[str, Any] | None = None,
        *,
        at: str | None = None,
        split_by: HashedSplit | ExplicitSplit | None = None,
    ) -> dict[str, SideSize]:
        """Counts the clips, recordings and independent groups of each side of a split, before any
        tolerance.

        Whole groups go to one side, so that with few of them the shares can be far from the
        fractions asked for: look here before training.

        Args:
            where, at, split_by: as in `pairs`.

        Raises:
            RefusedError: the split, as in `pairs`.
            NotFoundError: no such ref.
            UnknownNameError: no such column.
            UsageError: a filter that is not SQL.
        """
        from flagdata.dataset.resolve import side_sizes

        return dict(side_sizes(self.lake, where=where, at=at, split_by=split_by))

    def __repr__(self) -> str:
        contents = ", ".join(f"{count} {kind}" for kind, count in self._counts().items()) or "empty"
        return f"Lake({self.lake.path}: {contents})"

    def _repr_html_(self) -> str:
        return table(
            f"Lake {self.lake.path}", {kind: str(count) for kind, count in self._counts().items()}
        )

    def _counts(self) -> dict[str, int]:
        """Counts the artifacts on main by name of their kind."""
        return dict(sorted(Counter(self.lake.rows(columns=["kind"])["kind"].to_pylist()).items()))


AnyLake: TypeAlias = Source | Lake | Place | str
"""A lake that is open, its folder, or its address `s3://bucket/prefix`."""


def open_source(lake: AnyLake) -> Source:
    """Opens a lake, whatever names it."""
    if isinstance(lake, Source):
        return lake
    return Source(lake) if isinstance(lake, Lake) else Source.open(lake)


def lake_of(lake: AnyLake | None) -> Lake | None:
    """Opens the lake that a verb was given; None where it was given none."""
    return None if lake is None else open_source(lake).lake
