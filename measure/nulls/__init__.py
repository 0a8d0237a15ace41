"""Simulated experiments without any effect: how they are made and kept, and what the tests'
statistics are in them.

It may import `measure.inference` and what that may import.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from measure.nulls.bank import evaluate
    from measure.nulls.clustered import ClusteredNulls
    from measure.nulls.conformal import GroupedConformal, kinds_needed
    from measure.nulls.null_groups import GUSTS
    from measure.nulls.null_plan import FEWEST_NULLS, NullOptions, batches
    from measure.nulls.null_simulation import SETTLE, NullBatch
    from measure.nulls.null_workload import of_recordings
    from measure.nulls.reference import NullBank, Reference
    from measure.nulls.stiffness import StiffnessFactors

__getattr__ = lazy_exports(__name__, __file__)
