"""The linear model of a segment's statistics: the random effect of a kind of numerics, least
squares beside it, scores.

It may import `measure.probes` and what that may import. It simulates nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from measure.inference.growth import power
    from measure.inference.random_effect import NullModel, Nulls
    from measure.inference.segment_evidence import CoefficientFit, Evidence, gains
    from measure.inference.whitened_misfit import WhitenedMisfit

__getattr__ = lazy_exports(__name__, __file__)
