"""From an experiment to the numbers of a verdict: fits beyond the linear, selection of effects,
validation.

It may import `measure.nulls` and what that may import. `measure.report` writes the sentences.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from measure.loop.corrective_field import Mode
    from measure.loop.effect_selection import GUST_COLUMN, LibraryJudgement, finalists, judge
    from measure.loop.run import LoopOptions, LoopOutcome, solve
    from measure.loop.set_up import HOIST
    from measure.loop.strength_estimates import estimate
    from measure.loop.validation import folds, paired_difference, total_error

__getattr__ = lazy_exports(__name__, __file__)
