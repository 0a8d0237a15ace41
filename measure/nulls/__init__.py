"""Simulated experiments without any effect: how they are made and kept, and what the tests' statistics are in them.

It may import `measure.inference` and what that may import.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.lazy import lazy_exports

if TYPE_CHECKING:
    from measure.nulls.bank import evaluate
    from measure.nulls.clustered import ClusteredNulls
    from measure.nulls.conformal import GroupedConformal, kinds_needed
    from measure.nulls.plan import FEWEST_NULLS, NullOptions, batches
    from measure.nulls.reference import GUSTS, NullBank, Reference
    from measure.nulls.simulation import SETTLE, NullBatch
    from measure.nulls.stiffness import StiffnessFactors
    from measure.nulls.workload import of_recordings

__getattr__ = lazy_exports(__name__, __file__)
