"""Typed, synchronized pairs of clips and ground truth, out of the lake.

    import flagdata
    from flagdata.dataset import Tolerance

    lake = flagdata.open("lake")
    good = Tolerance(coverage=0.9)
    pairs = lake.pairs("wind between 3 and 6", at="v1", split="train", tolerance=good)
    for batch in pairs.loader(32, workers=2):
        batch.clip, batch.wind, batch.wind_sigma

Names are imported when they are first used: cutting clips needs no torch.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from flagdata.dataset.cache import DecodedCache
    from flagdata.dataset.clips import clip_rows
    from flagdata.dataset.lake_source import Source
    from flagdata.dataset.loader import PairLoader
    from flagdata.dataset.pair_table import COLUMNS, PairTable
    from flagdata.dataset.pairs import Pairs
    from flagdata.dataset.sample import Batch, Sample, collate
    from flagdata.dataset.sides import SideSize
    from flagdata.dataset.splits import ExplicitSplit, HashedSplit
    from flagdata.dataset.tolerance import Refusal, Tolerance
    from flagdata.dataset.truth import TruthSeries, WindTruth

__all__ = [
    "Batch",
    "DecodedCache",
    "ExplicitSplit",
    "HashedSplit",
    "PairLoader",
    "Pairs",
    "Refusal",
    "Sample",
    "SideSize",
    "Source",
    "Tolerance",
    "TruthSeries",
    "WindTruth",
    "clip_rows",
    "collate",
]

__getattr__ = lazy_exports(__name__, __file__)
