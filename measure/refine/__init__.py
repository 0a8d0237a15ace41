"""Refinement by simulation: what cloth and wind, simulated and filmed as the target was, look like
it.

Runia et al. 2020, sections 3.2 and 6: simulate, render with fixed ζ, embed, compare, choose the
next θ. `refine` is this project's own procedure (`measure.refine.procedure`) over the paper's 17
parameters (`measure.refine.space`). The paper's own optimiser and others belong to the validation,
which runs them on the same evaluator (`measure.refine.evaluator`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from measure.refine.evaluator import Evaluator, fingerprint
    from measure.refine.metamodel import Metamodel
    from measure.refine.procedure import Settings, refine, squared_embedding_distance
    from measure.refine.refine_command import Clip, run
    from measure.refine.refinement import Refined, Refinement, Round
    from measure.refine.simulator import FilmRequest, Simulator
    from measure.refine.space import AREA_WEIGHT_COLUMN, QUANTITIES, WIND_COLUMN, Space
    from measure.refine.target import Target
    from measure.refine.target_view import DrawnView, FilmCamera, FixedView
    from measure.refine.trace import Trace

__getattr__ = lazy_exports(__name__, __file__)
