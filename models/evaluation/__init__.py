"""Every score of a trained model from what it said of clips it never saw, and the report of all
models side by side."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from models.evaluation.bootstrap import Resamples, estimate
    from models.evaluation.predictions import Predictions
    from models.evaluation.predictive_calibration import LEVELS, coverage, rank_histogram, tarp
    from models.evaluation.scores import SCORES

__getattr__ = lazy_exports(__name__, __file__)
