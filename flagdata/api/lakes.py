"""A lake from Python: opened, its pairs taken."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from flagdata.core.arguments import check_arguments
from flagdata.dataset.lake_source import AnyLake, Source, open_source
from flagdata.storage import Place

if TYPE_CHECKING:
    from flagdata.dataset.cache import DecodedCache
    from flagdata.dataset.pairs import Pairs
    from flagdata.dataset.splits import ExplicitSplit, HashedSplit
    from flagdata.dataset.tolerance import Tolerance


@check_arguments
def open(path: Place | str) -> Source:  # noqa: A001  read as flagdata.open
    """The lake in the folder `path`, or at `s3://bucket/prefix`.

    ```python
    lake = flagdata.open("field.lake")
    lake.query("kind = 'clip' and wind > 3")
    lake.pairs(at="v1").loader(32)
    ```

    Args:
        path: of the lake.

    Returns:
        The lake as a source of rows and typed pairs; its attribute `lake` is the lake itself.

    Raises:
        NotFoundError: no lake there.
    """
    return Source.open(path)


@check_arguments
def pairs(
    lake: AnyLake,
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
    """Clips of a lake with their ground truth, for training: typed, split without leaks, the same
    at the same tag.

    ```python
    for batch in flagdata.pairs("field.lake", at="v1", split="train").loader(32, workers=2):
        batch.clip, batch.wind, batch.wind_sigma  # (n, 1, 30, h, w) uint8, (n,) m/s, (n,) m/s
    ```

    Args:
        lake: an open lake, or where it is.
        window: length of the mean that is the ground truth [s].
        where, at, split, split_by, tolerance, seed, cache: as for `Source.pairs`.

    Raises:
        MissingExtraError: torch is not installed.
        NotFoundError: no such lake or version, or no clip matches.
        RefusedError: the split, see `Source.pairs`; the side is empty, or no pair is within the
            tolerance.
        UnknownNameError: no such column or side.
        UsageError: a filter that is not SQL, or a window that is no length of time.
    """
    return open_source(lake).pairs(
        where,
        at=at,
        split=split,
        split_by=split_by,
        window=window,
        tolerance=tolerance,
        seed=seed,
        cache=cache,
    )
